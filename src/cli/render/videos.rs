//! The videos of a job whose frames are all there.
//!
//! A job of some frames makes the video of these. If they complete the shot, it also makes the video of the whole
//! shot: several jobs may have shared its frames, and any may be the last.

use super::round::{RenderJob, Round};
use crate::cli::request::Request;
use crate::error::Result;
use crate::output::manifest::{Manifest, beside, manifest_path};
use crate::output::video::{self, Clip, Video};
use crate::scene::FrameRange;
use crate::sequence::survey::survey_of;

/// Ending of the video of the whole shot. A video of some frames has their numbers in its name, so it does not
/// replace this one.
const WHOLE: &str = ".mp4";

/// Makes the videos; returns the lines to print.
pub(super) fn make(job: &RenderJob, round: &Round) -> Result<Vec<String>> {
    let Request { frames, shot, pattern, .. } = job.request;
    let whole = FrameRange { first: 1, last: shot.frames };
    let is_whole = frames.first == whole.first && frames.last == whole.last;
    let mut lines = Vec::new();
    if !is_whole && frames.first < frames.last {
        let ending = format!("_{}-{}{WHOLE}", frames.first, frames.last);
        lines.push(of(job, *frames, &ending)?);
    }
    // The shot's video is made once: by the job that brought the last frame, or where there is none.
    let is_due = is_whole || !round.plan.render.is_empty() || !beside(pattern, WHOLE).exists();
    if shot.frames > 1 && is_due && (is_whole || is_complete(job)?) {
        lines.push(of(job, whole, WHOLE)?);
    }
    Ok(lines)
}

/// Whether every frame of the shot is finished, by the manifest as it is now.
fn is_complete(job: &RenderJob) -> Result<bool> {
    let path = manifest_path(&job.target.pattern);
    let Some(manifest) = Manifest::as_of_now(&path)? else { return Ok(false) };
    // Before files are read: most jobs of a few frames are not the last.
    let has = |frame| manifest.rows.get(&frame).is_some_and(|row| row.stray.is_none());
    if !(1..=job.request.shot.frames).all(has) {
        return Ok(false);
    }
    let all = |count| Ok(FrameRange { first: 1, last: count });
    let is_this_shot = manifest.header.shot_hash == job.target.header.shot_hash;
    Ok(is_this_shot && survey_of(&manifest, &path, all)?.complete)
}

fn of(job: &RenderJob, frames: FrameRange, ending: &str) -> Result<String> {
    let pattern = &job.request.pattern;
    let clip = Clip {
        pattern,
        first: frames.first,
        count: frames.last - frames.first + 1,
        fps: job.request.options.fps,
        display: job.target.write.display,
    };
    let (out, stop) = (beside(pattern, ending), &job.site.interrupt.stop);
    Ok(match job.site.interrupt.watched(|| video::make(&clip, &out, stop))? {
        Video::Made(path) => format!("video {}", path.display()),
        Video::NoFfmpeg { command } => {
            format!(
                "no video, since ffmpeg is not installed; where it is, this makes one:\n{command}"
            )
        }
        Video::Failed { stderr } => format!("no video, since ffmpeg failed:\n{stderr}"),
    })
}
