//! Plain data: what messages carry, what is kept over a reload, what is remembered between visits.

use crate::diagnostic::Wrong;
use crate::place::Spot;
use rhai::Dynamic;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Lists in lists, at most so deep.
pub const MAX_DEPTH: usize = 12;

/// A piece of plain data. A place is a list of three numbers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Value {
    /// `()`, nothing.
    Nothing,
    /// True or false.
    Flag(bool),
    /// A whole number.
    Whole(i64),
    /// A number, finite.
    Number(f64),
    /// A text.
    Text(String),
    /// `[a, b, c]`.
    List(Vec<Value>),
    /// `#{ a: 1, b: 2 }`.
    Table(BTreeMap<String, Value>),
}

impl From<bool> for Value {
    fn from(value: bool) -> Self {
        Self::Flag(value)
    }
}

impl From<i64> for Value {
    fn from(value: i64) -> Self {
        Self::Whole(value)
    }
}

impl From<f64> for Value {
    fn from(value: f64) -> Self {
        Self::Number(value)
    }
}

impl From<&str> for Value {
    fn from(value: &str) -> Self {
        Self::Text(value.to_owned())
    }
}

impl Value {
    /// What it weighs, in bytes of text and 16 for each piece: what limits are counted in.
    #[must_use]
    pub fn weight(&self) -> usize {
        match self {
            Self::Text(text) => 16 + text.len(),
            Self::List(values) => 16 + values.iter().map(Self::weight).sum::<usize>(),
            Self::Table(values) => 16 + values.iter().map(|(key, value)| 16 + key.len() + value.weight()).sum::<usize>(),
            _ => 16,
        }
    }

    /// Whether lists stand in lists no deeper than [`MAX_DEPTH`] and every number is finite.
    #[must_use]
    pub fn is_sound(&self) -> bool {
        fn sound(value: &Value, depth: usize) -> bool {
            match value {
                Value::Number(number) => number.is_finite(),
                Value::List(values) => depth > 0 && values.iter().all(|value| sound(value, depth - 1)),
                Value::Table(values) => depth > 0 && values.values().all(|value| sound(value, depth - 1)),
                _ => true,
            }
        }
        sound(self, MAX_DEPTH)
    }

    /// From what a script holds; functions and the like are refused, and what is heavier than `most`.
    pub(crate) fn from_script(value: &Dynamic, most: usize) -> Result<Self, Wrong> {
        let mut left = most;
        let read = read(value, MAX_DEPTH, &mut left);
        read.map_err(|fault| match fault {
            Fault::Heavy => {
                Wrong::new(format!("the value holds more than {} KiB", most / 1024), "keep less in it, or shorter texts")
            }
            Fault::Deep => {
                Wrong::new(format!("lists stand in lists more than {MAX_DEPTH} deep"), "keep simple values and short lists")
            }
            Fault::Kind(kind) => {
                Wrong::new(format!("a {kind} cannot be kept or sent"), "use numbers, texts, true and false, lists and #{ ... }")
            }
        })
    }

    /// As a script sees it.
    pub(crate) fn to_script(&self) -> Dynamic {
        match self {
            Self::Nothing => Dynamic::UNIT,
            Self::Flag(value) => (*value).into(),
            Self::Whole(value) => (*value).into(),
            Self::Number(value) => (*value).into(),
            Self::Text(text) => text.as_str().into(),
            Self::List(values) => Dynamic::from_array(values.iter().map(Self::to_script).collect()),
            Self::Table(values) => {
                Dynamic::from_map(values.iter().map(|(key, value)| (key.as_str().into(), value.to_script())).collect())
            }
        }
    }
}

enum Fault {
    Heavy,
    Deep,
    Kind(String),
}

fn read(value: &Dynamic, depth: usize, left: &mut usize) -> Result<Value, Fault> {
    let mut pay = |bytes: usize| {
        *left = left.checked_sub(bytes).ok_or(Fault::Heavy)?;
        Ok(())
    };
    pay(16)?;
    if value.is_unit() {
        return Ok(Value::Nothing);
    }
    if let Ok(flag) = value.as_bool() {
        return Ok(Value::Flag(flag));
    }
    if let Ok(whole) = value.as_int() {
        return Ok(Value::Whole(whole));
    }
    if let Ok(number) = value.as_float() {
        return if number.is_finite() {
            Ok(Value::Number(number))
        } else {
            Err(Fault::Kind(format!("number that is {number}")))
        };
    }
    if let Ok(letter) = value.as_char() {
        return Ok(Value::Text(letter.to_string()));
    }
    if let Ok(text) = value.as_immutable_string_ref() {
        pay(text.len())?;
        return Ok(Value::Text(text.as_str().to_owned()));
    }
    if let Some(spot) = value.read_lock::<Spot>() {
        return Ok(Value::List(spot.0.iter().map(|&number| Value::Number(number)).collect()));
    }
    if depth == 0 {
        return Err(Fault::Deep);
    }
    if let Ok(values) = value.as_array_ref() {
        return values.iter().map(|value| read(value, depth - 1, left)).collect::<Result<_, _>>().map(Value::List);
    }
    if let Ok(values) = value.as_map_ref() {
        let mut table = BTreeMap::new();
        for (key, value) in values.iter() {
            *left = left.checked_sub(16 + key.len()).ok_or(Fault::Heavy)?;
            table.insert(key.to_string(), read(value, depth - 1, left)?);
        }
        return Ok(Value::Table(table));
    }
    let kind = value.type_name();
    Err(Fault::Kind(if kind == "Fn" { "function".to_owned() } else { kind.to_owned() }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plain_data_goes_there_and_back() {
        let table = [("flag".to_owned(), Value::from(true)), ("number".to_owned(), Value::from(0.1))];
        let value = Value::List(vec![Value::Nothing, Value::from(3), Value::from("ivory"), Value::Table(table.into())]);
        assert_eq!(Value::from_script(&value.to_script(), 1024).unwrap(), value);
        let text = serde_json::to_string(&value).unwrap();
        assert_eq!(text, r#"[null,3,"ivory",{"flag":true,"number":0.1}]"#);
        assert_eq!(serde_json::from_str::<Value>(&text).unwrap(), value);
        let spot = Value::from_script(&Dynamic::from(Spot([1.0, 2.0, 3.0])), 1024).unwrap();
        assert_eq!(spot, Value::List(vec![1.0.into(), 2.0.into(), 3.0.into()]));
    }

    #[test]
    fn what_is_too_much_is_refused() {
        let long = Dynamic::from("x".repeat(2000));
        assert!(Value::from_script(&long, 1024).unwrap_err().message.contains("1 KiB"));
        let mut deep = Dynamic::UNIT;
        for _ in 0..=MAX_DEPTH {
            deep = Dynamic::from_array(vec![deep]);
        }
        assert!(Value::from_script(&deep, 1024).unwrap_err().message.contains("12 deep"));
        let function = Dynamic::from(rhai::FnPtr::new("f").unwrap());
        assert!(Value::from_script(&function, 1024).unwrap_err().message.contains("function"));
        assert!(Value::from_script(&Dynamic::from(f64::NAN), 1024).is_err());
        assert!(!Value::from(f64::INFINITY).is_sound());
    }
}
