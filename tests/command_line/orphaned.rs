//! What the launcher does to its ranks: it is killed, or binds them.

use super::job::{Job, Ran, says};
use super::launch::mpirun;
use std::fs;
use std::process::Stdio;
use std::time::{Duration, Instant};

/// Each rank leaves its words and its exit code in files, since mpirun is not there to hand them on.
const RANK: &str = "\"$@\" 2> err.$OMPI_COMM_WORLD_RANK; echo $? > code.$OMPI_COMM_WORLD_RANK";

/// Of frames that take some tenths of a second, more than anybody waits for.
const LONG: &str = "render cube.obj --size 192x108 --spp 96 --shadow-samples 1 --sky-samples 1 --threads 1 \
    --policy off --no-video -o o/f_##.png";

fn wait_until(what: &str, holds: impl Fn() -> bool) {
    let since = Instant::now();
    while !holds() {
        assert!(since.elapsed() < Duration::from_secs(60), "{what}");
        std::thread::sleep(Duration::from_millis(10));
    }
}

#[test]
fn ranks_whose_mpirun_is_killed_stop_and_the_same_command_goes_on() {
    for ranks in [1, 3] {
        let job = Job::new();
        let alone = job.command(LONG);
        let mut command = mpirun(&job);
        command.args(["-n", &ranks.to_string(), "sh", "-c", RANK, "sh"]);
        command.arg(alone.get_program()).args(alone.get_args());
        let Ok(mut child) = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn() else {
            return;
        };
        let words =
            |rank: i32| fs::read_to_string(job.path(format!("err.{rank}"))).unwrap_or_default();
        wait_until("no frame is made", || words(0).contains("frame 1 of 48"));
        child.kill().and_then(|()| child.wait()).expect("killed");
        let killed = Instant::now();
        let code =
            |rank: i32| fs::read_to_string(job.path(format!("code.{rank}"))).unwrap_or_default();
        wait_until("a rank goes on alone", || (0..ranks).all(|rank| code(rank).ends_with('\n')));
        assert!(killed.elapsed() < Duration::from_secs(20), "{:?}", killed.elapsed());
        for rank in 0..ranks {
            assert_eq!(code(rank), "76\n", "rank {rank} of {ranks}: {}", words(rank));
        }
        let told = words(0);
        assert!(says(&told, "mpirun (process … ended … of 48 frames … same command"), "{told}");
        let status = job.run("status o");
        assert!(status.code == Some(3) && !status.out.contains("damaged"), "{}", status.out);
        let status: serde_json::Value =
            serde_json::from_str(&job.run("status o --json").out).expect("JSON");
        let done = status[0]["done"][0].as_u64().expect("a frame is done");
        assert!(job.done(&format!("{LONG} --frames {done}")).out.contains("1 kept"));
    }
}

/// Open MPI binds each of one or two ranks to a core, and said nothing of it.
#[test]
fn a_binding_that_leaves_cores_idle_is_reported() {
    if std::thread::available_parallelism().map_or(1, usize::from) < 2 {
        eprintln!("skipped: one core can be bound to only");
        return;
    }
    let job = Job::new();
    let run = |binding: &str, frames: &str| {
        let alone = job.command(&format!(
            "render cube.obj --size 32x18 --frames {frames} --no-video -o o/f_##.png"
        ));
        let mut command = mpirun(&job);
        command.args(["--bind-to", binding, "-n", "1"]);
        command.arg(alone.get_program()).args(alone.get_args());
        command.output().ok().map(|output| Ran::of(&output))
    };
    let Some(bound) = run("core", "1") else { return };
    assert_eq!(bound.code, Some(0), "{}", bound.err);
    let note = "note: … binds … 1 of … 1 thread … --bind-to none";
    assert!(says(&bound.err, note), "{}", bound.err);
    let free = run("none", "2").expect("mpirun");
    assert!(free.code == Some(0) && !free.err.contains("binds"), "{}", free.err);
}
