//! What is worth a lookup: decided from a fixed table of costs, never from measured times, so that
//! every machine decides alike.

use crate::effects::EffectPlan;
use crate::inference::{Channel, Channels};
use crate::scene::{Scene, Settings};

/// A shadow ray with its sample; the unit is a camera ray with the look at its surface.
const SHADOW_RAY: f64 = 1.2;
/// Looking one surface point up.
const LOOKUP: f64 = 1.5;

/// Whether a lookup is cheaper than `rays` shadow rays.
fn is_worth(rays: u32) -> bool {
    f64::from(rays) * SHADOW_RAY > LOOKUP
}

/// Shadow rays of one surface point in a channel.
pub fn rays_of(channel: Channel, settings: &Settings) -> u32 {
    match channel {
        Channel::Area(_) => settings.shadow_samples,
        Channel::Sky => settings.sky_samples,
    }
}

/// The lights whose ratios are worth keeping.
pub fn channels(scene: &Scene, plan: &EffectPlan, settings: &Settings) -> Channels {
    Channels::of(scene, |channel| {
        let runs = match channel {
            Channel::Area(_) => plan.area_lights,
            Channel::Sky => plan.sky_light,
        };
        // The camera samples of a pixel share one lookup.
        runs && is_worth(rays_of(channel, settings).saturating_mul(settings.spp))
    })
}

/// What is looked up and what traced, and why: lines for `inspect`.
pub fn lookup_reasons(scene: &Scene, plan: &EffectPlan, settings: &Settings) -> Vec<String> {
    let channels = channels(scene, plan, settings);
    channels.iter().map(|c| format!("{c:?}: {} rays", rays_of(c, settings))).collect()
}
