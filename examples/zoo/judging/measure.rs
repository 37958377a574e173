//! Figures of frames and scenes.

use super::audit::AuditCheck;
use super::contract::{DEVIATIONS, FLOOR, TRACES, Tile, mean};
use super::equal_rays::EqualRays;
use super::frame::Picture;
use super::job::Spent;
use serde_json::Value;

/// A pixel that is off by more than this in some channel is counted, display steps.
const FAR_OFF: f32 = 16.0;

/// The pictures of one judged frame.
pub struct Pictures {
    pub frame: usize,
    pub inferred: Picture,
    pub traced: Picture,
    pub truth: Picture,
    again: [Picture; TRACES - 1],
    /// MSE of the truth itself.
    truth_noise: f64,
}

impl Pictures {
    /// The pictures of frame `frame`; `truths` are two.
    pub fn new(
        frame: usize,
        [inferred, traced]: [Picture; 2],
        again: [Picture; TRACES - 1],
        truths: &[Picture; 2],
    ) -> Self {
        let truth_noise = mean(truths[0].squares(&truths[1]).into_iter()) / 4.0;
        Self { frame, inferred, traced, truth: Picture::mean(truths), again, truth_noise }
    }
}

/// What is known of one in-between frame.
pub struct FrameFigures {
    pub frame: usize,
    /// RMSE of the frame, and the mean one of independent traces of it.
    pub inferred: f64,
    pub traced: f64,
    /// That of the trace with the frame's own random numbers, which has what is not inferred in common.
    pub own_trace: f64,
    /// Share of pixels far off, inferred and traced.
    pub far_off: [f64; 2],
    pub tiles: Vec<Tile>,
    /// MSE of the truth itself.
    pub truth_noise: f64,
}

impl FrameFigures {
    fn new(p: &Pictures) -> Self {
        let inferred = p.inferred.squares(&p.truth);
        let [a, b, c] = &p.again;
        let traces = [&p.traced, a, b, c].map(|trace| trace.squares(&p.truth));
        let rms = |squares: &[f64]| mean(squares.iter().copied()).sqrt();
        let mean_trace = mean(traces.iter().map(|t| mean(t.iter().copied())));
        Self {
            frame: p.frame,
            inferred: rms(&inferred),
            traced: mean_trace.sqrt(),
            own_trace: rms(&traces[0]),
            far_off: [&p.inferred, &p.traced].map(|shown| far_off(shown, &p.truth)),
            tiles: Tile::all(&p.inferred, &inferred, &traces),
            truth_noise: p.truth_noise,
        }
    }

    /// How much nearer to the truth than tracing, decibels.
    pub fn db(&self) -> f64 {
        nearer(self.inferred, self.traced)
    }

    /// Whether it is worse than traced by more than 0.3 dB, and an error of its own could be seen. A frame
    /// whose own trace is as far off is so by chance.
    pub fn is_visibly_worse(&self) -> bool {
        let by_own = nearer(self.inferred, self.own_trace);
        self.db().max(by_own) < -0.3 && self.inferred > FLOOR
    }

    pub fn keeps_strictly(&self) -> bool {
        self.tiles.iter().all(Tile::keeps_strictly)
    }

    pub fn keeps(&self) -> bool {
        self.tiles.iter().all(Tile::keeps)
    }

    /// By how many deviations each of the traces exceeds what the others predict, in its worst tile.
    pub fn chance(&self) -> [f64; TRACES] {
        std::array::from_fn(|k| self.tiles.iter().map(|t| t.chance[k]).fold(0.0, f64::max))
    }

    /// How many of the traces break the bound that the others give.
    pub fn chance_breaks(&self) -> usize {
        self.chance().iter().filter(|deviations| **deviations > DEVIATIONS).count()
    }

    /// The tile that exceeds the contract most, or comes nearest to it.
    pub fn worst_tile(&self) -> Option<&Tile> {
        self.tiles.iter().max_by(|a, b| a.excess().total_cmp(&b.excess()))
    }
}

/// By how many decibels the RMSE `inferred` is below `traced`.
fn nearer(inferred: f64, traced: f64) -> f64 {
    // Both may be 0: a frame of nothing but sky.
    let tiny = 1e-6;
    20.0 * ((traced + tiny) / (inferred + tiny)).log10()
}

fn far_off(shown: &Picture, truth: &Picture) -> f64 {
    let is_far = |(a, b): (&[f32; 3], &[f32; 3])| (0..3).any(|k| (a[k] - b[k]).abs() > FAR_OFF);
    mean(shown.steps.iter().zip(&truth.steps).map(|pair| f64::from(u8::from(is_far(pair)))))
}

/// What is known of one scene.
pub struct Verdict {
    /// The judged in-between frames.
    pub frames: Vec<FrameFigures>,
    /// RMSE of the change from frame to frame against the truth's, inferred and traced; none
    /// without neighbours.
    pub flicker: Option<[f64; 2]>,
    /// Share of the points of in-between frames inferred, seen directly and in mirrors or glass.
    pub inferred_share: [Option<f64>; 2],
    pub audit: Option<AuditCheck>,
    /// The comparison with uniform samples, where camera samples are a range.
    pub equal_rays: Option<EqualRays>,
    /// The jobs that infer and that trace.
    pub jobs: [Spent; 2],
    pub pictures: Vec<Pictures>,
}

/// How many times faster than tracing, by CPU seconds of the jobs that infer and that trace.
pub fn speed(jobs: &[Spent; 2]) -> f64 {
    // It is told in hundredths of a second.
    let [surface, off] = jobs.each_ref().map(|job| job.cpu + 0.005);
    off / surface
}

impl Verdict {
    /// Judges the pictures of a move of `last` frames.
    pub fn new(pictures: Vec<Pictures>, last: usize, jobs: [Spent; 2]) -> Self {
        let between = |p: &&Pictures| p.frame != 1 && p.frame != last;
        let frames: Vec<FrameFigures> =
            pictures.iter().filter(between).map(FrameFigures::new).collect();
        Self {
            flicker: flicker(&pictures),
            inferred_share: ["direct", "specular"].map(|kind| share(&jobs[0].stats, kind, last)),
            audit: AuditCheck::new(&jobs[0].stats, &frames, last),
            equal_rays: None,
            frames,
            jobs,
            pictures,
        }
    }

    /// The frame and tile that exceed the contract most.
    pub fn worst_tile(&self) -> Option<(usize, &Tile)> {
        let of = |f: &FrameFigures| f.frame;
        self.frames
            .iter()
            .filter_map(|f| Some((of(f), f.worst_tile()?)))
            .max_by(|(_, a), (_, b)| a.excess().total_cmp(&b.excess()))
    }

    /// How many times faster than tracing, by CPU seconds of whole jobs.
    pub fn speed(&self) -> f64 {
        speed(&self.jobs)
    }

    /// Flicker of inferred frames over that of traced ones; 1 where neither has any to be seen.
    pub fn flicker_ratio(&self) -> Option<f64> {
        let [inferred, traced] = self.flicker?;
        let is_seen = inferred.max(traced) > FLOOR;
        Some(if is_seen { inferred / traced.max(1e-6) } else { 1.0 })
    }
}

/// Share of the points of this kind inferred in the in-between frames of a move of `last`.
fn share(stats: &Value, kind: &str, last: usize) -> Option<f64> {
    let frames = stats["frames"].as_array()?;
    let between = |f: &&Value| f["frame"] != 1 && f["frame"] != last;
    let sum = |name: &str| -> f64 {
        frames.iter().filter(between).filter_map(|f| f["reuse"][name].as_f64()).sum()
    };
    let all = sum(kind);
    (all > 0.0).then(|| sum(&format!("{kind}_inferred")) / all)
}

/// Over all pairs of neighbours.
fn flicker(pictures: &[Pictures]) -> Option<[f64; 2]> {
    let pairs: Vec<_> = pictures.windows(2).filter(|p| p[1].frame == p[0].frame + 1).collect();
    if pairs.is_empty() {
        return None;
    }
    let of = |which: fn(&Pictures) -> &Picture| {
        let squares = pairs.iter().flat_map(|pair| {
            let truth = pair[1].truth.change(&pair[0].truth);
            which(&pair[1]).change(which(&pair[0])).squares(&truth)
        });
        mean(squares).sqrt()
    };
    Some([of(|p| &p.inferred), of(|p| &p.traced)])
}
