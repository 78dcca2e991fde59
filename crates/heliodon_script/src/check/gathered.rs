//! What only all scripts together show: messages that nobody hears, names that are recalled and never remembered.

use crate::diagnostic::{Diagnostic, Place, Severity, nearest};
use std::collections::BTreeSet;

/// What was seen in all scripts so far.
#[derive(Default)]
pub(crate) struct Gathered {
    sent: Vec<(String, Place, String, String)>,
    heard: BTreeSet<(String, String)>,
    /// A script waits for messages whose names are made while it runs.
    hears_others: bool,
    recalled: Vec<(String, Place, String)>,
    remembered: BTreeSet<String>,
    remembers_others: bool,
}

impl Gathered {
    /// Notes the call of a word; `texts` are its arguments where they are texts.
    pub fn note(&mut self, file: &str, place: Place, word: &str, texts: &[Option<String>]) {
        let text = |i: usize| texts.get(i).cloned().flatten();
        match (word, text(0), text(1)) {
            ("send", Some(to), Some(name)) => self.sent.push((file.to_owned(), place, to, name)),
            ("when_message", Some(to), Some(name)) => drop(self.heard.insert((to, name))),
            ("when_message", ..) => self.hears_others = true,
            ("recall", Some(name), _) => self.recalled.push((file.to_owned(), place, name)),
            ("remember", Some(name), _) => drop(self.remembered.insert(name)),
            ("remember", ..) => self.remembers_others = true,
            _ => {}
        }
    }

    /// What is odd. None of it keeps a script from running: what is outside may remember and wait as well.
    pub fn unanswered(&self) -> Vec<Diagnostic> {
        let mut told = Vec::new();
        for (file, place, to, name) in &self.sent {
            let heard = self.heard.iter().any(|(a, b)| (a == to || a == "*") && (b == name || b == "*"));
            if heard || self.hears_others {
                continue;
            }
            let mine = |pair: &&(String, String)| pair.0 == *to;
            let remedy = match nearest(name, self.heard.iter().filter(mine).map(|(_, name)| name.as_str())) {
                Some(word) => format!("did you mean `{word}`?"),
                None => format!("add when_message(\"{to}\", \"{name}\", |e| {{ ... }}) to a script"),
            };
            let message = format!("no script waits for the message `{name}` to `{to}`");
            told.push(Diagnostic::new(file, *place, message, remedy).with_severity(Severity::Warning));
        }
        for (file, place, name) in &self.recalled {
            if self.remembers_others || self.remembered.contains(name) {
                continue;
            }
            let remedy = match nearest(name, self.remembered.iter().map(String::as_str)) {
                Some(word) => format!("did you mean `{word}`?"),
                None => format!("add remember(\"{name}\", ...) to a script"),
            };
            let message = format!("no script remembers `{name}`");
            told.push(Diagnostic::new(file, *place, message, remedy).with_severity(Severity::Warning));
        }
        told
    }
}
