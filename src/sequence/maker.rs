//! The interfaces of makers of frames: which frames are made from which, making them, and handing
//! references and strips from rank to rank.

use super::strips::Strip;
use crate::error::Result;
use crate::film::Film;
use crate::stats::{AuditSums, RayCounts, ReuseCounts};
use std::sync::Arc;

/// Which frames are made from which; answers without rendering. Of frames with equal cameras only one
/// is made, their *representative*; the others are copies of it.
pub trait FrameGraph {
    /// The frame of which `frame` is a copy, or `frame` itself.
    fn representative(&self, frame: u32) -> u32 {
        frame
    }

    /// The representatives whose references a representative is inferred from.
    fn needs(&self, _representative: u32) -> Vec<u32> {
        Vec::new()
    }

    /// `frames` (ascending) in the best order for one process, cut into lists that share few references.
    fn batches(&self, frames: &[u32]) -> Vec<Vec<u32>> {
        frames.iter().map(|frame| vec![*frame]).collect()
    }

    /// `representatives` (ascending) in the best order for several ranks, cut into lists that one rank makes
    /// each.
    fn rank_batches(&self, representatives: &[u32]) -> Vec<Vec<u32>> {
        self.batches(representatives)
    }

    /// Whether an earlier job left the reference of a representative on disk, so that it is read, not made.
    fn is_on_disk(&self, _representative: u32) -> bool {
        false
    }

    /// Whether every reference is sent to all ranks, needed or not.
    fn sends_to_all(&self) -> bool {
        false
    }

    /// The most strips that a frame can be cut into.
    fn most_strips(&self) -> u32 {
        1
    }
}

/// Makes the films of frames.
pub trait FrameMaker: FrameGraph {
    /// Makes frame `frame` (from 1).
    ///
    /// # Errors
    /// [`Stopped`](crate::error::Error::Stopped) when the job was asked to stop; errors of cameras and
    /// references.
    fn make(&self, frame: u32) -> Result<Made>;

    /// Announces the frames that will be asked for, before the first of them.
    fn expect(&self, _frames: &[u32]) {}

    /// Announces that the job stops before all frames are made: saves what a later job needs to go on.
    fn stopped(&self) {}

    /// Notes for the user about the frames made so far; each is returned once.
    fn notes(&self) -> Vec<String> {
        Vec::new()
    }

    /// The cost of writing references to disk so far.
    fn save_cost(&self) -> SaveCost {
        SaveCost::default()
    }

    /// The most memory that references took at a time so far, bytes.
    fn reference_memory(&self) -> u64 {
        0
    }
}

/// A maker whose frames several ranks make together.
///
/// References and strips travel as bytes that only makers of the same job understand. A maker that
/// lacks a reference makes it itself, so the frames do not depend on what arrives.
pub trait RankMaker: FrameMaker + Sync {
    /// Keeps the reference of `representative`, once it is made, until [`release`](Self::release).
    fn hold(&self, _representative: u32) {}

    /// Drops a reference that was held or imported, once no frame of this rank needs it.
    fn release(&self, _representative: u32) {}

    /// Makes the reference of `representative`, and no frame.
    ///
    /// # Errors
    /// As for [`FrameMaker::make`].
    fn make_reference(&self, _representative: u32) -> Result<()> {
        Ok(())
    }

    /// The bytes of the reference of `representative`, which is held and was just made. They are returned once.
    fn export(&self, _representative: u32) -> Option<Exported> {
        None
    }

    /// Takes in and holds the reference of `representative` that another rank exported.
    fn import(&self, _representative: u32, _bytes: &[u8]) {}

    /// Renders one strip of a frame, as bytes for [`join_strips`](Self::join_strips).
    ///
    /// # Errors
    /// As for [`FrameMaker::make`].
    fn render_strip(&self, _representative: u32, _strip: Strip) -> Result<Vec<u8>> {
        Ok(Vec::new())
    }

    /// Takes all strips of a frame, in order. [`FrameMaker::make`] then uses them instead of rendering.
    ///
    /// # Errors
    /// The strips do not belong to a frame of this job.
    fn join_strips(&self, _representative: u32, _strips: &[Arc<[u8]>]) -> Result<()> {
        Ok(())
    }
}

/// A reference as it is sent to other ranks.
#[derive(Debug, Clone, Default)]
pub struct Exported {
    /// The encoded reference, for [`RankMaker::import`].
    pub bytes: Arc<[u8]>,
    /// How many discoveries (traced points or pixels) the bytes hold.
    pub discoveries: u64,
}

/// The cost of writing references to disk.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct SaveCost {
    /// Wall seconds to encode, write and sync them.
    pub seconds: f64,
    /// Bytes written.
    pub bytes: u64,
}

/// A frame that was made.
pub struct Made {
    /// The picture.
    pub film: Film,
    /// Rays cast for it.
    pub rays: RayCounts,
    /// How much of it was inferred.
    pub reuse: ReuseCounts,
    /// The errors of its inferred pixels; `None` where none was audited.
    pub audit: Option<AuditSums>,
    /// The reference that its exr file keeps for later jobs, see [`crate::reuse::store`].
    pub reference: Option<Arc<[u8]>>,
}

impl Made {
    /// A copy of the frame, which took no rays and counts all its points as inferred.
    pub(super) fn copy(&self) -> Self {
        let reuse = ReuseCounts {
            direct_inferred: self.reuse.direct,
            specular_inferred: self.reuse.specular,
            inferred_in_part: 0,
            ..self.reuse
        };
        Self {
            film: self.film.clone(),
            rays: RayCounts::default(),
            reuse,
            audit: None,
            reference: self.reference.clone(),
        }
    }
}
