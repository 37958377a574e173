//! Meshes that emit and are seen as they are: by an image, or beside what they reflect.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "shows what it measured")]

mod common;

use common::{Job, job, mean, pose, render, render_scene};
use tweenray::film::Film;
use tweenray::math::{DAffine2, DVec2, DVec3, Rgb, Vec2};
use tweenray::scene::{
    AlphaMask, Corners, IntersectorKind, Light, Material, SphereLight, Texture, TextureMap, World,
    WorldMesh, Wrap,
};

/// Edge of the square panel, scene units.
const EDGE: f64 = 1.2;

/// Radiance of the panel at `x`, `y` from 0 to 1, (0, 0) its lower left corner as its front is seen.
type Picture = fn(f64, f64) -> f64;

const PICTURES: [(&str, Picture); 4] = [
    ("one half", |x, _| if x < 0.5 { 3.0 } else { 0.0 }),
    ("checks", |x, y| if ((8.0 * x) as i32 + (8.0 * y) as i32) % 2 == 0 { 4.0 } else { 0.2 }),
    ("ramp", |x, y| 0.1 + 2.0 * x * x + y),
    ("spot", |x, y| if (x - 0.7).hypot(y - 0.3) < 0.12 { 40.0 } else { 0.01 }),
];

fn image(picture: Picture) -> Texture {
    let n = 64;
    let at = |i: u32| (f64::from(i) + 0.5) / f64::from(n);
    // Rows from the top.
    let texel = |i: u32| Rgb::splat(picture(at(i % n), 1.0 - at(i / n)) as f32);
    Texture::from_linear("panel", [n, n], (0..n * n).map(texel).collect())
}

/// A panel that faces down at `height` above a grey floor, of two triangles or of many.
fn lit_floor(picture: Picture, height: f64, cuts: u32) -> World {
    let mut world = common::plate(Material::diffuse("floor", Rgb::splat(0.5)), 4.0);
    world.textures.push(image(picture));
    let mut panel = Material::diffuse("panel", Rgb::splat(0.3));
    let map = TextureMap { wrap: [Wrap::Clamp; 2], ..TextureMap::of(0) };
    (panel.emission, panel.emission_map) = (Rgb::new(1.0, 0.5, 2.0), Some(map));
    world.materials.push(panel);
    let n = cuts + 1;
    let share = |i: u32| f64::from(i) / f64::from(cuts);
    let (mut positions, mut uvs) = (Vec::new(), Vec::new());
    for (i, j) in (0..n).flat_map(|j| (0..n).map(move |i| (i, j))) {
        positions.push(DVec3::new((share(i) - 0.5) * EDGE, height, (share(j) - 0.5) * EDGE));
        uvs.push(Vec2::new(share(i) as f32, share(j) as f32));
    }
    let mut triangles = Vec::new();
    for (i, j) in (0..cuts).flat_map(|j| (0..cuts).map(move |i| (i, j))) {
        let a = i + j * n;
        // Down: clockwise in x and z as they stand.
        triangles.extend([[a, a + 1, a + n + 1], [a, a + n + 1, a + n]]);
    }
    let mesh = WorldMesh::new("panel", positions, triangles, 1);
    world.meshes.push(WorldMesh { uvs: Some(Corners { values: uvs, corners: None }), ..mesh });
    world
}

/// Irradiance of the panel at `p` of the floor per unit of its colour.
fn irradiance(picture: Picture, height: f64, p: DVec3) -> f64 {
    let n = 256;
    let at = |i: u32| (f64::from(i) + 0.5) / f64::from(n);
    let cell = (EDGE / f64::from(n)).powi(2);
    let part = |i: u32| {
        let (x, y) = (at(i % n), at(i / n));
        let to = DVec3::new((x - 0.5) * EDGE, height, (y - 0.5) * EDGE) - p;
        picture(x, y) * height * height / to.length_squared().powi(2) * cell
    };
    (0..n * n).map(part).sum()
}

/// Worst error of the floor over its brightest point, and the greatest value.
fn worst(job: &Job, picture: Picture, height: f64) -> f64 {
    let (film, _) = render(job);
    let (mut most, mut brightest) = (0.0f64, 0.0f64);
    for (x, y, rgb) in common::pixels(&film) {
        let p = common::on_plane_y(job, x, y, 0.0);
        // Else the panel's back is before it.
        if p.x < 0.0 {
            continue;
        }
        let expected = 0.5 / std::f64::consts::PI * irradiance(picture, height, p);
        for (channel, colour) in [(0, 1.0), (1, 0.5), (2, 2.0)] {
            most = most.max((f64::from(rgb[channel]) / colour - expected).abs());
        }
        brightest = brightest.max(expected);
    }
    most / brightest
}

#[test]
fn an_image_lights_the_floor_as_its_integral_says() {
    for (name, picture) in PICTURES {
        for (cuts, kind) in [
            (1, IntersectorKind::Embree),
            (7, IntersectorKind::Oracle),
            // More faces than lights.
            (60, IntersectorKind::Embree),
        ] {
            let mut worsts = Vec::new();
            for height in [0.3, 0.6, 1.2, 2.4] {
                let world = lit_floor(picture, height, cuts);
                // From beside the panel, steeply: only floor is seen.
                let mut job = job(world, pose((3.0, 1.0, 0.0), (1.2, 0.0, 0.0)), 24, 18);
                (job.settings.intersector, job.settings.shadow_samples) = (kind, 1);
                job.settings.all_lights = true;
                worsts.push(worst(&job, picture, height));
            }
            println!("{name}, {cuts} cuts: worst errors by height {worsts:.4?}");
            // At a quarter of the panel's width what differs within a part shows.
            let limits = [0.03, 0.01, 0.01, 0.01];
            let is_near = worsts.iter().zip(limits).all(|(worst, limit)| *worst < limit);
            assert!(is_near, "{name} {worsts:?}");
        }
    }
}

/// Convex bodies that emit and reflect, with flat and with smooth normals: none lights itself.
#[test]
fn a_convex_body_does_not_light_itself() {
    let smooth = |n: u32| {
        let mesh = common::uv_sphere(2 * n, n);
        let values = mesh.positions.iter().map(|p| p.as_vec3().normalize()).collect();
        WorldMesh { normals: Some(Corners { values, corners: None }), ..mesh }
    };
    let bodies = [
        ("cube", common::cube(DVec3::ZERO, 0.5, 0)),
        ("flat ball", common::uv_sphere(400, 200)),
        ("coarse ball", smooth(8)),
        ("ball", smooth(30)),
    ];
    for (name, body) in &bodies {
        for (turn, far, two_sided) in [(0.0, 0.0, true), (0.7, 0.0, false), (0.7, 3000.0, true)] {
            let mut world = World::default();
            let mut glow = Material::diffuse("glow", Rgb::splat(0.9));
            (glow.emission, glow.emits_back) = (Rgb::splat(0.25), two_sided);
            world.materials.push(glow);
            let away = DVec3::new(far, 0.0, far);
            let (mut mesh, turned) = (body.clone(), turn_by(turn));
            mesh.positions.iter_mut().for_each(|p| *p = turned(*p) + away);
            for normals in mesh.normals.iter_mut().flat_map(|n| &mut n.values) {
                *normals = turned(normals.as_dvec3()).as_vec3();
            }
            let mesh_is_smooth = mesh.normals.is_some();
            world.meshes.push(mesh);
            let eye = (far + 1.7, 1.3, far + 2.1);
            let mut job = job(world, pose(eye, (far, 0.0, far)), 60, 45);
            (job.settings.spp, job.settings.shadow_samples) = (1, 4);
            let (film, _) = render(&job);
            let seen: Vec<f32> = film.rgb.iter().map(|c| c.y).filter(|y| *y > 0.0).collect();
            assert!(seen.len() > 500, "{}", seen.len());
            let worst = seen.iter().map(|y| (y - 0.25).abs()).fold(0.0, f32::max);
            println!("{name} turned by {turn} at {far}: {} pixels, off by {worst:e}", seen.len());
            // Where normals are smooth, shadow rays start a little above facets and see over their edges.
            let limit = if mesh_is_smooth { 0.02 * 0.25 } else { 1e-6 };
            assert!(worst < limit, "{worst}");
        }
    }
}

/// A turn about the axis (1, 2, 3).
fn turn_by(angle: f64) -> impl Fn(DVec3) -> DVec3 {
    let axis = DVec3::new(1.0, 2.0, 3.0).normalize();
    move |p| {
        let (sin, cos) = angle.sin_cos();
        p * cos + axis.cross(p) * sin + axis * (axis.dot(p) * (1.0 - cos))
    }
}

/// What a surface emits stands beside what it reflects, seen directly and in a mirror.
#[test]
fn emission_and_reflection_add_up() {
    let mut world = lit_floor(|x, _| x, 2.0, 1);
    world.materials[1].diffuse = Rgb::splat(0.4);
    world.lights.push(Light::Point(tweenray::scene::PointLight {
        position: DVec3::new(0.2, 0.4, 0.1),
        intensity: Rgb::splat(1.5),
    }));
    world.materials[0] = Material::mirror("floor", Rgb::splat(0.8));
    // Once straight up, once by the mirror at y = 0.
    let mut seen = Vec::new();
    for (eye, target, share) in
        [((0.3, 0.5, 0.4), (0.1, 2.0, 0.0), 1.0), ((0.3, 0.5, 0.4), (0.1, -2.0, 0.0), 0.8)]
    {
        let mut job = job(world.clone(), pose(eye, target), 31, 23);
        // Else samples choose among the panel's lights and the point.
        job.settings.all_lights = true;
        let (film, _) = render(&job);
        for (x, y, rgb) in common::pixels(&film) {
            let p = match share {
                1.0 => common::on_plane_y(&job, x, y, 2.0),
                _ => common::on_plane_y(&job, x, y, -2.0) * DVec3::new(1.0, -1.0, 1.0),
            };
            let inside = p.x.abs().max(p.z.abs()) < 0.4 * EDGE;
            if !inside {
                continue;
            }
            let to = DVec3::new(0.2, 0.4, 0.1) - p;
            let cos = -to.y / to.length();
            let reflected = 0.4 / std::f64::consts::PI * 1.5 * cos / to.length_squared();
            let emitted = p.x / EDGE + 0.5;
            let expected = share * (reflected + emitted);
            let off = (f64::from(rgb.x) / expected - 1.0).abs();
            seen.push(off);
        }
    }
    let worst = seen.iter().copied().fold(0.0, f64::max);
    println!("{} pixels, worst relative error {worst:.5}", seen.len());
    // The image is read between texels.
    assert!(seen.len() > 300 && worst < 0.005, "{worst}");
}

/// A rough mirror sees the panel by samples of its lights and by its own rays; together they are what its own rays alone see.
#[test]
fn gloss_sees_an_emitting_image_once() {
    for roughness in [0.15, 0.4, 0.8] {
        // Of 60 cuts there are more faces than lights.
        for (picture, cuts) in [(PICTURES[0].1, 2), (PICTURES[1].1, 2), (PICTURES[1].1, 60)] {
            let mut world = lit_floor(picture, 0.8, cuts);
            world.materials[0] =
                Material { roughness, ..Material::mirror("floor", Rgb::splat(0.9)) };
            let of = |lit: bool, seed: u64, samples: u32| {
                let mut job = job(world.clone(), pose((1.6, 0.5, 0.2), (0.2, 0.0, 0.0)), 32, 24);
                (job.settings.spp, job.settings.seed) = (samples, seed);
                let mut scene = job.world.clone().into_scene(true).unwrap();
                if !lit {
                    scene.lights.clear();
                    scene.light_cells = None;
                    scene.meshes.iter_mut().for_each(|mesh| mesh.lights = None);
                }
                render_scene(&scene, &job).0
            };
            let means = |lit: bool| -> (f64, f64) {
                let all: Vec<f64> = (0..6).map(|seed| mean(&of(lit, seed, 64))).collect();
                let m = all.iter().sum::<f64>() / 6.0;
                let spread = all.iter().map(|x| (x - m).powi(2)).sum::<f64>() / 30.0;
                (m, spread.sqrt())
            };
            let ((a, sa), (b, sb)) = (means(true), means(false));
            println!(
                "roughness {roughness}, {cuts} cuts: {a:.5} ± {sa:.5}, by its own rays {b:.5} ± {sb:.5}"
            );
            assert!((a - b).abs() < 4.0 * sa.hypot(sb) + 0.005 * b, "{a} {b}");
        }
    }
}

fn film_on(job: &Job, threads: usize) -> Film {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| render(job).0)
}

#[test]
fn the_same_bytes_for_any_threads() {
    let mut job =
        job(lit_floor(PICTURES[3].1, 0.7, 5), pose((2.0, 1.0, 0.5), (0.0, 0.3, 0.0)), 61, 43);
    (job.settings.spp, job.settings.shadow_samples) = (4, 4);
    assert!(film_on(&job, 1) == film_on(&job, 3));
}

/// Faces that are nearly black by an image are no lights, and of too many faces some send the light of all.
#[test]
fn dim_faces_light_nothing_and_groups_of_too_many_send_all_light() {
    // Number of lights, and what they send: area times radiance.
    let sent = |world: World| {
        let lights = world.into_scene(true).unwrap().lights;
        let sent = lights.iter().map(|light| match light {
            Light::Face(light) => light.part.area() * f64::from(light.part.radiance.x),
            other => panic!("{other:?}"),
        });
        (lights.len(), sent.sum::<f64>())
    };
    // The spot covers a few faces of 30 x 30 squares.
    let (lights, _) = sent(lit_floor(PICTURES[3].1, 1.0, 30));
    assert!((20..1700).contains(&lights), "{lights}");
    for (name, picture) in [PICTURES[2], ("white", |_, _| 1.0)] {
        let (_, whole) = sent(lit_floor(picture, 1.0, 1));
        let (lights, of_groups) = sent(lit_floor(picture, 1.0, 80));
        println!("{name} of 12800 faces: {lights} lights send {of_groups:.4}, all {whole:.4}");
        assert!((2000..=4096).contains(&lights) && (of_groups / whole - 1.0).abs() < 2e-3);
    }
}

/// A panel with holes lights the floor as one whose image is black there.
#[test]
fn cut_outs_that_emit_light_as_black_texels_do() {
    let picture: Picture = |x, y| if x < 0.5 && y > 0.25 { 3.0 } else { 0.0 };
    let black = lit_floor(picture, 0.6, 1);
    let mut holes = lit_floor(|_, _| 3.0, 0.6, 1);
    let at = |i: u32| (f64::from(i) + 0.5) / 64.0;
    let is_there = |i: u32| picture(at(i % 64), 1.0 - at(i / 64)) > 0.0;
    let texels = (0..4096).map(|i| if is_there(i) { 255 } else { 0 }).collect();
    holes.masks.push(AlphaMask { name: "holes".into(), width: 64, height: 64, texels });
    let map = TextureMap { wrap: [Wrap::Clamp; 2], ..TextureMap::of(0) };
    for with_image in [true, false] {
        let mut holes = holes.clone();
        let panel = &mut holes.materials[1];
        panel.alpha = Some(map);
        if !with_image {
            (panel.emission, panel.emission_map) = (panel.emission * 3.0, None);
        }
        let mut job = job(holes, pose((3.0, 1.0, 0.0), (1.2, 0.0, 0.0)), 24, 18);
        (job.settings.shadow_samples, job.settings.all_lights) = (4, true);
        let of_holes = worst(&job, picture, 0.6);
        job.world = black.clone();
        let of_black = worst(&job, picture, 0.6);
        println!("worst error by holes {of_holes:.4}, by black texels {of_black:.4}");
        assert!(of_holes < 0.02 && of_black < 0.02);
    }
}

/// A pattern that repeats many times lights as much of the floor as there is of it.
#[test]
fn repeated_cut_outs_light_by_what_is_there() {
    type Pattern = fn(u32, u32) -> bool;
    let patterns: [(&str, u32, Pattern); 3] = [
        ("dots", 256, |x, y| (x % 16).abs_diff(8).pow(2) + (y % 16).abs_diff(8).pow(2) < 30),
        ("fence", 256, |x, y| x % 32 < 2 || y % 32 < 2),
        ("checks", 64, |x, y| (x + y) % 2 == 1),
    ];
    let lit = |alpha: Option<(AlphaMask, f64)>| {
        let mut world = lit_floor(|_, _| 3.0, 0.6, 1);
        let panel = &mut world.materials[1];
        panel.emission_map = None;
        if let Some((mask, scale)) = alpha {
            let transform = DAffine2::from_scale(DVec2::splat(scale));
            panel.alpha = Some(TextureMap { transform, ..TextureMap::of(0) });
            world.masks.push(mask);
        }
        let mut job = job(world, pose((3.0, 1.0, 0.0), (1.2, 0.0, 0.0)), 12, 9);
        job.settings.shadow_samples = 16;
        mean(&render(&job).0)
    };
    let whole = lit(None);
    for (name, n, is_there) in patterns {
        let texels: Vec<u8> =
            (0..n * n).map(|i| if is_there(i % n, i / n) { 255 } else { 0 }).collect();
        let share = texels.iter().filter(|texel| **texel > 0).count() as f64 / texels.len() as f64;
        for scale in [3.0, 8.0, 50.0] {
            let mask = AlphaMask { name: name.into(), width: n, height: n, texels: texels.clone() };
            let found = lit(Some((mask, scale))) / whole;
            println!("{name}, {scale} times: {found:.4} of the light, {share:.4} is there");
            // Between texels of which one is there the edge lies in the middle, but at corners.
            assert!((found - share).abs() < 0.02 + 0.05 * share, "{name} {scale}");
        }
    }
}

/// Rays see a mesh whole that has no texture coordinates, or one place for all corners, whatever its mask.
#[test]
fn cut_outs_without_coordinates_light_as_what_is_whole() {
    let lit = |with_mask: bool, uvs: Option<Corners<Vec2>>| {
        let mut world = lit_floor(|_, _| 3.0, 0.6, 1);
        world.masks.push(AlphaMask { name: "none".into(), width: 1, height: 1, texels: vec![0] });
        let panel = &mut world.materials[1];
        panel.emission_map = None;
        panel.alpha = with_mask.then(|| TextureMap::of(0));
        let floor = world.meshes[1].positions.len();
        world.meshes[1].uvs = uvs.map(|uvs| Corners { values: vec![uvs.values[0]; floor], ..uvs });
        let mut job = job(world, pose((3.0, 1.0, 0.0), (1.2, 0.0, 0.0)), 24, 18);
        job.settings.shadow_samples = 4;
        mean(&render(&job).0)
    };
    let whole = lit(false, None);
    let one_place = Corners { values: vec![Vec2::splat(0.5)], corners: None };
    assert!(whole > 0.01, "{whole}");
    for masked in [lit(true, None), lit(true, Some(one_place))] {
        assert!((masked / whole - 1.0).abs() < 0.01, "{masked} {whole}");
    }
}

/// A ball of many faces lights the floor as the exact sphere does.
#[test]
fn a_fine_mesh_lights_as_the_sphere_that_it_stands_for() {
    let lit = |mesh: Option<WorldMesh>| {
        let mut world = common::plate(Material::diffuse("floor", Rgb::splat(0.5)), 4.0);
        let mut glow = Material::black("glow");
        glow.emission = Rgb::splat(5.0);
        let material = world.add_material(glow);
        let centre = DVec3::new(0.0, 0.9, 0.0);
        match mesh {
            Some(mut mesh) => {
                mesh.positions.iter_mut().for_each(|p| *p = *p * 0.5 + centre);
                world.meshes.push(WorldMesh { material, ..mesh });
            }
            None => world.lights.push(Light::Sphere(SphereLight {
                centre,
                radius: 0.5,
                radiance: Rgb::splat(5.0),
            })),
        }
        let mut job = job(world, pose((3.0, 1.5, 0.0), (1.4, 0.0, 0.0)), 32, 24);
        (job.settings.shadow_samples, job.settings.spp, job.settings.all_lights) = (16, 4, true);
        render(&job).0
    };
    let (exact, fine) = (lit(None), lit(Some(common::uv_sphere(160, 80))));
    let off = |(a, b): (&Rgb, &Rgb)| f64::from((a.x / b.x - 1.0).abs());
    let worst = fine.rgb.iter().zip(&exact.rgb).map(off).fold(0.0, f64::max);
    println!("25,280 faces: means {:.5} and {:.5}, worst {worst:.4}", mean(&fine), mean(&exact));
    assert!((mean(&fine) / mean(&exact) - 1.0).abs() < 3e-3 && worst < 0.02);
}

/// Rays see the image's lower left corner, and the floor is lit by that.
#[test]
fn a_panel_without_texture_coordinates_lights_as_it_is_seen() {
    let light = |picture: Picture, has_uvs: bool| {
        let mut world = lit_floor(picture, 0.6, 1);
        world.meshes[1].uvs = world.meshes[1].uvs.take().filter(|_| has_uvs);
        let mut job = job(world, pose((0.0, 2.0, 3.0), (0.0, 0.0, 0.0)), 32, 24);
        job.settings.shadow_samples = 4;
        mean(&render(&job).0)
    };
    let of_corner = light(|_, _| 3.0, true);
    assert!(of_corner > 0.05, "{of_corner}");
    let bare = light(|x, y| if x < 0.2 && y < 0.2 { 3.0 } else { 0.0 }, false);
    assert!((bare / of_corner - 1.0).abs() < 1e-3, "{bare} {of_corner}");
    assert_eq!(light(|x, y| if x < 0.2 && y < 0.2 { 0.0 } else { 3.0 }, false), 0.0);
}
