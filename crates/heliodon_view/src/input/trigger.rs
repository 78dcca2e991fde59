//! What sets an action off: a key, a sign, a button, a stick, a wheel, a gesture.

use bevy::input::gamepad::{GamepadAxis, GamepadButton};
use bevy::prelude::{KeyCode, MouseButton};
use heliodon_track::gesture::Flick;
use std::fmt;

/// What an action can be bound to.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Trigger {
    /// A key, by where it is.
    Key(KeyCode),
    /// A key, by what is written on it.
    Sign(String),
    /// A button of the mouse.
    Mouse(MouseButton),
    /// The wheel, away from the visitor (`true`) or towards.
    Wheel(bool),
    /// A button of a game controller.
    Pad(GamepadButton),
    /// A stick of a game controller, to its positive side (`true`) or its negative.
    Stick(GamepadAxis, bool),
    /// A flick of a mouse in the air.
    Flick(Flick),
    /// A button of the tracked wand, counted from 1.
    Wand(u8),
    /// The wand's stick, x (0) or y (1), to its positive side or its negative.
    WandStick(u8, bool),
    /// A flick of the wand.
    WandFlick(Flick),
}

/// Keys that can be bound.
const KEYS: [KeyCode; 88] = {
    use KeyCode::*;
    [
        KeyA,
        KeyB,
        KeyC,
        KeyD,
        KeyE,
        KeyF,
        KeyG,
        KeyH,
        KeyI,
        KeyJ,
        KeyK,
        KeyL,
        KeyM,
        KeyN,
        KeyO,
        KeyP,
        KeyQ,
        KeyR,
        KeyS,
        KeyT,
        KeyU,
        KeyV,
        KeyW,
        KeyX,
        KeyY,
        KeyZ,
        Digit0,
        Digit1,
        Digit2,
        Digit3,
        Digit4,
        Digit5,
        Digit6,
        Digit7,
        Digit8,
        Digit9,
        Numpad0,
        Numpad1,
        Numpad2,
        Numpad3,
        Numpad4,
        Numpad5,
        Numpad6,
        Numpad7,
        Numpad8,
        Numpad9,
        NumpadAdd,
        NumpadSubtract,
        NumpadMultiply,
        NumpadDivide,
        NumpadDecimal,
        NumpadEnter,
        ArrowLeft,
        ArrowRight,
        ArrowUp,
        ArrowDown,
        Space,
        Enter,
        Tab,
        Escape,
        Backspace,
        Delete,
        Insert,
        Home,
        End,
        PageUp,
        PageDown,
        ShiftLeft,
        ShiftRight,
        ControlLeft,
        ControlRight,
        AltLeft,
        AltRight,
        F1,
        F2,
        F3,
        F4,
        F5,
        F6,
        F7,
        F8,
        F9,
        F10,
        F11,
        F12,
        Minus,
        Equal,
        Backquote,
    ]
};

const PAD_BUTTONS: [GamepadButton; 17] = {
    use GamepadButton::*;
    [
        South,
        East,
        North,
        West,
        LeftTrigger,
        LeftTrigger2,
        RightTrigger,
        RightTrigger2,
        Select,
        Start,
        Mode,
        LeftThumb,
        RightThumb,
        DPadUp,
        DPadDown,
        DPadLeft,
        DPadRight,
    ]
};

const STICKS: [(&str, GamepadAxis); 6] = [
    ("LeftX", GamepadAxis::LeftStickX),
    ("LeftY", GamepadAxis::LeftStickY),
    ("RightX", GamepadAxis::RightStickX),
    ("RightY", GamepadAxis::RightStickY),
    ("LeftZ", GamepadAxis::LeftZ),
    ("RightZ", GamepadAxis::RightZ),
];

const MOUSE_BUTTONS: [MouseButton; 5] =
    [MouseButton::Left, MouseButton::Right, MouseButton::Middle, MouseButton::Back, MouseButton::Forward];

const FLICKS: [(&str, Flick); 4] = [("left", Flick::Left), ("right", Flick::Right), ("up", Flick::Up), ("down", Flick::Down)];

/// What can be written, for people.
pub const NOTATION: &str = "a key (Space, W, F1, Left, PageUp, Numpad5), sign:+ (the key that says so), mouse:Left, wheel:Up, pad:South \
    (a controller's buttons: South, East, North, West, LeftTrigger, LeftTrigger2, Select, Start, LeftThumb, DPadUp ...), stick:LeftX+ \
    (its sticks: LeftX, LeftY, RightX, RightY with + or -), flick:Left (a mouse in the air), wand:1 (its buttons), wand:stick-x+, wand:flick-left";

/// A key's name: W for KeyW, Left for ArrowLeft.
fn key_name(key: KeyCode) -> String {
    let name = format!("{key:?}");
    ["Key", "Digit", "Arrow"].iter().find_map(|prefix| name.strip_prefix(prefix)).unwrap_or(&name).to_owned()
}

fn sided(text: &str) -> Option<(&str, bool)> {
    text.strip_suffix('+').map(|axis| (axis, true)).or_else(|| text.strip_suffix('-').map(|axis| (axis, false)))
}

impl Trigger {
    /// The trigger that is written so; capitals do not matter but in signs.
    #[must_use]
    pub fn parse(text: &str) -> Option<Self> {
        let Some((kind, what)) = text.split_once(':').filter(|(kind, _)| !kind.is_empty()) else {
            return KEYS.into_iter().find(|&key| key_name(key).eq_ignore_ascii_case(text)).map(Self::Key);
        };
        let flick = |name: &str| FLICKS.iter().find(|(known, _)| known.eq_ignore_ascii_case(name)).map(|(_, flick)| *flick);
        match kind {
            "sign" => (what.chars().count() == 1).then(|| Self::Sign(what.to_owned())),
            "mouse" => MOUSE_BUTTONS.into_iter().find(|b| format!("{b:?}").eq_ignore_ascii_case(what)).map(Self::Mouse),
            "wheel" => match what.to_ascii_lowercase().as_str() {
                "up" => Some(Self::Wheel(true)),
                "down" => Some(Self::Wheel(false)),
                _ => None,
            },
            "pad" => PAD_BUTTONS.into_iter().find(|b| format!("{b:?}").eq_ignore_ascii_case(what)).map(Self::Pad),
            "stick" => {
                let (name, positive) = sided(what)?;
                STICKS.iter().find(|(known, _)| known.eq_ignore_ascii_case(name)).map(|(_, axis)| Self::Stick(*axis, positive))
            }
            "flick" => flick(what).map(Self::Flick),
            "wand" => match what.to_ascii_lowercase().as_str() {
                what if what.starts_with("flick-") => flick(&what[6..]).map(Self::WandFlick),
                what if what.starts_with("stick-") => match sided(&what[6..])? {
                    ("x", positive) => Some(Self::WandStick(0, positive)),
                    ("y", positive) => Some(Self::WandStick(1, positive)),
                    _ => None,
                },
                number => number.parse().ok().filter(|number| (1..=32).contains(number)).map(Self::Wand),
            },
            _ => None,
        }
    }

    /// Whether it is a flick, a turn of a wheel or a sign: something that happens and is not held.
    #[must_use]
    pub fn is_momentary(&self) -> bool {
        matches!(self, Self::Sign(_) | Self::Wheel(_) | Self::Flick(_) | Self::WandFlick(_))
    }

    /// Whether it belongs to a keyboard or a mouse on a desk.
    #[must_use]
    pub fn is_of_desk(&self) -> bool {
        matches!(self, Self::Key(_) | Self::Sign(_) | Self::Mouse(_) | Self::Wheel(_))
    }

    /// As help on screen tells it.
    #[must_use]
    pub fn label(&self) -> String {
        match self {
            Self::Key(KeyCode::ShiftLeft | KeyCode::ShiftRight) => "Shift".to_owned(),
            Self::Key(KeyCode::Escape) => "Esc".to_owned(),
            Self::Key(key) => key_name(*key),
            Self::Sign(sign) => sign.clone(),
            Self::Mouse(MouseButton::Left) => "Click".to_owned(),
            Self::Mouse(button) => format!("{button:?} click"),
            Self::Wheel(_) => "Wheel".to_owned(),
            Self::Pad(button) => format!("{button:?}"),
            Self::Stick(axis, _) => format!("{axis:?}").replace("StickX", " stick").replace("StickY", " stick"),
            Self::Flick(flick) => format!("flick {}", format!("{flick:?}").to_lowercase()),
            Self::Wand(number) => format!("wand {number}"),
            Self::WandStick(..) => "wand's stick".to_owned(),
            Self::WandFlick(flick) => format!("wand's flick {}", format!("{flick:?}").to_lowercase()),
        }
    }
}

impl fmt::Display for Trigger {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let sign = |positive: &bool| if *positive { '+' } else { '-' };
        let flick_name = |flick: &Flick| FLICKS.iter().find(|(_, known)| known == flick).map_or("", |(name, _)| name);
        match self {
            Self::Key(key) => write!(f, "{}", key_name(*key)),
            Self::Sign(text) => write!(f, "sign:{text}"),
            Self::Mouse(button) => write!(f, "mouse:{button:?}"),
            Self::Wheel(up) => write!(f, "wheel:{}", if *up { "Up" } else { "Down" }),
            Self::Pad(button) => write!(f, "pad:{button:?}"),
            Self::Stick(axis, positive) => {
                let name = STICKS.iter().find(|(_, known)| known == axis).map_or("", |(name, _)| name);
                write!(f, "stick:{name}{}", sign(positive))
            }
            Self::Flick(flick) => write!(f, "flick:{}", flick_name(flick)),
            Self::Wand(number) => write!(f, "wand:{number}"),
            Self::WandStick(axis, positive) => {
                write!(f, "wand:stick-{}{}", ['x', 'y'][usize::from(*axis).min(1)], sign(positive))
            }
            Self::WandFlick(flick) => write!(f, "wand:flick-{}", flick_name(flick)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triggers_are_read_as_they_are_written() {
        for text in [
            "W",
            "Space",
            "F11",
            "Left",
            "5",
            "Numpad5",
            "sign:+",
            "sign::",
            "mouse:Right",
            "wheel:Down",
            "pad:DPadUp",
            "stick:RightY-",
            "flick:left",
            "wand:7",
            "wand:stick-y+",
            "wand:flick-down",
        ] {
            let trigger = Trigger::parse(text).unwrap_or_else(|| panic!("{text}"));
            assert_eq!(trigger.to_string(), text);
        }
        assert_eq!(Trigger::parse("space"), Trigger::parse("Space"));
        for text in
            ["", "Nowhere", "sign:", "sign:ab", "pad:Up", "stick:LeftX", "wand:0", "wand:33", "wand:stick-z+", "flick:", ":"]
        {
            assert_eq!(Trigger::parse(text), None, "{text}");
        }
    }

    #[test]
    fn every_key_has_a_name_of_its_own() {
        for key in KEYS {
            assert_eq!(Trigger::parse(&key_name(key)), Some(Trigger::Key(key)));
        }
    }
}
