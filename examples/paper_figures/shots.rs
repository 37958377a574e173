//! What is filmed, and the three ways of making a frame of it.

use std::path::Path;
use std::sync::atomic::AtomicBool;
use tweenray::film::{Film, Image};
use tweenray::import::{self, LoadOptions};
use tweenray::intersect::{self, Intersector};
use tweenray::math::{DVec3, Rgb};
use tweenray::reuse::colour::AgreementRule;
use tweenray::scene::{
    CameraPath, Light, Material, QuadLight, Scene, Settings, Shot, Sky, World, WorldMesh,
};
use tweenray::sequence::{ColourMaker, FrameContext, FrameMaker, Pyramid, SurfaceReuse};
use tweenray::shade::Renderer;

/// Frames of each move.
pub const FRAMES: u32 = 17;
const WIDTH: u32 = 320;
const HEIGHT: u32 = 240;

/// A scene and a camera move through it, ready to trace.
pub struct Filmed {
    scene: Scene,
    settings: Settings,
    shot: Shot,
    pool: rayon::ThreadPool,
}

/// The paper's test scene under a lamp so bright that shadows show, and a pan close by.
pub fn spheres() -> Filmed {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/reflective_spheres/scene.toml");
    let loaded = import::load(&file, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
    let mut world = loaded.world;
    for light in &mut world.lights {
        if let Light::Quad(lamp) = light {
            lamp.radiance *= 20.0;
        }
    }
    let (from, to) = (DVec3::new(2.2, 1.4, 4.6), DVec3::new(-2.2, 1.4, 4.6));
    Filmed::new(world, pan(from, to, DVec3::new(0.2, -0.1, -0.5)), loaded.settings)
}

/// A rabbit under a lamp, and a pan far to both sides of it.
pub fn rabbit(mesh: WorldMesh) -> Filmed {
    let mut world = World::default();
    world.materials.push(Material::diffuse("clay", Rgb::new(0.75, 0.55, 0.4)));
    world.materials.push(Material::diffuse("grass", Rgb::new(0.3, 0.45, 0.2)));
    world.meshes.push(WorldMesh { material: 0, ..mesh });
    let floor = [(-12.0, 12.0), (12.0, 12.0), (12.0, -12.0), (-12.0, -12.0)];
    world.meshes.push(WorldMesh::quad("floor", floor.map(|(x, z)| DVec3::new(x, 0.0, z)), 1));
    let lamp = [(-3.0, 1.0), (-1.0, 1.0), (-1.0, 3.0), (-3.0, 3.0)];
    let corners = lamp.map(|(x, z)| DVec3::new(x, 5.0, z));
    let radiance = Rgb::splat(14.0);
    world.lights.push(Light::Quad(QuadLight { corners, radiance, two_sided: false }));
    world.sky = Sky { radiance: Rgb::new(0.5, 0.6, 0.9), lights: false, ambient: Rgb::splat(0.15) };
    let (from, to) = (DVec3::new(1.6, 1.2, 2.9), DVec3::new(-1.6, 1.2, 2.9));
    let settings = Settings::default();
    Filmed::new(world, pan(from, to, DVec3::new(0.0, 0.6, 0.0)), settings)
}

fn pan(from: DVec3, to: DVec3, target: DVec3) -> Shot {
    let path = CameraPath::Pan { from, to, target, up: DVec3::Y, roll_degrees: 0.0 };
    Shot::new(path, FRAMES, 36.0)
}

impl Filmed {
    fn new(world: World, shot: Shot, settings: Settings) -> Self {
        let scene = world.into_scene(true).unwrap();
        let settings =
            Settings { width: WIDTH, height: HEIGHT, spp: 4, shadow_samples: 16, ..settings };
        let pool = rayon::ThreadPoolBuilder::new().build().unwrap();
        Self { scene, settings, shot, pool }
    }

    /// The paper's policy, `uploads` taken for frames.
    pub fn colour(&self, frame: u32, rule: AgreementRule, uploads: &[(u32, Image)]) -> Film {
        let intersector = self.intersector();
        let stop = no_stop();
        let maker = ColourMaker::new(self.context(&*intersector, &stop), rule, uploads);
        maker.unwrap().make(frame).unwrap().film
    }

    /// Ours.
    pub fn surface(&self, frame: u32) -> Film {
        let intersector = self.intersector();
        let stop = no_stop();
        let pyramid = Pyramid { segment: self.settings.reuse.segment, frames: FRAMES };
        let maker = SurfaceReuse::new(self.context(&*intersector, &stop), pyramid);
        maker.unwrap().make(frame).unwrap().film
    }

    fn context<'a>(
        &'a self,
        intersector: &'a dyn Intersector,
        stop: &'a AtomicBool,
    ) -> FrameContext<'a> {
        let (shot, pool, with_gbuffer, progress) = (&self.shot, &self.pool, false, &());
        let renderer = self.renderer(&self.settings, intersector);
        FrameContext { renderer, shot, pool, with_gbuffer, stop, progress }
    }

    /// Every pixel traced at the same settings; with first-hit records.
    pub fn traced(&self, frame: u32) -> Film {
        self.trace(frame, &self.settings)
    }

    /// The frame with little noise left.
    pub fn converged(&self, frame: u32) -> Film {
        self.trace(frame, &Settings { spp: 100, seed: 1, ..self.settings.clone() })
    }

    fn trace(&self, frame: u32, settings: &Settings) -> Film {
        let camera = self.shot.camera(frame, WIDTH, HEIGHT).unwrap();
        let intersector = self.intersector();
        let (renderer, stop) = (self.renderer(settings, &*intersector), no_stop());
        let render = || renderer.render(&camera, frame, true, &stop, &());
        self.pool.install(render).unwrap().0
    }

    fn intersector(&self) -> Box<dyn Intersector + '_> {
        let threads = self.pool.current_num_threads();
        self.pool.install(|| intersect::build(&self.scene, &self.settings, threads)).unwrap()
    }

    fn renderer<'a>(
        &'a self,
        settings: &'a Settings,
        intersector: &'a dyn Intersector,
    ) -> Renderer<'a> {
        Renderer::new(&self.scene, settings, intersector)
    }
}

fn no_stop() -> AtomicBool {
    AtomicBool::new(false)
}
