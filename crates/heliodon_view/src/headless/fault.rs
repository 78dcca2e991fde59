//! What goes wrong on the GPU, told to whoever steps an app without a window.
//!
//! Bevy's own handler logs such an error, asks the app to end, and draws nothing from the next frame on (`error_handler.rs` of
//! bevy_render 0.19). Whoever steps an app by hand would take the frame at hand, and all that follow, for drawn. The listener
//! here takes the place of Bevy's, and is asked after each step.

use bevy::app::PluginsState;
use bevy::prelude::*;
use bevy::render::renderer::RenderDevice;
use std::sync::{Arc, Mutex, PoisonError};

/// The first thing that went wrong.
#[derive(Resource, Clone, Debug, Default)]
pub(crate) struct DeviceFault(Arc<Mutex<Option<String>>>);

impl DeviceFault {
    /// Makes `app` ready to be stepped or run, and listens to its device from then on.
    pub(crate) fn start(app: &mut App) -> Self {
        while app.plugins_state() == PluginsState::Adding {
            // The renderer is asked for in the background.
            bevy::tasks::tick_global_task_pools_on_main_thread();
        }
        app.finish();
        app.cleanup();
        let fault = Self::default();
        if let Some(device) = app.world().get_resource::<RenderDevice>() {
            let device = device.wgpu_device();
            let told = fault.clone();
            device.on_uncaptured_error(Arc::new(move |error| told.tell(describe(&error))));
            let told = fault.clone();
            device.set_device_lost_callback(move |_, why| told.tell(format!("the device was lost: {why}")));
        }
        fault
    }

    /// Only the first is kept: it often causes the others.
    fn tell(&self, what: String) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(what);
    }

    /// What went wrong so far, if anything.
    pub(crate) fn first(&self) -> Option<String> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

fn describe(error: &wgpu::Error) -> String {
    match error {
        wgpu::Error::OutOfMemory { .. } => "out of memory; a smaller picture, or fewer samples a pixel, need less".to_owned(),
        other => other.to_string(),
    }
}
