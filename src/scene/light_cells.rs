//! Which of many lights matter where: a fixed tree of boxes over the scene, each with its lights by an upper bound of
//! what they can send there.
//!
//! Made once of a scene alone, so that the lights of a point are a function of its position. In each box
//! (*cell*) the lights are in three parts. Those that matter somewhere in the region around it are its *main* lights: they
//! are traced one by one. Those whose bounds together stay below a limit are culled. Samples choose among the others,
//! the *tail* (Shirley, Wang and Zimmerman, 1996), which leaves the mean as it is.
//!
//! Not done: bounds know neither shadows nor the normals of surfaces.

mod build;
mod count;

use crate::math::{Bounds3, DVec3, Rgb};
use serde::{Deserialize, Serialize};

/// Up to so many lights, all are looked at everywhere: the bytes of such scenes do not depend on this module.
pub(crate) const FEW_LIGHTS: usize = 8;
/// Most main lights of a cell.
pub(crate) const MOST_MAIN: usize = 16;

/// The lights of all places of a scene.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct LightCells {
    nodes: Vec<Node>,
    cells: Vec<Cell>,
    /// The lights of all cells, those of a cell in a row, the largest bound first.
    lights: Vec<CellLight>,
    /// The most main lights with an extent of any cell.
    most_area: usize,
    /// Colours whose sums are the light of any tail.
    tints: Vec<Rgb>,
    /// Means over the scene's surfaces.
    mean: MeanLights,
}

/// A box of the tree.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
enum Node {
    /// Cut in two across `axis`: the lower half is node `lower`, the upper half the one after it.
    Halves {
        axis: u8,
        at: f64,
        lower: u32,
    },
    Cell(u32),
}

/// A box that is not cut any further.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
struct Cell {
    /// Its first light in the list of all.
    first: u32,
    /// The number of lights that can send it anything.
    count: u32,
    /// The number of main lights, which come first.
    main: u32,
    /// Cells with the same main lights, but for culled ones, have the same number.
    tail_set: u32,
    /// What all of the lights send to the middle of the cell, at most: irradiance.
    typical: f64,
}

/// A light in a cell.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct CellLight {
    /// Its number among the scene's lights.
    pub light: u32,
    /// The bounds of this light and of all after it, summed: irradiance, infinite where a bound is.
    rest: f64,
    /// The weights of this light and of all after it, summed from the last on, so that a far larger bound rounds none
    /// of those after it away.
    weights: f64,
}

/// Mean numbers of lights at a point of the scene's surfaces.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct MeanLights {
    /// Main lights.
    pub main: f64,
    /// Main lights with an extent.
    pub area: f64,
    /// Lights of the tail.
    pub tail: f64,
    /// Tails: the share of the points that have one.
    pub tails: f64,
    /// Samples of the tail, over those of a main light.
    pub tail_samples: f64,
}

/// The lights of one cell.
#[derive(Debug, Clone, Copy)]
pub struct CellLights<'c> {
    lights: &'c [CellLight],
    main: usize,
    /// The weights of culled lights.
    culled: f64,
    typical: f64,
}

/// Lights that samples choose from.
#[derive(Debug, Clone, Copy)]
pub struct Tail<'c> {
    lights: &'c [CellLight],
    /// The weights of the lights after it.
    after: f64,
    typical: f64,
}

impl LightCells {
    /// Number of the cell of `p`. A point outside the scene belongs to a cell at its edge.
    pub fn cell(&self, p: DVec3) -> u32 {
        let mut node = 0;
        loop {
            match self.nodes[node as usize] {
                Node::Cell(cell) => return cell,
                Node::Halves { axis, at, lower } => {
                    node = lower + u32::from(p[usize::from(axis)] >= at);
                }
            }
        }
    }

    /// The lights of a cell but for those that together send an irradiance of at most `culled` to any of its
    /// points.
    pub fn lights(&self, cell: u32, culled: f64) -> CellLights<'_> {
        let Cell { first, count, main, tail_set: _, typical } = self.cells[cell as usize];
        let all = &self.lights[first as usize..][..count as usize];
        let (lights, culled) = all.split_at(all.partition_point(|light| light.rest > culled));
        let culled = culled.first().map_or(0.0, |light| light.weights);
        let main = (main as usize).min(lights.len());
        CellLights { lights, main, culled, typical }
    }

    /// Number of the set of lights in the tail of a cell: cells of one number have the same tail, but for culled lights.
    pub fn tail_set(&self, cell: u32) -> u32 {
        self.cells[cell as usize].tail_set
    }

    /// The most main lights with an extent of any cell.
    pub fn most_area(&self) -> usize {
        self.most_area
    }

    /// Colours whose sums are the light of any tail: one where all lights have the same colour, else the three
    /// primaries; none where no cell has a tail.
    pub fn tints(&self) -> &[Rgb] {
        &self.tints
    }

    /// Mean numbers of lights at a point of the scene's surfaces, of those that can send it anything.
    pub fn mean(&self) -> MeanLights {
        self.mean
    }

    /// Number of cells.
    pub fn len(&self) -> usize {
        self.cells.len()
    }

    /// Whether there are no cells: never.
    pub fn is_empty(&self) -> bool {
        self.cells.is_empty()
    }

    /// Memory, bytes.
    pub fn memory(&self) -> u64 {
        let Self { nodes, cells, lights, most_area: _, tints: _, mean: _ } = self;
        (size_of_val(&nodes[..]) + size_of_val(&cells[..]) + size_of_val(&lights[..])) as u64
    }
}

impl<'c> CellLights<'c> {
    /// Numbers of the main lights.
    pub fn main(&self) -> impl ExactSizeIterator<Item = u32> + 'c {
        self.lights[..self.main].iter().map(|light| light.light)
    }

    /// The others.
    pub fn tail(&self) -> Tail<'c> {
        Tail { lights: &self.lights[self.main..], after: self.culled, typical: self.typical }
    }
}

impl Tail<'_> {
    /// Whether it has no light.
    pub fn is_empty(&self) -> bool {
        self.lights.is_empty()
    }

    /// Number of lights.
    pub fn len(&self) -> usize {
        self.lights.len()
    }

    /// Numbers of the lights, the largest bound first.
    pub fn numbers(&self) -> impl ExactSizeIterator<Item = u32> + '_ {
        self.lights.iter().map(|light| light.light)
    }

    /// The tail from light number `first` on.
    pub fn after(&self, first: usize) -> Self {
        Self { lights: self.lights.get(first..).unwrap_or_default(), ..*self }
    }

    /// Number of samples of the tail where a main light has `samples`: as many where it sends a quarter of the
    /// cell's light, from a quarter to four times as many.
    pub fn samples(&self, samples: u32) -> u32 {
        (f64::from(samples) * self.samples_share()).ceil().max(1.0) as u32
    }

    fn samples_share(&self) -> f64 {
        let share = (4.0 * self.total() / self.typical).clamp(0.25, 4.0);
        // Of no number too.
        if share.is_nan() { 4.0 } else { share }
    }

    /// The largest number of [`samples`](Self::samples) of any tail.
    pub fn most_samples(samples: u32) -> u32 {
        samples.saturating_mul(4).max(1)
    }

    /// The light at `u` in [0, 1), and the probability with which it is chosen.
    pub fn choose(&self, u: f64) -> (u32, f64) {
        let at = self.first() - u * self.total();
        // The last light has all that is left.
        let others = &self.lights[1..];
        let k = match self.is_even() {
            true => (u * self.lights.len() as f64) as usize,
            false => others.partition_point(|light| light.weights >= at),
        };
        // At the end of the range u may be rounded to what is culled.
        let can_be_chosen = |k: &usize| self.probability(*k) > 0.0;
        let k = (0..=k.min(others.len())).rev().find(can_be_chosen).unwrap_or(0);
        (self.lights[k].light, self.probability(k))
    }

    /// The probability with which the light of this number is chosen; 0 of any other.
    pub fn probability_of(&self, light: u32) -> f64 {
        let k = self.lights.iter().position(|other| other.light == light);
        k.map_or(0.0, |k| self.probability(k))
    }

    fn probability(&self, k: usize) -> f64 {
        if self.is_even() {
            return 1.0 / self.lights.len() as f64;
        }
        let after = self.lights.get(k + 1).map_or(self.after, |light| light.weights);
        (self.lights[k].weights - after) / self.total()
    }

    /// Whether the weights tell nothing, since those of culled lights are too large beside them.
    fn is_even(&self) -> bool {
        self.total() <= f64::EPSILON * self.after
    }

    /// What all of the lights send at most: the sum of their weights.
    pub fn total(&self) -> f64 {
        self.first() - self.after
    }

    fn first(&self) -> f64 {
        self.lights.first().map_or(self.after, |light| light.weights)
    }
}

/// The box that the tree divides: a little larger than that of the surfaces, for what is rounded.
fn root(bounds: &Bounds3) -> Bounds3 {
    let margin = DVec3::splat(1e-6 * bounds.radius());
    Bounds3 { min: bounds.min - margin, max: bounds.max + margin }
}
