//! Jobs of several ranks that are killed or stopped, and go on with another number of them.

use super::bytes_on_ranks::small;
use super::job::{Job, lines_that_say, says};
use super::launch::{launched, under_mpirun};
use std::fs;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

const LINE: &str = "render cube.obj --size 192x108 --spp 4 --segment 8 --frames 1..20 --no-video \
    --threads 1 --checkpoint 0s";

/// Signals to all ranks, or one.
pub fn send(job: &Job, signal: &str, pids: &str) {
    let kill = format!("kill -{signal} $(cat {pids}) 2>/dev/null; true");
    let shell = Command::new("sh").args(["-c", &kill]).current_dir(job.path(".")).status();
    assert!(shell.expect("a shell").success());
}

/// Starts a job; `None` where there is no mpirun.
pub fn start(job: &Job, ranks: u32, line: &str) -> Option<Child> {
    // Those of more ranks before it, too: their numbers may be other processes' by now.
    for name in job.names(".").into_iter().filter(|name| name.starts_with("pid.")) {
        fs::remove_file(job.path(name)).expect("removed");
    }
    let mut command = launched(job, ranks, line);
    let errors = fs::File::create(job.path("errors")).expect("a file");
    command.stdout(Stdio::null()).stderr(errors).spawn().ok()
}

/// The frames that are there.
fn frames(job: &Job, folder: &str, ending: &str) -> usize {
    let is_frame = |name: &String| {
        // Maps have a second underscore, unfinished files a dot before their name.
        name.starts_with("f_") && name.ends_with(ending) && name.matches('_').count() == 1
    };
    let names = if job.path(folder).exists() { job.names(folder) } else { Vec::new() };
    names.into_iter().filter(is_frame).count()
}

/// Ends the whole job as a lost machine would, once there are more frames than before; whether it had not
/// ended by itself.
fn kill_at(job: &Job, child: &mut Child, (folder, ending): (&str, &str)) -> bool {
    let before = frames(job, folder, ending);
    while frames(job, folder, ending) <= before {
        if child.try_wait().expect("a child").is_some() {
            return false;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    send(job, "KILL", "pid.*");
    child.kill().expect("killed");
    child.wait().expect("dead");
    true
}

/// Kills and requeues a job, each time with as many ranks and threads as `groups` says, and lets it end with the
/// last; `None` where there is no mpirun. `line` gives the command for so many threads and a folder. After
/// each kill what is there has the bytes of an undisturbed job.
fn regroup(
    job: &Job,
    groups: &[(u32, u32)],
    (ending, all): (&str, usize),
    line: &dyn Fn(u32, &str) -> String,
) -> Option<()> {
    job.done(&line(2, "whole"));
    let (last, groups) = groups.split_last().expect("groups");
    let mut landed = 0;
    for (ranks, threads) in groups {
        let mut child = start(job, *ranks, &line(*threads, "k"))?;
        let is_killed = kill_at(job, &mut child, ("k", ending));
        let words = fs::read_to_string(job.path("errors")).expect("text");
        assert!(!words.contains("damaged"), "{words}");
        assert_same(job, "k", ending, false);
        landed += usize::from(is_killed && (1..all).contains(&frames(job, "k", ending)));
    }
    assert!(landed >= 4, "{landed} kills in the middle of the job");
    let ran = under_mpirun(job, last.0, &line(last.1, "k"))?;
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    assert_same(job, "k", ending, true);
    let left = job.path("k/.f.references");
    assert!(!left.exists(), "references are left: {:?}", job.names("k/.f.references"));
    job.done(&format!("status k --frames 1..{all}"));
    Some(())
}

fn assert_same(job: &Job, folder: &str, ending: &str, all: bool) {
    for name in job.names("whole").into_iter().filter(|name| name.ends_with(ending)) {
        if all || job.path(format!("{folder}/{name}")).exists() {
            let same = job.read(&format!("{folder}/{name}")) == job.read(&format!("whole/{name}"));
            assert!(same, "{name}");
        }
    }
}

#[test]
fn a_killed_job_goes_on_with_any_number_of_ranks() {
    for (ending, more) in [
        ("png", ""),
        ("exr", "--aovs all"),
        ("exr", "--crop 16,8,170,100 --aovs all"),
        ("png", "--maps"),
        ("png", "--policy colour"),
    ] {
        let job = Job::new();
        let line = |_, out: &str| format!("{LINE} {more} -o {out}/f_##.{ending}");
        let groups = [(3, 1), (2, 1), (4, 1), (1, 1), (3, 1), (2, 1)];
        let Some(()) = regroup(&job, &groups, (ending, 20), &line) else { return };
    }
}

/// The scenes of the repository, mirrors and glass among them, audit included: killed, requeued with other
/// ranks and other threads, again and again.
#[test]
fn scenes_that_are_killed_and_regrouped_are_the_same() {
    for (name, segment) in [("reflective_spheres", 8), ("spheres_on_terrain", 8), ("demo", 16)] {
        let job = Job::new();
        let scene = small(&job, name);
        let line = |threads: u32, out: &str| {
            format!(
                "render {scene} --size 192x108 --spp 2 --shadow-samples 16 --frames 1..16 --no-video \
                 --segment {segment} --probes 0.02 --checkpoint 0s --threads {threads} -o {out}/f_##.png"
            )
        };
        let groups = [(2, 1), (4, 1), (1, 2), (3, 2), (8, 1), (2, 2), (16, 1)];
        let Some(()) = regroup(&job, &groups, ("png", 16), &line) else { return };
    }
}

/// Key frames of half a minute and more: nobody gets through with one.
const LONG: &str =
    "render cube.obj --size 512x288 --spp 4096 --frames 1..40 --segment 8 --no-video";

/// A signal to any one rank, and a time limit, stop all of them in the middle of their frames.
#[test]
fn all_ranks_stop_soon_whichever_gets_the_signal() {
    let job = Job::new();
    for (signal, pid) in [("TERM", "pid.0"), ("USR1", "pid.1"), ("TERM", "pid.2")] {
        let Some(mut child) = start(&job, 3, &format!("{LONG} -o o/f_##.png")) else { return };
        // A busy machine takes its time to start a rank.
        while !job.path(pid).exists() {
            std::thread::sleep(Duration::from_millis(10));
        }
        std::thread::sleep(Duration::from_secs(2));
        assert_eq!(child.try_wait().expect("a child"), None);
        let asked = Instant::now();
        send(&job, signal, pid);
        let code = child.wait().expect("it ends").code();
        let words = fs::read_to_string(job.path("errors")).expect("text");
        assert!(asked.elapsed() < Duration::from_secs(5), "{:?}: {words}", asked.elapsed());
        assert_eq!(code, Some(75), "{words}");
        let stopped = format!("SIG{signal} … 0 of 40 frames");
        assert_eq!(lines_that_say(&words, &stopped), 1, "{words}");
    }
    let line = format!("{LONG} --time-limit 2s -o o/f_##.png");
    let begun = Instant::now();
    let Some(ran) = under_mpirun(&job, 2, &line) else { return };
    assert!(begun.elapsed() < Duration::from_secs(8), "{:?}", begun.elapsed());
    assert!(says(&ran.err, "time limit … 2.0 s"), "{}", ran.err);
    assert_eq!(ran.code, Some(75));
}

/// While rank 0 looks for settings the others wait: whichever is asked, the job ends, with one line.
#[test]
fn all_ranks_stop_while_settings_are_chosen() {
    let job = Job::new();
    let line =
        "render cube.obj --size 640x360 --target psnr=60 --png-bits 16 --no-video -o o/f_##.png";
    for pids in ["pid.0", "pid.1", "pid.*"] {
        let Some(mut child) = start(&job, 3, line) else { return };
        let words = || fs::read_to_string(job.path("errors")).expect("text");
        while !words().contains("probe: ") {
            assert_eq!(child.try_wait().expect("a child"), None, "{}", words());
            std::thread::sleep(Duration::from_millis(5));
        }
        let asked = Instant::now();
        send(&job, "TERM", pids);
        let code = child.wait().expect("it ends").code();
        assert!(asked.elapsed() < Duration::from_secs(10), "{:?}", asked.elapsed());
        let stopped = lines_that_say(&words(), "SIGTERM … before the first frame … same command");
        assert_eq!((code, stopped), (Some(75), 1), "{pids}: {}", words());
    }
}

/// All ranks put their key frames' references on disk when they stop, and leave none in the end.
#[test]
fn every_rank_leaves_its_references_when_it_is_stopped() {
    let job = Job::new();
    let line = |out: &str, more: &str| {
        format!(
            "render cube.obj --size 96x54 --spp 16 --segment 16 --frames 1..17 --no-video \
             --threads 1 {more} -o {out}/f_##.png"
        )
    };
    job.done(&line("whole", ""));
    let slow = line("o", "--checkpoint 1h");
    let Some(mut child) = start(&job, 2, &slow) else { return };
    let both = || ["o/f_01.png", "o/f_17.png"].iter().all(|name| job.path(name).exists());
    while !both() {
        assert_eq!(child.try_wait().expect("a child"), None);
        std::thread::sleep(Duration::from_millis(2));
    }
    send(&job, "USR1", "pid.*");
    let code = child.wait().expect("it ends").code();
    if code == Some(0) {
        // A quick machine was through before it heard.
        return;
    }
    assert_eq!(code, Some(75));
    let references = job.names("o/.f.references");
    assert_eq!(references, ["0000001.reference", "0000017.reference"]);
    let Some(ran) = under_mpirun(&job, 3, &line("o", "")) else { return };
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    for frame in 1..=17 {
        let name = format!("f_{frame:02}.png");
        assert!(job.read(&format!("o/{name}")) == job.read(&format!("whole/{name}")), "{name}");
    }
    assert!(!job.path("o/.f.references").exists(), "references are left");
}
