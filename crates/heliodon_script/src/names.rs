//! What exists on a site, by kind: scripts name it, and a name that is not there is found before anything runs.

use crate::diagnostic::{Wrong, nearest};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// What a name can be the name of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// A box or floor plan that visitors enter and leave.
    Region,
    /// An object that can be touched, grabbed, moved, shown; a tool is one.
    Thing,
    /// A part of a thing that is struck or covered by itself, such as `zeus/face`.
    Part,
    /// Someone or something that is animated.
    Actor,
    /// An animation of an actor or a thing.
    Animation,
    /// What a part can be made of.
    Material,
    /// A film on a screen in the scene.
    Film,
    /// A sound.
    Sound,
    /// A source of fire, smoke, dust, sparks.
    Particles,
    /// A lamp.
    Light,
    /// A key of the table of texts.
    Text,
    /// A place to look from.
    View,
    /// A way that actors follow and visitors are shown.
    Path,
}

impl Kind {
    /// All of them, in the order of the manual.
    pub const ALL: [Self; 13] = [
        Self::Region,
        Self::Thing,
        Self::Part,
        Self::Actor,
        Self::Animation,
        Self::Material,
        Self::Film,
        Self::Sound,
        Self::Particles,
        Self::Light,
        Self::Text,
        Self::View,
        Self::Path,
    ];

    /// The word for one of them, as messages and the manual say it.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Region => "region",
            Self::Thing => "thing",
            Self::Part => "part",
            Self::Actor => "actor",
            Self::Animation => "animation",
            Self::Material => "material",
            Self::Film => "film",
            Self::Sound => "sound",
            Self::Particles => "particles",
            Self::Light => "light",
            Self::Text => "text",
            Self::View => "view",
            Self::Path => "path",
        }
    }
}

/// `thing, part or actor`.
pub(crate) fn words(kinds: &[Kind]) -> String {
    let mut text = String::new();
    for (i, kind) in kinds.iter().enumerate() {
        if i > 0 {
            text += if i + 1 == kinds.len() { " or " } else { ", " };
        }
        text += kind.word();
    }
    text
}

/// Every name of a site. A kind of which nothing was said is not checked: a script alone can be checked without its site.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Names {
    known: BTreeMap<Kind, BTreeSet<String>>,
}

impl Names {
    /// Nothing is known, and no name is checked.
    #[must_use]
    pub fn unchecked() -> Self {
        Self::default()
    }

    /// Every kind is known to have no names yet.
    #[must_use]
    pub fn none() -> Self {
        Self { known: Kind::ALL.into_iter().map(|kind| (kind, BTreeSet::new())).collect() }
    }

    /// Adds names of a kind, which is checked from now on.
    pub fn add<S: Into<String>>(&mut self, kind: Kind, names: impl IntoIterator<Item = S>) {
        self.known.entry(kind).or_default().extend(names.into_iter().map(Into::into));
    }

    /// The same with names of a kind.
    #[must_use]
    pub fn with<S: Into<String>>(mut self, kind: Kind, names: impl IntoIterator<Item = S>) -> Self {
        self.add(kind, names);
        self
    }

    /// Whether something of one of the kinds has the name, or may have it.
    #[must_use]
    pub fn has(&self, kinds: &[Kind], name: &str) -> bool {
        kinds.iter().any(|kind| self.known.get(kind).is_none_or(|names| names.contains(name)))
    }

    /// Why a name is none of the kinds, with the name that was probably meant.
    pub(crate) fn check(&self, kinds: &[Kind], name: &str) -> Result<(), Wrong> {
        if self.has(kinds, name) {
            return Ok(());
        }
        let known = || kinds.iter().filter_map(|kind| self.known.get(kind)).flatten().map(String::as_str);
        let message = format!("there is no {} `{name}`", words(kinds));
        let elsewhere = self.known.iter().find(|(kind, names)| !kinds.contains(kind) && names.contains(name));
        let remedy = if let Some(word) = nearest(name, known()) {
            format!("did you mean `{word}`?")
        } else if let Some((kind, _)) = elsewhere {
            format!("`{name}` is the name of something else here: {}", kind.word())
        } else {
            let all: Vec<&str> = known().take(8).collect();
            if all.is_empty() { "the site has none".to_owned() } else { format!("there are: {}", all.join(", ")) }
        };
        Err(Wrong::new(message, remedy))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unknown_name_is_told_with_what_was_meant() {
        let names = Names::none().with(Kind::Thing, ["mallet", "chisel"]).with(Kind::Region, ["workshop"]);
        assert!(names.check(&[Kind::Thing], "mallet").is_ok());
        let told = |kinds: &[Kind], name| names.check(kinds, name).unwrap_err().to_string();
        assert_eq!(told(&[Kind::Thing, Kind::Actor], "malet"), "there is no thing or actor `malet`; did you mean `mallet`?");
        assert_eq!(
            told(&[Kind::Thing], "workshop"),
            "there is no thing `workshop`; `workshop` is the name of something else here: region"
        );
        assert_eq!(told(&[Kind::Film], "birth"), "there is no film `birth`; the site has none");
        assert_eq!(told(&[Kind::Thing], "zeus"), "there is no thing `zeus`; there are: chisel, mallet");
    }

    #[test]
    fn kinds_of_which_nothing_was_said_are_not_checked() {
        assert!(Names::unchecked().has(&[Kind::Thing], "anything"));
        assert!(!Names::none().has(&[Kind::Thing], "anything"));
    }
}
