//! From what a source plays to a slice of samples.

use crate::clip::Clip;
use crate::feed::FeedReader;
use crate::filter::Glide;
use crate::kernel::{AHEAD, Kernel, TAPS, dot};
use crate::{RATE_HZ, SLICE};
use std::sync::Arc;

/// What a source or a bed plays.
#[derive(Debug)]
pub enum Content {
    /// A sound in memory, shared by whoever plays it.
    Clip(Arc<Clip>),
    /// Sound that comes as it is made: a film's, or a file's that is [streamed](crate::stream).
    Feed(Box<FeedReader>),
}

impl Content {
    pub(crate) fn channels(&self) -> usize {
        match self {
            Self::Clip(clip) => clip.channels(),
            Self::Feed(feed) => feed.channels(),
        }
    }

    /// What its loudness is taken to be when the loudest are chosen: of a feed, as of speech.
    pub(crate) fn loudness(&self) -> f32 {
        match self {
            Self::Clip(clip) => clip.rms(),
            Self::Feed(_) => 0.1,
        }
    }
}

/// Content, and how far it has been played.
#[derive(Debug)]
pub(crate) struct Reader {
    pub(crate) content: Content,
    /// In frames of the clip.
    position: f64,
    pub(crate) looping: bool,
    pub(crate) rate: f32,
    gliding: Glide,
}

/// One channel of a clip.
struct Track<'a> {
    samples: &'a [f32],
    channels: usize,
    channel: usize,
    frames: i64,
    looping: bool,
}

impl Track<'_> {
    fn at(&self, frame: i64) -> f32 {
        let frame = if self.looping { frame.rem_euclid(self.frames) } else { frame };
        if (0..self.frames).contains(&frame) { self.samples[frame as usize * self.channels + self.channel] } else { 0.0 }
    }

    fn between(&self, kernel: &Kernel, position: f64) -> f32 {
        let whole = position.floor();
        let fraction = (position - whole) as f32;
        if fraction == 0.0 {
            return self.at(whole as i64);
        }
        let samples: [f32; TAPS] = std::array::from_fn(|tap| self.at(whole as i64 + tap as i64 - (AHEAD as i64 - 1)));
        dot(&samples, &kernel.weights(fraction))
    }
}

impl Reader {
    pub(crate) fn new(content: Content, looping: bool, rate: f32) -> Self {
        Self { content, position: 0.0, looping, rate, gliding: Glide::at(rate) }
    }

    /// To a time of a clip; feeds are wound by those who write them.
    pub(crate) fn seek(&mut self, seconds: f64) {
        if let Content::Clip(clip) = &self.content {
            let (frames, wanted) = (clip.frames() as f64, (seconds * f64::from(RATE_HZ)).max(0.0));
            self.position = if self.looping { wanted % frames } else { wanted.min(frames) }.floor();
        }
    }

    /// The next slice from its frame `from` on, into as many channels as the content has. Returns whether it is over.
    pub(crate) fn slice(&mut self, kernel: &Kernel, rate: f32, from: usize, frame: u64, out: &mut [[f32; SLICE]; 2]) -> bool {
        let clip = match &mut self.content {
            Content::Feed(feed) => return feed.slice(frame, out),
            Content::Clip(clip) => clip,
        };
        let line = self.gliding.slice(self.rate, rate);
        let (frames, start) = (clip.frames() as f64, self.position);
        for (channel, out) in out.iter_mut().enumerate().take(clip.channels()) {
            let track = Track {
                samples: clip.samples(),
                channels: clip.channels(),
                channel,
                frames: clip.frames() as i64,
                looping: self.looping,
            };
            let mut position = start;
            out[..from].fill(0.0);
            for (k, sample) in out.iter_mut().enumerate().skip(from) {
                *sample = track.between(kernel, position);
                position += f64::from(line.at(k));
            }
            self.position = position;
        }
        self.wrap(frames)
    }

    /// A slice goes by unheard. Returns whether it is over.
    pub(crate) fn pass(&mut self, from: usize, frame: u64) -> bool {
        match &mut self.content {
            Content::Feed(feed) => feed.pass(frame),
            Content::Clip(clip) => {
                let frames = clip.frames() as f64;
                self.gliding = Glide::at(self.rate);
                self.position += f64::from(self.rate) * (SLICE - from) as f64;
                self.wrap(frames)
            }
        }
    }

    fn wrap(&mut self, frames: f64) -> bool {
        if self.looping && self.position >= frames {
            self.position %= frames;
        }
        self.position >= frames
    }

    /// What a clip has played before its present place, mixed to one channel: `ago` frames before it, at its present rate.
    pub(crate) fn before(&self, kernel: &Kernel, ago: usize) -> f32 {
        let Content::Clip(clip) = &self.content else { return 0.0 };
        let (channels, rate) = (clip.channels(), f64::from(self.gliding.value()));
        let sum: f32 = (0..channels)
            .map(|channel| {
                let (frames, looping) = (clip.frames() as i64, self.looping);
                let track = Track { samples: clip.samples(), channels, channel, frames, looping };
                track.between(kernel, self.position - rate * ago as f64)
            })
            .sum();
        sum / channels as f32
    }
}
