//! Heads and hands of a room with screens, from an OpenXR runtime that shows nothing itself (`XR_MND_headless`): Monado with lighthouses or cameras, and whatever else has the extension.
//!
//! Poses are asked for once a frame, in the runtime's stage, or where it began if it has none; calibration, smoothing and loss are those of every other tracker.

use super::controllers::Bound;
use super::runtime::entry;
use bevy::math::{Quat, Vec3};
use heliodon_track::pose::Pose;
use heliodon_track::report::{Buttons, Report, Sight};
use openxr::{
    Action, ActiveActionSet, ApplicationInfo, Event, EventDataBuffer, ExtensionSet, FormFactor, FrameStream, FrameWaiter,
    Headless, Posef, ReferenceSpaceType, Session, SessionState, Space, SpaceLocationFlags, ViewConfigurationType, headless,
};
use thiserror::Error;

/// Where the extension's trackers are, such as `/user/vive_tracker_htcx/role/waist`.
const ROLES: &str = "/user/vive_tracker_htcx/role/";

/// Why a runtime cannot be followed.
#[derive(Debug, Error)]
pub(crate) enum XrTrackerError {
    #[error("the OpenXR loader is not on this machine ({0})")]
    NoLoader(openxr::LoadError),
    #[error("no OpenXR runtime answers ({0})")]
    NoRuntime(openxr::sys::Result),
    #[error("the OpenXR runtime cannot be asked without showing pictures: it has no {0}")]
    NoExtension(&'static str),
    #[error("{0} has nothing to track ({1})")]
    NoSystem(String, openxr::sys::Result),
    #[error("`{0}` is none of /user/head, /user/hand/left, /user/hand/right and /user/vive_tracker_htcx/role/...")]
    UnknownPath(String),
    #[error("{0} breaks off: {1}")]
    Failed(String, openxr::sys::Result),
}

impl XrTrackerError {
    /// Whether it may be otherwise in a while.
    pub(crate) fn may_pass(&self) -> bool {
        matches!(self, Self::NoRuntime(_) | Self::NoSystem(..) | Self::Failed(..))
    }
}

/// A runtime that is followed.
pub(crate) struct XrTracker {
    name: String,
    session: Session<Headless>,
    /// They go with the session: nothing is shown.
    _frames: (FrameWaiter, FrameStream<Headless>),
    bound: Bound,
    base: Space,
    bodies: Vec<Body>,
    state: SessionState,
    /// Roles are actions of the same set.
    _roles: Vec<Action<Posef>>,
}

struct Body {
    space: Space,
    /// The right hand: what it presses is told.
    has_buttons: bool,
    was_seen: bool,
}

impl XrTracker {
    /// Finds a runtime, and asks it for the bodies at these paths.
    #[expect(unsafe_code, reason = "a session is made; all of it is in this function")]
    pub(crate) fn open(paths: &[String]) -> Result<Self, XrTrackerError> {
        let entry = entry().map_err(XrTrackerError::NoLoader)?.0;
        let available = entry.enumerate_extensions().map_err(XrTrackerError::NoRuntime)?;
        let wants_roles = paths.iter().any(|path| path.starts_with(ROLES));
        let mut wanted = ExtensionSet::default();
        wanted.mnd_headless = available.mnd_headless;
        wanted.htcx_vive_tracker_interaction = wants_roles && available.htcx_vive_tracker_interaction;
        let has_clock = time_extension(&mut wanted, &available);
        if !available.mnd_headless {
            return Err(XrTrackerError::NoExtension("XR_MND_headless"));
        }
        if !has_clock {
            return Err(XrTrackerError::NoExtension("conversion of times"));
        }
        if wants_roles && !available.htcx_vive_tracker_interaction {
            return Err(XrTrackerError::NoExtension("XR_HTCX_vive_tracker_interaction, which tells trackers by their role"));
        }
        let info = ApplicationInfo { application_name: "Heliodon", application_version: 1, ..Default::default() };
        let instance = entry.create_instance(&info, &wanted, &[]).map_err(XrTrackerError::NoRuntime)?;
        let name = instance
            .properties()
            .map_or_else(|_| "the OpenXR runtime".to_owned(), |of| format!("{} {}", of.runtime_name, of.runtime_version));
        let system =
            instance.system(FormFactor::HEAD_MOUNTED_DISPLAY).map_err(|why| XrTrackerError::NoSystem(name.clone(), why))?;
        let failed = |why| XrTrackerError::Failed(name.clone(), why);
        // SAFETY: a headless session has no graphics whose requirements would have to be asked for and met, and its information holds no handles.
        let session = unsafe { instance.create_session::<Headless>(system, &headless::SessionCreateInfo {}) };
        let (session, waiter, stream) = session.map_err(failed)?;
        let bound = Bound::new(&instance).map_err(failed)?;
        bound.suggest(&instance).map_err(failed)?;
        let roles = bound.roles(&instance, paths.iter().filter(|path| path.starts_with(ROLES))).map_err(failed)?;
        session.attach_action_sets(&[bound.set()]).map_err(failed)?;
        let reference = |kind| session.create_reference_space(kind, Posef::IDENTITY);
        let base = reference(ReferenceSpaceType::STAGE).or_else(|_| reference(ReferenceSpaceType::LOCAL)).map_err(failed)?;
        let mut of_roles = roles.iter();
        let mut bodies = Vec::new();
        for path in paths {
            let in_hand = |action: &Action<Posef>| action.create_space(&session, openxr::Path::NULL, Posef::IDENTITY);
            let space = match path.as_str() {
                "/user/head" => reference(ReferenceSpaceType::VIEW),
                "/user/hand/left" => in_hand(bound.grips()[0]),
                "/user/hand/right" => in_hand(bound.grips()[1]),
                _ => match of_roles.next().filter(|_| path.starts_with(ROLES)) {
                    Some(action) => in_hand(action),
                    None => return Err(XrTrackerError::UnknownPath(path.clone())),
                },
            };
            bodies.push(Body { space: space.map_err(failed)?, has_buttons: path == "/user/hand/right", was_seen: false });
        }
        let frames = (waiter, stream);
        Ok(Self { name, session, _frames: frames, bound, base, bodies, state: SessionState::IDLE, _roles: roles })
    }

    /// What the runtime sees now, which is `now_s` of the caller's clock.
    pub(crate) fn reports(&mut self, now_s: f64, reports: &mut Vec<Report>) -> Result<(), XrTrackerError> {
        self.follow(now_s, reports).map_err(|why| XrTrackerError::Failed(self.name.clone(), why))
    }

    fn follow(&mut self, now_s: f64, reports: &mut Vec<Report>) -> openxr::Result<()> {
        self.keep_up()?;
        if !matches!(self.state, SessionState::SYNCHRONIZED | SessionState::VISIBLE | SessionState::FOCUSED) {
            return Ok(());
        }
        self.session.sync_actions(&[ActiveActionSet::new(self.bound.set())])?;
        let now = self.session.instance().now()?;
        let said = self.bound.read(&self.session);
        for (number, body) in self.bodies.iter_mut().enumerate() {
            let location = body.space.locate(&self.base, now)?;
            let whole = SpaceLocationFlags::POSITION_VALID | SpaceLocationFlags::ORIENTATION_VALID;
            let tracked = SpaceLocationFlags::POSITION_TRACKED | SpaceLocationFlags::ORIENTATION_TRACKED;
            let is_seen = location.location_flags.contains(whole | tracked);
            // What was never seen is not lost, and what is lost may be pressed.
            let sight = match (is_seen, std::mem::replace(&mut body.was_seen, is_seen)) {
                (true, _) => Sight::Pose(pose(location.pose)),
                (false, true) => Sight::Lost,
                (false, false) if body.has_buttons => Sight::Untold,
                (false, false) => continue,
            };
            let mut report =
                Report { body: number, arrival_s: now_s, sight, buttons: None, axes: [None; heliodon_track::report::AXES] };
            if body.has_buttons {
                report.buttons = Some(Buttons::all(said.buttons));
                (report.axes[0], report.axes[1]) = (Some(said.right_stick.x), Some(said.right_stick.y));
            }
            reports.push(report);
        }
        Ok(())
    }

    /// Does what the runtime's events ask for.
    fn keep_up(&mut self) -> openxr::Result<()> {
        let mut events = EventDataBuffer::new();
        while let Some(event) = self.session.instance().poll_event(&mut events)? {
            match event {
                Event::SessionStateChanged(changed) => {
                    self.state = changed.state();
                    match self.state {
                        SessionState::READY => drop(self.session.begin(ViewConfigurationType::PRIMARY_STEREO)?),
                        SessionState::STOPPING => drop(self.session.end()?),
                        SessionState::LOSS_PENDING | SessionState::EXITING => {
                            return Err(openxr::sys::Result::ERROR_SESSION_LOST);
                        }
                        _ => {}
                    }
                }
                Event::InstanceLossPending(_) => return Err(openxr::sys::Result::ERROR_INSTANCE_LOST),
                _ => {}
            }
        }
        Ok(())
    }
}

/// Lets times of this machine's clock be told in the runtime's.
fn time_extension(wanted: &mut ExtensionSet, available: &ExtensionSet) -> bool {
    #[cfg(windows)]
    {
        wanted.khr_win32_convert_performance_counter_time = available.khr_win32_convert_performance_counter_time;
        wanted.khr_win32_convert_performance_counter_time
    }
    #[cfg(not(windows))]
    {
        wanted.khr_convert_timespec_time = available.khr_convert_timespec_time;
        wanted.khr_convert_timespec_time
    }
}

fn pose(pose: Posef) -> Pose {
    let (at, turn) = (pose.position, pose.orientation);
    Pose { position: Vec3::new(at.x, at.y, at.z), orientation: Quat::from_xyzw(turn.x, turn.y, turn.z, turn.w) }
}
