//! Which trigger sets off which action.

use super::action::{ACTIONS, Action, HELP};
use super::trigger::{NOTATION, Trigger};
use heliodon_bundle::display::InputSettings;
use std::collections::HashMap;

/// The triggers of each action.
#[derive(Clone, Debug, PartialEq)]
pub struct Bindings {
    of: Vec<Vec<Trigger>>,
}

/// Something wrong with a display's bindings; the rest of them holds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BindingFault {
    /// The name under `[input.bind]`.
    pub action: String,
    /// What is wrong.
    pub message: String,
    /// What to do about it.
    pub remedy: String,
}

impl Default for Bindings {
    fn default() -> Self {
        let parsed = |action: &Action| action.defaults().iter().filter_map(|text| Trigger::parse(text)).collect();
        Self { of: Action::ALL.iter().map(parsed).collect() }
    }
}

impl Bindings {
    /// What the settings bind, and by default whatever they say nothing of. A trigger that the settings bind is taken away from the action
    /// that it sets off by default. What is wrong is left out and told.
    #[must_use]
    pub fn new(settings: &InputSettings) -> (Self, Vec<BindingFault>) {
        let mut bindings = Self::default();
        let mut faults = Vec::new();
        let mut given: HashMap<Trigger, &str> = HashMap::new();
        let mut own: Vec<(Action, Vec<Trigger>)> = Vec::new();
        for (name, texts) in &settings.bind {
            let mut fault = |message: String, remedy: &str| {
                faults.push(BindingFault { action: name.clone(), message, remedy: remedy.to_owned() });
            };
            let Some(action) = Action::named(name) else {
                fault(format!("there is no action `{name}`"), "`heliodon display --actions` lists them");
                continue;
            };
            let mut triggers = Vec::new();
            for text in texts {
                match Trigger::parse(text) {
                    None => fault(format!("`{text}` is nothing that can be bound"), NOTATION),
                    Some(trigger) => match given.get(&trigger) {
                        Some(other) => fault(format!("`{text}` is bound to `{other}` already"), "keep one of the two"),
                        None => {
                            given.insert(trigger.clone(), name);
                            triggers.push(trigger);
                        }
                    },
                }
            }
            own.push((action, triggers));
        }
        bindings.of.iter_mut().for_each(|triggers| triggers.retain(|trigger| !given.contains_key(trigger)));
        for (action, triggers) in own {
            bindings.of[action as usize] = triggers;
        }
        (bindings, faults)
    }

    /// What sets an action off.
    #[must_use]
    pub fn triggers(&self, action: Action) -> &[Trigger] {
        &self.of[action as usize]
    }

    /// All that is bound.
    pub(super) fn iter(&self) -> impl Iterator<Item = (Action, &Trigger)> {
        (0..ACTIONS).flat_map(|number| self.of[number].iter().map(move |trigger| (Action::ALL[number], trigger)))
    }

    /// What the help on screen lists: what is bound, and what it does. Of what is not at a desk, only where it is `in_use`.
    #[must_use]
    pub fn help(&self, in_use: impl Fn(&Trigger) -> bool) -> Vec<(String, &'static str)> {
        let line = |actions: &[Action]| {
            let mut labels: Vec<String> = Vec::new();
            for kind in [true, false] {
                for trigger in actions.iter().flat_map(|&action| self.triggers(action)) {
                    let label = trigger.label();
                    if trigger.is_of_desk() == kind && in_use(trigger) && !labels.contains(&label) {
                        labels.push(label);
                    }
                }
            }
            labels.join("  ")
        };
        let lines = HELP.iter().map(|(actions, what)| (line(actions), *what));
        lines.filter(|(keys, _)| !keys.is_empty()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings(bind: &[(&str, &[&str])]) -> InputSettings {
        let bind =
            bind.iter().map(|(action, triggers)| ((*action).to_owned(), triggers.iter().map(|t| (*t).to_owned()).collect()));
        InputSettings { bind: bind.collect(), ..InputSettings::default() }
    }

    #[test]
    fn nothing_is_bound_twice_by_default() {
        let bindings = Bindings::default();
        let all: Vec<&Trigger> = bindings.iter().map(|(_, trigger)| trigger).collect();
        for (i, trigger) in all.iter().enumerate() {
            assert!(!all[..i].contains(trigger), "{trigger}");
        }
        for action in Action::ALL {
            assert_eq!(bindings.triggers(action).len(), action.defaults().len(), "{action:?}");
        }
    }

    #[test]
    fn what_a_display_binds_is_taken_from_others() {
        let (bindings, faults) = Bindings::new(&settings(&[("day.play", &["W", "pad:East"]), ("move.home", &[])]));
        assert!(faults.is_empty());
        let names = |action| bindings.triggers(action).iter().map(ToString::to_string).collect::<Vec<_>>();
        assert_eq!(names(Action::Play), ["W", "pad:East"]);
        assert_eq!(names(Action::Forward), ["stick:LeftY+", "wand:stick-y+"]);
        assert_eq!(names(Action::Hud), ["Tab"]);
        assert!(names(Action::Home).is_empty());
    }

    #[test]
    fn what_is_wrong_is_told_and_the_rest_holds() {
        let (bindings, faults) =
            Bindings::new(&settings(&[("day.play", &["Q", "Nothing"]), ("day.loop", &["Q", "P"]), ("dance", &["D"])]));
        let told: Vec<&str> = faults.iter().map(|fault| fault.message.as_str()).collect();
        let taken = "`Q` is bound to `day.loop` already";
        assert_eq!(told, ["there is no action `dance`", taken, "`Nothing` is nothing that can be bound"]);
        assert_eq!(bindings.triggers(Action::Loop).len(), 2);
        assert!(bindings.triggers(Action::Play).is_empty());
    }

    #[test]
    fn help_lists_what_is_bound() {
        let (bindings, _) = Bindings::new(&settings(&[("move.gait", &[])]));
        let desk = bindings.help(Trigger::is_of_desk);
        assert_eq!(desk[0], ("Space".to_owned(), "let the day pass, or pause it"));
        assert!(desk.iter().any(|(keys, what)| keys == "W  A  S  D" && *what == "move"));
        assert!(desk.iter().all(|(_, what)| !what.starts_with("fly")));
        let all = bindings.help(|_| true);
        assert_eq!(all[0].0, "Space  South  wand 1");
    }
}
