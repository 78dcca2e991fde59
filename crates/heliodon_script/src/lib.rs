//! What happens on a site, in scripts: regions entered, things touched and struck, hours reached become movements, sounds,
//! subtitles and tasks.
//!
//! | module | what it does |
//! | --- | --- |
//! | [`book`] | a site's scripts and texts, read and checked against what it has |
//! | [`names`] | what exists on a site, by kind |
//! | [`program`] | scripts compiled and checked against the names: errors with line, column and remedy, before anything runs |
//! | [`runtime`] | runs them: [events](event::Event) in, once a frame [actions](action::Action) out, within [limits] |
//! | [`world`] | the snapshot that scripts ask |
//! | [`memory`] | what is kept between visits |
//! | [`texts`] | subtitles in several languages |
//! | [`vocabulary`], [`manual`](mod@manual) | every word that scripts have, one table; the manual made from it |
//!
//! Scripts are written in Rhai, in a sandbox: no files, modules, clock or `eval`; time, memory, messages and everything else have
//! [limits](limits::Limits), and a script that is over them, fails or loops is told of and, in the end, switched off, while the others
//! go on. `tests/all/hostile.rs` holds each limit to what tries to break it.
//!
//! The crate knows nothing of Bevy and carries nothing out: the host tells what has happened and does what is asked for. It
//! reads no clock but for the two budgets in milliseconds, which [`Limits::deterministic`](limits::Limits::deterministic) leaves
//! out; the only files are those that [`memory::Memory`] is told to open and save and that a [`book::Book`] is read from.
//!
//! # Example
//!
//! ```
//! use heliodon_script::action::Action;
//! use heliodon_script::event::Event;
//! use heliodon_script::limits::Limits;
//! use heliodon_script::memory::Memory;
//! use heliodon_script::names::{Kind, Names};
//! use heliodon_script::program::{Program, Source};
//! use heliodon_script::runtime::Runtime;
//! use heliodon_script::world::World;
//!
//! let names = Names::none().with(Kind::Region, ["workshop"]).with(Kind::Text, ["welcome"]);
//! let source = Source::new("workshop.rhai", r#"when_enter("workshop", || subtitle("welcome", 3));"#);
//! let (program, told) = Program::compile(&[source], &names);
//! assert!(program.is_sound() && told.is_empty());
//!
//! let mut runtime = Runtime::new(program, Memory::default(), Limits::default(), 0);
//! let world = World::new();
//! runtime.step(0.0, &world); // the scripts start
//!
//! // once a frame
//! runtime.event(Event::Entered { region: "workshop".to_owned() });
//! let actions = runtime.step(0.016, &world);
//! assert!(matches!(&actions[..], [Action::Subtitle { text, seconds: 3.0, .. }] if text == "welcome"));
//! assert!(runtime.take_told().is_empty());
//! ```

pub mod action;
pub mod book;
mod check;
mod desk;
pub mod diagnostic;
mod engine;
pub mod event;
pub mod limits;
pub mod manual;
pub mod memory;
pub mod names;
mod place;
pub mod program;
pub mod runtime;
pub mod texts;
pub mod value;
pub mod vocabulary;
pub mod world;
