//! Renders a scene as a user would, inferred and traced, and judges both by a converged trace.
//!
//! Four kinds of render, all of the same camera samples, since these depend on the seed and the
//! pixel alone, and light samples on the frame's number besides:
//!
//! * inferred: `--policy surface`, all frames;
//! * traced: `--policy off`, all frames;
//! * again, three times: traced as frames of other numbers, hence with other light samples. They tell
//!   how far traces are apart by chance;
//! * truth, twice: the same with 8 times the shadow and sky samples each. Their mean is the truth, with
//!   16 times the samples and independent of all that is judged by it, and their difference is its
//!   own noise.
//!
//! With a range of camera samples the frames have different numbers of these, so errors of edges count. Then all but
//! the first two have seeds, and camera samples, of their own, and the truth has four times the most camera samples of a
//! pixel instead of more light samples. Uniform samples are rendered as well ([`EqualRays`]).
//!
//! All errors are in display steps of 1/255, not rounded.

mod audit;
mod contract;
mod equal_rays;
mod frame;
mod job;
mod measure;

pub use contract::{FLOOR, Tile};
pub use equal_rays::EqualRays;
pub use frame::{Picture, SIDE};
pub use job::{Program, Spent};
pub use measure::{FrameFigures, Pictures, Verdict};

use crate::making::{Settings, Subject};
use job::Render;
use measure::speed;
use std::collections::BTreeSet;
use std::path::Path;

/// What goes wrong with a render.
pub type Failure = Box<dyn std::error::Error>;

/// Light samples of each half of the truth over those of a traced frame.
const TRUER: usize = 8;
/// Camera samples of each half of the truth over the most of a pixel, where these are a range.
const TRUER_CAMERA: usize = 4;
/// How often a move is timed, inferred and traced in turn; the turn of median speed counts.
const TURNS: usize = 3;

/// How scenes are rendered.
#[derive(Clone, Copy)]
pub struct Plan {
    /// Pixels.
    pub size: [u32; 2],
    /// Frames judged at most.
    pub judged: usize,
    /// Whether key frames, which are traced in any case, are left out: flicker then is of in-between
    /// frames alone.
    pub between_only: bool,
    /// Whether the move is rendered again, both ways, to png files, to be timed: packing an exr frame takes
    /// longer.
    pub timed: bool,
}

/// Renders and judges one scene in `folder`, which it makes and empties of frames again.
///
/// # Errors
/// Where a render fails or its files cannot be read.
pub fn judge(
    program: &Program,
    subject: &dyn Subject,
    settings: Settings,
    plan: &Plan,
    folder: &Path,
) -> Result<Verdict, Failure> {
    let frames = subject.frames();
    subject.write_frames(folder, "move.toml", &Vec::from_iter(1..=frames), 1)?;
    let judged = choose(frames, plan);
    let run = |render: Render| program.render(folder, &render, subject, settings, plan.size);
    let inferred = run(Render::of_move("inferred", "surface"))?;
    let traced = run(Render::of_move("traced", "off"))?;
    // Numbers that no frame of the move has, nor another render.
    let first = |k: usize| 1000 * (k + 1);
    let other = |k: usize, name: &str, factor: usize| -> Result<Spent, Failure> {
        subject.write_frames(folder, &format!("{name}.toml"), &judged, first(k))?;
        let render = |factor| Render::of_others(name, [first(k), judged.len()], factor);
        run(match settings.most {
            None => render(factor),
            Some(_) if factor == 1 => render(1).with_seed(first(k)),
            Some(most) => render(1).with_seed(first(k)).with_camera_samples(TRUER_CAMERA * most),
        })
    };
    let others = [
        other(0, "again1", 1)?,
        other(1, "again2", 1)?,
        other(2, "again3", 1)?,
        other(3, "truth1", TRUER)?,
        other(4, "truth2", TRUER)?,
    ];
    let mut pictures = Vec::new();
    for (i, frame) in judged.iter().enumerate() {
        let of = |job: &Spent, k: usize| job.frame(first(k) + i);
        let [a, b, c, d, e] = &others;
        pictures.push(Pictures::new(
            *frame,
            [inferred.frame(*frame)?, traced.frame(*frame)?],
            [of(a, 0)?, of(b, 1)?, of(c, 2)?],
            &[of(d, 3)?, of(e, 4)?],
        ));
    }
    let equal_rays = match settings.most {
        None => None,
        Some(most) => {
            let move_of =
                |policy, spp| run(Render::of_move("uniform", policy).with_camera_samples(spp));
            let between: Vec<&Pictures> =
                pictures.iter().filter(|p| p.frame != 1 && p.frame != frames).collect();
            Some(EqualRays::new([&inferred, &traced], &between, [settings.spp, most], move_of)?)
        }
    };
    for job in others.iter().chain([&inferred, &traced]) {
        job.remove_frames()?;
    }
    let mut jobs = [inferred, traced];
    if plan.timed {
        let timed = |name: &str, policy| -> Result<Spent, Failure> {
            let job = run(Render::of_move(name, policy).into_png())?;
            job.remove_frames()?;
            Ok(job)
        };
        let mut turns = Vec::new();
        for _ in 0..TURNS {
            turns.push([timed("timed-inferred", "surface")?, timed("timed-traced", "off")?]);
        }
        turns.sort_by(|a, b| speed(a).total_cmp(&speed(b)));
        for (job, timed) in jobs.iter_mut().zip(turns.swap_remove(TURNS / 2)) {
            (job.wall, job.cpu) = (timed.wall, timed.cpu);
        }
    }
    let verdict = Verdict::new(pictures, frames, jobs);
    // The audit's truth has the frame's own camera samples, so it knows nothing of their error.
    let audit = verdict.audit.filter(|_| settings.most.is_none());
    Ok(Verdict { equal_rays, audit, ..verdict })
}

/// Numbers of the frames that are judged: all of a short move; of a long one in-between frames in
/// pairs of neighbours, since flicker is between neighbours, evenly spread.
fn choose(frames: usize, plan: &Plan) -> Vec<usize> {
    if frames <= plan.judged {
        let all = 1..=frames;
        return all.filter(|f| !plan.between_only || (*f != 1 && *f != frames)).collect();
    }
    let pairs = (plan.judged / 2).max(1);
    let first = |k: usize| 2 + (frames - 3) * (2 * k + 1) / (2 * pairs);
    let frames: BTreeSet<usize> = (0..pairs).flat_map(|k| [first(k), first(k) + 1]).collect();
    frames.into_iter().collect()
}
