//! `tweenray status`: which frames of a sequence are finished.

use super::exit::Exit;
use super::say;
use super::values::{self, FrameRequest};
use crate::error::{Error, Result, counted};
use crate::output::FramePattern;
use crate::output::manifest::{self, manifest_path};
use crate::scene::FrameRange;
use crate::sequence::survey::{Survey, survey};
use clap::Args;
use std::fs;
use std::path::{Path, PathBuf};

/// Say which frames of a sequence are done, missing, damaged or of other settings
///
/// Every file is compared with its hash in the manifest. Nothing is changed, and the job may be
/// running.
#[derive(Debug, Args)]
#[command(after_help = "\
Exit codes: 0 the sequence is complete, 3 it is not, 1 failed, 2 usage or no sequence there.

Examples:
  tweenray status out/demo
  tweenray status 'out/frame_####.png' --frames 1..16
  until tweenray status out; do tweenray render scene.toml -o 'out/frame_####.png'; done")]
pub struct StatusArgs {
    /// The folder of one or more sequences, or a sequence's pattern with ####
    #[arg(value_name = "DIR")]
    sequence: String,
    /// Frames to ask about, counted from 1, both ends included: 7, 1..16, 5.. [default: all of the
    /// camera move]
    #[arg(long, value_name = "RANGE", value_parser = values::frames)]
    frames: Option<FrameRequest>,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(args: &StatusArgs) -> Result<Exit> {
    let range = |count| match args.frames {
        Some(request) => request.of_shot(count).map_err(Error::Usage),
        None => Ok(FrameRange { first: 1, last: count }),
    };
    let manifests = manifests(&args.sequence)?;
    let surveys = manifests.iter().map(|path| survey(path, range)).collect::<Result<Vec<_>>>()?;
    if args.json {
        say::json(&surveys)?;
    } else {
        surveys.iter().try_for_each(|survey| say::text(&words(survey)))?;
    }
    let complete = surveys.iter().all(|survey| survey.complete);
    Ok(if complete { Exit::Done } else { Exit::Incomplete })
}

/// The manifests that the argument names.
fn manifests(sequence: &str) -> Result<Vec<PathBuf>> {
    let path = Path::new(sequence);
    if !path.is_dir() {
        return of_pattern(sequence).map(|path| vec![path]);
    }
    let io = |e| Error::io("read the folder", path, e);
    let entries = fs::read_dir(path).map_err(io)?.collect::<std::io::Result<Vec<_>>>();
    let is_manifest = |name: &str| name.ends_with(".manifest.jsonl") && !name.starts_with('.');
    let mut found: Vec<PathBuf> = { entries.map_err(io)?.into_iter() }
        .filter(|entry| entry.file_name().to_str().is_some_and(is_manifest))
        .map(|entry| entry.path())
        .collect();
    found.sort();
    match found.is_empty() {
        true => Err(Error::Usage(format!("{sequence} holds no sequence: no *.manifest.jsonl"))),
        false => Ok(found),
    }
}

fn of_pattern(sequence: &str) -> Result<PathBuf> {
    let pattern = FramePattern::parse(sequence, 1).map_err(|why| match sequence.contains('#') {
        true => why,
        false if Path::new(sequence).exists() => {
            Error::Usage(format!("{sequence} is neither a folder nor a sequence: no # in it"))
        }
        false => Error::Usage(format!("there is no folder {sequence}")),
    })?;
    let path = manifest_path(&pattern);
    let none = || {
        let path = path.display();
        Error::Usage(format!("{sequence} is no sequence: there is no {path}"))
    };
    let found = manifest::Manifest::read(&path)?.ok_or_else(none)?;
    let (there, wanted) = (&found.header.files, manifest::file_name(&pattern));
    match *there == wanted {
        true => Ok(path),
        false => Err(Error::Usage(format!("{} is of {there}, not of {wanted}", path.display()))),
    }
}

/// A line for the whole, and one for each kind of frame that is not done.
fn words(survey: &Survey) -> String {
    let state = if survey.complete { "complete" } else { "not complete" };
    let of = counted(survey.total as usize, "frame");
    let mut lines = format!("{}: {state}, {} of {of} done\n", survey.frames, survey.done.len());
    for kind in not_done(survey) {
        lines += &format!("  {kind}\n");
    }
    lines
}

/// Words for each kind of frame that is not done: `2 missing: 3, 7`.
pub fn not_done(survey: &Survey) -> Vec<String> {
    let kinds = [
        ("missing", &survey.missing),
        ("damaged", &survey.damaged),
        ("of other settings", &survey.other_settings),
        ("of another camera move", &survey.other_move),
        ("beyond the end of the move", &survey.beyond),
    ];
    let there = kinds.into_iter().filter(|(_, frames)| !frames.is_empty());
    there.map(|(kind, frames)| format!("{} {kind}: {}", frames.len(), runs(frames))).collect()
}

/// `1..5, 9, 11..12`.
pub fn runs(frames: &[u32]) -> String {
    let runs = frames.chunk_by(|a, b| a + 1 == *b);
    let text = runs.map(|run| match run {
        [one] => one.to_string(),
        [first, .., last] => format!("{first}..{last}"),
        [] => String::new(),
    });
    text.collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::runs;

    #[test]
    fn frames_in_a_row_are_a_range() {
        assert_eq!(runs(&[1, 2, 3, 5, 7, 8]), "1..3, 5, 7..8");
        assert_eq!(runs(&[4]), "4");
        assert_eq!(runs(&[]), "");
    }
}
