//! What words are given: kinds of arguments, how they are read and what is told where they are wrong.

use crate::action::Filling;
use crate::desk::Desk;
use crate::diagnostic::{Wrong, nearest};
use crate::names::{Kind, Names, words};
use crate::place::Spot;
use rhai::{Dynamic, FnPtr, ImmutableString};

/// Longest name of a message or of something remembered, bytes.
const MAX_KEY_BYTES: usize = 200;

/// One argument of a word.
#[derive(Debug)]
pub struct Argument {
    /// Its name in the manual.
    pub name: &'static str,
    /// What it can be.
    pub kind: ArgumentKind,
}

/// What an argument can be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ArgumentKind {
    /// The name of something of one of these kinds.
    Name(&'static [Kind]),
    /// The same, or "*" for any.
    Pattern(&'static [Kind]),
    /// `at(x, y, z)`, `[x, y, z]` or the name of something that has a place.
    Place,
    /// A number, from and to.
    Number(f64, f64),
    /// `true` or `false`.
    Flag,
    /// One of these words.
    OneOf(&'static [&'static str]),
    /// An hour: "12:00", or a number of hours.
    Hour,
    /// A name of the author's own choice.
    Key,
    /// Plain data.
    Data,
    /// `#{ n: 3 }`: what is put into a text.
    Filling,
    /// What is done then: `|| { ... }`, `|e| { ... }`.
    Handler,
}

/// What has a place.
pub(crate) const PLACED: &[Kind] = &[Kind::Thing, Kind::Part, Kind::Actor, Kind::Region, Kind::View];

/// The name that stands for where the visitor is.
pub(crate) const VISITOR: &str = "visitor";

/// A value as a script wrote it, where it can be seen before it runs.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Literal<'a> {
    Text(&'a str),
    Number(f64),
    Flag,
    Nothing,
    List,
    Table,
    Function,
}

/// A value that was read.
#[derive(Clone, Debug)]
pub(super) enum Given {
    Nothing,
    Text(ImmutableString),
    Number(f64),
    Flag(bool),
    Spot(Spot),
    Data(Dynamic),
    Filling(Filling),
    Handler(FnPtr),
}

impl ArgumentKind {
    /// What it is, in the manual and in messages.
    #[must_use]
    pub fn words(self) -> String {
        let quoted = |words: &[&str]| words.iter().map(|word| format!("\"{word}\"")).collect::<Vec<_>>().join(", ");
        match self {
            Self::Name(kinds) => format!("the name of a {}", words(kinds)),
            Self::Pattern(kinds) => format!("the name of a {}, or \"*\" for any", words(kinds)),
            Self::Place => "a place: at(x, y, z), or the name of something that has one".to_owned(),
            Self::Number(least, most) if most == f64::INFINITY => format!("a number from {least} up"),
            Self::Number(least, most) => format!("a number from {least} to {most}"),
            Self::Flag => "true or false".to_owned(),
            Self::OneOf(choices) => format!("one of {}", quoted(choices)),
            Self::Hour => "an hour: \"12:30\", or a number of hours".to_owned(),
            Self::Key => "a name of your own".to_owned(),
            Self::Data => "a number, a text, true or false, or a list or #{ ... } of these".to_owned(),
            Self::Filling => "values for the text: #{ n: 3 }".to_owned(),
            Self::Handler => "what is done then: || { ... }, or |e| { ... } to be given the event".to_owned(),
        }
    }

    fn no(self, what: &str) -> Wrong {
        Wrong::new(format!("it is {what}"), format!("give {}", self.words()))
    }

    fn check_number(self, number: f64) -> Result<(), Wrong> {
        match self {
            Self::Number(least, most) if !(least..=most).contains(&number) => Err(self.no(&number.to_string())),
            Self::Number(..) | Self::Data => Ok(()),
            Self::Hour if (0.0..24.0).contains(&number) => Ok(()),
            _ => Err(self.no(&format!("the number {number}"))),
        }
    }

    fn check_text(self, text: &str, names: &Names) -> Result<(), Wrong> {
        match self {
            Self::Pattern(_) if text == "*" => Ok(()),
            Self::Name(kinds) | Self::Pattern(kinds) => names.check(kinds, text),
            Self::Place if text == VISITOR => Ok(()),
            Self::Place => names.check(PLACED, text),
            Self::OneOf(choices) if choices.contains(&text) => Ok(()),
            Self::OneOf(choices) => {
                let meant = nearest(text, choices.iter().copied());
                Err(meant.map_or_else(
                    || self.no(&format!("`{text}`")),
                    |word| Wrong::new(format!("it is `{text}`"), format!("did you mean `{word}`?")),
                ))
            }
            Self::Hour => hour_from_text(text).map(|_| ()).ok_or_else(|| self.no(&format!("`{text}`"))),
            Self::Key if text.is_empty() => Err(self.no("empty")),
            Self::Key if text.len() > MAX_KEY_BYTES => {
                Err(Wrong::new("it is very long", format!("use at most {MAX_KEY_BYTES} bytes")))
            }
            Self::Key | Self::Data => Ok(()),
            _ => Err(self.no("a text")),
        }
    }

    /// What can be said of a value before anything runs.
    pub(crate) fn check_literal(self, literal: Literal<'_>, names: &Names) -> Result<(), Wrong> {
        match (self, literal) {
            (_, Literal::Text(text)) => self.check_text(text, names),
            (_, Literal::Number(number)) => self.check_number(number),
            (Self::Flag, Literal::Flag)
            | (Self::Data, Literal::Flag | Literal::Nothing | Literal::List | Literal::Table)
            | (Self::Place, Literal::List | Literal::Table)
            | (Self::Filling, Literal::Table)
            | (Self::Handler, Literal::Function) => Ok(()),
            (_, Literal::Flag) => Err(self.no("true or false")),
            (_, Literal::Nothing) => Err(self.no("()")),
            (_, Literal::List) => Err(self.no("a list")),
            (_, Literal::Table) => Err(self.no("a #{ ... }")),
            (_, Literal::Function) => Err(self.no("a function")),
        }
    }
}

impl Argument {
    /// Reads what a script gave.
    pub(super) fn read(&self, desk: &Desk, value: &Dynamic) -> Result<Given, Wrong> {
        self.kind.read(desk, value).map_err(|wrong| {
            let message = if wrong.message.starts_with("it is ") {
                format!("its `{}` {}", self.name, &wrong.message[3..])
            } else {
                wrong.message
            };
            Wrong::new(message, wrong.remedy)
        })
    }
}

impl ArgumentKind {
    fn read(self, desk: &Desk, value: &Dynamic) -> Result<Given, Wrong> {
        if self == Self::Data {
            return Ok(Given::Data(value.clone()));
        }
        if let Ok(text) = value.as_immutable_string_ref() {
            self.check_text(&text, &desk.names)?;
            return match self {
                Self::Place => desk.place_of(&text).map(Given::Spot),
                Self::Hour => Ok(Given::Number(hour_from_text(&text).unwrap_or(0.0))),
                _ => Ok(Given::Text(text.clone())),
            };
        }
        if let Some(number) = value.as_float().ok().or_else(|| value.as_int().ok().map(|whole| whole as f64)) {
            self.check_number(number)?;
            // hours are handed on as seconds of the day
            return Ok(Given::Number(if self == Self::Hour { number * 3600.0 } else { number }));
        }
        let read = match self {
            Self::Flag => value.as_bool().ok().map(Given::Flag),
            Self::Place => read_spot(value).map(Given::Spot),
            Self::Handler => value.read_lock::<FnPtr>().map(|function| Given::Handler(function.clone())),
            Self::Filling => match value.as_map_ref() {
                Ok(values) if values.len() <= 16 => {
                    Some(Given::Filling(values.iter().map(|(name, value)| (name.to_string(), plainly(value))).collect()))
                }
                _ => None,
            },
            _ => None,
        };
        read.ok_or_else(|| {
            let kind = match value.type_name() {
                "()" => "()",
                "bool" => "true or false",
                "array" => "a list",
                "map" => "a #{ ... }",
                "Fn" => "a function",
                other => other,
            };
            self.no(kind)
        })
    }
}

/// A number or text as it is put into a text: without a fraction where there is none.
fn plainly(value: &Dynamic) -> String {
    if let Ok(text) = value.as_immutable_string_ref() {
        return text.to_string();
    }
    if let Ok(number) = value.as_float() {
        return format!("{}", (number * 100.0).round() / 100.0);
    }
    if value.is_array() || value.is_map() { "...".to_owned() } else { value.to_string() }
}

fn read_spot(value: &Dynamic) -> Option<Spot> {
    let number = |value: &Dynamic| {
        let number = value.as_float().ok().or_else(|| value.as_int().ok().map(|whole| whole as f64));
        number.filter(|number| number.is_finite())
    };
    let read = |values: [Option<&Dynamic>; 3]| {
        let mut spot = [0.0; 3];
        for (axis, value) in spot.iter_mut().zip(values) {
            *axis = number(value?)?;
        }
        Some(Spot(spot))
    };
    if let Some(spot) = value.read_lock::<Spot>() {
        return spot.0.iter().all(|number| number.is_finite()).then_some(*spot);
    }
    if let Ok(list) = value.as_array_ref() {
        return if list.len() == 3 { read([list.first(), list.get(1), list.get(2)]) } else { None };
    }
    value.as_map_ref().ok().and_then(|map| read([map.get("x"), map.get("y"), map.get("z")]))
}

/// `HH:MM` or `HH:MM:SS` as seconds of the day.
pub(crate) fn hour_from_text(text: &str) -> Option<f64> {
    let fields: Vec<&str> = text.split(':').collect();
    if !(2..=3).contains(&fields.len()) {
        return None;
    }
    let limits = [24, 60, 60];
    let mut seconds = 0;
    for (i, limit) in limits.iter().enumerate() {
        let field = fields.get(i).copied().unwrap_or("00");
        let whole = field.len() == 2 && field.bytes().all(|c| c.is_ascii_digit());
        let number: u32 = if whole { field.parse().ok()? } else { return None };
        if number >= *limit {
            return None;
        }
        seconds = seconds * 60 + number;
    }
    Some(f64::from(seconds))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hours_are_read_as_site_toml_has_them() {
        assert_eq!(hour_from_text("12:30"), Some(45_000.0));
        assert_eq!(hour_from_text("06:57:30"), Some(25_050.0));
        for wrong in ["", "12", "24:00", "12:60", "1:30", "12:30:61", "-1:30", "12:3a", "12:30:00:00", "١٢:٣٠"] {
            assert_eq!(hour_from_text(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn values_are_written_plainly() {
        assert_eq!(plainly(&3.into()), "3");
        assert_eq!(plainly(&3.0.into()), "3");
        assert_eq!(plainly(&0.125.into()), "0.13");
        assert_eq!(plainly(&"ivory".into()), "ivory");
    }
}
