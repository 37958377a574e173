//! Whether a launcher (mpirun, srun) started this process, and what its environment says.

use crate::error::Error;

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

/// How many threads a rank uses unless told: the cores that this process may use, shared with
/// the other ranks of its node where the launcher bound nobody to cores of their own.
pub fn default_threads() -> usize {
    let allowed = std::thread::available_parallelism().map_or(1, usize::from);
    share_of_node(allowed, cores_online(), |name| std::env::var(name).ok())
}

fn share_of_node(allowed: usize, online: usize, env: impl Fn(&str) -> Option<String>) -> usize {
    let local = ["OMPI_COMM_WORLD_LOCAL_SIZE", "MPI_LOCALNRANKS", "SLURM_NTASKS_PER_NODE"];
    let neighbours = local.iter().find_map(|name| env(name)?.trim().parse::<usize>().ok());
    match neighbours {
        Some(ranks) if allowed >= online => (allowed / ranks.max(1)).max(1),
        _ => allowed,
    }
}

fn cores_online() -> usize {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    text.lines().filter(|line| line.starts_with("processor")).count().max(1)
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

    #[test]
    fn unbound_ranks_share_the_cores_and_bound_ranks_keep_theirs() {
        let two = [("OMPI_COMM_WORLD_LOCAL_SIZE", "2")];
        assert_eq!(share_of_node(8, 8, env(&two)), 4);
        assert_eq!(share_of_node(4, 8, env(&two)), 4);
        assert_eq!(share_of_node(8, 8, env(&[])), 8);
        assert_eq!(share_of_node(1, 1, env(&two)), 1);
    }
}
