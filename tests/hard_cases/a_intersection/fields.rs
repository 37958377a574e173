//! Height fields and grids, looked at exactly through their vertices and edges.

use super::ways::{OneByOne, stock, to_scene};
use crate::shapes;
use crate::suite::{self, Outcome, Size};
use rand::Rng;
use tweenray::intersect::{EmbreeIntersector, Intersector, Oracle, Ray};
use tweenray::math::DVec3;
use tweenray::scene::{HitRules, Scene, World, WorldMesh};

/// Corners `(x, y, height(x, y))` for whole x and y from 0 to `cells`, two triangles a cell.
pub fn field(cells: u32, height: impl Fn(u32, u32) -> f64) -> WorldMesh {
    let side = cells + 1;
    let at = |x: u32, y: u32| DVec3::new(f64::from(x), f64::from(y), height(x, y));
    let positions = (0..side * side).map(|i| at(i % side, i / side)).collect();
    let cell = |i: u32| {
        let a = i / cells * side + i % cells;
        let (b, c, d) = (a + 1, a + side, a + side + 1);
        [[a, b, d], [a, d, c]]
    };
    let triangles = (0..cells * cells).flat_map(cell).collect();
    WorldMesh::new("field", positions, triangles, 0)
}

/// A whole number from 0 to 7, the same for the same corner.
fn bump(x: u32, y: u32) -> f64 {
    f64::from(suite::rng(4, u64::from(y) << 32 | u64::from(x)).random_range(0..8u32))
}

/// Inner vertex number `i` of a field of `cells`.
fn inner(cells: u32, i: u32) -> (u32, u32) {
    (1 + i % (cells - 1), 1 + i / (cells - 1))
}

/// Rays from above at every inner vertex of a rough field.
pub fn vertex_perspective(size: Size) -> Outcome {
    const CELLS: u32 = 256;
    let rough = |x: u32, y: u32| {
        let (x, y) = (f64::from(x), f64::from(y));
        // Gentler than any ray: at a silhouette near the border a miss would be right.
        (0.37 * x).sin() * (0.23 * y).cos() + 0.2 * (1.9 * x + 0.7 * y).sin()
    };
    let world = shapes::world_of(field(CELLS, rough));
    let first = DVec3::new(128.3, 127.9, 300.0);
    let vertices = (CELLS - 1) * (CELLS - 1);
    // The anchor's eye, and others around it.
    let eyes = size.of(1, 100);
    let aim = |i: u64| {
        let (x, y) = inner(CELLS, (i % u64::from(vertices)) as u32);
        let eye = match i / u64::from(vertices) {
            0 => first,
            k => {
                let mut rng = suite::rng(4, k);
                let mut within = |most: f64| rng.random_range(-most..most);
                first + DVec3::new(within(100.0), within(100.0), 200.0 + within(200.0))
            }
        };
        (eye, y * (CELLS + 1) + x)
    };
    let leaks = |rules: HitRules, rays: u64, one_by_one: bool| {
        let scene = world.clone().into_scene(rules.recentre).unwrap();
        let embree = EmbreeIntersector::new(&scene, rules, suite::isa(), 4).unwrap();
        let single = OneByOne(&embree);
        let tracer: &dyn Intersector = if one_by_one { &single } else { &embree };
        suite::misses(tracer, rays, |i| {
            let (eye, vertex) = aim(i);
            let eye = scene.recentring.point_to_scene(eye);
            let vertex = scene.meshes[0].positions[vertex as usize].as_dvec3();
            Ray::new(eye, vertex - eye)
        })
    };
    let mut outcome = Outcome::default();
    let rays = eyes * u64::from(vertices);
    outcome.count(rays, leaks(HitRules::default(), rays, false));
    outcome.count(rays, leaks(HitRules::default(), rays, true));
    for (name, robust) in [("not ROBUST", false), ("ROBUST", true)] {
        let missed = leaks(stock(robust), u64::from(vertices), false);
        let name = format!("misses of stock Embree, {name}, from the anchor's eye");
        outcome.at_least(&name, missed as f64, 1.0);
    }
    outcome
}

/// Places over an inner vertex and along the edges that leave it: rays meet them exactly.
const OVER: [(f64, f64); 9] = [
    (0.0, 0.0),
    (0.25, 0.0),
    (0.5, 0.0),
    (0.75, 0.0),
    (0.0, 0.25),
    (0.0, 0.5),
    (0.0, 0.75),
    (0.25, 0.25),
    (0.5, 0.5),
];

/// A grid with its normal along an axis, and axis-parallel rays exactly onto vertices and edges.
struct Grid {
    world: World,
    cells: u32,
    /// Which axis the rays run along.
    axis: usize,
    height: fn(u32, u32) -> f64,
}

impl Grid {
    fn new(cells: u32, axis: usize, height: fn(u32, u32) -> f64) -> Self {
        let mut mesh = field(cells, height);
        mesh.positions.iter_mut().for_each(|p| *p = turn(*p, axis));
        Self { world: shapes::world_of(mesh), cells, axis, height }
    }

    fn rays(&self) -> u64 {
        u64::from(self.cells - 1).pow(2) * OVER.len() as u64
    }

    /// Ray `i` from `distance` above (or below), and the `t` at which it meets the grid.
    fn ray(&self, i: u64, distance: f64) -> (Ray, f64) {
        let (x, y) = inner(self.cells, (i / OVER.len() as u64) as u32);
        let (dx, dy) = OVER[(i % OVER.len() as u64) as usize];
        // All places lie on edges of the upper right corner's two triangles.
        let (here, there) =
            ((self.height)(x, y), (self.height)(x + u32::from(dx > 0.0), y + u32::from(dy > 0.0)));
        let height = here + (there - here) * dx.max(dy);
        let org = DVec3::new(f64::from(x) + dx, f64::from(y) + dy, height + distance);
        let dir = DVec3::new(0.0, 0.0, -distance.signum());
        (Ray::new(turn(org, self.axis), turn(dir, self.axis)), distance.abs())
    }

    /// Rays that miss or hit elsewhere.
    fn wrong(&self, scene: &Scene, tracer: &dyn Intersector, distance: f64) -> u64 {
        let make = |i: u64| to_scene(&self.ray(i, distance).0, &scene.recentring);
        let right = |t: f64| (t - distance.abs()).abs() <= 1e-9 * distance.abs();
        suite::trace(
            tracer,
            self.rays(),
            make,
            |_, hits| hits.iter().filter(|h| !h.is_some_and(|h| right(h.t))).count() as u64,
            |a, b| a + b,
            || 0,
        )
    }
}

/// z becomes `axis`.
fn turn(p: DVec3, axis: usize) -> DVec3 {
    match axis {
        0 => DVec3::new(p.z, p.x, p.y),
        1 => DVec3::new(p.y, p.z, p.x),
        _ => p,
    }
}

fn flat(_: u32, _: u32) -> f64 {
    0.0
}

/// Axis-parallel rays exactly on whole-numbered vertices and edges.
pub fn structured_grid(size: Size) -> Outcome {
    let mut outcome = Outcome::default();
    let mut stock_wrong = 0;
    for (axis, height) in
        (0..3).flat_map(|axis| [(axis, flat as fn(u32, u32) -> f64), (axis, bump)])
    {
        let grid = Grid::new(size.of(64, 256), axis, height);
        let scene = grid.world.clone().into_scene(true).unwrap();
        let embree = EmbreeIntersector::new(&scene, HitRules::default(), suite::isa(), 4).unwrap();
        // From near, from far (where the eye is moved up), from either side.
        for distance in [300.0, -300.0, 1e6] {
            outcome.count(grid.rays(), grid.wrong(&scene, &embree, distance));
            outcome.count(grid.rays(), grid.wrong(&scene, &OneByOne(&embree), distance));
        }
        let raw = grid.world.clone().into_scene(false).unwrap();
        let embree = EmbreeIntersector::new(&raw, stock(true), suite::isa(), 4).unwrap();
        stock_wrong += grid.wrong(&raw, &embree, 300.0);
        // Without a BVH.
        let small = Grid::new(size.of(16, 64), axis, height);
        let scene = small.world.clone().into_scene(true).unwrap();
        outcome.count(small.rays(), small.wrong(&scene, &Oracle::new(&scene), 300.0));
    }
    outcome.show(format!("wrong with stock Embree: {stock_wrong}"));
    outcome
}
