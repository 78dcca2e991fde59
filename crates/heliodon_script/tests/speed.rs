//! What scripts cost: 10,000 events a second, and a reload.
//!
//! `cargo test -p heliodon_script --test speed -- --ignored --nocapture` prints the figures.
#![expect(clippy::unwrap_used, reason = "helpers of tests: a test that cannot go on has failed")]

mod common;

use common::*;
use heliodon_script::limits::Limits;
use heliodon_script::program::{Program, Source};
use heliodon_testkit::process::peak_bytes;
use std::time::{Duration, Instant};

/// 10,000 events a second at 60 frames a second.
const EVENTS_A_FRAME: usize = 167;

/// A handler as a site has it: it counts, asks, decides and acts.
const HANDLERS: &str = r#"
    state.blows = 0;
    state.by = #{ chisel: 0, mallet: 0 };
    fn enough(e) { e.speed > 1.0 && distance(e.place, "bench") < 100.0 }
    when_struck("*", "*", |e| {
        if !enough(e) { hint("harder"); return; }
        state.blows += 1;
        state.by[e.tool] += 1;
        if state.blows % 10 == 0 { start_particles("dust"); }
        if is_held("chisel") && e.target == "zeus/face" { material("zeus/face", "ivory", 0.5); }
    });
"#;

/// Milliseconds of each of so many frames, sorted.
fn frames(count: usize) -> Vec<f64> {
    // without the clocks: another program on the machine must not put work off to the next frame
    let mut stage = Stage::with_limits(&[("strike.rhai", HANDLERS)], Limits::deterministic());
    stage.step();
    let mut taken = Vec::with_capacity(count);
    for frame in 0..count {
        for i in 0..EVENTS_A_FRAME {
            stage.runtime.event(struck(
                "zeus/face",
                if i % 2 == 0 { "chisel" } else { "mallet" },
                0.5 + (frame + i) as f32 % 3.0,
            ));
        }
        let began = Instant::now();
        stage.step();
        taken.push(began.elapsed().as_secs_f64() * 1e3);
        assert!(!stage.runtime.is_behind(), "frame {frame} did not get through");
    }
    assert_eq!(stage.told(), "");
    let statistics = &stage.runtime.statistics()[0].1;
    assert_eq!((statistics.calls, statistics.dropped_events), (1 + (count * EVENTS_A_FRAME) as u64, 0));
    taken.sort_by(f64::total_cmp);
    taken
}

/// A site of 20 scripts, about 2,000 lines together.
fn large_site() -> Vec<Source> {
    let text: String = (0..10)
        .map(|i| format!("{}\nwhen_touch(\"mallet\", |e| {{ if e.thing == \"mallet\" {{ show(\"ladder\"); after({i}, || hide(\"ladder\")); }} }});\n", HANDLERS.replace("enough", &format!("enough{i}"))))
        .collect();
    (0..20).map(|i| Source::new(format!("{i}.rhai"), text.clone())).collect()
}

/// Compiling, taking over and starting again.
fn reload() -> Duration {
    let sources = large_site();
    let (program, told) = Program::compile(&sources, &names());
    assert!(program.is_sound(), "{}", lines(&told));
    let mut stage = Stage::new(&[("other.rhai", HANDLERS)]);
    stage.step();
    let began = Instant::now();
    let (program, _) = Program::compile(&sources, &names());
    stage.runtime.reload(program).unwrap();
    stage.step();
    let took = began.elapsed();
    assert_eq!(stage.told(), "");
    took
}

/// The largest resident memory of this process so far, MiB; 0 where the system does not say.
fn peak_mib() -> f64 {
    peak_bytes().unwrap_or(0) as f64 / f64::from(1 << 20)
}

/// A handler that holds as much as it can: a table that grows by an index, of texts as long as they may be.
fn hoard() {
    let text = r#"when_touch("mallet", || { let s = ""; s.pad(8000, 'a'); let m = #{}; let i = 0; loop { m["k" + i] = s + i; i += 1; } });"#;
    let mut stage = Stage::with_limits(&[("bad.rhai", text)], Limits::deterministic());
    stage.step();
    stage.after(touched("mallet"));
    assert!(stage.told().contains("is ended after 50000 operations"));
}

#[test]
#[ignore = "prints figures for BENCHMARKS.md"]
fn figures() {
    let taken = frames(600);
    let (median, p99, most) = (taken[300], taken[594], taken[599]);
    println!("{EVENTS_A_FRAME} events a frame: median {median:.3} ms, 99th of 100 {p99:.3} ms, longest {most:.3} ms");
    let lines: usize = large_site().iter().map(|source| source.text.lines().count()).sum();
    let mut reloads: Vec<f64> = (0..9).map(|_| reload().as_secs_f64() * 1e3).collect();
    reloads.sort_by(f64::total_cmp);
    let before = peak_mib();
    hoard();
    println!("the most that a handler could hold: {:.0} MiB", peak_mib() - before);
    println!("reload of 20 scripts, {lines} lines: median {:.1} ms, longest {:.1} ms", reloads[4], reloads[8]);
}

#[test]
fn events_and_reloads_stay_within_a_loose_bound() {
    // the bounds of the issue are 2 ms and 200 ms; a busy machine is given ten times as much for the fastest of several
    let taken = frames(30);
    assert!(taken[0] < 20.0, "the fastest frame took {} ms", taken[0]);
    let fastest = (0..3).map(|_| reload()).min().unwrap();
    assert!(fastest < Duration::from_secs(2), "the fastest reload took {fastest:?}");
}
