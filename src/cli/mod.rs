//! The command line: parses arguments, prints, and returns an exit code. One file per subcommand.
//!
//! Only this room prints or parses arguments. Results go to
//! stdout; progress, warnings and errors to stderr.

mod accuracy;
mod args;
mod audited;
mod choose;
mod compare;
mod convert;
mod exit;
mod findings;
mod inspect;
mod job;
mod machine;
mod manual;
mod progress;
mod references;
mod render;
mod report;
mod request;
mod say;
mod schema;
mod signals;
mod slurm;
mod spelled;
mod stats;
mod status;
mod values;
mod verify;

use crate::cluster;
use crate::error::{Error, Result};
use clap::{CommandFactory, Parser, Subcommand};
use exit::Exit;
use std::process::ExitCode;

/// Render camera moves through static, high-geometry scenes
#[derive(Debug, Parser)]
#[command(name = "tweenray", version = VERSION, arg_required_else_help = true)]
#[command(after_help = "\
Examples:
  tweenray render bunny.obj
  tweenray render scene.toml -o 'out/frame_####.png' --frames 1..16
  tweenray status out/
  tweenray slurm scene.toml --nodes 4 --time 30m | sbatch
  tweenray inspect scene.toml
  tweenray compare out/frame_0001.png other.png
  tweenray accuracy scene.toml -o accuracy
  tweenray report out/scene

`tweenray COMMAND --help` says more.")]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Render(Box<render::RenderArgs>),
    Status(status::StatusArgs),
    Slurm(slurm::SlurmArgs),
    Inspect(Box<inspect::InspectArgs>),
    Verify(Box<verify::VerifyArgs>),
    Compare(compare::CompareArgs),
    Convert(convert::ConvertArgs),
    Accuracy(Box<accuracy::AccuracyArgs>),
    Report(report::ReportArgs),
    Schema(schema::SchemaArgs),
    #[command(hide = true)]
    Manual(manual::ManualArgs),
}

const VERSION: &str = concat!(
    env!("CARGO_PKG_VERSION"),
    "+",
    env!("TWEENRAY_SOURCES"),
    " (built with Embree ",
    env!("TWEENRAY_EMBREE_VERSION"),
    ")"
);

/// Runs the program with the process's arguments; the process ends with what this returns.
pub fn run() -> ExitCode {
    std::panic::set_hook(Box::new(|panic| {
        say::aside(format_args!("error: {}: {panic}", cluster::PANIC_MESSAGE));
    }));
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(wrong) => {
            // Help and version are "errors" to clap. All processes of a job have the same words.
            let printed = match cluster::is_nonzero_rank() {
                true => Ok(()),
                false => say::told(wrong.print()),
            };
            return match wrong.use_stderr() {
                true => Exit::Usage,
                false => ended(printed.map(|()| Exit::Done)),
            }
            .into();
        }
    };
    // The hook above reported the panic.
    std::panic::catch_unwind(|| dispatch(&arguments.command)).unwrap_or(Exit::Failed).into()
}

fn dispatch(command: &Command) -> Exit {
    let is_alone = command.alone().map_or(Ok(()), cluster::require_single);
    if let Err(error) = is_alone {
        return refused(&error);
    }
    let result = match command {
        Command::Render(args) => return render::run(args),
        Command::Status(args) => status::run(args),
        Command::Slurm(args) => slurm::run(args),
        Command::Inspect(args) => inspect::run(args),
        Command::Verify(args) => verify::run(args),
        Command::Compare(args) => compare::run(args),
        Command::Convert(args) => convert::run(args),
        Command::Accuracy(args) => accuracy::run(args),
        Command::Report(args) => report::run(args),
        Command::Schema(args) => schema::run(args),
        Command::Manual(args) => manual::run(args, Arguments::command()),
    };
    ended(result)
}

impl Command {
    /// The name of the command, if it writes files and must run in a single process.
    fn alone(&self) -> Option<&'static str> {
        match self {
            Self::Accuracy(_) => Some("accuracy"),
            Self::Report(_) => Some("report"),
            Self::Convert(_) => Some("convert"),
            Self::Manual(_) => Some("manual"),
            _ => None,
        }
    }
}

/// Prints an error that all processes of a launcher have, once.
fn refused(error: &Error) -> Exit {
    if !cluster::is_nonzero_rank() {
        say::error(error);
    }
    Exit::of(error)
}

/// The exit code of `result`; prints its error.
fn ended(result: Result<Exit>) -> Exit {
    result.unwrap_or_else(|error| {
        say::error(&error);
        Exit::of(&error)
    })
}

/// The command line of this process, with the program's name instead of its path.
fn words() -> Vec<String> {
    let mut words: Vec<String> =
        std::env::args_os().map(|word| word.to_string_lossy().into_owned()).collect();
    if let Some(program) = words.first_mut() {
        *program = "tweenray".into();
    }
    words
}

#[cfg(test)]
mod tests {
    use super::Arguments;
    use clap::CommandFactory;

    #[test]
    fn the_declarations_of_the_command_line_are_consistent() {
        Arguments::command().debug_assert();
    }
}
