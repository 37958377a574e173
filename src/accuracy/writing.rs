//! What putting frames and checkpoints on disk takes: time alone, no pixel differs by it.

use super::context::TrialContext;
use super::frames::Cut;
use crate::error::{Error, Result};
use crate::film::Film;
use crate::measure::{Interval, median};
use crate::output::manifest::{self, Header};
use crate::output::{FramePattern, WriteOptions, atomic, write_image};
use crate::reuse::{self, store::Compatibility};
use crate::scene::Policy;
use crate::sequence::checkpoint::{self, Checkpoints};
use crate::sequence::{FrameContext, FrameMaker, Pyramid, Recipes, SurfaceReuse, Target, Tracer};
use crate::shade::Renderer;
use serde::{Deserialize, Serialize};
use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

/// How often each thing is written.
const TIMES: usize = 15;
/// How often a key frame is made for its reference.
const KEY_TIMES: usize = 5;

/// What it takes to write a frame and a key frame's reference: median seconds, bytes, and how many of each the move has.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Writing {
    /// Wall seconds to encode, write and sync a frame as png.
    pub frame_seconds: f64,
    /// Ends of its interval.
    pub frame_ends: [f64; 2],
    /// By how much writing its bytes takes longer for being synced, at most all of the above.
    pub sync_seconds: f64,
    /// Ends of its interval; noise where it holds 0.
    pub sync_ends: [f64; 2],
    /// Size of the file.
    pub frame_bytes: u64,
    /// Wall seconds to encode, write and sync the reference of a key frame, and its bytes; `None`
    /// where no frame is inferred from others.
    pub checkpoint: Option<(f64, u64)>,
    /// Key frames of the move.
    pub keys: u32,
    /// Frames of the move.
    pub frames: u32,
}

/// Writes the first frame of the default, and what others need of it, into `folder`, several times.
///
/// # Errors
/// As rendering and writing a frame.
pub fn on_disk(context: &TrialContext, folder: &Path) -> Result<Writing> {
    let frames = context.shot.frames;
    let (film, checkpoint) = match context.base.reuse.policy {
        Policy::Surface => with_checkpoints(context, folder)?,
        _ => (traced(context)?, None),
    };
    let path = folder.join("writing_0001.png");
    let options = WriteOptions::of(context.base, Some(1));
    let write = || write_image(&path, &film, &options).map(drop);
    write()?;
    let bytes = fs::read(&path).map_err(|e| Error::io("read", &path, e))?;
    let synced = || atomic::write(&path, |w| w.write_all(&bytes)).map(drop);
    let plain = || fs::write(&path, &bytes).map_err(|e| Error::io("write", &path, e));
    let [written, synced, plain] = in_turns([&write, &synced, &plain])?;
    // Of the same turn, since a disk that is shared changes its speed.
    let sync: Vec<f64> = synced.iter().zip(&plain).map(|(synced, plain)| synced - plain).collect();
    let (frame, sync) = (interval(&written), interval(&sync));
    fs::remove_file(&path).map_err(|e| Error::io("remove", &path, e))?;
    let keys = Cut::of(context.base, frames, checkpoint.is_some()).keys();
    Ok(Writing {
        frame_seconds: frame.estimate,
        frame_ends: [frame.low, frame.high],
        sync_seconds: sync.estimate.clamp(0.0, frame.estimate),
        sync_ends: [sync.low, sync.high],
        frame_bytes: bytes.len() as u64,
        checkpoint,
        keys,
        frames,
    })
}

fn interval(seconds: &[f64]) -> Interval {
    const NOTHING: Interval = Interval { estimate: 0.0, low: 0.0, high: 0.0 };
    median(seconds).map_or(NOTHING, |median| median.interval)
}

/// Does the three `works` in rotation, [`TIMES`] times. Returns for each work the wall seconds of its runs.
fn in_turns(works: [&dyn Fn() -> Result<()>; 3]) -> Result<[Vec<f64>; 3]> {
    let mut seconds = [const { Vec::new() }; 3];
    for _ in 0..TIMES {
        for (work, seconds) in works.iter().zip(&mut seconds) {
            let start = Instant::now();
            work()?;
            seconds.push(start.elapsed().as_secs_f64());
        }
    }
    Ok(seconds)
}

fn frame_context<'a>(context: &TrialContext<'a>) -> FrameContext<'a> {
    let TrialContext { scene, base: settings, intersector, shot, pool, stop, .. } = *context;
    let renderer = Renderer::new(scene, settings, intersector);
    FrameContext { renderer, shot, pool, with_gbuffer: false, stop, progress: &() }
}

fn traced(context: &TrialContext) -> Result<Film> {
    Ok(Tracer::new(frame_context(context)).make(1)?.film)
}

/// The first frame, and what its reference takes: seconds, and bytes on disk.
fn with_checkpoints(context: &TrialContext, folder: &Path) -> Result<(Film, Option<(f64, u64)>)> {
    let TrialContext { scene, shot, base, .. } = *context;
    let channels = reuse::channels(scene, base);
    let terms = Compatibility::of("", &channels, base);
    let target = target(context, folder, !channels.is_empty())?;
    let checkpoints =
        Checkpoints::new(&target, Some(Duration::ZERO), &terms, scene.recentring, true);
    let pyramid = Pyramid { segment: base.reuse.segment, frames: shot.frames };
    let (mut seconds, mut bytes, mut film) = (Vec::new(), 0, None);
    for _ in 0..KEY_TIMES {
        let mut maker = SurfaceReuse::new(frame_context(context), pyramid)?;
        maker.checkpoints = Some(&checkpoints);
        let all: Vec<u32> = (1..=shot.frames).collect();
        maker.expect(&all);
        film = Some(maker.make(1)?.film);
        let cost = maker.save_cost();
        seconds.push(cost.seconds);
        bytes = cost.bytes;
    }
    checkpoint::clear(&target);
    let cost = median(&seconds).map(|m| (m.interval.estimate, bytes));
    Ok((film.ok_or(Error::Stopped)?, cost.filter(|_| bytes > 0)))
}

fn target(context: &TrialContext, folder: &Path, keeps_light: bool) -> Result<Target> {
    let name = folder.join("writing_####.png");
    let pattern = FramePattern::parse(&name.to_string_lossy(), context.shot.frames)?;
    let header = Header {
        manifest: manifest::FORMAT,
        tweenray: crate::output::VERSION.into(),
        scene: String::new(),
        scene_hash: String::new(),
        scene_parts: Default::default(),
        shot_hash: String::new(),
        shot_frames: context.shot.frames,
        files: manifest::file_name(&pattern),
        tracer: String::new(),
        command: Vec::new(),
        chosen: None,
        settings: Header::settings(context.base),
    };
    let recipes = Recipes::new(context.shot, context.base, keeps_light, false)?;
    let write = WriteOptions::of(context.base, None);
    Ok(Target { pattern, header, recipes, write, overwrite: false })
}
