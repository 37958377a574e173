//! Pixel filters as densities of sample positions: a sample's weight is always 1 (Ernst,
//! Stamminger and Greiner, "Filter importance sampling", 2006).

/// Intervals over half of a tabulated filter. With 256 the distribution function is within
/// 2e-5 of the exact one.
const CELLS: usize = 256;

/// A separable pixel filter: draws offsets from the pixel's middle with the filter's density.
#[derive(Debug, Clone, PartialEq)]
pub struct PixelFilter {
    shape: Shape,
}

#[derive(Debug, Clone, PartialEq)]
enum Shape {
    Box,
    Tent,
    Table(HalfTable),
}

impl PixelFilter {
    /// One pixel wide: offsets in (-0.5, 0.5).
    pub fn boxed() -> Self {
        Self { shape: Shape::Box }
    }

    /// A triangle of radius 1 pixel.
    pub fn tent() -> Self {
        Self { shape: Shape::Tent }
    }

    /// A Gaussian of standard deviation 0.5 pixel, cut at 1.5.
    pub fn gaussian() -> Self {
        Self { shape: Shape::Table(HalfTable::new(1.5, |x| libm::exp(-2.0 * x * x))) }
    }

    /// A Blackman–Harris window of four terms and radius 1.5 pixels (Harris, 1978).
    pub fn blackman_harris() -> Self {
        let window = |x: f64| {
            let t = std::f64::consts::PI * x / 1.5;
            0.358_75
                + 0.488_29 * libm::cos(t)
                + 0.141_28 * libm::cos(2.0 * t)
                + 0.011_68 * libm::cos(3.0 * t)
        };
        Self { shape: Shape::Table(HalfTable::new(1.5, window)) }
    }

    /// The offset on one axis, pixels, for `u` in [0, 1); odd about `u = 0.5`, increasing.
    pub fn offset(&self, u: f64) -> f64 {
        // Half a filter, mirrored: `tail` is 1 in the middle and 0 at the edge.
        let (tail, sign) = if u < 0.5 { (2.0 * u, -1.0) } else { (2.0 * (1.0 - u), 1.0) };
        match &self.shape {
            Shape::Box => u - 0.5,
            Shape::Tent => sign * (1.0 - tail.sqrt()),
            Shape::Table(table) => sign * table.inverse(1.0 - tail),
        }
    }

    /// Offsets on both axes, pixels.
    pub fn offset2(&self, u: [f32; 2]) -> [f64; 2] {
        u.map(|u| self.offset(f64::from(u)))
    }
}

/// The right half of an even density, linear between equally spaced points.
#[derive(Debug, Clone, PartialEq)]
struct HalfTable {
    radius: f64,
    /// Density at the points, so that the half integrates to 1 with cells of width 1.
    density: Vec<f64>,
    /// Integral from 0 to each point; the last is 1.
    integral: Vec<f64>,
}

impl HalfTable {
    fn new(radius: f64, f: impl Fn(f64) -> f64) -> Self {
        let mut density: Vec<f64> =
            (0..=CELLS).map(|i| f(radius * i as f64 / CELLS as f64).max(0.0)).collect();
        let total: f64 = density.windows(2).map(|w| 0.5 * (w[0] + w[1])).sum();
        density.iter_mut().for_each(|d| *d /= total);
        let mut integral = Vec::with_capacity(CELLS + 1);
        let mut sum = 0.0;
        integral.push(sum);
        for w in density.windows(2) {
            sum += 0.5 * (w[0] + w[1]);
            integral.push(sum);
        }
        Self { radius, density, integral }
    }

    /// Where the integral is `u`, in [0, radius].
    fn inverse(&self, u: f64) -> f64 {
        let cell = self.integral.partition_point(|i| *i <= u).clamp(1, CELLS) - 1;
        let (a, b) = (self.density[cell], self.density[cell + 1]);
        // Root of a x + (b − a) x²/2 = rest that does not cancel.
        let rest = (u - self.integral[cell]).max(0.0);
        let x = 2.0 * rest / (a + (a * a + 2.0 * (b - a) * rest).max(0.0).sqrt());
        self.radius * (cell as f64 + x.min(1.0)) / CELLS as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Integral of f over [a, b] by Simpson's rule.
    fn integrate(a: f64, b: f64, f: impl Fn(f64) -> f64) -> f64 {
        let n = 2000;
        let h = (b - a) / f64::from(n);
        let weight = |i| if i == 0 || i == n { 1.0 } else { 2.0 + 2.0 * f64::from(i % 2) };
        (0..=n).map(|i| weight(i) * f(a + h * f64::from(i))).sum::<f64>() * h / 3.0
    }

    fn blackman_harris(x: f64) -> f64 {
        let t = std::f64::consts::TAU * (x + 1.5) / 3.0;
        0.35875 - 0.48829 * t.cos() + 0.14128 * (2.0 * t).cos() - 0.01168 * (3.0 * t).cos()
    }

    type Case = (PixelFilter, f64, fn(f64) -> f64);

    fn cases() -> [Case; 4] {
        [
            (PixelFilter::boxed(), 0.5, |_| 1.0),
            (PixelFilter::tent(), 1.0, |x| 1.0 - x.abs()),
            (PixelFilter::gaussian(), 1.5, |x| (-0.5 * (x / 0.5).powi(2)).exp()),
            (PixelFilter::blackman_harris(), 1.5, blackman_harris),
        ]
    }

    #[test]
    fn offsets_invert_the_distribution_function() {
        for (filter, radius, density) in cases() {
            assert!(filter.offset(0.0).abs() <= radius);
            let total = integrate(-radius, radius, density);
            for i in 0..=200 {
                let u = f64::from(i) / 200.0;
                let below = integrate(-radius, filter.offset(u), density) / total;
                assert!((below - u).abs() < 2e-5, "{filter:?}: {below} for {u}");
            }
        }
    }

    #[test]
    fn offsets_increase_are_odd_and_stay_inside() {
        for (filter, radius, _) in cases() {
            let mut last = f64::NEG_INFINITY;
            for i in 0..1 << 16 {
                let u = (f64::from(i) + 0.5) / 65536.0;
                let x = filter.offset(u);
                assert!(x > last && x.abs() < radius);
                assert_eq!(x, -filter.offset(1.0 - u));
                last = x;
            }
            let ends = filter.offset2([0.0, 1.0 - f32::EPSILON]);
            assert!(ends.iter().all(|x| x.abs() <= radius));
        }
    }

    #[test]
    fn variances_are_those_of_the_filters() {
        for (filter, radius, density) in cases() {
            let exact = integrate(-radius, radius, |x| x * x * density(x))
                / integrate(-radius, radius, density);
            let n = 1 << 16;
            let u = |i: i32| (f64::from(i) + 0.5) / f64::from(n);
            let found = (0..n).map(|i| filter.offset(u(i)).powi(2)).sum::<f64>() / f64::from(n);
            assert!((found / exact - 1.0).abs() < 1e-4, "{found} for {exact}");
        }
    }
}
