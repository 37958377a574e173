//! Short shots of a scene, audited, beside their true errors over all pixels.

use std::path::Path;
use std::sync::atomic::AtomicBool;
use tweenray::film::Film;
use tweenray::import::{self, LoadOptions, Loaded};
use tweenray::intersect::EmbreeIntersector;
use tweenray::math::Rgb;
use tweenray::output::Display;
use tweenray::reuse::audit::{Rmse, rmse};
use tweenray::scene::{Camera, CameraPath, ReuseSettings, Scene, Settings, Shot};
use tweenray::sequence::{FrameContext, FrameMaker, Pyramid, SurfaceReuse};
use tweenray::shade::{FrameJob, Renderer, Sampling};
use tweenray::stats::AuditSums;

/// How the shots of a trial are rendered.
#[derive(Debug, Clone, Copy)]
pub struct Trial {
    pub edge: u32,
    pub frames: u32,
    pub spp: u32,
    /// Most camera samples of a pixel, if they differ.
    pub most_spp: Option<u32>,
    /// Share of the pixels that are probed.
    pub share: f32,
    /// Shadow samples of each of the two converged renders.
    pub best: u32,
}

/// Mean squared errors, squares of a display step.
#[derive(Debug, Clone, Copy, Default)]
pub struct Truth {
    pub inferred: f64,
    pub inferred_pixels: u64,
    pub shown: f64,
    pub traced: f64,
}

/// What one shot's audit said, and what is true.
pub struct Audited {
    pub sums: AuditSums,
    pub rmse: Rmse,
    pub truth: Truth,
}

/// A scene of `scenes/`, read.
pub struct Set {
    pub loaded: Loaded,
    pub scene: Scene,
}

/// The scene, ready to render.
pub struct Stage<'s> {
    pub set: &'s Set,
    pub intersector: EmbreeIntersector<'s>,
    pub pool: rayon::ThreadPool,
}

impl Set {
    pub fn load(name: &str) -> Self {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("scenes/{name}/scene.toml"));
        let loaded = import::load(&file, &LoadOptions::default()).expect("the scene loads");
        let scene = loaded.world.clone().into_scene(true).expect("a scene");
        Self { loaded, scene }
    }

    pub fn stage(&self, threads: usize) -> Stage<'_> {
        let rules = self.loaded.settings.rules;
        let intersector = EmbreeIntersector::new(&self.scene, rules, None, threads).expect("a BVH");
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        Stage { set: self, intersector, pool }
    }
}

impl Stage<'_> {
    /// Settings of shot `number`: 48, 64 or 80 shadow samples, and a seed of its own.
    pub fn settings(&self, trial: &Trial, number: u32) -> Settings {
        let samples = [48, 64, 80][number as usize % 3];
        Settings {
            width: trial.edge,
            height: trial.edge,
            spp: trial.spp,
            most_spp: trial.most_spp,
            shadow_samples: samples,
            sky_samples: samples,
            seed: 1000 + u64::from(number),
            reuse: ReuseSettings { probes: trial.share, ..ReuseSettings::default() },
            ..self.set.loaded.settings.clone()
        }
    }

    /// The scene's move, shortened and turned a little differently for each number.
    pub fn shot(&self, trial: &Trial, number: u32) -> Shot {
        let mut shot = Shot { frames: trial.frames, ..self.set.loaded.shot.clone() };
        let (part, turn) = (0.2 + 0.08 * f64::from(number % 11), 0.05 * f64::from(number % 7));
        match &mut shot.path {
            CameraPath::Pan { from, to, target, .. } => {
                let middle = (*from + *to) * 0.5;
                (*from, *to) = (middle + (*from - middle) * part, middle + (*to - middle) * part);
                target.x += turn - 0.15;
            }
            CameraPath::BSpline { target, .. } => target.x += turn - 0.15,
            _ => {}
        }
        shot
    }

    pub fn renderer<'a>(&'a self, settings: &'a Settings) -> Renderer<'a> {
        Renderer::new(&self.set.scene, settings, &self.intersector)
    }

    pub fn context<'a>(
        &'a self,
        settings: &'a Settings,
        shot: &'a Shot,
        stop: &'a AtomicBool,
    ) -> FrameContext<'a> {
        let (renderer, pool, progress) = (self.renderer(settings), &self.pool, &());
        FrameContext { renderer, shot, pool, with_gbuffer: false, stop, progress }
    }

    /// Renders and audits shot `number`, then renders its frames again, traced and converged.
    pub fn audited(&self, trial: &Trial, number: u32) -> Audited {
        let (settings, shot) = (self.settings(trial, number), self.shot(trial, number));
        self.audited_shot(&settings, &shot, trial.best)
    }

    /// The same for a shot of one's own; `best` shadow samples converge.
    pub fn audited_shot(&self, settings: &Settings, shot: &Shot, best: u32) -> Audited {
        let best = Settings { shadow_samples: best, sky_samples: best, ..settings.clone() };
        let stop = AtomicBool::new(false);
        let pyramid = Pyramid { segment: 64, frames: shot.frames };
        let frames: Vec<u32> = (1..=pyramid.frames).collect();
        let maker =
            SurfaceReuse::new(self.context(settings, shot, &stop), pyramid).expect("cameras");
        maker.expect(&frames);
        let (mut sums, mut truth) = (AuditSums::default(), Truth::default());
        for frame in pyramid.order(&frames) {
            let made = maker.make(frame).expect("made");
            let Some(audit) = made.audit else { continue };
            sums += audit;
            let camera = shot.camera(frame, settings.width, settings.height).expect("a camera");
            // Each pixel with as many camera samples as it shows: the audit knows nothing of the error at edges.
            let counts = made.film.samples.as_deref();
            let render = |settings, stream| self.render_as(settings, &camera, stream, counts);
            let converged = [render(&best, frame | 5 << 27), render(&best, frame | 6 << 27)];
            let traced = render(settings, frame);
            truth.add(settings, &made.film, &traced, &converged);
        }
        truth.inferred /= truth.inferred_pixels.max(1) as f64;
        truth.shown /= sums.pixels as f64;
        truth.traced /= sums.pixels as f64;
        Audited { sums, rmse: rmse(&sums).expect("pixels were drawn"), truth }
    }

    pub fn render(&self, settings: &Settings, camera: &Camera, stream: u32) -> Film {
        self.render_as(settings, camera, stream, None)
    }

    /// With so many camera samples in each pixel, if there are `counts`.
    fn render_as(
        &self,
        settings: &Settings,
        camera: &Camera,
        stream: u32,
        counts: Option<&[u32]>,
    ) -> Film {
        let sampling = counts.map_or(Sampling::Neighbours, Sampling::As);
        let job = FrameJob { sampling, ..FrameJob::whole(camera, stream) };
        let stop = AtomicBool::new(false);
        let render = || self.renderer(settings).render_job(&job, &stop, &());
        self.pool.install(render).expect("not stopped").film
    }
}

impl Truth {
    /// Adds the squared errors of a frame. With two converged renders the product of differences
    /// is free of their own noise.
    fn add(&mut self, settings: &Settings, shown: &Film, traced: &Film, converged: &[Film; 2]) {
        let display = Display { exposure: settings.exposure, tone: settings.tone };
        let [a, b] = converged;
        for (i, source) in shown.provenance.as_ref().expect("sources").iter().enumerate() {
            let error = |c: Rgb| {
                let [c, a, b] = [c, a.rgb[i], b.rgb[i]].map(|c| display.code(c));
                (0..3).map(|k| (c[k] - a[k]) * (c[k] - b[k])).sum::<f64>() * 255.0 * 255.0 / 3.0
            };
            let own = error(shown.rgb[i]);
            self.shown += own;
            self.traced += error(traced.rgb[i]);
            if source.is_inferred() {
                self.inferred += own;
                self.inferred_pixels += 1;
            }
        }
    }
}
