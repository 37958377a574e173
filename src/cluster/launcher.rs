//! Whether a launcher (mpirun, srun) started this process, and what its environment says.

mod binding;
mod process;

use super::World;
use crate::error::{Error, Result};
pub use binding::Binding;
pub use process::LauncherProcess;
use process::allowed_cores;

/// What is known of the launcher before MPI is asked.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Launcher {
    /// Its usual name.
    pub name: String,
    /// How many processes it started, where it says so.
    pub ranks: Option<u32>,
    /// Which of them this one is, where it says so.
    pub rank: Option<u32>,
}

/// Looks for a launcher's variables. `SLURM_NTASKS` alone is none: it is also set in a batch
/// script, which runs once; `SLURM_STEP_NUM_TASKS` is set in the tasks of srun.
fn detect(env: impl Fn(&str) -> Option<String>) -> Option<Launcher> {
    let number = |name: &str| env(name).and_then(|text| text.trim().parse::<u32>().ok());
    let srun = env("SLURM_MPI_TYPE").map_or("srun".into(), |kind| format!("srun --mpi={kind}"));
    // srun sets PMI_SIZE too where it plays MPICH's launcher. Where mpirun starts its helpers by srun,
    // Slurm counts these, and not the ranks.
    let plays_mpich = number("PMI_SIZE") == number("SLURM_STEP_NUM_TASKS");
    let mpich = if plays_mpich { &srun } else { "mpiexec of MPICH or Intel MPI" };
    for (name, size, rank) in [
        ("mpirun of Open MPI", "OMPI_COMM_WORLD_SIZE", "OMPI_COMM_WORLD_RANK"),
        (mpich, "PMI_SIZE", "PMI_RANK"),
        (&srun, "SLURM_STEP_NUM_TASKS", "SLURM_PROCID"),
    ] {
        if let Some(ranks) = number(size) {
            return Some(Launcher { name: name.into(), ranks: Some(ranks), rank: number(rank) });
        }
    }
    env("PMIX_RANK").map(|_| {
        let rank = number("PMIX_RANK");
        Launcher { name: "a PMIx launcher".into(), ranks: None, rank }
    })
}

/// Whether a launcher started this process as another than the first. What all of them find wrong before
/// they know of each other, the first one tells.
pub fn is_follower() -> bool {
    here().is_some_and(|launcher| launcher.is_follower())
}

/// Whether this process is the only one, as `command` has to be, which does all of its work by itself.
///
/// # Errors
/// A launcher started several.
pub fn alone(command: &str) -> Result<()> {
    match several() {
        Some(launcher) => Err(launcher.crowd(command)),
        None => Ok(()),
    }
}

/// The launcher, where it started several processes as far as is known.
pub(super) fn several() -> Option<Launcher> {
    here().filter(|launcher| launcher.ranks != Some(1))
}

/// The process of the launcher that started this one, where both are known.
pub fn launcher_process() -> Option<LauncherProcess> {
    here().and_then(|_| LauncherProcess::find())
}

fn here() -> Option<Launcher> {
    detect(|name| std::env::var(name).ok())
}

/// How many threads a process uses unless told, with nobody to share with: the cores that it may use.
pub fn default_threads() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

impl World {
    /// How many threads this rank uses unless told: the cores that the launcher gave it, shared with
    /// those ranks of its node that got the very same ones. All ranks call it.
    ///
    /// # Errors
    /// Those of talking to other ranks.
    pub fn default_threads(&self) -> Result<usize> {
        let own = (self.nodes()?[self.rank() as usize], allowed_cores(std::process::id()));
        let all = self.all(own.clone())?;
        let sharers = all.iter().filter(|other| **other == own).count();
        Ok((default_threads() / sharers.max(1)).max(1))
    }
}

impl Launcher {
    fn is_follower(&self) -> bool {
        self.ranks != Some(1) && self.rank.is_some_and(|rank| rank > 0)
    }

    /// The error of a command that several processes would each run as a whole.
    fn crowd(&self, command: &str) -> Error {
        Error::Usage(format!(
            "{} started {}, and each would do all that `tweenray {command}` does and write the same \
             files\n  help: start it without a launcher; only `tweenray render` shares its work",
            self.name,
            self.processes()
        ))
    }

    /// The error of a program without MPI among several processes.
    #[cfg_attr(feature = "mpi", allow(dead_code))]
    pub fn without_mpi(&self) -> Error {
        Error::Usage(format!(
            "{} started {}, but this tweenray was built without MPI, and each would render every \
             frame\n  help: build it with `cargo build --release --features mpi`, or start it \
             without a launcher",
            self.name,
            self.processes()
        ))
    }

    /// The error of a process that MPI takes to be alone though the launcher started several.
    #[cfg_attr(not(feature = "mpi"), allow(dead_code))]
    pub fn stranger(&self) -> Error {
        Error::Usage(format!(
            "{} started {}, but MPI knows of one only, and each would render every frame\n  \
             help: use the mpirun of the MPI that tweenray was built with, or `srun --mpi=pmix`",
            self.name,
            self.processes()
        ))
    }

    fn processes(&self) -> String {
        self.ranks.map_or_else(|| "several processes".into(), |n| format!("{n} processes"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn env<'a>(pairs: &'a [(&'a str, &'a str)]) -> impl Fn(&str) -> Option<String> + 'a {
        |name| pairs.iter().find(|(n, _)| *n == name).map(|(_, v)| v.to_string())
    }

    #[test]
    fn a_launcher_is_known_by_its_variables_and_a_batch_script_is_none() {
        assert_eq!(detect(env(&[])), None);
        assert_eq!(detect(env(&[("SLURM_NTASKS", "4"), ("SLURM_PROCID", "0")])), None);
        let ranks = |pairs| detect(env(pairs)).and_then(|l| l.ranks);
        assert_eq!(ranks(&[("OMPI_COMM_WORLD_SIZE", "3")]), Some(3));
        assert_eq!(ranks(&[("PMI_SIZE", "2")]), Some(2));
        assert_eq!(ranks(&[("SLURM_STEP_NUM_TASKS", "8"), ("PMIX_RANK", "1")]), Some(8));
        let name = |pairs| detect(env(pairs)).map(|l| l.name).unwrap_or_default();
        let pmi2 = [("PMI_SIZE", "2"), ("SLURM_STEP_NUM_TASKS", "2"), ("SLURM_MPI_TYPE", "pmi2")];
        assert_eq!(name(&pmi2), "srun --mpi=pmi2");
        assert_eq!(name(&[("PMI_SIZE", "8"), ("SLURM_STEP_NUM_TASKS", "2")])[..7], *"mpiexec");
        assert!(detect(env(&[("PMIX_RANK", "0")])).is_some_and(|l| l.ranks.is_none()));
    }

    #[test]
    fn all_but_the_first_process_leave_it_to_that_to_speak() {
        let follows = |pairs: &[(&str, &str)]| detect(env(pairs)).is_some_and(|l| l.is_follower());
        assert!(!follows(&[]));
        assert!(!follows(&[("SLURM_NTASKS", "4"), ("SLURM_PROCID", "3")]));
        for (size, rank) in [
            ("OMPI_COMM_WORLD_SIZE", "OMPI_COMM_WORLD_RANK"),
            ("PMI_SIZE", "PMI_RANK"),
            ("SLURM_STEP_NUM_TASKS", "SLURM_PROCID"),
        ] {
            assert!(!follows(&[(size, "4"), (rank, "0")]), "{size}");
            assert!(follows(&[(size, "4"), (rank, "3")]), "{size}");
            assert!(!follows(&[(size, "1"), (rank, "3")]), "{size}");
            assert!(!follows(&[(size, "4")]), "{size}");
        }
        assert!(follows(&[("PMIX_RANK", "1")]) && !follows(&[("PMIX_RANK", "0")]));
        // A step of one process that mpirun starts its helpers in is not what counts.
        let helper = [("SLURM_STEP_NUM_TASKS", "1"), ("SLURM_PROCID", "0")];
        let ranks = [("OMPI_COMM_WORLD_SIZE", "2"), ("OMPI_COMM_WORLD_RANK", "1")];
        assert!(follows(&[helper, ranks].concat()));
    }
}
