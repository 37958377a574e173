//! The light of an environment at diffuse and glossy points.
//!
//! At a diffuse point the estimate is `ratio · unshadowed`, as for other lights, but with a ratio for each primary colour: where
//! a yellow sun is hidden the rest is as blue as the sky. All primaries have the same rays. The ratios are kept for other
//! frames, one where the environment has one colour. At a glossy point samples by importance are joined with
//! the lobe's own rays (multiple importance sampling).
//!
//! Not done: pilot rays. Hardly any point sees all of a sky or nothing of it.

use super::backdrop::{Backdrop, environment_light};
use super::direct::{BATCH, ShadowScratch};
use super::highlight::GlossyPoint;
use super::light::{EnvironmentLight, ShadowTarget};
use super::pixels::BlockPixels;
use super::point::{SamplePlace, ShadingPoint};
use super::{Renderer, Reuse, dimensions, normal_map};
use crate::math::{DVec3, Rgb, luminance};
use crate::stats::{RayCounts, RayKind};
use std::ops::Range;

/// An environment that shines in this frame.
pub(super) struct EnvironmentSource<'a> {
    light: EnvironmentLight<'a>,
    /// Its number among the scene's lights: the sky's, after the last.
    number: u32,
    /// Shadow rays of one camera sample.
    samples: u32,
    /// The channels of its ratios, if they are kept.
    channels: Range<usize>,
    /// Channels of a point.
    all_channels: usize,
}

/// Buffers.
#[derive(Default)]
pub(super) struct EnvironmentScratch {
    u: Vec<[f32; 2]>,
    found: Vec<FoundSky>,
}

/// What rays from a shading point have found.
#[derive(Debug, Clone, Copy)]
struct FoundSky {
    /// The point's number in the chunk.
    point: u32,
    rays: u32,
    /// Weights of the rays that reached the environment, and of all.
    open: Rgb,
    all: Rgb,
}

impl FoundSky {
    /// The part of each colour that arrives. Of a colour that no ray has found, as of all together.
    fn ratio(&self) -> Rgb {
        let together = self.open.element_sum() / self.all.element_sum();
        let part = |open: f32, all: f32| if all > 0.0 { open / all } else { together };
        let (open, all) = (self.open, self.all);
        Rgb::new(part(open.x, all.x), part(open.y, all.y), part(open.z, all.z))
    }
}

/// How much of a colour there is in `light`.
fn part(light: Rgb, tint: Rgb) -> f64 {
    f64::from(light.dot(tint) / tint.length_squared())
}

impl EnvironmentSource<'_> {
    /// The part of what a lobe's ray of density `lobe` sees along `dir` that light samples do not.
    pub fn share_of_lobe(&self, dir: DVec3, lobe: f64) -> f32 {
        (lobe / (lobe + f64::from(self.samples) * self.light.pdf_li(dir))) as f32
    }

    /// What arrives at a point where nothing is in the way.
    fn unshadowed(&self, point: &ShadingPoint) -> Rgb {
        match point.is_mapped() {
            false => self.light.unshadowed(point.n),
            true => {
                let cos = point.n.dot(point.mapped);
                let [own, tilted] = [point.n, point.mapped].map(|n| self.light.unshadowed(n));
                normal_map::unshadowed_colour(own, tilted, cos)
            }
        }
    }

    /// The channels of shading point `i`: their places among those of all points, and their colours.
    fn places(&self, i: usize) -> impl Iterator<Item = (usize, Rgb)> {
        let first = i * self.all_channels + self.channels.start;
        (first..).zip(&self.light.tints()[..self.channels.len()]).map(|(at, tint)| (at, *tint))
    }

    /// What arrives at shading point `i` if that is known, as it is where nothing can arrive; `None` where nothing is kept.
    fn known(&self, s: &ShadowScratch, i: usize) -> Option<Rgb> {
        if self.channels.is_empty() {
            return None;
        }
        let mut light = Rgb::ZERO;
        for (channel, (at, tint)) in self.channels.clone().zip(self.places(i)) {
            let exact = s.exact(at);
            if exact == 0.0 {
                continue;
            }
            let ratio = s.groups.known(i, channel, self.all_channels);
            if ratio.is_nan() {
                return None;
            }
            light += tint * (exact as f32 * ratio);
        }
        Some(light)
    }
}

impl Renderer<'_> {
    /// The environment that shines under the plan.
    pub(super) fn environment_source(&self, reuse: Option<Reuse>) -> Option<EnvironmentSource<'_>> {
        let light = environment_light(self.scene).filter(|_| self.plan.sky_light)?;
        Some(EnvironmentSource {
            light,
            number: self.scene.lights.len() as u32,
            samples: self.settings.sky_samples,
            channels: reuse.map_or(0..0, |reuse| reuse.channels.sky()),
            all_channels: reuse.map_or(0, |reuse| reuse.channels.len()),
        })
    }

    /// Notes what of the environment would arrive at all `lit` points if nothing were in the way.
    pub(super) fn environment_without_shadows(
        &self,
        source: &EnvironmentSource,
        lit: &[ShadingPoint],
        s: &mut ShadowScratch,
    ) {
        if source.channels.is_empty() {
            return;
        }
        for (i, point) in lit.iter().enumerate() {
            let sent = source.unshadowed(point);
            for (at, tint) in source.places(i) {
                let exact = part(sent, tint);
                let shown = luminance(point.weight * tint) * exact as f32;
                s.note_exact(at, exact, shown * self.settings.exposure);
            }
        }
    }

    /// Casts the check rays to the environment that the inference wants.
    pub(super) fn check_environment(
        &self,
        source: &EnvironmentSource,
        lit: &[ShadingPoint],
        pixels: &BlockPixels,
        s: &mut ShadowScratch,
        counts: &mut RayCounts,
    ) {
        if source.channels.is_empty() {
            return;
        }
        let (channels, all_channels) = (source.channels.clone(), source.all_channels);
        // Samples that tracing does not use.
        let samples = source.samples.next_power_of_two();
        let traced = self.settings.most_camera_samples().wrapping_mul(samples);
        let wanted = |s: &ShadowScratch, i: usize| {
            let wanted = s.groups.check_rays(i, channels.clone(), all_channels, source.samples)?;
            let is_sent = source.places(i).any(|(at, _)| s.exact(at) != 0.0);
            let first = traced.wrapping_add(wanted.first).wrapping_add(wanted.own.start as u32);
            is_sent.then_some((first, wanted.own.len()))
        };
        self.cast_to_environment(source, lit, pixels, wanted, s, counts);
        let found = std::mem::take(&mut s.environment.found);
        for FoundSky { point: i, rays, open, all } in &found {
            let i = *i as usize;
            for (channel, (at, tint)) in channels.clone().zip(source.places(i)) {
                let (open, all) = (part(*open, tint), part(*all, tint));
                if s.exact(at) != 0.0 && all > 0.0 {
                    let at = (channel, all_channels);
                    s.groups.note_checked(i, at, (open, all), *rays as usize);
                }
            }
        }
        s.environment.found = found;
    }

    /// Adds the environment's light at all `lit` points, known or traced.
    pub(super) fn light_from_environment(
        &self,
        source: &EnvironmentSource,
        lit: &[ShadingPoint],
        pixels: &mut BlockPixels,
        s: &mut ShadowScratch,
        counts: &mut RayCounts,
    ) {
        for (i, point) in lit.iter().enumerate() {
            if let Some(light) = source.known(s, i) {
                if source.places(i).any(|(at, _)| s.exact(at) != 0.0) {
                    s.groups.note_lit(i);
                }
                pixels.add(point.place.pixel, point.place.sample, point.weight * light);
            }
        }
        let wanted = |s: &ShadowScratch, i: usize| {
            let first = lit[i].place.sample.wrapping_mul(source.samples);
            source.known(s, i).is_none().then_some((first, source.samples as usize))
        };
        self.cast_to_environment(source, lit, pixels, wanted, s, counts);
        let found = std::mem::take(&mut s.environment.found);
        for found in &found {
            let i = found.point as usize;
            let point = &lit[i];
            let light = point.weight * source.unshadowed(point) * found.ratio();
            pixels.add(point.place.pixel, point.place.sample, light);
            for (channel, (at, tint)) in source.channels.clone().zip(source.places(i)) {
                let (open, all) = (part(found.open, tint), part(found.all, tint));
                if s.exact(at) != 0.0 && all > 0.0 {
                    s.groups.note_lit(i);
                    s.groups.add(i, channel, source.all_channels, open, all);
                }
            }
        }
        s.environment.found = found;
    }

    /// Casts rays to the environment: from each of the `lit` points the samples from the first number that `wanted` says on, and as
    /// many. Leaves what they found, of points that cast any.
    fn cast_to_environment(
        &self,
        source: &EnvironmentSource,
        lit: &[ShadingPoint],
        pixels: &BlockPixels,
        wanted: impl Fn(&ShadowScratch, usize) -> Option<(u32, usize)>,
        s: &mut ShadowScratch,
        counts: &mut RayCounts,
    ) {
        let mut own = std::mem::take(&mut s.environment);
        own.found.clear();
        let mut traced = 0;
        s.clear();
        for (i, point) in lit.iter().enumerate() {
            let wanted = wanted(s, i).filter(|(_, count)| *count > 0);
            let is_lit = || source.light.unshadowed(point.n) != Rgb::ZERO;
            if let Some((first, count)) = wanted.filter(|_| is_lit()) {
                own.u.resize(count, [0.0; 2]);
                self.fill_sky(&point.place, source, first, pixels, &mut own.u);
                let before = s.ray_count();
                let all = self.rays_to_environment(source, (lit, i), &own.u, s);
                let rays = (s.ray_count() - before) as u32;
                own.found.push(FoundSky { point: i as u32, rays, open: Rgb::ZERO, all });
                s.close();
            }
            if s.ray_count() >= BATCH || i + 1 == lit.len() {
                counts[RayKind::ShadowSky] += s.ray_count() as u64;
                self.trace_rays(s, counts);
                let found = own.found[traced..].iter_mut().zip(s.highlights());
                found.for_each(|(found, open)| found.open = open);
                traced = own.found.len();
                s.clear();
            }
        }
        own.found.retain(|found| found.all != Rgb::ZERO);
        s.environment = own;
    }

    /// Pushes the rays of the samples `u` at shading point `i`; what they would find if nothing were in the way.
    fn rays_to_environment(
        &self,
        source: &EnvironmentSource,
        (lit, i): (&[ShadingPoint], usize),
        u: &[[f32; 2]],
        s: &mut ShadowScratch,
    ) -> Rgb {
        let starts = s.starts(self, lit, i as u32);
        let n = lit[i].n;
        let view = source.light.seen_from(n);
        let mut all = Rgb::ZERO;
        let mut push = |sample: super::light::EnvironmentSample| {
            let weight = sample.radiance * (sample.wi.dot(n) / sample.density) as f32;
            all += weight;
            s.push_highlight(starts.ray_to(&ShadowTarget::Sky(sample.wi)), weight);
        };
        let mut is_above = false;
        for u in u.iter().map(|u| u.map(f64::from)) {
            let sample = view.sample_li(u);
            if sample.wi.dot(n) > 0.0 {
                is_above = true;
                push(sample);
            }
        }
        // All samples went to what is bright below the horizon.
        if let (false, Some(first)) = (is_above, u.first()) {
            push(view.by_cosine(first.map(f64::from)));
        }
        all
    }

    /// Stratified points of the environment for one place, from sample number `first` on.
    fn fill_sky(
        &self,
        place: &SamplePlace,
        source: &EnvironmentSource,
        first: u32,
        pixels: &BlockPixels,
        u: &mut [[f32; 2]],
    ) {
        let dimension = dimensions::of_light(place.branch, source.number, self.light_dimensions());
        pixels.sampler(place.pixel).fill2(first, dimension, u);
    }

    /// Adds what glossy `points` reflect of the environment along samples by importance. The rest is seen by the lobes' rays.
    pub(super) fn highlight_environment(
        &self,
        (source, backdrop): (&EnvironmentSource, &Backdrop),
        points: &[GlossyPoint],
        pixels: &mut BlockPixels,
        s: &mut ShadowScratch,
        counts: &mut RayCounts,
    ) {
        let n = source.samples as usize;
        let mut u = s.samples(n);
        for group in points.chunks((BATCH / n.max(1)).max(1)) {
            s.clear();
            for point in group {
                let first = point.place.sample.wrapping_mul(source.samples);
                self.fill_sky(&point.place, source, first, pixels, &mut u);
                for u in u.iter().map(|u| u.map(f64::from)) {
                    let Some(sample) = source.light.sample_li(u) else { break };
                    let GlossyPoint { lobe, n, ng, wo, starts, .. } = point;
                    // The lobe's rays below the facet are mirrored and count whole.
                    if sample.wi.dot(*ng) <= 0.0 {
                        continue;
                    }
                    let density = sample.density * f64::from(source.samples);
                    // The balance heuristic, by which the lobe's rays count the rest.
                    let joined = density + lobe.pdf(*wo, sample.wi);
                    let weight = sample.wi.dot(*n).max(0.0) / joined;
                    let light = backdrop.radiance(sample.wi, 0.0);
                    let seen = lobe.f(*wo, sample.wi) * light * weight as f32;
                    if seen != Rgb::ZERO {
                        let target = ShadowTarget::Sky(sample.wi);
                        s.push_highlight(starts.ray_to(&target), seen);
                    }
                }
                s.close();
            }
            counts[RayKind::ShadowSky] += s.ray_count() as u64;
            self.trace_rays(s, counts);
            for (point, seen) in group.iter().zip(s.highlights()) {
                pixels.add(point.place.pixel, point.place.sample, point.throughput * seen);
            }
        }
        s.give_back(u);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::DVec2;
    use crate::sampling::{PixelSampler, mix};
    use crate::scene::{
        Environment, EnvironmentKind, Scene, SceneEnvironment, SunSky, Texture, World,
    };

    fn random(mut seed: u64) -> impl FnMut() -> f64 {
        move || {
            seed = mix(seed);
            (seed >> 11) as f64 / (1u64 << 53) as f64
        }
    }

    fn direction(next: &mut impl FnMut() -> f64) -> DVec3 {
        let y = 2.0 * next() - 1.0;
        let (sin, cos) = libm::sincos(std::f64::consts::TAU * next());
        let level = (1.0 - y * y).sqrt();
        DVec3::new(level * sin, y, level * cos)
    }

    fn scene(kind: EnvironmentKind, textures: Vec<Texture>) -> Scene {
        let environment = Some(Environment::new(kind));
        World { environment, textures, ..World::default() }.into_scene(true).expect("a scene")
    }

    /// A smooth studio, a sky with a tiny sun in it, and a day without its sun, which is a light of its own.
    fn scenes() -> [(&'static str, Scene); 3] {
        let image = |size: [u32; 2], radiance: &dyn Fn(DVec3) -> Rgb| {
            let texels = (0..size[0] * size[1]).map(|i| {
                let place = DVec2::new(f64::from(i % size[0]), f64::from(i / size[0])) + 0.5;
                let place = place / DVec2::new(f64::from(size[0]), f64::from(size[1]));
                let (sin, cos) = libm::sincos(std::f64::consts::PI * place.y);
                let (s, c) = libm::sincos(std::f64::consts::TAU * (place.x - 0.5));
                radiance(DVec3::new(sin * s, cos, -sin * c))
            });
            let image = Texture::from_linear("image", size, texels.collect());
            scene(EnvironmentKind::Image(0), vec![image])
        };
        let lamp = |d: DVec3, at: DVec3| libm::exp(8.0 * (d.dot(at.normalize()) - 1.0)) as f32;
        let studio = image([128, 64], &|d| {
            Rgb::new(0.1, 0.12, 0.15)
                + Rgb::new(4.0, 3.0, 2.0) * lamp(d, DVec3::new(1.0, 1.0, -0.5))
                + Rgb::new(0.5, 1.0, 3.0) * lamp(d, DVec3::new(-1.0, 0.5, 0.7))
        });
        let to_sun = DVec3::new(0.5, 0.6, -0.62).normalize();
        let sunny = image([1024, 512], &|d| match d.dot(to_sun) > 0.999_968 {
            true => Rgb::new(24_000.0, 18_000.0, 9_000.0),
            false => Rgb::new(0.15, 0.3, 0.7) * (0.5 + 0.5 * d.y.max(0.0) as f32),
        });
        let day = SunSky { to_sun, turbidity: 3.0, sun_radius: 0.005, ground: Rgb::splat(0.2) };
        [
            ("studio", studio),
            ("sky with a tiny sun", sunny),
            ("day without its sun", scene(EnvironmentKind::SunSky(day), Vec::new())),
        ]
    }

    fn own(scene: &Scene) -> &SceneEnvironment {
        scene.environment.as_ref().expect("an environment")
    }

    /// What hides a part of the sky: walls that rise to an angle, and balls.
    struct Occluders {
        walls: Vec<DVec3>,
        balls: Vec<(DVec3, f64)>,
    }

    impl Occluders {
        fn random(next: &mut impl FnMut() -> f64) -> Self {
            let walls = (0..1 + (2.0 * next()) as usize).map(|_| direction(next)).collect();
            let balls = (0..1 + (4.0 * next()) as usize)
                .map(|_| (direction(next), 1.0 - 0.3 * next() * next()))
                .collect();
            Self { walls, balls }
        }

        fn is_open(&self, d: DVec3) -> bool {
            self.walls.iter().all(|wall| wall.dot(d) < 0.5)
                && self.balls.iter().all(|(at, cos)| at.dot(d) < *cos)
        }
    }

    /// Samples of both kinds add up to the irradiance, whatever the normal: by the standard error of their mean.
    #[test]
    fn samples_have_the_density_that_they_say() {
        for (name, scene) in &scenes() {
            let light = EnvironmentLight::new(own(scene));
            let mut next = random(11);
            for _ in 0..12 {
                let n = direction(&mut next);
                let (view, exact) = (light.seen_from(n), light.unshadowed(n));
                let (mut sum, mut squares) = (DVec3::ZERO, DVec3::ZERO);
                const COUNT: u32 = 40_000;
                for _ in 0..COUNT {
                    let sample = view.sample_li([next(), next()]);
                    let cos = sample.wi.dot(n).max(0.0);
                    let weight = sample.radiance.as_dvec3() * (cos / sample.density);
                    sum += weight;
                    squares += weight * weight;
                }
                let mean = sum / f64::from(COUNT);
                let variance = (squares / f64::from(COUNT) - mean * mean).max(DVec3::ZERO);
                let error = (variance / f64::from(COUNT)).map(f64::sqrt);
                let off = (mean - exact.as_dvec3()).abs();
                // The table is off by a little, too.
                let allowed = error * 4.5 + exact.as_dvec3() * 2e-3;
                assert!(off.cmple(allowed).all(), "{name} {n}: {mean} for {exact}, {error}");
            }
        }
    }

    /// Nine coefficients of real spherical harmonics to order 2 (Ramamoorthi and Hanrahan, 2001).
    fn harmonics(d: DVec3) -> [f64; 9] {
        let DVec3 { x, y, z } = d;
        [
            0.282_095,
            0.488_603 * y,
            0.488_603 * z,
            0.488_603 * x,
            1.092_548 * x * y,
            1.092_548 * y * z,
            0.315_392 * (3.0 * z * z - 1.0),
            1.092_548 * x * z,
            0.546_274 * (x * x - y * y),
        ]
    }

    /// Irradiance by coefficients of radiance.
    fn by_harmonics(coefficients: &[DVec3; 9], n: DVec3) -> DVec3 {
        const BANDS: [f64; 9] = [
            3.141_593, 2.094_395, 2.094_395, 2.094_395, 0.785_398, 0.785_398, 0.785_398, 0.785_398,
            0.785_398,
        ];
        let basis = harmonics(n);
        (0..9).map(|k| coefficients[k] * (BANDS[k] * basis[k])).sum()
    }

    fn root(sum: f64, count: u32) -> f64 {
        100.0 * (sum / f64::from(count)).sqrt()
    }

    /// What a traced point tells of the light at a normal that is turned by an angle, if this or that is kept of it: errors
    /// in per cent of the irradiance without shadows there. Also how ratio times exact and plain samples compare where they
    /// are traced. The figures of decision 031.
    #[test]
    #[ignore = "a minute; prints figures"]
    #[allow(clippy::print_stdout)]
    fn figures() {
        println!(
            "RMS error, per cent: | one ratio | a ratio a colour | harmonics | their ratio | two regions"
        );
        for (name, scene) in &scenes() {
            let tables = own(scene);
            let light = EnvironmentLight::new(tables);
            let [width, height] = tables.radiance.size();
            let mut cells = Vec::new();
            // Every other cell of fine tables, at random, would miss a sun: all cells.
            for cell in 0..width * height {
                let (row, column) = (cell / width, cell % width);
                let y = libm::cos(std::f64::consts::PI * (row as f64 + 0.5) / height as f64);
                let (s, c) = libm::sincos(
                    std::f64::consts::TAU * ((column as f64 + 0.5) / width as f64 - 0.5),
                );
                let level = (1.0 - y * y).sqrt();
                let d = DVec3::new(level * s, y, -level * c);
                let solid = tables.radiance.solid_angle(cell);
                let bright = tables.radiance.pdf(cell) > 0.0;
                cells.push((d, tables.radiance.radiance(cell).as_dvec3() * solid, bright));
            }
            for degrees in [2.0, 8.0, 20.0f64] {
                let mut next = random(23);
                let mut sums = [0.0; 5];
                const TRIALS: u32 = 60;
                for _ in 0..TRIALS {
                    let occluders = Occluders::random(&mut next);
                    let n = (direction(&mut next) + DVec3::Y).normalize();
                    let across = n.cross(direction(&mut next)).normalize();
                    let (sin, cos) = libm::sincos(degrees.to_radians());
                    let turned = n * cos + across * sin;
                    // Open and all: at the normal, at the turned one, by region at the normal and turned, as harmonics.
                    let mut at = [[DVec3::ZERO; 2]; 2];
                    let mut regions = [[[DVec3::ZERO; 2]; 2]; 2];
                    let mut bands = [[DVec3::ZERO; 9]; 2];
                    for (d, light, bright) in &cells {
                        let open = occluders.is_open(*d);
                        let basis = harmonics(*d);
                        for which in 0..2 {
                            if which == 0 && !open {
                                continue;
                            }
                            for (k, n) in [n, turned].into_iter().enumerate() {
                                let part = *light * n.dot(*d).max(0.0);
                                at[k][which] += part;
                                regions[usize::from(*bright)][k][which] += part;
                            }
                            (0..9).for_each(|k| bands[which][k] += *light * basis[k]);
                        }
                    }
                    let exact = at[1][1];
                    let safe = |a: DVec3, b: DVec3| a / b.max(DVec3::splat(1e-12));
                    let ratio = safe(at[0][0], at[0][1]);
                    let one = at[0][0].element_sum() / at[0][1].element_sum();
                    let [seen, all] =
                        bands.map(|bands| by_harmonics(&bands, turned).max(DVec3::ZERO));
                    let by_region: DVec3 =
                        regions.iter().map(|[own, turned]| turned[1] * safe(own[0], own[1])).sum();
                    let kept = [
                        exact * one,
                        exact * ratio,
                        seen,
                        exact * safe(seen, all).min(DVec3::ONE),
                        by_region,
                    ];
                    for (sum, kept) in sums.iter_mut().zip(kept) {
                        *sum +=
                            ((kept - at[1][0]) / exact.element_sum() * 3.0).length_squared() / 3.0;
                    }
                }
                let errors = sums.map(|sum| format!("{:5.2}", root(sum, TRIALS))).join(" | ");
                println!("{name}, turned by {degrees} degrees: {errors}");
            }
            for count in [4, 16, 64] {
                let mut next = random(31);
                let (mut of_ratio, mut of_plain, mut bias, mut worse, mut open_enough) =
                    (0.0, 0.0, 0.0, 0, 0);
                const POINTS: u32 = 60;
                const TRIALS: u32 = 200;
                for point in 0..POINTS {
                    let occluders = Occluders::random(&mut next);
                    let n = (direction(&mut next) + DVec3::Y).normalize();
                    let view = light.seen_from(n);
                    let exact = light.unshadowed(n);
                    let open = |(d, light, _): &(DVec3, DVec3, bool)| {
                        *light * (n.dot(*d).max(0.0) * f64::from(u8::from(occluders.is_open(*d))))
                    };
                    let truth: DVec3 = cells.iter().map(open).sum();
                    let scale = 3.0 / f64::from(exact.element_sum());
                    let (mut own_ratio, mut own_plain, mut mean) = (0.0, 0.0, DVec3::ZERO);
                    for trial in 0..TRIALS {
                        let sampler = PixelSampler::new(9, trial, point, 0);
                        let mut u = vec![[0.0; 2]; count];
                        sampler.fill2(0, 0, &mut u);
                        let (mut seen, mut all) = (Rgb::ZERO, Rgb::ZERO);
                        for u in u {
                            let sample = view.sample_li(u.map(f64::from));
                            let cos = sample.wi.dot(n).max(0.0);
                            let weight = sample.radiance * (cos / sample.density) as f32;
                            all += weight;
                            seen += if occluders.is_open(sample.wi) { weight } else { Rgb::ZERO };
                        }
                        if all == Rgb::ZERO {
                            // As tracing does: one direction by the cosine says.
                            let sample = view.by_cosine([next(), next()]);
                            all = sample.radiance;
                            seen = if occluders.is_open(sample.wi) { all } else { seen };
                        }
                        let found = FoundSky { point: 0, rays: 0, open: seen, all };
                        let by_ratio = (exact * found.ratio()).as_dvec3();
                        let plain = seen.as_dvec3() / count as f64;
                        let off = |light: DVec3| ((light - truth) * scale).length_squared() / 3.0;
                        mean += (by_ratio - truth) * scale / f64::from(TRIALS);
                        own_ratio += off(by_ratio) / f64::from(TRIALS);
                        own_plain += off(plain) / f64::from(TRIALS);
                    }
                    worse += u32::from(own_ratio > 1.1 * own_plain);
                    open_enough += u32::from(own_ratio * 1.1 < own_plain);
                    of_ratio += own_ratio;
                    of_plain += own_plain;
                    bias += mean.length_squared() / 3.0;
                }
                println!(
                    "{name}, {count} samples: ratio {:.2} %, plain {:.2} %, bias of the ratio {:.2} %; the ratio is worse at {worse} \
                     of {POINTS} points, better at {open_enough}",
                    root(of_ratio, POINTS),
                    root(of_plain, POINTS),
                    root(bias, POINTS)
                );
            }
        }
    }
}
