//! `tweenray manual`: manual pages and shell completions, from the description of the command line.
//!
//! Takes a prefix such as `/usr/local`; writes below its `share`, where the shells and `man` look. Hidden from the help:
//! `./x install` and `./x package` call it.

use super::exit::Exit;
use super::say;
use crate::error::{Error, Result};
use crate::output::atomic;
use clap::{Args, Command};
use clap_complete::{Shell, generate};
use clap_mangen::Man;
use std::path::{Path, PathBuf};

/// Write the manual pages and the completions of bash, zsh and fish
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  tweenray manual /usr/local")]
pub struct ManualArgs {
    /// The folder below whose `share` they are written
    #[arg(value_name = "PREFIX")]
    prefix: PathBuf,
}

/// Where each shell looks for completions, below the prefix.
const COMPLETIONS: [(Shell, &str); 3] = [
    (Shell::Bash, "share/bash-completion/completions/tweenray"),
    (Shell::Zsh, "share/zsh/site-functions/_tweenray"),
    (Shell::Fish, "share/fish/vendor_completions.d/tweenray.fish"),
];

/// Runs the command for the command line `described`.
pub fn run(args: &ManualArgs, mut described: Command) -> Result<Exit> {
    described.build();
    for (shell, place) in COMPLETIONS {
        let mut script = Vec::new();
        generate(shell, &mut described, "tweenray", &mut script);
        write(&args.prefix.join(place), &script)?;
    }
    let pages = args.prefix.join("share/man/man1");
    page(&described, "tweenray", &pages)?;
    for command in described.get_subcommands().filter(|command| !command.is_hide_set()) {
        let name = format!("tweenray-{}", command.get_name());
        if command.get_name() != "help" {
            page(command, &name, &pages)?;
        }
    }
    say::result(format_args!("{}", args.prefix.join("share").display()))?;
    Ok(Exit::Done)
}

/// Writes the page `name` of section 1 into `folder`.
fn page(command: &Command, name: &str, folder: &Path) -> Result<()> {
    let path = folder.join(format!("{name}.1"));
    let mut text = Vec::new();
    // The version names the Embree of this machine, so pages leave it out.
    let command = command.clone().version(env!("CARGO_PKG_VERSION"));
    let page = Man::new(command).title(name);
    page.render(&mut text).map_err(|e| Error::io("write", &path, e))?;
    write(&path, &text)
}

fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    path.parent().map_or(Ok(()), atomic::create_folder)?;
    atomic::write(path, |out| out.write_all(bytes)).map(drop)
}
