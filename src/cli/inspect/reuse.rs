//! What `inspect` tells of reuse between frames.

use super::bytes;
use crate::error::{Result, counted};
use crate::inference::Channels;
use crate::reuse::{self, Reference};
use crate::scene::{Policy, Settings, Shot};
use crate::sequence::{Pyramid, Schedule};
use crate::shade::{FrameJob, Progress, Renderer, Reuse};
use crate::stats::RayCounts;
use serde::Serialize;
use std::sync::atomic::AtomicBool;

/// A reference between key frames takes about one part in so many of a key frame's memory.
const BETWEEN: u64 = 5;
/// Longer edge of the small picture that tells how much a key frame's reference takes, pixels.
const SMALL: u32 = 96;

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

/// Bytes that a key frame's reference takes: those of a small picture's at the start, the middle or
/// the end of the shot, whichever is largest, times its pixels.
fn key_bytes(renderer: &Renderer, shot: &Shot, channels: &Channels) -> Result<u64> {
    let Settings { width, height, .. } = *renderer.settings;
    let shrink = (width.max(height) / SMALL).max(1);
    let (w, h) = ((width / shrink).max(1), (height / shrink).max(1));
    let settings = Settings {
        width: w,
        height: h,
        shadow_samples: 1,
        sky_samples: 1,
        ..renderer.settings.clone()
    };
    let small = Renderer { settings: &settings, ..*renderer };
    let mut most = 0;
    for frame in [1, shot.frames.div_ceil(2), shot.frames] {
        let camera = shot.camera(frame, w, h)?;
        let job = FrameJob {
            camera: &camera,
            stream: frame,
            with_gbuffer: false,
            reuse: Some(Reuse { channels, inference: None }),
            mask: None,
            beyond_crop: true,
        };
        let traced = small.render_job(&job, &AtomicBool::new(false), &Unseen);
        let sources = traced.map(|done| done.sources).unwrap_or_default();
        let camera = camera.to_scene(&renderer.scene.recentring);
        most = most.max(Reference::new(frame, &camera, &sources, channels.len()).memory());
    }
    let larger = f64::from(width) * f64::from(height) / (f64::from(w) * f64::from(h));
    Ok((most as f64 * larger) as u64)
}

/// Nobody looks on.
struct Unseen;

impl Progress for Unseen {
    fn tile_done(&self, _: f64, _: &RayCounts) {}
}

impl Plan {
    /// That of rendering the whole shot in one process.
    pub fn of(renderer: &Renderer, shot: &Shot) -> Result<Self> {
        let Renderer { scene, settings, plan: effects, .. } = renderer;
        let channels = reuse::channels(scene, effects, settings);
        let policy = settings.reuse.policy;
        let reasons = match policy {
            Policy::Surface => reuse::lookup_reasons(scene, effects, settings),
            Policy::Colour | Policy::Off => Vec::new(),
        };
        let looks_up = policy == Policy::Surface && !channels.is_empty();
        let segment = if looks_up { settings.reuse.segment } else { 1 };
        let schedule = Schedule::new(Pyramid { segment, frames: shot.frames }, shot)?;
        let frames: Vec<u32> = (1..=shot.frames).collect();
        let (keys, others) = if looks_up { schedule.most_held(&frames) } else { (0, 0) };
        let key = if keys > 0 { key_bytes(renderer, shot, &channels)? } else { 0 };
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
                bytes: keys as u64 * key + others as u64 * key / BETWEEN,
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
