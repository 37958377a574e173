//! Settings as command-line options.

use crate::effects::EffectPlan;
use crate::scene::{Policy, ReuseSettings, Settings};
use std::fmt::Display;

/// The options that decide a picture's error and time, with their values in `settings`. Options without effect in the
/// scene, by its `plan`, are left out.
pub fn options(settings: &Settings, plan: &EffectPlan) -> String {
    let reuse = &settings.reuse;
    let is_usual = reuse.tolerance == ReuseSettings::default().tolerance;
    let policy = match reuse.policy {
        Policy::Off => " --policy off".into(),
        Policy::Colour => " --policy colour".into(),
        Policy::Surface if is_usual => " --policy surface".into(),
        Policy::Surface => format!(" --policy surface --tolerance {}", reuse.tolerance),
    };
    samples(
        settings.camera_samples(),
        settings.shadow_sample_range(),
        settings.sky_sample_range(),
        plan,
    ) + &match plan.mirror || plan.glass {
        true => format!(" --bounces {}", settings.bounces),
        false => String::new(),
    } + &policy
}

/// Only the options of samples.
pub fn samples(
    spp: impl Display,
    shadow: impl Display,
    sky: impl Display,
    plan: &EffectPlan,
) -> String {
    let mut options = format!("--spp {spp}");
    if plan.area_lights {
        options += &format!(" --shadow-samples {shadow}");
    }
    if plan.sky_light {
        options += &format!(" --sky-samples {sky}");
    }
    options
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_options_with_an_effect_are_spelled_out() {
        let mut settings = Settings::default();
        let all = options(&settings, &EffectPlan::EVERYTHING);
        let every = "--spp 4 --shadow-samples 16 --sky-samples 16 --bounces 4 --policy surface";
        assert_eq!(all, every);
        settings.reuse.tolerance = 0.5;
        let bare = EffectPlan {
            mirror: false,
            glass: false,
            area_lights: false,
            sky_light: false,
            ..EffectPlan::EVERYTHING
        };
        assert_eq!(options(&settings, &bare), "--spp 4 --policy surface --tolerance 0.5");
    }
}
