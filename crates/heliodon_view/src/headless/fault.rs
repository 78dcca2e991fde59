//! What goes wrong on the GPU, told to whoever steps an app without a window.
//!
//! Bevy's own handler logs such an error, asks the app to end, and draws nothing from the next frame on (`error_handler.rs` of
//! bevy_render 0.19). Whoever steps an app by hand would take the frame at hand, and all that follow, for drawn. The listener
//! here takes the place of Bevy's, and is asked after each step.

use bevy::app::PluginsState;
use bevy::prelude::*;
use bevy::render::renderer::RenderDevice;

/// The first thing that went wrong.
#[derive(Resource, Clone, Debug, Default)]
pub(crate) struct DeviceFault(heliodon_gpu::DeviceFault);

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
            fault.0.listen(device.wgpu_device());
        }
        fault
    }

    /// What went wrong so far, if anything.
    pub(crate) fn first(&self) -> Option<String> {
        self.0.first()
    }
}
