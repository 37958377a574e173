//! Which lights shading points look at, where the scene has many.
//!
//! A point's lights are those of its cell ([`LightCells`]), a function of its position alone. Its main lights are
//! traced one by one, as all lights are in a scene of few. Samples choose among those of the tail
//! ([`super::tail`]).

use super::Renderer;
use super::direct::LightSource;
use crate::math::DVec3;
use crate::scene::{CellLights, LightCells, Settings};
use std::f64::consts::PI;

/// Culled lights together change a white surface by at most so much, display steps of 1/255, even where nothing else
/// shines.
const CULLED: f64 = 0.1;
/// Display steps of 1/255 per unit of radiance where the sRGB curve is steepest, in the dark.
const STEPS: f64 = 255.0 * 12.92;
/// No source.
const NONE: u32 = u32::MAX;

/// The lights of all places in one frame.
pub(super) struct LightSelection<'a> {
    cells: &'a LightCells,
    /// Irradiance that the culled lights of a diffuse point send together at most.
    culled: f64,
    /// Shadow samples of a light with an extent.
    pub samples: u32,
    /// For each light of the scene its place among the frame's sources.
    sources: Vec<u32>,
}

/// A point that a light is traced at.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct LightUser {
    /// Its number in the chunk.
    pub point: u32,
    /// Where the light's ratio is kept, if it is.
    pub slot: Option<u16>,
}

/// For each source the points of a chunk that it is traced at.
#[derive(Default)]
pub(super) struct LightUsers {
    /// The cell of each point.
    pub cells: Vec<u32>,
    /// Sources with their users, point by point.
    found: Vec<(u32, LightUser)>,
    /// Where the users of each source begin.
    starts: Vec<u32>,
    /// The users, source by source.
    users: Vec<LightUser>,
}

/// The points that one source is traced at.
#[derive(Clone, Copy)]
pub(super) enum Reached<'u> {
    /// So many points, all of a chunk, and where its ratios are kept.
    All(usize, Option<u16>),
    Some(&'u [LightUser]),
}

/// The irradiance that the culled lights of a point may send together.
fn culled(settings: &Settings) -> f64 {
    CULLED * PI / (STEPS * f64::from(settings.exposure).max(f64::MIN_POSITIVE))
}

impl Renderer<'_> {
    /// The selection among `sources`; `None` where every point looks at every light.
    pub(super) fn light_selection(&self, lights: &[LightSource]) -> Option<LightSelection<'_>> {
        let cells = self.scene.selected_lights(self.settings)?;
        let mut sources = vec![NONE; self.scene.lights.len()];
        for (at, source) in (0..).zip(lights).filter(|(_, source)| !source.is_sky()) {
            sources[source.number as usize] = at;
        }
        let samples = self.settings.shadow_samples;
        Some(LightSelection { cells, culled: culled(self.settings), samples, sources })
    }
}

impl LightSelection<'_> {
    /// Number of the cell of `p`.
    pub fn cell(&self, p: DVec3) -> u32 {
        self.cells.cell(p)
    }

    /// The lights of a diffuse point.
    pub fn of_diffuse(&self, cell: u32) -> CellLights<'_> {
        self.cells.lights(cell, self.culled)
    }

    /// The lights of a glossy point: all that can send it anything, since a highlight may be as bright as the light.
    pub fn of_glossy(&self, cell: u32) -> CellLights<'_> {
        self.cells.lights(cell, 0.0)
    }

    /// The place among the frame's sources of a light, if it shines.
    pub fn source(&self, light: u32) -> Option<usize> {
        self.sources.get(light as usize).filter(|at| **at != NONE).map(|at| *at as usize)
    }

    /// Samples that glossy points of a cell have on average of a light, of which main ones have `samples`.
    pub fn samples_of(&self, cell: u32, light: u32, samples: u32) -> f64 {
        let lights = self.of_glossy(cell);
        if lights.main().any(|main| main == light) {
            return f64::from(samples);
        }
        let tail = lights.tail();
        f64::from(tail.samples(self.samples)) * tail.probability_of(light)
    }
}

impl LightUsers {
    /// Finds the main lights at `points`. `lights` gives the lights of a cell; `slot` says where the ratio of a
    /// source is kept at a point.
    pub fn find<'c>(
        &mut self,
        selection: &'c LightSelection,
        sources: &[LightSource],
        points: impl Iterator<Item = DVec3>,
        lights: impl Fn(u32) -> CellLights<'c>,
        mut slot: impl FnMut(u32, &LightSource) -> Option<u16>,
    ) {
        let Self { cells, found, starts, users } = self;
        cells.clear();
        found.clear();
        starts.clear();
        starts.resize(sources.len() + 1, 0);
        for (point, p) in (0..).zip(points) {
            let cell = selection.cell(p);
            cells.push(cell);
            for at in lights(cell).main().filter_map(|light| selection.source(light)) {
                let user = LightUser { point, slot: slot(point, &sources[at]) };
                found.push((at as u32, user));
                starts[at + 1] += 1;
            }
        }
        for at in 0..sources.len() {
            starts[at + 1] += starts[at];
        }
        users.clear();
        users.resize(found.len(), LightUser::default());
        for (at, user) in found {
            let next = &mut starts[*at as usize];
            users[*next as usize] = *user;
            *next += 1;
        }
        // Each start is the next one's by now.
        starts.rotate_right(1);
        starts[0] = 0;
    }

    /// The points that source number `at` is traced at.
    pub fn of(&self, at: usize) -> Reached<'_> {
        Reached::Some(&self.users[self.starts[at] as usize..self.starts[at + 1] as usize])
    }
}

impl Reached<'_> {
    pub fn len(&self) -> usize {
        match self {
            Self::All(points, _) => *points,
            Self::Some(users) => users.len(),
        }
    }

    #[inline(always)]
    pub fn get(&self, k: usize) -> LightUser {
        match self {
            Self::All(_, slot) => LightUser { point: k as u32, slot: *slot },
            Self::Some(users) => users[k],
        }
    }

    pub fn iter(self) -> impl Iterator<Item = LightUser> {
        (0..self.len()).map(move |k| self.get(k))
    }
}
