//! What `inspect` tells of reuse between frames.

use super::bytes;
use crate::effects::EffectPlan;
use crate::error::{Result, counted};
use crate::reuse::{self, Reference};
use crate::scene::{Policy, Scene, Settings, Shot};
use crate::sequence::{Pyramid, Schedule};
use serde::Serialize;

/// In an in-between frame about one pixel in so many is traced.
const TRACED_BETWEEN: u64 = 20;

/// How the frames of the shot come about.
#[derive(Serialize)]
pub struct Plan {
    policy: Policy,
    /// Frames from one key frame to the next; 0 where nothing is looked up.
    segment: u32,
    /// Frames that are traced whole.
    key_frames: u32,
    /// Frames that show what another frame of the same camera shows.
    copies: u32,
    lights: Vec<LightPlan>,
    references: References,
}

#[derive(Serialize)]
struct LightPlan {
    light: String,
    looked_up: bool,
    why: String,
}

/// References held at a time, at most, and about how much memory they take.
#[derive(Serialize)]
struct References {
    key_frames: usize,
    others: usize,
    bytes: u64,
}

impl Plan {
    /// That of rendering the whole shot in one process.
    pub fn of(scene: &Scene, settings: &Settings, shot: &Shot) -> Result<Self> {
        let effects = EffectPlan::of(scene, settings);
        let channels = reuse::channels(scene, &effects, settings).len();
        let policy = settings.reuse.policy;
        let reasons = match policy {
            Policy::Surface => reuse::lookup_reasons(scene, &effects, settings),
            Policy::Colour | Policy::Off => Vec::new(),
        };
        let looks_up = policy == Policy::Surface && channels > 0;
        let segment = if looks_up { settings.reuse.segment } else { 1 };
        let schedule = Schedule::new(Pyramid { segment, frames: shot.frames }, shot)?;
        let frames: Vec<u32> = (1..=shot.frames).collect();
        let (keys, others) = if looks_up { schedule.most_held(&frames) } else { (0, 0) };
        let pixels = u64::from(settings.width) * u64::from(settings.height);
        let size = |traced| Reference::expected_memory(pixels, traced, channels);
        Ok(Self {
            policy,
            segment: if looks_up { segment } else { 0 },
            key_frames: if policy == Policy::Off { shot.frames } else { schedule.key_frames() },
            copies: if policy == Policy::Surface { schedule.copies() } else { 0 },
            lights: reasons
                .into_iter()
                .map(|r| LightPlan { light: r.light, looked_up: r.looked_up, why: r.why })
                .collect(),
            references: References {
                key_frames: keys,
                others,
                bytes: keys as u64 * size(pixels) + others as u64 * size(pixels / TRACED_BETWEEN),
            },
        })
    }

    /// Lines for people.
    pub fn to_text(&self) -> Vec<String> {
        let mut lines = vec![format!("reuse      {}", self.headline())];
        for light in &self.lights {
            let how = if light.looked_up { "looked up" } else { "traced" };
            lines.push(format!("  {:<20} {how:<10} {}", light.light, light.why));
        }
        if self.segment > 0 {
            let References { key_frames, others, bytes: size } = self.references;
            lines.push(format!(
                "  references held at a time: {} and {others} between, about {}",
                counted(key_frames, "key frame"),
                bytes(size)
            ));
        }
        lines
    }

    fn headline(&self) -> String {
        let copies = match self.copies {
            0 => String::new(),
            copies => format!("; {} from the camera of another", counted(copies as usize, "frame")),
        };
        match self.policy {
            Policy::Off => "policy off: every frame is traced".into(),
            Policy::Colour => "policy colour: colours of pixels".into(),
            Policy::Surface if self.segment == 0 => {
                format!("policy surface, but no light is worth a lookup: all is traced{copies}")
            }
            Policy::Surface => format!(
                "policy surface: {}, one every {}{copies}",
                counted(self.key_frames as usize, "key frame"),
                counted(self.segment as usize, "frame"),
            ),
        }
    }
}
