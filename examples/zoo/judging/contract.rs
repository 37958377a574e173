//! The contract: no tile of an inferred frame is further from the truth than if it were traced.
//!
//! *Strictly*: in every tile the RMSE is at most that of the traced frame, or [`FLOOR`], which no
//! display shows. An independent trace of the frame breaks that in nearly every frame, since of many
//! tiles some come out worse by chance.
//!
//! *With an allowance for chance*: a tile may be as bad as an independent trace of it hardly ever is.
//! Squared errors of pixels are independent, as their random numbers are, so the variance of a tile's
//! MSE is that of its pixels over the square of their number. Each pixel's is estimated from K
//! independent traces. A further trace lies above their mean m with the variance v (1 + 1/K), where v
//! is the tile's. The bound is
//!
//! max(m, [`FLOOR`]²) + [`DEVIATIONS`] √(v (1 + 1/K))
//!
//! Squared errors have long tails (one pixel at a shadow's rim is much of a tile), so
//! [`DEVIATIONS`] is not taken from the normal distribution but measured: each trace is held against
//! the bound that the others give, and one frame in a hundred may break it. Of 608 traces of 160 x 96
//! pixels, 15 tiles, most with 1 camera and 16 light samples, 46 exceeded 3 deviations somewhere, 11
//! exceeded 4, 4 exceeded 5, 3 exceeded 8. The zoo prints how many did. There the bound comes from K - 1
//! traces, which makes it looser in the mean but less sure, so inferred frames break theirs by chance at
//! most as often. A larger frame has more tiles, hence breaks it more often.

use super::frame::Picture;

/// RMSE that counts as none, display steps.
pub const FLOOR: f64 = 0.25;
/// Standard deviations that chance is allowed: about one trace in a hundred goes beyond.
pub const DEVIATIONS: f64 = 5.0;

/// Independent traces of a frame, the traced one among them.
pub const TRACES: usize = 4;

/// Errors of one tile, each a mean over its pixels of squared display steps.
#[derive(Debug, Clone, Copy)]
pub struct Tile {
    /// Column and row, in tiles.
    pub place: [usize; 2],
    pub inferred: f64,
    /// Of the traced frame of the same number.
    pub traced: f64,
    /// What an independent trace hardly ever exceeds.
    pub bound: f64,
    /// By how many of its deviations each trace exceeds what the others predict.
    pub chance: [f64; TRACES],
}

impl Tile {
    /// All tiles of a frame: of what is judged, and of independent traces of which the first is the
    /// traced frame; each pixel's squared error.
    pub fn all(picture: &Picture, inferred: &[f64], traces: &[Vec<f64>; TRACES]) -> Vec<Self> {
        let of = |(place, pixels): ([usize; 2], Vec<usize>)| {
            let mean = |squares: &[f64]| mean(pixels.iter().map(|p| squares[*p]));
            let all = traces.each_ref().map(Vec::as_slice);
            let chance = std::array::from_fn(|k| {
                let others: Vec<&[f64]> = (0..TRACES).filter(|i| *i != k).map(|i| all[i]).collect();
                Expected::new(&pixels, &others).deviations(mean(all[k]))
            });
            Self {
                place,
                inferred: mean(inferred),
                traced: mean(all[0]),
                bound: Expected::new(&pixels, &all).bound(),
                chance,
            }
        };
        picture.tiles().map(of).collect()
    }

    /// Whether it is no worse than traced.
    pub fn keeps_strictly(&self) -> bool {
        self.inferred <= self.traced.max(FLOOR * FLOOR)
    }

    /// Whether it is no worse than a trace could be.
    pub fn keeps(&self) -> bool {
        self.keeps_strictly() || self.inferred <= self.bound
    }

    /// By how much its MSE is more than the contract allows.
    pub fn excess(&self) -> f64 {
        self.inferred - self.traced.max(FLOOR * FLOOR)
    }
}

/// What is to be expected of a further trace of some pixels.
struct Expected {
    /// MSE, the floor at least.
    mse: f64,
    deviation: f64,
}

impl Expected {
    fn new(pixels: &[usize], traces: &[&[f64]]) -> Self {
        let k = traces.len() as f64;
        let n = pixels.len() as f64;
        let (mut sum, mut variance) = (0.0, 0.0);
        for p in pixels {
            let m = mean(traces.iter().map(|t| t[*p]));
            sum += m;
            variance += traces.iter().map(|t| (t[*p] - m).powi(2)).sum::<f64>() / (k - 1.0);
        }
        let deviation = (variance * (1.0 + 1.0 / k)).sqrt() / n;
        Self { mse: (sum / n).max(FLOOR * FLOOR), deviation }
    }

    /// What it hardly ever exceeds.
    fn bound(&self) -> f64 {
        self.mse + DEVIATIONS * self.deviation
    }

    /// By how many deviations this MSE lies above.
    fn deviations(&self, mse: f64) -> f64 {
        // No deviation at all: all of the tile is sky.
        if mse <= self.mse { 0.0 } else { (mse - self.mse) / self.deviation.max(1e-12) }
    }
}

/// The mean of numbers, of which there is one at least.
pub fn mean(numbers: impl Iterator<Item = f64>) -> f64 {
    let (count, sum) = numbers.fold((0.0, 0.0), |(n, s), x| (n + 1.0, s + x));
    sum / f64::max(count, 1.0)
}
