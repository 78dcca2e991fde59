//! What a visitor can do, by name.

/// An action: what keys, buttons, sticks and gestures are bound to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[repr(u8)]
pub enum Action {
    /// Let the day pass, or pause it.
    Play,
    /// A step of the day back.
    StepBack,
    /// A step of the day on.
    StepOn,
    /// The day passes more slowly.
    Slower,
    /// The day passes faster.
    Faster,
    /// Begin the day again at its end, or stop there.
    Loop,
    /// Smooth light, or the steps as they are.
    Blend,
    /// More exposure.
    Brighter,
    /// Less exposure.
    Darker,
    /// Exposure follows the day, or is held.
    HoldExposure,
    /// The other tone curve.
    ToneCurve,
    /// The grain of near surfaces, or none.
    Grain,
    /// Tell what is guessed from what was seen, or not.
    Guessed,
    /// Look around with the mouse.
    TakeMouse,
    /// Forward.
    Forward,
    /// Back.
    Back,
    /// To the left.
    Left,
    /// To the right.
    Right,
    /// Up, in flight.
    Rise,
    /// Down, in flight.
    Sink,
    /// Turn to the left.
    TurnLeft,
    /// Turn to the right.
    TurnRight,
    /// Look up.
    LookUp,
    /// Look down.
    LookDown,
    /// Hurry.
    Hurry,
    /// A quicker pace.
    PaceUp,
    /// A slower pace.
    PaceDown,
    /// Fly, walk, or whatever comes next.
    Gait,
    /// Inside the room's box, or free.
    KeepIn,
    /// Back to the beginning.
    Home,
    /// Straight ahead is where the head points now.
    Recentre,
    /// Cull what occluders hide, or not.
    CullHidden,
    /// Cull what is small, or not.
    CullSmall,
    /// Cull only what is smaller.
    CullLess,
    /// Cull what is larger, too.
    CullMore,
    /// The list of keys.
    Help,
    /// Text and timeline.
    Hud,
    /// What each feature takes of the processor.
    Costs,
    /// All of the screen, or a window.
    FullScreen,
    /// Save a picture.
    Picture,
    /// Take what is before the hand, or put down what it holds.
    Take,
    /// The same with the left hand.
    TakeLeft,
    /// Strike with what the hand holds, or put on what that brings.
    Use,
    /// Touch what is before the hand.
    Touch,
    /// Give the mouse back; quit.
    Leave,
}

/// How many there are.
pub(super) const ACTIONS: usize = Action::ALL.len();

impl Action {
    /// All of them, in the order of their numbers.
    pub const ALL: [Self; 45] = [
        Self::Play,
        Self::StepBack,
        Self::StepOn,
        Self::Slower,
        Self::Faster,
        Self::Loop,
        Self::Blend,
        Self::Brighter,
        Self::Darker,
        Self::HoldExposure,
        Self::ToneCurve,
        Self::Grain,
        Self::Guessed,
        Self::TakeMouse,
        Self::Forward,
        Self::Back,
        Self::Left,
        Self::Right,
        Self::Rise,
        Self::Sink,
        Self::TurnLeft,
        Self::TurnRight,
        Self::LookUp,
        Self::LookDown,
        Self::Hurry,
        Self::PaceUp,
        Self::PaceDown,
        Self::Gait,
        Self::KeepIn,
        Self::Home,
        Self::Recentre,
        Self::CullHidden,
        Self::CullSmall,
        Self::CullLess,
        Self::CullMore,
        Self::Help,
        Self::Hud,
        Self::Costs,
        Self::FullScreen,
        Self::Picture,
        Self::Take,
        Self::TakeLeft,
        Self::Use,
        Self::Touch,
        Self::Leave,
    ];

    /// Its name in `display.toml`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Play => "day.play",
            Self::StepBack => "day.back",
            Self::StepOn => "day.on",
            Self::Slower => "day.slower",
            Self::Faster => "day.faster",
            Self::Loop => "day.loop",
            Self::Blend => "day.blend",
            Self::Brighter => "exposure.up",
            Self::Darker => "exposure.down",
            Self::HoldExposure => "exposure.hold",
            Self::ToneCurve => "exposure.curve",
            Self::Grain => "view.grain",
            Self::Guessed => "view.guessed",
            Self::TakeMouse => "look.mouse",
            Self::Forward => "move.forward",
            Self::Back => "move.back",
            Self::Left => "move.left",
            Self::Right => "move.right",
            Self::Rise => "move.rise",
            Self::Sink => "move.sink",
            Self::TurnLeft => "look.left",
            Self::TurnRight => "look.right",
            Self::LookUp => "look.up",
            Self::LookDown => "look.down",
            Self::Hurry => "move.hurry",
            Self::PaceUp => "pace.up",
            Self::PaceDown => "pace.down",
            Self::Gait => "move.gait",
            Self::KeepIn => "move.room",
            Self::Home => "move.home",
            Self::Recentre => "look.recentre",
            Self::CullHidden => "cull.hidden",
            Self::CullSmall => "cull.small",
            Self::CullLess => "cull.less",
            Self::CullMore => "cull.more",
            Self::Help => "view.help",
            Self::Hud => "view.hud",
            Self::Costs => "view.costs",
            Self::FullScreen => "view.full",
            Self::Picture => "view.picture",
            Self::Take => "hand.take",
            Self::TakeLeft => "hand.take-left",
            Self::Use => "hand.use",
            Self::Touch => "hand.touch",
            Self::Leave => "view.leave",
        }
    }

    /// The one of this name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|action| action.name() == name)
    }

    /// What sets it off unless a display says otherwise.
    pub(super) fn defaults(self) -> &'static [&'static str] {
        match self {
            Self::Play => &["Space", "pad:South", "wand:1"],
            Self::StepBack => &["Left", "pad:DPadLeft", "flick:Left", "wand:flick-left"],
            Self::StepOn => &["Right", "pad:DPadRight", "flick:Right", "wand:flick-right"],
            // By what is written on the key, wherever a keyboard has it.
            Self::Slower => &["sign:["],
            Self::Faster => &["sign:]"],
            Self::Loop => &["L"],
            Self::Blend => &["B"],
            // The one shares its key with the plus on many keyboards.
            Self::Brighter => &["sign:+", "sign:=", "pad:DPadUp", "flick:Up", "wand:flick-up"],
            Self::Darker => &["sign:-", "pad:DPadDown", "flick:Down", "wand:flick-down"],
            Self::HoldExposure => &["X"],
            Self::ToneCurve => &["T"],
            Self::Grain => &["G"],
            Self::Guessed => &["U"],
            Self::TakeMouse => &["mouse:Left"],
            Self::Forward => &["W", "stick:LeftY+", "wand:stick-y+"],
            Self::Back => &["S", "stick:LeftY-", "wand:stick-y-"],
            Self::Left => &["A", "stick:LeftX-"],
            Self::Right => &["D", "stick:LeftX+"],
            Self::Rise => &["PageUp", "pad:RightTrigger2"],
            Self::Sink => &["PageDown", "pad:LeftTrigger2"],
            Self::TurnLeft => &["stick:RightX-", "wand:stick-x-"],
            Self::TurnRight => &["stick:RightX+", "wand:stick-x+"],
            Self::LookUp => &["stick:RightY+"],
            Self::LookDown => &["stick:RightY-"],
            Self::Hurry => &["ShiftLeft", "ShiftRight", "pad:LeftThumb"],
            Self::PaceUp => &["wheel:Up"],
            Self::PaceDown => &["wheel:Down"],
            Self::Gait => &["F", "pad:LeftTrigger", "wand:2"],
            Self::KeepIn => &["R"],
            Self::Home => &["Home", "pad:Select", "wand:3"],
            Self::Recentre => &["Y", "pad:RightThumb", "wand:4"],
            Self::CullHidden => &["O"],
            Self::CullSmall => &["C"],
            Self::CullLess => &["sign:,"],
            Self::CullMore => &["sign:."],
            Self::Help => &["H", "F1", "pad:Start"],
            Self::Hud => &["Tab", "pad:East"],
            Self::Costs => &["F3"],
            Self::FullScreen => &["F11"],
            Self::Picture => &["F12"],
            Self::Take => &["E", "pad:West", "wand:5"],
            Self::TakeLeft => &["wand:6"],
            // And a click while the mouse looks around, and the wand's first button: see `hands`.
            Self::Use => &["Q", "mouse:Right", "pad:RightTrigger"],
            Self::Touch => &["V", "pad:North"],
            Self::Leave => &["Escape"],
        }
    }
}

/// What the help on screen says of actions, those that belong together in one line.
pub(super) const HELP: [(&[Action], &str); 30] = [
    (&[Action::Play], "let the day pass, or pause it"),
    (&[Action::StepBack, Action::StepOn], "one step of the day back or on"),
    (&[Action::Slower, Action::Faster], "slower, faster"),
    (&[Action::Loop], "begin the day again at its end, or stop"),
    (&[Action::Blend], "smooth light, or the steps as they are"),
    (&[Action::Brighter, Action::Darker], "exposure, a quarter of a stop"),
    (&[Action::HoldExposure], "exposure follows the day, or is held"),
    (&[Action::ToneCurve], "tone curve: clamped or filmic"),
    (&[Action::Grain], "the grain of near surfaces, or none"),
    (&[Action::Guessed], "what no photograph saw, in blue, or not"),
    (&[Action::TakeMouse], "look around with the mouse; then use what you hold"),
    (&[Action::Take, Action::TakeLeft], "take a thing, or put it down"),
    (&[Action::Use], "strike with what you hold, or put it on"),
    (&[Action::Touch], "touch"),
    (&[Action::Forward, Action::Left, Action::Back, Action::Right], "move"),
    (&[Action::Hurry], "hurry"),
    (&[Action::Rise, Action::Sink], "rise and sink in flight"),
    (&[Action::TurnLeft, Action::TurnRight, Action::LookUp, Action::LookDown], "look around"),
    (&[Action::PaceUp, Action::PaceDown], "pace"),
    (&[Action::Gait], "fly, walk or be guided"),
    (&[Action::KeepIn], "inside the room's box, or free"),
    (&[Action::Home, Action::Recentre], "back to the beginning; ahead is where you look"),
    (&[Action::CullHidden], "cull what occluders hide, or not"),
    (&[Action::CullSmall], "cull what is small, or not"),
    (&[Action::CullLess, Action::CullMore], "how small, in pixels: less, more"),
    (&[Action::Help], "this help"),
    (&[Action::Hud], "hide or show text and timeline"),
    (&[Action::Costs], "what each feature takes of the processor"),
    (&[Action::FullScreen, Action::Picture], "all of the screen; save a picture beside you"),
    (&[Action::Leave], "give the mouse back; quit"),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn actions_stand_at_their_numbers_and_have_names_of_their_own() {
        for (number, action) in Action::ALL.into_iter().enumerate() {
            assert_eq!(action as usize, number);
            assert_eq!(Action::named(action.name()), Some(action));
        }
    }

    #[test]
    fn the_help_tells_of_every_action_once() {
        for action in Action::ALL {
            assert_eq!(HELP.iter().filter(|(actions, _)| actions.contains(&action)).count(), 1, "{action:?}");
        }
    }
}
