//! Displays to begin with.

use super::types::{
    BodyEntry, BodyKind, DisplayFile, DisplayInfo, Navigation, Output, Protocol, ScreenEntry, Stereo, TrackerEntry,
};

/// A kind of display.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Preset {
    /// One window, as without a display.toml.
    Desktop,
    /// A monitor of 24 inches as a window before a tracked head.
    Monitor,
    /// Two retro-projected walls that meet at a corner before the visitor, a pair of projectors for each: Pair and Piepol, "FlatWorld: a
    /// mixed reality environment for education and training", 2002.
    Flatworld,
    /// A room of three metres: left, front and right wall and the floor. Cruz-Neira, Sandin, DeFanti: "Surround-screen projection-based
    /// virtual reality: the design and implementation of the CAVE", 1993.
    Cave,
    /// Eight screens all around, leaning inwards above.
    Ring,
}

impl Preset {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Desktop, Self::Monitor, Self::Flatworld, Self::Cave, Self::Ring];

    /// Its name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Desktop => "desktop",
            Self::Monitor => "monitor",
            Self::Flatworld => "flatworld",
            Self::Cave => "cave",
            Self::Ring => "ring",
        }
    }

    /// The one that is called so.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|preset| preset.name() == name)
    }

    /// What its file holds.
    #[must_use]
    pub fn file(self) -> DisplayFile {
        let (screens, eye) = match self {
            Self::Desktop => (Vec::new(), DisplayInfo::default().eye),
            Self::Monitor => (monitor(), [0.0, 1.2, 0.0]),
            Self::Flatworld => (flatworld(), [0.0, 1.65, 0.0]),
            Self::Cave => (cave(), [0.0, 1.65, 0.0]),
            Self::Ring => (ring(), [0.0, 1.65, 0.0]),
        };
        let navigation = if screens.is_empty() { Navigation::Fly } else { Navigation::Window };
        let trackers = if screens.is_empty() { Vec::new() } else { vec![simulated()] };
        let display = DisplayInfo { name: self.name().to_owned(), eye, navigation, ..DisplayInfo::default() };
        DisplayFile { display, screens, trackers, ..DisplayFile::default() }
    }
}

/// Keyboard and mouse for the head, until a tracker takes its place.
fn simulated() -> TrackerEntry {
    let head = BodyEntry { is: BodyKind::Head, address: None, id: None, flystick: None, offset: [0.0; 3] };
    TrackerEntry { bodies: vec![head], ..TrackerEntry::new("keyboard", Protocol::Simulated) }
}

fn sized(width: u32, height: u32) -> Output {
    Output { size_px: Some([width, height]), ..Output::default() }
}

fn screen(name: &str, corners: [[f64; 3]; 3], stereo: Stereo, output: Output) -> ScreenEntry {
    let output_right = (stereo == Stereo::Pair).then(|| output.clone());
    ScreenEntry {
        name: name.to_owned(),
        corners,
        stereo,
        output,
        output_right,
        blend: Default::default(),
        colour: Default::default(),
    }
}

fn monitor() -> Vec<ScreenEntry> {
    let corners = [[-0.265, 1.05, -0.6], [0.265, 1.05, -0.6], [-0.265, 1.35, -0.6]];
    vec![screen("monitor", corners, Stereo::Mono, sized(1280, 720))]
}

fn flatworld() -> Vec<ScreenEntry> {
    // Walls of 3.2 x 2.4 m at right angles, the corner ahead.
    let (side, ahead, behind, height) = (2.263, -2.2, 0.063, 2.4);
    let left = [[-side, 0.0, behind], [0.0, 0.0, ahead], [-side, height, behind]];
    let right = [[0.0, 0.0, ahead], [side, 0.0, behind], [0.0, height, ahead]];
    [("left", left), ("right", right)].map(|(name, corners)| screen(name, corners, Stereo::Pair, sized(1024, 768))).into()
}

fn cave() -> Vec<ScreenEntry> {
    let (half, height) = (1.5, 3.0);
    let walls = [
        ("left", [[-half, 0.0, half], [-half, 0.0, -half], [-half, height, half]]),
        ("front", [[-half, 0.0, -half], [half, 0.0, -half], [-half, height, -half]]),
        ("right", [[half, 0.0, -half], [half, 0.0, half], [half, height, -half]]),
        // Its upper edge is the one that meets the front.
        ("floor", [[-half, 0.0, half], [half, 0.0, half], [-half, 0.0, -half]]),
    ];
    walls.map(|(name, corners)| screen(name, corners, Stereo::TopBottom, sized(1024, 2048))).into()
}

fn ring() -> Vec<ScreenEntry> {
    const SCREENS: u32 = 8;
    const LEAN_DEG: f64 = 10.0;
    let (radius, height) = (3.0, 2.4);
    let half_angle = std::f64::consts::PI / f64::from(SCREENS);
    let (lean_sin, lean_cos) = (libm::sin(LEAN_DEG.to_radians()), libm::cos(LEAN_DEG.to_radians()));
    // Edges meet below; above they would overlap, and the upper edge's ends hide behind the neighbours'.
    let half_width = radius * libm::tan(half_angle);
    let screens = (0..SCREENS).map(|number| {
        let around = 2.0 * half_angle * f64::from(number);
        let (sin, cos) = (libm::sin(around), libm::cos(around));
        // From the middle of the lower edge, to the right and inwards, to the room.
        let place = |right: f64, inwards: f64, up: f64| {
            let out = radius - inwards;
            let round = |v: f64| libm::round(v * 1e4) / 1e4;
            [round(sin * out + cos * right), round(up), round(-cos * out + sin * right)]
        };
        let corners = [
            place(-half_width, 0.0, 0.3),
            place(half_width, 0.0, 0.3),
            place(-half_width, height * lean_sin, 0.3 + height * lean_cos),
        ];
        screen(&format!("ring-{}", number + 1), corners, Stereo::Mono, sized(1024, 1024))
    });
    screens.collect()
}

#[cfg(test)]
mod tests {
    use super::super::Display;
    use super::*;

    #[test]
    fn presets_are_displays_and_say_so_in_their_files() {
        for preset in Preset::ALL {
            let display = Display::preset(preset);
            let read = Display::parse(&display.to_toml_string(), "display.toml").unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(*read.file(), preset.file());
            assert_eq!(Preset::named(preset.name()), Some(preset));
        }
    }

    #[test]
    fn walls_meet() {
        let of = |preset: Preset| preset.file().screens.iter().map(|s| s.screen().unwrap().corners()).collect::<Vec<_>>();
        let walls = of(Preset::Flatworld);
        assert!(walls[0][1].distance(walls[1][0]) < 1e-9 && walls[0][2].distance(walls[1][3]) < 1e-9);
        let cave = of(Preset::Cave);
        assert!(cave[0][1].distance(cave[1][0]) < 1e-9 && cave[1][1].distance(cave[2][0]) < 1e-9);
        assert!(cave[3][3].distance(cave[1][0]) < 1e-9 && cave[3][2].distance(cave[1][1]) < 1e-9);
        let ring = of(Preset::Ring);
        for (one, next) in ring.iter().zip(ring.iter().cycle().skip(1)) {
            assert!(one[1].distance(next[0]) < 1e-3, "{one:?} {next:?}");
        }
    }
}
