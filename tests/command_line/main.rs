//! The program as a user meets it: words, exit codes, files.

mod aovs;
mod arguments;
#[cfg(feature = "mpi")]
mod bytes_on_ranks;
mod choosing;
mod comparing;
mod full_disk;
mod interrupted;
mod job;
mod killed;
#[cfg(feature = "mpi")]
mod launch;
#[cfg(feature = "mpi")]
#[path = "../common/mpirun.rs"]
mod launcher;
mod locked;
#[cfg(feature = "mpi")]
mod orphaned;
mod pages;
mod ranks;
#[cfg(feature = "mpi")]
mod ranks_killed;
#[cfg(feature = "mpi")]
mod read_once;
mod references;
#[cfg(feature = "mpi")]
mod regrouped;
mod rendering;
mod resumed;
mod reuse;
#[cfg(feature = "mpi")]
mod side_by_side;
mod slurm;
mod sweeps;
mod verify;
