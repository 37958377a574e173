//! The settings that are compared: each knob alone, then combinations of those that trade error for
//! time.

use super::knobs::{Candidate, Group, Knob};
use crate::effects::EffectPlan;
use crate::scene::limits::MAX_SAMPLES;
use crate::scene::{BuildQuality, HitRules, IntersectorKind, Policy, Recheck, Settings};

/// The default first, then each knob of `groups` alone, then combinations. Left out are knobs that by
/// `plan` have no part in the scene, settings that equal an earlier one, and those that make no
/// difference in a move of `frames` frames. `looks_up` says whether any light is worth a lookup in other
/// frames under given settings.
pub fn candidates(
    base: &Settings,
    plan: &EffectPlan,
    frames: u32,
    looks_up: &dyn Fn(&Settings) -> bool,
    groups: &[Group],
) -> Vec<Candidate> {
    let mut list = List { base, frames, looks_up, all: Vec::new() };
    list.add(Knob::Default, String::new(), |_| ());
    let takes = |group| groups.contains(&group);
    if takes(Group::Reuse) {
        list.reuse();
    }
    if takes(Group::Samples) {
        list.samples(plan);
    }
    if takes(Group::Specular) && (plan.mirror || plan.glass) {
        list.specular();
    }
    if takes(Group::Intersection) {
        list.intersection();
    }
    if takes(Group::Tree) && base.intersector == IntersectorKind::Embree {
        list.tree();
    }
    if takes(Group::Combinations) {
        list.combinations(plan);
    }
    if takes(Group::Denoiser) {
        list.denoised(plan);
    }
    list.all
}

struct List<'a> {
    base: &'a Settings,
    frames: u32,
    looks_up: &'a dyn Fn(&Settings) -> bool,
    all: Vec<Candidate>,
}

impl List<'_> {
    fn add(&mut self, knob: Knob, options: String, turn: impl FnOnce(&mut Settings)) {
        let mut settings = self.base.clone();
        turn(&mut settings);
        let is_denoised = knob.is_denoised();
        let mut same = self.all.iter().filter(|other| other.knob.is_denoised() == is_denoised);
        if same.all(|other| other.settings != settings) {
            self.all.push(Candidate { knob, options, settings });
        }
    }

    /// Whether frames look up light in other frames under `settings`.
    fn reuses(&self, settings: &Settings) -> bool {
        self.frames > 1 && (self.looks_up)(settings)
    }

    fn reuse(&mut self) {
        // Colours are taken over whatever lights the scene, where that was asked for.
        let has_part = self.reuses(self.base) || self.base.reuse.policy == Policy::Colour;
        if self.frames < 2 || !has_part {
            return;
        }
        for (name, policy) in
            [("off", Policy::Off), ("surface", Policy::Surface), ("colour", Policy::Colour)]
        {
            self.add(Knob::Policy, format!("--policy {name}"), |s| s.reuse.policy = policy);
        }
        if self.base.reuse.policy != Policy::Surface {
            return;
        }
        // Where it is left to the scene, a display step is one of those to compare with.
        let base = self.base.reuse.tolerance;
        for tolerance in [0.25, 0.5, 1.0, 2.0, 4.0].map(|f| times(f, base)) {
            let options = format!("--tolerance {tolerance}");
            self.add(Knob::Tolerance, options, |s| s.reuse.tolerance = tolerance);
        }
        // A segment longer than the move is one as long as it.
        let cut = |segment: u32| segment.min(self.frames);
        let others = [16, 64, 512].into_iter().filter(|s| cut(*s) != cut(self.base.reuse.segment));
        for segment in others.collect::<Vec<u32>>() {
            let options = format!("--segment {segment}");
            self.add(Knob::Segment, options, |s| s.reuse.segment = segment);
        }
        for probes in [0.003, 0.03] {
            self.add(Knob::Probes, format!("--probes {probes}"), |s| s.reuse.probes = probes);
        }
    }

    fn samples(&mut self, plan: &EffectPlan) {
        let base = self.base.spp;
        let [less, more] = around(base);
        let counts = [less, base, base.saturating_mul(2).min(MAX_SAMPLES), more];
        // The default is there already.
        let uniform = counts.into_iter().map(|spp| (spp, None));
        let wider = base.saturating_mul(8).min(MAX_SAMPLES);
        let ranges = [(base.div_ceil(2), counts[2]), (base, more), (base, wider)];
        let ranges = ranges.map(|(least, most)| (least, (most > least).then_some(most)));
        for (spp, most_spp) in uniform.chain(ranges) {
            self.add_camera_samples(spp, most_spp);
        }
        if plan.area_lights {
            for n in around(self.base.shadow_samples) {
                let options = format!("--shadow-samples {n}");
                self.add(Knob::ShadowSamples, options, |s| {
                    (s.shadow_samples, s.least_shadow_samples) = (n, None);
                });
            }
            let n = self.base.shadow_samples;
            if let Some(pilots) = pilots(n) {
                let options = format!("--shadow-samples {pilots}..{n}");
                self.add(Knob::ShadowSamples, options, |s| s.least_shadow_samples = Some(pilots));
            }
        }
        if plan.sky_light {
            for n in around(self.base.sky_samples) {
                let options = format!("--sky-samples {n}");
                self.add(Knob::SkySamples, options, |s| {
                    (s.sky_samples, s.least_sky_samples) = (n, None);
                });
            }
            let n = self.base.sky_samples;
            if let Some(pilots) = pilots(n) {
                let options = format!("--sky-samples {pilots}..{n}");
                self.add(Knob::SkySamples, options, |s| s.least_sky_samples = Some(pilots));
            }
        }
    }

    fn add_camera_samples(&mut self, spp: u32, most_spp: Option<u32>) {
        let given = Settings { spp, most_spp, ..self.base.clone() };
        let options = format!("--spp {}", given.camera_samples());
        self.add(Knob::CameraSamples, options, |s| *s = given);
    }

    fn specular(&mut self) {
        let bounces = self.base.bounces;
        for n in [1, bounces / 2, bounces * 2].into_iter().filter(|n| *n > 0) {
            self.add(Knob::Bounces, format!("--bounces {n}"), |s| s.bounces = n);
        }
        for cutoff in [10.0, 0.1].map(|f| times(f, self.base.cutoff)) {
            self.add(Knob::CutOff, format!("--cutoff {cutoff}"), |s| s.cutoff = cutoff);
        }
    }

    fn intersection(&mut self) {
        for (name, recheck) in
            [("off", Recheck::Off), ("risky", Recheck::Risky), ("always", Recheck::Always)]
        {
            self.add(Knob::Recheck, format!("--recheck {name}"), |s| s.rules.recheck = recheck);
        }
        let word = |on: bool| if on { "off" } else { "on" };
        let rules = self.base.rules;
        self.add(Knob::Retry, format!("--retry {}", word(rules.retry)), |s| s.rules.retry ^= true);
        let options = format!("--robust {}", word(rules.robust));
        self.add(Knob::Robust, options, |s| s.rules.robust ^= true);
        let options = format!("--spawn-offset {}", word(rules.spawn_offset));
        self.add(Knob::SpawnOffset, options, |s| s.rules.spawn_offset ^= true);
        let options = format!("--recentre {}", word(rules.recentre));
        self.add(Knob::Recentre, options, |s| s.rules.recentre ^= true);
        let options = "--recheck off --retry off --robust off --spawn-offset off".to_string();
        self.add(Knob::AllRules, options, |s| {
            let recentre = s.rules.recentre;
            let recheck = Recheck::Off;
            s.rules =
                HitRules { robust: false, retry: false, recheck, spawn_offset: false, recentre };
        });
    }

    fn tree(&mut self) {
        let qualities = [
            ("low", BuildQuality::Low),
            ("medium", BuildQuality::Medium),
            ("high", BuildQuality::High),
        ];
        for (name, quality) in qualities {
            let options = format!("--build-quality {name}");
            self.add(Knob::BuildQuality, options, |s| s.build_quality = quality);
        }
        let options = format!("--compact {}", if self.base.compact { "off" } else { "on" });
        self.add(Knob::Compact, options, |s| s.compact ^= true);
    }

    fn combinations(&mut self, plan: &EffectPlan) {
        let with_base = |n: u32| {
            let [less, more] = around(n);
            [less, n, more]
        };
        let base = self.base;
        let (shadow, sky) = (with_base(base.shadow_samples), with_base(base.sky_samples));
        let lit = usize::from(plan.area_lights || plan.sky_light);
        let [less, spp, more] = with_base(base.spp);
        let range = (spp, (more > spp).then_some(more));
        for (spp, most_spp) in [(less, None), (spp, None), (more, None), range] {
            // Without soft light there is but one number of shadow samples: none.
            for k in if lit == 1 { 0..3 } else { 1..2 } {
                let camera = Settings { spp, most_spp, ..base.clone() };
                let (settings, options) = with_lights(camera, plan, [shadow[k], sky[k]]);
                // So would policies where there is nothing to take over.
                if !self.reuses(&settings) {
                    self.add(Knob::Combination, options, |s| *s = settings);
                    continue;
                }
                for (name, policy) in [("off", Policy::Off), ("surface", Policy::Surface)] {
                    let options = format!("{options} --policy {name}");
                    self.add(Knob::Combination, options, |s| {
                        *s = settings.clone();
                        s.reuse.policy = policy;
                    });
                }
            }
        }
        // Samples of both kinds only where they differ.
        let n = base.shadow_samples;
        if let (Some(most), true, Some(pilots)) = (range.1, plan.area_lights, pilots(n)) {
            let options = format!("--spp {spp}..{most} --shadow-samples {pilots}..{n}");
            self.add(Knob::Combination, options, |s| {
                (s.spp, s.most_spp, s.least_shadow_samples) = (spp, Some(most), Some(pilots));
            });
        }
    }

    /// The default's own frames, and traced ones with one sample of each light.
    fn denoised(&mut self, plan: &EffectPlan) {
        self.add(Knob::Denoiser, String::new(), |_| ());
        let [less, more] = around(self.base.spp);
        for spp in [less, self.base.spp, more] {
            let camera = Settings { spp, most_spp: None, ..self.base.clone() };
            let (mut settings, mut options) = with_lights(camera, plan, [1, 1]);
            if self.reuses(&settings) {
                options += " --policy off";
                settings.reuse.policy = Policy::Off;
            }
            self.add(Knob::Denoiser, options, |s| *s = settings);
        }
    }
}

/// `settings` with these numbers of shadow and sky samples, as far as there is light for them, and the options of its
/// samples: those of what is not there would only make twins.
fn with_lights(
    mut settings: Settings,
    plan: &EffectPlan,
    [shadow, sky]: [u32; 2],
) -> (Settings, String) {
    let mut options = format!("--spp {}", settings.camera_samples());
    if plan.area_lights {
        options += &format!(" --shadow-samples {shadow}");
        (settings.shadow_samples, settings.least_shadow_samples) = (shadow, None);
    }
    if plan.sky_light {
        options += &format!(" --sky-samples {sky}");
        (settings.sky_samples, settings.least_sky_samples) = (sky, None);
    }
    (settings, options)
}

/// `x` times `factor` in decimal digits: ten times 0.001 is 0.01, not 0.010000001.
fn times(factor: f64, x: f32) -> f32 {
    (factor * x.to_string().parse::<f64>().unwrap_or(f64::from(x))) as f32
}

/// How many of `n` samples may be pilots; `None` where they would hardly be fewer.
fn pilots(n: u32) -> Option<u32> {
    (n >= 4).then_some((n / 8).max(1))
}

/// A quarter of `n` samples, at least one, and four times `n`.
fn around(n: u32) -> [u32; 2] {
    [(n / 4).max(1), n.saturating_mul(4).clamp(1, MAX_SAMPLES)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_candidate_twice_and_none_for_effects_that_are_not_there() {
        let base = Settings::default();
        let yes = |_: &Settings| true;
        let all = candidates(&base, &EffectPlan::EVERYTHING, 100, &yes, &Group::ALL);
        assert_eq!((all[0].knob, &all[0].settings), (Knob::Default, &base));
        for (i, a) in all.iter().enumerate() {
            let is_new = |b: &Candidate| {
                (&a.settings, a.knob.is_denoised()) != (&b.settings, b.knob.is_denoised())
            };
            assert!(all[..i].iter().all(is_new), "{}", a.name());
        }
        let one = Settings { shadow_samples: 1, ..Settings::default() };
        let no_sky = EffectPlan { sky_light: false, ..EffectPlan::EVERYTHING };
        let list = candidates(&one, &no_sky, 100, &yes, &Group::ALL);
        for (i, a) in list.iter().enumerate() {
            assert!(list[..i].iter().all(|b| a.name() != b.name()), "{}", a.name());
        }
        let nothing = EffectPlan {
            mirror: false,
            glass: false,
            area_lights: false,
            sky_light: false,
            ..EffectPlan::EVERYTHING
        };
        let few = candidates(&base, &nothing, 10, &yes, &Group::ALL);
        let has = |knob| few.iter().any(|c| c.knob == knob);
        assert!(!has(Knob::Bounces) && !has(Knob::ShadowSamples) && !has(Knob::SkySamples));
        assert!(has(Knob::CameraSamples) && has(Knob::Policy) && has(Knob::Retry));
        // The tree of today's default is no candidate beside it.
        let trees: Vec<&str> = few
            .iter()
            .filter(|c| c.knob.group() == Some(Group::Tree))
            .map(|c| &*c.options)
            .collect();
        assert_eq!(trees, ["--build-quality low", "--build-quality high", "--compact on"]);
        let all_rules = few.iter().find(|c| c.knob == Knob::AllRules).expect("there");
        assert!(!all_rules.settings.rules.robust && all_rules.settings.rules.recentre);
        assert!(few.len() < all.len());
        let segments = |list: &[Candidate]| list.iter().filter(|c| c.knob == Knob::Segment).count();
        assert_eq!((segments(&all), segments(&few)), (2, 0));
        assert_eq!(candidates(&base, &nothing, 10, &yes, &[]).len(), 1);
        assert_eq!((times(10.0, 0.001), times(0.1, 0.001)), (0.01, 0.0001));
    }

    #[test]
    fn ranges_of_camera_samples_stand_beside_single_numbers() {
        let list = |base: &Settings| -> Vec<String> {
            let yes = |_: &Settings| true;
            let all = candidates(base, &EffectPlan::EVERYTHING, 9, &yes, &[Group::Samples]);
            let own = all.into_iter().filter(|c| c.knob == Knob::CameraSamples);
            own.map(|c| c.options).collect()
        };
        let four = Settings { spp: 4, ..Settings::default() };
        let expected =
            ["--spp 1", "--spp 8", "--spp 16", "--spp 2..8", "--spp 4..16", "--spp 4..32"];
        assert_eq!(list(&four), expected);
        let range = Settings { most_spp: Some(16), ..four };
        let expected = ["--spp 1", "--spp 4", "--spp 8", "--spp 16", "--spp 2..8", "--spp 4..32"];
        assert_eq!(list(&range), expected);
        let most = Settings { spp: MAX_SAMPLES, ..Settings::default() };
        assert!(
            list(&most)
                .iter()
                .all(|options| !options.ends_with(&format!("{MAX_SAMPLES}..{MAX_SAMPLES}")))
        );
    }

    #[test]
    fn denoised_are_the_default_and_traced_frames_of_few_samples() {
        let list = |base: &Settings, looks_up: bool| -> Vec<String> {
            let looks_up = |_: &Settings| looks_up;
            let everything = &EffectPlan::EVERYTHING;
            let all = candidates(base, everything, 9, &looks_up, &[Group::Denoiser]);
            assert!(all[1..].iter().all(|c| c.knob == Knob::Denoiser));
            all.iter().map(Candidate::name).collect()
        };
        let base = Settings { spp: 4, ..Settings::default() };
        let one = |spp| format!("--spp {spp} --shadow-samples 1 --sky-samples 1");
        let expected = [1, 4, 16].map(|spp| one(spp) + " --policy off, denoised");
        let list_of_base = list(&base, true);
        assert_eq!(list_of_base[..2], ["default", "default, denoised"]);
        assert_eq!(list_of_base[2..], expected);
        let few = Settings { shadow_samples: 1, sky_samples: 1, ..base };
        let expected = [1, 16].map(|spp| one(spp) + ", denoised");
        assert_eq!(list(&few, false)[2..], expected, "four are the default's own");
    }

    #[test]
    fn pilots_stand_beside_all_samples_of_light() {
        let list = |n: u32| -> Vec<String> {
            let base = Settings { shadow_samples: n, sky_samples: n, ..Settings::default() };
            let yes = |_: &Settings| true;
            let all = candidates(&base, &EffectPlan::EVERYTHING, 9, &yes, &[Group::Samples]);
            all.into_iter()
                .map(|c| c.options)
                .filter(|o| o.contains("..") && !o.contains("spp"))
                .collect()
        };
        assert_eq!(list(16), ["--shadow-samples 2..16", "--sky-samples 2..16"]);
        assert_eq!(list(4), ["--shadow-samples 1..4", "--sky-samples 1..4"]);
        assert_eq!(list(1), [""; 0]);
    }

    #[test]
    fn nothing_of_reuse_where_there_is_nothing_to_take_over() {
        let base = Settings::default();
        let everything = &EffectPlan::EVERYTHING;
        let of_reuse = |list: &[Candidate]| {
            let tells = |c: &&Candidate| {
                c.knob.group() == Some(Group::Reuse) || c.options.contains("--policy")
            };
            list.iter().filter(tells).count()
        };
        let yes = |_: &Settings| true;
        assert!(of_reuse(&candidates(&base, everything, 2, &yes, &Group::ALL)) > 10);
        let one_frame = candidates(&base, everything, 1, &yes, &Group::ALL);
        assert_eq!(of_reuse(&one_frame), 0);
        let dark = candidates(&base, everything, 100, &|_| false, &Group::ALL);
        assert_eq!(of_reuse(&dark), 0);
        assert!(dark.iter().any(|c| c.knob == Knob::Combination), "samples are still combined");
        // What is not worth a lookup by default may be with more samples.
        let many = |s: &Settings| s.shadow_samples > base.shadow_samples;
        assert!(of_reuse(&candidates(&base, everything, 9, &many, &Group::ALL)) > 0);
    }
}
