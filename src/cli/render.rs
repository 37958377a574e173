//! `tweenray render`: every frame of a shot, and a video of them.
//!
//! Load, choose, render, report: [`render`] is the whole of it, and each of the four has a file.

mod choosing;
mod report;
mod round;
mod site;
mod videos;

use super::args::{JobArgs, SceneArgs, SettingArgs};
use super::choose::{ChoiceArgs, Judgement};
use super::exit::Exit;
use super::request::Request;
use super::say;
use super::signals::Interrupt;
use crate::cluster::{self, Communicator};
use crate::error::{Error, Result};
use choosing::Choosing;
use clap::{Args, Command, FromArgMatches};
use round::RenderJob;
use site::{Site, share_isa};
use std::time::Instant;

/// Render the frames of a camera move
#[derive(Debug, Args)]
#[command(after_help = "\
Most options can also stand in the scene file; the command line wins.
Frames that exist with the same settings are kept, so the same command goes on where it stopped.

`tweenray status` shows which frames are done. When a camera move gets longer, frames that stay the
same are kept.

SIGINT, SIGTERM and SIGUSR1 stop the job; a second SIGINT or SIGTERM ends it at once.
Exit codes: 0 done, 1 failed, 2 usage or bad input, 75 stopped and can be resumed,
76 stopped because mpirun (or srun) was killed; can be resumed.

Examples:
  tweenray render scene.toml -o 'out/frame_####.png' --frames 1..16 --size 640x360 --spp 4
  tweenray render bunny.obj --up z
  tweenray render scene.toml --target psnr=45
  mpirun -n 4 tweenray render scene.toml")]
pub struct RenderArgs {
    #[command(flatten)]
    pub scene: SceneArgs,
    #[command(flatten)]
    pub job: JobArgs,
    #[command(flatten)]
    pub choice: ChoiceArgs,
    #[command(flatten)]
    pub settings: SettingArgs,
}

/// The arguments of this command for `scene`, with the options in `words`.
///
/// Errors: `Error::Usage`: these are no options of the command.
pub fn parse(scene: &str, words: &[String]) -> Result<RenderArgs> {
    let command = RenderArgs::augment_args(Command::new("tweenray render"));
    let words = ["tweenray render", scene].into_iter().chain(words.iter().map(String::as_str));
    let parsed = command.try_get_matches_from(words);
    let parsed = parsed.and_then(|found| RenderArgs::from_arg_matches(&found));
    parsed.map_err(|wrong| {
        let text = wrong.to_string();
        Error::Usage(text.trim().trim_start_matches("error: ").into())
    })
}

/// How to resume a job that has begun no frame: with `--overwrite` again, if it had that.
const NOTHING_DONE: &str = " before the first frame; give the same command again";

/// Runs the command.
pub fn run(args: &RenderArgs) -> Exit {
    let interrupt = Interrupt::new();
    let theirs = interrupt.clone();
    let tell_failure = move |error: &Error| {
        theirs.over();
        say::error(error);
        Exit::of(error).code()
    };
    let comm = match Communicator::init(tell_failure) {
        Ok(comm) => comm,
        Err(error) => return super::refused(&error),
    };
    let ended = render(&comm, &interrupt, args);
    // Other ranks still listen for signals while rank 0 makes the video.
    if comm.is_root() || !matches!(ended, Ok(Exit::Done)) {
        interrupt.over();
    }
    let exit = ended.unwrap_or_else(|error| {
        if comm.has_unreported_failure() {
            comm.abort(&error);
        } else if comm.is_root() {
            say::error(&error);
        }
        Exit::of(&error)
    });
    // Rank 0 may still be making the video.
    comm.final_barrier();
    interrupt.over();
    if interrupt.is_orphan() {
        let exit = if exit == Exit::Stopped { Exit::Orphaned } else { exit };
        // Ending MPI would wait for a launcher that is not there.
        signal_hook::low_level::exit(exit.code().into());
    }
    exit
}

/// Renders all missing frames. If the program chose the settings and the target was missed, renders them again
/// with other settings. All ranks call it.
fn render(comm: &Communicator, interrupt: &Interrupt, args: &RenderArgs) -> Result<Exit> {
    let start = Instant::now();
    // Only one rank talks.
    let quiet = args.job.quiet || !comm.is_root();
    let request = load(comm, interrupt, args, (start, quiet))?;
    let rank_map = args.job.rank_map.as_deref();
    let site = Site::new(comm, interrupt, &request, (start, rank_map, quiet))?;
    let choosing = Choosing { args, request: &request, site: &site };
    let mut choice = match choosing.first() {
        Err(Error::Stopped) => return Ok(report::stopped_while_choosing(&site)),
        first => first?,
    };
    let mut is_again = false;
    loop {
        let job = RenderJob::new(&site, &request, choice.as_ref(), is_again)?;
        let round = job.render()?;
        match choosing.next(&job, &round, choice.take()) {
            // All frames are finished, but not all were checked against the target.
            Err(Error::Stopped) => return report::conclude(&job, &round, true),
            Err(error) => return Err(error),
            Ok(Some(Judgement::Again(tighter))) => (choice, is_again) = (Some(tighter), true),
            Ok(last) => {
                let exit = report::conclude(&job, &round, false)?;
                report::say_verdict(last, quiet)?;
                return Ok(exit);
            }
        }
    }
}

/// Reads the scene and the options; from here on the job can be stopped.
fn load(
    comm: &Communicator,
    interrupt: &Interrupt,
    args: &RenderArgs,
    (start, quiet): (Instant, bool),
) -> Result<Request> {
    interrupt.listen(comm.is_root())?;
    if let Some(launcher) = cluster::launcher_process() {
        interrupt.end_with(launcher);
    }
    interrupt.goes_on(NOTHING_DONE.into());
    interrupt.before_slurm_ends();
    interrupt.limit(start, args.job.time_limit);
    let mut request =
        Request::load(comm, &args.scene, (&args.settings, args.choice.is_any()), &args.job)?;
    if args.job.time_limit.is_none() {
        interrupt.limit(start, request.options.time_limit);
    }
    comm.set_exchange(request.options.exchange);
    comm.agree(args.choice.check(&request))?;
    say::unless(quiet, &request.warnings, |w| say::warning(w));
    share_isa(comm, &mut request.settings, quiet)?;
    Ok(request)
}
