//! How lights shine on a surface point, before any shadow ray.
//!
//! Takes a light and a point with its normal; gives the irradiance that would arrive if nothing were in
//! the way, and samples of the light that say where shadow rays go. One file for each kind; nothing else
//! in `shade` asks for the kind.

mod directional;
mod disk;
mod environment;
mod flat;
mod point;
mod quad;
mod sample;
mod sky;
mod sphere;
mod spot;
mod sun;

pub use environment::{EnvironmentLight, EnvironmentSample};
pub use sample::{AreaPdf, LightSample, Pdf, SampleSink, ShadowTarget};

use super::irradiance;
use crate::math::{DVec3, Rgb};
use crate::sampling::SphereCone;
use crate::scene::{Light, Sky};
use directional::Directional;
use disk::Disk;
use point::Point;
use quad::Quad;
use sky::{SkyDome, SkyView};
use sphere::{Sphere, SphereView};
use spot::Spot;
use sun::Sun;

/// A light that is sampled, with all that its samples need: made once a frame.
pub struct LightSampler {
    /// What the light emits: radiance of an area light and of the sky, intensity of a point or spot light,
    /// irradiance of a directional one.
    pub emission: Rgb,
    /// The area of what sends its light over that of its shape: 1 but for faces that send the light of others too.
    stands_for: f64,
    shape: Shape,
}

/// What differs by the kind of light.
#[allow(clippy::large_enum_variant)] // A handful of lights: nothing to gain from a box.
enum Shape {
    Point(Point),
    Directional(Directional),
    Quad(Quad),
    Sphere(Sphere),
    Disk(Disk),
    Spot(Spot),
    Sun(Sun),
    Sky(SkyDome),
}

/// A light as seen from one surface point.
pub struct LightView<'a>(View<'a>);

enum View<'a> {
    Point(&'a Point),
    Directional(&'a Directional),
    Quad(&'a Quad),
    Sphere(SphereView),
    Disk(&'a Disk),
    Sun(&'a SphereCone),
    Sky(SkyView),
}

impl LightSampler {
    /// Prepares `light`, scene space.
    pub fn new(light: &Light) -> Self {
        let (emission, shape) = match light {
            Light::Point(light) => (light.intensity, Shape::Point(Point::new(light))),
            Light::Directional(light) => {
                (light.irradiance, Shape::Directional(Directional::new(light)))
            }
            Light::Quad(light) => (light.radiance, Shape::Quad(Quad::new(light))),
            Light::Face(light) => (light.part.radiance, Shape::Quad(Quad::of_face(light))),
            Light::Sphere(light) => (light.radiance, Shape::Sphere(Sphere::new(light))),
            Light::Disk(light) => (light.radiance, Shape::Disk(Disk::new(light))),
            Light::Spot(light) => (light.intensity, Shape::Spot(Spot::new(light))),
            Light::Sun(light) => (light.radiance, Shape::Sun(Sun::new(light))),
        };
        let stands_for = match light {
            Light::Face(light) => light.stands_for,
            _ => 1.0,
        };
        Self { emission, stands_for, shape }
    }

    /// Prepares the constant sky.
    pub fn of_sky(sky: &Sky) -> Self {
        Self { emission: sky.radiance, stands_for: 1.0, shape: Shape::Sky(SkyDome) }
    }

    /// Unshadowed irradiance at `p` with unit normal `n`, per unit of emission; 0 where no light can arrive.
    /// NaN goes on, to be counted at its pixel.
    pub fn unshadowed(&self, p: DVec3, n: DVec3) -> f64 {
        match &self.shape {
            Shape::Point(light) => light.unshadowed(p, n),
            Shape::Directional(light) => light.unshadowed(n),
            Shape::Quad(light) => light.unshadowed(p, n),
            Shape::Sphere(light) => light.unshadowed(p, n),
            Shape::Disk(light) => light.unshadowed(p, n),
            Shape::Spot(light) => light.unshadowed(p, n),
            Shape::Sun(light) => light.unshadowed(n),
            Shape::Sky(sky) => sky.unshadowed(),
        }
    }

    /// The same for a normal `mapped` by an image, whose cosine to the surface's own normal is `cos`: of the sky, without
    /// what lies below the surface.
    pub fn unshadowed_tilted(&self, p: DVec3, mapped: DVec3, cos: f64) -> f64 {
        match &self.shape {
            Shape::Sky(sky) => sky.unshadowed() * 0.5 * (1.0 + cos),
            Shape::Point(_)
            | Shape::Directional(_)
            | Shape::Quad(_)
            | Shape::Sphere(_)
            | Shape::Disk(_)
            | Shape::Spot(_)
            | Shape::Sun(_) => self.unshadowed(p, mapped),
        }
    }

    /// Whether it may send anything towards `p`: flat lights emit on one side, or on both.
    pub fn reaches(&self, p: DVec3) -> bool {
        match &self.shape {
            Shape::Quad(light) => light.reaches(p),
            Shape::Disk(light) => light.reaches(p),
            Shape::Point(_)
            | Shape::Directional(_)
            | Shape::Sphere(_)
            | Shape::Spot(_)
            | Shape::Sun(_)
            | Shape::Sky(_) => true,
        }
    }

    /// The area of what sends its light over that of its shape.
    pub fn stands_for(&self) -> f64 {
        self.stands_for
    }

    /// Whether rays can end on the light's surface, or leave the scene towards it.
    pub fn is_seen(&self) -> bool {
        match &self.shape {
            Shape::Quad(_) | Shape::Sphere(_) | Shape::Disk(_) | Shape::Sun(_) => true,
            Shape::Point(_) | Shape::Directional(_) | Shape::Spot(_) | Shape::Sky(_) => false,
        }
    }

    /// The light as seen from `p` with unit normal `n`; `None` from within.
    pub fn seen_from(&self, p: DVec3, n: DVec3) -> Option<LightView<'_>> {
        Some(LightView(match &self.shape {
            Shape::Point(light) => View::Point(light),
            Shape::Directional(light) => View::Directional(light),
            Shape::Quad(light) => View::Quad(light),
            Shape::Sphere(light) => View::Sphere(light.seen_from(p, 1.0)?),
            Shape::Disk(light) => View::Disk(light),
            Shape::Spot(light) => light.seen_from(p)?,
            Shape::Sun(light) => View::Sun(light.seen()?),
            Shape::Sky(_) => View::Sky(SkyView::above(n)),
        }))
    }
}

impl LightView<'_> {
    /// Gives `sink` the light's point or direction for each of `u` in the unit square, as seen from `p`, which the
    /// view was made for. All at once, so that nothing asks for the kind sample by sample.
    pub fn sample_li(&self, p: DVec3, u: &[[f32; 2]], sink: &mut impl SampleSink) {
        let u = u.iter().map(|u| u.map(f64::from));
        match &self.0 {
            View::Point(light) => u.for_each(|_| sink.push(light.sample_li(p))),
            View::Directional(light) => u.for_each(|_| sink.push(light.sample_li())),
            View::Quad(light) => u.for_each(|u| sink.push(light.sample_li(p, u))),
            View::Sphere(light) => u.for_each(|u| sink.push(light.sample_li(p, u))),
            View::Disk(light) => u.for_each(|u| sink.push(light.sample_li(p, u))),
            View::Sun(cone) => u.for_each(|u| sink.push(sun::sample_li(cone, u))),
            View::Sky(sky) => u.for_each(|u| sink.push(sky.sample_li(u))),
        }
    }

    /// Density of [`sample_li`](Self::sample_li) at `point` of the light, per steradian seen from `p`; `None` of a delta
    /// light and of the sky.
    pub fn pdf_li(&self, p: DVec3, point: DVec3) -> Option<f64> {
        match &self.0 {
            View::Quad(light) => Some(light.pdf_li(p, point)),
            View::Sphere(light) => Some(light.pdf_li()),
            View::Disk(light) => Some(light.pdf_li(p, point)),
            View::Sun(cone) => Some(sun::pdf_li(cone)),
            View::Point(_) | View::Directional(_) | View::Sky(_) => None,
        }
    }

    /// A point of the light above the horizon of `n`, in the middle of what is: for slivers that
    /// no sample meets. `None` where nothing is.
    pub fn above(&self, p: DVec3, n: DVec3) -> Option<ShadowTarget> {
        match &self.0 {
            View::Quad(light) => light.above(p, n),
            View::Sphere(light) => light.above(p, n),
            View::Disk(light) => light.above(p, n),
            View::Sun(cone) => sun::above(cone, n),
            // Each sample of these lies above.
            View::Point(_) | View::Directional(_) | View::Sky(_) => None,
        }
    }
}

/// Whether light arrives from above; NaN goes on, to be counted at its pixel.
fn is_lit(cos: f64) -> bool {
    cos > 0.0 || cos.is_nan()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{
        DirectionalLight, DiskLight, PointLight, QuadLight, SphereLight, SpotLight,
    };

    /// Samples that were given.
    struct All(Vec<LightSample>);

    impl SampleSink for All {
        fn push(&mut self, sample: LightSample) {
            self.0.push(sample);
        }
    }

    fn samples(light: &LightSampler, p: DVec3, n: DVec3) -> Vec<LightSample> {
        let at = |k: u32| (k as f32 + 0.5) / 64.0;
        let u: Vec<[f32; 2]> = (0..64 * 64).map(|k| [at(k % 64), at(k / 64)]).collect();
        let mut all = All(Vec::new());
        light.seen_from(p, n).expect("outside").sample_li(p, &u, &mut all);
        all.0
    }

    fn lights(radius: f64) -> [Light; 4] {
        let (centre, radiance) = (DVec3::new(0.3, 2.0, -0.4), Rgb::ONE);
        let (normal, intensity, two_sided) = (DVec3::NEG_Y, Rgb::ONE, true);
        let corners = [[-0.6, -0.5], [0.9, -0.4], [0.7, 0.8], [-0.5, 0.6]];
        let corners = corners.map(|[x, z]| centre + DVec3::new(x, 0.0, z));
        [
            Light::Quad(QuadLight { corners, radiance, two_sided }),
            Light::Sphere(SphereLight { centre, radius: 0.7, radiance }),
            Light::Disk(DiskLight { centre, normal, radius: 0.7, radiance, two_sided }),
            Light::Spot(SpotLight {
                position: centre,
                direction: normal,
                intensity,
                cos_inner: 0.99,
                cos_outer: 0.5,
                radius,
            }),
        ]
    }

    /// Radiance times cosine over density is on average the irradiance in closed form, and each sample's weight is in
    /// proportion to it.
    #[test]
    fn samples_add_up_to_the_irradiance_without_shadows() {
        let sky = LightSampler::of_sky(&Sky { radiance: Rgb::ONE, ..Sky::default() });
        let area = lights(0.2).map(|light| LightSampler::new(&light));
        // The horizon of the second normal cuts most of the lights.
        let cut = DVec3::new(0.95, 0.1, 0.3).normalize();
        for (n, tolerance) in [(DVec3::Y, 2e-3), (cut, 2e-2)] {
            let p = DVec3::new(0.5, 0.1, 0.2);
            for (kind, light) in area.iter().chain([&sky]).enumerate() {
                let (mut sum, mut share) = (0.0, None);
                let all = samples(light, p, n);
                for LightSample { wi, radiance, pdf, .. } in &all {
                    let density = pdf.per_steradian().expect("an area light");
                    let irradiance = radiance * wi.dot(n).max(0.0) / density;
                    sum += irradiance;
                    assert!((wi.length() - 1.0).abs() < 1e-12);
                    if irradiance > 1e-6 {
                        let ratio = pdf.weight(n) / irradiance;
                        let same = *share.get_or_insert(ratio);
                        assert!((ratio / same - 1.0).abs() < 1e-6, "{kind}: {ratio} {same}");
                    }
                }
                let (mean, exact) = (sum / all.len() as f64, light.unshadowed(p, n));
                assert!((mean - exact).abs() < tolerance * exact, "{kind} {n}: {mean} for {exact}");
            }
        }
    }

    #[test]
    fn a_delta_light_has_one_direction_and_no_density() {
        let [position, p] = [DVec3::new(0.0, 3.0, 4.0), DVec3::ZERO];
        let point = Light::Point(PointLight { position, intensity: Rgb::ONE });
        let to_light = position / 5.0;
        let sun = Light::Directional(DirectionalLight { to_light, irradiance: Rgb::ONE });
        let [.., spot] = lights(0.0);
        for light in [point, sun, spot] {
            for sample in samples(&LightSampler::new(&light), p, DVec3::Y) {
                assert!((sample.wi.length() - 1.0).abs() < 1e-15 && sample.wi.y > 0.5);
                assert_eq!((sample.pdf.per_steradian(), sample.pdf.weight(DVec3::Y)), (None, 1.0));
                assert_eq!(sample.radiance, f64::INFINITY);
            }
        }
    }
}
