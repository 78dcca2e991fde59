//! The scripts that Slurm runs.

use std::ffi::OsStr;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// Where everything is, in absolute terms: a job begins elsewhere.
pub struct Places {
    /// This program.
    pub program: PathBuf,
    /// The site.
    pub site: PathBuf,
    /// Where the bundle will stand.
    pub bundle: PathBuf,
    /// The cache that all shards share.
    pub cache: PathBuf,
    /// Whether a bundle that is up to date is baked again.
    pub again: bool,
}

/// The cores that Slurm has given: without a plugin that binds tasks a program would use all that a node has.
const THREADS: &str = "--threads \"${SLURM_CPUS_PER_TASK:-${SLURM_CPUS_ON_NODE:-1}}\"";

/// One shard of `count` of the plan `key`, its number that of the task.
pub fn of_shard(places: &Places, count: u32, key: &str) -> String {
    format!("{} --shard \"$SLURM_ARRAY_TASK_ID/{count}\" --plan {key} {THREADS}\n", begin(places, "bake"))
}

/// The merge, whose report goes to `report`.
pub fn of_merge(places: &Places, report: &Path, no_cache: bool) -> String {
    let keep = if no_cache { " --no-cache" } else { "" };
    format!("{}{keep} --json {THREADS} > {}\n", begin(places, "merge"), quoted(report.as_os_str()))
}

fn begin(places: &Places, command: &str) -> String {
    let Places { program, site, bundle, cache, again } = places;
    let mut text = String::from("#!/bin/sh\n# Written by heliodon; Slurm runs it.\nexec ");
    let quote = |path: &PathBuf| quoted(path.as_os_str());
    let _ = write!(text, "{} {command} {} -o {} --cache {}", quote(program), quote(site), quote(bundle), quote(cache));
    text += if *again { " --again" } else { "" };
    text
}

/// As one word of a shell.
fn quoted(text: &OsStr) -> String {
    format!("'{}'", text.to_string_lossy().replace('\'', "'\\''"))
}

/// Numbers that ascend, in Slurm's notation: `1-3,7`.
pub fn array(numbers: &[u32]) -> String {
    let runs = numbers.chunk_by(|a, b| a + 1 == *b).map(|run| match run {
        [one] => one.to_string(),
        run => format!("{}-{}", run[0], run[run.len() - 1]),
    });
    runs.collect::<Vec<_>>().join(",")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrays_and_paths_are_written_for_their_readers() {
        assert_eq!((array(&[1, 2, 3, 7]), array(&[5]), array(&[2, 3])), ("1-3,7".into(), "5".into(), "2-3".into()));
        let path = |name: &str| PathBuf::from(name);
        let places = Places {
            program: path("/bin/h"),
            site: path("/my site"),
            bundle: path("/it's/b"),
            cache: path("/c"),
            again: false,
        };
        let script = of_shard(&places, 7, "abc");
        assert!(script.starts_with("#!/bin/sh\n"), "{script}");
        assert!(
            script.contains("exec '/bin/h' bake '/my site' -o '/it'\\''s/b' --cache '/c' --shard \"$SLURM_ARRAY_TASK_ID/7\"")
        );
    }
}
