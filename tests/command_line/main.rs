//! The program as a user meets it: words, exit codes, files.

mod comparing;
mod interrupted;
mod job;
#[cfg(feature = "mpi")]
mod launch;
mod ranks;
mod references;
mod rendering;
mod reuse;
#[cfg(feature = "mpi")]
mod together;
mod verify;
mod words;
