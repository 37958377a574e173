//! Where an in-between frame's time goes: the same frame, more of it each time.

use super::cost::Bare;
use super::moves::{self, Set, Stage};
use super::{Choice, support};
use std::collections::BTreeMap;
use support::Candidate;
use tweenray::film::{Provenance, ProvenanceKind};
use tweenray::inference::{Channels, Inference, LookupBatch};
use tweenray::output::{WriteOptions, write_image};
use tweenray::reuse::{self, Lookup, LookupChannel, Reference};
use tweenray::scene::{Camera, Policy, Settings, Shot};
use tweenray::sequence::Pyramid;
use tweenray::shade::{FrameJob, Rendered, Renderer, Reuse};

const FRAMES: u32 = 33;
/// A leaf of the pyramid, as half of the frames are: inferred from the ends and four between.
const FRAME: u32 = 18;
const TURNS: usize = 11;

/// Knows that everything is in full light, without looking.
struct AllKnown;

impl Inference for AllKnown {
    fn infer(&self, batch: &mut LookupBatch) {
        let (points, channels) = (batch.points.len(), batch.unshadowed.len());
        batch.ratios.clear();
        batch.ratios.resize(channels, 1.0);
        batch.provenance.clear();
        let found = Provenance { kind: ProvenanceKind::Earlier, frame: 1, distance: 0.0 };
        batch.provenance.resize(points, found);
    }
}

/// Looks everything up and takes it as it is; what it does not find is traced, or taken for known.
struct Taken<'a> {
    lookup: Lookup<'a>,
    misses: bool,
}

impl Inference for Taken<'_> {
    fn infer(&self, batch: &mut LookupBatch) {
        self.lookup.estimate(batch);
        let LookupBatch { ratios, estimates, .. } = batch;
        for (ratio, estimate) in ratios.iter_mut().zip(estimates) {
            let is_missed = estimate.ratio.is_nan() && !self.misses;
            *ratio = if is_missed { 1.0 } else { estimate.ratio };
        }
    }
}

/// A frame with all that it is inferred from.
struct Stand<'a> {
    stage: &'a Stage<'a>,
    settings: &'a Settings,
    camera: Camera,
    channels: Channels,
    looked_up: Vec<LookupChannel>,
    references: Vec<Reference>,
}

impl<'a> Stand<'a> {
    /// Renders the frame's ancestors, each from its own.
    fn new(stage: &'a Stage<'a>, settings: &'a Settings, shot: &Shot) -> Self {
        let channels = reuse::channels(&stage.set.scene, settings);
        let camera = |f: u32| shot.camera(f, settings.width, settings.height).expect("a camera");
        let looked_up = LookupChannel::all(&channels, settings);
        let eye = camera(FRAME);
        let mut stand =
            Self { stage, settings, camera: eye, channels, looked_up, references: Vec::new() };
        let pyramid = Pyramid { segment: FRAMES - 1, frames: FRAMES };
        let mut known: BTreeMap<u32, Reference> = BTreeMap::new();
        let wanted = pyramid.ancestors(FRAME);
        for frame in pyramid.order(&wanted) {
            let own: Vec<&Reference> =
                pyramid.ancestors(frame).iter().filter_map(|f| known.get(f)).collect();
            let lookup = Taken { lookup: stand.lookup(frame, &own), misses: true };
            let inference = (!own.is_empty()).then_some(&lookup as &dyn Inference);
            let eye = camera(frame);
            let job = stand.job(&eye, frame, inference);
            let reference = stand.reference(&job);
            known.insert(frame, reference);
        }
        stand.references = wanted.iter().filter_map(|f| known.remove(f)).collect();
        stand
    }

    fn lookup<'l>(&'l self, frame: u32, references: &'l [&'l Reference]) -> Lookup<'l> {
        Lookup { frame, references, channels: &self.looked_up, specular: true }
    }

    fn job<'j>(
        &'j self,
        camera: &'j Camera,
        stream: u32,
        inference: Option<&'j dyn Inference>,
    ) -> FrameJob<'j> {
        let reuse = Some(Reuse { channels: &self.channels, inference, is_source: true });
        FrameJob { reuse, ..FrameJob::whole(camera, stream) }
    }

    fn reference(&self, job: &FrameJob) -> Reference {
        let scene = &self.stage.set.scene;
        let made = self.render(&self.stage.renderer(self.settings), job);
        let own = job.camera.to_scene(&scene.recentring);
        Reference::new(job.stream, &own, &made.sources, self.channels.len())
    }

    fn render(&self, renderer: &Renderer, job: &FrameJob) -> Rendered {
        let render = || renderer.render_job(job, &self.stage.stop, &());
        self.stage.pool.install(render).expect("not stopped")
    }

    /// Renders the frame without lights, to the depth `bounces`.
    fn unlit(&self, bounces: u32) {
        let settings = Settings { bounces, ..self.settings.clone() };
        let renderer = self.stage.renderer(&settings).without_lights();
        let job = FrameJob { reuse: None, ..self.job(&self.camera, FRAME, None) };
        self.render(&renderer, &job);
    }

    /// Renders the frame by `inference`.
    fn inferred(&self, inference: &dyn Inference) {
        let job = self.job(&self.camera, FRAME, Some(inference));
        self.render(&self.stage.renderer(self.settings), &job);
    }
}

/// Prints the table.
pub fn report(choice: &Choice) {
    let size = choice.size.unwrap_or((640, 360));
    let set = Set::load("spheres_on_terrain", |_| ());
    let bare = Bare::new(&set.scene, choice.threads);
    println!(
        "spheres_on_terrain, frame {FRAME} of {FRAMES}, {} x {}; each line renders the frame with one",
        size.0, size.1
    );
    println!("thing more than the line before, and is told in C loops (median of {TURNS} turns)");
    for (spp, samples) in [(1, 16), (1, 100), (4, 16), (4, 100)] {
        one(choice, &set, &bare, &set.settings(size, spp, samples));
    }
}

fn one(choice: &Choice, set: &Set, bare: &Bare, settings: &Settings) {
    let stage = set.stage(choice.threads);
    let shot = set.shot(FRAMES);
    let stand = Stand::new(&stage, settings, &shot);
    let references: Vec<&Reference> = stand.references.iter().collect();
    let taken = |misses| Taken { lookup: stand.lookup(FRAME, &references), misses };
    let (no_misses, lookup) = (taken(false), taken(true));
    let mut plain = settings.clone();
    plain.reuse.policy = Policy::Surface;
    plain.reuse.segment = FRAMES - 1;
    let maker = stage.maker(&plain, &shot, &[FRAME, FRAME + 1]);
    let film = moves::make(&*maker, FRAME).film;
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("frame.png");
    let options = WriteOptions::of(settings, None);
    let mut candidates: Vec<Candidate> = vec![
        (
            "bare C loop".into(),
            Box::new(|| _ = bare.seconds(&stage.pool, &stand.camera, settings.spp)),
        ),
        ("primary: no lights, no bounces".into(), Box::new(|| stand.unlit(0))),
        ("+ mirror and glass".into(), Box::new(|| stand.unlit(settings.bounces))),
        ("+ exact shading, all known".into(), Box::new(|| stand.inferred(&AllKnown))),
        ("+ lookups, no misses".into(), Box::new(|| stand.inferred(&no_misses))),
        ("+ misses".into(), Box::new(|| stand.inferred(&lookup))),
        (
            "output alone (png)".into(),
            Box::new(|| _ = write_image(&path, &film, &options).expect("written")),
        ),
    ];
    let times = support::take_turns(TURNS, &mut candidates);
    let names: Vec<String> = candidates.into_iter().map(|(name, _)| name).collect();
    let loops = |k: usize| times[k].over(&times[0])[1];
    let rows: Vec<Vec<String>> = names
        .into_iter()
        .enumerate()
        .map(|(k, name)| {
            let adds = match k {
                0 => String::new(),
                1..=5 => format!("{:.2}", loops(k) - if k == 1 { 0.0 } else { loops(k - 1) }),
                _ => format!("{:.2}", loops(k)),
            };
            vec![name, format!("{:.1}", 1e3 * times[k].median()), format!("{:.2}", loops(k)), adds]
        })
        .collect();
    let what = format!("{} camera, {} shadow samples", settings.spp, settings.shadow_samples);
    support::table(&[&what, "ms", "C loops", "adds"], &rows);
}
