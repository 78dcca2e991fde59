//! Scripts, compiled and checked: what a [`Runtime`](crate::runtime::Runtime) runs.

use crate::check;
use crate::diagnostic::{Diagnostic, Severity};
use crate::engine;
use crate::limits::Limits;
use crate::names::Names;
use rhai::AST;
use std::collections::HashMap;
use std::sync::Arc;

/// Bytes of a script's text: more is refused before it is parsed.
pub const MAX_SOURCE_BYTES: usize = 256 * 1024;
/// Scripts of a site.
pub const MAX_SCRIPTS: usize = 64;

/// A script as it is written.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Source {
    /// What messages call it: its file's name. Each script has its own.
    pub name: String,
    /// Its text.
    pub text: String,
}

impl Source {
    /// A script of a name.
    #[must_use]
    pub fn new(name: impl Into<String>, text: impl Into<String>) -> Self {
        Self { name: name.into(), text: text.into() }
    }
}

/// A script that compiles and whose names are all known.
#[derive(Clone, Debug)]
pub(crate) struct Script {
    pub name: String,
    pub tree: AST,
    /// Numbers of parameters of its functions, by name.
    pub functions: Arc<HashMap<String, Vec<usize>>>,
}

/// The scripts of a site that can run. Cheap to clone; made on any thread.
#[derive(Clone, Debug)]
pub struct Program {
    pub(crate) scripts: Vec<Script>,
    pub(crate) names: Names,
    sound: bool,
}

impl Program {
    /// Compiles and checks scripts against what a site has; nothing runs.
    ///
    /// Answers with the scripts that can run and everything there is to tell, in the order of the scripts and their lines. A
    /// script with an error is left out; the others are there.
    #[must_use]
    pub fn compile(sources: &[Source], names: &Names) -> (Self, Vec<Diagnostic>) {
        let engine = engine::bare(&Limits::default());
        let library = check::Library::of(&engine);
        let mut told = Vec::new();
        let mut scripts: Vec<Script> = Vec::new();
        let mut gathered = check::Gathered::default();
        for (i, source) in sources.iter().enumerate() {
            let refuse = |message: &str, remedy: &str| Diagnostic::new(&source.name, check::NOWHERE, message, remedy);
            if i >= MAX_SCRIPTS {
                told.push(refuse(&format!("there are more than {MAX_SCRIPTS} scripts"), "join some"));
                break;
            }
            if source.text.len() > MAX_SOURCE_BYTES {
                told.push(refuse(&format!("the script has more than {} KiB", MAX_SOURCE_BYTES / 1024), "divide it"));
                continue;
            }
            if scripts.iter().any(|script| script.name == source.name) {
                told.push(refuse("another script has the same name", "give each a name of its own"));
                continue;
            }
            match engine.compile(&source.text) {
                Err(error) => told.push(check::parse_error(&source.name, &error)),
                Ok(mut tree) => {
                    tree.set_source(source.name.as_str());
                    let found = check::check(&source.name, &tree, names, &library, &mut gathered);
                    let sound = found.iter().all(|diagnostic| diagnostic.severity != Severity::Error);
                    told.extend(found);
                    if sound {
                        let functions = check::functions(&tree);
                        scripts.push(Script { name: source.name.clone(), tree, functions: Arc::new(functions) });
                    }
                }
            }
        }
        told.extend(gathered.unanswered());
        let order: HashMap<&str, usize> = sources.iter().enumerate().map(|(i, source)| (source.name.as_str(), i)).collect();
        told.sort_by_key(|diagnostic| (order.get(diagnostic.file.as_str()).copied(), diagnostic.place));
        let sound = told.iter().all(|diagnostic| diagnostic.severity != Severity::Error);
        (Self { scripts, names: names.clone(), sound }, told)
    }

    /// Whether no script was left out.
    #[must_use]
    pub fn is_sound(&self) -> bool {
        self.sound
    }

    /// The names of the scripts that can run.
    pub fn script_names(&self) -> impl Iterator<Item = &str> {
        self.scripts.iter().map(|script| script.name.as_str())
    }
}
