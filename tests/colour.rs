//! Policy `colour`: what it infers, what it traces, and that its bytes depend on nothing else.

#![allow(clippy::unwrap_used)]

mod common;

use std::sync::atomic::AtomicBool;
use tweenray::error::Result;
use tweenray::film::{Encoding, Film, Image, ProvenanceKind};
use tweenray::intersect;
use tweenray::math::{DVec3, Rgb, srgb_encode};
use tweenray::reuse::colour::AgreementRule;
use tweenray::scene::{
    CameraPath, DirectionalLight, Light, Material, QuadLight, Rect, Scene, Settings, Shot, Sky,
    ToneCurve, World, WorldSphere,
};
use tweenray::sequence::{ColourMaker, FrameContext, FrameMaker, Made, Tracer, check_upload};
use tweenray::shade::Renderer;
use tweenray::stats::RayKind;

/// A floor and a ball before the sky. Lit by the sun, which makes no noise, or by a lamp.
fn world(with_lamp: bool) -> World {
    let mut world = World::default();
    world.materials.push(Material::diffuse("floor", Rgb::new(0.6, 0.5, 0.4)));
    world.materials.push(Material::diffuse("ball", Rgb::new(0.7, 0.1, 0.1)));
    let floor = [(-9.0, 9.0), (9.0, 9.0), (9.0, -9.0), (-9.0, -9.0)];
    world.meshes.push(common::quad(floor.map(|(x, z)| DVec3::new(x, 0.0, z)), 0));
    let centre = DVec3::new(0.0, 1.2, 0.0);
    let (name, always_traced) = ("ball".into(), false);
    world.spheres.push(WorldSphere { name, centre, radius: 0.5, material: 1, always_traced });
    if with_lamp {
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        let corners = corners.map(|(x, z)| DVec3::new(x, 4.0, z));
        let radiance = Rgb::splat(8.0);
        world.lights.push(Light::Quad(QuadLight { corners, radiance, two_sided: false }));
    } else {
        let to_light = DVec3::new(0.3, 1.0, 0.5).normalize();
        world
            .lights
            .push(Light::Directional(DirectionalLight { to_light, irradiance: Rgb::splat(2.0) }));
    }
    world.sky = Sky { radiance: Rgb::new(0.1, 0.15, 0.3), lights: false, ambient: Rgb::ZERO };
    world
}

/// A move of nine frames of a small picture.
struct Move {
    scene: Scene,
    settings: Settings,
    shot: Shot,
    threads: usize,
}

const FRAMES: u32 = 9;
/// That of the settings.
const USUAL: AgreementRule = AgreementRule { colour_epsilon: 0.02, distance_epsilon: 0.02 };
const STRICT: AgreementRule = AgreementRule { colour_epsilon: 0.0, distance_epsilon: 0.0 };

impl Move {
    fn new(world: World, from: (f64, f64, f64), to: (f64, f64, f64), target: DVec3) -> Self {
        let settings =
            Settings { width: 61, height: 43, spp: 2, shadow_samples: 2, ..Settings::default() };
        let (from, to) = (from.into(), to.into());
        let path = CameraPath::Pan { from, to, target, up: DVec3::Y, roll_degrees: 0.0 };
        let shot = Shot::new(path, FRAMES, 40.0);
        Self { scene: world.into_scene(true).unwrap(), settings, shot, threads: 2 }
    }

    /// A sideways pan with the ball against floor and sky. Not symmetric: the middle column would
    /// see the same twice.
    fn pan(with_lamp: bool, far: f64) -> Self {
        let target = DVec3::new(0.0, 1.0, 0.0);
        Self::new(world(with_lamp), (-far, 1.4, 5.0), (1.1 * far, 1.4, 5.0), target)
    }

    /// The films of `frames`, made in this order by one maker.
    fn films(
        &self,
        rule: AgreementRule,
        uploads: &[(u32, Image)],
        frames: &[u32],
    ) -> Result<Vec<Made>> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(self.threads).build().unwrap();
        let intersector = intersect::build(&self.scene, &self.settings, 1).unwrap();
        let renderer = Renderer::new(&self.scene, &self.settings, &*intersector);
        let stop = AtomicBool::new(false);
        let maker = ColourMaker::new(self.context(renderer, &pool, &stop), rule, uploads)?;
        maker.expect(frames);
        frames.iter().map(|frame| maker.make(*frame)).collect()
    }

    fn all(&self, rule: AgreementRule, uploads: &[(u32, Image)]) -> Vec<Made> {
        self.films(rule, uploads, &(1..=FRAMES).collect::<Vec<_>>()).unwrap()
    }

    /// Every frame traced.
    fn traced(&self) -> Vec<Film> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
        let intersector = intersect::build(&self.scene, &self.settings, 1).unwrap();
        let renderer = Renderer::new(&self.scene, &self.settings, &*intersector);
        let stop = AtomicBool::new(false);
        let tracer = Tracer::new(self.context(renderer, &pool, &stop));
        (1..=FRAMES).map(|frame| tracer.make(frame).unwrap().film).collect()
    }

    fn context<'a>(
        &'a self,
        renderer: Renderer<'a>,
        pool: &'a rayon::ThreadPool,
        stop: &'a AtomicBool,
    ) -> FrameContext<'a> {
        let (shot, with_gbuffer, progress) = (&self.shot, false, &());
        FrameContext { renderer, shot, pool, with_gbuffer, stop, progress }
    }
}

fn count(film: &Film, kind: ProvenanceKind) -> usize {
    let sources = film.provenance.as_ref().unwrap();
    sources.iter().filter(|s| s.kind == kind).count()
}

#[test]
fn first_and_last_frame_are_traced_as_without_the_policy() {
    let pan = Move::pan(true, 0.3);
    let (made, traced) = (pan.all(USUAL, &[]), pan.traced());
    for k in [0, FRAMES as usize - 1] {
        assert_eq!(made[k].film.rgb, traced[k].rgb);
        assert_eq!(count(&made[k].film, ProvenanceKind::Traced), 61 * 43);
    }
    let between = &made[4];
    let inferred = count(&between.film, ProvenanceKind::Both);
    assert!(inferred > 500, "{inferred} pixels inferred");
    assert_eq!(between.reuse.direct_inferred, inferred as u64);
    assert_eq!(between.reuse.direct, 61 * 43);
    assert_eq!(between.rays[RayKind::Camera], 2 * (61 * 43 - inferred as u64));
}

#[test]
fn where_nothing_agrees_every_frame_is_the_traced_one() {
    // The floor in a lamp's noisy light; no sky, which would agree with itself.
    let target = DVec3::new(0.0, 0.0, 0.0);
    let down = Move::new(world(true), (-2.0, 3.0, 0.7), (2.2, 3.0, 0.7), target);
    for (made, traced) in down.all(STRICT, &[]).iter().zip(down.traced()) {
        assert_eq!(count(&made.film, ProvenanceKind::Traced), 61 * 43);
        assert_eq!(made.film.rgb, traced.rgb);
    }
}

#[test]
fn without_epsilons_a_moving_camera_infers_the_sky_and_what_is_traced_is_traced_right() {
    let mut pan = Move::pan(true, 0.5);
    // With one sample a pixel is sky or it is not.
    pan.settings.spp = 1;
    let (made, traced) = (pan.all(STRICT, &[]), pan.traced());
    let sky = pan.scene.sky.radiance;
    for (made, traced) in made.iter().zip(&traced).skip(1).take(FRAMES as usize - 2) {
        assert!(count(&made.film, ProvenanceKind::Both) > 100);
        let sources = made.film.provenance.as_ref().unwrap();
        for ((source, rgb), truth) in sources.iter().zip(&made.film.rgb).zip(&traced.rgb) {
            match source.kind {
                ProvenanceKind::Traced => assert_eq!(rgb, truth),
                _ => assert_eq!(*rgb, sky),
            }
        }
    }
}

#[test]
fn a_still_camera_in_light_without_noise_traces_two_frames() {
    let still = Move::pan(false, 0.0);
    let made = still.all(STRICT, &[]);
    for between in &made[1..FRAMES as usize - 1] {
        assert_eq!(count(&between.film, ProvenanceKind::Both), 61 * 43);
        assert_eq!(between.rays[RayKind::Camera], 0);
        assert_eq!(between.film.rgb, made[0].film.rgb);
    }
}

#[test]
fn a_larger_epsilon_infers_more() {
    let pan = Move::pan(true, 0.5);
    let inferred = |colour_epsilon, distance_epsilon| {
        let made = pan.all(AgreementRule { colour_epsilon, distance_epsilon }, &[]);
        made.iter().map(|m| m.reuse.direct_inferred).sum::<u64>()
    };
    let (strict, colour, both) = (inferred(0.0, 0.0), inferred(0.1, 0.0), inferred(0.1, 0.1));
    assert!(strict <= colour && colour < both, "{strict} {colour} {both}");
    assert_eq!(inferred(f32::INFINITY, f32::INFINITY), 7 * 61 * 43);
}

#[test]
fn threads_order_and_range_change_no_byte() {
    let mut pan = Move::pan(true, 0.5);
    let whole = pan.all(USUAL, &[]);
    assert!(whole[1].reuse.direct_inferred > 0 && whole[1].rays[RayKind::Camera] > 0);
    for threads in [1, 3] {
        pan.threads = threads;
        let again = pan.all(USUAL, &[]);
        assert!(again.iter().zip(&whole).all(|(a, b)| a.film == b.film), "{threads} threads");
    }
    let backwards: Vec<u32> = (1..=FRAMES).rev().collect();
    for frames in [vec![6], vec![2, 7], backwards, vec![1, 9, 5, 3, 2, 4, 7, 6, 8]] {
        let part = pan.films(USUAL, &[], &frames).unwrap();
        for (frame, made) in frames.iter().zip(part) {
            assert!(made.film == whole[*frame as usize - 1].film, "frame {frame} of {frames:?}");
        }
    }
}

#[test]
fn a_crop_is_black_outside_and_knows_only_itself() {
    let mut pan = Move::pan(true, 0.5);
    let whole = pan.all(USUAL, &[]);
    pan.settings.crop = Some(Rect { x0: 13, y0: 6, x1: 41, y1: 30 });
    for (part, whole) in pan.all(USUAL, &[]).iter().zip(&whole) {
        for (x, y, rgb) in common::pixels(&part.film) {
            let inside = (13..41).contains(&x) && (6..30).contains(&y);
            let expected = if inside { whole.film.rgb[whole.film.index(x, y)] } else { Rgb::ZERO };
            assert_eq!(rgb, expected, "{x},{y}");
        }
        assert_eq!(part.reuse.direct, 28 * 24);
    }
}

/// The film as a png holds it.
fn picture(film: &Film) -> Image {
    let encode =
        |v: f32| (srgb_encode(f64::from(v.clamp(0.0, 1.0))) * 255.0).round() as f32 / 255.0;
    let rgb = film.rgb.iter().map(|c| Rgb::new(encode(c.x), encode(c.y), encode(c.z)));
    Image::new(film.width, film.height, rgb.collect(), Encoding::Srgb).unwrap()
}

#[test]
fn a_surface_that_passes_between_two_samples_is_missed_unless_a_picture_is_uploaded() {
    // From far left past the ball to far right, looking ahead: only frames between see the ball.
    let mut pan = Move::pan(false, 0.0);
    pan.shot.path = CameraPath::Keys(
        [(-4.0, 0.0), (4.0, 1.0)]
            .map(|(x, at)| tweenray::scene::KeyPose {
                at,
                pose: common::pose((x, 1.4, 5.0), (x, 1.4, 0.0)),
            })
            .to_vec(),
    );
    let traced = pan.traced();
    let redness = |film: &Film| film.rgb.iter().filter(|c| c.x > 2.0 * c.z).count();
    assert!(redness(&traced[4]) > 50 && redness(&traced[0]) == 0 && redness(&traced[8]) == 0);
    let loose = AgreementRule { colour_epsilon: 0.1, distance_epsilon: 0.1 };
    assert_eq!(redness(&pan.all(loose, &[])[4].film), 0);
    let uploads = [(5, picture(&traced[4]))];
    let with_upload = pan.all(loose, &uploads);
    assert_eq!(redness(&with_upload[4].film), redness(&traced[4]));
    assert_eq!(with_upload[4].rays[RayKind::Camera], 0);
    let apart = with_upload[4].film.rgb.iter().zip(&traced[4].rgb).map(|(a, b)| (*a - *b).abs());
    assert!(apart.fold(0.0, |most, d| d.max_element().max(most)) < 0.01);
    // Where the ball is in the picture the frames beside it disagree, and are traced.
    let cast = |made: &[Made]| made.iter().map(|m| m.rays[RayKind::Camera]).sum::<u64>();
    assert!(cast(&with_upload) > cast(&pan.all(loose, &[])));
}

#[test]
fn an_uploaded_picture_has_no_distances() {
    // Flat light: the floor has one colour, whatever its distance.
    let mut flat = world(false);
    flat.spheres.clear();
    let target = DVec3::new(0.0, 0.0, 0.0);
    let dive = Move::new(flat, (0.0, 2.0, 0.1), (0.0, 4.0, 0.1), target);
    let apart = AgreementRule { colour_epsilon: 0.01, distance_epsilon: 0.05 };
    assert_eq!(dive.all(apart, &[])[4].reuse.direct_inferred, 0);
    let middle = [(5, picture(&dive.traced()[4]))];
    let made = dive.all(apart, &middle);
    assert_eq!(made[2].reuse.direct_inferred, 61 * 43);
}

#[test]
fn pictures_that_do_not_fit_are_refused() {
    let pan = Move::pan(false, 0.1);
    let image = picture(&pan.traced()[0]);
    let refused = |uploads: &[(u32, Image)]| pan.films(USUAL, uploads, &[1]).err().unwrap();
    for frame in [0, 10] {
        let error = refused(&[(frame, image.clone())]).to_string();
        assert!(error.contains(&format!("frame {frame}")) && error.contains("1..9"), "{error}");
    }
    let error = refused(&[(2, image.clone()), (2, image.clone())]).to_string();
    assert!(error.contains("frame 2"), "{error}");
    let small = Image::new(2, 1, vec![Rgb::ZERO; 2], Encoding::Srgb).unwrap();
    let error = refused(&[(2, small)]).to_string();
    assert!(error.contains("2x1") && error.contains("61x43"), "{error}");
    let filmic = Settings { tone: ToneCurve::Filmic, ..pan.settings.clone() };
    assert!(check_upload(1, &image, &pan.shot, &filmic).is_err());
    let linear = Image { encoding: Encoding::Linear, ..image };
    assert!(check_upload(1, &linear, &pan.shot, &filmic).is_ok());
}

#[test]
fn exposure_is_taken_out_of_an_uploaded_picture() {
    let mut pan = Move::pan(false, 0.1);
    let mut bright = pan.traced()[4].clone();
    bright.rgb.iter_mut().for_each(|c| *c *= 0.5);
    pan.settings.exposure = 0.5;
    let made = pan.films(USUAL, &[(5, picture(&bright))], &[5]).unwrap();
    let traced = &pan.traced()[4];
    let apart = made[0].film.rgb.iter().zip(&traced.rgb).map(|(a, b)| (*a - *b).abs());
    assert!(apart.fold(0.0, |most, d| d.max_element().max(most)) < 0.02);
}
