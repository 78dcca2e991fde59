//! A bake on Slurm: an array of shards and a merge that depends on it, followed to their end.
//!
//! Slurm does the work without us: whoever closes the terminal finds the bundle all the same, unless a shard is lost. While we are there we
//! tell how far all shards are (by the blocks in the cache, which needs no accounting), submit again what was lost, and on Ctrl-C cancel all. Before
//! anything is submitted Ctrl-C ends the program, as it does elsewhere.

mod client;
mod script;

use crate::App;
use crate::output::counted;
use anyhow::{Context, Result, bail};
use client::{Job, Task};
use heliodon_bake::CACHE_FOLDER;
use heliodon_bake::cache::Cache;
use heliodon_bake::merge::{Standing, begin_shards, standing};
use heliodon_bake::plan::Plan;
use heliodon_bake::report::Reporter;
use script::Places;
use serde::Serialize;
use serde_json::Value;
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// The shortest and the longest time between two looks at the queue: Slurm's masters serve many.
const LOOK_FIRST: Duration = Duration::from_millis(250);
const LOOK_LATER: Duration = Duration::from_secs(2);
/// How long Slurm's master may be silent before we give up: it is restarted now and then.
const PATIENCE: Duration = Duration::from_secs(600);
/// How long cancelled jobs may take to go.
const CANCELLING: Duration = Duration::from_secs(60);

/// How a bake runs on Slurm.
pub struct Options<'a> {
    /// Parts that the bake is divided into.
    pub shards: u32,
    /// How often a shard is submitted that ends without its blocks.
    pub tries: u32,
    /// What `sbatch` is told besides.
    pub sbatch: &'a [String],
}

/// What came of it.
#[derive(Debug, Serialize)]
pub struct SlurmReport {
    /// The key of the plan.
    pub plan: String,
    /// Shards.
    pub shards: u32,
    /// Jobs that were submitted, in order.
    pub jobs: Vec<u64>,
    /// Shards that were submitted again, once for each time.
    pub again: Vec<u32>,
    /// Seconds that it took.
    pub seconds: f64,
    /// What the merge reports.
    pub bake: Value,
}

/// Bakes on Slurm.
///
/// # Errors
/// What is wrong with the site or with Slurm, shards that are lost too often, or an interruption.
pub fn bake(app: &App, plan: &Plan, options: &Options) -> Result<SlurmReport> {
    client::find()?;
    let begun = Instant::now();
    let key = begin_shards(plan, options.shards, &app.progress)?;
    // not before: until there can be jobs to cancel, which preparation may put off for minutes, an interruption ends the program
    let interrupted = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&interrupted);
    ctrlc::set_handler(move || flag.store(true, Ordering::Relaxed)).context("interruptions cannot be listened to")?;
    let mut launch = Launch::new(app, plan, options, key, interrupted)?;
    let done = launch.run();
    if launch.interrupted.load(Ordering::Relaxed) {
        return Err(launch.cancelled());
    }
    let bake = done?;
    launch.tidy();
    let Launch { key, jobs, again, .. } = launch;
    Ok(SlurmReport { plan: key, shards: options.shards, jobs, again, seconds: begun.elapsed().as_secs_f64(), bake })
}

/// One bake on its way.
struct Launch<'a> {
    app: &'a App,
    plan: &'a Plan,
    options: &'a Options<'a>,
    key: String,
    /// Scripts and logs.
    kept: Cache,
    /// The names of the array and of the merge.
    names: [String; 2],
    interrupted: Arc<AtomicBool>,
    jobs: Vec<u64>,
    again: Vec<u32>,
}

impl<'a> Launch<'a> {
    fn new(app: &'a App, plan: &'a Plan, options: &'a Options<'a>, key: String, interrupted: Arc<AtomicBool>) -> Result<Self> {
        let absolute = |path: &Path| std::path::absolute(path).with_context(|| format!("no such place: {}", path.display()));
        let places = Places {
            program: std::env::current_exe().context("the program does not know where it is")?,
            site: absolute(plan.site.path())?,
            bundle: absolute(&plan.options.bundle)?,
            cache: absolute(&plan.cache_root())?,
            again: plan.options.again,
        };
        let mark = plan.mark(&key);
        // held as long as we live: a merge that ends without us removes the folder
        let kept = Cache::join(&places.cache, &format!("slurm-{mark}"), &plan.owner())?;
        let folder = kept.folder();
        let write = |name: &str, text: String| {
            let path = folder.join(name);
            fs::write(&path, text).with_context(|| format!("cannot write {}", path.display()))
        };
        write(SHARD_SCRIPT, script::of_shard(&places, options.shards, &key))?;
        write(MERGE_SCRIPT, script::of_merge(&places, &folder.join(MERGE_REPORT), plan.options.no_cache))?;
        let names = [format!("heliodon-{mark}"), format!("heliodon-merge-{mark}")];
        Ok(Self { app, plan, options, key, kept, names, interrupted, jobs: Vec::new(), again: Vec::new() })
    }

    /// Submits what is missing and follows it, until the bundle is there.
    fn run(&mut self) -> Result<Value> {
        if self.queued()?.is_empty() {
            // of an earlier run, whose bundle is not what is asked for now
            let _ = fs::remove_file(self.kept.folder().join(MERGE_REPORT));
        } else {
            self.app.progress.note("jobs of an earlier run of this bake are still there: following them");
            self.follow()?;
        }
        for attempt in 1..=self.options.tries {
            if let Some(report) = self.merged() {
                return Ok(report);
            }
            self.check_interrupted()?;
            let (_, open) = self.standing();
            self.submit(&open, attempt)?;
            self.follow()?;
        }
        match self.merged() {
            Some(report) => Ok(report),
            None => Err(self.lost()),
        }
    }

    fn submit(&mut self, open: &[u32], attempt: u32) -> Result<()> {
        let log = |name: &str| self.kept.folder().join(name);
        let [shards, merge] = &self.names;
        let mut after = None;
        if !open.is_empty() {
            let job = Job {
                name: shards,
                script: &log(SHARD_SCRIPT),
                log: &log("shard-%a.log"),
                array: Some(script::array(open)),
                after: None,
                options: self.options.sbatch,
            };
            let id = client::submit(&job)?;
            self.jobs.push(id);
            after = Some(id);
            let shards = counted(open.len() as u64, "shard", "shards");
            let told = if attempt > 1 { format!(", try {attempt} of {}", self.options.tries) } else { String::new() };
            self.app.progress.note(&format!("Slurm job {id}: {shards} of {}{told}", self.options.shards));
            if attempt > 1 {
                self.again.extend(open);
            }
        }
        let job = Job {
            name: merge,
            script: &log(MERGE_SCRIPT),
            log: &log("merge.log"),
            array: None,
            after,
            options: self.options.sbatch,
        };
        let id = client::submit(&job).with_context(|| match after {
            Some(array) => {
                format!("the shards are Slurm job {array} and go on; the merge could not be submitted: run the same again")
            }
            None => "the merge could not be submitted".to_owned(),
        })?;
        self.jobs.push(id);
        self.app.progress.note(&format!("Slurm job {id}: the merge"));
        Ok(())
    }

    /// Removes scripts and logs of what went well, and the folders above where they are empty now.
    fn tidy(&self) {
        let _ = fs::remove_dir_all(self.kept.folder());
        let root = self.plan.cache_root();
        // remove_dir only removes empty folders
        let _ = fs::remove_dir(&root);
        if let Some(above) = root.parent().filter(|above| above.ends_with(CACHE_FOLDER)) {
            let _ = fs::remove_dir(above);
        }
    }

    /// Waits until nothing of this bake is queued or runs any more, and tells how far it is.
    fn follow(&self) -> Result<()> {
        let mut pause = LOOK_FIRST;
        let mut heard = Instant::now();
        let mut told_blocks = false;
        let mut told_reasons = BTreeSet::new();
        self.app.progress.stage("waiting for Slurm", 0);
        loop {
            match self.queued() {
                Ok(tasks) if tasks.is_empty() => break,
                Ok(tasks) => {
                    heard = Instant::now();
                    for task in tasks {
                        self.look_at(&task, &mut told_reasons);
                    }
                }
                // it answers again after a while, or never
                Err(error) if heard.elapsed() > PATIENCE => return Err(error),
                Err(_) => {}
            }
            let (Standing { done, blocks }, _) = self.standing();
            if blocks > 0 && !told_blocks {
                told_blocks = true;
                self.app.progress.finished();
                self.app.progress.stage("blocks of all shards", blocks as u64);
            }
            if blocks > 0 {
                self.app.progress.progress(done as u64);
            }
            self.wait(pause)?;
            pause = (pause * 2).min(LOOK_LATER);
        }
        self.app.progress.finished();
        // the array and its merge
        let latest = self.jobs.iter().rev().take(2);
        for (shard, state) in latest.flat_map(|&job| client::ended(job)).filter(|(_, state)| state != "COMPLETED") {
            self.app.progress.note(&format!("shard {shard}/{} ended as {state}", self.options.shards));
        }
        Ok(())
    }

    /// Tells why a task waits, once for its job; one that waits for good is cancelled, so that it is submitted again as others that are lost.
    fn look_at(&self, task: &Task, told: &mut BTreeSet<(u64, String)>) {
        let (job, Some(reason)) = (task.job, &task.held_by) else { return };
        let is_lost = task.is_lost();
        if told.insert((job, reason.clone())) {
            let then = if is_lost { "it is taken back and submitted again" } else { "scontrol show job tells more" };
            self.app.progress.note(&format!("Slurm job {job} waits: {reason} ({then})"));
        }
        if is_lost {
            // where that fails it is still there at the next look
            let _ = client::cancel_task(&task.id);
        }
    }

    fn queued(&self) -> Result<Vec<Task>> {
        client::queued(&self.names)
    }

    fn standing(&self) -> (Standing, Vec<u32>) {
        standing(self.plan, &self.key, self.options.shards)
    }

    /// What the merge has reported, once its bundle is there.
    fn merged(&self) -> Option<Value> {
        let report = serde_json::from_slice(&fs::read(self.kept.folder().join(MERGE_REPORT)).ok()?).ok()?;
        self.plan.is_up_to_date().then_some(report)
    }

    fn wait(&self, pause: Duration) -> Result<()> {
        let begun = Instant::now();
        while begun.elapsed() < pause {
            self.check_interrupted()?;
            std::thread::sleep(Duration::from_millis(50));
        }
        Ok(())
    }

    fn check_interrupted(&self) -> Result<()> {
        if self.interrupted.load(Ordering::Relaxed) {
            bail!("interrupted");
        }
        Ok(())
    }

    /// Why it came to nothing, with the last words of what failed.
    fn lost(&self) -> anyhow::Error {
        let (_, open) = self.standing();
        let (what, log) = match open.first() {
            Some(first) => (
                format!("shards {} of {} ended without their blocks", script::array(&open), self.options.shards),
                format!("shard-{first}.log"),
            ),
            None => ("the merge failed".to_owned(), "merge.log".to_owned()),
        };
        let log = self.kept.folder().join(log);
        let text = fs::read_to_string(&log).unwrap_or_default();
        let last = text.lines().rev().find(|line| !line.trim().is_empty()).unwrap_or("nothing");
        anyhow::anyhow!(
            "{what} {}; the last words in {}: {last}; mend it and run the same again: what is done is not done again",
            counted(u64::from(self.options.tries), "time", "times"),
            log.display()
        )
    }

    /// Takes all jobs back.
    fn cancelled(&self) -> anyhow::Error {
        let cancelled = client::cancel(&self.names);
        let begun = Instant::now();
        while begun.elapsed() < CANCELLING && self.queued().is_ok_and(|tasks| !tasks.is_empty()) {
            std::thread::sleep(LOOK_FIRST);
        }
        let left = self.queued().map_or(0, |tasks| tasks.len());
        match (cancelled, left) {
            (Ok(()), 0) => {
                anyhow::anyhow!("interrupted: its jobs are cancelled; run the same again, and it goes on where it stopped")
            }
            (Ok(()), left) => anyhow::anyhow!("interrupted: its jobs are cancelled, {left} of them are still ending"),
            (Err(error), _) => error.context(format!(
                "interrupted, and its jobs cannot be cancelled; do it with scancel --name={}",
                self.names.join(" and --name=")
            )),
        }
    }
}

const SHARD_SCRIPT: &str = "shard.sh";
const MERGE_SCRIPT: &str = "merge.sh";
const MERGE_REPORT: &str = "merge.json";
