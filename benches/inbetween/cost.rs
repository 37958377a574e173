//! Figure 2: an in-between frame over the bare primary visibility of the same frame.

use super::moves::{self, Set};
use super::{Choice, quartiles, support};
use rayon::ThreadPool;
use tweenray::embree::{BareCamera, CommittedScene};
use tweenray::scene::{Camera, Policy, Scene, Settings};

/// Frames of the move.
const FRAMES: u32 = 33;

/// The C loop over a scene of triangles.
pub struct Bare<'s> {
    committed: CommittedScene<'s>,
    scene: &'s Scene,
}

impl<'s> Bare<'s> {
    /// The scene's triangles in Embree, as the intersect layer builds them.
    pub fn new(scene: &'s Scene, threads: usize) -> Self {
        Self { committed: support::commit(scene, threads), scene }
    }

    /// Seconds of the loop over all pixels of `camera` (world space), `spp` times: the image is cut
    /// into bands of rows for the threads of `pool`, two for each so that they end together.
    pub fn seconds(&self, pool: &ThreadPool, camera: &Camera, spp: u32) -> f64 {
        let camera = camera.to_scene(&self.scene.recentring);
        let bands = bands(&camera, 2 * pool.current_num_threads() as u32);
        support::seconds(|| {
            (0..spp).for_each(|_| {
                pool.scope(|scope| {
                    for band in &bands {
                        scope.spawn(move |_| {
                            let tally = self.committed.bare_camera_loop(band).expect("it runs");
                            std::hint::black_box(tally);
                        });
                    }
                });
            });
        })
    }
}

/// `camera`, scene space, in `count` bands of rows or fewer; their edges are multiples of 8.
fn bands(camera: &Camera, count: u32) -> Vec<BareCamera> {
    let rows = camera.height / 8;
    let at = |k: u32| 8 * (rows * k / count);
    let band = |k: u32| {
        let (top, bottom) = (at(k), at(k + 1));
        let height = f64::from(camera.height);
        let middle = 1.0 - f64::from(top + bottom) / height;
        BareCamera {
            eye: camera.eye.as_vec3(),
            forward: (camera.forward + camera.half_up * middle).as_vec3(),
            half_right: camera.half_right.as_vec3(),
            half_up: (camera.half_up * (f64::from(bottom - top) / height)).as_vec3(),
            width: camera.width,
            height: bottom - top,
        }
    };
    (0..count).map(band).filter(|band| band.height > 0).collect()
}

/// Each in-between frame, beside the loop and the traced frame.
pub fn report(choice: &Choice) {
    let size = choice.size.unwrap_or((640, 360));
    let set = Set::load("spheres_on_terrain", |_| ());
    let bare = Bare::new(&set.scene, choice.threads);
    println!(
        "spheres_on_terrain, {FRAMES} frames of {} x {}: median (quartiles) over the in-between frames",
        size.0, size.1
    );
    println!("of their time over that of the bare C loop, once for each camera sample, on as many");
    println!("threads; wanted: 5 at 1 camera and 16 shadow samples, 3.5 at 4 and 16");
    let mut rows = Vec::new();
    for (spp, samples) in [(1, 16), (1, 100), (4, 16), (4, 100)] {
        let settings = set.settings(size, spp, samples);
        rows.push(row(choice, &set, &bare, &settings));
    }
    let head = ["samples", "an in-between frame", "a key frame", "loop, ms", "in-between, ms"];
    support::table(&head, &rows);
}

fn row(choice: &Choice, set: &Set, bare: &Bare, settings: &Settings) -> Vec<String> {
    let stage = set.stage(choice.threads);
    let shot = set.shot(FRAMES);
    let mut plain = settings.clone();
    plain.reuse.policy = Policy::Surface;
    let frames: Vec<u32> = (1..=FRAMES).collect();
    let maker = stage.maker(&plain, &shot, &frames);
    let (mut ratios, mut keys) = (Vec::new(), Vec::new());
    let (mut loops, mut betweens) = (Vec::new(), Vec::new());
    for frame in maker.batches(&frames).concat() {
        let camera = shot.camera(frame, settings.width, settings.height).expect("a camera");
        let turn = || bare.seconds(&stage.pool, &camera, settings.spp);
        let before = turn();
        let took = support::seconds(|| moves::make(&*maker, frame));
        let loop_seconds = support::quantile(&[before, turn(), turn()], 0.5);
        if frame == 1 || frame == FRAMES {
            keys.push(took / loop_seconds);
            continue;
        }
        ratios.push(took / loop_seconds);
        loops.push(1e3 * loop_seconds);
        betweens.push(1e3 * took);
    }
    vec![
        format!("{} camera, {} shadow", settings.spp, settings.shadow_samples),
        quartiles(&ratios),
        format!("{:.1}", support::quantile(&keys, 0.5)),
        quartiles(&loops),
        quartiles(&betweens),
    ]
}
