//! A capture before it is made: one frame of one view at a time, while somebody places the model in it.

use super::fit::{Framing, window};
use super::view::{Viewed, draw_one};
use super::{CaptureError, CaptureParams, Fitted, prepare};
use glam::Vec3;
use heliodon_bundle::impostor::ImpostorInfo;
use heliodon_mesh::albedo::MeshAlbedo;
use heliodon_mesh::motion::MovingMesh;

/// A model that is to be captured.
pub struct Preview {
    model: MovingMesh,
    params: CaptureParams,
    fitted: Fitted,
    axes: Vec<[Vec3; 3]>,
}

/// A frame as it would be captured, on its finest level; rows from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct PreviewFrame {
    /// Texels along its sides.
    pub size: [u32; 2],
    /// Square roots of linear albedo, and cover, 0 to 255.
    pub looks: Vec<[u8; 4]>,
}

impl Preview {
    /// Poses a model in all its frames.
    ///
    /// # Errors
    /// As [`super::capture`], but for how the model is framed: that may be mended here.
    pub fn new(model: MovingMesh, name: &str, params: CaptureParams) -> Result<Self, CaptureError> {
        let fitted = prepare(&model, name, &params)?;
        let axes = fitted.plan.info.view_axes().collect();
        Ok(Self { model, params, fitted, axes })
    }

    /// What would be captured.
    #[must_use]
    pub fn info(&self) -> &ImpostorInfo {
        &self.fitted.plan.info
    }

    /// With what parameters.
    #[must_use]
    pub fn params(&self) -> &CaptureParams {
        &self.params
    }

    /// The model.
    #[must_use]
    pub fn model(&self) -> &MovingMesh {
        &self.model
    }

    /// Places the model in its frames.
    pub fn set_framing(&mut self, framing: Framing) {
        self.params.framing = framing;
        let Fitted { plan, shown, .. } = &mut self.fitted;
        let px = plan.info.frame_px;
        plan.info.windows_m = shown.iter().map(|shown| framing.apply(window(shown, px))).collect();
    }

    /// The view in which the model comes nearest to the border, over all frames, and how near, texels: below 0 it is cut.
    #[must_use]
    pub fn nearest_border(&self) -> (usize, f32) {
        self.fitted.nearest_border()
    }

    /// Whether it can be captured as it is framed.
    #[must_use]
    pub fn is_whole(&self) -> bool {
        self.fitted.check_framing().is_ok()
    }

    /// The part of a frame that the box around the model in a view takes.
    ///
    /// # Panics
    /// If there is no such view.
    #[must_use]
    pub fn used(&self, view: usize) -> f32 {
        let [left, bottom, right, top] = self.info().windows_m[view];
        let size = self.fitted.shown[view][1] - self.fitted.shown[view][0];
        size.x * size.y / ((right - left) * (top - bottom))
    }

    /// A frame of a view.
    ///
    /// # Panics
    /// If there is no such view or frame.
    #[must_use]
    pub fn frame(&self, view: usize, frame: usize) -> PreviewFrame {
        let (info, rest) = (self.info(), self.model.rest());
        let albedo = MeshAlbedo::new(rest, 0.5 * self.params.distance_m / self.params.px_per_radian);
        let viewed = Viewed { info, axes: &self.axes[view], window: &info.windows_m[view], samples: self.params.samples };
        let level = draw_one(rest, &albedo, &self.fitted.poses, frame, &viewed);
        let [looks, _] = level.texels;
        PreviewFrame { size: level.size, looks }
    }
}
