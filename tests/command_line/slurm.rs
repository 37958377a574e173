//! Batch scripts, run with stand-ins for Slurm's programs. `./x slurm-test` uses the real ones.

use super::job::{Job, Ran};
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::process::Command;

const LINE: &str = "slurm cube.obj --nodes 2 --time 30m";

/// Puts a program called `name` before all others of that name.
fn stand_in(job: &Job, name: &str, text: &str) {
    fs::create_dir_all(job.path("bin")).expect("made");
    let path = job.path(format!("bin/{name}"));
    fs::write(&path, format!("#!/bin/bash\n{text}\n")).expect("written");
    fs::set_permissions(path, fs::Permissions::from_mode(0o755)).expect("runs");
}

/// Runs the script `text` as Slurm would.
fn batch(job: &Job, text: &str) -> Ran {
    let path = format!("{}:{}", job.path("bin").display(), env!("PATH"));
    let mut command = Command::new("bash");
    command.args(["-c", text]).current_dir("/").env("PATH", path);
    command.env("SLURM_JOB_ID", "7").env("SLURM_JOB_NODELIST", "n[1-2]");
    Ran::of(&command.output().expect("a shell"))
}

/// Slurm's own program requeues nothing, and [`requeues`] tells what it was asked.
fn note_requeues(job: &Job) {
    let note = format!("echo \"$@\" >> {}", job.path("requeues").display());
    stand_in(job, "scontrol", &note);
}

fn requeues(job: &Job) -> String {
    fs::read_to_string(job.path("requeues")).unwrap_or_default()
}

#[test]
fn a_script_goes_on_until_the_sequence_is_complete() {
    let job = Job::new();
    let render = "--size 192x108 --spp 16 --segment 4 --frames 1..8 --no-video";
    let script = job.done(&format!("{LINE} -- {render} -o o/f_##.png")).out;
    // A limit that comes as soon as a run got any further.
    let limited = "\
        while [[ $1 == --* ]]; do shift; done\n\
        there() { ls o/*.png 2>/dev/null | wc -l; }\n\
        before=$(there)\n\
        \"$@\" & pid=$!\n\
        until [[ $(there) != \"$before\" ]] || ! kill -0 $pid; do sleep 0.01; done\n\
        kill -USR1 $pid; wait $pid";
    stand_in(&job, "srun", limited);
    note_requeues(&job);
    let mut codes = Vec::new();
    while codes.last() != Some(&Some(0)) {
        let ran = batch(&job, &script);
        codes.push(ran.code);
        assert!(codes.len() < 100 && [Some(0), Some(75)].contains(&ran.code), "{}", ran.err);
        assert!(ran.out.contains("job 7 on n[1-2], run 1"), "{}", ran.out);
    }
    assert_eq!(requeues(&job), "requeue 7\n".repeat(codes.len() - 1), "{codes:?}");
    assert!(codes.len() > 1, "one run was enough");
    job.done(&format!("render cube.obj {render} -o whole/f_##.png"));
    for frame in 1..=8 {
        let name = format!("f_0{frame}.png");
        assert!(job.read(&format!("o/{name}")) == job.read(&format!("whole/{name}")), "{name}");
    }
}

/// A limit may come between the last frame and the video.
#[test]
fn a_run_that_is_stopped_after_the_last_frame_is_followed_by_one_more() {
    let job = Job::new();
    let script = job.done(&format!("{LINE} -- --size 8x8 --frames 1..2 -o o/f_##.png")).out;
    note_requeues(&job);
    stand_in(&job, "srun", "while [[ $1 == --* ]]; do shift; done\n\"$@\" --no-video; exit 75");
    let ran = batch(&job, &script);
    assert_eq!((ran.code, &*requeues(&job)), (Some(75), "requeue 7\n"), "{}", ran.err);
    // One that is stopped there again gets no further, and so does the one after it.
    let ran = batch(&job, &script);
    assert_eq!(ran.code, Some(75), "{}", ran.err);
    let ran = batch(&job, &script);
    assert_eq!((ran.code, requeues(&job)), (Some(75), "requeue 7\n".repeat(2)), "{}", ran.err);
    assert!(ran.err.contains("got no further"), "{}", ran.err);
    stand_in(&job, "srun", "while [[ $1 == --* ]]; do shift; done\n\"$@\" --no-video");
    assert_eq!(batch(&job, &script).code, Some(0));
}

/// Killed between the last frame and the video: the video is made, but not tried for ever.
#[test]
fn a_run_that_is_killed_after_the_last_frame_is_followed_by_one_more() {
    let job = Job::new();
    let script = job.done(&format!("{LINE} -- --size 8x8 --frames 1..2 -o o/f_##.png")).out;
    note_requeues(&job);
    stand_in(&job, "sleep", &format!("echo \"$@\" >> {}", job.path("naps").display()));
    let killed = "while [[ $1 == --* ]]; do shift; done\n\"$@\" --no-video; exit 137";
    stand_in(&job, "srun", killed);
    let ran = batch(&job, &script);
    assert_eq!((ran.code, &*requeues(&job)), (Some(75), "requeue 7\n"), "{}", ran.err);
    let ran = batch(&job, &script);
    assert_eq!((ran.code, &*requeues(&job)), (Some(137), "requeue 7\n"), "{}", ran.err);
    assert!(ran.err.contains("got no further"), "{}", ran.err);
    assert_eq!(job.read("naps"), b"5\n30\n0\n");
    // One that failed by itself is not asked again.
    for code in [1, 2] {
        std::fs::remove_dir_all(job.path("o")).expect("removed");
        stand_in(&job, "srun", &killed.replace("137", &code.to_string()));
        let ran = batch(&job, &script);
        assert_eq!((ran.code, &*requeues(&job)), (Some(code), "requeue 7\n"), "{}", ran.err);
    }
}

#[test]
fn a_run_that_gets_no_further_is_the_last() {
    let job = Job::new();
    let script = job.done(&format!("{LINE} -- --size 8x8 --frames 1..2 -o o/f_##.png")).out;
    note_requeues(&job);
    for code in [0, 2] {
        stand_in(&job, "srun", &format!("exit {code}"));
        let ran = batch(&job, &script);
        assert_eq!(ran.code, Some(if code == 0 { 1 } else { code }), "{}", ran.err);
        assert!(ran.err.contains("got no further"), "{}", ran.err);
        assert_eq!(requeues(&job), "");
    }
    // A start that failed is tried again, with whatever code it did.
    let tried = job.path("tried").display().to_string();
    let second = format!(
        "[ -e {tried} ] || {{ touch {tried}; exit 14; }}\nwhile [[ $1 == --* ]]; do shift; done\n\"$@\""
    );
    stand_in(&job, "srun", &second);
    assert_eq!(batch(&job, &script).code, Some(0));
    std::fs::remove_dir_all(job.path("o")).expect("removed");
    // Where there was no time left there is one more run, and not another.
    std::fs::remove_file(&tried).expect("removed");
    stand_in(&job, "sleep", "");
    let late = format!("rm {tried} 2>/dev/null && exit 75; touch {tried}; exit 14");
    for (srun, requeued) in [("exit 75", 1), (&late, 2)] {
        stand_in(&job, "srun", srun);
        for last in [false, true] {
            let ran = batch(&job, &script);
            let is_last = ran.err.contains("got no further");
            assert_eq!((ran.code, is_last), (Some(75), last), "{}", ran.err);
            assert_eq!(requeues(&job), "requeue 7\n".repeat(requeued));
        }
    }
    assert!(!job.names(".").iter().any(|name| name.contains("idle")));
    // Slurm may forbid it.
    job.done("render cube.obj --size 8x8 --frames 1 --no-video -o alone/f_##.png");
    stand_in(&job, "srun", "while [[ $1 == --* ]]; do shift; done\n\"$@\"; rm o/f_02.png; exit 9");
    stand_in(&job, "scontrol", "exit 1");
    assert_eq!(batch(&job, &script).code, Some(9));
}

#[test]
fn a_script_holds_what_was_asked_for_and_invalid_options_are_refused_before_the_queue() {
    let job = Job::new();
    let out = job.done(&format!("{LINE} --sbatch partition=long --cpus 8 --tasks-per-node 2")).out;
    for line in [
        "#SBATCH --nodes=2",
        "#SBATCH --ntasks-per-node=2",
        "#SBATCH --cpus-per-task=8",
        "#SBATCH --time=30",
        "#SBATCH --signal=USR1@60",
        "#SBATCH --requeue",
        "#SBATCH --open-mode=append",
        "#SBATCH --output=cube-%j.log",
        "#SBATCH --export=NONE",
        "#SBATCH --partition=long",
        "render=(render cube.obj)",
        "status=(status 'out/cube/frame_####.png')",
        "references=out/cube/.frame.references",
    ] {
        assert!(out.lines().any(|l| l == line), "{line}\n{out}");
    }
    for (line, says) in [
        ("--nodes 2", "--time"),
        ("--nodes 0 --time 30m", "1..=100000"),
        ("--nodes 2 --time 30s", "at least 1m"),
        ("--nodes 2 --time 2m --notice 2m", "--notice … --time"),
        ("--nodes 2 --time 30m --notice 1d", "--notice … --time"),
        ("--nodes 2 --time 20d --notice 1d", "--notice … 65535s"),
        ("--nodes 2 --time 9999999d", "--time … year"),
        ("--nodes 2 --time 30m --sbatch=", "NAME=VALUE"),
        ("--nodes 2 --time 30m --sbatch=--", "NAME=VALUE"),
        ("--nodes 2 --time 30m -- --rank-map none", "none … ranks"),
        ("--nodes 2 --time 30m -- --rank-map cube.obj", "cube.obj … line 1"),
        ("--nodes 2 --time 30m -- --references none", "--references none … folder"),
        ("--nodes 2 --time 30m -- --references .", "--references . … exr"),
        ("--nodes 2 --time 30m -- --policy colour --references .", "--policy surface"),
        ("--nodes 2 --time 30m -- --policy colour --upload 1=none.png", "none.png"),
        ("--nodes 2 --time 30m -- --policy off --spp 4 --maps", "--maps"),
        ("--nodes 2 --time 30m -- --sp 4", "'--sp'"),
        ("--nodes 2 --time 30m -- --frames 900", "900 … 1..48"),
        ("--nodes 2 --time 30m -- --overwrite", "--overwrite … -o"),
        ("--nodes 2 --time 30m -- -o a.gif", ".png, .exr or .ppm"),
    ] {
        job.refused(&format!("slurm cube.obj {line}"), says);
    }
    job.refused("slurm nothing.toml --nodes 2 --time 30m", "nothing.toml");
    assert_eq!(job.names("."), ["cube.obj"], "nothing is written");
}
