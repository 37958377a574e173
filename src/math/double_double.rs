//! Numbers of twice f64's precision: a sum of two f64 (Dekker, 1971; Joldes et al., 2017).
//!
//! For the few places that must round once only. Not done: overflow and underflow; operands stay
//! within about 1e±100.

use super::DVec3;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// `high + low`, where `high` is the sum rounded to f64.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DoubleDouble {
    high: f64,
    low: f64,
}

impl DoubleDouble {
    /// `a − b` without rounding.
    pub fn difference(a: f64, b: f64) -> Self {
        two_sum(a, -b)
    }

    /// The nearest f64.
    pub fn round(self) -> f64 {
        self.high
    }
}

impl From<f64> for DoubleDouble {
    fn from(high: f64) -> Self {
        Self { high, low: 0.0 }
    }
}

impl Add for DoubleDouble {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        let (high, low) = (two_sum(self.high, o.high), two_sum(self.low, o.low));
        let sum = fast_two_sum(high.high, high.low + low.high);
        fast_two_sum(sum.high, sum.low + low.low)
    }
}

impl Neg for DoubleDouble {
    type Output = Self;
    fn neg(self) -> Self {
        Self { high: -self.high, low: -self.low }
    }
}

impl Sub for DoubleDouble {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        self + -o
    }
}

impl Mul for DoubleDouble {
    type Output = Self;
    fn mul(self, o: Self) -> Self {
        let p = two_product(self.high, o.high);
        fast_two_sum(p.high, p.low + (self.high * o.low + self.low * o.high))
    }
}

impl Div for DoubleDouble {
    type Output = Self;
    fn div(self, o: Self) -> Self {
        let first = self.high / o.high;
        let rest = self - o * first.into();
        let second = rest.high / o.high;
        let rest = rest - o * second.into();
        let sum = fast_two_sum(first, second);
        fast_two_sum(sum.high, sum.low + rest.high / o.high)
    }
}

/// Three numbers of twice f64's precision.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DoubleDouble3([DoubleDouble; 3]);

impl DoubleDouble3 {
    /// `a − b` without rounding.
    pub fn difference(a: DVec3, b: DVec3) -> Self {
        Self([0, 1, 2].map(|i| DoubleDouble::difference(a[i], b[i])))
    }

    /// `org + t·dir`, to be rounded once.
    pub fn along(org: DVec3, dir: DVec3, t: f64) -> Self {
        Self([0, 1, 2].map(|i| DoubleDouble::from(org[i]) + two_product(dir[i], t)))
    }

    /// The nearest f64 vector.
    pub fn round(self) -> DVec3 {
        DVec3::from_array(self.0.map(DoubleDouble::round))
    }

    /// Scalar product.
    pub fn dot(self, o: Self) -> DoubleDouble {
        let [a, b, c] = [0, 1, 2].map(|i| self.0[i] * o.0[i]);
        a + b + c
    }

    /// Vector product.
    pub fn cross(self, o: Self) -> Self {
        let ([ax, ay, az], [bx, by, bz]) = (self.0, o.0);
        Self([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])
    }
}

fn two_sum(a: f64, b: f64) -> DoubleDouble {
    let high = a + b;
    let of_b = high - a;
    DoubleDouble { high, low: (a - (high - of_b)) + (b - of_b) }
}

/// For `|a| >= |b|`.
fn fast_two_sum(a: f64, b: f64) -> DoubleDouble {
    let high = a + b;
    DoubleDouble { high, low: b - (high - a) }
}

fn two_product(a: f64, b: f64) -> DoubleDouble {
    let high = a * b;
    // A fused product and sum is one IEEE operation: the same on every CPU.
    DoubleDouble { high, low: a.mul_add(b, -high) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keeps_what_f64_loses() {
        let tiny = 1e-25;
        let sum = DoubleDouble::from(1.0) + DoubleDouble::from(tiny);
        assert_eq!((sum - DoubleDouble::from(1.0)).round(), tiny);
        // (1 + 2^-40)(1 − 2^-40) = 1 − 2^-80.
        let small = 2f64.powi(-40);
        let product = two_sum(1.0, small) * two_sum(1.0, -small);
        assert_eq!((product - DoubleDouble::from(1.0)).round(), -small * small);
        let third = DoubleDouble::from(1.0) / DoubleDouble::from(3.0);
        let off = third * DoubleDouble::from(3.0) - DoubleDouble::from(1.0);
        assert!(off.round().abs() < 1e-31);
    }

    #[test]
    fn the_cross_product_of_near_parallel_vectors_keeps_its_digits() {
        let (a, b) = (DVec3::new(1.0, 1.0 + 1e-15, 0.0), DVec3::new(1.0 + 1e-15, 1.0, 0.0));
        let wide = |v| DoubleDouble3::difference(v, DVec3::ZERO);
        // 1 − (1 + e)² with e = 1e-15 as rounded.
        let e = (1.0 + 1e-15) - 1.0;
        let z = wide(a).cross(wide(b)).round().z;
        assert!((z + e * (2.0 + e)).abs() < 1e-30 * 2.0, "{z}");
    }
}
