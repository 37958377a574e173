//! Evidence: what probes found, and which estimates may be used for it.
//!
//! A probe is a pixel that is estimated from other frames *and* traced twice, independently. With the
//! estimate S and the traces A and B, (S - A)(S - B) is on average the squared error of the estimate, and
//! (A - B)²/2 that of a trace. Estimates are sorted into classes (`class.rs`); a class may be used
//! where probes of it, in the frame itself and in those that it is inferred from, found it no further from
//! the truth than a trace, or off by less than can be seen. Errors come in regions, a shadow here, a
//! thicket there: so what was found in a region of the surface outweighs what was found elsewhere.
//!
//! Every figure is a sum over findings in a fixed order.

use super::check::CheckRays;
use super::class::{CLASSES, family, hidden_error, is_direct};
use super::index::{cell_of, edge_of, key_of, level_of};
use crate::inference::{Estimate, SurfacePoint};
use crate::math::{Vec3, srgb_encode};
use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

/// Display steps.
const STEPS: f64 = 255.0;
/// Edge of a region, footprints: a power of two, as an exponent.
const REGION: i32 = 5;
/// Findings elsewhere count as many as this in a region: it has to gainsay them.
const PRIOR: f64 = 8.0;
/// A class with fewer findings takes in those of its family, as many as this.
const FEW: f64 = 16.0;
/// A class's error must be below its bound by so many standard errors.
const SURE: f64 = 1.0;
/// As large a share of the error that a class may hide (`hidden_error`) counts as found once among its
/// probes: a few that find nothing say little where a shadow's edge is near.
const HIDDEN: f64 = 0.25;
/// Of a tile's error that nobody sees, the share that a class may use up: errors are rare and large, so a
/// mean below it leaves tiles that are above.
const UNSEEN_SHARE: f64 = 0.5;

/// What a probe found at a surface point, all lights together that other frames know.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Finding {
    /// The point, scene space.
    pub p: Vec3,
    /// Its footprint, scene units.
    pub footprint: f32,
    /// Its mesh, or the spheres' number.
    pub geom_id: u32,
    /// Class of the estimate.
    pub class: u8,
    /// Squared error of the estimate, squares of a display step of the pixel; may be negative.
    pub error: f32,
    /// That of a trace.
    pub noise: f32,
    /// Whether check rays agreed with the estimate.
    pub agreed: bool,
}

/// What a light of a point showed: estimate and both traces.
#[derive(Debug, Clone, Copy)]
pub struct Compared {
    /// What the pixel would show of the light without shadows: luminance, exposure applied.
    pub unshadowed: f32,
    /// What other frames suggest.
    pub estimate: Estimate,
    /// Traced ratios.
    pub traced: [f32; 2],
}

/// What was found at `point`, which makes up `share` of its pixel, from what its lights showed; `None`
/// where other frames know none of them.
pub fn finding_at(
    point: &SurfacePoint,
    share: f32,
    lights: &[Compared],
    agreed: bool,
) -> Option<Finding> {
    let is_known = |l: &&Compared| {
        l.unshadowed != 0.0 && !l.estimate.ratio.is_nan() && !l.traced.iter().any(|r| r.is_nan())
    };
    let lights = || lights.iter().filter(is_known);
    let class = lights().next()?.estimate.class;
    let sum = |ratio: &dyn Fn(&Compared) -> f32| lights().map(|l| l.unshadowed * ratio(l)).sum();
    let estimated = shown(sum(&|l| l.estimate.ratio));
    let [a, b] = [0, 1].map(|k| shown(sum(&|l| l.traced[k])));
    let share = f64::from(share) * f64::from(share);
    Some(Finding {
        p: point.p.as_vec3(),
        footprint: point.footprint,
        geom_id: point.geom_id,
        class,
        error: (share * (estimated - a) * (estimated - b)) as f32,
        noise: (share * 0.5 * (a - b) * (a - b)) as f32,
        agreed,
    })
}

/// Display steps that `radiance` is shown as.
fn shown(radiance: f32) -> f64 {
    STEPS * srgb_encode(f64::from(radiance.clamp(0.0, 1.0)))
}

/// A set of classes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ClassSet([u64; CLASSES.div_ceil(64)]);

impl ClassSet {
    /// Whether `class` is in it.
    pub fn has(&self, class: u8) -> bool {
        self.0[usize::from(class) / 64] >> (class % 64) & 1 == 1
    }

    fn set(&mut self, class: u8, is_in: bool) {
        let bit = 1 << (class % 64);
        let word = &mut self.0[usize::from(class) / 64];
        *word = if is_in { *word | bit } else { *word & !bit };
    }
}

/// What is done with an estimate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// It is used as it is.
    Use,
    /// It is used where check rays agree.
    Check,
    /// The point is traced.
    Trace,
}

/// Which classes may be used as they are, and which where check rays agree.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Usable {
    outright: ClassSet,
    checked: ClassSet,
}

impl Usable {
    /// What is done with estimates of `class`.
    pub fn verdict(&self, class: u8) -> Verdict {
        match (self.outright.has(class), self.checked.has(class)) {
            (true, _) => Verdict::Use,
            (false, true) => Verdict::Check,
            (false, false) => Verdict::Trace,
        }
    }
}

/// Which classes may be used where.
#[derive(Debug, Clone, Default)]
pub struct Evidence {
    /// Where a region has no finding.
    elsewhere: Usable,
    regions: HashMap<u64, Usable, BuildHasherDefault<Mixed>>,
}

/// Sums over findings.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    count: f64,
    error: f64,
    noise: f64,
    /// Of the squared errors' squares.
    squares: f64,
}

impl Sums {
    fn add(&mut self, finding: &Finding) {
        let (error, noise) = (f64::from(finding.error), f64::from(finding.noise));
        self.count += 1.0;
        self.error += error;
        self.noise += noise;
        self.squares += error * error;
    }

    /// With `prior` findings more that are like those of `other`.
    fn with(&self, other: &Self, prior: f64) -> Self {
        let by = if other.count > 0.0 { prior / other.count } else { 0.0 };
        Self {
            count: self.count + by * other.count,
            error: self.error + by * other.error,
            noise: self.noise + by * other.noise,
            squares: self.squares + by * other.squares,
        }
    }

    /// Standard error of the mean error.
    fn doubt(&self) -> f64 {
        self.squares.sqrt() / self.count
    }

    /// Whether the error is at most tracing's noise or `unseen`, by `margin`.
    fn may_be_used(&self, margin: f64, unseen: f64) -> bool {
        let [error, noise] = [self.error, self.noise].map(|sum| sum / self.count);
        self.count > 0.0 && error + margin <= noise.max(unseen)
    }
}

/// How much of the error that a class may hide is left behind check rays: what so many rays overlook is about
/// as large a part of it.
fn overlooked(class: u8, rays: CheckRays) -> f64 {
    let rays = if is_direct(class) { rays.direct } else { rays.specular };
    f64::from(rays).powi(-2)
}

/// The classes that may be used, by findings for which something holds, with `overlooked` of the hidden error
/// of each.
fn sort<'f>(
    findings: impl Iterator<Item = &'f Finding>,
    unseen: f64,
    overlooked: impl Fn(u8) -> f64,
) -> (ClassSet, HashMap<u64, ClassSet, BuildHasherDefault<Mixed>>) {
    let mut families = [Sums::default(); CLASSES];
    let mut classes = [Sums::default(); CLASSES];
    let mut regions: HashMap<(u64, u8), Sums, BuildHasherDefault<Mixed>> = HashMap::default();
    for finding in findings {
        families[usize::from(family(finding.class))].add(finding);
        classes[usize::from(finding.class)].add(finding);
        for level in -1..=1 {
            let region = region(finding.geom_id, finding.footprint, finding.p, level);
            regions.entry((region, finding.class)).or_default().add(finding);
        }
    }
    let mut elsewhere = ClassSet::default();
    let mut margins = [0.0; CLASSES];
    for class in 0..CLASSES as u8 {
        let at = usize::from(class);
        if classes[at].count < FEW {
            classes[at] = classes[at].with(&families[usize::from(family(class))], PRIOR);
        }
        let hidden = HIDDEN * overlooked(class) * hidden_error(class) / classes[at].count.max(1.0);
        margins[at] = SURE * classes[at].doubt() + hidden;
        elsewhere.set(class, classes[at].may_be_used(margins[at], unseen));
    }
    let mut sets = HashMap::default();
    for ((region, class), sums) in &regions {
        let at = usize::from(*class);
        let sums = sums.with(&classes[at], PRIOR);
        let set: &mut ClassSet = sets.entry(*region).or_insert(elsewhere);
        set.set(*class, sums.may_be_used(margins[at], unseen));
    }
    (elsewhere, sets)
}

impl Evidence {
    /// What `findings` amount to, where so many `rays` check an estimate. An error of `tolerance` display
    /// steps (root mean square over a tile) is not seen.
    pub fn of<'f>(
        findings: impl Iterator<Item = &'f Finding> + Clone,
        rays: CheckRays,
        tolerance: f32,
    ) -> Self {
        let unseen = UNSEEN_SHARE * f64::from(tolerance) * f64::from(tolerance);
        let (outright, of_regions) = sort(findings.clone(), unseen, |_| 1.0);
        let agreed = findings.filter(|finding| finding.agreed);
        let (checked, checked_of_regions) = sort(agreed, unseen, |class| overlooked(class, rays));
        let elsewhere = Usable { outright, checked };
        let mut regions: HashMap<u64, Usable, _> = HashMap::default();
        for (region, outright) in of_regions {
            regions.insert(region, Usable { outright, ..elsewhere });
        }
        for (region, checked) in checked_of_regions {
            regions.entry(region).or_insert(elsewhere).checked = checked;
        }
        Self { elsewhere, regions }
    }

    /// What is done with the estimate that `finding` is about.
    pub fn verdict(&self, finding: &Finding) -> Verdict {
        let region = region(finding.geom_id, finding.footprint, finding.p, 0);
        self.regions.get(&region).unwrap_or(&self.elsewhere).verdict(finding.class)
    }

    /// The classes that may be used at a point.
    pub fn at(&self, point: &SurfacePoint) -> Usable {
        let region = region(point.geom_id, point.footprint, point.p.as_vec3(), 0);
        self.regions.get(&region).copied().unwrap_or(self.elsewhere)
    }
}

/// The region of a point, `further` levels coarser than its footprint asks for.
fn region(geom_id: u32, footprint: f32, p: Vec3, further: i32) -> u64 {
    let level = level_of(footprint) + REGION + further;
    key_of(level, geom_id, cell_of(p.as_dvec3(), edge_of(level)))
}

/// Passes on keys that are mixed already.
#[derive(Default)]
struct Mixed(u64);

impl Hasher for Mixed {
    fn finish(&self) -> u64 {
        self.0
    }

    fn write(&mut self, bytes: &[u8]) {
        bytes.iter().for_each(|byte| self.write_u8(*byte));
    }

    fn write_u8(&mut self, byte: u8) {
        self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    }

    fn write_u64(&mut self, word: u64) {
        self.0 ^= word;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of a class of calm estimates, and of one beside a shadow's edge.
    const CALM: u8 = 0;
    const EDGE: u8 = 4 * 24;

    fn point(x: f32) -> SurfacePoint {
        let p = Vec3::new(x, 0.0, 0.0).as_dvec3();
        let (n, footprint) = (Vec3::Y, 0.01);
        SurfacePoint { p, n, geom_id: 0, footprint, cos: 1.0, direct: true, samples: 1 }
    }

    fn found(x: f32, class: u8, error: f32, noise: f32) -> Finding {
        let (p, footprint, geom_id, agreed) = (Vec3::new(x, 0.0, 0.0), 0.01, 0, true);
        Finding { p, footprint, geom_id, class, error, noise, agreed }
    }

    fn may_use(findings: &[Finding], x: f32, class: u8) -> bool {
        Evidence::of(findings.iter(), 0.25).at(&point(x)).has(class)
    }

    #[test]
    fn nothing_is_used_without_a_probe() {
        assert!(!may_use(&[], 0.0, CALM));
        assert!(!may_use(&[found(0.0, CALM, 0.0, 0.0)], 0.0, EDGE));
    }

    #[test]
    fn what_is_no_worse_than_a_trace_is_used_and_what_is_worse_is_not() {
        let probes = |error, noise| vec![found(0.0, EDGE, error, noise); 400];
        assert!(may_use(&probes(1.0, 2.0), 0.0, EDGE));
        assert!(!may_use(&probes(3.0, 2.0), 0.0, EDGE));
        // Nobody sees it, if there are enough probes to say so.
        let calm = |error| vec![found(0.0, CALM, error, 0.0); 400];
        assert!(may_use(&calm(0.01), 0.0, CALM));
        assert!(!may_use(&calm(0.1), 0.0, CALM));
    }

    #[test]
    fn an_edge_needs_more_probes_than_what_is_calm() {
        let clean = |class, count| vec![found(0.0, class, 0.0, 0.5); count];
        assert!(may_use(&clean(CALM, 20), 0.0, CALM));
        assert!(!may_use(&clean(EDGE, 20), 0.0, EDGE));
        assert!(may_use(&clean(EDGE, 1000), 0.0, EDGE));
    }

    #[test]
    fn a_region_gainsays_what_was_found_elsewhere() {
        let mut probes = vec![found(0.0, EDGE, 1.0, 2.0); 1000];
        probes.extend([found(5.0, EDGE, 9.0, 2.0); 20]);
        assert!(may_use(&probes, 0.0, EDGE) && may_use(&probes, 9.0, EDGE));
        assert!(!may_use(&probes, 5.0, EDGE));
        let finding = found(5.0, EDGE, 0.0, 0.0);
        assert!(!Evidence::of(probes.iter(), 0.25).may_use(&finding));
    }

    #[test]
    fn a_finding_compares_all_known_lights_together() {
        let light = |ratio: f32, traced| Compared {
            unshadowed: 0.5,
            estimate: Estimate { ratio, class: EDGE },
            traced,
        };
        // One light's error makes up for the other's.
        let lights = [light(0.5, [0.25; 2]), light(0.5, [0.75; 2])];
        let finding = finding_at(&point(0.0), 1.0, &lights).expect("known");
        assert_eq!((finding.error, finding.noise, finding.class), (0.0, 0.0, EDGE));
        let noisy = [light(0.5, [0.25, 0.75]), light(f32::NAN, [1.0, 0.0])];
        let finding = finding_at(&point(0.0), 1.0, &noisy).expect("one is known");
        assert!(finding.error < 0.0 && finding.noise > 0.0);
        let half = finding_at(&point(0.0), 0.5, &noisy).expect("one is known");
        assert!((half.noise / finding.noise - 0.25).abs() < 1e-6);
        assert!(finding_at(&point(0.0), 1.0, &noisy[1..]).is_none());
    }
}
