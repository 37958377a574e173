//! The maker of policy `colour`, the source paper's algorithm: frames from the colours that other
//! frames have at the same pixels ([`reuse::colour`](crate::reuse::colour)).
//!
//! The samples are the first and the last frame of the shot, traced, and the pictures that somebody
//! uploads, which are taken as they are. The frames between are made in the order of the pyramid
//! over the whole shot: the middle one from both ends, then the quarters, and so on. The paper's
//! ranks make their frames side by side and send each other what they discover, so that there a
//! frame depends on who was faster. Here it depends on its own ancestors and on nothing else, and a
//! frame that is asked for alone has these made first.
//!
//! Over several ranks every frame's discoveries go to all of them, as in the paper.
//!
//! Not done: first hits of inferred pixels are not known: their records say that nothing is hit.
//! What a scene names as always traced may be inferred: an inferred pixel does not know what it
//! shows.

mod exchange;
mod pixels;
mod saved;
mod upload;

pub use upload::check_upload;

use super::checkpoint::Checkpoints;
use super::pyramid::Pyramid;
use super::saved::{Keeps, Saved};
use super::{FrameMaker, Made, SaveCost, previous_camera};
use crate::error::{Error, Result};
use crate::film::{Film, Image};
use crate::math::Vec2;
use crate::reuse::colour::{AgreementRule, InferredColour, KnownColours};
use crate::scene::{Camera, Shot};
use crate::shade::{FrameJob, Progress, Rendered, Renderer};
use pixels::{discoveries, fill};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, PoisonError};
use upload::known_of_upload;

/// Infers frames from colours.
pub struct ColourMaker<'a> {
    /// What traces.
    pub renderer: Renderer<'a>,
    /// Where the camera is when.
    pub shot: &'a Shot,
    /// The threads that render.
    pub pool: &'a rayon::ThreadPool,
    /// Whether films get their first-hit records.
    pub with_gbuffer: bool,
    /// Set when the job shall stop.
    pub stop: &'a AtomicBool,
    /// Hears of finished tiles.
    pub progress: &'a dyn Progress,
    /// When cached colours agree.
    pub rule: AgreementRule,
    /// Where discoveries are kept for a job that goes on after this one; `None` for nowhere.
    pub checkpoints: Option<&'a Checkpoints<'a>>,
    pyramid: Pyramid,
    uploads: Vec<KnownColours>,
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    /// Frames that are still to come.
    to_come: BTreeSet<u32>,
    /// Frames whose discoveries other ranks' frames, or later ones, need.
    held: BTreeSet<u32>,
    /// What the frames so far discovered, as far as it is still needed.
    known: BTreeMap<u32, Arc<KnownColours>>,
    /// The most that all of it took at a time, bytes.
    most_memory: u64,
    saved: Saved<Arc<KnownColours>>,
}

impl<'a> ColourMaker<'a> {
    /// A maker of frames of `shot`, which takes `uploads` for the frames that they name.
    ///
    /// # Errors
    /// [`check_upload`]'s, and a frame that has two `uploads`.
    #[allow(clippy::too_many_arguments, reason = "each is a field")]
    pub fn new(
        renderer: Renderer<'a>,
        shot: &'a Shot,
        pool: &'a rayon::ThreadPool,
        stop: &'a AtomicBool,
        progress: &'a dyn Progress,
        rule: AgreementRule,
        uploads: &[(u32, Image)],
    ) -> Result<Self> {
        let mut seen = BTreeSet::new();
        let mut known = Vec::new();
        for (frame, image) in uploads {
            check_upload(*frame, image, shot, renderer.settings)?;
            if !seen.insert(*frame) {
                return Err(Error::Usage(format!("frame {frame} has two uploaded pictures")));
            }
            known.push(known_of_upload(*frame, image, renderer.settings));
        }
        Ok(Self {
            renderer,
            shot,
            pool,
            with_gbuffer: false,
            stop,
            progress,
            rule,
            checkpoints: None,
            pyramid: Pyramid::whole(shot.frames),
            uploads: known,
            state: Mutex::default(),
        })
    }

    /// Makes `frame` from what its ancestors know, which are made first where they are not at hand;
    /// gives its discoveries too.
    fn frame(&self, frame: u32) -> Result<Option<(Made, KnownColours)>> {
        let mut ancestors = Vec::new();
        for other in self.pyramid.ancestors(frame) {
            match self.known(other)? {
                Some(known) => ancestors.push(known),
                None => return Ok(None),
            }
        }
        let known: Vec<&KnownColours> =
            ancestors.iter().map(|k| &**k).chain(&self.uploads).collect();
        let settings = self.renderer.settings;
        let camera = self.shot.camera(frame, settings.width, settings.height)?;
        let pixels = settings.width as usize * settings.height as usize;
        let inferred = self.rule.infer(&known, frame, pixels);
        let Some(mut traced) = self.trace(frame, &camera, &inferred) else { return Ok(None) };
        let discoveries = discoveries(frame, &traced.film, &inferred, &camera, settings);
        let reuse = fill(&mut traced.film, frame, &inferred, settings);
        if self.with_gbuffer {
            self.note_motion(frame, &camera, &mut traced.film, &inferred)?;
        } else {
            traced.film.gbuffer = None;
        }
        Ok(Some((
            Made { film: traced.film, rays: traced.rays, reuse, audit: None, reference: None },
            discoveries,
        )))
    }

    /// Fills in how the traced pixels moved; of the others no first hit is known.
    fn note_motion(
        &self,
        frame: u32,
        camera: &Camera,
        film: &mut Film,
        inferred: &[Option<InferredColour>],
    ) -> Result<()> {
        let previous = previous_camera(self.shot, frame, self.renderer.settings)?;
        self.pool.install(|| self.renderer.note_motion(camera, previous.as_ref(), film));
        let motion = film.gbuffer.iter_mut().flat_map(|g| &mut g.motion);
        motion.zip(inferred).filter(|(_, i)| i.is_some()).for_each(|(m, _)| *m = Vec2::ZERO);
        Ok(())
    }

    /// Traces what could not be inferred.
    fn trace(
        &self,
        frame: u32,
        camera: &Camera,
        inferred: &[Option<InferredColour>],
    ) -> Option<Rendered> {
        let mask: Vec<bool> = inferred.iter().map(Option::is_none).collect();
        let job = FrameJob {
            camera,
            stream: frame,
            // Distances come from it.
            with_gbuffer: true,
            reuse: None,
            mask: Some(&mask),
            beyond_crop: false,
        };
        self.pool.install(|| self.renderer.render_job(&job, self.stop, self.progress))
    }

    /// What `frame` discovered; makes it where nobody did.
    fn known(&self, frame: u32) -> Result<Option<Arc<KnownColours>>> {
        if let Some(found) = self.with_state(|s| s.known.get(&frame).cloned()) {
            return Ok(Some(found));
        }
        if let Some(found) = self.left_on_disk(frame) {
            return Ok(Some(found));
        }
        let Some((_, known)) = self.frame(frame)? else { return Ok(None) };
        Ok(Some(self.made(known)))
    }

    /// What a frame discovered that was just made, which is worth keeping on disk too.
    fn made(&self, known: KnownColours) -> Arc<KnownColours> {
        let known = self.keep(known);
        self.with_state(|s| s.saved.add(known.frame, Arc::clone(&known)));
        known
    }

    fn keep(&self, known: KnownColours) -> Arc<KnownColours> {
        let known = Arc::new(known);
        self.with_state(|s| {
            s.known.insert(known.frame, Arc::clone(&known));
            s.most_memory = s.most_memory.max(memory(s.known.values().map(|k| &**k)));
        });
        known
    }

    /// Drops what no frame to come is inferred from.
    fn forget(&self, done: u32) {
        self.with_state(|s| {
            s.to_come.remove(&done);
            let ancestors = |frame: &u32| self.pyramid.ancestors(*frame);
            let needed: BTreeSet<u32> = s.to_come.iter().flat_map(ancestors).collect();
            let State { known, held, .. } = s;
            known.retain(|frame, _| needed.contains(frame) || held.contains(frame));
        });
    }

    fn with_state<T>(&self, act: impl FnOnce(&mut State) -> T) -> T {
        act(&mut self.state.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl FrameMaker for ColourMaker<'_> {
    fn make(&self, frame: u32) -> Result<Option<Made>> {
        let Some((made, known)) = self.frame(frame)? else { return Ok(None) };
        self.made(known);
        self.forget(frame);
        self.put_away(false);
        Ok(Some(made))
    }

    /// First and last frame, then each between after its ancestors.
    fn batches(&self, frames: &[u32]) -> Vec<Vec<u32>> {
        let mut ordered = self.pyramid.order(frames);
        ordered.sort_by_key(|frame| !self.pyramid.is_key(*frame));
        ordered.into_iter().map(|frame| vec![frame]).collect()
    }

    fn expect(&self, frames: &[u32]) {
        self.with_state(|s| s.to_come.extend(frames));
    }

    fn stopped(&self) {
        self.put_away(true);
    }

    fn notes(&self) -> Vec<String> {
        self.checkpoints.map(Checkpoints::notes).unwrap_or_default()
    }

    fn save_cost(&self) -> SaveCost {
        self.with_state(|s| s.saved.cost)
    }

    fn reference_memory(&self) -> u64 {
        memory(&self.uploads) + self.with_state(|s| s.most_memory)
    }
}

/// Bytes that entries take.
fn memory<'k>(known: impl IntoIterator<Item = &'k KnownColours>) -> u64 {
    known.into_iter().map(|k| size_of_val(&k.entries[..]) as u64).sum()
}
