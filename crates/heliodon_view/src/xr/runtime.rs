//! The OpenXR runtime: asked for a headset before there is an app, and then made its renderer.
//!
//! After `OxrInitPlugin` of bevy_mod_openxr 0.6, which logs what fails and goes on without a headset: its public systems are used, what they do in the app
//! is the same.

use super::run::HeadsetError;
use bevy::prelude::*;
use bevy::render::extract_resource::ExtractResourcePlugin;
use bevy::render::renderer::{RenderAdapter, RenderAdapterInfo, RenderInstance, RenderQueue, WgpuWrapper};
use bevy::render::settings::RenderCreation;
use bevy::render::{ExtractSchedule, Render, RenderApp};
use bevy_mod_openxr::environment_blend_mode::OxrEnvironmentBlendModes;
use bevy_mod_openxr::error::OxrError;
use bevy_mod_openxr::exts::{OxrEnabledExtensions, OxrExtensions};
use bevy_mod_openxr::init;
use bevy_mod_openxr::poll_events::OxrEventHandlerExt;
use bevy_mod_openxr::resources::{
    OxrEntry, OxrInstance, OxrSessionConfig, OxrSessionStarted, OxrSystemId, SessionGraphicsCreateInfo,
};
use bevy_mod_openxr::session::{OxrSession, OxrSessionCreateNextChain};
use bevy_mod_openxr::types::{AppInfo, Version, WgpuGraphics};
use bevy_mod_xr::session::{
    XrBeginSessionMessage, XrCreateSessionMessage, XrDestroySessionMessage, XrDestroySessionRender, XrEndSessionMessage,
    XrFirst, XrHandleEvents, XrRequestExitMessage, XrSessionCreated, XrSessionCreatedMessage, XrSessionDestroyedMessage,
    XrState, XrStateChanged, session_created, state_equals,
};
use openxr::sys;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use wgpu::TextureFormat;

/// A runtime with a headset.
pub(super) struct Runtime {
    /// The runtime's name and version.
    pub name: String,
    /// The headset's name.
    pub system: String,
    instance: OxrInstance,
    system_id: openxr::SystemId,
    extensions: OxrExtensions,
    graphics: SessionGraphicsCreateInfo,
}

/// Looks for the loader where the system keeps libraries, first by the name that it has where only the library is installed: the one without a number
/// comes with what programs are built with.
#[expect(unsafe_code, reason = "a library is loaded, whose functions are then trusted; all of it is in this function")]
pub(super) fn entry() -> Result<OxrEntry, openxr::LoadError> {
    // SAFETY: what is loaded is OpenXR's own loader, by its name, from the library search path. Whoever can put another there can change any library of
    // the program.
    let (numbered, usual) = unsafe { (openxr::Entry::load_from(Path::new("libopenxr_loader.so.1")), openxr::Entry::load()) };
    numbered.or(usual).map(OxrEntry)
}

impl Runtime {
    /// Finds the runtime and its headset, and the device that draws for it.
    pub(super) fn open() -> Result<(Self, RenderCreation), HeadsetError> {
        let entry = entry().map_err(|why| HeadsetError::NoLoader(why.to_string()))?;
        let available = entry.enumerate_extensions().map_err(|why| HeadsetError::NoRuntime(told(&why)))?;
        let backends = entry.available_backends().map_err(|why| HeadsetError::NoRuntime(told(&why)))?;
        let Some(&backend) = backends.first() else {
            return Err(HeadsetError::NoRuntime("it does not take pictures of Vulkan (XR_KHR_vulkan_enable2)".to_owned()));
        };
        let mut wanted = OxrExtensions::default();
        wanted.raw_mut().ext_local_floor = true;
        let extensions = wanted & available;
        let info = AppInfo { name: "Heliodon".into(), version: Version(0, 1, 0) };
        let instance =
            entry.create_instance(info, extensions.clone(), &[], backend).map_err(|why| HeadsetError::NoRuntime(told(&why)))?;
        let name = match instance.properties() {
            Ok(properties) => format!("{} {}", properties.runtime_name, properties.runtime_version),
            Err(_) => "OpenXR runtime".to_owned(),
        };
        let no_headset = |why: sys::Result| HeadsetError::NoHeadset { runtime: name.clone(), why: why.to_string() };
        let system_id = instance.system(openxr::FormFactor::HEAD_MOUNTED_DISPLAY).map_err(no_headset)?;
        let system = instance.system_properties(system_id).map(|of| of.system_name).unwrap_or_default();
        let (WgpuGraphics(device, queue, adapter_info, adapter, wgpu_instance), graphics) = instance
            .init_graphics(system_id, None)
            .map_err(|why| HeadsetError::Graphics { runtime: name.clone(), why: told(&why) })?;
        let render = RenderCreation::manual(
            device.into(),
            RenderQueue(Arc::new(WgpuWrapper::new(queue))),
            RenderAdapterInfo(WgpuWrapper::new(adapter_info)),
            RenderAdapter(Arc::new(WgpuWrapper::new(adapter))),
            RenderInstance(Arc::new(WgpuWrapper::new(wgpu_instance))),
        );
        Ok((Self { name, system, instance, system_id, extensions, graphics }, render))
    }

    /// Lets the app, which has its renderer and `XrSessionPlugin`, open a session when it begins.
    pub(super) fn install(self, app: &mut App) {
        app.insert_resource(OxrEnabledExtensions(self.extensions))
            .insert_resource(OxrSessionConfig {
                // The last that the runtime has: pictures are display values, which sRGB formats encode on writing.
                formats: Some(vec![TextureFormat::Bgra8UnormSrgb, TextureFormat::Rgba8UnormSrgb]),
                ..default()
            })
            .add_plugins((
                ExtractResourcePlugin::<OxrSessionStarted>::default(),
                ExtractResourcePlugin::<OxrEnvironmentBlendModes>::default(),
            ))
            .add_oxr_event_handler(init::handle_events)
            .add_systems(
                XrFirst,
                (
                    create_session.run_if(state_equals(XrState::Available)).run_if(on_message::<XrCreateSessionMessage>),
                    (init::destroy_xr_session, destroy_in_render_world)
                        .chain()
                        .run_if(is_exiting)
                        .run_if(on_message::<XrDestroySessionMessage>),
                    init::begin_xr_session.run_if(state_equals(XrState::Ready)).run_if(on_message::<XrBeginSessionMessage>),
                    init::end_xr_session.run_if(state_equals(XrState::Stopping)).run_if(on_message::<XrEndSessionMessage>),
                    request_exit.run_if(session_created).run_if(on_message::<XrRequestExitMessage>),
                    tell_destroyed,
                )
                    .in_set(XrHandleEvents::SessionStateUpdateEvents),
            )
            .insert_resource(self.instance.clone())
            .insert_resource(OxrSystemId(self.system_id))
            .insert_resource(XrState::Available)
            .insert_resource(OxrSessionStarted(false))
            .insert_non_send(self.graphics)
            .init_non_send::<OxrSessionCreateNextChain>();
        app.world_mut().write_message(XrStateChanged(XrState::Available));
        app.sub_app_mut(RenderApp)
            .add_systems(ExtractSchedule, init::transfer_xr_resources)
            .add_systems(Render, (init::destroy_xr_session, tell_destroyed_in_render_world).chain().run_if(is_to_be_destroyed))
            .insert_resource(self.instance)
            .insert_resource(OxrSystemId(self.system_id))
            .insert_resource(XrState::Available)
            .insert_resource(OxrSessionStarted(false));
    }
}

/// bevy_mod_openxr runs what is to follow even if no session could be made, and there all of it panics. Here nothing follows, and watch.rs tells it.
fn create_session(world: &mut World) {
    let follows = world.resource_mut::<Schedules>().insert(Schedule::new(XrSessionCreated));
    init::create_xr_session(world);
    if let Some(follows) = follows {
        world.resource_mut::<Schedules>().insert(follows);
    }
    if world.contains_resource::<OxrSession>() {
        world.run_schedule(XrSessionCreated);
    } else {
        world.resource_mut::<Messages<XrSessionCreatedMessage>>().clear();
    }
}

/// The innermost of what went wrong, for people.
fn told(why: &OxrError) -> String {
    match why {
        OxrError::OpenXrError(result) => result.to_string(),
        other => other.to_string(),
    }
}

fn is_exiting(state: Option<Res<XrState>>) -> bool {
    matches!(state.as_deref(), Some(XrState::Exiting { .. }))
}

/// A session may end between two frames.
fn request_exit(session: Option<Res<OxrSession>>) {
    if let Some(Err(why)) = session.map(|session| session.request_exit()) {
        warn!("the headset's session does not end: {why}");
    }
}

fn destroy_in_render_world(destroy: Res<XrDestroySessionRender>) {
    destroy.0.store(true, Ordering::Relaxed);
}

fn is_to_be_destroyed(destroy: Option<Res<XrDestroySessionRender>>) -> bool {
    destroy.is_some_and(|destroy| destroy.0.load(Ordering::Relaxed))
}

fn tell_destroyed_in_render_world(destroy: Res<XrDestroySessionRender>, mut commands: Commands) {
    destroy.0.store(false, Ordering::Relaxed);
    commands.insert_resource(XrState::Available);
}

fn tell_destroyed(
    destroy: Res<XrDestroySessionRender>,
    mut before: Local<bool>,
    mut destroyed: MessageWriter<XrSessionDestroyedMessage>,
    mut commands: Commands,
) {
    let now = destroy.0.load(Ordering::Relaxed);
    if std::mem::replace(&mut *before, now) && !now {
        destroyed.write_default();
        commands.insert_resource(XrState::Available);
    }
}
