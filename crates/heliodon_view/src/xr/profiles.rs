//! What each kind of controller calls its sticks and buttons.
//!
//! Interaction profiles of the OpenXR 1.0 specification, section 6.4. A runtime takes those it knows and brings others' controllers to one of
//! them.

/// What controllers are asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Asked {
    /// Where the hands are.
    GripLeft,
    GripRight,
    /// Where the right one points.
    AimRight,
    /// The left stick.
    Move,
    /// The right stick.
    Turn,
    /// The wand's buttons, from the first on: trigger, A, B, menu, and what the right and the left hand close on.
    Trigger,
    First,
    Second,
    Menu,
    SqueezeRight,
    SqueezeLeft,
}

impl Asked {
    #[cfg(test)]
    pub(super) const ALL: [Self; 11] = [
        Self::GripLeft,
        Self::GripRight,
        Self::AimRight,
        Self::Move,
        Self::Turn,
        Self::Trigger,
        Self::First,
        Self::Second,
        Self::Menu,
        Self::SqueezeRight,
        Self::SqueezeLeft,
    ];

    /// The wand's buttons, in their order.
    pub(super) const BUTTONS: [Self; 6] =
        [Self::Trigger, Self::First, Self::Second, Self::Menu, Self::SqueezeRight, Self::SqueezeLeft];

    /// The action's name, and the one that a runtime shows to people.
    pub(super) fn names(self) -> (&'static str, &'static str) {
        match self {
            Self::GripLeft => ("grip_left", "Left hand"),
            Self::GripRight => ("grip_right", "Right hand"),
            Self::AimRight => ("aim_right", "Where the right hand points"),
            Self::Move => ("move", "Move"),
            Self::Turn => ("turn", "Turn"),
            Self::Trigger => ("wand_1", "Let the day pass, or pause it; use what is before you; drag the time line"),
            Self::First => ("wand_2", "Fly, walk or be guided"),
            Self::Second => ("wand_3", "Back to the beginning"),
            Self::Menu => ("wand_4", "Ahead is where you look"),
            Self::SqueezeRight => ("wand_5", "Take with the right hand, or let go"),
            Self::SqueezeLeft => ("wand_6", "Take with the left hand, or let go"),
        }
    }
}

/// A kind of controller: what is asked for, and the paths that answer it, the hand first (`L` or `R`).
pub(super) struct Profile {
    pub path: &'static str,
    pub paths: &'static [(Asked, &'static str)],
}

/// Poses, which every kind has.
const POSES: [(Asked, &str); 3] =
    [(Asked::GripLeft, "L/grip/pose"), (Asked::GripRight, "R/grip/pose"), (Asked::AimRight, "R/aim/pose")];

/// All kinds.
pub(super) const PROFILES: [Profile; 5] = [
    Profile {
        path: "/interaction_profiles/khr/simple_controller",
        paths: &[
            (Asked::Trigger, "R/select/click"),
            (Asked::First, "L/select/click"),
            (Asked::Menu, "L/menu/click"),
            (Asked::Menu, "R/menu/click"),
        ],
    },
    Profile {
        path: "/interaction_profiles/oculus/touch_controller",
        paths: &[
            (Asked::Move, "L/thumbstick"),
            (Asked::Turn, "R/thumbstick"),
            (Asked::Trigger, "R/trigger/value"),
            (Asked::First, "R/a/click"),
            (Asked::Second, "R/b/click"),
            // The right one's is the system's.
            (Asked::Menu, "L/menu/click"),
            (Asked::SqueezeRight, "R/squeeze/value"),
            (Asked::SqueezeLeft, "L/squeeze/value"),
        ],
    },
    Profile {
        path: "/interaction_profiles/valve/index_controller",
        paths: &[
            (Asked::Move, "L/thumbstick"),
            (Asked::Turn, "R/thumbstick"),
            (Asked::Trigger, "R/trigger/click"),
            (Asked::First, "R/a/click"),
            (Asked::Second, "R/b/click"),
            // It has no menu button.
            (Asked::Menu, "L/b/click"),
            (Asked::SqueezeRight, "R/squeeze/value"),
            (Asked::SqueezeLeft, "L/squeeze/value"),
        ],
    },
    Profile {
        path: "/interaction_profiles/microsoft/motion_controller",
        paths: &[
            (Asked::Move, "L/thumbstick"),
            (Asked::Turn, "R/thumbstick"),
            (Asked::Trigger, "R/trigger/value"),
            (Asked::First, "R/trackpad/click"),
            (Asked::Second, "L/trackpad/click"),
            (Asked::SqueezeRight, "R/squeeze/click"),
            (Asked::SqueezeLeft, "L/squeeze/click"),
            (Asked::Menu, "L/menu/click"),
            (Asked::Menu, "R/menu/click"),
        ],
    },
    Profile {
        path: "/interaction_profiles/htc/vive_controller",
        paths: &[
            (Asked::Move, "L/trackpad"),
            (Asked::Turn, "R/trackpad"),
            (Asked::Trigger, "R/trigger/click"),
            (Asked::First, "R/trackpad/click"),
            (Asked::Second, "L/trackpad/click"),
            (Asked::SqueezeRight, "R/squeeze/click"),
            (Asked::SqueezeLeft, "L/squeeze/click"),
            (Asked::Menu, "L/menu/click"),
            (Asked::Menu, "R/menu/click"),
        ],
    },
];

impl Profile {
    /// All that is bound, with whole paths.
    pub(super) fn bindings(&self) -> impl Iterator<Item = (Asked, String)> {
        POSES.iter().chain(self.paths).map(|(asked, path)| {
            let hand = if path.starts_with('L') { "left" } else { "right" };
            (*asked, format!("/user/hand/{hand}/input{}", &path[1..]))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_whole_and_nothing_is_bound_twice() {
        for profile in PROFILES {
            let bound: Vec<(Asked, String)> = profile.bindings().collect();
            for (number, (asked, path)) in bound.iter().enumerate() {
                assert!(path.starts_with("/user/hand/left/input/") || path.starts_with("/user/hand/right/input/"), "{path}");
                assert!(!bound[..number].iter().any(|(_, other)| other == path), "{path} of {}", profile.path);
                let is_pose = matches!(asked, Asked::GripLeft | Asked::GripRight | Asked::AimRight);
                assert_eq!(path.ends_with("/pose"), is_pose);
            }
            // A simple controller has two buttons at each hand and no stick.
            let simple = profile.path.contains("simple");
            let has = |asked: Asked| bound.iter().any(|(of, _)| *of == asked);
            assert!(Asked::ALL.into_iter().all(|asked| has(asked) || simple), "{}", profile.path);
            assert!(has(Asked::Trigger) && has(Asked::Menu));
        }
    }

    #[test]
    fn names_are_as_openxr_wants_them() {
        for asked in Asked::ALL {
            let (name, shown) = asked.names();
            assert!(name.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_'));
            assert!(!shown.is_empty() && shown.len() < 128);
        }
    }
}
