//! What a frame may depend on, and what it must.

use crate::moves::{self, Set};
use crate::suite::{Outcome, Size};
use tweenray::film::Film;
use tweenray::math::{DVec3, Rgb};
use tweenray::scene::{Light, PointLight, ReuseSettings, Settings, World};
use tweenray::sequence::{FrameMaker, Made, fingerprint};

/// A scene that is edited has another fingerprint, so that no frame of the old one is kept or
/// referred to. (Within a job the scene cannot change.)
pub fn scene_change(_: Size) -> Outcome {
    let mut outcome = Outcome::default();
    let mut base = World::default();
    let mut shot = Set::load("cornell", |world| base = world.clone()).shot;
    let before = fingerprint(&base, &shot);
    type Edit = fn(&mut World);
    let edits: [(&str, Edit); 7] = [
        ("brighter light", |w| {
            let Light::Quad(quad) = &mut w.lights[0] else { panic!("cornell has a quad") };
            quad.radiance *= 1.0 + f32::EPSILON;
        }),
        ("light moved", |w| moves::lower(w, 2.48)),
        ("a further light", |w| {
            let (position, intensity) = (DVec3::ONE, Rgb::splat(1e-6));
            w.lights.push(Light::Point(PointLight { position, intensity }));
        }),
        ("sky", |w| w.sky.radiance.x += 1e-6),
        ("material", |w| w.materials[1].diffuse.y += 1e-6),
        ("vertex", |w| w.meshes[7].positions[3].z += 1e-9),
        ("mesh removed", |w| _ = w.meshes.pop()),
    ];
    for (name, edit) in edits {
        let mut world = base.clone();
        edit(&mut world);
        outcome.check(fingerprint(&world, &shot) != before, || format!("{name}: not seen"));
    }
    let mut renamed = base.clone();
    renamed.materials[0].name = "another".into();
    outcome.check(fingerprint(&renamed, &shot) == before, || "a name was taken for an edit".into());
    shot.frames += 1;
    outcome.check(fingerprint(&base, &shot) != before, || "a longer shot: not seen".into());
    outcome
}

fn made_in(set: &Set, settings: &Settings, threads: usize, frames: &[u32]) -> Vec<Made> {
    let stage = set.stage(threads);
    let maker = stage.maker(settings, &set.shot, frames);
    frames.iter().map(|frame| moves::make(&*maker as &dyn FrameMaker, *frame)).collect()
}

/// Whether two makes of a frame agree in all but the rays that a copy saves.
fn is_same(a: &Made, b: &Made) -> bool {
    // What the audit did not draw is NaN in its map.
    let map = |film: &Film| film.audit.iter().flatten().map(|x| x.to_bits()).collect::<Vec<_>>();
    a.film.rgb == b.film.rgb
        && a.film.provenance == b.film.provenance
        && a.reuse == b.reuse
        && a.audit == b.audit
        && map(&a.film) == map(&b.film)
}

/// The same bytes for any number of threads, any order and any part of the frames. Ranks start
/// processes: the command line's tests have them.
pub fn order_independence(size: Size) -> Outcome {
    let mut outcome = Outcome::default();
    // In the second the tolerance is a small part of what it is in the first.
    let scenes = ["cornell", "reflective_spheres", "demo"];
    for scene in size.of(&scenes[..2], &scenes[..]) {
        outcome.merge(order_of(scene, size));
    }
    outcome
}

fn order_of(scene: &str, size: Size) -> Outcome {
    const FRAMES: u32 = 13;
    let mut outcome = Outcome::default();
    let mut set = Set::load(scene, |_| ());
    set.shot = set.shot(FRAMES);
    let reuse = ReuseSettings { segment: 8, ..ReuseSettings::default() };
    let settings = Settings { reuse, ..set.settings(size.of((40, 40), (240, 160)), 1, 64) };
    let all: Vec<u32> = (1..=FRAMES).collect();
    let whole = set.stage(2).frames(&settings, &set.shot, &all);
    let inferred: u64 = whole.iter().map(|m| m.reuse.direct_inferred).sum();
    outcome.check(inferred > 0, || "nothing was inferred".into());
    let mut compare = |what: String, frames: &[u32], threads: usize| {
        let made = made_in(&set, &settings, threads, frames);
        for (frame, made) in frames.iter().zip(made) {
            let expected = &whole[*frame as usize - 1];
            outcome.check(is_same(&made, expected), || format!("{scene}, {what}: frame {frame}"));
        }
    };
    for threads in size.of(&[1, 3][..], &[1, 3, 16]) {
        compare(format!("{threads} threads"), &all, *threads);
    }
    compare("backwards".into(), &all.iter().rev().copied().collect::<Vec<_>>(), 2);
    compare("odd frames first".into(), &[7, 3, 11, 1, 13, 5, 9, 2, 12, 4, 10, 6, 8], 2);
    compare("one frame".into(), &[6], 2);
    compare("a part".into(), &[4, 5, 6, 11], 2);
    compare("one by one over the segments' ends".into(), &[8, 9, 10], 2);
    outcome
}
