//! One candidate, one turn: its frames, made and timed.

use super::context::TrialContext;
use super::denoiser::Denoiser;
use super::errors::{Frames, displayed};
use super::frames::Cut;
use crate::error::Result;
use crate::intersect::Intersector;
use crate::reuse;
use crate::reuse::colour::AgreementRule;
use crate::scene::{Policy, Settings};
use crate::sequence::{ColourMaker, FrameContext, FrameMaker, Made, Pyramid, SurfaceReuse, Tracer};
use crate::shade::Renderer;
use crate::stats::RayCounts;
use nix::sys::resource::UsageWho;
use std::time::Instant;

/// What came of a trial: means over the move, per frame.
pub struct Trial {
    /// The frames asked for, as displayed.
    pub frames: Frames,
    /// How the setting cuts the move.
    pub cut: Cut,
    /// Wall seconds.
    pub seconds: f64,
    /// CPU seconds of this process, all threads together, and of the denoiser's.
    pub cpu_seconds: f64,
    /// Rays by kind, the audit's among them, of all frames that were made.
    pub rays: RayCounts,
    /// Rays per frame.
    pub rays_per_frame: f64,
    /// Camera samples a pixel; `None` where all pixels take as many.
    pub camera_samples: Option<f64>,
    /// Memory of the intersector and of the references, bytes.
    pub memory: u64,
}

/// Makes `chosen` frames under `settings`, and what they are inferred from; all denoised if there is a `denoiser`.
///
/// # Errors
/// [`Stopped`](crate::error::Error::Stopped); those of cameras and of the denoiser.
pub fn run(
    context: &TrialContext,
    settings: &Settings,
    intersector: &dyn Intersector,
    denoiser: Option<&Denoiser>,
    chosen: &[u32],
) -> Result<Trial> {
    let scene = context.scene_of(settings);
    let renderer = Renderer::new(scene, settings, intersector);
    let looks_up = !reuse::channels(scene, settings).is_empty();
    let cut = Cut::of(settings, context.shot.frames, looks_up);
    let maker = maker(context, renderer, settings, denoiser.is_some())?;
    let order = maker.batches(&cut.with_ancestors(chosen)).concat();
    maker.expect(&order);
    let mut frames = Frames::new();
    let (mut seconds, mut cpu, mut rays) = (Vec::new(), Vec::new(), Vec::new());
    let mut samples = Vec::new();
    let mut all_rays = RayCounts::default();
    for frame in order {
        let (start, cpu_start) = (Instant::now(), cpu_now());
        let mut made = maker.make(frame)?;
        if let Some(denoiser) = denoiser {
            let threads = context.pool.current_num_threads();
            made.film.rgb = denoiser.denoise(&made.film, threads, context.stop)?;
        }
        seconds.push((frame, start.elapsed().as_secs_f64()));
        cpu.push((frame, cpu_now() - cpu_start));
        let cast = rays_of(&made);
        rays.push((frame, cast.total() as f64));
        all_rays += cast;
        samples.extend(made.film.mean_samples().map(|mean| (frame, mean)));
        if chosen.contains(&frame) {
            let image = context.pool.install(|| displayed(&made.film, settings));
            frames.insert(frame, image);
        }
    }
    Ok(Trial {
        frames,
        seconds: cut.mean(seconds.into_iter()),
        cpu_seconds: cut.mean(cpu.into_iter()),
        rays: all_rays,
        rays_per_frame: cut.mean(rays.into_iter()),
        camera_samples: (!samples.is_empty()).then(|| cut.mean(samples.into_iter())),
        memory: intersector.memory() + maker.reference_memory(),
        cut,
    })
}

fn rays_of(made: &Made) -> RayCounts {
    let mut rays = made.rays;
    rays += made.audit.map_or(RayCounts::default(), |audit| audit.rays);
    rays
}

fn maker<'m>(
    context: &TrialContext<'m>,
    renderer: Renderer<'m>,
    settings: &Settings,
    with_gbuffer: bool,
) -> Result<Box<dyn FrameMaker + 'm>> {
    let TrialContext { shot, pool, stop, .. } = *context;
    let progress = &();
    let context = FrameContext { renderer, shot, pool, with_gbuffer, stop, progress };
    Ok(match settings.reuse.policy {
        Policy::Surface => {
            let pyramid = Pyramid { segment: settings.reuse.segment, frames: shot.frames };
            Box::new(SurfaceReuse::new(context, pyramid)?)
        }
        Policy::Colour => {
            Box::new(ColourMaker::new(context, AgreementRule::of(&settings.reuse), &[])?)
        }
        Policy::Off => Box::new(Tracer::new(context)),
    })
}

/// CPU seconds of this process so far, and of the programs that it has run.
pub fn cpu_now() -> f64 {
    let now = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    let others = nix::sys::resource::getrusage(UsageWho::RUSAGE_CHILDREN).map_or(0.0, |usage| {
        [usage.user_time(), usage.system_time()]
            .map(|time| time.tv_sec() as f64 + time.tv_usec() as f64 * 1e-6)
            .iter()
            .sum()
    });
    now.tv_sec as f64 + now.tv_nsec as f64 * 1e-9 + others
}
