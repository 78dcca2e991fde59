//! What the render world is told about a frame.

use super::feed::Feed;
use crate::tonemap::ToneCurve;
use bevy::image::Image;
use bevy::prelude::{AssetId, Resource};
use bevy::render::extract_resource::ExtractResource;
use glam::Vec3;
use heliodon_bundle::moment::Moment;
use std::sync::Arc;

/// The frame's light and what it is drawn with; the same for all cameras.
#[derive(Resource, Clone, Debug, Default, ExtractResource)]
pub struct StageFrame {
    /// Where the stone comes from.
    pub feed: Option<Arc<Feed>>,
    /// The light of the moment, once a bundle is open.
    pub moment: Option<Arc<Moment>>,
    /// Exposure in stops.
    pub exposure_stops: f32,
    /// The tone curve.
    pub curve: ToneCurve,
    /// Whether details are switched off.
    pub without_details: bool,
    /// Whether what no photograph saw is shown in blue, where a bundle tells that of its parts.
    pub shows_guessed: bool,
    /// The dome.
    pub sky: SkyFrame,
}

/// The dome of a frame.
#[derive(Clone, Debug, Default)]
pub struct SkyFrame {
    /// Two maps and their weights; a map without weight is not read.
    pub maps: [(Option<AssetId<Image>>, f32); 2],
    /// Unit direction to the sun.
    pub sun_direction: Vec3,
    /// Radiance of the sun's disc where the maps leave it out, else zero.
    pub disc_radiance: Vec3,
}
