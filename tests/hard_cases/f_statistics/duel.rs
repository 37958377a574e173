//! Embree with its rules against brute force with the exact court, on scenes small enough for it.

use crate::common;
use crate::shapes;
use crate::suite::{self, Outcome, Size};
use rand::Rng;
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;
use tweenray::intersect::{EmbreeIntersector, Hit, Intersector, Oracle, Ray};
use tweenray::math::DVec3;
use tweenray::scene::{CameraPath, HitRules, Pose, Recheck, Scene, Settings, Shot, WorldMesh};
use tweenray::stats::RayCounts;
use tweenray::verify::{Answers, Check, Class, Difference, PAST_VERTEX_LIMIT, TracedRay};

/// Rays a scene.
const RAYS: u64 = 1024;

/// A random mesh of some ten to some hundred triangles: a closed ball, a soup, slivers, a grid of
/// whole numbers, a flat sheet, a stack of sheets.
fn mesh(rng: &mut Pcg64Mcg) -> WorldMesh {
    let centre = if rng.random() { DVec3::ZERO } else { shapes::in_ball(rng, 1e3) };
    match rng.random_range(0..6) {
        0 => {
            let (columns, rows) = (rng.random_range(3..24), rng.random_range(2..10));
            shapes::sphere(centre, 10f64.powf(rng.random_range(-3.0..=3.0)), columns, rows)
        }
        1 => soup(rng, centre, 1.0),
        2 => soup(rng, centre, 1e-4),
        3 => sheets(centre, 8, 1, |i, j| f64::from((i * 7 + j * 3) % 5)),
        4 => sheets(centre, 8, 1, |_, _| 0.0),
        _ => sheets(centre, 4, 6, |_, _| 0.0),
    }
}

/// Triangles anywhere in the unit ball; `width` below 1 makes slivers.
fn soup(rng: &mut Pcg64Mcg, centre: DVec3, width: f64) -> WorldMesh {
    let count = rng.random_range(1..100);
    let mut positions = Vec::new();
    for _ in 0..count {
        let [a, b] = [(); 2].map(|()| centre + shapes::in_ball(rng, 1.0));
        positions.extend([a, b, a.lerp(b, rng.random()) + shapes::in_ball(rng, width)]);
    }
    let triangles = (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    common::mesh(positions, triangles, 0)
}

/// `layers` square sheets of `n` x `n` cells on whole numbers, `height` above each other's corner.
fn sheets(centre: DVec3, n: u32, layers: u32, height: impl Fn(u32, u32) -> f64) -> WorldMesh {
    let centre = centre.round();
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for layer in 0..layers {
        let base = positions.len() as u32;
        for j in 0..=n {
            for i in 0..=n {
                let z = f64::from(layer) + height(i, j);
                positions.push(centre + DVec3::new(f64::from(i), f64::from(j), z));
            }
        }
        for j in 0..n {
            for i in 0..n {
                let k = base + j * (n + 1) + i;
                triangles.extend([[k, k + 1, k + n + 2], [k, k + n + 2, k + n + 1]]);
            }
        }
    }
    common::mesh(positions, triangles, 0)
}

/// A ray in scene space: from inside, near or far; at nothing, a vertex, an edge or along an axis.
fn ray(scene: &Scene, rng: &mut Pcg64Mcg) -> Ray {
    let mesh = &scene.meshes[0];
    let corners = mesh.corners(rng.random_range(0..mesh.triangles.len()));
    let out = [1.0, 3.0, 10.0, 1e3][rng.random_range(0..4)];
    let org = shapes::in_ball(rng, out);
    let target = match rng.random_range(0..5) {
        0 => corners[0],
        1 => corners[0].lerp(corners[1], rng.random()),
        2 => {
            let axis = [DVec3::X, DVec3::Y, DVec3::Z][rng.random_range(0..3)];
            let sign = if rng.random() { out } else { -out };
            return Ray::new(corners[rng.random_range(0..3)] + axis * sign, axis * -sign);
        }
        3 => {
            let (u, v): (f64, f64) = (rng.random(), rng.random());
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            corners[0] + (corners[1] - corners[0]) * u + (corners[2] - corners[0]) * v
        }
        _ => shapes::in_ball(rng, 1.0),
    };
    let scale = 10f64.powf(rng.random_range(-2.0..=2.0));
    Ray::new(org, (target - org) * scale)
}

/// The camera of a check, which none of the rays needs.
fn shot() -> Shot {
    let pose = Pose { eye: DVec3::Z, target: DVec3::ZERO, up: DVec3::Y, roll_degrees: 0.0 };
    Shot::new(CameraPath::Still(pose), 1, 60.0)
}

/// Differences by class.
#[derive(Default)]
struct Tally {
    rays: u64,
    hits: u64,
    found: [u64; Class::ALL.len()],
    /// Unexplained ones, a few.
    examples: Vec<String>,
}

impl Tally {
    fn count(&self, class: Class) -> u64 {
        self.found[class as usize]
    }

    fn with(mut self, other: Self) -> Self {
        self.rays += other.rays;
        self.hits += other.hits;
        self.found.iter_mut().zip(other.found).for_each(|(mine, theirs)| *mine += theirs);
        self.examples.extend(other.examples);
        self
    }
}

/// One ray by Embree, the oracle's answer beside it, judged as `tweenray verify` judges.
fn judged(check: &Check, ray: &Ray, oracle: Option<Hit>) -> (Answers, Option<Difference>) {
    let product = check.product.intersect(ray, &mut RayCounts::default());
    let answers = Answers::Hits { product, oracle };
    (answers, check.judge(&TracedRay { ray: *ray, answers }))
}

/// Calls `then` with a check of `scene`.
fn with_check<T>(scene: &Scene, rules: HitRules, then: impl FnOnce(&Check) -> T) -> T {
    let (settings, shot) = (Settings::default(), shot());
    let embree = EmbreeIntersector::new(scene, rules, None, 1).unwrap();
    let oracle = Oracle::new(scene);
    then(&Check::new(scene, &settings, &shot, &embree, &oracle))
}

/// The rays go one by one: a block's rules are for rays that start together, which these do not.
fn duel(number: u64, rules: HitRules) -> Tally {
    let mut rng = suite::rng(60, number);
    let mesh = mesh(&mut rng);
    let Ok(scene) = shapes::world_of(mesh).into_scene(true) else {
        return Tally::default();
    };
    let mut tally = Tally { rays: RAYS, ..Tally::default() };
    with_check(&scene, rules, |check| {
        let rays: Vec<Ray> = (0..RAYS).map(|_| ray(&scene, &mut rng)).collect();
        let mut truth = vec![None; rays.len()];
        check.oracle.intersect_batch(&rays, &mut truth, &mut RayCounts::default());
        for (ray, truth) in rays.iter().zip(truth) {
            tally.hits += u64::from(truth.is_some());
            let (_, difference) = judged(check, ray, truth);
            let Some(Difference { class, .. }) = difference else { continue };
            tally.found[class as usize] += 1;
            if !class.is_explained() && tally.examples.is_empty() {
                tally.examples.push(format!("scene {number}: {}", minimised(&scene, rules, ray)));
            }
        }
    });
    tally
}

/// The fewest triangles, found by leaving out one after the other, on which the two differ so that
/// nothing explains it.
fn minimised(scene: &Scene, rules: HitRules, ray: &Ray) -> String {
    let apart = |scene: &Scene| {
        let (answers, difference) = with_check(scene, rules, |check| {
            let truth = check.oracle.intersect(ray, &mut RayCounts::default());
            judged(check, ray, truth)
        });
        difference.filter(|d| !d.class.is_explained()).map(|d| (answers, d))
    };
    let mut scene = scene.clone();
    let Some(mut found) = apart(&scene) else {
        return format!("not again: {ray:?}");
    };
    let mut at = 0;
    while at < scene.meshes[0].triangles.len() {
        let mut fewer = scene.clone();
        fewer.meshes[0].triangles.remove(at);
        match apart(&fewer) {
            Some(again) => (scene, found) = (fewer, again),
            None => at += 1,
        }
    }
    let mesh = &scene.meshes[0];
    let corners: Vec<[DVec3; 3]> = (0..mesh.triangles.len()).map(|i| mesh.corners(i)).collect();
    let (answers, Difference { class, ulps }) = found;
    format!("{class:?}, {ulps:.2} ulp: {ray:?} on {corners:?} in {:?}: {answers:?}", scene.bounds)
}

fn duels(scenes: u64, rules: HitRules) -> Tally {
    let tallies = (0..scenes).into_par_iter().map(|number| duel(number, rules));
    tallies.reduce(Tally::default, Tally::with)
}

pub fn oracle_duel(size: Size) -> Outcome {
    // Slivers at less than 1e-5 rad to the ray are isolated, their edges nobody else's, and narrower than
    // Embree's rounding: a ray that meets one inside may miss it by all three tries.
    let mut outcome = Outcome { allowed: 1e-7, ..Outcome::default() };
    let scenes = size.of(50_000, 100_000_000) / RAYS + 1;
    let tally = duels(scenes, HitRules::default());
    let share = |count: u64| count as f64 / tally.rays as f64;
    let unexplained = Class::ALL.iter().filter(|class| !class.is_explained());
    outcome.count(tally.rays, unexplained.map(|class| tally.count(*class)).sum());
    outcome.show(format!("{scenes} scenes, {:.1} % of rays hit", 100.0 * share(tally.hits)));
    for class in Class::ALL.into_iter().filter(|class| tally.count(*class) > 0) {
        let count = tally.count(class);
        outcome.show(format!("{class:?}: {count}, {:.2e} of the rays", share(count)));
    }
    outcome.at_most("past a vertex", share(tally.count(Class::PastVertex)), PAST_VERTEX_LIMIT);
    let naive = HitRules { retry: false, recheck: Recheck::Off, ..HitRules::default() };
    let naive = duels(size.of(6, 60), naive);
    let wrong = Class::ALL.iter().filter(|class| !class.is_explained());
    let wrong: u64 = wrong.map(|class| naive.count(*class)).sum();
    outcome.at_least("unexplained without our rules", wrong as f64 / naive.rays as f64, 1e-3);
    tally.examples.into_iter().for_each(|line| outcome.example(line));
    outcome
}
