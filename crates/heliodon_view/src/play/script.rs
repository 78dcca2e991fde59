//! A visit that is played: what somebody does, in lines.

use thiserror::Error;

/// What is walked to or looked at.
#[derive(Clone, Debug, PartialEq)]
pub enum Goal {
    /// An actor, a thing, a region or a view, by its name.
    Named(String),
    /// A place, metres.
    Place([f32; 3]),
}

/// What is expected to be so.
#[derive(Clone, Debug, PartialEq)]
#[expect(missing_docs, reason = "fields are what their names say, units in them")]
pub enum Expected {
    /// The task that stands, by its key; `none` for no task.
    Task(String),
    /// What the right hand holds; `none` for nothing.
    Held(String),
    /// The last material that scripts have covered something with.
    Material { target: String, material: String },
    /// What scripts remember, as JSON.
    Memory { key: String, value: String },
}

/// What is done in a line.
#[derive(Clone, Debug, PartialEq)]
#[expect(missing_docs, reason = "fields are what their names say, units in them")]
pub enum Doing {
    /// Walks until so near to the goal on the ground.
    Walk { to: Goal, within_m: f32 },
    /// Looks, or points a tracked hand.
    Look(Goal),
    /// Strikes something with what the right hand holds: by the action for it, or by swinging a tracked hand.
    Strike(Goal),
    /// Sets an action off, by its name in `display.toml` or what that ends with, and holds it for so many seconds.
    Press { action: String, hold_s: f32 },
    /// Lets time pass.
    Wait(f32),
    /// Waits until something is so, for so many seconds at most.
    Until { expected: Expected, within_s: f32 },
    /// Something is so now.
    Expect(Expected),
    /// A picture of this moment, by its name.
    Shot(String),
    /// A note for whoever looks on.
    Say(String),
}

/// A line of a script.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    /// Its number, from 1.
    pub number: usize,
    /// What it says.
    pub text: String,
    /// What is done.
    pub doing: Doing,
}

/// What is wrong with a line.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("line {line}: {message}; {HELP}")]
pub struct ScriptFault {
    /// Its number, from 1.
    pub line: usize,
    /// What is wrong.
    pub message: String,
}

/// What lines there are.
pub const HELP: &str = "a line is one of: walk PLACE [within M] | look PLACE | strike PLACE | press ACTION [SECONDS] | wait SECONDS | until WHAT [within SECONDS] | expect WHAT | \
     shot NAME.png | say \"TEXT\"; PLACE is a name in quotes, x z, or x y z; WHAT is task KEY | held THING | material \"TARGET\" MATERIAL | memory KEY VALUE; # begins a remark";

/// How near is there, unless a line says it, metres.
const WITHIN_M: f32 = 0.35;
/// How long somebody waits for what must come, unless a line says it, seconds.
const WITHIN_S: f32 = 20.0;

/// Words of a line: what is in quotes is one.
fn words(text: &str) -> Result<Vec<String>, String> {
    let mut words = Vec::new();
    let mut rest = text.trim_start();
    while !rest.is_empty() && !rest.starts_with('#') {
        let (word, after) = match rest.strip_prefix('"') {
            Some(quoted) => quoted.split_once('"').ok_or("a quote is not closed")?,
            None => rest.split_once(char::is_whitespace).unwrap_or((rest, "")),
        };
        words.push(word.to_owned());
        rest = after.trim_start();
    }
    Ok(words)
}

fn number(word: &str) -> Result<f32, String> {
    word.parse::<f32>().ok().filter(|number| number.is_finite()).ok_or_else(|| format!("`{word}` is no number"))
}

/// What comes after `within`, and the words before it.
fn within(words: &[String]) -> Result<(&[String], Option<f32>), String> {
    match words {
        [before @ .., within, last] if within == "within" => Ok((before, Some(number(last)?))),
        _ => Ok((words, None)),
    }
}

fn goal(words: &[String]) -> Result<Goal, String> {
    match words {
        [name] => Ok(Goal::Named(name.clone())),
        [x, z] => Ok(Goal::Place([number(x)?, 0.0, number(z)?])),
        [x, y, z] => Ok(Goal::Place([number(x)?, number(y)?, number(z)?])),
        _ => Err("a place is a name, x z, or x y z".to_owned()),
    }
}

fn expected(words: &[String]) -> Result<Expected, String> {
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    Ok(match words[..] {
        ["task", key] => Expected::Task(key.to_owned()),
        ["held", thing] => Expected::Held(thing.to_owned()),
        ["material", target, material] => Expected::Material { target: target.to_owned(), material: material.to_owned() },
        ["memory", key, value] => Expected::Memory { key: key.to_owned(), value: value.to_owned() },
        _ => return Err("this is nothing that can be expected".to_owned()),
    })
}

fn doing(words: &[String]) -> Result<Doing, String> {
    let (first, rest) = words.split_first().ok_or("it is empty")?;
    Ok(match (first.as_str(), rest) {
        ("walk", rest) => {
            let (rest, near) = within(rest)?;
            Doing::Walk { to: goal(rest)?, within_m: near.unwrap_or(WITHIN_M) }
        }
        ("look", rest) => Doing::Look(goal(rest)?),
        ("strike", rest) => Doing::Strike(goal(rest)?),
        ("press", [action]) => Doing::Press { action: action.clone(), hold_s: 0.0 },
        ("press", [action, seconds]) => Doing::Press { action: action.clone(), hold_s: number(seconds)? },
        ("wait", [seconds]) => Doing::Wait(number(seconds)?),
        ("until", rest) => {
            let (rest, most) = within(rest)?;
            Doing::Until { expected: expected(rest)?, within_s: most.unwrap_or(WITHIN_S) }
        }
        ("expect", rest) => Doing::Expect(expected(rest)?),
        ("shot", [name]) => Doing::Shot(name.clone()),
        ("say", [text]) => Doing::Say(text.clone()),
        _ => return Err(format!("`{first}` with {} words after it is nothing that can be done", rest.len())),
    })
}

/// Reads a script.
///
/// # Errors
/// The first line that cannot be understood.
pub fn parse(text: &str) -> Result<Vec<Line>, ScriptFault> {
    let mut lines = Vec::new();
    for (index, text) in text.lines().enumerate() {
        let fault = |message| ScriptFault { line: index + 1, message };
        let words = words(text).map_err(fault)?;
        if !words.is_empty() {
            lines.push(Line { number: index + 1, text: text.trim().to_owned(), doing: doing(&words).map_err(fault)? });
        }
    }
    Ok(lines)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_say_what_is_done() {
        let text = "# a visit\nwalk \"the bench\" within 0.5\nwalk 1 -2\nlook 0 1.5 -3  # up\npress hand.take\n\npress hand.use 0.4\nwait 2\n\
            until task carve within 3\nexpect material \"zeus/face\" ivory\nexpect memory stage \"\\\"finished\\\"\"\nshot end.png\nsay \"the end\"";
        // quotes within quotes are none of this language's
        assert_eq!(parse(text).unwrap_err().line, 11);
        let lines = parse(&text.replace("\"\\\"finished\\\"\"", "finished")).unwrap();
        assert_eq!(lines.len(), 11);
        assert_eq!(
            (lines[0].number, &lines[0].doing),
            (2, &Doing::Walk { to: Goal::Named("the bench".into()), within_m: 0.5 })
        );
        assert_eq!(lines[1].doing, Doing::Walk { to: Goal::Place([1.0, 0.0, -2.0]), within_m: WITHIN_M });
        assert_eq!(lines[4].doing, Doing::Press { action: "hand.use".into(), hold_s: 0.4 });
        assert_eq!(lines[6].doing, Doing::Until { expected: Expected::Task("carve".into()), within_s: 3.0 });
        assert_eq!(lines[10].doing, Doing::Say("the end".into()));
    }

    #[test]
    fn what_is_no_line_is_told_with_its_number() {
        for (line, wanted) in [
            ("jump", "`jump`"),
            ("walk a b", "`a` is no number"),
            ("wait soon", "`soon` is no number"),
            ("look \"mallet", "not closed"),
            ("expect rain", "can be expected"),
            ("walk 1 2 3 4", "a place is"),
            ("say done and done", "`say` with 3 words"),
            ("wait inf", "no number"),
        ] {
            let fault = parse(&format!("wait 1\n{line}\n")).unwrap_err();
            assert!(fault.line == 2 && fault.message.contains(wanted), "{fault}");
        }
    }
}
