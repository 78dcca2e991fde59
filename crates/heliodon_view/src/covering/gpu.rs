//! What is worn, in the render world: a table of parts for those who draw stone, and one uniform for all shaders.

use super::uniform::{COVERS_BYTES, CoverUniform, CoversHead};
use bevy::prelude::*;
use bevy::render::extract_resource::ExtractResource;
use bevy::render::render_resource::{Buffer, BufferDescriptor, BufferUsages};
use bevy::render::renderer::{RenderDevice, RenderQueue};
use std::sync::Arc;

/// What of a part or an actor whoever draws it must know.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Worn {
    /// Where in the uniform it is; 0 where it wears nothing.
    pub slot: u32,
    /// How much of it is there.
    pub sight: Sight,
    /// Whether it is outlined.
    pub marked: bool,
    /// What an item buffer takes for its albedo, where that is all that is changed.
    pub coat: Option<Coat>,
}

impl Worn {
    /// Nothing.
    pub const NOTHING: Self = Self { slot: 0, sight: Sight::Whole, marked: false, coat: None };

    /// Whether a picture that knows no more than albedo can show it.
    fn is_settled(&self) -> bool {
        self.slot == 0 || self.sight == Sight::Hidden || (self.sight == Sight::Whole && !self.marked && self.coat.is_some())
    }
}

impl Default for Worn {
    fn default() -> Self {
        Self::NOTHING
    }
}

/// How much of something is there.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sight {
    /// All of it.
    #[default]
    Whole,
    /// More than half, so that it casts shadows.
    Most,
    /// Less.
    Little,
    /// Nothing.
    Hidden,
}

impl Sight {
    /// Of an opacity.
    #[must_use]
    pub fn of(opacity: f32) -> Self {
        match opacity {
            1.0.. => Self::Whole,
            0.5.. => Self::Most,
            o if o > 0.0 => Self::Little,
            _ => Self::Hidden,
        }
    }

    /// Whether it casts shadows where those are all or nothing.
    #[must_use]
    pub fn casts(self) -> bool {
        matches!(self, Self::Whole | Self::Most)
    }
}

/// An albedo in place of another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coat {
    /// Its albedo.
    pub albedo: Vec3,
    /// How much of the other's shades stays.
    pub grain: f32,
    /// The other's mean luminance.
    pub mean: f32,
}

/// Luminance of linear Rec. 709.
#[must_use]
pub fn luminance(color: Vec3) -> f32 {
    color.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}

impl Coat {
    /// Over an albedo, as `cover_coated` of cover.wgsl says.
    #[must_use]
    pub fn over(&self, own: Vec3) -> Vec3 {
        let shade = luminance(own) / self.mean.max(1e-3);
        (self.albedo * (1.0 + (shade - 1.0) * self.grain)).min(Vec3::ONE)
    }
}

/// What is worn in a frame.
#[derive(Resource, Clone, Debug, Default, ExtractResource)]
pub struct CoversFrame {
    /// The uniform's beginning.
    pub head: CoversHead,
    /// What is in its slots, from the first on.
    pub slots: Arc<[CoverUniform]>,
    /// Of each part of the bundle what it wears; none where no part wears anything.
    pub parts: Arc<[Worn]>,
    /// Actors that wear anything: whether one has a texture, and one has none.
    pub actors: [bool; 2],
    /// Changes with [`Self::parts`].
    pub serial: u64,
}

/// Render world: what is worn.
#[derive(Resource, Default)]
pub struct CoversGpu {
    buffer: Option<Buffer>,
    frame: CoversFrame,
}

impl CoversGpu {
    /// What all views bind beside their own uniform, from the first frame on.
    #[must_use]
    pub fn buffer(&self) -> Option<&Buffer> {
        self.buffer.as_ref()
    }

    /// Whether anything is worn.
    #[must_use]
    pub fn any(&self) -> bool {
        !self.frame.slots.is_empty()
    }

    /// What a part wears.
    #[must_use]
    pub fn part(&self, part: u16) -> Worn {
        self.frame.parts.get(usize::from(part)).copied().unwrap_or_default()
    }

    /// What all parts wear.
    #[must_use]
    pub fn parts(&self) -> &[Worn] {
        &self.frame.parts
    }

    /// Whether actors without a texture wear anything, and those with one.
    #[must_use]
    pub fn actors(&self) -> [bool; 2] {
        self.frame.actors
    }

    /// Changes with what is hidden, faded, or of another colour for good; not while a material spreads.
    #[must_use]
    pub fn serial(&self) -> u64 {
        self.frame.serial
    }

    /// Whether some part can be seen through: then what is behind it is not hidden.
    #[must_use]
    pub fn any_faded(&self) -> bool {
        self.frame.parts.iter().any(|worn| matches!(worn.sight, Sight::Most | Sight::Little))
    }

    /// Whether all that parts wear is colour, so that item buffers can show it.
    #[must_use]
    pub fn is_settled(&self) -> bool {
        self.frame.parts.iter().all(Worn::is_settled)
    }

    /// Whether anything is outlined.
    #[must_use]
    pub fn any_marked(&self) -> bool {
        self.frame.parts.iter().any(|worn| worn.marked)
    }
}

/// Takes what is worn to the GPU.
pub fn prepare(frame: Res<CoversFrame>, mut gpu: ResMut<CoversGpu>, device: Res<RenderDevice>, queue: Res<RenderQueue>) {
    let gpu = &mut *gpu;
    gpu.frame = frame.clone();
    let buffer = gpu.buffer.get_or_insert_with(|| {
        device.create_buffer(&BufferDescriptor {
            label: Some("covers"),
            size: COVERS_BYTES as u64,
            usage: BufferUsages::UNIFORM | BufferUsages::COPY_DST,
            mapped_at_creation: false,
        })
    });
    if !frame.slots.is_empty() {
        queue.write_buffer(buffer, 0, bytemuck::bytes_of(&frame.head));
        queue.write_buffer(buffer, size_of::<CoversHead>() as u64, bytemuck::cast_slice(&frame.slots));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grain_keeps_the_shades_of_what_is_covered() {
        let own = [Vec3::new(0.2, 0.3, 0.1), Vec3::new(0.5, 0.3, 0.4)];
        let mean = own.iter().map(|&own| luminance(own)).sum::<f32>() / 2.0;
        let gold = Vec3::new(0.8, 0.6, 0.2);
        let coat = |grain| Coat { albedo: gold, grain, mean };
        assert!(own.iter().all(|&own| coat(0.0).over(own) == gold));
        let [a, b] = own.map(|own| coat(1.0).over(own));
        assert!((luminance(a) / luminance(b) - luminance(own[0]) / luminance(own[1])).abs() < 1e-5);
        assert!((luminance(a + b) / 2.0 - luminance(gold)).abs() < 1e-5 && (a.x / a.z - gold.x / gold.z).abs() < 1e-4);
        assert_eq!(coat(1.0).over(Vec3::ONE * 9.0), Vec3::ONE, "no more than all");
    }

    #[test]
    fn item_buffers_show_colours_and_nothing_else() {
        let coat = Some(Coat { albedo: Vec3::ONE, grain: 0.0, mean: 0.5 });
        let worn = Worn { slot: 1, coat, ..Worn::NOTHING };
        assert!(
            Worn::NOTHING.is_settled() && worn.is_settled() && Worn { coat: None, sight: Sight::Hidden, ..worn }.is_settled()
        );
        let others = [Worn { coat: None, ..worn }, Worn { marked: true, ..worn }, Worn { sight: Sight::Most, ..worn }];
        assert!(others.iter().all(|worn| !worn.is_settled()));
        assert_eq!([1.0, 0.7, 0.2, 0.0].map(Sight::of), [Sight::Whole, Sight::Most, Sight::Little, Sight::Hidden]);
    }
}
