//! FLIP's colour pipeline: from sRGB to a perceived difference in [0, 1] per pixel.

use super::{Plane, kernel, to_f32};
use crate::film::Image;
use crate::math::{Rgb, Vec3, srgb_decode};
use rayon::prelude::*;
use std::f64::consts::PI;

/// Exponent on the HyAB distance.
const QC: f32 = 0.7;
/// Share of the largest distance that is mapped to [`PT`]; beyond it, the map is compressed.
const PC: f32 = 0.4;
const PT: f32 = 0.95;
/// D65 reference white, CIE XYZ.
const WHITE: Vec3 = Vec3::new(0.950_428_55, 1.0, 1.088_900_4);

/// The contrast-sensitivity functions are sums of `a √(π/b) exp(-π² x² / b)`, x in degrees:
/// (a, b) per channel, two terms for Cz.
const SENSITIVITY_Y: (f64, f64) = (1.0, 0.0047);
const SENSITIVITY_CX: (f64, f64) = (1.0, 0.0053);
const SENSITIVITY_CZ: [(f64, f64); 2] = [(34.1, 0.04), (13.5, 0.025)];

/// The image's Y, Cx and Cz planes.
pub fn ycxcz(image: &Image) -> [Plane; 3] {
    let linear = |v: f32| srgb_decode(f64::from(v)) as f32;
    let convert = |c: &Rgb| {
        let xyz = linear_to_xyz(Vec3::new(linear(c.x), linear(c.y), linear(c.z))) / WHITE;
        Vec3::new(116.0 * xyz.y - 16.0, 500.0 * (xyz.x - xyz.y), 200.0 * (xyz.y - xyz.z))
    };
    let pixels: Vec<Vec3> = image.rgb.par_iter().map(convert).collect();
    let (width, height) = (image.width as usize, image.height as usize);
    [0, 1, 2].map(|c| Plane::from_fn(width, height, |i| pixels[i][c]))
}

/// The perceived colour difference of every pixel, in [0, 1].
pub fn colour_difference(reference: &[Plane; 3], test: &[Plane; 3], ppd: f64) -> Vec<f32> {
    let filters = Filters::new(ppd);
    let (reference, test) = (filters.hunt_lab(reference), filters.hunt_lab(test));
    let largest = {
        let [green, blue] = [Vec3::Y, Vec3::Z].map(|c| hunt(xyz_to_lab(linear_to_xyz(c))));
        libm::powf(hyab(green, blue), QC)
    };
    let knee = PC * largest;
    let map = |(p, q): (&Vec3, &Vec3)| {
        let difference = libm::powf(hyab(*p, *q), QC);
        if difference < knee {
            difference * PT / knee
        } else {
            PT + (difference - knee) / (largest - knee) * (1.0 - PT)
        }
    };
    reference.par_iter().zip(&test).map(map).collect()
}

/// The filters of the eye, as kernels in pixels.
struct Filters {
    y: Vec<f32>,
    cx: Vec<f32>,
    cz: [Vec<f32>; 2],
}

impl Filters {
    fn new(ppd: f64) -> Self {
        let widest = SENSITIVITY_CZ[0].1;
        let radius = libm::ceil(3.0 * libm::sqrt(widest / (2.0 * PI * PI)) * ppd) as usize;
        let fall = |b: f64| move |d: f64| libm::exp(-PI * PI * (d / ppd) * (d / ppd) / b);
        let normalised = |b: f64| {
            let k = kernel(radius, fall(b));
            to_f32(&k, 1.0 / k.iter().sum::<f64>())
        };
        // Each term of Cz is separable with the root of its height on either axis; the two
        // terms together must sum to 1 over the square.
        let terms = SENSITIVITY_CZ.map(|(a, b)| {
            let height = libm::sqrt(a * libm::sqrt(PI / b));
            kernel(radius, |d| height * fall(b)(d))
        });
        let total: f64 = terms.iter().map(|k| k.iter().sum::<f64>()).map(|s| s * s).sum();
        let cz = terms.map(|k| to_f32(&k, 1.0 / libm::sqrt(total)));
        Self { y: normalised(SENSITIVITY_Y.1), cx: normalised(SENSITIVITY_CX.1), cz }
    }

    /// Filters the planes and converts each pixel to Hunt-adjusted L*a*b*.
    fn hunt_lab(&self, [y, cx, cz]: &[Plane; 3]) -> Vec<Vec3> {
        let y = y.filtered(&self.y, &self.y).data;
        let cx = cx.filtered(&self.cx, &self.cx).data;
        let [cz1, cz2] = [0, 1].map(|i| cz.filtered(&self.cz[i], &self.cz[i]).data);
        let pixel = |i| {
            let y = (y[i] + 16.0) / 116.0;
            let xyz = Vec3::new(y + cx[i] / 500.0, y, y - (cz1[i] + cz2[i]) / 200.0) * WHITE;
            let inside = xyz_to_linear(xyz).clamp(Vec3::ZERO, Vec3::ONE);
            hunt(xyz_to_lab(linear_to_xyz(inside)))
        };
        (0..y.len()).into_par_iter().map(pixel).collect()
    }
}

/// Hunt's effect: colours lose chroma as they darken.
fn hunt(lab: Vec3) -> Vec3 {
    Vec3::new(lab.x, 0.01 * lab.x * lab.y, 0.01 * lab.x * lab.z)
}

/// City-block in lightness, Euclidean in chroma (Abasi et al., 2020).
fn hyab(a: Vec3, b: Vec3) -> f32 {
    let d = a - b;
    d.x.abs() + (d.y * d.y + d.z * d.z).sqrt()
}

fn linear_to_xyz(c: Vec3) -> Vec3 {
    Vec3::new(
        0.412_386_57 * c.x + 0.357_591_48 * c.y + 0.180_450_5 * c.z,
        0.212_636_81 * c.x + 0.715_182_97 * c.y + 0.072_180_2 * c.z,
        0.019_330_62 * c.x + 0.119_197_17 * c.y + 0.950_372_6 * c.z,
    )
}

fn xyz_to_linear(c: Vec3) -> Vec3 {
    Vec3::new(
        3.241_003_3 * c.x - 1.537_399 * c.y - 0.498_615_86 * c.z,
        -0.969_224_33 * c.x + 1.875_930_1 * c.y + 0.041_554_224 * c.z,
        0.055_639_423 * c.x - 0.204_011_2 * c.y + 1.057_148_9 * c.z,
    )
}

fn xyz_to_lab(xyz: Vec3) -> Vec3 {
    const DELTA: f32 = 6.0 / 29.0;
    let f = |v: f32| {
        if v > DELTA * DELTA * DELTA {
            libm::cbrtf(v)
        } else {
            v / (3.0 * DELTA * DELTA) + 4.0 / 29.0
        }
    };
    let v = xyz / WHITE;
    let (x, y, z) = (f(v.x), f(v.y), f(v.z));
    Vec3::new(116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_is_neutral_and_the_matrices_are_inverse() {
        let lab = xyz_to_lab(linear_to_xyz(Vec3::ONE));
        assert!((lab - Vec3::new(100.0, 0.0, 0.0)).length() < 1e-2, "{lab}");
        let c = Vec3::new(0.2, 0.7, 0.4);
        assert!((xyz_to_linear(linear_to_xyz(c)) - c).length() < 1e-5);
    }

    #[test]
    fn filters_keep_a_constant() {
        let filters = Filters::new(67.0);
        let sum = |k: &[f32]| f64::from(k.iter().sum::<f32>());
        assert!((sum(&filters.y) - 1.0).abs() < 1e-6 && (sum(&filters.cx) - 1.0).abs() < 1e-6);
        let cz: f64 = filters.cz.iter().map(|k| sum(k).powi(2)).sum();
        assert!((cz - 1.0).abs() < 1e-6);
        assert_eq!(filters.y.len(), 21);
    }
}
