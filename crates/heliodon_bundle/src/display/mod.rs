//! A display: the file `display.toml` that tells a viewer of its screens, trackers, keys and of who may give it orders.
//!
//! It lies beside a site or is a user's own. Its coordinates are the room's in which the screens stand: right-handed, metres, +Y up from
//! the floor, -Z ahead. [`Display::read`] answers with a display whose every number is in range, or with a [`ConfigError`] that names
//! the line and column to mend.

mod check;
mod preset;
mod template;
mod types;

pub use preset::Preset;
pub use types::{
    Blend, BodyEntry, BodyKind, Control, Correction, DEFAULT_SIZE_PX, DisplayFile, DisplayInfo, Headset, HeadsetTimeline,
    InputSettings, Kiosk, MonitorName, Navigation, Output, Passes, Place, Protocol, ScreenEntry, Stereo, TrackerEntry,
};

use crate::config::{ConfigError, Kind, Source};
use heliodon_math::glam::DVec3;
use heliodon_math::screen::{Screen, ScreenFault};
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::ops::Deref;
use std::path::{Path, PathBuf};

/// The name of the file that is looked for beside a site.
pub const DISPLAY_FILE_NAME: &str = "display.toml";

const KIND: Kind = Kind {
    many_tables: &["screen", "tracker", "tracker.body"],
    subject: "a display",
    reference: "schema/display.schema.json and `heliodon display --preset flatworld` show what can be written",
    missing: &[
        ("corners", "give lower left, lower right and upper left corner, in metres of the room"),
        ("name", "give it a name, which messages call it by"),
        ("protocol", "write protocol = \"osc\", \"dtrack\", \"recording\" or \"simulated\""),
        ("is", "write is = \"head\", \"wand\" or \"left-hand\""),
    ],
    no_file: "`heliodon display --preset flatworld -o display.toml` makes one",
};

/// A display that was read and checked; dereferences to its [`DisplayFile`].
#[derive(Clone, Debug)]
pub struct Display {
    file: DisplayFile,
    source: Source,
}

impl Display {
    /// Reads and checks a `display.toml`.
    ///
    /// # Errors
    /// The first thing that is wrong, with its place and remedy.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, ConfigError> {
        Self::from_source(Source::read(&KIND, path.as_ref())?)
    }

    /// Parses and checks the text of a `display.toml`; `file` is its path, from which relative paths start and which messages name.
    ///
    /// # Errors
    /// The first thing that is wrong, with its place and remedy.
    pub fn parse(text: &str, file: impl AsRef<Path>) -> Result<Self, ConfigError> {
        Self::from_source(Source::new(&KIND, file.as_ref(), text))
    }

    /// A preset, as if its file had been read.
    #[must_use]
    pub fn preset(preset: Preset) -> Self {
        let file = preset.file();
        let source = Source::new(&KIND, Path::new(preset.name()), &file.to_toml_string());
        Self { file, source }
    }

    /// The same display with a recording of poses in place of its trackers: body 0 is the head, 1 the wand, 2 the left hand.
    #[must_use]
    pub fn with_recording(mut self, recording: &Path, repeat: bool) -> Self {
        // From this folder, not from the display's.
        let file = std::path::absolute(recording).unwrap_or_else(|_| recording.to_owned());
        let body = |is: BodyKind| BodyEntry { is, address: None, id: None, flystick: None, offset: [0.0; 3] };
        let bodies = BodyKind::ALL.map(body).into();
        self.file.trackers =
            vec![TrackerEntry { file: Some(file), repeat, bodies, ..TrackerEntry::new("recording", Protocol::Recording) }];
        self
    }

    fn from_source(source: Source) -> Result<Self, ConfigError> {
        let file = source.parse()?;
        check::check(&file).map_err(|fault| source.fault(fault))?;
        Ok(Self { file, source })
    }

    /// What it holds.
    #[must_use]
    pub fn file(&self) -> &DisplayFile {
        &self.file
    }

    /// The path of the file, or the name of the preset.
    #[must_use]
    pub fn path(&self) -> &Path {
        self.source.file()
    }

    /// A path that the file names, from the folder it lies in.
    #[must_use]
    pub fn resolve(&self, named: &Path) -> PathBuf {
        self.source.folder().join(named)
    }

    /// An error about a key, for what only later stages can find: `&["tracker", "0", "axes"]`.
    #[must_use]
    pub fn error_at(&self, key_path: &[&str], message: impl Into<String>, remedy: impl Into<String>) -> ConfigError {
        let path: Vec<String> = key_path.iter().map(|&key| key.to_owned()).collect();
        self.source.error_at(&path, message.into(), remedy.into())
    }
}

impl Deref for Display {
    type Target = DisplayFile;

    fn deref(&self) -> &DisplayFile {
        &self.file
    }
}

impl DisplayFile {
    /// The file for people to go on from: what is set, and beside it, commented out, what could be.
    #[must_use]
    pub fn to_toml_string(&self) -> String {
        template::write(self)
    }

    /// The JSON schema of `display.toml`.
    #[must_use]
    pub fn json_schema() -> String {
        crate::config::json_schema::<Self>()
    }
}

impl ScreenEntry {
    /// The screen in the room.
    ///
    /// # Errors
    /// If its corners are none of a rectangle.
    pub fn screen(&self) -> Result<Screen, ScreenFault> {
        Screen::from_corners(self.corners.map(DVec3::from))
    }
}

/// The port to which DTrack sends if nothing else is said.
const TRACKER_PORT: u16 = 5000;

/// `HOST:PORT`, or a port alone, which is this machine's own loopback address. Names are not looked up.
fn socket_address(text: &str) -> Option<SocketAddr> {
    match text.parse::<u16>() {
        Ok(port) => Some(SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), port)),
        Err(_) => text.parse().ok(),
    }
}

impl TrackerEntry {
    /// Where its packets come to: on loopback unless `listen` says otherwise. `None` if what it says is no address.
    #[must_use]
    pub fn address(&self) -> Option<SocketAddr> {
        self.listen.as_deref().map_or_else(|| socket_address(&TRACKER_PORT.to_string()), socket_address)
    }
}

impl Control {
    /// Where orders come to. `None` if what it says is no address.
    #[must_use]
    pub fn address(&self) -> Option<SocketAddr> {
        socket_address(&self.listen)
    }
}
