//! What a maker must be able to do so that several ranks share out its frames.

use super::FrameMaker;
use crate::error::Result;
use crate::shade::Rendered;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

/// A maker whose frames several processes make together.
///
/// What is handed from one to another are bytes that only makers of the same job understand. A
/// maker that lacks what another should have sent makes it itself, so the frames never differ.
pub trait RankMaker: FrameMaker + Sync {
    /// The frame that `frame` is: itself unless another is the same picture.
    fn original(&self, frame: u32) -> u32 {
        frame
    }

    /// The originals that an original is made of.
    fn needs(&self, _original: u32) -> Vec<u32> {
        Vec::new()
    }

    /// `originals` (ascending) in the order in which they are best made, cut into lists each of which
    /// one rank makes, and that need little from one another.
    fn rank_batches(&self, originals: &[u32]) -> Vec<Vec<u32>> {
        self.batches(originals)
    }

    /// Whether what an original leaves behind was put on disk by an earlier job, so that it is rather
    /// read than made.
    fn is_on_disk(&self, _original: u32) -> bool {
        false
    }

    /// Whether what a frame leaves behind goes to all ranks, needed or not.
    fn sends_to_all(&self) -> bool {
        false
    }

    /// Into how many strips a frame can be cut at most.
    fn most_strips(&self) -> u32 {
        1
    }

    /// What `original` leaves behind is kept, once it is made, until it is let go.
    fn hold(&self, _original: u32) {}

    /// No frame to come needs what `original` left.
    fn release(&self, _original: u32) {}

    /// Makes what `original` leaves behind, and no frame; `false` when the job was asked to stop.
    ///
    /// # Errors
    /// Whatever making a frame can meet.
    fn make_reference(&self, _original: u32) -> Result<bool> {
        Ok(true)
    }

    /// What `original`, which is held and was just made, left behind; once.
    fn export(&self, _original: u32) -> Option<Exported> {
        None
    }

    /// Takes in and holds what `original` left on another rank.
    fn import(&self, _original: u32, _bytes: &[u8]) {}

    /// Renders one strip of an original; `None` when the job was asked to stop.
    ///
    /// # Errors
    /// Whatever making a frame can meet.
    fn render_strip(&self, _original: u32, _strip: Strip) -> Result<Option<Vec<u8>>> {
        Ok(None)
    }

    /// Takes the strips of an original, all of them in order, in place of rendering it.
    ///
    /// # Errors
    /// The strips are no such strips.
    fn join_strips(&self, _original: u32, _strips: &[Arc<[u8]>]) -> Result<()> {
        Ok(())
    }
}

/// What an original left behind.
#[derive(Debug, Clone, Default)]
pub struct Exported {
    /// For [`RankMaker::import`].
    pub bytes: Arc<[u8]>,
    /// How many points or pixels they tell of.
    pub discoveries: u64,
}

/// One of several strips of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Strip {
    /// Which, from the top, from 0.
    pub number: u32,
    /// How many there are.
    pub of: u32,
    /// Whether other frames are made of this one.
    pub is_source: bool,
}

/// Frames put together from strips, until they are asked for.
#[derive(Default)]
pub struct JoinedStrips(Mutex<BTreeMap<u32, Rendered>>);

impl JoinedStrips {
    pub(super) fn put(&self, frame: u32, rendered: Rendered) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).insert(frame, rendered);
    }

    pub(super) fn take(&self, frame: u32) -> Option<Rendered> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).remove(&frame)
    }
}
