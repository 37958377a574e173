//! Jobs under mpirun.

use super::job::{Job, Ran};
use super::launcher;
use std::process::Command;

/// The job under mpirun; `None` where there is none: without it there is nothing to test.
pub fn under_mpirun(job: &Job, ranks: u32, line: &str) -> Option<Ran> {
    launched(job, ranks, line).output().ok().map(|output| Ran::of(&output))
}

/// The command for it. Each rank leaves its process's number in a file `pid.RANK`.
pub fn launched(job: &Job, ranks: u32, line: &str) -> Command {
    let alone = job.command(line);
    let mut command = mpirun(job);
    let note_pid = "echo $$ > pid.$OMPI_COMM_WORLD_RANK; exec \"$@\"";
    command.args(["-n", &ranks.to_string(), "sh", "-c", note_pid, "sh"]);
    command.arg(alone.get_program()).args(alone.get_args());
    command
}

/// mpirun in the job's folder.
pub fn mpirun(job: &Job) -> Command {
    let mut command = launcher::mpirun();
    command.current_dir(job.path("."));
    command
}
