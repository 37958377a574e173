//! Jobs of several ranks of which one is killed, or all, at any moment, again and again.

use super::bytes_on_ranks::small;
use super::job::Job;
use super::killed::{Moments, visible};
use super::regrouped::{send, start};
use std::collections::BTreeMap;
use std::fs;
use std::process::Child;
use std::time::{Duration, Instant};

/// Waits until all ranks run; false where the job ended before.
fn all_run(job: &Job, child: &mut Child, ranks: u32) -> bool {
    let runs =
        |rank| fs::read_to_string(job.path(format!("pid.{rank}"))).is_ok_and(|p| p.ends_with('\n'));
    while !(0..ranks).all(runs) {
        if child.try_wait().expect("a child").is_some() {
            return false;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    true
}

/// Waits for the job's end, or kills one rank or all when `moment` has passed. Whether it was done.
fn ends_before(job: &Job, child: &mut Child, moment: Duration, victim: Option<u64>) -> bool {
    let start = Instant::now();
    while start.elapsed() < moment && child.try_wait().expect("a child").is_none() {
        std::thread::sleep(Duration::from_millis(1));
    }
    if child.try_wait().expect("a child").is_none() {
        match victim {
            // The launcher ends the others.
            Some(rank) => send(job, "KILL", &format!("pid.{rank}")),
            None => {
                send(job, "KILL", "pid.*");
                child.kill().expect("killed");
            }
        }
    }
    child.wait().expect("it ends").success()
}

/// What is there has the bytes of an undisturbed job. Of frames that were there before a kill at most those
/// in flight are made again, one for each rank.
#[test]
#[ignore = "minutes"]
fn ranks_survive_forty_kills() {
    const KILLS: u32 = 40;
    let job = Job::new();
    let scene = small(&job, "reflective_spheres");
    let line = |out: &str| {
        format!(
            "render {scene} --size 160x120 --spp 4 --shadow-samples 16 --frames 1..16 --no-video \
             --segment 8 --probes 0.02 --checkpoint 0s --threads 1 -o {out}/f_##.png"
        )
    };
    let begun = Instant::now();
    job.done(&line("whole"));
    let time = begun.elapsed();
    let whole = visible(&job, "whole");
    let mut moments = Moments(0x2545_f491_4f6c_dd1d);
    // A number below `end`, by way of a moment.
    let mut below = |end: u64| moments.before(Duration::from_secs(end)).as_secs();
    let (mut kills, mut jobs, mut most) = (0, 0, 0);
    let (mut before, mut ranks_before) = (BTreeMap::new(), 0);
    while kills < KILLS {
        let ranks = 2 + below(3) as u32;
        let moment = time.mul_f64(below(1000) as f64 / 1000.0);
        let victim = (below(2) == 0).then(|| below(ranks.into()));
        let Some(mut child) = start(&job, ranks, &line("k")) else { return };
        let is_done = match all_run(&job, &mut child, ranks) {
            true => ends_before(&job, &mut child, moment, victim),
            false => child.wait().expect("it ended").success(),
        };
        let words = fs::read_to_string(job.path("errors")).expect("text");
        assert!(!words.contains("damaged"), "{words}");
        let now = visible(&job, "k");
        for (name, (bytes, _)) in &now {
            assert!(*bytes == whole[name].0, "kill {kills}: {name} differs\n{words}");
        }
        let is_again = |(name, (_, file)): &(&String, &(Vec<u8>, u64))| {
            now.get(*name).map(|(_, f)| f) != Some(file)
        };
        let again = before.iter().filter(is_again).count();
        assert!(
            again <= ranks_before,
            "kill {kills}: {again} frames of {ranks_before} ranks\n{words}"
        );
        most = most.max(again);
        (before, ranks_before) = (now, ranks as usize);
        if is_done {
            assert!(before.keys().eq(whole.keys()));
            assert_eq!(job.names("k").len(), whole.len() + 1, "{:?}", job.names("k"));
            job.done("status k");
            fs::remove_dir_all(job.path("k")).expect("removed");
            (before, ranks_before) = (BTreeMap::new(), 0);
            jobs += 1;
        } else {
            kills += 1;
        }
    }
    println!("{kills} kills in {jobs} jobs; at most {most} frames made again");
}
