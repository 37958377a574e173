//! Jobs that are killed at any moment, again and again, and resumed until they are done.

use super::job::Job;
use std::collections::BTreeMap;
use std::fs;
use std::os::unix::fs::MetadataExt;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

/// What the jobs are called with, each with the ending of its frames.
const JOBS: [(&str, &str); 5] = [
    ("png", "--checkpoint 0s"),
    ("exr", "--checkpoint 0s --aovs all"),
    ("exr", "--checkpoint 1s --crop 8,4,50,30 --aovs all"),
    ("png", "--checkpoint 0s --maps --threads 1"),
    ("png", "--checkpoint 0s --policy colour"),
];

/// Numbers without a pattern, the same in each run (Marsaglia, 2003: xorshift).
pub struct Moments(pub u64);

impl Moments {
    /// A moment before `end`.
    pub fn before(&mut self, end: Duration) -> Duration {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        end.mul_f64((self.0 >> 11) as f64 / (1_u64 << 53) as f64)
    }
}

fn line(options: &str, ending: &str, folder: &str) -> String {
    format!(
        "render cube.obj --size 64x36 --spp 2 --segment 8 --frames 1..20 --no-video {options} \
         -o {folder}/f_##.{ending}"
    )
}

/// The files that a user sees, but for the manifest, with what they hold and which file they are.
pub fn visible(job: &Job, folder: &str) -> BTreeMap<String, (Vec<u8>, u64)> {
    let is_visible = |name: &String| !name.starts_with('.') && !name.ends_with(".jsonl");
    let names = if job.path(folder).exists() { job.names(folder) } else { Vec::new() };
    let look = |name: String| {
        let path = job.path(folder).join(&name);
        let file = fs::metadata(&path).expect("a file").ino();
        (name, (fs::read(&path).expect("whole"), file))
    };
    names.into_iter().filter(is_visible).map(look).collect()
}

/// Waits for the child's end or for `moment`; whether it ended by itself.
fn ends_before(child: &mut Child, moment: Duration) -> bool {
    let start = Instant::now();
    while start.elapsed() < moment {
        if let Some(status) = child.try_wait().expect("a child") {
            assert!(status.success(), "{status}");
            return true;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    child.kill().expect("killed");
    child.wait().expect("dead");
    false
}

/// Kills a job until it gets done, or `most` times; gives how often.
fn kill_until_done(number: usize, moments: &mut Moments, most: usize) -> usize {
    let (ending, options) = JOBS[number % JOBS.len()];
    let job = Job::new();
    let start = Instant::now();
    job.done(&line(options, ending, "whole"));
    let time = start.elapsed();
    let whole = visible(&job, "whole");
    let mut before = BTreeMap::new();
    for kills in 0.. {
        let mut command = job.command(&line(options, ending, "k"));
        let errors = fs::File::create(job.path("errors")).expect("a file");
        let mut child = command.stdout(Stdio::null()).stderr(errors).spawn().expect("it starts");
        let moment = if kills < most { moments.before(time) } else { 100 * time };
        let done = ends_before(&mut child, moment);
        let words = fs::read_to_string(job.path("errors")).expect("text");
        assert!(!words.contains("damaged"), "{words}");
        let now = visible(&job, "k");
        for (name, (bytes, _)) in &now {
            assert!(*bytes == whole[name].0, "job {number}, kill {kills}: {name} differs\n{words}");
        }
        let repeated = |(name, (_, file)): &(&String, &(Vec<u8>, u64))| {
            // Maps belong to their frame.
            name.matches('_').count() == 1 && now.get(*name).map(|(_, f)| f) != Some(file)
        };
        let repeated = before.iter().filter(repeated).count();
        assert!(repeated <= 1, "job {number}, kill {kills}: {repeated} frames were made again");
        if done {
            assert_eq!(now.len(), whole.len());
            assert!(!job.path("k/.f.references").exists(), "references are left");
            job.done("status k --frames 1..20");
            return kills;
        }
        before = now;
    }
    unreachable!("the loop has no end")
}

/// Kills jobs until `wanted` are dead; gives how many jobs that took.
fn kill(wanted: usize, seed: u64) -> usize {
    let mut moments = Moments(seed);
    let (mut kills, mut number) = (0, 0);
    while kills < wanted {
        kills += kill_until_done(number, &mut moments, wanted - kills);
        number += 1;
    }
    number
}

#[test]
fn a_job_killed_at_any_moment_ends_with_the_same_bytes() {
    kill(8, 0x9e37_79b9_7f4a_7c15);
}

/// `cargo test --release --test command_line -- --ignored --nocapture two_hundred`
#[test]
#[ignore = "minutes"]
fn a_job_survives_two_hundred_kills() {
    println!("200 kills in {} jobs", kill(200, 0xd1b5_4a32_d192_ed03));
}
