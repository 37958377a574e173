//! Figures of frames and scenes.

use super::audit::AuditCheck;
use super::contract::{FLOOR, Tile, mean};
use super::frame::Picture;
use super::job::Spent;

/// A pixel that is off by more than this in some channel is counted, display steps.
const FAR_OFF: f32 = 16.0;

/// The pictures of one judged frame.
pub struct Pictures {
    pub frame: usize,
    pub inferred: Picture,
    pub traced: Picture,
    pub truth: Picture,
    again: Vec<Picture>,
    /// MSE of the truth itself.
    truth_noise: f64,
}

impl Pictures {
    /// The pictures of frame `frame`; `truths` are two.
    pub fn new(
        frame: usize,
        [inferred, traced]: [Picture; 2],
        again: Vec<Picture>,
        truths: &[Picture],
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
    /// Share of pixels far off, inferred and traced.
    pub far_off: [f64; 2],
    pub tiles: Vec<Tile>,
    /// MSE of the truth itself.
    pub truth_noise: f64,
}

impl FrameFigures {
    fn new(p: &Pictures) -> Self {
        let inferred = p.inferred.squares(&p.truth);
        let traces: Vec<Vec<f64>> =
            [&p.traced].into_iter().chain(&p.again).map(|t| t.squares(&p.truth)).collect();
        let rms = |squares: &[f64]| mean(squares.iter().copied()).sqrt();
        let mean_trace = mean(traces.iter().map(|t| mean(t.iter().copied())));
        Self {
            frame: p.frame,
            inferred: rms(&inferred),
            traced: mean_trace.sqrt(),
            far_off: [&p.inferred, &p.traced].map(|shown| far_off(shown, &p.truth)),
            tiles: Tile::all(&p.inferred, &inferred, &traces),
            truth_noise: p.truth_noise,
        }
    }

    /// How much nearer to the truth than tracing, decibels.
    pub fn db(&self) -> f64 {
        // Both may be 0: a frame of nothing but sky.
        let tiny = 1e-6;
        20.0 * ((self.traced + tiny) / (self.inferred + tiny)).log10()
    }

    /// Whether it is worse than traced by more than 0.3 dB, and an error of its own could be seen.
    pub fn is_visibly_worse(&self) -> bool {
        self.db() < -0.3 && self.inferred > FLOOR
    }

    pub fn keeps_strictly(&self) -> bool {
        self.tiles.iter().all(Tile::keeps_strictly)
    }

    pub fn keeps(&self) -> bool {
        self.tiles.iter().all(Tile::keeps)
    }

    /// Whether a trace broke the bound for chance.
    pub fn chance(&self) -> bool {
        self.tiles.iter().any(|tile| tile.chance)
    }

    /// The tile that exceeds the contract most, or comes nearest to it.
    pub fn worst_tile(&self) -> Option<&Tile> {
        self.tiles.iter().max_by(|a, b| a.excess().total_cmp(&b.excess()))
    }
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
    /// Share of points inferred, seen directly and in mirrors or glass.
    pub inferred_share: [Option<f64>; 2],
    pub audit: Option<AuditCheck>,
    pub surface: Spent,
    pub off: Spent,
    pub pictures: Vec<Pictures>,
}

impl Verdict {
    /// Judges the pictures of a move of `last` frames.
    pub fn new(pictures: Vec<Pictures>, last: usize, surface: Spent, off: Spent) -> Self {
        let between = |p: &&Pictures| p.frame != 1 && p.frame != last;
        let frames: Vec<FrameFigures> =
            pictures.iter().filter(between).map(FrameFigures::new).collect();
        let share = |all: &str, inferred: &str| {
            let reuse = &surface.stats["reuse"];
            let all = reuse[all].as_f64().filter(|n| *n > 0.0)?;
            Some(reuse[inferred].as_f64()? / all)
        };
        Self {
            flicker: flicker(&pictures),
            inferred_share: [
                share("direct", "direct_inferred"),
                share("specular", "specular_inferred"),
            ],
            audit: AuditCheck::new(&surface.stats, &frames, last),
            frames,
            surface,
            off,
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
        (self.off.cpu + 0.005) / (self.surface.cpu + 0.005)
    }

    /// Flicker of inferred frames over that of traced ones; 1 where neither has any to be seen.
    pub fn flicker_ratio(&self) -> Option<f64> {
        let [inferred, traced] = self.flicker?;
        let is_seen = inferred.max(traced) > FLOOR;
        Some(if is_seen { inferred / traced.max(1e-6) } else { 1.0 })
    }
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
