//! Renders a move whose in-between frames are inferred, and reads the audit, which says how far they
//! are from the truth: `cargo run --example 3_sequence_with_reuse`.

#![allow(clippy::print_stdout, reason = "a program for people")]

#[allow(dead_code)]
#[path = "1_one_frame.rs"]
pub mod one_frame;

use std::sync::atomic::AtomicBool;
use tweenray::error::{Error, Result};
use tweenray::intersect;
use tweenray::math::{DVec3, Rgb};
use tweenray::reuse::audit::{Rmse, rmse};
use tweenray::scene::{CameraPath, Light, QuadLight, ReuseSettings, Settings, Shot};
use tweenray::sequence::{FrameContext, FrameMaker, Pyramid, SurfaceReuse};
use tweenray::shade::Renderer;
use tweenray::stats::{AuditSums, ReuseCounts};

fn main() -> Result<()> {
    let (reused, Rmse { shown, traced, .. }) = render(9)?;
    println!("{:.0} % of the shadowing is inferred", 100.0 * reused.share().unwrap_or(0.0));
    // Root mean square errors in steps of an 8-bit display, with 95 % intervals.
    println!("off by {:.2} ({:.2} to {:.2}),", shown.estimate, shown.low, shown.high);
    println!("if traced {:.2} ({:.2} to {:.2})", traced.estimate, traced.low, traced.high);
    Ok(())
}

/// Renders a pan of `frames` frames; gives how much was inferred, and what the audit says of it.
pub fn render(frames: u32) -> Result<(ReuseCounts, Rmse)> {
    // One segment; a tenth of its pixels are probes: traced, they decide what is inferred, and audit it.
    let reuse = ReuseSettings { segment: frames - 1, probes: 0.1, ..ReuseSettings::default() };
    let settings =
        Settings { width: 160, height: 120, shadow_samples: 64, reuse, ..Settings::default() };
    // Soft shadows take many rays: those are what is worth reusing.
    let corners = [(-1., -1.), (1., -1.), (1., 1.), (-1., 1.)].map(|(x, z)| DVec3::new(x, 4.0, z));
    let lamp = QuadLight { corners, radiance: Rgb::splat(12.0), two_sided: false };
    let scene = one_frame::world_under(Light::Quad(lamp)).into_scene(true)?;
    let [from, to] = [-1.0, 1.0].map(|x| DVec3::new(x, 2.5, 7.0));
    let path = CameraPath::Pan { from, to, target: DVec3::Y, up: DVec3::Y, roll_degrees: 0.0 };
    let shot = Shot::new(path, frames, 40.0);
    let intersector = intersect::build(&scene, &settings, 1)?;
    let renderer = Renderer::new(&scene, &settings, &*intersector);
    let pool = rayon::ThreadPoolBuilder::new().build().map_err(|e| Error::Failed(e.to_string()))?;
    let (pyramid, stop) = (Pyramid::whole(frames), &AtomicBool::new(false));
    let (shot, pool, progress) = (&shot, &pool, &());
    let context = FrameContext { renderer, shot, pool, with_gbuffer: false, stop, progress };
    let maker = SurfaceReuse::new(context, pyramid)?;
    // Both ends, then the middle, then the quarters: each after those that it is inferred from.
    let order = pyramid.by_need();
    maker.expect(&order);
    let (mut reused, mut audit) = (ReuseCounts::default(), AuditSums::default());
    for frame in order {
        let made = maker.make(frame)?;
        reused += made.reuse;
        audit += made.audit.unwrap_or_default();
    }
    Ok((reused, rmse(&audit).ok_or(Error::Failed("no pixel was audited".into()))?))
}
