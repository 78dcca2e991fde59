//! Slurm's own commands: the one place where they are started and what they print is read.

use anyhow::{Context, Result, bail};
use std::ffi::OsString;
use std::io;
use std::path::Path;
use std::process::{Command, Output};

/// What is submitted.
pub struct Job<'a> {
    /// By this name it is found again.
    pub name: &'a str,
    /// The script that it runs.
    pub script: &'a Path,
    /// Where its output goes; `%a` is the task's number.
    pub log: &'a Path,
    /// The tasks of an array, in Slurm's notation (`1-3,7`).
    pub array: Option<String>,
    /// Begins once this job has succeeded, and goes where it has not.
    pub after: Option<u64>,
    /// Whatever else the user wants `sbatch` to be told.
    pub options: &'a [String],
}

/// A task that is waiting or running.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Task {
    /// What Slurm calls it: `17`, or `17_3` where it is one of an array.
    pub id: String,
    /// Its job's number.
    pub job: u64,
    /// `RUNNING`, `PENDING` and the like.
    pub state: String,
    /// Why it waits, where that is not that others are before it.
    pub held_by: Option<String>,
}

/// Why a task is held for good that a node could not start: `--requeue` has put it back, and nobody but an administrator lets it go on.
const LOST: &str = "launch failed requeued held";

impl Task {
    /// Whether it will not run unless somebody sees to it.
    pub fn is_lost(&self) -> bool {
        // later Slurms write underscores
        self.held_by.as_ref().is_some_and(|reason| reason.replace('_', " ") == LOST)
    }
}

/// Why tasks wait as a matter of course.
const USUAL: [&str; 8] =
    ["None", "(null)", "Priority", "Resources", "Dependency", "BeginTime", "Cleaning", "JobArrayTaskLimit"];

/// Looks whether Slurm is there.
///
/// # Errors
/// Where it is not, with what to do.
pub fn find() -> Result<()> {
    match Command::new("sbatch").arg("--version").output() {
        Ok(output) if output.status.success() => Ok(()),
        Ok(output) => bail!("sbatch does not work: {}", words(&output.stderr)),
        Err(error) if error.kind() == io::ErrorKind::NotFound => bail!(
            "there is no sbatch on the PATH: run this where jobs are submitted to Slurm (Debian: slurm-client), or share the bake \
             by any other means with --shard (docs/many-machines.md)"
        ),
        Err(error) => Err(error).context("sbatch cannot be started"),
    }
}

/// Submits a job; returns its number.
///
/// # Errors
/// What `sbatch` says.
pub fn submit(job: &Job) -> Result<u64> {
    let mut arguments: Vec<OsString> = vec!["--parsable".into(), format!("--job-name={}", job.name).into()];
    // Slurm expands % in the names of files
    let log = job.log.to_string_lossy().replace('%', "%%").replace("%%a", "%a");
    arguments.extend([format!("--output={log}").into(), "--open-mode=append".into()]);
    if !job.options.iter().any(|option| option.contains("requeue")) {
        arguments.push("--requeue".into());
    }
    arguments.extend(job.array.iter().map(|tasks| format!("--array={tasks}").into()));
    if let Some(after) = job.after {
        arguments.extend([format!("--dependency=afterok:{after}").into(), "--kill-on-invalid-dep=yes".into()]);
    }
    arguments.extend(job.options.iter().map(OsString::from));
    arguments.push(job.script.into());
    let told = run("sbatch", &arguments)?;
    job_number(&told).with_context(|| format!("sbatch printed no job number, but `{}`", told.trim()))
}

/// What waits or runs of the jobs of some names.
///
/// # Errors
/// What `squeue` says.
pub fn queued(names: &[String]) -> Result<Vec<Task>> {
    let arguments =
        ["--noheader".into(), "--array".into(), format!("--name={}", names.join(",")).into(), "--format=%i %T %r".into()];
    Ok(tasks(&run("squeue", &arguments)?))
}

/// Cancels all jobs of some names.
///
/// # Errors
/// What `scancel` says.
pub fn cancel(names: &[String]) -> Result<()> {
    names.iter().try_for_each(|name| run("scancel", &[format!("--name={name}").into()]).map(drop))
}

/// Cancels one task.
///
/// # Errors
/// What `scancel` says.
pub fn cancel_task(id: &str) -> Result<()> {
    run("scancel", &[id.into()]).map(drop)
}

/// How the tasks of an array have ended, by their numbers, where Slurm keeps accounts.
pub fn ended(job: u64) -> Vec<(u32, String)> {
    let fields = "--format=JobID,State";
    let arguments = ["--noheader", "--allocations", "--parsable2", "--jobs", &job.to_string(), fields].map(OsString::from);
    run("sacct", &arguments).map(|told| ends(&told)).unwrap_or_default()
}

fn run(program: &str, arguments: &[OsString]) -> Result<String> {
    let Output { status, stdout, stderr } =
        Command::new(program).args(arguments).output().with_context(|| format!("{program} cannot be started"))?;
    if !status.success() {
        bail!("{program} failed: {}", words(&stderr));
    }
    Ok(String::from_utf8_lossy(&stdout).into_owned())
}

/// What a program said, in one line.
fn words(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).split_whitespace().collect::<Vec<_>>().join(" ")
}

/// `123`, or `123;cluster`, perhaps after lines that a site's own filter prints.
fn job_number(told: &str) -> Option<u64> {
    told.lines().rev().find_map(|line| line.trim().split(';').next()?.parse().ok())
}

fn tasks(told: &str) -> Vec<Task> {
    let task = |line: &str| {
        let (id, rest) = line.trim().split_once(' ')?;
        let job = id.split_once('_').map_or(id, |(job, _)| job).parse().ok()?;
        let (state, reason) = rest.trim().split_once(' ').unwrap_or((rest, ""));
        let held_by = Some(reason.trim()).filter(|reason| state == "PENDING" && !reason.is_empty() && !USUAL.contains(reason));
        Some(Task { id: id.to_owned(), job, state: state.trim().to_owned(), held_by: held_by.map(str::to_owned) })
    };
    told.lines().filter_map(task).collect()
}

/// Lines of `12_3|NODE_FAIL`; of a cancelled one `CANCELLED by 0`.
fn ends(told: &str) -> Vec<(u32, String)> {
    let end = |line: &str| {
        let (id, state) = line.trim().split_once('|')?;
        Some((id.split_once('_')?.1.parse().ok()?, state.split(' ').next()?.to_owned()))
    };
    told.lines().filter_map(end).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_slurm_prints_is_read() {
        assert_eq!((job_number("17\n"), job_number("sbatch: note\n17;alps\n"), job_number("")), (Some(17), Some(17), None));
        let task = |id: &str, job, state: &str, held_by: Option<&str>| Task {
            id: id.to_owned(),
            job,
            state: state.to_owned(),
            held_by: held_by.map(str::to_owned),
        };
        let told =
            "17 RUNNING None\n\n18 PENDING \n19 PENDING Priority\n20_3 PENDING launch failed requeued held\nslurm: odd\n";
        let read = [
            task("17", 17, "RUNNING", None),
            task("18", 18, "PENDING", None),
            task("19", 19, "PENDING", None),
            task("20_3", 20, "PENDING", Some("launch failed requeued held")),
        ];
        assert_eq!(tasks(told), read);
        assert_eq!(read.map(|task| task.is_lost()), [false, false, false, true]);
        let later = tasks("21 PENDING launch_failed_requeued_held\n22 PENDING JobHeldUser\n");
        assert!(later[0].is_lost() && later[1].held_by.is_some() && !later[1].is_lost());
        let told = "17_1|COMPLETED\n17_2|CANCELLED by 0\n17_[3-4]|PENDING\n18|FAILED\n";
        assert_eq!(ends(told), [(1, "COMPLETED".to_owned()), (2, "CANCELLED".to_owned())]);
    }
}
