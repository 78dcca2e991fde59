//! What can be found wrong with a script before it runs: unknown names, functions and variables, arguments that cannot be meant.

mod gathered;
mod syntax;

pub(crate) use gathered::Gathered;
pub(crate) use syntax::parse_error;

use crate::diagnostic::{Diagnostic, Place, Wrong, nearest};
use crate::engine::STATE;
use crate::names::Names;
use crate::vocabulary::{ArgumentKind, Literal, Word, word, words};
use rhai::{AST, ASTNode, Engine, Expr, FnCallExpr, FnPtr, Position, Stmt};
use std::collections::{HashMap, HashSet};

/// Of what has no place in its file.
pub(crate) const NOWHERE: Place = Place(None);

/// What Rhai itself has, and how to do without what it has not here.
const KEYWORDS: &[(&str, &[usize])] = &[
    ("print", &[0, 1]),
    ("debug", &[0, 1]),
    ("type_of", &[1]),
    ("is_def_var", &[1]),
    ("is_def_fn", &[2]),
    ("call", &[1, 2, 3, 4, 5, 6]),
];
const FORBIDDEN: &[&str] = &["eval", "Fn", "curry"];

/// Functions of Rhai's packages: numbers of parameters by name.
pub(crate) struct Library(HashMap<String, Vec<usize>>);

impl Library {
    pub fn of(engine: &Engine) -> Self {
        let list =
            engine.collect_fn_metadata(None, |info| Some((info.metadata.name.to_string(), info.metadata.num_params)), true);
        let mut library: HashMap<String, Vec<usize>> = HashMap::new();
        for (name, count) in list {
            library.entry(name).or_default().push(count);
        }
        for (name, counts) in KEYWORDS {
            library.entry((*name).to_owned()).or_default().extend_from_slice(counts);
        }
        Self(library)
    }
}

/// Numbers of parameters of a script's functions, anonymous ones among them.
pub(crate) fn functions(tree: &AST) -> HashMap<String, Vec<usize>> {
    let mut functions: HashMap<String, Vec<usize>> = HashMap::new();
    for function in tree.iter_fn_def() {
        functions.entry(function.name.to_string()).or_default().push(function.params.len());
    }
    functions
}

/// One function of a script, or its top level.
struct Body {
    name: Option<String>,
    parameters: Vec<String>,
    /// The tree with nothing else in it: Rhai walks whole trees, and does not say where it is.
    tree: AST,
    declared: HashSet<String>,
}

impl Body {
    fn all(tree: &AST) -> Vec<Self> {
        let top = Self { name: None, parameters: Vec::new(), tree: tree.clone_statements_only(), declared: HashSet::new() };
        let functions = tree.iter_functions().map(|function| {
            let (name, count) = (function.name.to_owned(), function.params.len());
            let parameters: Vec<String> = function.params.iter().map(|&name| name.to_owned()).collect();
            let declared = parameters.iter().cloned().collect();
            let mut tree = tree.clone_functions_only();
            tree.retain_functions(|_, _, other, others| other == name && others == count);
            Self { name: Some(name), parameters, tree, declared }
        });
        std::iter::once(top).chain(functions).collect()
    }
}

struct Checker<'a> {
    file: &'a str,
    names: &'a Names,
    library: &'a Library,
    functions: HashMap<String, Vec<usize>>,
    /// Top-level variables: handlers see them, and cannot change them.
    globals: HashSet<String>,
    /// Those that are texts from the beginning to the end.
    constants: HashMap<String, String>,
    /// Which words a function is a handler of.
    handlers: HashMap<String, Vec<&'static Word>>,
    told: Vec<Diagnostic>,
}

/// Everything that is wrong with a script that parses.
pub(crate) fn check(file: &str, tree: &AST, names: &Names, library: &Library, gathered: &mut Gathered) -> Vec<Diagnostic> {
    let mut bodies = Body::all(tree);
    let mut checker = Checker {
        file,
        names,
        library,
        functions: functions(tree),
        globals: HashSet::new(),
        constants: HashMap::new(),
        handlers: HashMap::new(),
        told: Vec::new(),
    };
    for statement in tree.statements() {
        if let Stmt::Var(var, flags, _) = statement {
            checker.globals.insert(var.0.name.to_string());
            if let (Expr::StringConstant(text, _), true) = (&var.1, flags.intersects(rhai::ASTFlags::CONSTANT)) {
                checker.constants.insert(var.0.name.to_string(), text.to_string());
            }
        }
    }
    for body in &mut bodies {
        let mut declared = std::mem::take(&mut body.declared);
        walk(&body.tree, &mut |path| checker.gather(path, &mut declared));
        body.declared = declared;
    }
    for body in &bodies {
        let elsewhere = |name: &str| bodies.iter().any(|other| other.declared.contains(name));
        walk(&body.tree, &mut |path| checker.visit(path, body, &elsewhere, gathered));
    }
    checker.told
}

fn walk(tree: &AST, visit: &mut dyn FnMut(&[ASTNode<'_>])) {
    tree.walk(&mut |path: &[ASTNode<'_>]| {
        visit(path);
        true
    });
}

/// The name of a variable, where an expression is one.
fn variable_name(expression: &Expr) -> Option<&str> {
    match expression {
        Expr::Variable(variable, ..) => Some(variable.1.as_str()),
        _ => None,
    }
}

/// The call of a node, if it is one, and whether something stands before its dot.
fn call_of<'a>(node: ASTNode<'a>) -> Option<(&'a FnCallExpr, Position, bool)> {
    match node {
        ASTNode::Expr(Expr::FnCall(call, position)) | ASTNode::Stmt(Stmt::FnCall(call, position)) => {
            (!call.is_operator_call()).then_some((&**call, *position, false))
        }
        ASTNode::Expr(Expr::MethodCall(call, position)) => Some((&**call, *position, true)),
        _ => None,
    }
}

/// The name of the function that a handler written in place is.
fn anonymous(expression: &Expr) -> Option<String> {
    match expression {
        Expr::DynamicConstant(value, _) => value.read_lock::<FnPtr>().map(|function| function.fn_name().to_owned()),
        _ => None,
    }
}

/// The variable at the beginning of `a.b[c].d`.
fn root(expression: &Expr) -> Option<(&str, Position)> {
    match expression {
        Expr::Dot(pair, ..) | Expr::Index(pair, ..) => root(&pair.lhs),
        _ => variable_name(expression).map(|name| (name, expression.start_position())),
    }
}

impl Checker<'_> {
    fn tell(&mut self, position: Position, message: impl Into<String>, remedy: impl Into<String>) {
        self.told.push(Diagnostic::new(self.file, position.into(), message, remedy));
    }

    /// First walk: what is declared, and which functions are handlers of what.
    fn gather(&mut self, path: &[ASTNode<'_>], declared: &mut HashSet<String>) {
        let Some(&node) = path.last() else { return };
        match node {
            ASTNode::Stmt(Stmt::Var(var, ..)) => drop(declared.insert(var.0.name.to_string())),
            ASTNode::Stmt(Stmt::For(parts, _)) => {
                declared.insert(parts.0.name.to_string());
                declared.extend(parts.1.iter().map(|counter| counter.name.to_string()));
            }
            ASTNode::Stmt(Stmt::TryCatch(parts, _)) => {
                declared.extend(variable_name(&parts.expr).map(str::to_owned));
            }
            _ => {}
        }
        let Some((call, _, method)) = call_of(node) else { return };
        let Some(word) = word(&call.name) else { return };
        for (argument, value) in word.arguments.iter().skip(usize::from(method)).zip(call.args.iter()) {
            if argument.kind == ArgumentKind::Handler
                && let Some(function) = anonymous(value)
            {
                self.handlers.entry(function).or_default().push(word);
            }
        }
    }

    /// Second walk: what is wrong.
    fn visit(&mut self, path: &[ASTNode<'_>], body: &Body, elsewhere: &dyn Fn(&str) -> bool, gathered: &mut Gathered) {
        let Some(&node) = path.last() else { return };
        if let Some((call, position, method)) = call_of(node) {
            self.visit_call(call, position, method, body, gathered);
            return;
        }
        match node {
            ASTNode::Stmt(Stmt::Var(var, ..)) if var.0.name == STATE => {
                self.tell(
                    var.0.pos,
                    "`state` is there already: it is what lasts of a script",
                    "give the variable another name",
                );
            }
            ASTNode::Stmt(Stmt::Assignment(parts)) => {
                if let Some((name, position)) = root(&parts.1.lhs)
                    && body.name.is_some()
                    && !body.declared.contains(name)
                    && self.globals.contains(name)
                {
                    let message = format!("`{name}` cannot be changed here: a function sees what stands at the top as it was");
                    self.tell(position, message, format!("write state.{name}, here and at the top"));
                }
            }
            ASTNode::Expr(expression @ Expr::Variable(..)) => self.visit_variable(expression, body, elsewhere),
            ASTNode::Expr(Expr::Dot(pair, ..)) => self.visit_field(&pair.lhs, &pair.rhs, body),
            _ => {}
        }
    }

    fn visit_variable(&mut self, expression: &Expr, body: &Body, elsewhere: &dyn Fn(&str) -> bool) {
        let Some(name) = variable_name(expression) else { return };
        let known =
            body.declared.contains(name) || self.globals.contains(name) || self.functions.contains_key(name) || name == STATE;
        if known {
            return;
        }
        let position = expression.start_position();
        if elsewhere(name) {
            let message = format!("`{name}` is not known here: a function sees what it is given and what stands at the top");
            let remedy = "hand it over as the last argument and read e.given, or write it into state";
            return self.tell(position, message, remedy);
        }
        let near = body.declared.iter().chain(&self.globals).map(String::as_str).chain([STATE]);
        let remedy = match nearest(name, near) {
            Some(word) => format!("did you mean `{word}`?"),
            None => format!("write let {name} = ...; before it, or \"{name}\" in quotation marks if it is a name of the site"),
        };
        self.tell(position, format!("there is no variable `{name}`"), remedy);
    }

    /// `e.tol`, where `e` is the event that a handler was given.
    fn visit_field(&mut self, lhs: &Expr, rhs: &Expr, body: &Body) {
        let Some(words) = body.name.as_ref().and_then(|name| self.handlers.get(name)) else { return };
        let (Some(event), Some(variable)) = (body.parameters.first(), variable_name(lhs)) else { return };
        let property = match rhs {
            Expr::Property(property, position) => Some((property, position)),
            Expr::Dot(pair, ..) | Expr::Index(pair, ..) => match &pair.lhs {
                Expr::Property(property, position) => Some((property, position)),
                _ => None,
            },
            _ => None,
        };
        let Some((property, position)) = property else { return };
        if variable != event {
            return;
        }
        let field = property.2.as_str();
        let fields = || words.iter().flat_map(|word| word.fields.iter().map(|(name, _)| *name)).chain(["given"]);
        if fields().any(|known| known == field) {
            return;
        }
        let remedy = match nearest(field, fields()) {
            Some(word) => format!("did you mean `{event}.{word}`?"),
            None => format!("there are: {}", fields().map(|name| format!("{event}.{name}")).collect::<Vec<_>>().join(", ")),
        };
        let message = format!("the event of {} has no `{field}`", words[0].name);
        self.tell(*position, message, remedy);
    }

    fn visit_call(&mut self, call: &FnCallExpr, position: Position, method: bool, body: &Body, gathered: &mut Gathered) {
        let name = call.name.as_str();
        let count = call.args.len() + usize::from(method);
        let own = self.functions.get(name);
        if FORBIDDEN.contains(&name) {
            return self.tell(position, format!("`{name}` cannot be used in a site's scripts"), syntax::instead(name));
        }
        if let Some(own) = own {
            // a method of the script's own is given what stands before the dot as `this`
            if own.contains(&count) || (method && own.contains(&(count - 1))) {
                return;
            }
        }
        if let Some(word) = word(name) {
            if !(word.required..=word.arguments.len()).contains(&count) {
                let message = format!("{name} is given {count} {}", if count == 1 { "argument" } else { "arguments" });
                return self.tell(position, message, format!("write {}", word.signature()));
            }
            return self.visit_word(word, call, method, body, gathered);
        }
        let known = self.library.0.get(name);
        if known.is_some_and(|counts| counts.contains(&count)) {
            return;
        }
        if let Some(counts) = own.or(known) {
            let mut counts: Vec<usize> = counts.clone();
            counts.sort_unstable();
            counts.dedup();
            let counts: Vec<String> = counts.iter().map(ToString::to_string).collect();
            let message = format!("{name} is given {count} {}", if count == 1 { "argument" } else { "arguments" });
            return self.tell(position, message, format!("give it {}", counts.join(" or ")));
        }
        if body.declared.contains(name) || self.globals.contains(name) {
            let message = format!("`{name}` is a variable, not a function");
            return self.tell(position, message, format!("if a function was put into it, write {name}.call()"));
        }
        let own = self.functions.keys().map(String::as_str).filter(|name| !name.starts_with("anon$"));
        let near = words().map(|word| word.name).chain(own).chain(KEYWORDS.iter().map(|(name, _)| *name));
        let remedy = match nearest(name, near) {
            Some(word) => format!("did you mean `{word}`?"),
            None => "the manual lists all: heliodon script manual".to_owned(),
        };
        self.tell(position, format!("there is no function `{name}`"), remedy);
    }

    fn literal<'a>(&'a self, expression: &'a Expr, body: &Body) -> Option<Literal<'a>> {
        Some(match expression {
            Expr::StringConstant(text, _) => Literal::Text(text),
            Expr::IntegerConstant(number, _) => Literal::Number(*number as f64),
            Expr::FloatConstant(number, _) => Literal::Number(**number),
            Expr::BoolConstant(..) => Literal::Flag,
            Expr::Unit(_) => Literal::Nothing,
            Expr::Array(..) => Literal::List,
            Expr::Map(..) => Literal::Table,
            Expr::DynamicConstant(value, _) if value.is_fnptr() => Literal::Function,
            Expr::Variable(..) => {
                let name = variable_name(expression)?;
                let local = body.name.is_some() && body.declared.contains(name);
                Literal::Text(self.constants.get(name).filter(|_| !local)?)
            }
            _ => return None,
        })
    }

    fn visit_word(&mut self, word: &'static Word, call: &FnCallExpr, method: bool, body: &Body, gathered: &mut Gathered) {
        let mut texts = Vec::new();
        if method {
            texts.push(None);
        }
        for (argument, value) in word.arguments.iter().skip(usize::from(method)).zip(call.args.iter()) {
            let place = value.start_position();
            if argument.kind == ArgumentKind::Handler
                && let Some(counts) = anonymous(value).and_then(|function| self.functions.get(&function))
                && !counts.contains(&0)
                && !counts.contains(&1)
            {
                let message = format!("the handler of {} takes more than one argument", word.name);
                self.tell(place, message, "a handler takes none, || { ... }, or the event, |e| { ... }");
                continue;
            }
            let literal = self.literal(value, body);
            let wrong = literal.map(|literal| argument.kind.check_literal(literal, self.names));
            texts.push(match literal {
                Some(Literal::Text(text)) => Some(text.to_owned()),
                _ => None,
            });
            if let Some(Err(Wrong { message, remedy })) = wrong {
                let message = match message.strip_prefix("it is ") {
                    Some(what) => format!("`{}` of {} is {what}", argument.name, word.name),
                    None => message,
                };
                self.tell(place, message, remedy);
            }
        }
        let place = call.args.first().map_or(NOWHERE, |value| value.start_position().into());
        gathered.note(self.file, place, word.name, &texts);
    }
}
