//! The manual of scripts, in Markdown, made from the table that registers their words.

use crate::limits::Limits;
use crate::vocabulary::{Group, Word, words};
use std::fmt::Write;

/// The manual: how scripts are written, and every word with its arguments, the event of its handler and an example.
#[must_use]
pub fn manual() -> String {
    let limits = Limits::default();
    let mut text = String::from(BEGINNING);
    let numbers = [
        ("{handler_operations}", limits.handler_operations.to_string()),
        ("{handler_ms}", limits.handler_ms.unwrap_or(0).to_string()),
        ("{call_depth}", limits.call_depth.to_string()),
        ("{text_kib}", (limits.text_bytes / 1024).to_string()),
        ("{list_entries}", limits.list_entries.to_string()),
        ("{table_entries}", limits.table_entries.to_string()),
        ("{state_kib}", (limits.state_bytes / 1024).to_string()),
        ("{messages}", limits.messages.to_string()),
        ("{actions}", limits.actions.to_string()),
        ("{handlers}", limits.handlers.to_string()),
        ("{timers}", limits.timers.to_string()),
        ("{failures}", limits.failures.to_string()),
    ];
    for (hole, number) in numbers {
        text = text.replace(hole, &number);
    }
    for group in Group::ALL {
        let _ = write!(text, "\n## {}\n", group.title());
        for word in words().filter(|word| word.group == group) {
            describe(&mut text, word);
        }
    }
    text
}

fn describe(text: &mut String, word: &Word) {
    // writing into a String cannot fail
    let _ = write!(text, "\n### {}\n\n`{}`\n\n{}\n", word.name, word.signature(), word.what);
    if !word.arguments.is_empty() {
        text.push('\n');
    }
    for (i, argument) in word.arguments.iter().enumerate() {
        let may = if i < word.required { "" } else { " (may be left out)" };
        let _ = writeln!(text, "- `{}`{may}: {}", argument.name, argument.kind.words());
    }
    if !word.fields.is_empty() {
        let fields: Vec<String> = word.fields.iter().map(|(name, what)| format!("`e.{name}` ({what})")).collect();
        let _ = write!(text, "\nThe event: {}.\n", fields.join(", "));
    }
    let _ = write!(text, "\n```rhai\n{}\n```\n", word.example.trim());
}

const BEGINNING: &str = r#"# Scripts of a site

A script says what happens on a site: *when* something happens, *then* do this. It is a text file that ends in `.rhai`.

```rhai
state.blows = 0;

when_enter("workshop", || {
    subtitle("welcome");
    task("strike");
});

when_struck("zeus/face", "chisel", |e| {
    state.blows += 1;
    start_particles("dust");
    if state.blows == 3 {
        subtitle("well-done");
        no_task();
    }
});
```

What stands between the braces is done when the visitor enters, each time. `e` is the event: what happened, to what, by what.
Names such as `"workshop"` are those of the site; `heliodon script check` finds the ones that are not there, before anything runs.
Texts such as `"welcome"` are keys of the table of texts, where they stand in every language.

## The language

Scripts are written in Rhai (rhai.rs/book). What one needs of it:

| written | what it is |
| --- | --- |
| `let name = 3;` | a variable; `const NAME = 3;` one that never changes |
| `3`, `2.5`, `"text"`, `true`, `[1, 2]`, `#{ a: 1 }` | a number, a text, yes, a list, values with names |
| `if a == 1 && b > 2 { ... } else { ... }` | a choice |
| `for part in ["face", "hand"] { ... }` | something for each of a list |
| `fn open(door) { turn(door, 90, 2); }` | a function of your own, called as `open("north-door")` |
| `"blows: " + state.blows`, or `` `blows: ${state.blows}` `` | texts put together |
| `print(state.blows)` | told to the author, not to the visitor |
| `// ...` | a remark |

**What lasts is in `state`.** Each script has its own: `state.blows = 0;` at the top, `state.blows += 1;` in a handler. Other
variables live as long as the braces in which they stand. Handlers and functions see the variables at the top of the script as
they were when the top had run, and cannot change them.

**A handler is handed what it needs.** It does not see the variables around it. Whatever stands after it is `e.given`:

```rhai
for part in ["zeus/face", "zeus/robe"] {
    when_look(part, 1.0, |e| hint(e.given), "about-" + part.sub_string(5));
}
```

**What outlives what.** `state` lives until the script is saved again; what is named by `keep` outlives that, too. `remember`
and `recall` are for what is known at the next visit.

**When a script goes wrong** it is told with its line, and what it was doing is dropped; the next event finds it again. After
{failures} failures within a minute it is switched off until it is saved again. The other scripts go on. A handler may take
{handler_operations} operations and {handler_ms} ms; functions may call one another {call_depth} deep; a text may have {text_kib} KiB, a list
{list_entries} entries, a `#{ ... }` {table_entries}, `state` {state_kib} KiB; in a frame a script may send {messages} messages and ask for {actions} actions;
it may have {handlers} handlers and {timers} timers.

Saved while the viewer runs, the scripts start anew: their top runs, timers are gone. Where one has an error, all go on as they were.
"#;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_word_is_in_the_manual() {
        let manual = manual();
        for word in words() {
            assert!(manual.contains(&format!("\n### {}\n\n`{}`\n", word.name, word.signature())), "{}", word.name);
        }
        assert!(!manual.contains("{handler") && !manual.contains("_kib}"), "a number is missing");
        assert_eq!(manual.matches("```").count() % 2, 0);
    }
}
