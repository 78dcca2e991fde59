//! One device, through cpal.

use super::{OutputSettings, Shared, held};
use crate::clock::Clock;
use crate::mixer::Mixer;
use crate::resample::Resampler;
use crate::{RATE_HZ, SLICE};
use cpal::traits::{DeviceTrait, HostTrait, StreamTrait};
use cpal::{
    BufferSize, ErrorKind, FromSample, I24, OutputCallbackInfo, SampleFormat, SizedSample, StreamConfig, SupportedBufferSize,
};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::time::{Duration, Instant};

/// How long a device may take to give the mixer back.
const PATIENCE: Duration = Duration::from_secs(5);

/// A device that plays.
pub(super) struct Playing {
    pub(super) name: String,
    pub(super) rate_hz: u32,
    stream: cpal::Stream,
    back: Receiver<Box<Mixer>>,
}

impl Playing {
    /// Ends it, and takes the mixer back.
    pub(super) fn end(self) -> Option<Box<Mixer>> {
        drop(self.stream);
        self.back.recv_timeout(PATIENCE).ok()
    }
}

/// The mixer while a device has it: given back when the device's closure is dropped, so no lock is ever held while it plays.
struct Lent {
    mixer: Option<Box<Mixer>>,
    back: SyncSender<Box<Mixer>>,
    /// For devices of another rate.
    bridge: Option<Bridge>,
    clock: Clock,
    shared: Arc<Shared>,
}

struct Bridge {
    resampler: Resampler,
    out: Vec<f32>,
    given: usize,
}

impl Drop for Lent {
    fn drop(&mut self) {
        if let Some(mixer) = self.mixer.take() {
            // the channel has room for it
            let _ = self.back.try_send(mixer);
        }
    }
}

impl Bridge {
    fn new(rate_hz: u32) -> Option<Self> {
        let mut resampler = Resampler::new(RATE_HZ, rate_hz, 2).ok()?;
        let mut out = Vec::with_capacity(2 * resampler.most_frames(SLICE) + 64);
        // it has met all its phases and grown to its size before a callback uses it, and allocates no more
        for _ in 0..2 * RATE_HZ as usize / SLICE {
            resampler.push(&[0.0; 2 * SLICE], &mut out);
            out.clear();
        }
        Some(Self { resampler, out, given: 0 })
    }

    fn frame(&mut self, mixer: &mut Mixer) -> [f32; 2] {
        while self.given >= self.out.len() {
            (self.given, self.out) = (0, std::mem::take(&mut self.out));
            self.out.clear();
            let mut slice = [0.0; 2 * SLICE];
            mixer.render(&mut slice);
            self.resampler.push(&slice, &mut self.out);
        }
        self.given += 2;
        [self.out[self.given - 2], self.out[self.given - 1]]
    }
}

impl Lent {
    fn fill<T: SizedSample + FromSample<f32>>(&mut self, data: &mut [T], channels: usize, info: &OutputCallbackInfo) {
        let Some(mixer) = &mut self.mixer else { return };
        let (now, first) = (Instant::now(), mixer.next_frame());
        for frame in data.chunks_mut(channels) {
            let ears = match &mut self.bridge {
                Some(bridge) => bridge.frame(mixer),
                None => {
                    let mut ears = [0.0; 2];
                    mixer.render(&mut ears);
                    ears
                }
            };
            match frame {
                [only] => *only = T::from_sample((ears[0] + ears[1]) * 0.5),
                [left, right, rest @ ..] => {
                    (*left, *right) = (T::from_sample(ears[0]), T::from_sample(ears[1]));
                    rest.fill(T::EQUILIBRIUM);
                }
                [] => {}
            }
        }
        let times = info.timestamp();
        let latency = times.playback.saturating_duration_since(times.callback);
        self.clock.taken(first, mixer.next_frame(), now, latency.min(Duration::from_secs(1)));
        self.shared.asked.fetch_add((data.len() / channels) as u64, Ordering::Relaxed);
    }
}

/// Opens what the settings ask for; with the mixer's way back where it fails.
pub(super) fn open(
    shared: &Arc<Shared>,
    settings: &OutputSettings,
    mixer: Box<Mixer>,
) -> Result<Playing, (Option<Box<Mixer>>, String)> {
    let chosen = choose(settings);
    let (device, name, format, config) = match chosen {
        Ok(chosen) => chosen,
        Err(why) => return Err((Some(mixer), why)),
    };
    let bridge = if config.sample_rate == RATE_HZ { None } else { Bridge::new(config.sample_rate) };
    if bridge.is_none() && config.sample_rate != RATE_HZ {
        return Err((Some(mixer), format!("{name} plays {} Hz only", config.sample_rate)));
    }
    let (give, back) = sync_channel(1);
    let lent = Lent { clock: mixer.clock(), mixer: Some(mixer), back: give, bridge, shared: Arc::clone(shared) };
    let built = match format {
        SampleFormat::F32 => build::<f32>(&device, config, lent),
        SampleFormat::F64 => build::<f64>(&device, config, lent),
        SampleFormat::I8 => build::<i8>(&device, config, lent),
        SampleFormat::I16 => build::<i16>(&device, config, lent),
        SampleFormat::I24 => build::<I24>(&device, config, lent),
        SampleFormat::I32 => build::<i32>(&device, config, lent),
        SampleFormat::U8 => build::<u8>(&device, config, lent),
        SampleFormat::U16 => build::<u16>(&device, config, lent),
        SampleFormat::U32 => build::<u32>(&device, config, lent),
        other => {
            drop(lent);
            Err(format!("it plays samples as {other}"))
        }
    };
    let begun = built.and_then(|stream| stream.play().map(|()| stream).map_err(|error| error.to_string()));
    match begun {
        Ok(stream) => Ok(Playing { name, rate_hz: config.sample_rate, stream, back }),
        // whoever failed has dropped what was lent
        Err(why) => Err((back.recv_timeout(PATIENCE).ok(), format!("{name}: {why}"))),
    }
}

type Chosen = (cpal::Device, String, SampleFormat, StreamConfig);

fn choose(settings: &OutputSettings) -> Result<Chosen, String> {
    let host = cpal::default_host();
    let name_of = |device: &cpal::Device| {
        device.description().map_or_else(|_| "an audio device".to_owned(), |told| told.name().to_owned())
    };
    let device = match &settings.device {
        None => host.default_output_device().ok_or("this machine has no audio device that is free")?,
        Some(wanted) => {
            let mut devices = host.output_devices().map_err(|error| error.to_string())?;
            devices.find(|device| name_of(device).contains(wanted)).ok_or(format!("no audio device is called {wanted:?}"))?
        }
    };
    let name = name_of(&device);
    // two channels at our own rate in floats, or as near to that as it has
    let best = device.supported_output_configs().ok().and_then(|configs| {
        let ours = configs.filter(|config| config.channels() >= 1 && config.contains_rate(RATE_HZ));
        let nearness = |config: &cpal::SupportedStreamConfigRange| {
            let format = match config.sample_format() {
                SampleFormat::F32 => 0,
                SampleFormat::I32 => 1,
                SampleFormat::I24 => 2,
                SampleFormat::I16 => 3,
                _ => 4,
            };
            ((i32::from(config.channels()) - 2).abs(), format)
        };
        ours.min_by_key(nearness).and_then(|config| config.try_with_sample_rate(RATE_HZ))
    });
    let supported = match best {
        Some(config) => config,
        None => device.default_output_config().map_err(|error| format!("{name}: {error}"))?,
    };
    let mut config = supported.config();
    if let SupportedBufferSize::Range { min, max } = supported.buffer_size()
        && min <= max
    {
        config.buffer_size = BufferSize::Fixed(settings.buffer_frames.clamp(*min, *max));
    }
    Ok((device, name, supported.sample_format(), config))
}

fn build<T: SizedSample + FromSample<f32>>(
    device: &cpal::Device,
    config: StreamConfig,
    mut lent: Lent,
) -> Result<cpal::Stream, String> {
    let (channels, shared) = (usize::from(config.channels.max(1)), Arc::clone(&lent.shared));
    let fill = move |data: &mut [T], info: &OutputCallbackInfo| lent.fill(data, channels, info);
    let failed = move |error: cpal::Error| {
        // these pass: the device plays on
        if !matches!(error.kind(), ErrorKind::DeviceChanged | ErrorKind::Xrun | ErrorKind::RealtimeDenied) {
            *held(&shared.why_lost) = error.to_string();
            shared.lost.store(true, Ordering::Relaxed);
        }
    };
    device.build_output_stream(config, fill, failed, None).map_err(|error| error.to_string())
}
