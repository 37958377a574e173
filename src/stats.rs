//! Counts that travel upwards: rays by kind, and invalid samples. Merging is order-free.

mod audit;

pub use audit::{AuditSums, DrawnSum};

use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::collections::BTreeMap;
use std::ops::{AddAssign, Index, IndexMut};

/// The purpose of a ray.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RayKind {
    /// Camera rays.
    Camera,
    /// Rays reflected by mirrors.
    Mirror,
    /// Rays reflected by rough surfaces.
    Glossy,
    /// Rays reflected or refracted by glass.
    Glass,
    /// Shadow rays to area lights.
    ShadowArea,
    /// Shadow rays to delta lights.
    ShadowDelta,
    /// Shadow rays to the sky.
    ShadowSky,
    /// Shadow rays from fog to lights and sky.
    ShadowFog,
    /// Shadow rays straight on from a surface that they met, where glass lets them through.
    ThroughGlass,
    /// Second tries after a miss inside the bounds; their first tries count as what they are.
    Retry,
    /// Rays refused before tracing (NaN, infinite, zero direction); they also count as what they are.
    Invalid,
}

const _: () = assert!(RayKind::Invalid as usize + 1 == RayKind::ALL.len(), "the last kind");

impl RayKind {
    /// All kinds, in the order in which they are stored and shown.
    pub const ALL: [Self; 11] = [
        Self::Camera,
        Self::Mirror,
        Self::Glossy,
        Self::Glass,
        Self::ShadowArea,
        Self::ShadowDelta,
        Self::ShadowSky,
        Self::ShadowFog,
        Self::ThroughGlass,
        Self::Retry,
        Self::Invalid,
    ];

    /// The kinds that were traced.
    pub fn traced() -> impl Iterator<Item = Self> {
        Self::ALL.into_iter().filter(|kind| *kind != Self::Invalid)
    }

    /// The kind in a table.
    pub fn name(self) -> &'static str {
        match self {
            Self::Camera => "camera",
            Self::Mirror => "mirror",
            Self::Glossy => "glossy",
            Self::Glass => "glass",
            Self::ShadowArea => "shadow of area lights",
            Self::ShadowDelta => "shadow of other lights",
            Self::ShadowSky => "shadow of the sky",
            Self::ShadowFog => "shadow in fog",
            Self::ThroughGlass => "shadow through glass",
            Self::Retry => "second tries",
            Self::Invalid => "invalid",
        }
    }

    /// The kind in JSON and CSV files.
    pub fn key(self) -> &'static str {
        match self {
            Self::Camera => "camera",
            Self::Mirror => "mirror",
            Self::Glossy => "glossy",
            Self::Glass => "glass",
            Self::ShadowArea => "shadow_area",
            Self::ShadowDelta => "shadow_delta",
            Self::ShadowSky => "shadow_sky",
            Self::ShadowFog => "shadow_fog",
            Self::ThroughGlass => "shadow_glass",
            Self::Retry => "retry",
            Self::Invalid => "invalid",
        }
    }
}

/// Rays cast, by kind: `counts[RayKind::Camera]`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct RayCounts([u64; RayKind::ALL.len()]);

impl RayCounts {
    /// `rays` of one kind, none of the others.
    pub fn of(kind: RayKind, rays: u64) -> Self {
        let mut counts = Self::default();
        counts[kind] = rays;
        counts
    }

    /// All rays that were traced, second tries included.
    pub fn total(&self) -> u64 {
        RayKind::traced().map(|kind| self[kind]).sum()
    }
}

impl Index<RayKind> for RayCounts {
    type Output = u64;

    fn index(&self, kind: RayKind) -> &u64 {
        &self.0[kind as usize]
    }
}

impl IndexMut<RayKind> for RayCounts {
    fn index_mut(&mut self, kind: RayKind) -> &mut u64 {
        &mut self.0[kind as usize]
    }
}

impl AddAssign for RayCounts {
    fn add_assign(&mut self, o: Self) {
        self.0.iter_mut().zip(o.0).for_each(|(count, more)| *count += more);
    }
}

// Named in files that people read, a number of each kind in order in those that only tweenray reads.
impl Serialize for RayCounts {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match serializer.is_human_readable() {
            true => serializer.collect_map(RayKind::ALL.map(|kind| (kind.key(), self[kind]))),
            false => self.0.serialize(serializer),
        }
    }
}

impl<'de> Deserialize<'de> for RayCounts {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        if !deserializer.is_human_readable() {
            return Deserialize::deserialize(deserializer).map(Self);
        }
        let named = BTreeMap::<String, u64>::deserialize(deserializer)?;
        Ok(Self(RayKind::ALL.map(|kind| named.get(kind.key()).copied().unwrap_or(0))))
    }
}

/// Surface points that a kept light could shine on, and how many of them needed no ray to one.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ReuseCounts {
    /// Points seen directly and sharply.
    pub direct: u64,
    /// Those of them that were inferred.
    pub direct_inferred: u64,
    /// Points seen in mirrors, through glass or out of focus.
    pub specular: u64,
    /// Those of them that were inferred.
    pub specular_inferred: u64,
    /// Points of both kinds some of whose lights were inferred and others traced.
    #[serde(default)]
    pub inferred_in_part: u64,
}

impl ReuseCounts {
    /// Whether there was nothing to infer.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// Whether anything was inferred.
    pub fn is_inferred(&self) -> bool {
        self.direct_inferred + self.specular_inferred + self.inferred_in_part > 0
    }

    /// Number of points of one frame that were looked up in others, but for those of probes. Points in mirrors and
    /// through glass of which none was inferred whole count as not looked up.
    pub fn looked_up(&self) -> u64 {
        let of = |inferred, points| if inferred { points } else { 0 };
        of(self.is_inferred(), self.direct) + of(self.specular_inferred > 0, self.specular)
    }

    /// Share of the points that were inferred, 0 to 1; `None` where there was none to infer.
    pub fn share(&self) -> Option<f64> {
        share(self.direct_inferred + self.specular_inferred, self.direct + self.specular)
    }

    /// Share of the points that were inferred in part, 0 to 1; `None` where there was none to infer.
    pub fn share_in_part(&self) -> Option<f64> {
        share(self.inferred_in_part, self.direct + self.specular)
    }

    /// Share of the points seen in mirrors, through glass or out of focus that were inferred, 0 to 1; `None` without any.
    pub fn specular_share(&self) -> Option<f64> {
        share(self.specular_inferred, self.specular)
    }
}

fn share(part: u64, all: u64) -> Option<f64> {
    (all > 0).then(|| part as f64 / all as f64)
}

impl AddAssign for ReuseCounts {
    fn add_assign(&mut self, o: Self) {
        self.direct += o.direct;
        self.direct_inferred += o.direct_inferred;
        self.specular += o.specular;
        self.specular_inferred += o.specular_inferred;
        self.inferred_in_part += o.inferred_in_part;
    }
}

/// Why a radiance is invalid; later faults outdo earlier ones.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Fault {
    /// Some channel is negative.
    Negative,
    /// Some channel is infinite.
    Infinite,
    /// Some channel is not a number.
    NotANumber,
}

impl Fault {
    /// The kind of invalid sample of the linear RGB radiance `channels`; `None` if it is valid.
    pub fn of(channels: [f32; 3]) -> Option<Self> {
        if channels.iter().any(|c| c.is_nan()) {
            Some(Self::NotANumber)
        } else if channels.iter().any(|c| c.is_infinite()) {
            Some(Self::Infinite)
        } else {
            channels.iter().any(|c| *c < 0.0).then_some(Self::Negative)
        }
    }
}

/// Invalid camera samples: NaN, infinite or negative. Each is counted once, by its worst fault.
///
/// They stay in the picture as they are: a pixel that is NaN is NaN in an exr file.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct BadSamples {
    /// Some channel is not a number.
    pub nan: u64,
    /// Some channel is infinite; also pixels whose sum of finite samples is.
    pub infinite: u64,
    /// Some channel is negative.
    pub negative: u64,
    /// Column and row of the first pixel that has one, row by row.
    pub first: Option<[u32; 2]>,
}

impl BadSamples {
    /// All of them.
    pub fn total(&self) -> u64 {
        self.nan + self.infinite + self.negative
    }

    /// Whether there is none.
    pub fn is_none(&self) -> bool {
        self.total() == 0
    }

    /// One more, of pixel `(x, y)`.
    pub fn count(&mut self, fault: Fault, x: u32, y: u32) {
        let mut one = Self { first: Some([x, y]), ..Self::default() };
        match fault {
            Fault::NotANumber => one.nan = 1,
            Fault::Infinite => one.infinite = 1,
            Fault::Negative => one.negative = 1,
        }
        *self += one;
    }
}

impl AddAssign for BadSamples {
    fn add_assign(&mut self, o: Self) {
        self.nan += o.nan;
        self.infinite += o.infinite;
        self.negative += o.negative;
        let pixels = [self.first, o.first].into_iter().flatten();
        self.first = pixels.min_by_key(|[x, y]| (*y, *x));
    }
}

impl std::fmt::Display for BadSamples {
    /// `12 NaN, 3 negative`.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let kinds = [(self.nan, "NaN"), (self.infinite, "infinite"), (self.negative, "negative")];
        let words: Vec<String> = kinds
            .iter()
            .filter(|(count, _)| *count > 0)
            .map(|(count, name)| format!("{count} {name}"))
            .collect();
        f.write_str(&words.join(", "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_of_a_kind_that_is_not_inferred_are_not_looked_up() {
        let counts = ReuseCounts { direct: 10, specular: 5, ..ReuseCounts::default() };
        assert_eq!(counts.looked_up(), 0);
        assert_eq!(ReuseCounts { direct_inferred: 1, ..counts }.looked_up(), 10);
        assert_eq!(ReuseCounts { inferred_in_part: 1, ..counts }.looked_up(), 10);
        assert_eq!(
            ReuseCounts { direct_inferred: 1, specular_inferred: 1, ..counts }.looked_up(),
            15
        );
    }

    #[test]
    fn faults_have_names_and_the_worst_one_counts() {
        let (nan, inf) = (f32::NAN, f32::INFINITY);
        assert_eq!(Fault::of([0.0, -0.0, 1e38]), None);
        assert_eq!(Fault::of([1.0, -1e-30, 0.0]), Some(Fault::Negative));
        assert_eq!(Fault::of([-1.0, inf, 0.0]), Some(Fault::Infinite));
        assert_eq!(Fault::of([-1.0, -inf, nan]), Some(Fault::NotANumber));
    }

    #[test]
    fn sums_keep_the_first_pixel_in_any_order() {
        let mut a = BadSamples::default();
        a.count(Fault::NotANumber, 3, 4);
        let mut b = BadSamples::default();
        b.count(Fault::Negative, 7, 2);
        let (mut ab, mut ba) = (a, b);
        ab += b;
        ba += a;
        assert_eq!(ab, ba);
        assert_eq!((ab.total(), ab.first), (2, Some([7, 2])));
        assert_eq!(ab.to_string(), "1 NaN, 1 negative");
    }
}
