//! What a run in a headset came to: frames that were submitted, both eyes' pictures of the last of them, and why it ended.

use super::eyes::Eye;
use super::run::XrOptions;
use crate::daylight::OnePassPairs;
use crate::navigation::Visitor;
use crate::stage::{Stage, StageStatus};
use crate::time_lapse::TimeLapse;
use bevy::camera::RenderTarget;
use bevy::prelude::*;
use bevy::render::view::screenshot::{Screenshot, ScreenshotCaptured};
use bevy::render::{Render, RenderApp};
use bevy_mod_openxr::init::should_run_frame_loop;
use bevy_mod_openxr::render::{begin_frame, end_frame, wait_image};
use bevy_mod_openxr::resources::{OxrCurrentSessionConfig, OxrFrameState};
use bevy_mod_openxr::session::OxrSession;
use bevy_mod_xr::session::{XrRenderSystems, XrRequestExitMessage, XrState};
use heliodon_image::SrgbImage;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// How long a session may take to be made, and to end.
const PATIENCE: Duration = Duration::from_secs(10);

/// What was counted and told so far, in both worlds and after the app.
#[derive(Resource, Clone, Debug, Default)]
pub(super) struct Tally(Arc<Mutex<Told>>);

/// What a run came to.
#[derive(Clone, Debug, Default)]
pub(super) struct Told {
    /// Frames that were submitted with pictures.
    pub frames: u64,
    /// When the first and the last of them were.
    pub first: Option<Instant>,
    pub last: Option<Instant>,
    /// How long the runtime was waited for, for frames and for images to draw to, from the first of them on.
    pub waited: Duration,
    /// Size of an eye's picture.
    pub resolution: [u32; 2],
    /// Frames of which both eyes' were drawn in one pass.
    pub one_pass_frames: u64,
    /// Where the visitor's platform is, how far it is turned, and what hour it is.
    pub eye: Vec3,
    pub yaw_rad: f32,
    pub clock_s: f64,
    pub playing: bool,
    /// Pictures that were written.
    pub pictures: Vec<PathBuf>,
    /// The first thing that went wrong.
    pub fault: Option<String>,
}

impl Tally {
    pub(super) fn told(&self) -> MutexGuard<'_, Told> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Something went wrong; only the first counts.
    pub(super) fn fail(&self, why: String) {
        self.told().fault.get_or_insert(why);
    }

    /// The runtime was waited for.
    pub(super) fn waited(&self, time: Duration) {
        let mut told = self.told();
        if told.first.is_some() {
            told.waited += time;
        }
    }

    fn count(&self) {
        let (mut told, now) = (self.told(), Instant::now());
        told.frames += 1;
        told.first.get_or_insert(now);
        told.last = Some(now);
    }
}

/// How far a run has come to its end.
#[derive(Clone, Debug, Default, PartialEq)]
enum Stand {
    /// It goes on.
    #[default]
    Goes,
    /// So many pictures are under way, since then.
    Captures(usize, Instant),
    /// The session was asked to end, then.
    Leaves(Instant),
}

/// What ends a run, and how far that has come.
#[derive(Resource, Clone, Debug)]
pub(super) struct Watch {
    options: XrOptions,
    begun: Instant,
    stand: Stand,
}

/// Counts, captures and ends.
pub(super) struct WatchPlugin {
    pub options: XrOptions,
    pub tally: Tally,
}

impl Plugin for WatchPlugin {
    fn build(&self, app: &mut App) {
        let watch = Watch { options: self.options.clone(), begun: Instant::now(), stand: Stand::Goes };
        app.insert_resource(self.tally.clone()).insert_resource(watch).add_systems(Last, (note, end_in_time).chain());
        app.sub_app_mut(RenderApp).insert_resource(self.tally.clone()).init_resource::<AsksForImage>().add_systems(
            Render,
            (
                (|mut asks: ResMut<AsksForImage>| asks.0 = Some(Instant::now()))
                    .before(begin_frame)
                    .in_set(XrRenderSystems::PreRender),
                count_wait.after(wait_image).in_set(XrRenderSystems::PreRender),
                count_frames.after(end_frame).in_set(XrRenderSystems::PostRender),
            )
                .run_if(should_run_frame_loop),
        );
    }
}

/// Since when the runtime is asked for an image to draw to.
#[derive(Resource, Default)]
struct AsksForImage(Option<Instant>);

fn count_wait(mut asks: ResMut<AsksForImage>, tally: Res<Tally>) {
    if let Some(since) = asks.0.take() {
        tally.waited(since.elapsed());
    }
}

/// A frame without pictures, while the headset is laid aside, is none.
fn count_frames(state: Option<Res<OxrFrameState>>, tally: Res<Tally>) {
    if state.is_some_and(|state| state.should_render) {
        tally.count();
    }
}

/// Notes what a report tells of the end: nobody knows which frame will be the last.
fn note(
    config: Option<Res<OxrCurrentSessionConfig>>,
    visitors: Query<&Visitor>,
    lapse: Res<TimeLapse>,
    one_pass: Res<OnePassPairs>,
    tally: Res<Tally>,
) {
    let mut told = tally.told();
    told.one_pass_frames += u64::from(one_pass.count() > 0);
    if let Some(config) = config {
        told.resolution = config.resolution.to_array();
    }
    if let Some(visitor) = visitors.iter().next() {
        (told.eye, told.yaw_rad) = (visitor.pose.eye, visitor.pose.yaw_rad);
    }
    (told.clock_s, told.playing) = (lapse.clock_s, lapse.playing);
}

/// Ends a run in time, or when there is no session any more.
#[expect(clippy::too_many_arguments, reason = "a system's arguments are its resources")]
fn end_in_time(
    state: Res<XrState>,
    session: Option<Res<OxrSession>>,
    stage: Res<Stage>,
    tally: Res<Tally>,
    eyes: Query<(&Eye, &RenderTarget)>,
    mut watch: ResMut<Watch>,
    mut request_exit: MessageWriter<XrRequestExitMessage>,
    mut exit: MessageWriter<AppExit>,
    mut commands: Commands,
) {
    let watch = &mut *watch;
    let had_session = !matches!(tally.told().resolution, [0, 0]);
    match (session.is_some(), had_session) {
        (false, false) if watch.begun.elapsed() > PATIENCE => {
            tally.fail("it made no session; RUST_LOG=bevy_mod_openxr=info tells more".to_owned());
            exit.write(AppExit::error());
        }
        // The visitor, or whoever runs the headset, ended it.
        (false, true) => {
            exit.write(AppExit::Success);
        }
        _ => {}
    }
    if let StageStatus::Failed(why) = stage.status()
        && watch.options.seconds.is_some()
    {
        tally.fail(why.clone());
    }
    let first = tally.told().first;
    let is_over = |seconds: f32| first.is_some_and(|first| first.elapsed().as_secs_f32() >= seconds);
    watch.stand = match watch.stand.clone() {
        Stand::Goes if watch.options.seconds.is_some_and(is_over) => match &watch.options.capture {
            Some(folder) => Stand::Captures(capture(&eyes, folder, &tally, &mut commands), Instant::now()),
            None => Stand::Captures(0, Instant::now()),
        },
        Stand::Captures(wanted, since) => {
            let taken = tally.told().pictures.len();
            if since.elapsed() > PATIENCE && taken < wanted {
                tally.fail(format!("{} of {wanted} pictures did not come back from the GPU", wanted - taken));
            }
            if taken >= wanted || tally.told().fault.is_some() {
                request_exit.write_default();
                Stand::Leaves(Instant::now())
            } else {
                Stand::Captures(wanted, since)
            }
        }
        Stand::Leaves(since) if since.elapsed() > PATIENCE => {
            warn!("the headset's session did not end in time (it is {:?})", *state);
            exit.write(AppExit::Success);
            Stand::Leaves(since)
        }
        stand => stand,
    };
}

/// Asks for both eyes' pictures as they are submitted, all of one frame. Answers how many.
fn capture(eyes: &Query<(&Eye, &RenderTarget)>, folder: &Path, tally: &Tally, commands: &mut Commands) -> usize {
    let mut asked = 0;
    for (eye, target) in eyes {
        let (path, tally) = (folder.join(eye.file()), tally.clone());
        commands.spawn(Screenshot(target.clone())).observe(move |captured: On<ScreenshotCaptured>| {
            match write(&captured.image, &path) {
                Ok(()) => tally.told().pictures.push(path.clone()),
                Err(why) => tally.fail(format!("{}: {why}", path.display())),
            }
        });
        asked += 1;
    }
    asked
}

fn write(image: &Image, path: &Path) -> Result<(), String> {
    let size = image.size();
    let codes = image.data.as_deref().unwrap_or_default().chunks_exact(4);
    let swapped = image.texture_descriptor.format.remove_srgb_suffix() == wgpu::TextureFormat::Bgra8Unorm;
    let pixels = codes.map(|code| match (code, swapped) {
        (&[b, g, r, a], true) | (&[r, g, b, a], false) => [r, g, b, a],
        _ => [0; 4],
    });
    let picture = SrgbImage { width: size.x, height: size.y, pixels: pixels.collect() };
    path.parent().map_or(Ok(()), std::fs::create_dir_all).map_err(|why| why.to_string())?;
    picture.write_png(path).map_err(|why| why.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_fault_counts() {
        let tally = Tally::default();
        tally.fail("the cable".to_owned());
        tally.clone().fail("the session".to_owned());
        tally.count();
        tally.count();
        let told = tally.told().clone();
        assert_eq!((told.fault.as_deref(), told.frames), (Some("the cable"), 2));
        assert!(told.first <= told.last);
    }
}
