//! Whether a launcher (mpirun, srun) started this process, and what its environment says.

use super::World;
use crate::error::{Error, Result};

/// What is known of the launcher before MPI is asked.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Launcher {
    /// Its usual name.
    pub name: String,
    /// How many processes it started, where it says so.
    pub ranks: Option<u32>,
}

/// Looks for a launcher's variables. `SLURM_NTASKS` alone is none: it is also set in a batch
/// script, which runs once; `SLURM_STEP_NUM_TASKS` is set in the tasks of srun.
pub fn detect(env: impl Fn(&str) -> Option<String>) -> Option<Launcher> {
    let number = |name: &str| env(name).and_then(|text| text.trim().parse::<u32>().ok());
    let srun = env("SLURM_MPI_TYPE").map_or("srun".into(), |kind| format!("srun --mpi={kind}"));
    // srun sets PMI_SIZE too where it plays MPICH's launcher. Where mpirun starts its helpers by srun,
    // Slurm counts these, and not the ranks.
    let plays_mpich = number("PMI_SIZE") == number("SLURM_STEP_NUM_TASKS");
    let mpich = if plays_mpich { &srun } else { "mpiexec of MPICH or Intel MPI" };
    for (name, size) in [
        ("mpirun of Open MPI", "OMPI_COMM_WORLD_SIZE"),
        (mpich, "PMI_SIZE"),
        (&srun, "SLURM_STEP_NUM_TASKS"),
    ] {
        if let Some(ranks) = number(size) {
            return Some(Launcher { name: name.into(), ranks: Some(ranks) });
        }
    }
    env("PMIX_RANK").map(|_| Launcher { name: "a PMIx launcher".into(), ranks: None })
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
        let own = (self.nodes()?[self.rank() as usize], allowed_cores());
        let all = self.all(own.clone())?;
        let sharers = all.iter().filter(|other| **other == own).count();
        Ok((default_threads() / sharers.max(1)).max(1))
    }
}

/// The cores that this process may use, as the system lists them; empty where it does not tell.
fn allowed_cores() -> String {
    let text = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = text.lines().find_map(|line| line.strip_prefix("Cpus_allowed_list:"));
    line.unwrap_or_default().trim().into()
}

impl Launcher {
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
}
