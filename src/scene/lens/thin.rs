//! The thin lens: sharp at one distance, blurred before and behind it (Potmesil and Chakravarty, "A lens and
//! aperture camera model for synthetic image generation", 1981; Cook, Porter and Carpenter, "Distributed ray
//! tracing", 1984).

use super::Lens;
use crate::error::{Error, Result};
use crate::math::DVec3;
use crate::sampling::concentric_disk;
use crate::scene::Recentring;
use crate::scene::spline::{Timed, around, catmull_rom};
use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// A thin lens that changes along the path.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ThinLensPath {
    /// Radius and focus at moments of the path, joined as key poses are, but never beyond the values of the two
    /// keys around a moment; at least one.
    pub keys: Vec<LensKey>,
    /// Blades that bound the aperture, 3 or more; 0 for a round one.
    pub blades: u32,
    /// Turn of the blades, degrees, counter-clockwise in the image; at 0 a corner points up in
    /// spots behind the focus, and down in those before it.
    pub blade_rotation_degrees: f64,
}

/// Radius and focus at a moment of the path.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LensKey {
    /// When, in `[0, 1]` of the path; strictly increasing from key to key.
    pub at: f64,
    /// Radius of the aperture, to its corners where it has blades, world units; 0 makes a pinhole.
    pub radius: f64,
    /// The plane in focus.
    pub focus: Focus,
}

/// The plane in focus.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Focus {
    /// The plane at this distance along the view axis, world units.
    Distance(f64),
    /// The plane through the camera's target.
    Target,
}

/// The thin lens of one camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ThinLens {
    /// Radius of the aperture, above 0.
    pub radius: f64,
    /// Distance of the plane that is sharp, along the view axis.
    pub focus: f64,
    /// Blades of the aperture; 0 for a round one.
    pub blades: u32,
    /// Turn of the blades, degrees.
    pub blade_rotation_degrees: f64,
}

/// Widest radius, world units: squares of what is further away leave the range of f32.
const WIDEST: f64 = 1e15;
/// Steepest slope of a ray against the view axis.
const STEEPEST: f64 = 1e12;
/// Most blades; a circle is hardly told from that.
pub const MOST_BLADES: u32 = 64;

impl Timed for LensKey {
    fn at(&self) -> f64 {
        self.at
    }
}

impl ThinLensPath {
    pub(super) fn check(&self) -> Result<()> {
        let Self { keys, blades, blade_rotation_degrees } = self;
        let fault = |what: String| Err(Error::Usage(what));
        if keys.is_empty() || !keys.windows(2).all(|pair| pair[0].at < pair[1].at) {
            return fault("the lens needs keys whose times increase".into());
        }
        for LensKey { radius, focus, .. } in keys {
            if !(radius.is_finite() && *radius >= 0.0) {
                return fault(format!("the lens has the radius {radius}; it must be 0 or more"));
            }
            if let Focus::Distance(distance) = focus {
                if !(distance.is_finite() && *distance > 0.0) {
                    return fault(format!(
                        "the lens is focused at the distance {distance}; it must be above 0"
                    ));
                }
            }
        }
        let is_shape = *blades == 0 || (3..=MOST_BLADES).contains(blades);
        if !(is_shape && blade_rotation_degrees.is_finite()) {
            return fault(format!(
                "the aperture has {blades} blades turned by {blade_rotation_degrees} degrees; \
                 it can have 3 to {MOST_BLADES}, or 0 where it is round"
            ));
        }
        Ok(())
    }

    /// The lens at `progress` of the path with the target `target` world units away.
    pub(super) fn at(&self, progress: f64, target: f64) -> Lens {
        let value = |get: &dyn Fn(&LensKey) -> f64| {
            let [a, b] = around(&self.keys, progress).map(|i| get(&self.keys[i]));
            catmull_rom(&self.keys, progress, get).clamp(a.min(b), a.max(b))
        };
        let radius = value(&|key| key.radius);
        let focus = value(&|key| match key.focus {
            Focus::Distance(distance) => distance,
            Focus::Target => target,
        });
        let Self { blades, blade_rotation_degrees, .. } = *self;
        match radius > 0.0 {
            true => Lens::Thin(ThinLens { radius, focus, blades, blade_rotation_degrees }),
            false => Lens::Pinhole,
        }
    }

    pub(super) fn reason(&self) -> (bool, String) {
        let radii = self.keys.iter().map(|key| key.radius);
        let (least, most) = radii.fold((f64::INFINITY, 0.0), |(a, b), r| (r.min(a), r.max(b)));
        let radius = match least == most {
            true => format!("radius {}", short(most)),
            false => format!("radius {} to {}", short(least), short(most)),
        };
        let distances = self.keys.iter().filter_map(|key| match key.focus {
            Focus::Distance(distance) => Some(distance),
            Focus::Target => None,
        });
        let (near, far) = distances.fold((f64::INFINITY, 0.0), |(a, b), d| (d.min(a), d.max(b)));
        let mut focus = match far {
            0.0 => String::new(),
            _ if near == far => format!("at {}", short(far)),
            _ => format!("at {} to {}", short(near), short(far)),
        };
        if self.keys.iter().any(|key| key.focus == Focus::Target) {
            focus += if focus.is_empty() { "on the target" } else { " and on the target" };
        }
        (most > 0.0, format!("thin lens, {radius}, focus {focus}"))
    }
}

impl ThinLens {
    pub(super) fn bend(
        &self,
        toward: DVec3,
        [right, up]: [DVec3; 2],
        u: [f64; 2],
    ) -> (DVec3, DVec3) {
        let [x, y] = self.aperture(u).map(|x| x * self.radius);
        let offset = right * x + up * y;
        // All rays of an image point meet at `toward` times the focus.
        (offset, toward - offset / self.focus)
    }

    /// Whether the rays through its rim start and point somewhere that can be traced.
    pub(super) fn is_in_range(&self) -> bool {
        self.radius <= WIDEST && self.radius / self.focus <= STEEPEST
    }

    /// A point of the aperture, its corners or rim 1 from the middle; uniform for a uniform `u`, and the middle
    /// for that of the square.
    fn aperture(&self, u: [f64; 2]) -> [f64; 2] {
        let (x, y, r2) = concentric_disk(u);
        if self.blades == 0 || r2 == 0.0 {
            return [x, y];
        }
        // Each sector of the disk becomes a triangle of the polygon, ring by ring; areas keep their ratios.
        let blades = f64::from(self.blades);
        let angle = libm::atan2(y, x).rem_euclid(TAU) / TAU * blades;
        let sector = angle.floor();
        let half = PI / blades;
        let (along, across) = (libm::cos(half), (2.0 * (angle - sector) - 1.0) * libm::sin(half));
        let turn = (self.blade_rotation_degrees % 360.0).to_radians() + FRAC_PI_2;
        let middle = turn + (2.0 * sector + 1.0) * half;
        let (sin, cos) = (libm::sin(middle), libm::cos(middle));
        let r = r2.sqrt();
        [r * (along * cos - across * sin), r * (along * sin + across * cos)]
    }

    pub(super) fn blur(&self, depth: f64) -> f64 {
        2.0 * self.radius * (depth - self.focus).abs() / self.focus
    }

    pub(super) fn to_scene(self, recentring: &Recentring) -> Self {
        let scale = recentring.scale();
        Self { radius: self.radius * scale, focus: self.focus * scale, ..self }
    }

    pub(super) fn numbers(&self) -> [f64; 4] {
        let Self { radius, focus, blades, blade_rotation_degrees } = *self;
        [radius, focus, f64::from(blades), blade_rotation_degrees]
    }

    /// `None` where no thin lens has these `numbers`.
    pub(super) fn from_numbers(numbers: [f64; 4]) -> Option<Self> {
        let [radius, focus, blades, blade_rotation_degrees] = numbers;
        let is_positive = |x: f64| x.is_finite() && x > 0.0;
        let is_shape = blades == 0.0 || (3..=MOST_BLADES).any(|n| f64::from(n) == blades);
        let is_sound = is_positive(radius)
            && is_positive(focus)
            && is_shape
            && blade_rotation_degrees.is_finite();
        is_sound.then_some(Self { radius, focus, blades: blades as u32, blade_rotation_degrees })
    }
}

/// `x`, 0 or more, to four digits that matter.
fn short(x: f64) -> f64 {
    let scale = libm::exp10(3.0 - x.max(f64::MIN_POSITIVE).log10().floor());
    if scale.is_finite() { (x * scale).round() / scale } else { x }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(at: f64, radius: f64, focus: Focus) -> LensKey {
        LensKey { at, radius, focus }
    }

    fn path(keys: Vec<LensKey>) -> ThinLensPath {
        ThinLensPath { keys, blades: 0, blade_rotation_degrees: 0.0 }
    }

    fn lens(blades: u32) -> ThinLens {
        ThinLens { radius: 0.25, focus: 4.0, blades, blade_rotation_degrees: 20.0 }
    }

    #[test]
    fn all_rays_of_an_image_point_meet_in_the_plane_of_focus() {
        let toward = DVec3::new(0.3, -0.2, -1.0);
        for blades in [0, 3, 6] {
            for u in [[0.01, 0.99], [0.5, 0.5], [0.7, 0.2]] {
                let (offset, dir) = lens(blades).bend(toward, [DVec3::X, DVec3::Y], u);
                assert!((offset + dir * 4.0 - toward * 4.0).length() < 1e-15);
                assert!(offset.length() <= 0.25 && offset.z == 0.0);
            }
            let (middle, dir) = lens(blades).bend(toward, [DVec3::X, DVec3::Y], [0.5; 2]);
            assert_eq!((middle, dir), (DVec3::ZERO, toward));
        }
    }

    #[test]
    fn an_aperture_of_blades_is_a_regular_polygon_and_evenly_sampled() {
        for blades in [3u32, 5, 8] {
            let lens = ThinLens { blade_rotation_degrees: 0.0, ..lens(blades) };
            let half = PI / f64::from(blades);
            let (mut up, mut inner, mut highest) = (0u32, 0u32, 0.0f64);
            let n = 400;
            for i in 0..n * n {
                let u = [i / n, i % n].map(|k| (f64::from(k) + 0.5) / f64::from(n));
                let [x, y] = lens.aperture(u);
                for side in 0..blades {
                    let normal = FRAC_PI_2 + f64::from(2 * side + 1) * half;
                    let distance = x * normal.cos() + y * normal.sin();
                    assert!(distance <= half.cos() + 1e-12, "{x} {y} beyond side {side}");
                }
                up += u32::from(x > 0.0);
                inner += u32::from(x.hypot(y) < 0.3);
                highest = highest.max(y);
            }
            let all = f64::from(n * n);
            let area = 0.5 * f64::from(blades) * (2.0 * half).sin();
            assert!((f64::from(up) / all - 0.5).abs() < 2e-3);
            assert!((f64::from(inner) / all - PI * 0.09 / area).abs() < 2e-3);
            assert!((highest - 1.0).abs() < 0.01, "a corner points up");
        }
    }

    #[test]
    fn focus_and_radius_pass_their_keys_and_never_leave_them() {
        let focus = [2.0, 8.0, 8.5, 3.0];
        let keys = (0..4).map(|i| {
            let at = f64::from(i) / 3.0;
            key(at, if i == 3 { 0.0 } else { 0.1 }, Focus::Distance(focus[i as usize]))
        });
        let path = path(keys.collect());
        path.check().expect("a lens");
        let at = |progress| match path.at(progress, 5.0) {
            Lens::Thin(lens) => lens,
            Lens::Pinhole => panic!("a pinhole at {progress}"),
        };
        assert_eq!([0.0, 1.0 / 3.0, 2.0 / 3.0].map(|t| at(t).focus), [2.0, 8.0, 8.5]);
        for k in 0..1000 {
            let found = at(f64::from(k) / 1000.0);
            assert!((2.0..=8.5).contains(&found.focus) && (0.0..=0.1).contains(&found.radius));
        }
        // Without a radius it is a pinhole, to the last bit.
        assert_eq!(path.at(1.0, 5.0), Lens::Pinhole);
    }

    #[test]
    fn focus_on_the_target_follows_it() {
        let all = path(vec![key(0.0, 0.1, Focus::Target), key(1.0, 0.1, Focus::Target)]);
        let half = path(vec![key(0.0, 0.1, Focus::Target), key(1.0, 0.1, Focus::Distance(2.0))]);
        for (progress, target) in [(0.0, 3.0), (0.3, 7.0), (1.0, 1.5)] {
            let Lens::Thin(lens) = all.at(progress, target) else { panic!("a pinhole") };
            assert_eq!(lens.focus, target);
        }
        let Lens::Thin(lens) = half.at(0.5, 6.0) else { panic!("a pinhole") };
        assert_eq!(lens.focus, 4.0);
    }

    #[test]
    fn numbers_make_the_same_lens_and_no_wrong_one() {
        for blades in [0, 3, 64] {
            let lens = Lens::Thin(lens(blades));
            assert_eq!(Lens::from_numbers(lens.numbers()), Some(lens));
        }
        assert_eq!(Lens::from_numbers([0.0; 5]), Some(Lens::Pinhole));
        let wrong = [
            [-1.0, 4.0, 0.0, 0.0],
            [0.0, 4.0, 0.0, 0.0],
            [0.1, 0.0, 0.0, 0.0],
            [0.1, f64::NAN, 0.0, 0.0],
            [0.1, 4.0, 2.0, 0.0],
            [0.1, 4.0, 6.5, 0.0],
            [0.1, 4.0, 0.0, f64::INFINITY],
        ];
        assert!(wrong.iter().all(|numbers| ThinLens::from_numbers(*numbers).is_none()));
        assert!(Lens::from_numbers([2.0, 1.0, 1.0, 0.0, 0.0]).is_none());
    }

    #[test]
    fn the_plans_reason_has_short_numbers() {
        let focus = Focus::Distance(2.0 / 3.0);
        let one = path(vec![key(0.0, 0.1 + 0.2, focus)]);
        assert_eq!(one.reason(), (true, "thin lens, radius 0.3, focus at 0.6667".into()));
        let two = path(vec![key(0.0, 0.0, focus), key(1.0, 1e-5, Focus::Target)]);
        let why = "thin lens, radius 0 to 0.00001, focus at 0.6667 and on the target";
        assert_eq!(two.reason(), (true, why.into()));
        assert_eq!([0.0, 120.0, 12345.0, 1.5].map(short), [0.0, 120.0, 12350.0, 1.5]);
        assert!(!path(vec![key(0.0, 0.0, focus)]).reason().0);
    }

    #[test]
    fn a_lens_of_absurd_size_is_out_of_range() {
        assert!(lens(0).is_in_range());
        for (radius, focus) in [(1e20, 1.0), (1e-5, 0.0), (1.0, 1e-15)] {
            assert!(!ThinLens { radius, focus, ..lens(0) }.is_in_range(), "{radius} {focus}");
        }
    }

    #[test]
    fn faults_are_named() {
        let text = |path: ThinLensPath| path.check().expect_err("a fault").to_string();
        assert!(text(path(vec![])).contains("keys"));
        assert!(text(path(vec![key(0.0, -1.0, Focus::Target)])).contains("radius -1"));
        assert!(text(path(vec![key(0.0, 1.0, Focus::Distance(0.0))])).contains("distance 0"));
        let two = ThinLensPath { blades: 2, ..path(vec![key(0.0, 1.0, Focus::Target)]) };
        assert!(text(two).contains("2 blades"));
    }
}
