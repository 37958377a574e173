//! The tree of cells, made of a scene: the cell with the loosest bounds, and the largest, is cut next.

use super::{Cell, CellLight, FEW_LIGHTS, LightCells, MOST_MAIN, MeanLights, Node, root};
use crate::math::{Bounds3, DVec3, Rgb};
use crate::scene::{Light, PRIMARIES, Scene};
use rayon::prelude::*;
use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};
use std::sync::Arc;

/// Most cells.
const MOST_CELLS: usize = 1 << 14;
/// Most bounds that are computed, and lights of all cells.
const MOST_BOUNDS: usize = 1 << 21;
/// A cell whose bounds sum up to less than this times what arrives in its middle is not cut.
const TIGHT: f64 = 1.25;
/// Looser bounds than this count as this loose.
const LOOSEST: f64 = 16.0;
/// Smallest diagonal of a cell that is cut, in diagonals of the scene.
const SMALLEST: f64 = 1.0 / 1024.0;
/// Regions for each light of the scene. All cells in a region have the same main lights.
const REGIONS: usize = 2;
/// A light is a main one in a region where it sends this share of what arrives at any of the places that are looked at.
const SHARE: f64 = 0.1;
/// Places in a region that are looked at, along each axis.
const ACROSS: u32 = 3;

/// Lights have one colour where the shares of each primary differ by no more than this part of the larger share.
const SAME_COLOUR: f32 = 1e-3;

/// A light may send this many times as much next to it, in or beside a box, as to the middle and the corners of the box:
/// samples choose it no more often for more.
const NEAR: f64 = 64.0;

/// A box whose lights are known.
struct Open {
    bounds: Bounds3,
    node: usize,
    lights: Vec<BoundedLight>,
    /// Numbers of the main lights, those of the region that the box lies in.
    main: Arc<[u32]>,
    /// What all lights send to the middle, at most.
    typical: f64,
}

/// A light with the bound of what it sends to a box, more than 0.
#[derive(Clone, Copy)]
struct BoundedLight {
    light: u32,
    bound: f64,
    /// In proportion to it samples choose the light, more than 0 and finite: the bound, where that is not far above
    /// what arrives in most of the box.
    weight: f64,
}

impl LightCells {
    /// The cells of `scene`; `None` where it has few lights.
    pub(in crate::scene) fn of(scene: &Scene) -> Option<Self> {
        if scene.lights.len() <= FEW_LIGHTS {
            return None;
        }
        let mut cells = Self {
            nodes: vec![Node::Cell(0)],
            cells: Vec::new(),
            lights: Vec::new(),
            most_area: 0,
            tints: Vec::new(),
            mean: MeanLights::default(),
        };
        let mut sets = BTreeMap::new();
        for open in cells.divide(&scene.lights, root(&scene.bounds)) {
            let mut main = open.main.to_vec();
            main.sort_unstable();
            let next = sets.len() as u32;
            let tail_set = *sets.entry(main).or_insert(next);
            cells.close(open, tail_set, &scene.lights);
        }
        if cells.cells.iter().any(|cell| cell.count > cell.main) {
            cells.tints = tints(&scene.lights);
        }
        cells.mean = cells.count(scene);
        Some(cells)
    }

    /// Makes the nodes of the tree; returns its leaves.
    fn divide(&mut self, lights: &[Light], root: Bounds3) -> Vec<Open> {
        let smallest = SMALLEST * root.radius();
        let all: Vec<u32> = (0..lights.len() as u32).collect();
        let regions = REGIONS * lights.len();
        let mut open = vec![Open::new(root, 0, &all, lights)];
        let mut queue = BinaryHeap::new();
        queue.extend(open[0].gain(smallest).map(|gain| (gain, Reverse(0))));
        let mut bounds = all.len();
        let mut has_main = false;
        while let Some((_, Reverse(at))) = queue.pop() {
            if !has_main && open.len() >= regions {
                open.par_iter_mut().for_each(|open| open.choose_main(lights));
                has_main = true;
            }
            let next: usize = open[at].lights.len();
            if open.len() >= MOST_CELLS || bounds + 4 * next > MOST_BOUNDS {
                break;
            }
            bounds += 4 * next;
            let [lower, upper] = self.halves(&open[at], lights);
            open[at] = lower;
            open.push(upper);
            for at in [at, open.len() - 1] {
                queue.extend(open[at].gain(smallest).map(|gain| (gain, Reverse(at))));
            }
        }
        if !has_main {
            open.par_iter_mut().for_each(|open| open.choose_main(lights));
        }
        open
    }

    fn halves(&mut self, whole: &Open, lights: &[Light]) -> [Open; 2] {
        let Bounds3 { min, max } = whole.bounds;
        let extent = whole.bounds.extent();
        let axis =
            (0..3).fold(0, |most, axis| if extent[axis] > extent[most] { axis } else { most });
        let at = 0.5 * min[axis] + 0.5 * max[axis];
        let node = self.nodes.len();
        self.nodes[whole.node] = Node::Halves { axis: axis as u8, at, lower: node as u32 };
        self.nodes.extend([Node::Cell(0); 2]);
        let known: Vec<u32> = whole.lights.iter().map(|light| light.light).collect();
        let with = |mut corner: DVec3| {
            corner[axis] = at;
            corner
        };
        let lower = Bounds3 { min, max: with(max) };
        let upper = Bounds3 { min: with(min), max };
        [(lower, node), (upper, node + 1)].map(|(bounds, node)| Open {
            main: whole.main.clone(),
            ..Open::new(bounds, node, &known, lights)
        })
    }

    /// Makes a cell of a leaf.
    fn close(&mut self, open: Open, tail_set: u32, lights: &[Light]) {
        let Open { bounds: _, node, lights: mut own, main, typical } = open;
        self.nodes[node] = Node::Cell(self.cells.len() as u32);
        let is_main = |own: &BoundedLight| main.contains(&own.light);
        own.sort_by(|a, b| b.bound.total_cmp(&a.bound).then(a.light.cmp(&b.light)));
        own.sort_by_cached_key(|own| !is_main(own));
        let first = self.lights.len();
        self.lights.extend(own.iter().map(|light| {
            let BoundedLight { light, bound: rest, weight: weights } = *light;
            CellLight { light, rest, weights }
        }));
        let (mut rest, mut weights) = (0.0, 0.0);
        for light in self.lights[first..].iter_mut().rev() {
            rest += light.rest;
            weights += light.weights;
            (light.rest, light.weights) = (rest, weights);
        }
        let main = own.iter().filter(|own| is_main(own)).count();
        let area =
            own[..main].iter().filter(|light| lights[light.light as usize].is_area()).count();
        self.most_area = self.most_area.max(area);
        let [first, count, main] = [first, own.len(), main].map(|n| n as u32);
        self.cells.push(Cell { first, count, main, tail_set, typical });
    }
}

/// The one colour that all `lights` have, else the three primaries.
fn tints(lights: &[Light]) -> Vec<Rgb> {
    let mut colours = lights.iter().map(Light::emission).filter(|colour| *colour != Rgb::ZERO);
    let of = |colour: Rgb| colour / colour.element_sum();
    let first = colours.next().map_or(Rgb::ONE, of);
    let is_same = |own: Rgb| (own - first).abs().cmple(SAME_COLOUR * own.max(first)).all();
    if colours.all(|colour| is_same(of(colour))) { vec![first] } else { PRIMARIES.to_vec() }
}

/// The most that a light sends to any corner of a box, where that is finite.
fn far_end(light: &Light, bounds: &Bounds3) -> f64 {
    let Bounds3 { min, max } = *bounds;
    let corners = (0..8).map(|corner: u32| {
        let side = |axis: u32| f64::from(corner >> axis & 1);
        let p = min + (max - min) * DVec3::new(side(0), side(1), side(2));
        light.most_irradiance(&Bounds3 { min: p, max: p })
    });
    corners.filter(|irradiance| irradiance.is_finite()).fold(0.0, f64::max)
}

impl Open {
    /// A box, with those of the lights `known` that can send it anything.
    fn new(bounds: Bounds3, node: usize, known: &[u32], lights: &[Light]) -> Self {
        let place = |p: DVec3| Bounds3 { min: p, max: p };
        let middle = place(bounds.centre());
        let mut typical = 0.0;
        let mut own = Vec::with_capacity(known.len());
        for number in known {
            let light = &lights[*number as usize];
            let bound = light.most_irradiance(&bounds);
            if bound == 0.0 {
                continue;
            }
            let at_middle = light.most_irradiance(&middle);
            typical += if at_middle.is_finite() { at_middle } else { 0.0 };
            let is_near = bound.is_infinite() || bound > NEAR * at_middle;
            let far = if is_near { far_end(light, &bounds) } else { 0.0 };
            let most = NEAR * if at_middle.is_finite() { at_middle.max(far) } else { far };
            let weight = if most > 0.0 { bound.min(most) } else { bound };
            let weight = if weight.is_finite() { weight } else { 1.0 };
            own.push(BoundedLight { light: *number, bound, weight });
        }
        Self { bounds, node, lights: own, main: Arc::new([]), typical }
    }

    /// Chooses the main lights of all boxes within this one: those that somewhere in it send at least [`SHARE`] of what
    /// arrives, and those without a bound.
    fn choose_main(&mut self, lights: &[Light]) {
        let Bounds3 { min, max } = self.bounds;
        let mut shares = vec![0.0f64; self.lights.len()];
        let mut sent = vec![0.0; self.lights.len()];
        for k in 0..ACROSS * ACROSS * ACROSS {
            let at = [k, k / ACROSS, k / ACROSS / ACROSS]
                .map(|k| (f64::from(k % ACROSS) + 0.5) / f64::from(ACROSS));
            let p = min + (max - min) * DVec3::from(at);
            let place = Bounds3 { min: p, max: p };
            for (sent, own) in sent.iter_mut().zip(&self.lights) {
                *sent = lights[own.light as usize].most_irradiance(&place);
            }
            let all: f64 = sent.iter().sum();
            for (share, sent) in shares.iter_mut().zip(&sent) {
                *share = share.max(sent / all);
            }
        }
        let mut order: Vec<usize> = (0..shares.len()).collect();
        order.retain(|k| shares[*k] >= SHARE || self.lights[*k].bound.is_infinite());
        order.sort_by(|a, b| shares[*b].total_cmp(&shares[*a]).then(a.cmp(b)));
        order.truncate(MOST_MAIN);
        self.main = order.into_iter().map(|k| self.lights[k].light).collect();
    }

    /// What cutting the box promises, greater where it is greater; `None` where nothing.
    fn gain(&self, smallest: f64) -> Option<u64> {
        let radius = self.bounds.radius();
        let bounds: f64 = self.lights.iter().map(|light| light.bound).sum();
        let looseness = bounds / self.typical;
        // Bounds of no light are 0/0.
        if self.lights.is_empty() || radius < smallest || looseness < TIGHT {
            return None;
        }
        let looseness = if looseness < LOOSEST { looseness } else { LOOSEST };
        // Positive numbers are in the order of their bits.
        Some((radius * (looseness - 1.0)).to_bits())
    }
}
