//! What rays see that leave the scene, where that is more than one colour.
//!
//! An image is looked up by direction, bilinear, or the mean over the ray's cone where paths carry cones; gradients and
//! days are computed. Suns lie before it. What a lobe's ray sees counts in part only, as far as light samples see the same
//! (multiple importance sampling).

use super::light::EnvironmentLight;
use super::texture;
use super::{FrameInput, Renderer};
use crate::intersect::Ray;
use crate::math::{DMat3, DVec2, DVec3, Rgb, Vec2};
use crate::scene::{
    EnvironmentRadiance, Light, Scene, SceneEnvironment, SunLight, Wrap, image_place,
};
use std::f64::consts::{FRAC_1_PI, PI};

/// Environment and suns.
pub(super) struct Backdrop<'a> {
    /// Radiance of a sky of one colour.
    constant: Rgb,
    environment: Option<Seen<'a>>,
    suns: Vec<SeenSun>,
}

struct Seen<'a> {
    radiance: EnvironmentRadiance<'a>,
    to_own: DMat3,
    strength: f32,
}

struct SeenSun {
    light: SunLight,
    /// `1 - cos` of the angular radius.
    versine: f64,
    /// Its number among the scene's lights, if it is one.
    number: Option<u32>,
}

/// A ray that left the scene.
pub(super) struct Escaped<'r> {
    pub ray: &'r Ray,
    /// How much its cone widens along a unit of length.
    pub spread: f32,
    /// Density of its direction among those of the lobe that sent it, per steradian; 0 of other rays.
    pub pdf: f32,
    /// The cell of lights of the point that it was sent from.
    pub cell: u32,
}

impl<'a> Backdrop<'a> {
    /// `None` where all that rays see beyond the scene is the sky's radiance.
    pub fn of(scene: &'a Scene) -> Option<Self> {
        let environment = scene.environment.as_ref();
        let seen = |number, light: &SunLight| {
            let half = libm::sin(0.5 * light.angular_radius);
            SeenSun { light: light.clone(), versine: 2.0 * half * half, number }
        };
        let mut suns: Vec<SeenSun> = (0..)
            .zip(&scene.lights)
            .filter_map(|(number, light)| match light {
                Light::Sun(sun) => Some(seen(Some(number), sun)),
                Light::Point(_)
                | Light::Directional(_)
                | Light::Quad(_)
                | Light::Sphere(_)
                | Light::Disk(_)
                | Light::Spot(_)
                | Light::Face(_) => None,
            })
            .collect();
        if !scene.sky.lights {
            let sun = environment.and_then(|sky| sky.environment.sun());
            suns.extend(sun.map(|sun| seen(None, &sun)));
        }
        if environment.is_none() && suns.is_empty() {
            return None;
        }
        let environment = environment.map(|sky| Seen::of(sky, scene));
        Some(Self { constant: scene.sky.radiance, environment, suns })
    }

    /// Radiance of the environment along the unit direction `dir`, the mean over a cone that widens by `spread`.
    pub fn radiance(&self, dir: DVec3, spread: f32) -> Rgb {
        self.environment.as_ref().map_or(self.constant, |seen| seen.radiance(dir, spread))
    }
}

impl<'a> Seen<'a> {
    fn of(sky: &'a SceneEnvironment, scene: &'a Scene) -> Self {
        let environment = &sky.environment;
        let radiance = environment.radiance(&scene.textures);
        let (to_own, strength) = (environment.orientation.transpose(), environment.strength);
        Self { radiance, to_own, strength }
    }

    fn radiance(&self, dir: DVec3, spread: f32) -> Rgb {
        let own = self.to_own * dir;
        let seen = match &self.radiance {
            EnvironmentRadiance::Gradient(sky) => sky.radiance(own),
            EnvironmentRadiance::Daylight(sky) => sky.radiance(own),
            EnvironmentRadiance::Image(image) => {
                let [u, v] = image_place(own);
                let level = (own.x * own.x + own.z * own.z).sqrt();
                let spread = f64::from(spread.abs());
                // Towards the poles a cone covers more of the longitudes, and counts as covering half at most: more would blur
                // the heights too.
                let across = (0.5 * FRAC_1_PI * spread / level.max(spread * FRAC_1_PI)).min(0.5);
                let along = (spread / PI).min(1.0);
                let covered = [DVec2::new(across, 0.0), DVec2::new(0.0, along)];
                let place = Vec2::new(u as f32, (1.0 - v) as f32);
                texture::filtered(image, [Wrap::Repeat, Wrap::Clamp], place, covered)
            }
        };
        seen * self.strength
    }
}

impl SeenSun {
    fn covers(&self, dir: DVec3) -> bool {
        // 1 - cos by the chord, which is exact for small angles too.
        0.5 * (dir - self.light.to_light).length_squared() <= self.versine
    }
}

impl Renderer<'_> {
    /// What a valid ray sees of the `backdrop`, less what samples of its lights see of the same.
    #[inline(never)]
    pub(super) fn seen_outside(
        &self,
        input: &FrameInput,
        backdrop: &Backdrop,
        escaped: &Escaped,
    ) -> Rgb {
        let Escaped { ray, spread, pdf, cell } = *escaped;
        let dir = ray.dir.normalize();
        let lobe = f64::from(pdf);
        // Light samples see what is there, so that what shares the light with them must not blur it.
        let spread = if lobe > 0.0 { 0.0 } else { spread };
        let mut seen = backdrop.radiance(dir, spread);
        if let Some(source) = input.environment.as_ref().filter(|_| lobe > 0.0) {
            seen *= source.share_of_lobe(dir, lobe);
        }
        for sun in backdrop.suns.iter().filter(|sun| sun.covers(dir)) {
            let share = match lobe > 0.0 {
                true => {
                    self.share_of_lobe(input, sun.number, (ray.org, ray.org + dir), (lobe, cell))
                }
                false => 1.0,
            };
            seen += sun.light.radiance * share;
        }
        seen
    }
}

/// The light that an environment sends to surfaces, if it does.
pub(super) fn environment_light(scene: &Scene) -> Option<EnvironmentLight<'_>> {
    scene.environment.as_ref().map(EnvironmentLight::new)
}
