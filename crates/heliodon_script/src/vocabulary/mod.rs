//! The words that scripts have: one table, from which they are registered, checked and told of in the manual.

mod actions;
mod argument;
mod events;
mod questions;

pub use argument::{Argument, ArgumentKind};
pub(crate) use argument::{Literal, VISITOR};

use crate::action::{Action, Filling, Hand};
use crate::desk::Desk;
use crate::diagnostic::{Place, Wrong};
use crate::place::Spot;
use argument::Given;
use rhai::{Dynamic, FnPtr};

/// Where a word stands in the manual.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Group {
    /// What happens, and what is then to be done.
    Events,
    /// Timers.
    Time,
    /// What scripts say to one another.
    Messages,
    /// Moving, showing, playing.
    Actions,
    /// What the visitor is told.
    Visitor,
    /// What is kept.
    Memory,
    /// What can be asked.
    Questions,
}

impl Group {
    /// All of them, in the order of the manual.
    pub const ALL: [Self; 7] =
        [Self::Events, Self::Time, Self::Messages, Self::Actions, Self::Visitor, Self::Memory, Self::Questions];

    /// The heading of its chapter.
    #[must_use]
    pub fn title(self) -> &'static str {
        match self {
            Self::Events => "What happens",
            Self::Time => "Time",
            Self::Messages => "Messages",
            Self::Actions => "What is done to the site",
            Self::Visitor => "What the visitor is told and shown",
            Self::Memory => "What is kept",
            Self::Questions => "Questions",
        }
    }
}

/// A function that scripts can call.
#[derive(Debug)]
pub struct Word {
    /// Its name.
    pub name: &'static str,
    /// Where the manual tells of it.
    pub group: Group,
    /// What it is given, in order.
    pub arguments: &'static [Argument],
    /// How many of them there must be; the others are as the manual says.
    pub required: usize,
    /// What the event that its handler is given holds, with what each is.
    pub fields: &'static [(&'static str, &'static str)],
    /// What it does.
    pub what: &'static str,
    /// How it is used; a test compiles and runs it.
    pub example: &'static str,
    pub(crate) run: fn(&mut Call<'_>) -> Result<Dynamic, Wrong>,
}

/// Every word.
pub fn words() -> impl Iterator<Item = &'static Word> {
    events::WORDS.iter().chain(actions::WORDS).chain(questions::WORDS)
}

/// The word of a name.
#[must_use]
pub fn word(name: &str) -> Option<&'static Word> {
    words().find(|word| word.name == name)
}

impl Word {
    /// `move_to(what, place, [seconds], [easing])`.
    #[must_use]
    pub fn signature(&self) -> String {
        let arguments: Vec<String> = self
            .arguments
            .iter()
            .enumerate()
            .map(|(i, argument)| if i < self.required { argument.name.to_owned() } else { format!("[{}]", argument.name) })
            .collect();
        format!("{}({})", self.name, arguments.join(", "))
    }

    /// Runs it with what a script gave.
    pub(crate) fn call(&'static self, desk: &mut Desk, place: Place, values: &[Dynamic]) -> Result<Dynamic, Wrong> {
        let mut given = Vec::with_capacity(values.len());
        for (argument, value) in self.arguments.iter().zip(values) {
            given.push(
                argument
                    .read(desk, value)
                    .map_err(|wrong| Wrong::new(format!("{}: {}", self.name, wrong.message), wrong.remedy))?,
            );
        }
        (self.run)(&mut Call { desk, word: self, place, given })
    }
}

/// A word as it is called: what was given, and the desk of the script that calls.
pub(crate) struct Call<'a> {
    pub desk: &'a mut Desk,
    pub word: &'static Word,
    pub place: Place,
    given: Vec<Given>,
}

impl Call<'_> {
    fn given(&self, i: usize) -> &Given {
        self.given.get(i).unwrap_or(&Given::Nothing)
    }

    pub fn text(&self, i: usize) -> String {
        self.text_or(i, "")
    }

    pub fn text_or(&self, i: usize, otherwise: &str) -> String {
        if let Given::Text(text) = self.given(i) { text.to_string() } else { otherwise.to_owned() }
    }

    pub fn number_or(&self, i: usize, otherwise: f64) -> f64 {
        if let Given::Number(number) = self.given(i) { *number } else { otherwise }
    }

    /// As actions carry numbers.
    #[expect(clippy::cast_possible_truncation, reason = "seconds, degrees and the like, within the range of their argument")]
    pub fn single_or(&self, i: usize, otherwise: f64) -> f32 {
        self.number_or(i, otherwise) as f32
    }

    pub fn flag_or(&self, i: usize, otherwise: bool) -> bool {
        if let Given::Flag(flag) = self.given(i) { *flag } else { otherwise }
    }

    pub fn spot(&self, i: usize) -> Option<Spot> {
        if let Given::Spot(spot) = self.given(i) { Some(*spot) } else { None }
    }

    pub fn hand(&self, i: usize) -> Hand {
        Hand::from_word(&self.text_or(i, ""))
    }

    pub fn data(&self, i: usize) -> Dynamic {
        if let Given::Data(data) = self.given(i) { data.clone() } else { Dynamic::UNIT }
    }

    pub fn filling(&self, i: usize) -> Filling {
        if let Given::Filling(filling) = self.given(i) { filling.clone() } else { Filling::new() }
    }

    pub fn handler(&self, i: usize) -> Result<FnPtr, Wrong> {
        if let Given::Handler(handler) = self.given(i) {
            return Ok(handler.clone());
        }
        Err(Wrong::new(format!("{}: there is no handler", self.word.name), "write || { ... }"))
    }

    /// Asks the host for something.
    pub fn act(&mut self, action: Action) -> Result<Dynamic, Wrong> {
        let most = self.desk.limits.actions;
        let sheet = self.desk.sheet();
        if sheet.acted >= most {
            return Err(Wrong::new(format!("more than {most} actions in a frame"), "do less at once: spread it with after()"));
        }
        sheet.acted += 1;
        self.desk.actions.push(action);
        Ok(Dynamic::UNIT)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn the_table_is_sound() {
        let mut names = BTreeSet::new();
        for word in words() {
            assert!(names.insert(word.name), "{} is there twice", word.name);
            assert!(word.required <= word.arguments.len() && word.arguments.len() <= 5, "{}", word.name);
            assert!(!word.what.is_empty() && word.what.ends_with('.'), "{}: what it does is a sentence", word.name);
            assert!(word.example.contains(&format!("{}(", word.name)), "{}: the example shows it", word.name);
            let handler = word.arguments.iter().any(|argument| argument.kind == ArgumentKind::Handler);
            assert!(handler || word.fields.is_empty(), "{}: only handlers are given events", word.name);
        }
    }
}
