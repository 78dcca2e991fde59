//! What culling gains on a walk: the same frames without it, with each kind and with both, in turn, in one program.

use super::{BenchError, ended, processor_ms};
use crate::HeliodonPlugins;
use crate::culling::{Culling, CullingTold};
use crate::daylight::DaylightCamera;
use crate::daylight::prepare::StageGpu;
use crate::headless::fault::DeviceFault;
use crate::headless::without_a_window;
use crate::navigation::pose::{Pose, fov_deg};
use crate::stage::Stage;
use crate::time_lapse::TimeLapse;
use bevy::app::ScheduleRunnerPlugin;
use bevy::camera::RenderTarget;
use bevy::prelude::*;
use bevy::render::render_resource::{PollType, TextureFormat};
use bevy::render::renderer::{RenderAdapterInfo, RenderDevice};
use bevy::render::{Render, RenderApp, RenderSystems};
use heliodon_bundle::Manifest;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// What is measured.
#[derive(Clone, Debug, PartialEq)]
pub struct WalkBench {
    /// Columns of the picture.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Points between which the eye goes, at one pace, looking ahead; the last joins the first.
    pub path: Vec<Vec3>,
    /// Frames of a walk.
    pub frames: u32,
    /// Walks of each kind; medians are told.
    pub rounds: u32,
    /// Threshold of contribution culling, pixels.
    pub threshold_px: f32,
    /// Where a processor draws: all triangles that culling leaves are drawn, as a GPU draws them, rather than found on the processor first.
    pub plain: bool,
}

impl Default for WalkBench {
    fn default() -> Self {
        Self { width: 1024, height: 768, path: Vec::new(), frames: 120, rounds: 5, threshold_px: 1.0, plain: false }
    }
}

/// The kinds of culling that are compared, with their names.
#[must_use]
pub fn kinds(threshold_px: f32) -> [(&'static str, Culling); 4] {
    let of = |shadow, contribution| Culling { shadow, contribution, threshold_px };
    [("none", of(false, false)), ("shadow", of(true, false)), ("contribution", of(false, true)), ("both", of(true, true))]
}

/// A kind of culling on the walk.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct WalkTimes {
    /// Mean time of a frame, of each walk, milliseconds.
    pub frame_ms: Vec<f64>,
    /// Mean processor time of a frame over all threads, of each walk; nothing where the system does not tell.
    pub processor_ms: Vec<f64>,
    /// Triangles of a frame that frustum and cones left, in the mean.
    pub met: f64,
    /// Those of them that were too small.
    pub small: f64,
    /// Those that lay in shadows.
    pub hidden: f64,
    /// Occluders that cast them.
    pub occluders: f64,
}

/// What was found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct WalkFound {
    /// For each of [`kinds`].
    pub kinds: [WalkTimes; 4],
    /// The device that drew it.
    pub device: String,
}

/// A way around the inside of the first room at the height of its middle, a tenth of its size off its walls.
#[must_use]
pub fn around_the_room(manifest: &Manifest) -> Vec<Vec3> {
    let Some(room) = manifest.rooms.first() else { return Vec::new() };
    let [low, high] = [room.min, room.max].map(|corner| Vec3::from(corner.map(|v| v as f32)));
    let at = |x: f32, z: f32| low + (high - low) * Vec3::new(x, 0.5, z);
    vec![at(0.1, 0.1), at(0.9, 0.1), at(0.9, 0.9), at(0.1, 0.9)]
}

/// How far ahead a walker looks, metres.
const LOOKS_AHEAD_M: f32 = 3.0;

/// Where the eye is after a part, 0 to 1, of a walk around `path`, and where it looks.
#[must_use]
pub fn on_the_way(path: &[Vec3], part: f32) -> Pose {
    let lengths = || (0..path.len()).map(|i| path[i].distance(path[(i + 1) % path.len()]));
    let whole: f32 = lengths().sum();
    let at = |distance: f32| {
        let mut left = if whole > 0.0 { distance.rem_euclid(whole) } else { 0.0 };
        for (i, length) in lengths().enumerate() {
            if left <= length && length > 0.0 {
                return path[i].lerp(path[(i + 1) % path.len()], left / length);
            }
            left -= length;
        }
        path.first().copied().unwrap_or_default()
    };
    Pose::looking(at(part * whole), at(part * whole + LOOKS_AHEAD_M))
}

/// Frames before those that count, at the beginning of each walk: what the walk before left is drawn in them.
const LEAD_IN: u32 = 6;

/// How far the walks are.
#[derive(Default)]
struct Going {
    /// Walks that are done, of all kinds.
    walks: u32,
    frame: u32,
    begun: Option<(Instant, Option<f64>)>,
    found: WalkFound,
    ended: Option<Result<(), BenchError>>,
}

#[derive(Resource, Clone, Default)]
struct Walks(Arc<Mutex<Going>>);

/// Lets every triangle that culling leaves be drawn, as a GPU draws them, where a processor draws too.
pub fn draw_plainly(app: &mut App) {
    let as_a_gpu = |mut gpu: ResMut<StageGpu>| gpu.software = false;
    if let Some(render_app) = app.get_sub_app_mut(RenderApp) {
        render_app.add_systems(Render, as_a_gpu.in_set(RenderSystems::ExtractCommands));
    }
}

/// Walks through the bundle in `folder` off screen, as often as `bench` says, at noon.
///
/// # Errors
/// As [`super::frame_times`].
///
/// # Panics
/// Without any GPU driver, as Bevy does.
pub fn walk_times(folder: &Path, bench: WalkBench) -> Result<WalkFound, BenchError> {
    let mut app = App::new();
    app.add_plugins(without_a_window()).add_plugins((HeliodonPlugins, ScheduleRunnerPlugin::run_loop(Duration::ZERO)));
    app.world_mut().resource_mut::<TimeLapse>().playing = false;
    if bench.plain {
        draw_plainly(&mut app);
    }
    let target = Image::new_target_texture(bench.width, bench.height, TextureFormat::Rgba8UnormSrgb, None);
    let target = app.world_mut().resource_mut::<Assets<Image>>().add(target);
    app.world_mut().resource_mut::<Stage>().open(folder)?;
    let fov = app.world().resource::<Stage>().manifest().map_or(50.0, fov_deg).to_radians();
    let projection = Projection::Perspective(PerspectiveProjection { fov, near: 0.05, ..default() });
    app.world_mut().spawn((DaylightCamera, RenderTarget::from(target), projection));
    let walks = Walks::default();
    let fault = DeviceFault::start(&mut app);
    app.insert_resource(walks.clone()).insert_resource(fault.clone());
    app.add_systems(
        Update,
        move |stage: Res<Stage>,
              walks: Res<Walks>,
              told: Res<CullingTold>,
              (fault, adapter, device): (Res<DeviceFault>, Option<Res<RenderAdapterInfo>>, Res<RenderDevice>),
              mut cameras: Query<&mut Transform, With<DaylightCamera>>,
              (mut culling, mut lapse): (ResMut<Culling>, ResMut<TimeLapse>),
              mut exit: MessageWriter<AppExit>| {
            let mut going = walks.0.lock().unwrap_or_else(PoisonError::into_inner);
            if let Some(error) = BenchError::of(&stage, &fault) {
                going.ended = Some(Err(error));
                exit.write(AppExit::error());
                return;
            }
            if !stage.is_complete() || !told.is_ready() {
                return;
            }
            let kinds = kinds(bench.threshold_px);
            if going.walks == 0 && going.frame == 0 {
                let (first, last) = lapse.span_s();
                lapse.scrub((first + last) * 0.5);
                going.found.device = adapter.map_or_else(String::new, |info| info.name.clone());
            }
            let kind = going.walks as usize % kinds.len();
            *culling = kinds[kind].1;
            // In steps from the lead-in on: where it begins, the eye still moves.
            let part = going.frame as f32 / (LEAD_IN + bench.frames) as f32;
            let pose = on_the_way(&bench.path, part);
            cameras.iter_mut().for_each(|mut camera| *camera = pose.transform());
            if going.frame == LEAD_IN {
                device.wgpu_device().poll(PollType::wait_indefinitely()).ok();
                going.begun = Some((Instant::now(), processor_ms()));
            }
            if going.frame >= LEAD_IN {
                let (saved, times) = (told.last(), &mut going.found.kinds[kind]);
                times.met += saved.met.triangles as f64;
                times.small += saved.small.triangles as f64;
                times.hidden += saved.hidden.triangles as f64;
                times.occluders += saved.occluders as f64;
            }
            going.frame += 1;
            if going.frame < LEAD_IN + bench.frames.max(1) {
                return;
            }
            device.wgpu_device().poll(PollType::wait_indefinitely()).ok();
            let frames = f64::from(bench.frames.max(1));
            if let Some((start, before)) = going.begun.take() {
                let (wall, processor) = (start.elapsed().as_secs_f64() * 1e3, processor_ms());
                let times = &mut going.found.kinds[kind];
                times.frame_ms.push(wall / frames);
                times.processor_ms.extend(before.zip(processor).map(|(before, after)| (after - before) / frames));
            }
            (going.walks, going.frame) = (going.walks + 1, 0);
            // The first round warms up: pipelines, light and memory.
            if going.walks == kinds.len() as u32 {
                going.found.kinds = default();
            }
            if going.walks == (bench.rounds.max(1) + 1) * kinds.len() as u32 {
                let counted = frames * f64::from(bench.rounds.max(1));
                for times in &mut going.found.kinds {
                    for sum in [&mut times.met, &mut times.small, &mut times.hidden, &mut times.occluders] {
                        *sum /= counted;
                    }
                }
                going.ended = Some(Ok(()));
                exit.write(AppExit::Success);
            }
        },
    );
    let exit = app.run();
    let mut going = walks.0.lock().unwrap_or_else(PoisonError::into_inner);
    let found = going.ended.take().map(|ended| ended.map(|()| std::mem::take(&mut going.found)));
    ended(found, &fault, exit)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_walk_goes_around_at_one_pace_and_looks_ahead() {
        let path = [Vec3::ZERO, Vec3::X * 10.0, Vec3::new(10.0, 0.0, 30.0)];
        let whole = 40.0 + 1000_f32.sqrt();
        let at = |distance: f32| on_the_way(&path, distance / whole);
        assert!((at(5.0).eye - Vec3::X * 5.0).length() < 1e-4);
        assert!((at(5.0).rotation() * Vec3::NEG_Z - Vec3::X).length() < 1e-4);
        assert!((at(25.0).eye - Vec3::new(10.0, 0.0, 15.0)).length() < 1e-3);
        assert!((at(25.0).rotation() * Vec3::NEG_Z - Vec3::Z).length() < 1e-4);
        assert!((at(whole).eye - at(0.0).eye).length() < 1e-3, "it comes back");
        assert_eq!(on_the_way(&[], 0.5).eye, Vec3::ZERO);
        assert_eq!(on_the_way(&[Vec3::Y], 0.5).eye, Vec3::Y);
    }
}
