//! The sandbox: a Rhai engine with our words, without modules, clocks, files, captured variables or `eval`.
//!
//! # Why functions capture nothing
//!
//! Rhai's closures share the variables that they capture. What is shared can hold itself, is counted by none of Rhai's limits on
//! size, and frees itself by recursion: a script of three lines fills the memory or overflows the stack. Without the feature
//! every value is a tree whose size is limited, a script's lasting data is one thing (`state`) that can be measured, and authors
//! read `state.blows` and see what lasts. What a handler needs from around it is handed over as its last argument, `e.given`.

use crate::desk::{SharedDesk, lock};
use crate::diagnostic::{Place, Severity, Wrong};
use crate::limits::Limits;
use crate::place;
use crate::vocabulary::{Word, words};
use rhai::packages::{
    ArithmeticPackage, BasicArrayPackage, BasicFnPackage, BasicIteratorPackage, BasicMapPackage, BasicMathPackage,
    BasicStringPackage, LogicPackage, MoreStringPackage, Package,
};
use rhai::{Dynamic, Engine, EvalAltResult, FuncRegistration, ImmutableString, NativeCallContext, Position};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// Expressions in expressions, at the top and in functions: the parser and the interpreter go as deep on the stack.
const EXPRESSION_DEPTH: usize = 48;
/// Operations between two looks at the clock. One operation can copy a list of lists, which takes some 0.1 ms.
const CLOCK_EVERY: u64 = 16;
/// Why a handler was ended.
pub(crate) const TOO_MANY_OPERATIONS: &str = "operations";
pub(crate) const TOO_LONG: &str = "time";
/// The variable that every script has.
pub(crate) const STATE: &str = "state";

type Answer<T> = Result<T, Box<EvalAltResult>>;

/// A script's `state`: a handle, its data lie on the desk.
#[derive(Clone, Copy, Debug)]
pub(crate) struct State(usize);

/// What a handler has used. Rhai's own count forgets what functions called by its library use up, so this one is kept beside it.
#[derive(Debug, Default)]
pub(crate) struct Meter {
    used: AtomicU64,
    most: AtomicU64,
    /// Microseconds since the beginning at which the handler must end; 0: never.
    deadline_us: AtomicU64,
    ended: AtomicBool,
}

/// The beginning of the meter's clock.
fn clock_us() -> u64 {
    static BEGAN: std::sync::OnceLock<Instant> = std::sync::OnceLock::new();
    u64::try_from(BEGAN.get_or_init(Instant::now).elapsed().as_micros()).unwrap_or(u64::MAX).max(1)
}

impl Meter {
    /// Begins to count for a handler.
    pub fn begin(&self, most: u64, time: Option<Duration>) {
        self.used.store(0, Ordering::Relaxed);
        self.most.store(most, Ordering::Relaxed);
        let deadline = time.map_or(0, |time| clock_us() + u64::try_from(time.as_micros()).unwrap_or(u64::MAX / 2));
        self.deadline_us.store(deadline, Ordering::Relaxed);
        self.ended.store(false, Ordering::Relaxed);
    }

    /// Operations since then.
    pub fn used(&self) -> u64 {
        self.used.load(Ordering::Relaxed)
    }

    fn tick(&self) -> Option<Dynamic> {
        // one thread alone counts: no read-modify-write is needed
        let used = self.used.load(Ordering::Relaxed) + 1;
        self.used.store(used, Ordering::Relaxed);
        if used > self.most.load(Ordering::Relaxed) {
            return Some(TOO_MANY_OPERATIONS.into());
        }
        if used.is_multiple_of(CLOCK_EVERY) || self.ended.load(Ordering::Relaxed) {
            let deadline = self.deadline_us.load(Ordering::Relaxed);
            if deadline != 0 && clock_us() > deadline {
                self.ended.store(true, Ordering::Relaxed);
                return Some(TOO_LONG.into());
            }
        }
        None
    }
}

/// An engine with Rhai's own functions alone, within limits: it compiles, and lists what there is.
pub(crate) fn bare(limits: &Limits) -> Engine {
    let mut engine = Engine::new_raw();
    ArithmeticPackage::new().register_into_engine(&mut engine);
    LogicPackage::new().register_into_engine(&mut engine);
    BasicStringPackage::new().register_into_engine(&mut engine);
    MoreStringPackage::new().register_into_engine(&mut engine);
    BasicIteratorPackage::new().register_into_engine(&mut engine);
    BasicFnPackage::new().register_into_engine(&mut engine);
    BasicArrayPackage::new().register_into_engine(&mut engine);
    BasicMapPackage::new().register_into_engine(&mut engine);
    BasicMathPackage::new().register_into_engine(&mut engine);
    engine
        .set_max_call_levels(limits.call_depth)
        .set_max_expr_depths(EXPRESSION_DEPTH, EXPRESSION_DEPTH)
        .set_max_variables(limits.variables)
        .set_max_functions(1000)
        .set_max_string_size(limits.text_bytes)
        .set_max_array_size(limits.list_entries)
        .set_max_map_size(limits.table_entries)
        .set_fail_on_invalid_map_property(true)
        .set_allow_shadowing(true);
    // `curry` is refused by the check, which can say what to write instead; it takes a function to call it, and `Fn` makes none
    for symbol in ["eval", "Fn"] {
        engine.disable_symbol(symbol);
    }
    place::register(&mut engine);
    register_replace(&mut engine, limits.text_bytes);
    engine
}

/// The engine that runs scripts.
pub(crate) fn whole(desk: &SharedDesk, meter: &Arc<Meter>, limits: &Limits) -> Engine {
    let mut engine = bare(limits);
    for word in words() {
        for count in word.required..=word.arguments.len() {
            register_word(&mut engine, desk, word, count);
        }
    }
    register_state(&mut engine, desk);
    engine.register_type_with_name::<Wrong>("error").register_fn("to_string", |wrong: &mut Wrong| wrong.to_string());
    let counted = Arc::clone(meter);
    engine.on_progress(move |_| counted.tick());
    let printing = Arc::clone(desk);
    engine.on_print(move |text| {
        let mut desk = lock(&printing);
        let script = desk.speaker;
        desk.tell(script, Severity::Note, Place(None), shortened(text), String::new());
    });
    let debugging = Arc::clone(desk);
    engine.on_debug(move |text, _, position| {
        let mut desk = lock(&debugging);
        let script = desk.speaker;
        desk.tell(script, Severity::Note, position.into(), shortened(text), String::new());
    });
    let variables = Arc::clone(desk);
    #[expect(
        deprecated,
        reason = "not deprecated: Rhai marks in this way what may change, and the lock file holds its version"
    )]
    engine.on_var(move |name, index, _| {
        // a variable that the parser has found is the function's own
        if index > 0 {
            return Ok(None);
        }
        let desk = lock(&variables);
        if name == STATE {
            return Ok(Some(Dynamic::from(State(desk.speaker))));
        }
        Ok(desk.sheets.get(desk.speaker).and_then(|sheet| sheet.globals.get(name)).cloned())
    });
    engine
}

/// What a script prints, a line of it.
fn shortened(text: &str) -> String {
    const MOST: usize = 500;
    match text.char_indices().nth(MOST) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text.to_owned(),
    }
}

/// As an error of Rhai's.
pub(crate) fn thrown(wrong: Wrong) -> Box<EvalAltResult> {
    Box::new(EvalAltResult::ErrorRuntime(Dynamic::from(wrong), Position::NONE))
}

fn register_word(engine: &mut Engine, desk: &SharedDesk, word: &'static Word, count: usize) {
    let desk = Arc::clone(desk);
    let call = move |context: NativeCallContext<'_>, values: &[Dynamic]| -> Answer<Dynamic> {
        let place = Place::from(context.call_position());
        word.call(&mut lock(&desk), place, values).map_err(thrown)
    };
    type D = Dynamic;
    // a wildcard of Rhai's is a parameter of type Dynamic: there is one function for each number of arguments
    let name = word.name;
    let _ = match count {
        0 => engine.register_fn(name, move |c: NativeCallContext<'_>| call(c, &[])),
        1 => engine.register_fn(name, move |c: NativeCallContext<'_>, v: D| call(c, &[v])),
        2 => engine.register_fn(name, move |c: NativeCallContext<'_>, v: D, w: D| call(c, &[v, w])),
        3 => engine.register_fn(name, move |c: NativeCallContext<'_>, v: D, w: D, x: D| call(c, &[v, w, x])),
        4 => engine.register_fn(name, move |c: NativeCallContext<'_>, v: D, w: D, x: D, y: D| call(c, &[v, w, x, y])),
        _ => engine.register_fn(name, move |c: NativeCallContext<'_>, v: D, w: D, x: D, y: D, z: D| call(c, &[v, w, x, y, z])),
    };
}

fn register_state(engine: &mut Engine, desk: &SharedDesk) {
    engine.register_type_with_name::<State>(STATE);
    let (reading, writing) = (Arc::clone(desk), Arc::clone(desk));
    FuncRegistration::new_index_getter().with_purity(true).with_volatility(true).register_into_engine(
        engine,
        move |state: &mut State, key: ImmutableString| -> Answer<Dynamic> {
            lock(&reading).state(state.0, &key).map_err(thrown)
        },
    );
    // pure in Rhai's sense: the handle does not change
    FuncRegistration::new_index_setter().with_purity(true).with_volatility(true).register_into_engine(
        engine,
        move |state: &mut State, key: ImmutableString, value: Dynamic| -> Answer<()> {
            lock(&writing).set_state(state.0, &key, value).map_err(thrown)
        },
    );
}

/// Rhai's own `replace` makes the whole text before it looks at its size: 16 KiB of `a`, each replaced by 16 KiB, are 256 MiB.
fn register_replace(engine: &mut Engine, most: usize) {
    fn replace(text: &mut ImmutableString, find: &str, by: &str, most: usize) -> Answer<()> {
        let found = text.matches(find).count();
        let length = (text.len() - found * find.len()).saturating_add(found.saturating_mul(by.len()));
        if length > most {
            return Err(Box::new(EvalAltResult::ErrorDataTooLarge("Length of string".to_owned(), Position::NONE)));
        }
        *text = text.replace(find, by).into();
        Ok(())
    }
    engine
        .register_fn("replace", move |text: &mut ImmutableString, find: &str, by: &str| replace(text, find, by, most))
        .register_fn("replace", move |text: &mut ImmutableString, find: char, by: &str| {
            replace(text, &find.to_string(), by, most)
        })
        .register_fn("replace", move |text: &mut ImmutableString, find: &str, by: char| {
            replace(text, find, &by.to_string(), most)
        })
        .register_fn("replace", move |text: &mut ImmutableString, find: char, by: char| {
            replace(text, &find.to_string(), &by.to_string(), most)
        });
}
