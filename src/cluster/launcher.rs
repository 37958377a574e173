//! The launcher (mpirun, srun) that started this process, found by its environment variables.

mod binding;
mod process;

use super::Communicator;
use crate::error::{Error, Result};
pub use binding::Binding;
pub use process::LauncherProcess;
use process::allowed_cores;

/// The launcher's environment variables, read before MPI is initialised.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Launcher {
    /// Name for messages.
    pub name: String,
    /// Number of processes that the launcher started, if set.
    pub ranks: Option<u32>,
    /// Number of this process, from 0, if set.
    pub rank: Option<u32>,
}

/// Finds a launcher by its variables. `SLURM_NTASKS` is not one of them, because it is also set in a batch
/// script, which runs once; `SLURM_STEP_NUM_TASKS` is set only in the tasks of srun.
fn detect(env: impl Fn(&str) -> Option<String>) -> Option<Launcher> {
    let number = |name: &str| env(name).and_then(|text| text.trim().parse::<u32>().ok());
    let srun = env("SLURM_MPI_TYPE").map_or("srun".into(), |kind| format!("srun --mpi={kind}"));
    // srun sets PMI_SIZE too when it acts as MPICH's launcher. If mpirun starts its helpers by srun,
    // Slurm counts the helpers and not the ranks.
    let is_srun = number("PMI_SIZE") == number("SLURM_STEP_NUM_TASKS");
    let mpich = if is_srun { &srun } else { "mpiexec of MPICH or Intel MPI" };
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

/// Whether a launcher started this process with a number other than 0. Such a process stays silent about
/// errors that all processes meet before MPI connects them.
pub fn is_nonzero_rank() -> bool {
    current().is_some_and(|launcher| launcher.is_nonzero_rank())
}

/// Refuses to run `command`, which does not share its work, in several processes.
///
/// # Errors
/// A launcher started several processes.
pub fn require_single(command: &str) -> Result<()> {
    match multi_process_launcher() {
        Some(launcher) => Err(launcher.not_shared(command)),
        None => Ok(()),
    }
}

/// The launcher, unless it is known to have started only one process.
pub(super) fn multi_process_launcher() -> Option<Launcher> {
    current().filter(|launcher| launcher.ranks != Some(1))
}

/// The process of the launcher that started this one, if the launcher is known and still visible.
pub fn launcher_process() -> Option<LauncherProcess> {
    current().and_then(|_| LauncherProcess::find())
}

fn current() -> Option<Launcher> {
    detect(|name| std::env::var(name).ok())
}

/// Default number of threads of a single process: the number of cores that it may use.
pub fn default_threads() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

impl Communicator {
    /// Default number of threads of this rank: the number of cores that the rank may use, divided by the
    /// number of ranks on its node with exactly the same cores. All ranks call it.
    ///
    /// # Errors
    /// A message between ranks cannot be encoded or decoded.
    pub fn default_threads(&self) -> Result<usize> {
        let own = (self.node_ids()?[self.rank() as usize], allowed_cores(std::process::id()));
        let all = self.all_gather(own.clone())?;
        let sharers = all.iter().filter(|other| **other == own).count();
        Ok((default_threads() / sharers.max(1)).max(1))
    }
}

impl Launcher {
    fn is_nonzero_rank(&self) -> bool {
        self.ranks != Some(1) && self.rank.is_some_and(|rank| rank > 0)
    }

    /// The error of a command that each of several processes would run as a whole.
    fn not_shared(&self, command: &str) -> Error {
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

    /// The error of a process that MPI does not connect to the others that the launcher started.
    #[cfg_attr(not(feature = "mpi"), allow(dead_code))]
    pub fn not_connected(&self) -> Error {
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
    fn a_launcher_is_found_by_its_variables_and_a_batch_script_is_not_one() {
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
    fn a_nonzero_rank_is_one_of_several_processes_and_has_a_number_above_0() {
        let is_nonzero =
            |pairs: &[(&str, &str)]| detect(env(pairs)).is_some_and(|l| l.is_nonzero_rank());
        assert!(!is_nonzero(&[]));
        assert!(!is_nonzero(&[("SLURM_NTASKS", "4"), ("SLURM_PROCID", "3")]));
        for (size, rank) in [
            ("OMPI_COMM_WORLD_SIZE", "OMPI_COMM_WORLD_RANK"),
            ("PMI_SIZE", "PMI_RANK"),
            ("SLURM_STEP_NUM_TASKS", "SLURM_PROCID"),
        ] {
            assert!(!is_nonzero(&[(size, "4"), (rank, "0")]), "{size}");
            assert!(is_nonzero(&[(size, "4"), (rank, "3")]), "{size}");
            assert!(!is_nonzero(&[(size, "1"), (rank, "3")]), "{size}");
            assert!(!is_nonzero(&[(size, "4")]), "{size}");
        }
        assert!(is_nonzero(&[("PMIX_RANK", "1")]) && !is_nonzero(&[("PMIX_RANK", "0")]));
        // mpirun starts its helper in a Slurm step of one process; mpirun's own variables take precedence.
        let helper = [("SLURM_STEP_NUM_TASKS", "1"), ("SLURM_PROCID", "0")];
        let ranks = [("OMPI_COMM_WORLD_SIZE", "2"), ("OMPI_COMM_WORLD_RANK", "1")];
        assert!(is_nonzero(&[helper, ranks].concat()));
    }
}
