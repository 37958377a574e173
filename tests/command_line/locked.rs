//! Jobs of other settings that start in one folder at the same time.

use super::job::{Job, Ran, says};
use super::killed::visible;
use std::process::Stdio;
use std::time::{Duration, Instant};

const LINE: &str = "render cube.obj --size 96x54 --segment 8 --frames 1..8 --no-video --threads 1";

fn start(job: &Job, more: &str) -> std::process::Child {
    let mut command = job.command(&format!("{LINE} {more} -o k/f_##.png"));
    command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("it starts")
}

/// One gets the folder, whole and of its own settings; the other ends with an error and leaves no trace.
#[test]
fn of_two_jobs_of_other_settings_one_gets_the_folder() {
    let job = Job::new();
    let seeds = ["--spp 2 --seed 1", "--spp 2 --seed 2"];
    for (n, seed) in seeds.iter().enumerate() {
        job.done(&format!("{LINE} {seed} -o whole.{n}/f_##.png"));
    }
    let whole = [visible(&job, "whole.0"), visible(&job, "whole.1")];
    let mut by_lock = 0;
    for attempt in 0..12 {
        // Either is first now and then; a folder that has frames of old is no matter either.
        let overwrite = if attempt % 3 == 2 { " --overwrite" } else { "" };
        if overwrite.is_empty() && job.path("k").exists() {
            std::fs::remove_dir_all(job.path("k")).expect("removed");
        }
        let order = if attempt % 2 == 0 { [0, 1] } else { [1, 0] };
        let jobs = order.map(|n| (n, start(&job, &format!("{}{overwrite}", seeds[n]))));
        let ran = jobs.map(|(n, child)| (n, Ran::of(&child.wait_with_output().expect("it ends"))));
        let told = format!("{:?}", ran.each_ref().map(|(n, ran)| (n, ran.code, &ran.err)));
        let winners: Vec<usize> =
            ran.iter().filter(|(_, r)| r.code == Some(0)).map(|(n, _)| *n).collect();
        let loser = ran.iter().find(|(_, ran)| ran.code != Some(0));
        // (With --overwrite the second may begin when the first is through.)
        let Some((_, loser)) = loser else {
            assert!(!overwrite.is_empty(), "{told}");
            continue;
        };
        assert_eq!((winners.len(), loser.code), (1, Some(2)), "{told}");
        assert!(loser.err.contains("k/f_##.png") && loser.err.contains("-o"), "{told}");
        by_lock += usize::from(says(&loser.err, "is being rendered … seed"));
        let now = visible(&job, "k");
        let expected = &whole[winners[0]];
        assert!(now.keys().eq(expected.keys()), "{told}");
        assert!(now.iter().all(|(name, (bytes, _))| *bytes == expected[name].0), "{told}");
        // The manifest beside the frames, and no lock.
        assert_eq!(job.names("k").len(), now.len() + 1, "{:?}", job.names("k"));
    }
    assert!(by_lock > 0, "no two of them met");
}

/// Other frames of the same shot go side by side; another move through the scene does not.
#[test]
fn parts_of_one_shot_share_a_folder_and_another_move_is_kept_out() {
    let job = Job::new();
    let line = LINE.replace("--frames 1..8", "");
    let run = |more: &str| {
        let mut command = job.command(&format!("{line} {more} -o k/f_##.png"));
        command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("it starts")
    };
    let first = run("--spp 64 --frames 1..4");
    let since = Instant::now();
    while !job.path("k/.f.lock").exists() {
        assert!(since.elapsed() < Duration::from_secs(20));
        std::thread::sleep(Duration::from_millis(1));
    }
    let second = run("--spp 64 --frames 5..8");
    let turned = job.run(&format!("{line} --spp 64 --up z --frames 1..4 -o k/f_##.png"));
    assert_eq!(turned.code, Some(2), "{}", turned.err);
    assert!(says(&turned.err, "is being rendered … scene content"), "{}", turned.err);
    for child in [first, second] {
        let ran = Ran::of(&child.wait_with_output().expect("it ends"));
        assert_eq!(ran.code, Some(0), "{}", ran.err);
    }
    assert_eq!(job.run("status k --frames 1..8").code, Some(0));
}

/// The lock is the process's, not the file's.
#[test]
fn the_lock_of_a_killed_job_keeps_no_other_job_out() {
    let job = Job::new();
    let mut child = start(&job, "--spp 256 --seed 1");
    let since = Instant::now();
    while !job.path("k/.f.lock").exists() {
        assert!(since.elapsed() < Duration::from_secs(20));
        std::thread::sleep(Duration::from_millis(1));
    }
    child.kill().and_then(|()| child.wait()).expect("killed");
    job.done(&format!("{LINE} --spp 2 --seed 2 --overwrite -o k/f_##.png"));
    assert!(!job.path("k/.f.lock").exists());
}
