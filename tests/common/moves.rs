//! Camera moves by each policy, beside traced and converged frames of them.

#![allow(dead_code, missing_docs, reason = "the tests and the bench each use their part")]

use std::path::Path;
use std::sync::atomic::AtomicBool;
use tweenray::film::Film;
use tweenray::import::{self, LoadOptions};
use tweenray::intersect::EmbreeIntersector;
use tweenray::measure::psnr;
use tweenray::output::Display;
use tweenray::reuse::colour::AgreementRule;
use tweenray::scene::{Light, Policy, Scene, Settings, Shot, World};
use tweenray::sequence::{
    ColourMaker, FrameContext, FrameMaker, Made, Pyramid, SurfaceReuse, Tracer,
};
use tweenray::shade::{FrameJob, Renderer};

/// Some scenes of `scenes/`.
pub const SCENES: [&str; 5] =
    ["spheres_on_terrain", "cornell", "reflective_spheres", "demo", "street_at_night"];
/// Added to a frame's number for random numbers that nothing else in a job uses.
pub const CONVERGED: u32 = 5 << 27;

/// A scene and the move through it.
pub struct Set {
    pub scene: Scene,
    pub settings: Settings,
    pub shot: Shot,
}

impl Set {
    /// A scene of `scenes/`, after a `change`.
    pub fn load(name: &str, change: impl FnOnce(&mut World)) -> Self {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("scenes/{name}/scene.toml"));
        let mut loaded = import::load(&file, &LoadOptions::default()).expect("the scene loads");
        change(&mut loaded.world);
        Self { settings: loaded.settings, ..Self::of(loaded.world, loaded.shot) }
    }

    /// A world of one's own.
    pub fn of(world: World, shot: Shot) -> Self {
        let scene = world.into_scene(true).expect("a scene");
        Self { scene, settings: Settings::default(), shot }
    }

    /// The scene's settings at another size and with other samples, for light and sky alike.
    pub fn settings(&self, (width, height): (u32, u32), spp: u32, samples: u32) -> Settings {
        let own = self.settings.clone();
        Settings { width, height, spp, shadow_samples: samples, sky_samples: samples, ..own }
    }

    /// The same move in `frames` steps.
    pub fn shot(&self, frames: u32) -> Shot {
        Shot { frames, ..self.shot.clone() }
    }

    pub fn stage(&self, threads: usize) -> Stage<'_> {
        let rules = self.settings.rules;
        let intersector = EmbreeIntersector::new(&self.scene, rules, None, threads).expect("a BVH");
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        Stage { set: self, intersector, pool, stop: AtomicBool::new(false) }
    }
}

/// Moves all quads of light to the height `y`.
pub fn lower(world: &mut World, y: f64) {
    for light in &mut world.lights {
        if let Light::Quad(quad) = light {
            quad.corners.iter_mut().for_each(|c| c.y = y);
        }
    }
}

/// A scene, ready to render.
pub struct Stage<'s> {
    pub set: &'s Set,
    pub intersector: EmbreeIntersector<'s>,
    pub pool: rayon::ThreadPool,
    pub stop: AtomicBool,
}

impl Stage<'_> {
    pub fn renderer<'a>(&'a self, settings: &'a Settings) -> Renderer<'a> {
        Renderer::new(&self.set.scene, settings, &self.intersector)
    }

    /// The maker that the settings' policy calls for, which expects `frames`.
    pub fn maker<'a>(
        &'a self,
        settings: &'a Settings,
        shot: &'a Shot,
        frames: &[u32],
    ) -> Box<dyn FrameMaker + 'a> {
        let renderer = self.renderer(settings);
        let (pool, stop, progress, with_gbuffer) = (&self.pool, &self.stop, &(), false);
        let context = FrameContext { renderer, shot, pool, with_gbuffer, stop, progress };
        let reuse = &settings.reuse;
        let maker: Box<dyn FrameMaker + 'a> = match reuse.policy {
            Policy::Surface => {
                let pyramid = Pyramid { segment: reuse.segment, frames: shot.frames };
                Box::new(SurfaceReuse::new(context, pyramid).expect("cameras"))
            }
            Policy::Colour => {
                let maker = ColourMaker::new(context, AgreementRule::of(reuse), &[]);
                Box::new(maker.expect("cameras"))
            }
            Policy::Off => Box::new(Tracer::new(context)),
        };
        maker.expect(frames);
        maker
    }

    /// `frames` (ascending), each as it was made, made in the order that is best.
    pub fn frames(&self, settings: &Settings, shot: &Shot, frames: &[u32]) -> Vec<Made> {
        let maker = self.maker(settings, shot, frames);
        let mut made: Vec<(u32, Made)> = maker
            .batches(frames)
            .concat()
            .into_iter()
            .map(|frame| (frame, make(&*maker, frame)))
            .collect();
        made.sort_by_key(|(frame, _)| *frame);
        made.into_iter().map(|(_, made)| made).collect()
    }

    /// A frame, traced with the random numbers of `stream`.
    pub fn traced(&self, settings: &Settings, shot: &Shot, frame: u32, stream: u32) -> Film {
        let camera = shot.camera(frame, settings.width, settings.height).expect("a camera");
        let job = FrameJob::whole(&camera, stream);
        let render = || self.renderer(settings).render_job(&job, &self.stop, &());
        self.pool.install(render).expect("not stopped").film
    }

    /// A frame with many samples a light, of which no other frame has one. Its camera samples are
    /// those of every render of the pixel.
    pub fn converged(&self, settings: &Settings, shot: &Shot, frame: u32, samples: u32) -> Film {
        let best = Settings {
            shadow_samples: samples,
            least_shadow_samples: None,
            sky_samples: samples,
            least_sky_samples: None,
            ..settings.clone()
        };
        self.traced(&best, shot, frame, CONVERGED | frame)
    }
}

/// A frame of a maker that nobody stops.
pub fn make(maker: &dyn FrameMaker, frame: u32) -> Made {
    maker.make(frame).expect("made")
}

/// Channels as a png shows them, in [0, 1].
pub fn codes(settings: &Settings, film: &Film) -> Vec<[f64; 3]> {
    let display = Display { exposure: settings.exposure, tone: settings.tone };
    film.rgb.iter().map(|c| display.code(*c)).collect()
}

/// Peak signal-to-noise ratio of what is shown, dB.
pub fn psnr_of(settings: &Settings, film: &Film, truth: &Film) -> f64 {
    psnr(mean_square(&codes(settings, film), &codes(settings, truth)))
}

/// Mean squared difference of two pictures' channels.
pub fn mean_square(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    let channels = a.iter().flatten().zip(b.iter().flatten());
    channels.map(|(a, b)| (a - b) * (a - b)).sum::<f64>() / (3 * a.len()) as f64
}

/// Flicker: the mean squared error of the change from each frame to the next, of successive `films`
/// against the `truths`.
pub fn flicker(settings: &Settings, films: &[&Film], truths: &[&Film]) -> Vec<f64> {
    let errors: Vec<Vec<[f64; 3]>> = films
        .iter()
        .zip(truths)
        .map(|(film, truth)| {
            let pairs = codes(settings, film).into_iter().zip(codes(settings, truth));
            pairs.map(|(a, b)| [0, 1, 2].map(|k| a[k] - b[k])).collect()
        })
        .collect();
    errors.windows(2).map(|pair| mean_square(&pair[0], &pair[1])).collect()
}

/// A made frame with its number.
pub type Numbered = (u32, Made);
