//! `tweenray schema`: the scene format for editors.

use super::exit::Exit;
use super::say;
use crate::error::Result;
use crate::import;
use clap::Args;

/// Print the JSON schema of scene files, for editors that check TOML
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  tweenray schema > scene.schema.json

Then open a scene file with this as its first line:
  #:schema ./scene.schema.json")]
pub struct SchemaArgs {}

/// Runs the command.
pub fn run(_: &SchemaArgs) -> Result<Exit> {
    say::json(&import::schema())?;
    Ok(Exit::Done)
}
