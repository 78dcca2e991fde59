//! What an eye at rest sees: the clusters that put something into the picture, found out by the GPU and exact.
//!
//! An eye that watches the day pass stands still, and much of what it faces is hidden behind nearer stone. Once a camera has
//! not moved for a frame, the next frame draws each cluster by itself within an occlusion query. A cluster of which no sample
//! passed is strictly behind what was drawn before it, so that frames without it are the same to the last bit, until the
//! camera or the stage changes. Nobody waits for the answer: until it is there, everything is drawn.

use super::view::ClusterRef;
use bevy::prelude::{Mat4, UVec4};
use bevy::render::renderer::RenderDevice;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};
use wgpu::{Buffer, BufferDescriptor, BufferUsages, CommandEncoder, MapMode, QuerySet, QuerySetDescriptor, QueryType};

/// Queries of a set: what WebGPU promises.
const SET_QUERIES: usize = wgpu::QUERY_SET_MAX_QUERIES as usize;
/// Bytes of an answer.
const ANSWER_BYTES: u64 = wgpu::QUERY_SIZE as u64;

/// What must stay the same for the answer to hold.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SightKey {
    /// The camera.
    pub clip_from_world: Mat4,
    /// Its viewport.
    pub viewport: UVec4,
    /// Samples a pixel.
    pub samples: u32,
    /// The bundle, and how much of it is there.
    pub stage: (u64, usize),
}

/// The question, as the frame that asks it needs it: one query a cluster, in the order of drawing.
#[derive(Debug)]
pub struct Question {
    sets: Vec<QuerySet>,
    clusters: usize,
    resolved: Buffer,
    readable: Buffer,
    asked: AtomicBool,
}

impl Question {
    fn new(device: &RenderDevice, clusters: usize) -> Self {
        let device = device.wgpu_device();
        let sets = (0..clusters).step_by(SET_QUERIES).map(|first| {
            let count = (clusters - first).min(SET_QUERIES) as u32;
            device.create_query_set(&QuerySetDescriptor { label: Some("stone_sight"), ty: QueryType::Occlusion, count })
        });
        let buffer = |label, usage| {
            let size = (clusters as u64 * ANSWER_BYTES).next_multiple_of(wgpu::QUERY_RESOLVE_BUFFER_ALIGNMENT);
            device.create_buffer(&BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false })
        };
        Self {
            sets: sets.collect(),
            clusters,
            resolved: buffer("stone_sight", BufferUsages::QUERY_RESOLVE | BufferUsages::COPY_SRC),
            readable: buffer("stone_sight_read", BufferUsages::MAP_READ | BufferUsages::COPY_DST),
            asked: AtomicBool::new(false),
        }
    }

    /// The query sets, each with the range of clusters that it asks for: a pass of its own for each.
    pub fn passes(&self) -> impl Iterator<Item = (&QuerySet, std::ops::Range<usize>)> {
        self.sets.iter().enumerate().map(|(i, set)| (set, i * SET_QUERIES..((i + 1) * SET_QUERIES).min(self.clusters)))
    }

    /// Makes the answers readable, after the passes.
    pub fn resolve(&self, encoder: &mut CommandEncoder) {
        for (set, range) in self.passes() {
            encoder.resolve_query_set(set, 0..range.len() as u32, &self.resolved, range.start as u64 * ANSWER_BYTES);
        }
        encoder.copy_buffer_to_buffer(&self.resolved, 0, &self.readable, 0, self.resolved.size());
        self.asked.store(true, Ordering::Release);
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
    /// Only what is seen is listed; or there is no answer to be had.
    Settled,
}

/// What a camera draws.
#[derive(Debug, Default)]
pub struct Sight {
    key: Option<SightKey>,
    rest: Rest,
    /// The clusters, in the order of drawing.
    pub seen: Vec<ClusterRef>,
}

impl Sight {
    /// Goes on to the next frame. `cull` lists what could be seen after a change; `may_ask` says whether a frame that is drawn
    /// now can ask. True if [`Sight::seen`] is another than before.
    pub fn next(
        &mut self,
        device: &RenderDevice,
        key: SightKey,
        may_ask: bool,
        cull: impl FnOnce(&mut Vec<ClusterRef>),
    ) -> bool {
        if self.key != Some(key) {
            self.key = Some(key);
            self.rest = Rest::Moved;
            self.seen.clear();
            cull(&mut self.seen);
            return true;
        }
        let (rest, changed) = match std::mem::take(&mut self.rest) {
            Rest::Moved if may_ask && !self.seen.is_empty() => (Rest::Asks(Question::new(device, self.seen.len())), true),
            // The frame was not drawn, as in a minimised window: nobody asked, and an answer would be that nothing is seen.
            Rest::Asks(question) if !question.asked.load(Ordering::Acquire) => (Rest::Moved, true),
            // The frame that asked was submitted.
            Rest::Asks(question) => {
                let answer = Arc::new(OnceLock::new());
                let told = Arc::clone(&answer);
                question.readable.slice(..).map_async(MapMode::Read, move |result| {
                    // Set once: there is one callback.
                    told.set(result.is_ok()).ok();
                });
                (Rest::Waits(question, answer), true)
            }
            Rest::Waits(question, answer) => match answer.get() {
                None => (Rest::Waits(question, answer), false),
                Some(false) => (Rest::Settled, false),
                Some(true) => {
                    self.keep_seen(&question);
                    (Rest::Settled, true)
                }
            },
            same @ (Rest::Moved | Rest::Settled) => (same, false),
        };
        self.rest = rest;
        changed
    }

    /// The question of this frame, if it asks one.
    #[must_use]
    pub fn question(&self) -> Option<&Question> {
        match &self.rest {
            Rest::Asks(question) => Some(question),
            _ => None,
        }
    }

    fn keep_seen(&mut self, question: &Question) {
        let mapped = question.readable.slice(..).get_mapped_range();
        let answers: &[u64] = bytemuck::cast_slice(&mapped);
        let mut answers = answers.iter();
        self.seen.retain(|_| answers.next().is_none_or(|&samples| samples > 0));
    }
}
