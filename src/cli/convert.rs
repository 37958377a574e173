//! `tweenray convert`: a mesh in another format.

use super::exit::{Exit, as_input};
use super::{say, values};
use crate::error::{Error, Result};
use crate::import;
use crate::scene::limits;
use clap::Args;
use std::path::PathBuf;

/// Convert a mesh to binary PLY, which loads many times faster
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  tweenray convert bunny.obj bunny.ply
  tweenray convert figure.glb figure.ply --time 1.5")]
pub struct ConvertArgs {
    /// The mesh to read (.obj, .ply, .glb, .gltf)
    #[arg(value_name = "FROM")]
    from: PathBuf,
    /// The file to write (.ply); replaced where it exists
    #[arg(value_name = "TO")]
    to: PathBuf,
    /// Time at which animated meshes of a glTF file stand, seconds [default: 0]
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = values::within(limits::TIME))]
    time: Option<f64>,
}

/// Runs the command.
pub fn run(args: &ConvertArgs) -> Result<Exit> {
    let report = import::convert(&args.from, &args.to, args.time).map_err(|e| match e {
        Error::Io { ref path, .. } if *path == args.to => e,
        other => as_input(other),
    })?;
    report.warnings.iter().for_each(say::warning);
    let written = &report.written;
    say::result(format_args!(
        "{}: {} triangles, {} vertices, {:.1} MB",
        args.to.display(),
        written.triangles,
        written.vertices,
        written.bytes as f64 * 1e-6
    ))?;
    Ok(Exit::Done)
}
