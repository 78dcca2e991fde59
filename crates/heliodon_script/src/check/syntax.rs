//! What the parser says, in plain English.

use crate::diagnostic::Diagnostic;
use rhai::{LexError, ParseError, ParseErrorType};

/// What to do without something that scripts of a site do not have.
pub(super) fn instead(word: &str) -> &'static str {
    match word {
        "import" | "export" => "a script loads no other files; scripts talk by send() and when_message()",
        "curry" => "hand values over as the last argument of when_..., after() and every(), and read e.given",
        "Fn" => "write the function's name without quotation marks, or || { ... }",
        _ => "write what it is to do into the script itself",
    }
}

/// What is wrong with a script that does not parse.
pub(crate) fn parse_error(file: &str, error: &ParseError) -> Diagnostic {
    let look = "look at this place and just before it";
    let (message, remedy) = match &*error.0 {
        ParseErrorType::UnexpectedEOF => {
            ("the script ends too early".to_owned(), "look for a bracket or quotation mark that is not closed".to_owned())
        }
        ParseErrorType::MissingToken(token, what) => (format!("`{token}` is missing {what}"), look.to_owned()),
        ParseErrorType::MissingSymbol(what) => (format!("something is missing: {what}"), look.to_owned()),
        ParseErrorType::Reserved(word) => (format!("`{word}` cannot be used in a site's scripts"), instead(word).to_owned()),
        ParseErrorType::BadInput(LexError::ImproperSymbol(word, text)) if text.contains("keyword") => {
            (format!("`{word}` cannot be used in a site's scripts"), instead(word).to_owned())
        }
        ParseErrorType::BadInput(LexError::UnterminatedString) => {
            ("a text is not closed".to_owned(), "put a quotation mark at its end".to_owned())
        }
        ParseErrorType::ExprTooDeep => {
            ("too many expressions stand in one another".to_owned(), "give the inner ones names with let".to_owned())
        }
        ParseErrorType::LiteralTooLarge(what, most) => (format!("{what} is larger than {most}"), "divide it".to_owned()),
        ParseErrorType::LoopBreak => {
            ("`break` or `continue` stands outside a loop".to_owned(), "return ends a function".to_owned())
        }
        ParseErrorType::AssignmentToConstant(name) => {
            (format!("`{name}` is a const and cannot be changed"), "declare it with let".to_owned())
        }
        ParseErrorType::FnDuplicatedDefinition(name, _) => {
            (format!("there are two functions `{name}`"), "give one of them another name".to_owned())
        }
        other => {
            let text = other.to_string();
            let mut letters = text.chars();
            let first = letters.next().map(char::to_lowercase);
            (first.into_iter().flatten().chain(letters).collect(), look.to_owned())
        }
    };
    Diagnostic::new(file, error.1.into(), message, remedy)
}
