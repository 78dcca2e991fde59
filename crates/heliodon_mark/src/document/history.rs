//! Undo and redo of a text: what changed between two of its states, as one stretch that was replaced.

/// A stretch of a text that was replaced.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Change {
    at: usize,
    removed: String,
    inserted: String,
}

impl Change {
    /// What leads from one text to another: all between what they begin and end with alike.
    pub fn between(old: &str, new: &str) -> Self {
        let alike = |pairs: &mut dyn Iterator<Item = (char, char)>| -> usize {
            pairs.take_while(|(a, b)| a == b).map(|(a, _)| a.len_utf8()).sum()
        };
        let at = alike(&mut old.chars().zip(new.chars()));
        let tail = alike(&mut old[at..].chars().rev().zip(new[at..].chars().rev()));
        Self { at, removed: old[at..old.len() - tail].to_owned(), inserted: new[at..new.len() - tail].to_owned() }
    }

    /// The text after it.
    pub fn done(&self, text: &str) -> String {
        replaced(text, self.at, self.removed.len(), &self.inserted)
    }

    /// The text before it.
    pub fn undone(&self, text: &str) -> String {
        replaced(text, self.at, self.inserted.len(), &self.removed)
    }
}

fn replaced(text: &str, at: usize, length: usize, by: &str) -> String {
    [&text[..at], by, &text[at + length..]].concat()
}

/// One thing that can be undone.
#[derive(Clone, Debug)]
struct Step {
    change: Change,
    what: String,
    /// Steps of one name that follow one another are undone at once.
    run: Option<String>,
}

/// All that was done, and all that was undone.
#[derive(Clone, Debug, Default)]
pub(super) struct History {
    done: Vec<Step>,
    undone: Vec<Step>,
}

impl History {
    /// Remembers what led from one text to another. Steps of one `run` become one.
    pub fn push(&mut self, old: &str, new: &str, what: String, run: Option<String>) {
        let joins = self.undone.is_empty() && run.is_some() && self.done.last().is_some_and(|last| last.run == run);
        self.undone.clear();
        let first = if joins { self.done.pop() } else { None };
        let change = match &first {
            Some(step) => Change::between(&step.change.undone(old), new),
            None => Change::between(old, new),
        };
        self.done.push(Step { change, what, run });
    }

    /// The text before the last step, and what that was.
    pub fn undo(&mut self, text: &str) -> Option<(String, String)> {
        let step = self.done.pop()?;
        let told = (step.change.undone(text), step.what.clone());
        self.undone.push(step);
        Some(told)
    }

    /// The text after the step that was undone last, and what that was.
    pub fn redo(&mut self, text: &str) -> Option<(String, String)> {
        let step = self.undone.pop()?;
        let told = (step.change.done(text), step.what.clone());
        self.done.push(step);
        Some(told)
    }

    /// Ends a run: what follows is undone by itself.
    pub fn rest(&mut self) {
        if let Some(last) = self.done.last_mut() {
            last.run = None;
        }
    }

    /// How many steps can be undone and redone.
    pub fn len(&self) -> (usize, usize) {
        (self.done.len(), self.undone.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_goes_there_and_back_between_any_two_texts() {
        let texts = ["", "a", "aa", "aaa", "aba", "säule = 1\n", "säule = 11\n", "söule = 1\n", "x\nsäule = 1\ny"];
        for old in texts {
            for new in texts {
                let change = Change::between(old, new);
                assert_eq!(change.done(old), new);
                assert_eq!(change.undone(new), old);
            }
        }
    }

    #[test]
    fn a_run_is_undone_at_once() {
        let mut history = History::default();
        let mut text = "10".to_owned();
        for (new, run) in [("11", Some("a")), ("12", Some("a")), ("13", Some("b")), ("14", None), ("15", None)] {
            history.push(&text, new, format!("to {new}"), run.map(str::to_owned));
            text = new.to_owned();
        }
        let mut seen = Vec::new();
        while let Some((before, _)) = history.undo(&text) {
            text = before;
            seen.push(text.clone());
        }
        assert_eq!(seen, ["14", "13", "12", "10"]);
        while let Some((after, _)) = history.redo(&text) {
            text = after;
        }
        assert_eq!(text, "15");
    }
}
