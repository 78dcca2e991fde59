//! `bake --on slurm` against commands of a Slurm that this file makes up: scripts on the PATH that run the jobs at once. The real one is
//! tested by scripts/slurm/test.sh.

use crate::sites::{TestSite, waves};
use crate::{Ran, assert_same_bundle, done, heliodon, ran};
use std::os::unix::fs::PermissionsExt;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Runs each task of an array after the other in the background; one for which there is a file `lose-I` ends without having run, one for
/// which there is `slow` takes a minute. With `no-merge` it refuses what waits for others; `state` is what its queue says of all.
const SBATCH: &str = r#"#!/bin/sh
for word in "$@"; do
    case "$word" in
        --version) echo "slurm 0"; exit 0 ;;
        --array=*) array=${word#*=} ;;
        --job-name=*) name=${word#*=} ;;
        --output=*) log=${word#*=} ;;
        --dependency=afterok:*) after=${word##*:}; [ -e "$FAKE/no-merge" ] && exit 1 ;;
        --*) ;;
        *) script=$word ;;
    esac
done
echo "$@" >>"$FAKE/submitted"
id=$(($(cat "$FAKE/last" 2>/dev/null || echo 0) + 1))
echo $id >"$FAKE/last"
echo "$name" >"$FAKE/job-$id"
export id array log after script
setsid sh -c '
    while [ -n "$after" ] && [ -e "$FAKE/job-$after" ]; do sleep 0.05; done
    if [ -z "$after" ] || [ ! -e "$FAKE/failed-$after" ]; then
        for part in $(echo "${array:-0}" | tr , " "); do
            for task in $(seq "${part%-*}" "${part#*-}"); do
                [ -e "$FAKE/slow" ] && sleep 60
                if [ -e "$FAKE/lose-$task" ]; then
                    rm "$FAKE/lose-$task"
                    touch "$FAKE/failed-$id"
                    continue
                fi
                one=$(echo "$log" | sed "s/%a/$task/")
                SLURM_ARRAY_TASK_ID=$task SLURM_CPUS_ON_NODE=2 sh "$script" >>"$one" 2>&1 || touch "$FAKE/failed-$id"
            done
        done
    fi
    rm -f "$FAKE/job-$id"
' </dev/null >/dev/null 2>&1 &
echo $! >"$FAKE/pid-$id"
echo "$id;fake"
"#;

const SQUEUE: &str = r#"#!/bin/sh
for word in "$@"; do
    case "$word" in --name=*) names=,${word#*=}, ;; esac
done
for job in "$FAKE"/job-*; do
    [ -e "$job" ] || continue
    case "$names" in *,"$(cat "$job")",*) echo "${job##*-} $(cat "$FAKE/state" 2>/dev/null || echo RUNNING None)" ;; esac
done
"#;

const SCANCEL: &str = r#"#!/bin/sh
for job in "$FAKE"/job-*; do
    [ -e "$job" ] || continue
    id=${job##*-}
    if [ "--name=$(cat "$job")" = "$1" ] || [ "$id" = "$1" ]; then
        kill -- "-$(cat "$FAKE/pid-$id")"
        touch "$FAKE/failed-$id"
        rm -f "$job"
    fi
done
exit 0
"#;

/// A Slurm of scripts, and a site to bake on it.
struct Fake {
    site: TestSite,
}

impl Fake {
    fn new() -> Self {
        let site = TestSite::smallest(&waves(40));
        site.edit("samples = 64", "samples = 512");
        std::fs::create_dir_all(site.path("bin")).unwrap();
        std::fs::create_dir_all(site.path("fake")).unwrap();
        for (name, script) in [("sbatch", SBATCH), ("squeue", SQUEUE), ("scancel", SCANCEL), ("sacct", "#!/bin/sh\nexit 1\n")] {
            let path = site.path("bin").join(name);
            std::fs::write(&path, script).unwrap();
            std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).unwrap();
        }
        Self { site }
    }

    fn bake(&self, more: &[&str]) -> Command {
        let mut command = heliodon(&[&"bake", &self.site.folder(), &"--on", &"slurm", &"--shards", &"3"]);
        let path = std::env::var("PATH").unwrap();
        command.args(more).env("PATH", format!("{}:{path}", self.site.path("bin").display()));
        command.env("FAKE", self.site.path("fake"));
        command
    }

    fn baked(&self, more: &[&str]) -> Ran {
        ran(self.bake(more).output().unwrap())
    }

    /// What was submitted, a line each.
    fn submitted(&self) -> Vec<String> {
        let text = std::fs::read_to_string(self.fake("submitted")).unwrap();
        text.lines().map(str::to_owned).collect()
    }

    fn fake(&self, name: &str) -> PathBuf {
        self.site.path("fake").join(name)
    }
}

#[test]
fn a_bake_on_slurm_is_that_of_one_machine_and_lost_shards_are_submitted_again() {
    let fake = Fake::new();
    let whole = fake.site.path("whole");
    done(&[&"bake", &fake.site.folder(), &"-o", &whole, &"--no-cache"]);
    std::fs::write(fake.fake("lose-2"), "").unwrap();
    let baked = fake.baked(&["--no-cache", "--json", "--slurm-option=--partition=long", "--slurm-option", "--mem=1G"]);
    assert_eq!(baked.code, 0, "{}", baked.err);
    assert_same_bundle(&fake.site.path("bundle"), &whole);
    let report: serde_json::Value = serde_json::from_str(&baked.out).unwrap();
    assert_eq!((report["jobs"].to_string().as_str(), report["again"].to_string().as_str()), ("[1,2,3,4]", "[2]"), "{report}");
    assert_eq!(report["bake"]["up_to_date"], false);
    let submitted = fake.submitted();
    assert!(submitted[0].contains("--array=1-3") && submitted[1].contains("--dependency=afterok:1"), "{submitted:?}");
    assert!(submitted[2].contains("--array=2 ") && submitted[3].contains("--dependency=afterok:3"), "{submitted:?}");
    assert!(submitted.iter().all(|line| line.contains("--partition=long --mem=1G")), "{submitted:?}");
    assert!(!fake.site.path(".heliodon").exists(), "neither blocks nor scripts nor logs stay");
    let again = fake.baked(&[]);
    assert!(again.code == 0 && again.out.contains("up to date"), "{}", again.err);
    assert_eq!(fake.submitted().len(), 4);
    // the same site into another bundle: neither follows the other's jobs, nor cancels them
    let other = fake.site.path("other");
    assert_eq!(fake.baked(&["-o", other.to_str().unwrap()]).code, 0);
    let names = |line: &str| line.split(' ').find_map(|word| word.strip_prefix("--job-name=")).map(str::to_owned).unwrap();
    let submitted = fake.submitted();
    assert!(names(&submitted[0]) == names(&submitted[2]) && names(&submitted[0]) != names(&submitted[4]), "{submitted:?}");
}

#[test]
fn what_waits_for_good_and_what_cannot_be_submitted_are_told() {
    let fake = Fake::new();
    std::fs::write(fake.fake("no-merge"), "").unwrap();
    let without = fake.baked(&[]);
    assert!(without.code == 1 && without.err.contains("are Slurm job 1 and go on; the merge could not be"), "{}", without.err);
    std::fs::remove_file(fake.fake("no-merge")).unwrap();
    std::fs::write(fake.fake("state"), "PENDING JobHeldUser").unwrap();
    let baked = fake.baked(&[]);
    assert_eq!(baked.code, 0, "{}", baked.err);
    assert_eq!(baked.err.matches("waits: JobHeldUser").count(), baked.err.matches("waits: ").count());
    assert!(baked.err.contains(" waits: JobHeldUser (scontrol show job "), "{}", baked.err);
}

#[test]
fn what_no_node_could_start_is_taken_back_and_submitted_again() {
    let fake = Fake::new();
    std::fs::write(fake.fake("slow"), "").unwrap();
    std::fs::write(fake.fake("state"), "PENDING launch failed requeued held").unwrap();
    // the next node can
    let scancel = fake.site.path("bin/scancel");
    std::fs::write(&scancel, format!("#!/bin/sh\nrm -f \"$FAKE/slow\" \"$FAKE/state\"\n{SCANCEL}")).unwrap();
    let baked = fake.baked(&["--json"]);
    assert_eq!(baked.code, 0, "{}", baked.err);
    assert!(baked.err.contains("Slurm job 1 waits: launch failed requeued held (it is taken back"), "{}", baked.err);
    let report: serde_json::Value = serde_json::from_str(&baked.out).unwrap();
    assert_eq!(report["again"].to_string(), "[1,2,3]", "{report}");
}

#[test]
fn a_site_file_of_another_name_is_baked_by_its_shards() {
    let fake = Fake::new();
    let text = std::fs::read_to_string(fake.site.path("site.toml")).unwrap();
    let evening = fake.site.path("evening.toml");
    std::fs::write(&evening, text.replace("samples = 512", "samples = 256")).unwrap();
    let whole = fake.site.path("whole");
    done(&[&"bake", &evening, &"-o", &whole, &"--no-cache"]);
    let mut command = heliodon(&[&"bake", &evening, &"--on", &"slurm", &"--shards", &"2"]);
    let path = std::env::var("PATH").unwrap();
    command.env("PATH", format!("{}:{path}", fake.site.path("bin").display())).env("FAKE", fake.site.path("fake"));
    let baked = ran(command.output().unwrap());
    assert_eq!(baked.code, 0, "{}", baked.err);
    assert_same_bundle(&fake.site.path("bundle"), &whole);
}

#[test]
fn without_what_finished_bakes_have_kept_all_shards_are_baked_anew() {
    let fake = Fake::new();
    let whole = fake.site.path("whole");
    assert_eq!(fake.baked(&[]).code, 0);
    std::fs::rename(fake.site.path("bundle"), &whole).unwrap();
    assert_eq!(fake.baked(&[]).code, 0);
    assert_eq!(fake.submitted().len(), 3, "the first time an array and its merge, then the merge alone");
    assert_eq!(fake.baked(&["--again", "--no-cache"]).code, 0);
    let anew = &fake.submitted()[3..];
    assert!(anew.len() == 2 && anew[0].contains("--array=1-3"), "{anew:?}");
    assert_same_bundle(&fake.site.path("bundle"), &whole);
    assert!(!fake.site.path(".heliodon").exists());
}

#[test]
fn shards_that_are_done_are_not_submitted() {
    let fake = Fake::new();
    for shard in ["1/3", "3/3"] {
        done(&[&"bake", &fake.site.folder(), &"--shard", &shard]);
    }
    let baked = fake.baked(&[]);
    assert_eq!(baked.code, 0, "{}", baked.err);
    let submitted = fake.submitted();
    assert!(submitted.len() == 2 && submitted[0].contains("--array=2 "), "{submitted:?}");
}

#[test]
fn what_is_lost_too_often_ends_with_its_last_words() {
    let fake = Fake::new();
    // the same for every try: the site is not what the plan was made of any more
    let script = std::fs::read_to_string(fake.site.path("bin/sbatch")).unwrap();
    let edited = format!("sh -c 'sed -i s/512/500/ \"{}\"';", fake.site.path("site.toml").display());
    std::fs::write(fake.site.path("bin/sbatch"), script.replace("setsid sh", &format!("{edited} setsid sh"))).unwrap();
    let lost = fake.baked(&["--tries", "2"]);
    assert_eq!(lost.code, 1, "{}", lost.err);
    assert!(lost.err.contains("shards 1-3 of 3 ended without their blocks 2 times"), "{}", lost.err);
    assert!(lost.err.contains("shard-1.log") && lost.err.contains("bake.samples (512 there, 500 here)"), "{}", lost.err);
}

#[test]
fn an_interruption_cancels_the_jobs() {
    let fake = Fake::new();
    std::fs::write(fake.fake("slow"), "").unwrap();
    let child = fake.bake(&[]).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let begun = Instant::now();
    while !fake.fake("job-2").exists() {
        assert!(begun.elapsed() < Duration::from_secs(60));
        std::thread::sleep(Duration::from_millis(10));
    }
    let signal = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(signal.success());
    let ended = ran(child.wait_with_output().unwrap());
    assert_eq!(ended.code, 1, "{}", ended.err);
    assert!(ended.err.contains("its jobs are cancelled"), "{}", ended.err);
    assert!(begun.elapsed() < Duration::from_secs(50), "nobody waited for the jobs");
    let left = std::fs::read_dir(fake.site.path("fake")).unwrap();
    assert!(left.flatten().all(|entry| !entry.file_name().to_string_lossy().starts_with("job-")), "no job is left");
    std::fs::remove_file(fake.fake("slow")).unwrap();
    assert_eq!(fake.baked(&[]).code, 0);
}

#[test]
fn a_merge_that_nobody_waits_for_leaves_nothing() {
    let fake = Fake::new();
    let mut child = fake.bake(&["--no-cache"]).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let begun = Instant::now();
    let wait = |until: &dyn Fn() -> bool| {
        while !until() {
            assert!(begun.elapsed() < Duration::from_secs(300));
            std::thread::sleep(Duration::from_millis(10));
        }
    };
    wait(&|| fake.fake("job-2").exists());
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(!fake.site.path("bundle").exists());
    wait(&|| !fake.fake("job-2").exists());
    assert!(fake.site.path("bundle/manifest.json").exists() && !fake.site.path(".heliodon").exists());
}

#[test]
fn without_slurm_one_message_says_what_to_do() {
    let fake = Fake::new();
    let output = fake.bake(&[]).env("PATH", fake.site.path("fake")).output().unwrap();
    let ran = ran(output);
    assert_eq!(ran.code, 1);
    assert!(ran.err.contains("no sbatch on the PATH") && ran.err.contains("--shard"), "{}", ran.err);
}
