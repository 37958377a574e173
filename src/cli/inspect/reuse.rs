//! The part of `inspect` about reuse between frames.

use super::bytes;
use crate::error::{Result, counted};
use crate::inference::Channels;
use crate::reuse::{self, Reference, colour};
use crate::scene::{Policy, Rect, Scene, Settings, Shot};
use crate::sequence::Schedule;
use crate::shade::{FrameJob, Renderer, Reuse};
use serde::Serialize;
use std::sync::atomic::AtomicBool;

/// Memory that a reference between key frames takes at most, as a share of a key frame's: 0.07 to 0.22 in
/// the repository's scenes, more where a quarter of a tiny frame's pixels are probed.
const BETWEEN: f64 = 0.3;
/// Memory of a key frame's reference encoded for disk, likewise: 0.17 to 0.44.
const WAITING: f64 = 0.5;
/// Most names of always traced meshes and spheres that are printed.
const NAMED: usize = 8;
/// Longer edge of the small picture from which the memory of a key frame's reference is estimated, pixels.
const SMALL: u32 = 96;

/// How the frames of the shot are made.
#[derive(Serialize)]
pub struct ReusePlan {
    policy: Policy,
    /// Frames from one key frame to the next; 0 where nothing is looked up.
    segment: u32,
    /// Frames that are traced whole.
    key_frames: u32,
    /// Frames that are copies of another frame with the same camera.
    copies: u32,
    lights: Vec<LightPlan>,
    always_traced: AlwaysTraced,
    references: References,
}

#[derive(Serialize)]
struct LightPlan {
    light: String,
    looked_up: bool,
    why: String,
}

/// Meshes, spheres and boxes that the scene file says to trace in every frame.
#[derive(Serialize)]
struct AlwaysTraced {
    meshes: Vec<String>,
    spheres: Vec<String>,
    boxes: usize,
}

/// Most references held at a time (policy colour: most frames with known pixels), and their memory.
#[derive(Serialize)]
struct References {
    key_frames: usize,
    others: usize,
    bytes: u64,
}

/// Estimated bytes of a key frame's reference: the largest of three small pictures, at the start, the middle and
/// the end of the shot, scaled to the number of pixels.
fn key_bytes(renderer: &Renderer, shot: &Shot, channels: &Channels) -> Result<u64> {
    let Settings { width, height, .. } = *renderer.settings;
    let shrink = (width.max(height) / SMALL).max(1);
    let (w, h) = ((width / shrink).max(1), (height / shrink).max(1));
    let settings = Settings {
        width: w,
        height: h,
        shadow_samples: renderer.settings.shadow_samples.min(1),
        sky_samples: renderer.settings.sky_samples.min(1),
        ..renderer.settings.clone()
    };
    let small = Renderer::new(renderer.scene, &settings, renderer.intersector);
    let mut most = 0;
    for frame in [1, shot.frames.div_ceil(2), shot.frames] {
        let camera = shot.camera(frame, w, h)?;
        let job = FrameJob {
            reuse: Some(Reuse { channels, inference: None, is_source: true }),
            beyond_crop: true,
            ..FrameJob::whole(&camera, frame)
        };
        let traced = small.render_job(&job, &AtomicBool::new(false), &());
        let sources = traced.map(|done| done.sources).unwrap_or_default();
        let camera = camera.to_scene(&renderer.scene.recentring);
        most = most.max(Reference::new(frame, &camera, &sources, channels.len()).memory());
    }
    let larger = f64::from(width) * f64::from(height) / (f64::from(w) * f64::from(h));
    Ok((most as f64 * larger) as u64)
}

/// Most bytes of a frame's known pixels under policy colour.
fn pixel_bytes(settings: &Settings) -> u64 {
    let Rect { x0, y0, x1, y1 } = settings.region();
    u64::from(x1 - x0) * u64::from(y1 - y0) * size_of::<colour::Entry>() as u64
}

impl AlwaysTraced {
    fn of(scene: &Scene) -> Self {
        let meshes = scene.meshes.iter().filter(|m| m.surface.always_traced);
        let spheres = scene.spheres.iter().filter(|s| s.surface.always_traced);
        Self {
            meshes: meshes.map(|m| m.name.clone()).collect(),
            spheres: spheres.map(|s| s.name.clone()).collect(),
            boxes: scene.traced_regions.len(),
        }
    }

    /// The line about them; `None` if there are none, or if everything is traced anyway.
    fn to_text(&self, policy: Policy) -> Option<String> {
        let ignored = match policy {
            Policy::Surface => "",
            Policy::Colour => ", which policy colour ignores",
            Policy::Off => return None,
        };
        let meshes = self.meshes.iter().map(|name| format!("mesh {name}"));
        let mut all: Vec<String> =
            meshes.chain(self.spheres.iter().map(|name| format!("sphere {name}"))).collect();
        if all.len() > NAMED {
            let more = all.split_off(NAMED).len();
            all.push(format!("{more} more"));
        }
        all.extend(match self.boxes {
            0 => None,
            1 => Some("1 box".to_string()),
            n => Some(format!("{n} boxes")),
        });
        (!all.is_empty()).then(|| format!("  always traced: {}{ignored}", all.join(", ")))
    }
}

impl ReusePlan {
    /// The plan of rendering the whole shot in one process.
    pub fn of(renderer: &Renderer, shot: &Shot) -> Result<Self> {
        let Renderer { scene, settings, .. } = renderer;
        let channels = reuse::channels(scene, settings);
        let policy = settings.reuse.policy;
        let reasons = match policy {
            Policy::Surface => reuse::lookup_reasons(scene, settings),
            Policy::Colour | Policy::Off => Vec::new(),
        };
        let looks_up = policy == Policy::Surface && !channels.is_empty();
        let schedule = Schedule::of_shot(shot, settings, looks_up)?;
        let frames: Vec<u32> = (1..=shot.frames).collect();
        let (keys, others) = match policy {
            Policy::Surface if !looks_up => (0, 0),
            Policy::Off => (0, 0),
            Policy::Surface => schedule.most_held(&frames),
            Policy::Colour => {
                let (keys, others) = schedule.most_held(&frames);
                // What the frame that is being made finds is noted before it is known who needs it.
                (keys, others + 1)
            }
        };
        let bytes = match policy {
            Policy::Colour => (keys + others) as u64 * pixel_bytes(settings),
            _ if keys == 0 => 0,
            _ => {
                let shares = keys as f64 * (1.0 + WAITING) + others as f64 * BETWEEN;
                (shares * key_bytes(renderer, shot, &channels)? as f64) as u64
            }
        };
        Ok(Self {
            policy,
            segment: if looks_up { settings.reuse.segment } else { 0 },
            key_frames: schedule.key_frames(),
            copies: schedule.copies(),
            lights: reasons
                .into_iter()
                .map(|r| LightPlan { light: r.light, looked_up: r.looked_up, why: r.why })
                .collect(),
            always_traced: AlwaysTraced::of(scene),
            references: References { key_frames: keys, others, bytes },
        })
    }

    /// Lines for people.
    pub fn to_text(&self) -> Vec<String> {
        let mut lines = vec![format!("reuse      {}", self.headline())];
        for light in &self.lights {
            let how = if light.looked_up { "looked up" } else { "traced" };
            lines.push(format!("  {:<20} {how:<10} {}", light.light, light.why));
        }
        lines.extend(self.always_traced.to_text(self.policy));
        let References { key_frames, others, bytes: size } = self.references;
        if size > 0 {
            let what = if self.policy == Policy::Colour { "pixels" } else { "references" };
            lines.push(format!(
                "  {what} held at a time: {} and {others} between, at most about {}",
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
            Policy::Colour => format!(
                "policy colour: colours of pixels; {}",
                counted(self.key_frames as usize, "key frame")
            ),
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
