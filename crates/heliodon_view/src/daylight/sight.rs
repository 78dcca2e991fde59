//! What an eye at rest sees: the triangles that the picture shows, found out by the GPU and exact.
//!
//! An eye that watches the day pass stands still, and most of what it faces is hidden behind nearer stone or lies between the
//! pixels. Once a camera has not moved for a frame, the next frame also draws the number of the triangle that each pixel shows,
//! by the same depth test. A triangle whose number is nowhere in that picture gave no pixel its colour, so that frames without
//! it are the same to the last bit, until the camera or the stage changes. Nobody waits for the answer: until it is there,
//! everything is drawn.

use super::flat::flat_texture;
use super::seen::NumberSet;
use crate::culling::Culling;
use crate::readback::TextureReadback;
use bevy::prelude::{Mat4, UVec2, UVec4};
use bevy::render::renderer::RenderDevice;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};
use wgpu::{CommandEncoder, Texture, TextureFormat, TextureUsages, TextureView, TextureViewDescriptor};

/// What a pixel of the question is: 0 where it shows no stone, else the triangle's number in the order of drawing plus 1.
pub const NUMBER_FORMAT: TextureFormat = TextureFormat::R32Uint;
/// Bytes of it.
const NUMBER_BYTES: u32 = 4;

/// What must stay the same for the answer to hold.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SightKey {
    /// The camera.
    pub clip_from_world: Mat4,
    /// The camera of the other eye of its pair: what both draw is found together.
    pub beside: Option<Mat4>,
    /// Its viewport.
    pub viewport: UVec4,
    /// Samples a pixel.
    pub samples: u32,
    /// The bundle, and how much of it is there.
    pub stage: (u64, usize),
    /// Whether it is the scan itself that is seen.
    pub scan: bool,
    /// What is culled.
    pub culling: Culling,
    /// What is hidden, faded, and of another colour ([`crate::covering::gpu::CoversGpu::serial`]).
    pub covers: u64,
}

/// The question, as the frame that asks it needs it.
#[derive(Debug)]
pub struct Question {
    numbers: Texture,
    /// What its pass draws to.
    pub view: TextureView,
    readback: TextureReadback,
    asked: AtomicBool,
}

impl Question {
    fn new(device: &RenderDevice, size: UVec2) -> Self {
        let usage = TextureUsages::RENDER_ATTACHMENT | TextureUsages::COPY_SRC;
        let numbers = flat_texture(device, "stone_sight", size, NUMBER_FORMAT, usage);
        let readback = TextureReadback::new(device, "stone_sight_read", size, NUMBER_BYTES);
        let view = numbers.create_view(&TextureViewDescriptor::default());
        Self { numbers, view, readback, asked: AtomicBool::new(false) }
    }

    /// Makes the answer readable, after the pass.
    pub fn read(&self, encoder: &mut CommandEncoder) {
        self.readback.copy(encoder, &self.numbers);
        self.asked.store(true, Ordering::Release);
    }

    /// The answer.
    fn shown(&self) -> NumberSet {
        let mapped = self.readback.mapped();
        let mut shown = NumberSet::default();
        for row in self.readback.rows(&mapped) {
            let numbers: &[u32] = bytemuck::cast_slice(row);
            shown.extend(numbers.iter().filter_map(|number| number.checked_sub(1)));
        }
        shown
    }
}

/// How far a camera's rest has come.
#[derive(Debug, Default)]
enum Rest {
    /// It moved.
    #[default]
    Moved,
    /// This frame asks.
    Asks(Question),
    /// The answer is on its way.
    Waits(Question, Arc<OnceLock<bool>>),
    /// Only what is seen is drawn; or there is no answer to be had.
    Settled,
}

/// What a frame changes of what is drawn.
#[derive(Debug, PartialEq, Eq)]
pub enum Change {
    /// Nothing.
    None,
    /// The camera or the stage is another: all that it may see must be found anew.
    Moved,
    /// Of what was drawn so far, only these triangles are seen, by their number in the order of drawing.
    Shown(NumberSet),
}

/// What a camera knows of what it sees.
#[derive(Debug, Default)]
pub struct Sight {
    key: Option<SightKey>,
    rest: Rest,
}

impl Sight {
    /// Goes on to the next frame. `may_ask` is the size of the camera's picture, if a frame that is drawn now can ask.
    pub fn next(&mut self, device: &RenderDevice, key: SightKey, may_ask: Option<UVec2>) -> Change {
        if self.key != Some(key) {
            self.key = Some(key);
            self.rest = Rest::Moved;
            return Change::Moved;
        }
        let mut change = Change::None;
        self.rest = match (std::mem::take(&mut self.rest), may_ask) {
            (Rest::Moved, Some(size)) => Rest::Asks(Question::new(device, size)),
            // The frame was not drawn, as in a minimised window: nobody asked, and an answer would be that nothing is seen.
            (Rest::Asks(question), _) if !question.asked.load(Ordering::Acquire) => Rest::Moved,
            // The frame that asked was submitted.
            (Rest::Asks(question), _) => {
                let answer = Arc::new(OnceLock::new());
                let told = Arc::clone(&answer);
                question.readback.map(move |result| {
                    // Set once: there is one callback.
                    told.set(result.is_ok()).ok();
                });
                Rest::Waits(question, answer)
            }
            (Rest::Waits(question, answer), _) => match answer.get() {
                None => Rest::Waits(question, answer),
                Some(readable) => {
                    if *readable {
                        change = Change::Shown(question.shown());
                    }
                    Rest::Settled
                }
            },
            (same @ (Rest::Moved | Rest::Settled), _) => same,
        };
        change
    }

    /// The question of this frame, if it asks one.
    #[must_use]
    pub fn question(&self) -> Option<&Question> {
        match &self.rest {
            Rest::Asks(question) => Some(question),
            _ => None,
        }
    }
}
