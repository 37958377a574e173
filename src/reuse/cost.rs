//! Which lights are worth a lookup: decided from a fixed table of costs, never from measured times, so that
//! every machine decides alike.

use super::evidence::{Evidence, Finding};
use super::risk::{is_direct, is_part};
use crate::effects::EffectPlan;
use crate::error::counted;
use crate::inference::{Channel, Channels, SAMPLES_TOGETHER, check_rays};
use crate::scene::{MeanLights, Scene, Settings};
use crate::stats::{RayCounts, RayKind};

// Nanoseconds on one core of the machine that they were measured on. Only their ratios count.

/// Cost of a shadow ray with its sample in a scene of a few triangles.
const SHADOW_RAY: f64 = 38.0;
/// Binary logarithm of the number of triangles with which a shadow ray costs twice as much.
const TWICE: f64 = 13.5;
/// Cost of looking up one surface point in all references and of keeping the point for other frames, without lights.
const LOOKUP: f64 = 250.0;
/// Cost of looking up one light of a surface point.
const LIGHT: f64 = 230.0;
/// The same where each point has lights of its own, which are found in lists.
const LISTED_LIGHT: f64 = 390.0;
/// Cost of each further ratio of a light that has one for each primary colour.
const RATIO: f64 = 115.0;
/// Cost of merging one camera sample into the surface point that it shares with others of its pixel.
const JOINING: f64 = 110.0;
/// Cost of a check ray, in units of a shadow ray that is traced with many others of its point.
const CHECK_RAY: f64 = 1.7;

/// The largest share of points to expect to be inferred. Where that would not pay, nothing is tried: probes, and
/// points that are kept for other frames, cost a twentieth to a tenth of a trace.
const MOST_INFERRED: f64 = 0.85;
/// The ratio of most points: no shadow.
const OPEN: f32 = 1.0;

/// Cost of a shadow ray with its sample in `scene`. With fewer triangles the tree is flatter, and more of it
/// stays in the processor's caches.
fn shadow_ray(scene: &Scene) -> f64 {
    let primitives = scene.triangle_count() + scene.spheres.len();
    SHADOW_RAY * (1.0 + (libm::log2(primitives.max(1) as f64) / TWICE).powi(3))
}

/// Whether looking up the light of `channel` is cheaper than the shadow rays that a pixel casts to it.
fn is_worth(scene: &Scene, settings: &Settings, channel: Channel) -> bool {
    let lookup = match channel {
        Channel::Selected(..) | Channel::Tail(_) => LISTED_LIGHT,
        // At least: it is in a list where other lights are.
        Channel::Area(..) | Channel::Sky(_) => LIGHT,
    };
    f64::from(pixel_rays(channel, settings)) * shadow_ray(scene) > lookup
}

/// Whether to infer a light whose point is traced to others, which saves `rays` shadow rays: where its check rays cost at
/// most half as much.
pub(super) fn is_worth_in_part(rays: u32) -> bool {
    2.0 * CHECK_RAY * f64::from(check_rays(rays, 1.0, OPEN, true)) <= f64::from(rays)
}

/// Number of shadow rays that one camera sample casts to the light of a channel; the largest number where points
/// may stop after pilot rays.
pub(super) fn rays_of(channel: Channel, settings: &Settings) -> u32 {
    match channel {
        Channel::Area(..) | Channel::Selected(..) | Channel::Tail(_) => settings.shadow_samples,
        Channel::Sky(_) => settings.sky_samples,
    }
}

/// The part of all points that take all samples of an area light although they have pilots: in the scenes of
/// `scenes/` a tenth to four tenths.
const DISPUTED: f64 = 0.25;

/// Expected number of shadow rays of one camera sample in a channel, where the pilots of some points may be enough.
fn expected_rays(channel: Channel, settings: &Settings) -> u32 {
    let all = rays_of(channel, settings);
    match channel {
        Channel::Area(..) | Channel::Selected(..) => match settings.least_shadow_samples {
            Some(pilots) => (pilots + (DISPUTED * f64::from(all)) as u32).min(all),
            None => all,
        },
        // Hardly any point sees all of the sky or nothing; the tail has no pilots.
        Channel::Tail(_) | Channel::Sky(_) => all,
    }
}

/// Expected number of shadow rays of a pixel in a channel.
fn pixel_rays(channel: Channel, settings: &Settings) -> u32 {
    expected_rays(channel, settings).saturating_mul(settings.spp)
}

/// The lights whose ratios are worth keeping.
pub fn channels(scene: &Scene, settings: &Settings) -> Channels {
    let plan = EffectPlan::of(scene, settings);
    let cells = scene.selected_lights(settings);
    let kept = Channels::of(scene, cells, plan.coloured_shadows, |channel| {
        let runs = match channel {
            Channel::Area(..) | Channel::Selected(..) | Channel::Tail(_) => plan.area_lights,
            Channel::Sky(_) => plan.sky_light,
        };
        // The camera samples of a pixel share one lookup.
        runs && plan.diffuse && is_worth(scene, settings, channel)
    });
    let cost = PointCost::of(scene, &kept, settings, direct_samples(settings));
    if MOST_INFERRED * (cost.traced - cost.checked) > cost.lookup {
        kept
    } else {
        Channels::of(scene, cells, false, |_| false)
    }
}

/// Whether a light's shadowing is looked up in other frames, and why.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LookupReason {
    /// Name of the light in messages.
    pub light: String,
    /// Whether it is looked up; else it is traced in every frame.
    pub looked_up: bool,
    /// The reason, in words.
    pub why: String,
}

/// For each light that shines, then the sky: whether it is looked up or traced, and why.
pub fn lookup_reasons(scene: &Scene, settings: &Settings) -> Vec<LookupReason> {
    let kept = channels(scene, settings);
    let EffectPlan { diffuse, area_lights, sky_light, .. } = EffectPlan::of(scene, settings);
    let soft = scene.lights.iter().filter(|light| light.is_area()).count();
    let is_alone = usize::from(area_lights) * soft + usize::from(sky_light) == 1;
    let why = |channel, looked_up| why((scene, settings, channel), looked_up, diffuse, is_alone);
    let mut reasons = Vec::new();
    let delta = || "one hard shadow ray is not worth a lookup".to_string();
    if let Some(cells) = scene.selected_lights(settings) {
        // Too many to list: they differ by nothing that decides.
        let (looked_up, hard) = (kept.slots() > 0, scene.lights.len() - soft);
        let why = match cells.most_area() {
            0 => "at no point one of them stands out from the others".into(),
            _ => why(Channel::Selected(0, 0), looked_up),
        };
        let soft = (soft, "area light", looked_up, why);
        for (count, kind, looked_up, why) in [soft, (hard, "delta light", false, delta())] {
            if count > 0 {
                reasons.push(LookupReason { light: counted(count, kind), looked_up, why });
            }
        }
    } else {
        for (index, light) in scene.lights.iter().enumerate() {
            let channel = light.is_area().then_some(Channel::Area(index as u32, 0));
            let looked_up = kept.of_light(index as u32).is_some();
            let why = channel.map_or_else(delta, |channel| why(channel, looked_up));
            let light = format!("light {}, {}", index + 1, light.name());
            reasons.push(LookupReason { light, looked_up, why });
        }
    }
    if sky_light {
        let looked_up = !kept.sky().is_empty();
        let why = why(Channel::Sky(0), looked_up);
        reasons.push(LookupReason { light: "sky".into(), looked_up, why });
    }
    reasons
}

/// Why the light of `channel` is `looked_up` or not; whether it `is_alone`, without others that have soft shadows.
fn why(
    (scene, settings, channel): (&Scene, &Settings, Channel),
    looked_up: bool,
    diffuse: bool,
    is_alone: bool,
) -> String {
    if !diffuse {
        return "no diffuse surface: what a rough mirror shows depends on the view".into();
    }
    let all = pixel_rays(channel, settings);
    let vary = settings.most_spp.is_some() || settings.least_shadow_samples.is_some();
    let rays = match all {
        0 => return "it has no samples".into(),
        1 => "one shadow ray".into(),
        _ if vary => format!("{all} or so shadow rays"),
        _ => format!("{all} shadow rays"),
    };
    match (looked_up, is_worth(scene, settings, channel)) {
        (true, _) => format!("one lookup costs less than a pixel's {rays}"),
        (false, true) if !is_alone => {
            format!("a pixel's {rays}, and those to other lights, are too few for reuse")
        }
        (false, true) => format!("a pixel's {rays} are too few for reuse"),
        (false, false) => format!("a lookup costs more than a pixel's {rays}"),
    }
}

/// The cost of a frame that cast `rays` and looked up `lookups` surface points, in camera rays, each with the look at
/// its surface. In all scenes that were measured a shadow ray costs a sixth to a third of one.
pub fn of_frame(rays: &RayCounts, lookups: u64) -> f64 {
    let of_kind = |kind| match kind {
        RayKind::Camera => 1.0,
        // From a mirror, perfect or rough, or glass, traced alone; followed through glass.
        RayKind::Mirror | RayKind::Glossy | RayKind::Glass | RayKind::ThroughGlass => 2.0,
        RayKind::ShadowArea | RayKind::ShadowDelta | RayKind::ShadowSky | RayKind::ShadowFog => {
            0.25
        }
        // Second tries are few, and part of what their first ones cost.
        RayKind::Retry | RayKind::Invalid => 0.0,
    };
    let of_rays = RayKind::ALL.map(|kind| of_kind(kind) * rays[kind] as f64);
    of_rays.iter().sum::<f64>() + 2.5 * lookups as f64
}

/// Number of camera samples of a pixel that share a lookup where they see one surface directly. Each sample that a mirror
/// or glass leads to a surface takes a lookup of its own.
fn direct_samples(settings: &Settings) -> u32 {
    settings.spp.min(SAMPLES_TOGETHER)
}

/// Costs of the light of one surface point, whose camera samples are shaded together.
struct PointCost {
    /// Cost of tracing.
    traced: f64,
    /// Cost of check rays.
    checked: f64,
    /// Cost of looking the point up in all references and of merging its camera samples.
    lookup: f64,
}

impl PointCost {
    /// Of a point of this many `samples`.
    fn of(scene: &Scene, channels: &Channels, settings: &Settings, samples: u32) -> Self {
        let mean = scene.light_cells.as_ref().map(|cells| cells.mean()).unwrap_or_default();
        let MeanLights { area, tails, tail_samples, .. } = mean;
        // Few points have as many lights as they have channels for.
        let share = |channel| match channel {
            Channel::Selected(..) => area / channels.slots() as f64,
            // All parts have the same rays.
            Channel::Tail(_) => tail_samples / channels.tail().len() as f64,
            Channel::Sky(_) => 1.0 / channels.sky().len() as f64,
            Channel::Area(..) => 1.0 / channels.colours() as f64,
        };
        let sum = |of: &dyn Fn(Channel) -> u32| -> f64 {
            channels.iter().map(|channel| share(channel) * f64::from(of(channel))).sum()
        };
        let traced = |channel| samples.saturating_mul(expected_rays(channel, settings));
        // The part of the points that have the light of a channel.
        let present = |channel| match channel {
            Channel::Selected(..) => area * channels.colours() as f64 / channels.slots() as f64,
            Channel::Tail(_) => tails,
            Channel::Area(..) | Channel::Sky(_) => 1.0,
        };
        let is_first = |channel: &Channel| channel.part() == 0;
        let lights: f64 = channels.iter().filter(is_first).map(present).sum();
        let light = if channels.slots() > 0 { LISTED_LIGHT } else { LIGHT };
        let looked_up = channels
            .iter()
            .map(|channel| present(channel) * if is_first(&channel) { light } else { RATIO });
        // As if all lights were as bright.
        let checked = |channel| {
            let saved = samples.saturating_mul(rays_of(channel, settings));
            check_rays(saved, 1.0 / lights.max(1.0) as f32, OPEN, false)
        };
        Self {
            traced: shadow_ray(scene) * sum(&traced),
            checked: shadow_ray(scene) * CHECK_RAY * sum(&checked),
            lookup: LOOKUP + looked_up.sum::<f64>() + JOINING * f64::from(samples),
        }
    }
}

/// Whether lookups of all points would save more than they cost if each estimate held, where a share `known` of the points
/// has one.
pub fn could_be_worth_lookups(
    known: f64,
    (scene, channels, settings): (&Scene, &Channels, &Settings),
) -> bool {
    let cost = PointCost::of(scene, channels, settings, direct_samples(settings));
    known * (cost.traced - cost.checked) > cost.lookup
}

/// The points of a frame that are looked up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LookedUp {
    /// None: the frame is traced whole.
    Nothing,
    /// Those that a pixel shows directly.
    Direct,
    /// Those in mirrors and through glass too.
    All,
}

/// What lookups of some points save: the sum over the findings at them, and the sum of the squares.
#[derive(Debug, Clone, Copy, Default)]
struct Gain {
    sum: f64,
    squares: f64,
}

impl Gain {
    fn with(self, other: Self) -> Self {
        Self { sum: self.sum + other.sum, squares: self.squares + other.squares }
    }

    /// Whether it is above zero by more than `deviations` of the standard deviations that it would have if lookups saved
    /// nothing on average. About zero and not about their mean: a few findings that agree may do so by chance.
    fn exceeds(self, deviations: f64) -> bool {
        self.sum > deviations * self.squares.sqrt()
    }

    /// Whether it is below zero by more than as many.
    fn falls_below(self, deviations: f64) -> bool {
        self.sum < -deviations * self.squares.sqrt()
    }
}

/// What lookups save, by the findings of probes, if those estimates are used that the evidence allows.
pub struct Gains {
    direct: Gain,
    /// At points in mirrors and through glass.
    specular: Gain,
}

impl Gains {
    /// Of `findings`, judged by `evidence`. A share `probed` of the points is probed, each of which is traced once more. For
    /// each point in mirrors and through glass that has an estimate, `unknown` have none. Where pixels have one camera sample
    /// all points count as seen directly.
    pub fn of<'f>(
        evidence: &Evidence,
        findings: impl Iterator<Item = &'f Finding>,
        (scene, channels, settings): (&Scene, &Channels, &Settings),
        (probed, unknown): (f64, f64),
    ) -> Self {
        let of_samples = |samples| PointCost::of(scene, channels, settings, samples);
        let (direct, specular) = (of_samples(direct_samples(settings)), of_samples(1));
        let mut gains = Self { direct: Gain::default(), specular: Gain::default() };
        // With one camera sample a lookup saves as much in mirrors and glass: all points are judged together.
        let is_apart = direct_samples(settings) > 1;
        // Each point has one finding of all its lights.
        for finding in findings.filter(|finding| !is_part(finding.level)) {
            let (cost, gain, unknown) = match is_direct(finding.level) || !is_apart {
                true => (&direct, &mut gains.direct, 0.0),
                false => (&specular, &mut gains.specular, unknown),
            };
            let saved = match (evidence.may_use(finding.level, 1.0), finding.agreed) {
                (true, true) => cost.traced - cost.checked,
                (true, false) => -cost.checked,
                (false, _) => 0.0,
            };
            let sum = saved - probed * cost.traced - cost.lookup - unknown * LOOKUP;
            *gain = gain.with(Gain { sum, squares: sum * sum });
        }
        gains
    }

    /// Whether lookups of all points, or of those alone that are seen directly, save more than they cost: by more than
    /// `deviations` standard deviations.
    pub fn pay(&self, deviations: f64) -> bool {
        let all = self.direct.with(self.specular);
        self.direct.exceeds(deviations) || all.exceeds(deviations)
    }

    /// The points to look up. Those in mirrors and through glass are left out if lookups of them lose more than the others
    /// gain, or lose by more than `deviations` standard deviations: few findings do not tell.
    pub fn looked_up(&self, deviations: f64) -> LookedUp {
        let all = self.direct.with(self.specular);
        if all.exceeds(0.0) && !self.specular.falls_below(deviations) {
            LookedUp::All
        } else if self.direct.exceeds(0.0) {
            LookedUp::Direct
        } else {
            LookedUp::Nothing
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{DVec3, Rgb};
    use crate::reuse::risk::STEPS;
    use crate::scene::{
        Environment, EnvironmentKind, Light, Material, PointLight, Sky, SkyGradient, SphereLight,
        World, WorldSphere,
    };

    /// A grey room under `count` lamps and a sky of this `radiance`.
    fn room(count: u32, radiance: f32) -> Scene {
        world(count, radiance).into_scene(true).expect("a scene")
    }

    fn world(count: u32, radiance: f32) -> World {
        let sky = Sky { radiance: Rgb::splat(radiance), ..Sky::default() };
        let lamp = |k| {
            let centre = DVec3::new(0.02 * f64::from(k), 1.0, 0.0);
            Light::Sphere(SphereLight { centre, radius: 0.1, radiance: Rgb::ONE })
        };
        let lights = (0..count).map(lamp).collect();
        let mut world = World { lights, sky, ..World::default() };
        let grey = world.add_material(Material::diffuse("grey", Rgb::splat(0.5)));
        world.spheres.push(WorldSphere::new("room", DVec3::ZERO, 2.0, grey));
        world
    }

    /// Whether `count` findings without error show a gain of more than `deviations` standard deviations.
    fn pays(
        scene: &Scene,
        settings: &Settings,
        level: usize,
        (count, deviations): (usize, f64),
    ) -> bool {
        let channels = channels(scene, settings);
        assert!(!channels.is_empty());
        let exact = Finding { level: level as u8, agreed: true, error: 0.0, noise: 1.0 };
        let findings = vec![exact; count];
        let evidence = Evidence::of(std::iter::repeat_n(&exact, 100), 0.25);
        Gains::of(&evidence, findings.iter(), (scene, &channels, settings), (0.01, 0.0))
            .pay(deviations)
    }

    #[test]
    fn lookups_of_single_samples_in_mirrors_pay_with_more_rays_than_those_of_pixels() {
        let scene = room(1, 0.0);
        let is_worth = |level, shadow_samples| {
            let settings = Settings { spp: 4, shadow_samples, ..Settings::default() };
            pays(&scene, &settings, level, (100, 0.0))
        };
        let (direct, specular) = (0, 2 * STEPS);
        assert!(is_worth(direct, 16) && !is_worth(specular, 16));
        assert!(is_worth(specular, 256));
    }

    #[test]
    fn points_in_mirrors_are_left_out_where_lookups_of_them_lose_by_more_than_chance() {
        let scene = room(1, 0.0);
        let settings = Settings { spp: 4, ..Settings::default() };
        let channels = channels(&scene, &settings);
        let exact =
            |level: usize| Finding { level: level as u8, agreed: true, error: 0.0, noise: 1.0 };
        // The evidence allows the first two.
        let levels = [0, 2 * STEPS, STEPS - 1, 3 * STEPS - 1];
        let [direct, specular, risky, risky_specular] = levels.map(exact);
        let known = [direct, specular].into_iter().cycle().take(200).collect::<Vec<_>>();
        let evidence = Evidence::of(known.iter(), 0.25);
        let looked_up = |found: &[(Finding, usize)]| {
            let each =
                found.iter().flat_map(|(finding, count)| std::iter::repeat_n(finding, *count));
            Gains::of(&evidence, each, (&scene, &channels, &settings), (0.0, 0.0)).looked_up(2.0)
        };
        assert_eq!(looked_up(&[]), LookedUp::Nothing);
        assert_eq!(looked_up(&[(risky, 100)]), LookedUp::Nothing);
        assert_eq!(looked_up(&[(specular, 100)]), LookedUp::Nothing);
        assert_eq!(looked_up(&[(direct, 100)]), LookedUp::All);
        // Four that lose are no proof.
        assert_eq!(looked_up(&[(direct, 100), (specular, 4)]), LookedUp::All);
        assert_eq!(looked_up(&[(direct, 100), (specular, 5)]), LookedUp::Direct);
        // Where they lose more than the others gain they are left out too.
        assert_eq!(looked_up(&[(direct, 1), (risky_specular, 4)]), LookedUp::Direct);
        // With more rays they gain as well.
        let settings = Settings { shadow_samples: 256, ..settings };
        let each = [direct, specular, specular, specular, specular, specular];
        let looked_up = |unknown| {
            let cast = (&scene, &channels, &settings);
            Gains::of(&evidence, each.iter(), cast, (0.0, unknown)).looked_up(2.0)
        };
        assert_eq!(looked_up(0.0), LookedUp::All);
        // Unless most lookups find nothing.
        assert_eq!(looked_up(99.0), LookedUp::Direct);
    }

    #[test]
    fn what_a_few_findings_agree_on_may_be_chance() {
        let settings = Settings { spp: 4, ..Settings::default() };
        let pays = |count| pays(&room(1, 0.0), &settings, 0, (count, 2.0));
        assert_eq!([1, 4, 5, 100].map(pays), [false, false, true, true]);
    }

    #[test]
    fn each_light_that_a_point_has_and_each_further_ratio_is_a_lookup() {
        let settings = Settings { spp: 4, ..Settings::default() };
        let lookup = |scene: &Scene| {
            let channels = channels(scene, &settings);
            let cost = PointCost::of(scene, &channels, &settings, 4);
            (cost.lookup - LOOKUP - 4.0 * JOINING, channels)
        };
        let is_near = |a: f64, b: f64| (a - b).abs() < 1e-9;
        assert!(is_near(lookup(&room(1, 0.0)).0, LIGHT));
        assert!(is_near(lookup(&room(2, 1.0)).0, 3.0 * LIGHT));
        let [zenith, horizon, ground] = [Rgb::X, Rgb::Y, Rgb::Z];
        let gradient = EnvironmentKind::Gradient(SkyGradient { zenith, horizon, ground });
        let environment = Some(Environment::new(gradient));
        let tinted = World { environment, ..world(1, 0.0) }.into_scene(true).expect("a scene");
        let (cost, channels) = lookup(&tinted);
        assert_eq!(channels.sky().len(), 3);
        assert!(is_near(cost, 2.0 * LIGHT + 2.0 * RATIO));
        // Selected lights.
        let many = room(24, 1.0);
        let (cost, channels) = lookup(&many);
        assert!(channels.slots() > 0 && channels.tail().len() == 1);
        let mean = many.light_cells.as_ref().map(|cells| cells.mean()).unwrap_or_default();
        assert!(mean.area > 0.0 && mean.tails > 0.0, "{mean:?}");
        assert!(is_near(cost, (mean.area + mean.tails + 1.0) * LISTED_LIGHT));
    }

    #[test]
    fn a_sky_beside_many_lights_without_an_extent_is_in_no_list() {
        let mut world = world(0, 1.0);
        let point =
            |k| Light::Point(PointLight { position: DVec3::Y / f64::from(k), intensity: Rgb::ONE });
        world.lights = (1..20).map(point).collect();
        let scene = world.into_scene(true).expect("a scene");
        let settings = Settings { spp: 4, ..Settings::default() };
        let channels = channels(&scene, &settings);
        assert!(scene.selected_lights(&settings).is_some() && channels.len() == 1);
        let cost = PointCost::of(&scene, &channels, &settings, 4);
        assert_eq!(cost.lookup, LOOKUP + LIGHT + 4.0 * JOINING);
    }

    #[test]
    fn one_light_has_no_others_that_are_too_few() {
        let settings =
            |rays| Settings { shadow_samples: rays, sky_samples: rays, ..Settings::default() };
        // Enough rays for a lookup of the light, too few for that of the point.
        let rays = (1..64).find(|n| is_worth(&room(1, 0.0), &settings(*n), Channel::Area(0, 0)));
        let settings = settings(rays.expect("a number"));
        let told = |scene: &Scene, settings: &Settings| {
            lookup_reasons(scene, settings).into_iter().map(|reason| reason.why).collect::<Vec<_>>()
        };
        let alone = "shadow rays are too few for reuse";
        for scene in [room(1, 0.0), room(0, 1.0)] {
            assert!(told(&scene, &settings)[0].ends_with(alone));
        }
        for scene in [room(2, 0.0), room(1, 1.0)] {
            assert!(
                told(&scene, &settings).iter().all(|why| why.contains("those to other lights"))
            );
        }
        let no_shadows = Settings { shadow_samples: 0, ..settings };
        assert!(told(&room(1, 1.0), &no_shadows)[1].ends_with(alone));
    }
}
