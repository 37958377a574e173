//! Ice in tea in a glass.

use crate::common::{self, Job};
use crate::suite::{Outcome, Size};
use tweenray::film::Film;
use tweenray::math::{DAffine3, DQuat, DVec3, Rgb};
use tweenray::scene::{Camera, Glass, Material, Pose, World, WorldMesh};
use tweenray::stats::RayKind;

const GLASS: f64 = 1.5;
const TEA: f64 = 1.33;
const ICE: f64 = 1.31;
/// Half width of the glass, outside.
const OUT: f64 = 1.0;
/// The same, inside.
const IN: f64 = 0.8;
/// Level of the tea.
const LEVEL: f64 = 0.4;
/// The ice: lower and upper corner.
const ICE_BOX: [DVec3; 2] = [DVec3::new(-0.2, 0.05, -0.4), DVec3::new(0.4, 0.65, 0.2)];

/// Quads that become one mesh.
#[derive(Default)]
struct Shell(Vec<[DVec3; 4]>);

impl Shell {
    /// A rectangle across `axis` at `at`, from `lo` to `hi` in the other two axes (in the order
    /// x, y, z), facing along `sign` of the axis.
    fn face(&mut self, axis: usize, at: f64, lo: [f64; 2], hi: [f64; 2], sign: f64) {
        let point = |a: f64, b: f64| {
            let mut p = [0.0; 3];
            let others: Vec<usize> = (0..3).filter(|k| *k != axis).collect();
            (p[axis], p[others[0]], p[others[1]]) = (at, a, b);
            DVec3::from_array(p)
        };
        let mut quad =
            [point(lo[0], lo[1]), point(hi[0], lo[1]), point(hi[0], hi[1]), point(lo[0], hi[1])];
        let normal = (quad[1] - quad[0]).cross(quad[3] - quad[0]);
        if normal[axis] * sign < 0.0 {
            quad.swap(1, 3);
        }
        self.0.push(quad);
    }

    /// The four upright walls of a square column, facing outwards (`sign` 1) or inwards.
    fn walls(&mut self, lo: DVec3, hi: DVec3, sign: f64) {
        for (at, way) in [(lo.x, -sign), (hi.x, sign)] {
            self.face(0, at, [lo.y, lo.z], [hi.y, hi.z], way);
        }
        for (at, way) in [(lo.z, -sign), (hi.z, sign)] {
            self.face(2, at, [lo.x, lo.y], [hi.x, hi.y], way);
        }
    }

    /// A level square ring from `outer` (x0, z0, x1, z1) to `inner`, facing up.
    fn ring(&mut self, y: f64, outer: [f64; 4], inner: [f64; 4]) {
        let [x0, z0, x1, z1] = outer;
        let [u0, w0, u1, w1] = inner;
        self.face(1, y, [x0, z0], [x1, w0], 1.0);
        self.face(1, y, [x0, w1], [x1, z1], 1.0);
        self.face(1, y, [x0, w0], [u0, w1], 1.0);
        self.face(1, y, [u1, w0], [x1, w1], 1.0);
    }

    fn cuboid(lo: DVec3, hi: DVec3) -> Self {
        let mut shell = Self::default();
        shell.walls(lo, hi, 1.0);
        shell.face(1, lo.y, [lo.x, lo.z], [hi.x, hi.z], -1.0);
        shell.face(1, hi.y, [lo.x, lo.z], [hi.x, hi.z], 1.0);
        shell
    }

    fn mesh(self, material: u32) -> WorldMesh {
        let positions: Vec<DVec3> = self.0.into_iter().flatten().collect();
        let quads = 0..positions.len() as u32 / 4;
        let triangles =
            quads.flat_map(|q| [[4 * q, 4 * q + 1, 4 * q + 2], [4 * q, 4 * q + 2, 4 * q + 3]]);
        common::mesh(positions, triangles.collect(), material)
    }
}

/// A material of glass.
fn glass(world: &mut World, ior: f64, priority: Option<u8>) -> u32 {
    let glass = Glass { priority, ..Glass::clear(ior) };
    world.materials.push(Material { glass: Some(glass), ..Material::black("glass") });
    world.materials.len() as u32 - 1
}

/// Glowing tiles below and around, so that every direction has something to show.
fn surroundings() -> World {
    let mut world = World::default();
    for emission in [Rgb::new(0.9, 0.2, 0.1), Rgb::new(0.1, 0.5, 0.9), Rgb::new(0.7, 0.8, 0.3)] {
        world.materials.push(Material { emission, emits_back: true, ..Material::black("tile") });
    }
    let mut tiles = [Shell::default(), Shell::default(), Shell::default()];
    for i in -4i32..4 {
        for j in -4i32..4 {
            let (a, b) = (f64::from(i), f64::from(j));
            let colour = (i + 2 * j).rem_euclid(3) as usize;
            let (lo, hi) = ([a, b], [a + 1.0, b + 1.0]);
            tiles[colour].face(1, -1.5, lo, hi, 1.0);
            tiles[colour].face(2, -4.0, lo, hi, 1.0);
            tiles[colour].face(0, 4.0, lo, hi, 1.0);
            tiles[(colour + 1) % 3].face(0, -4.0, lo, hi, 1.0);
            tiles[(colour + 2) % 3].face(2, 4.0, lo, hi, 1.0);
        }
    }
    let meshes = tiles.into_iter().enumerate().map(|(i, shell)| shell.mesh(i as u32));
    world.meshes = meshes.collect();
    world.sky.radiance = Rgb::new(0.5, 0.6, 0.8);
    world
}

fn tumbler() -> Shell {
    let mut shell = Shell::default();
    shell.walls(DVec3::splat(-OUT), DVec3::splat(OUT), 1.0);
    shell.face(1, -OUT, [-OUT; 2], [OUT; 2], -1.0);
    shell.ring(OUT, [-OUT, -OUT, OUT, OUT], [-IN, -IN, IN, IN]);
    shell.walls(DVec3::splat(-IN), DVec3::new(IN, OUT, IN), -1.0);
    shell.face(1, -IN, [-IN; 2], [IN; 2], 1.0);
    shell
}

/// Three closed bodies; the tea reaches `overlap` into the glass.
fn bodies(overlap: f64, ranked: bool) -> World {
    let mut world = surroundings();
    let rank = |priority| ranked.then_some(priority);
    let [a, b, c] =
        [(GLASS, 3), (TEA, 1), (ICE, 2)].map(|(ior, p)| glass(&mut world, ior, rank(p)));
    let wide = IN + overlap;
    world.meshes.push(tumbler().mesh(a));
    world.meshes.push(Shell::cuboid(DVec3::splat(-wide), DVec3::new(wide, LEVEL, wide)).mesh(b));
    world.meshes.push(Shell::cuboid(ICE_BOX[0], ICE_BOX[1]).mesh(c));
    world
}

/// The same cut by hand: one surface between each two media, with their relative index.
fn cut() -> World {
    let mut world = surroundings();
    let [lo, hi] = ICE_BOX;
    let mut push = |ior, shell: Shell| {
        let material = glass(&mut world, ior, None);
        world.meshes.push(shell.mesh(material));
    };
    let mut glass_air = Shell::default();
    glass_air.walls(DVec3::splat(-OUT), DVec3::splat(OUT), 1.0);
    glass_air.face(1, -OUT, [-OUT; 2], [OUT; 2], -1.0);
    glass_air.ring(OUT, [-OUT, -OUT, OUT, OUT], [-IN, -IN, IN, IN]);
    glass_air.walls(DVec3::new(-IN, LEVEL, -IN), DVec3::new(IN, OUT, IN), -1.0);
    push(GLASS, glass_air);
    let mut glass_tea = Shell::default();
    glass_tea.walls(DVec3::splat(-IN), DVec3::new(IN, LEVEL, IN), -1.0);
    glass_tea.face(1, -IN, [-IN; 2], [IN; 2], 1.0);
    push(GLASS / TEA, glass_tea);
    let mut tea_air = Shell::default();
    tea_air.ring(LEVEL, [-IN, -IN, IN, IN], [lo.x, lo.z, hi.x, hi.z]);
    push(TEA, tea_air);
    let mut ice_tea = Shell::default();
    ice_tea.walls(lo, DVec3::new(hi.x, LEVEL, hi.z), 1.0);
    ice_tea.face(1, lo.y, [lo.x, lo.z], [hi.x, hi.z], -1.0);
    push(ICE / TEA, ice_tea);
    let mut ice_air = Shell::default();
    ice_air.walls(DVec3::new(lo.x, LEVEL, lo.z), hi, 1.0);
    ice_air.face(1, hi.y, [lo.x, lo.z], [hi.x, hi.z], 1.0);
    push(ICE, ice_air);
    world
}

/// Where the camera stands: above, below the level, in the tea, in the wall of the glass.
const VIEWS: [(DVec3, DVec3); 4] = [
    (DVec3::new(1.3, 2.2, 3.0), DVec3::ZERO),
    (DVec3::new(-2.6, -0.3, 2.3), DVec3::new(0.0, -0.1, 0.0)),
    (DVec3::new(-0.5, -0.3, 0.6), DVec3::new(0.1, 0.3, -0.1)),
    (DVec3::new(0.9, -0.2, 0.3), DVec3::new(0.0, 0.0, 0.0)),
];

fn film(world: World, view: (DVec3, DVec3), edge: u32, turned: bool) -> Film {
    film_within(world, view, 50.0, edge, turned)
}

/// `degrees` wide. Turned by no particular angle, so that surfaces which coincide do so up to
/// rounding only.
fn film_within(
    mut world: World,
    (eye, target): (DVec3, DVec3),
    degrees: f64,
    edge: u32,
    turned: bool,
) -> Film {
    let turn =
        if turned { DQuat::from_axis_angle(DVec3::ONE.normalize(), 0.7) } else { DQuat::IDENTITY };
    world.apply_transform(&DAffine3::from_quat(turn)).unwrap();
    let pose =
        Pose { eye: turn * eye, target: turn * target, up: turn * DVec3::Y, roll_degrees: 0.0 };
    let camera = Camera::new(&pose, degrees, edge, edge).unwrap();
    let mut job: Job = common::job(world, pose, edge, edge);
    job.camera = camera;
    job.settings.bounces = 12;
    job.settings.cutoff = 0.004;
    let (film, counts) = common::render(&job);
    assert!(film.bad.is_none());
    assert_eq!(counts[RayKind::Invalid], 0);
    film
}

/// Mean difference as a share of the mean, and the share of pixels that differ by over 1 % of it.
fn apart(film: &Film, reference: &Film) -> (f64, f64) {
    let mean = reference.rgb.iter().map(|c| f64::from(c.element_sum())).sum::<f64>();
    let each = mean / reference.rgb.len() as f64;
    let differences = || {
        let pairs = film.rgb.iter().zip(&reference.rgb);
        pairs.map(|(a, b)| f64::from((*a - *b).abs().element_sum()))
    };
    let off = differences().filter(|d| *d > 0.01 * each).count();
    (differences().sum::<f64>() / mean, off as f64 / film.rgb.len() as f64)
}

pub fn nested_dielectrics(size: Size) -> Outcome {
    let mut outcome = Outcome::default();
    let edge = size.of(40, 300);
    let views = if size == Size::Full { &VIEWS[..] } else { &VIEWS[..3] };
    for (v, view) in views.iter().enumerate() {
        let turned = v % 2 == 0;
        let reference = film(cut(), *view, edge, turned);
        let mut compare = |name: &str, overlap: f64| {
            let image = film(bodies(overlap, true), *view, edge, turned);
            let (mean, share) = apart(&image, &reference);
            outcome.count(u64::from(edge * edge), 0);
            outcome.at_most(&format!("view {v}, {name}: mean difference from the cut"), mean, 0.01);
            outcome.at_most(&format!("view {v}, {name}: pixels off by over 1 %"), share, 0.01);
            image
        };
        compare("coincident", 0.0);
        compare("overlap 0.1", 0.1);
        let over = compare("overlap 1e-6", 1e-6);
        let gap = compare("gap 1e-6", -1e-6);
        // Edges move by 1e-6: a pixel in ten thousand may fall to the other side.
        let (mean, share) = apart(&gap, &over);
        outcome.at_most(&format!("view {v}, gap against overlap: mean difference"), mean, 1e-3);
        outcome.at_most(&format!("view {v}, gap against overlap: pixels off"), share, 2e-3);
        if v == 0 {
            let (mean, share) = apart(&film(bodies(0.1, false), *view, edge, turned), &reference);
            outcome.at_least("without priorities, overlap 0.1: mean difference", mean, 0.02);
            outcome.show(format!("without priorities: {:.1} % of pixels off", 100.0 * share));
        }
    }
    for distance in [3.0, 50.0, 500.0] {
        from_afar(&mut outcome, distance, edge);
    }
    outcome
}

/// Half width of a box in a box, level of the inner one's floor, and half width of a lid.
const INNER: f64 = 0.6;
const FLOOR: f64 = -0.5;
const LID: f64 = 1.2;

/// A box in a box, both up to y = 1 but for `apart`, and if asked for a lid on both, again but for
/// `apart`.
fn boxes(apart: f64, lid: bool) -> World {
    let mut world = surroundings();
    let [a, b, c] =
        [(GLASS, 1), (TEA, 2), (1.8, 3)].map(|(ior, p)| glass(&mut world, ior, Some(p)));
    let mut push = |lo: DVec3, hi: DVec3, material| {
        world.meshes.push(Shell::cuboid(lo, hi).mesh(material));
    };
    push(DVec3::splat(-OUT), DVec3::new(OUT, 1.0 - apart, OUT), a);
    push(DVec3::new(-INNER, FLOOR, -INNER), DVec3::new(INNER, 1.0, INNER), b);
    if lid {
        push(DVec3::new(-LID, 1.0 + apart, -LID), DVec3::new(LID, 1.5, LID), c);
    }
    world
}

/// The same cut by hand.
fn cut_boxes(lid: bool) -> World {
    let mut world = surroundings();
    let mut push = |ior, shell: Shell| {
        let material = glass(&mut world, ior, None);
        world.meshes.push(shell.mesh(material));
    };
    let wide = [-OUT, -OUT, OUT, OUT];
    let inner = [-INNER, -INNER, INNER, INNER];
    let above = if lid { 1.8 } else { 1.0 };
    let mut outer_air = Shell::default();
    outer_air.walls(DVec3::splat(-OUT), DVec3::splat(OUT), 1.0);
    outer_air.face(1, -OUT, [-OUT; 2], [OUT; 2], -1.0);
    push(GLASS, outer_air);
    let mut outer_above = Shell::default();
    outer_above.ring(1.0, wide, inner);
    push(GLASS / above, outer_above);
    let mut inner_above = Shell::default();
    inner_above.face(1, 1.0, [-INNER; 2], [INNER; 2], 1.0);
    push(TEA / above, inner_above);
    let mut inner_outer = Shell::default();
    inner_outer.walls(DVec3::new(-INNER, FLOOR, -INNER), DVec3::new(INNER, 1.0, INNER), 1.0);
    inner_outer.face(1, FLOOR, [-INNER; 2], [INNER; 2], -1.0);
    push(TEA / GLASS, inner_outer);
    if lid {
        let mut lid_air = Shell::default();
        lid_air.walls(DVec3::new(-LID, 1.0, -LID), DVec3::new(LID, 1.5, LID), 1.0);
        lid_air.face(1, 1.5, [-LID; 2], [LID; 2], 1.0);
        let mut below = Shell::default();
        below.ring(1.0, [-LID, -LID, LID, LID], wide);
        below.0.iter_mut().for_each(|quad| quad.reverse());
        lid_air.0.extend(below.0);
        push(1.8, lid_air);
    }
    world
}

/// Boundaries that touch, two and three, looked at from ever further away through an ever longer
/// lens.
fn from_afar(outcome: &mut Outcome, distance: f64, edge: u32) {
    let eye = DVec3::new(0.17, 1.0, 0.23).normalize() * distance;
    let degrees = 2.0 * (1.3 / distance).atan().to_degrees();
    let film = |world| film_within(world, (eye, DVec3::ZERO), degrees, edge, true);
    // Under 4 units to the scene's unit: a quarter of what still touches.
    for (lid, gap) in [(false, 0.0), (false, 4e-6), (true, 4e-6), (true, -4e-6)] {
        let (mean, share) = apart(&film(boxes(gap, lid)), &film(cut_boxes(lid)));
        outcome.count(u64::from(edge * edge), 0);
        let name = format!("{} boxes {gap:e} apart, from {distance}", if lid { 3 } else { 2 });
        outcome.at_most(&format!("{name}: mean difference from the cut"), mean, 1e-4);
        outcome.at_most(&format!("{name}: pixels off by over 1 %"), share, 1e-3);
    }
}
