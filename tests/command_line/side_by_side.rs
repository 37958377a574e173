//! Jobs that run in one folder at the same time.

use super::job::Job;
use super::killed::visible;
use super::launch::launched;
use std::fs;
use std::process::{Child, Stdio};
use std::time::Duration;

const LINE: &str = "render cube.obj --size 192x108 --spp 4 --segment 8 --frames 1..20 --no-video \
    --threads 1 --checkpoint 0s";

fn start(job: &Job, ranks: u32, name: &str) -> Option<Child> {
    let mut command = launched(job, ranks, &format!("{LINE} -o k/f_##.png"));
    let errors = fs::File::create(job.path(name)).expect("a file");
    command.stdout(Stdio::null()).stderr(errors).spawn().ok()
}

/// The second takes in what ranks of the first have written so far, and either may end first.
#[test]
fn jobs_side_by_side_leave_a_complete_sequence() {
    let job = Job::new();
    job.done(&format!("{LINE} -o whole/f_##.png"));
    let whole = visible(&job, "whole");
    for (first, second, frames) in [(3, 2, 0), (2, 4, 1), (4, 1, 4), (2, 3, 9)] {
        let Some(one) = start(&job, first, "errors.1") else { return };
        let there = || if job.path("k").exists() { visible(&job, "k").len() } else { 0 };
        while there() < frames {
            std::thread::sleep(Duration::from_millis(1));
        }
        let two = start(&job, second, "errors.2").expect("it starts");
        for (mut child, name) in [(one, "errors.1"), (two, "errors.2")] {
            let code = child.wait().expect("it ends").code();
            let words = fs::read_to_string(job.path(name)).expect("text");
            assert_eq!(code, Some(0), "{words}");
        }
        let ran = job.run("status k --frames 1..20");
        assert_eq!(ran.code, Some(0), "{}", ran.out);
        let now = visible(&job, "k");
        assert!(now.keys().eq(whole.keys()));
        assert!(now.iter().all(|(name, (bytes, _))| *bytes == whole[name].0));
        // The manifest beside them, and no part of it.
        assert_eq!(job.names("k").len(), now.len() + 1, "{:?}", job.names("k"));
        fs::remove_dir_all(job.path("k")).expect("removed");
    }
}
