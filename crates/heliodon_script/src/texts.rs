//! Subtitles, tasks and hints in several languages: a TOML table that people who translate can write.
//!
//! ```toml
//! languages = ["en", "el", "de"]    # what there should be; where a text lacks a language, the first is shown
//!
//! [texts.welcome]
//! en = "Welcome to the workshop."
//! el = "Καλώς ήρθες στο εργαστήριο."
//! de = "Willkommen in der Werkstatt."
//!
//! [texts.blows]
//! en = "{n} more blows."
//! ```

use crate::action::Filling;
use crate::diagnostic::{Diagnostic, Place, Severity, nearest};
use heliodon_bundle::line_and_column;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::ops::Range;
use toml::Spanned;

/// Texts by key and language.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Texts {
    languages: Vec<String>,
    texts: BTreeMap<String, BTreeMap<String, String>>,
    /// Where each text's table begins, for messages.
    places: BTreeMap<String, (usize, usize)>,
    file: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TextsFile {
    languages: Spanned<Vec<Spanned<String>>>,
    #[serde(default)]
    texts: BTreeMap<Spanned<String>, BTreeMap<Spanned<String>, Spanned<String>>>,
}

impl Texts {
    /// Reads the text of such a file; `file` is its name, for messages.
    ///
    /// # Errors
    /// The first thing that is wrong, with line and column.
    pub fn parse(text: &str, file: &str) -> Result<Self, Diagnostic> {
        let at = |span: Range<usize>, message: String, remedy: &str| {
            Diagnostic::new(file, Place(Some(line_and_column(text, span.start))), message, remedy)
        };
        let read: TextsFile = toml::from_str(text).map_err(|error| {
            let message = error.message().trim().replace('\n', ", ");
            let remedy =
                "write languages = [\"en\", \"el\"], and a table for each text: [texts.welcome], below it en = \"...\"";
            at(error.span().unwrap_or_default(), message, remedy)
        })?;
        let languages: Vec<String> = read.languages.get_ref().iter().map(|language| language.get_ref().clone()).collect();
        if languages.is_empty() {
            let remedy = "name at least one: languages = [\"en\"]";
            return Err(at(read.languages.span(), "there are no languages".to_owned(), remedy));
        }
        for (i, language) in read.languages.get_ref().iter().enumerate() {
            let tag = language.get_ref();
            let plain = tag.bytes().all(|c| c.is_ascii_alphanumeric() || c == b'-');
            if !plain || tag.len() < 2 || tag.starts_with('-') || tag.ends_with('-') {
                let remedy = "write two letters, as in \"en\", or with a region: \"en-GB\"";
                return Err(at(language.span(), format!("`{tag}` is no language"), remedy));
            }
            if languages[..i].contains(tag) {
                return Err(at(language.span(), format!("`{tag}` is listed twice"), "take one of the two out"));
            }
        }
        let mut texts = BTreeMap::new();
        let mut places = BTreeMap::new();
        for (key, translations) in &read.texts {
            for (language, words) in translations {
                if !languages.contains(language.get_ref()) {
                    let remedy = match nearest(language.get_ref(), languages.iter().map(String::as_str)) {
                        Some(word) => format!("did you mean `{word}`?"),
                        None => "add it to `languages`".to_owned(),
                    };
                    return Err(at(
                        language.span(),
                        format!("`{language}` is not among the languages", language = language.get_ref()),
                        &remedy,
                    ));
                }
                if words.get_ref().trim().is_empty() {
                    return Err(at(words.span(), "the text is empty".to_owned(), "write it, or take the line out"));
                }
            }
            if translations.is_empty() {
                let message = format!("`{}` has no text in any language", key.get_ref());
                return Err(at(key.span(), message, "add a line such as en = \"...\""));
            }
            let owned = translations.iter().map(|(language, words)| (language.get_ref().clone(), words.get_ref().clone()));
            texts.insert(key.get_ref().clone(), owned.collect());
            places.insert(key.get_ref().clone(), line_and_column(text, key.span().start));
        }
        Ok(Self { languages, texts, places, file: file.to_owned() })
    }

    /// The languages that there should be, the first the one that stands in for the others.
    #[must_use]
    pub fn languages(&self) -> &[String] {
        &self.languages
    }

    /// All keys, for [`Names`](crate::names::Names).
    pub fn keys(&self) -> impl Iterator<Item = &str> {
        self.texts.keys().map(String::as_str)
    }

    /// A text in a language; where there is none, in the language without its region (`en` for `en-GB`), in the first language
    /// that the file lists, or in any. Answers with the language that it is in. None for a key that is not there.
    #[must_use]
    pub fn get(&self, key: &str, language: &str) -> Option<(&str, &str)> {
        let translations = self.texts.get(key)?;
        let plain = language.split('-').next().unwrap_or(language);
        let wanted = [language, plain].into_iter().chain(self.languages.iter().map(String::as_str));
        let found = wanted.filter_map(|language| translations.get_key_value(language)).next();
        found.or_else(|| translations.first_key_value()).map(|(language, text)| (text.as_str(), language.as_str()))
    }

    /// The same with `{name}` replaced by what `values` has for the name; a name that it does not have stays as it is.
    #[must_use]
    pub fn show(&self, key: &str, language: &str, values: &Filling) -> Option<String> {
        let (text, _) = self.get(key, language)?;
        let mut shown = String::with_capacity(text.len());
        let mut rest = text;
        while let Some((before, after)) = rest.split_once('{') {
            shown += before;
            let value = after.split_once('}').and_then(|(name, after)| values.get(name).map(|value| (value, after)));
            match value {
                Some((value, after)) => {
                    shown += value;
                    rest = after;
                }
                None => {
                    shown.push('{');
                    rest = after;
                }
            }
        }
        shown += rest;
        Some(shown)
    }

    /// Every text that lacks a language, and every one whose `{names}` are not those of the first language.
    #[must_use]
    pub fn missing(&self) -> Vec<Diagnostic> {
        let mut told = Vec::new();
        for (key, translations) in &self.texts {
            let mut tell = |message: String, remedy: String| {
                let place = Place(self.places.get(key).copied());
                told.push(Diagnostic::new(&self.file, place, message, remedy).with_severity(Severity::Warning));
            };
            let lacking: Vec<&str> =
                self.languages.iter().filter(|language| !translations.contains_key(*language)).map(String::as_str).collect();
            if !lacking.is_empty() {
                let shown = self.get(key, lacking[0]).map_or("", |(_, language)| language);
                tell(
                    format!("`{key}` is missing in {}", lacking.join(", ")),
                    format!("translate it; until then `{shown}` is shown"),
                );
            }
            let Some((first, names)) = translations.iter().next().map(|(language, text)| (language, holes(text))) else {
                continue;
            };
            if let Some((other, _)) = translations.iter().find(|(_, text)| holes(text) != names) {
                let message = format!("`{key}` has other {{names}} in {other} than in {first}");
                tell(message, "write the same in every language".to_owned());
            }
        }
        told
    }
}

/// The `{names}` of a text, in their order of the alphabet.
fn holes(text: &str) -> Vec<&str> {
    let mut names: Vec<&str> = text.split('{').skip(1).filter_map(|rest| rest.split_once('}')).map(|(name, _)| name).collect();
    names.sort_unstable();
    names.dedup();
    names
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = r#"languages = ["en", "el", "de"]

[texts.welcome]
en = "Welcome"
el = "Καλώς ήρθες"
de = "Willkommen"

[texts.blows]
en = "{n} more blows of the {tool}"
de = "Noch {n} Schläge"
"#;

    #[test]
    fn texts_are_found_in_the_nearest_language() {
        let texts = Texts::parse(TEXT, "texts.toml").unwrap();
        assert_eq!(texts.get("welcome", "el"), Some(("Καλώς ήρθες", "el")));
        assert_eq!(texts.get("welcome", "de-AT"), Some(("Willkommen", "de")));
        assert_eq!(texts.get("blows", "el").unwrap().1, "en");
        assert_eq!(texts.get("farewell", "en"), None);
        let values = [("n".to_owned(), "3".to_owned())].into();
        assert_eq!(texts.show("blows", "en", &values).unwrap(), "3 more blows of the {tool}");
        assert_eq!(texts.keys().collect::<Vec<_>>(), ["blows", "welcome"]);
    }

    #[test]
    fn what_is_missing_is_told_with_its_place() {
        let told: Vec<String> = Texts::parse(TEXT, "texts.toml").unwrap().missing().iter().map(ToString::to_string).collect();
        assert_eq!(told.len(), 2, "{told:?}");
        assert_eq!(told[0], "texts.toml:8:8: warning: `blows` is missing in el; translate it; until then `en` is shown");
        assert!(told[1].contains("other {names} in en than in de"), "{}", told[1]);
    }

    #[test]
    fn mistakes_are_told_with_line_and_column() {
        let told = |text: &str| Texts::parse(text, "t.toml").unwrap_err().to_string();
        assert!(told("languages = []").starts_with("t.toml:1:13: there are no languages"), "{}", told("languages = []"));
        assert!(told("languages = [\"en\", \"en\"]").contains("listed twice"));
        assert!(told("languages = [\"e n\"]").contains("is no language"));
        let unknown = told("languages = [\"en\"]\n[texts.a]\nfr = \"x\"\n");
        assert!(unknown.starts_with("t.toml:3:1: `fr` is not among the languages"), "{unknown}");
        assert!(told("languages = [\"en\"]\n[texts.a]\nen = \" \"\n").contains("empty"));
        assert!(told("languages = [\"en\"]\n[texts.a]\n").contains("no text in any"));
        assert!(told("languages = \"en\"").starts_with("t.toml:1:"));
        assert!(told("[texts.a]\nen = \"x\"").contains("languages"));
    }
}
