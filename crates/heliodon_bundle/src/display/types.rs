//! The tables of `display.toml`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// What a `display.toml` holds. Without a `[[screen]]` it is a desktop: one window with the opening angle that the site was prepared
/// for.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct DisplayFile {
    /// The display as a whole.
    pub display: DisplayInfo,
    /// Where the room with the screens stands in the site.
    pub place: Place,
    /// The screens.
    #[serde(rename = "screen", skip_serializing_if = "Vec::is_empty")]
    pub screens: Vec<ScreenEntry>,
    /// Where poses of heads and hands come from.
    #[serde(rename = "tracker", skip_serializing_if = "Vec::is_empty")]
    pub trackers: Vec<TrackerEntry>,
    /// Keys, buttons, sticks and gestures.
    pub input: InputSettings,
    /// Comfort in headsets.
    pub headset: Headset,
    /// An unattended installation; without it the viewer is a program on somebody's desk.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kiosk: Option<Kiosk>,
    /// Orders from a show-control system.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub control: Option<Control>,
}

/// `[display]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct DisplayInfo {
    /// What people call it.
    pub name: String,
    /// Where the middle between the eyes is while nobody is tracked, metres in the room.
    pub eye: [f64; 3],
    /// From one eye to the other, metres. 0 makes both pictures of a stereo pair the same.
    #[schemars(range(min = 0, max = 1))]
    pub eye_separation_m: f64,
    /// Nothing nearer to an eye than this is drawn, metres.
    #[schemars(range(min = 0.001, max = 10))]
    pub near_m: f64,
    /// Nothing farther than this is drawn, metres; without it, there is no end.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub far_m: Option<f64>,
    /// In how many passes both eyes' pictures are drawn.
    pub passes: Passes,
    /// How a visitor gets about at first.
    pub navigation: Navigation,
    /// Where the text and the timeline are shown: a screen's name; without it, on the first one. "none" for nowhere.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hud: Option<String>,
}

impl Default for DisplayInfo {
    fn default() -> Self {
        Self {
            name: "display".to_owned(),
            eye: [0.0, 1.65, 0.0],
            eye_separation_m: 0.063,
            near_m: 0.05,
            far_m: None,
            passes: Passes::default(),
            navigation: Navigation::default(),
            hud: None,
        }
    }
}

/// In how many passes the site is drawn for two eyes; their pictures are the same.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Passes {
    /// In one where the device can (multiview); in two where it cannot, or where a processor draws, to which pixels are dear and vertices are not.
    #[default]
    Auto,
    /// In one wherever the device can.
    One,
    /// In two.
    Two,
}

/// How a visitor gets about.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Navigation {
    /// The room stands still, and only the head moves in it: a virtual window.
    Window,
    /// On foot over the ground, along walls.
    Walk,
    /// Through the air.
    #[default]
    Fly,
    /// Along the site's rooms, one after the other, by itself.
    Guided,
}

/// `[place]`: where the room with the screens stands in the site.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Place {
    /// The site's room whose middle the resting eye is put at; the first one, unless `at` says otherwise.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub room: Option<String>,
    /// Where the origin of the room with the screens is, in the site.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at: Option<[f64; 3]>,
    /// Where -Z of the room with the screens points, clockwise from the site's -Z, degrees; without it, towards what the site's room looks at.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub heading_deg: Option<f64>,
    /// Metres of the site for each metre of the room: 10 makes a visitor a giant, 0.1 an ant.
    #[schemars(range(min = 0.001, max = 1000))]
    pub scale: f64,
}

impl Default for Place {
    fn default() -> Self {
        Self { room: None, at: None, heading_deg: None, scale: 1.0 }
    }
}

/// `[[screen]]`: a flat rectangle of the room.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ScreenEntry {
    /// The screen's name.
    pub name: String,
    /// Lower left, lower right and upper left corner, seen from the visitor's side; metres in the room.
    pub corners: [[f64; 3]; 3],
    /// How both eyes' pictures reach the visitor.
    #[serde(default)]
    pub stereo: Stereo,
    /// Where the picture is shown; the right eye's goes to `output_right` where `stereo` is "pair".
    #[serde(default)]
    pub output: Output,
    /// The right eye's projector.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub output_right: Option<Output>,
    /// Where neighbours' pictures overlap.
    #[serde(default, skip_serializing_if = "Blend::is_none")]
    pub blend: Blend,
    /// What makes this projector's picture look as its neighbours'.
    #[serde(default, skip_serializing_if = "Correction::is_none")]
    pub colour: Correction,
}

/// How both eyes' pictures share an output.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Stereo {
    /// One picture, from between the eyes.
    #[default]
    Mono,
    /// The left eye's picture in the left half, each squeezed to half its width.
    SideBySide,
    /// The left eye's picture in the upper half, each squeezed to half its height.
    TopBottom,
    /// The left eye's picture in even rows, counted from above.
    Rows,
    /// The left eye's picture in even columns.
    Columns,
    /// The left eye's picture where row and column are both even or both odd.
    Checkerboard,
    /// For red and cyan glasses: red from the left eye's picture, green and blue from the right eye's.
    Anaglyph,
    /// Two outputs, one for each eye: projectors with filters.
    Pair,
    /// Only the left eye's picture, for one of two machines.
    Left,
    /// Only the right eye's.
    Right,
}

impl Stereo {
    /// Whether two eyes' pictures are drawn.
    #[must_use]
    pub fn is_double(self) -> bool {
        !matches!(self, Self::Mono | Self::Left | Self::Right)
    }
}

/// Where a picture is shown: on a monitor, in a window without a frame, or in an image. Without any of them, in an ordinary window.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Output {
    /// All of a monitor: its number, counted from 1 as the system lists them, or its name.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub monitor: Option<MonitorName>,
    /// Place and size on the desktop: left, top, width, height in pixels.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub window: Option<[i32; 4]>,
    /// A file, where there is no display: pictures are written there.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub image: Option<PathBuf>,
    /// Size of an ordinary window's or of an image, pixels.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub size_px: Option<[u32; 2]>,
}

/// Size of pictures for which nothing else is said: FlatWorld's.
pub const DEFAULT_SIZE_PX: [u32; 2] = [1024, 768];

impl Output {
    /// Size in pixels, where the file says it: a monitor's is known when it is there.
    #[must_use]
    pub fn size_px(&self) -> [u32; 2] {
        match self.window {
            Some([_, _, width, height]) => [width.unsigned_abs(), height.unsigned_abs()],
            None => self.size_px.unwrap_or(DEFAULT_SIZE_PX),
        }
    }
}

/// A monitor, by its number from 1 or by name.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum MonitorName {
    /// As the system lists them, counted from 1.
    Number(u32),
    /// As the system calls it: "HDMI-1".
    Name(String),
}

/// `blend`: how far a picture's edges overlap with those of its neighbours, as parts of its width or height. There its light fades out, so
/// that both together give what one gives elsewhere.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Blend {
    /// At the left edge.
    #[schemars(range(min = 0, max = 0.5))]
    pub left: f64,
    /// At the right edge.
    #[schemars(range(min = 0, max = 0.5))]
    pub right: f64,
    /// At the upper edge.
    #[schemars(range(min = 0, max = 0.5))]
    pub top: f64,
    /// At the lower edge.
    #[schemars(range(min = 0, max = 0.5))]
    pub bottom: f64,
    /// The projector's gamma: its light is its input to this power.
    #[schemars(range(min = 1, max = 4))]
    pub gamma: f64,
}

impl Default for Blend {
    fn default() -> Self {
        Self { left: 0.0, right: 0.0, top: 0.0, bottom: 0.0, gamma: 2.2 }
    }
}

impl Blend {
    /// Whether no edge overlaps.
    #[must_use]
    pub fn is_none(&self) -> bool {
        [self.left, self.right, self.top, self.bottom] == [0.0; 4]
    }
}

/// `colour`: `black + (1 - black) * (gain * value)^gamma` of the values that go to the projector, for each of red, green and blue.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Correction {
    /// What values are multiplied by.
    pub gain: [f64; 3],
    /// The power that they are raised to.
    pub gamma: [f64; 3],
    /// The value of black: where pictures overlap, two projectors' blacks add up.
    pub black: [f64; 3],
}

impl Default for Correction {
    fn default() -> Self {
        Self { gain: [1.0; 3], gamma: [1.0; 3], black: [0.0; 3] }
    }
}

impl Correction {
    /// Whether it changes nothing.
    #[must_use]
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }
}

/// `[[tracker]]`: where poses come from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TrackerEntry {
    /// What it is called in messages.
    pub name: String,
    /// What it speaks.
    pub protocol: Protocol,
    /// The address and port of this machine that its packets come to, for "osc" and "dtrack".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub listen: Option<String>,
    /// The recording, for "recording".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<PathBuf>,
    /// The recording begins again at its end.
    #[serde(default)]
    pub repeat: bool,
    /// What it tracks.
    #[serde(default, rename = "body")]
    pub bodies: Vec<BodyEntry>,
    /// Which of the tracker's axes are the room's x, y and z: "x z -y" for a tracker whose z points up.
    #[serde(default = "own_axes")]
    pub axes: String,
    /// Turn from the tracker's axes, as `axes` names them, to the room's: around x, then y, then z, degrees.
    #[serde(default)]
    pub rotate_deg: [f64; 3],
    /// Where the tracker's origin is in the room, metres.
    #[serde(default)]
    pub translate: [f64; 3],
    /// Metres for each unit of the tracker. DTrack's millimetres are metres already.
    #[serde(default = "one")]
    pub scale: f64,
    /// How smooth: the One Euro filter's least cutoff frequency, Hz. Less is smoother and later; 0 for none.
    #[serde(default = "smoothing_hz")]
    #[schemars(range(min = 0, max = 120))]
    pub smoothing_hz: f64,
    /// How much of the smoothing motion takes away: the filter's beta for metres a second; a third of it for radians a second.
    #[serde(default = "smoothing_beta")]
    pub smoothing_beta: f64,
    /// How far ahead poses are predicted, milliseconds: the time from the tracker to the screen.
    #[serde(default = "prediction_ms")]
    #[schemars(range(min = 0, max = 200))]
    pub prediction_ms: f64,
    /// Without news for so long, a body counts as lost, milliseconds.
    #[serde(default = "lost_after_ms")]
    #[schemars(range(min = 10, max = 10000))]
    pub lost_after_ms: f64,
}

/// What a tracker speaks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Protocol {
    /// Open Sound Control 1.0 over UDP.
    Osc,
    /// The ASCII protocol of A.R.T.'s DTrack over UDP.
    Dtrack,
    /// An OpenXR runtime that can be asked without showing pictures (XR_MND_headless), such as Monado.
    Openxr,
    /// A recording of poses, played back.
    Recording,
    /// Keyboard and mouse stand in for the head.
    Simulated,
}

/// `[[tracker.body]]`: one thing that is tracked.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BodyEntry {
    /// Whose pose it is.
    pub is: BodyKind,
    /// Its OSC address: "/head". Its OpenXR path: "/user/head", "/user/hand/left", "/user/hand/right" (what the body's kind says without one), or a tracker's
    /// role, "/user/vive_tracker_htcx/role/waist".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub address: Option<String>,
    /// Its number as DTrack counts standard bodies, from 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub id: Option<u32>,
    /// Its number as DTrack counts Flysticks, from 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub flystick: Option<u32>,
    /// From the tracked target to the middle between the eyes or to the wand's tip, in the body's own axes, metres.
    #[serde(default)]
    pub offset: [f64; 3],
}

/// Whose pose a body's is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum BodyKind {
    /// The visitor's head.
    Head,
    /// The wand, or the right hand.
    Wand,
    /// The left hand.
    LeftHand,
}

impl BodyKind {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Head, Self::Wand, Self::LeftHand];

    /// As files write it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Head => "head",
            Self::Wand => "wand",
            Self::LeftHand => "left-hand",
        }
    }
}

fn own_axes() -> String {
    "x y z".to_owned()
}

fn one() -> f64 {
    1.0
}

fn smoothing_hz() -> f64 {
    1.5
}

fn smoothing_beta() -> f64 {
    60.0
}

fn prediction_ms() -> f64 {
    50.0
}

fn lost_after_ms() -> f64 {
    100.0
}

impl TrackerEntry {
    /// A tracker without a body, everything else as it comes.
    #[must_use]
    pub fn new(name: &str, protocol: Protocol) -> Self {
        Self {
            name: name.to_owned(),
            protocol,
            listen: None,
            file: None,
            repeat: false,
            bodies: Vec::new(),
            axes: own_axes(),
            rotate_deg: [0.0; 3],
            translate: [0.0; 3],
            scale: one(),
            smoothing_hz: smoothing_hz(),
            smoothing_beta: smoothing_beta(),
            prediction_ms: prediction_ms(),
            lost_after_ms: lost_after_ms(),
        }
    }
}

/// `[input]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct InputSettings {
    /// What of a stick's way counts for nothing, as part of it.
    #[schemars(range(min = 0, max = 0.9))]
    pub dead_zone: f64,
    /// Metres a second at first.
    #[schemars(range(min = 0.01, max = 200))]
    pub pace_m_s: f64,
    /// How fast a stick turns the view, degrees a second.
    #[schemars(range(min = 1, max = 720))]
    pub turn_deg_s: f64,
    /// What a flick of a wireless mouse in the air needs at least, pixels a second.
    #[schemars(range(min = 10, max = 100000))]
    pub flick_px_s: f64,
    /// The mouse is a free-floating one: its motion is for flicks, and does not turn the view.
    pub air_mouse: bool,
    /// What sets off each action, in place of what does so by itself: `"day.play" = ["Space", "pad:South"]`. `heliodon display --actions` lists
    /// actions and what they can be bound to.
    pub bind: BTreeMap<String, Vec<String>>,
}

impl Default for InputSettings {
    fn default() -> Self {
        Self { dead_zone: 0.15, pace_m_s: 2.0, turn_deg_s: 90.0, flick_px_s: 1500.0, air_mouse: false, bind: BTreeMap::new() }
    }
}

/// `[headset]`: comfort.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Headset {
    /// Degrees of a turn by the stick; 0 turns smoothly.
    #[schemars(range(min = 0, max = 180))]
    pub snap_turn_deg: f64,
    /// How far the edge of the view is darkened while one is moved, 0 to 1.
    #[schemars(range(min = 0, max = 1))]
    pub vignette: f64,
    /// Where the time line is.
    pub timeline: HeadsetTimeline,
}

impl Default for Headset {
    fn default() -> Self {
        Self { snap_turn_deg: 30.0, vignette: 0.7, timeline: HeadsetTimeline::default() }
    }
}

/// Where the time line of a headset is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum HeadsetTimeline {
    /// On the left wrist.
    #[default]
    Wrist,
    /// On the floor before the visitor.
    Floor,
    /// Nowhere.
    Hidden,
}

/// `[kiosk]`: an installation that runs by itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Kiosk {
    /// After so many seconds without a hand on anything, everything is as at the beginning, and the day begins again.
    #[schemars(range(min = 1, max = 86400))]
    pub idle_s: f64,
    /// Escape and the window's own buttons end the program; without it, only the system or the control does.
    pub may_quit: bool,
    /// Where slow frames are written to; relative to this file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub log: Option<PathBuf>,
    /// Frames of more milliseconds are slow.
    #[schemars(range(min = 1, max = 60000))]
    pub slow_ms: f64,
}

impl Default for Kiosk {
    fn default() -> Self {
        Self { idle_s: 120.0, may_quit: false, log: None, slow_ms: 100.0 }
    }
}

/// `[control]`: orders from outside, as OSC over UDP.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Control {
    /// The address and port that orders come to. Anything but a loopback address lets the whole network give them.
    pub listen: String,
    /// Bundles or sites that `/heliodon/site` may open, by name; relative to this file.
    pub sites: BTreeMap<String, PathBuf>,
}

impl Default for Control {
    fn default() -> Self {
        Self { listen: "127.0.0.1:9000".to_owned(), sites: BTreeMap::new() }
    }
}
