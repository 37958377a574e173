//! The maker that traces every frame on its own.

use super::context::FrameContext;
use super::strips::{self, JoinedStrips, Strip};
use super::{FrameGraph, FrameMaker, Made, RankMaker};
use crate::error::Result;
use crate::shade::{FrameJob, Progress, Rendered};
use crate::stats::ReuseCounts;
use std::sync::Arc;

/// Traces each frame through the shot's camera.
pub struct Tracer<'a> {
    context: FrameContext<'a>,
    joined: JoinedStrips,
}

impl<'a> Tracer<'a> {
    /// A maker of the frames of `context`.
    pub fn new(context: FrameContext<'a>) -> Self {
        Self { context, joined: JoinedStrips::default() }
    }

    fn render(
        &self,
        frame: u32,
        mask: Option<&[bool]>,
        progress: &dyn Progress,
    ) -> Result<Rendered> {
        let camera = self.context.camera(frame)?;
        self.context.render(&FrameJob { mask, ..self.context.job(frame, &camera) }, progress)
    }
}

impl FrameGraph for Tracer<'_> {
    fn most_strips(&self) -> u32 {
        strips::most(self.context.renderer.settings.height)
    }
}

impl FrameMaker for Tracer<'_> {
    fn make(&self, frame: u32) -> Result<Made> {
        let Rendered { mut film, rays, .. } = match self.joined.take(frame) {
            Some(rendered) => rendered,
            None => self.render(frame, None, self.context.progress)?,
        };
        self.context.note_motion(frame, &mut film)?;
        Ok(Made { film, rays, reuse: ReuseCounts::default(), audit: None, reference: None })
    }
}

impl RankMaker for Tracer<'_> {
    fn render_strip(&self, representative: u32, strip: Strip) -> Result<Vec<u8>> {
        let mask = strips::mask(strip, self.context.renderer.settings);
        strips::encode(self.render(representative, Some(&mask), &())?, strip)
    }

    fn join_strips(&self, representative: u32, strips: &[Arc<[u8]>]) -> Result<()> {
        self.joined.join(representative, strips, self.context.renderer.settings)
    }
}
