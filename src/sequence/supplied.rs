//! References that the user supplies: frames of an earlier job of the same scene.
//!
//! A reference is read when a frame is inferred from it, so a process reads only references that its
//! own frames need. [`ReferenceInfo`]s decide which these are.

use crate::error::{Error, Result};
use crate::math::DVec3;
use crate::output::exr;
use crate::reuse::Reference;
use crate::reuse::store::{ATTRIBUTE, Compatibility, decode};
use crate::scene::{Camera, Recentring};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Largest file that is read.
const LARGEST: u64 = 2 << 30;

/// Number of references with many samples that a frame is inferred from; then the number of other references.
const DENSE: usize = 2;
const OTHERS: usize = 6;

/// A supplied reference without its samples: enough to choose those that serve a frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ReferenceInfo {
    /// Index of its file in the list of all files.
    pub file: usize,
    /// Hash of its content.
    pub hash: [u8; 32],
    /// Position of its camera, scene space.
    eye: DVec3,
    /// View direction of its camera, unit.
    forward: DVec3,
    /// Number of its samples.
    samples: usize,
}

impl ReferenceInfo {
    /// The info of a reference that was read from the `file`-th file.
    pub fn of(file: usize, hash: [u8; 32], reference: &Reference) -> Self {
        let (eye, forward) = (reference.eye(), reference.forward());
        Self { file, hash, eye, forward, samples: reference.len() }
    }
}

/// Function that reads a file's reference and the hash of its content.
type Read = Box<dyn Fn(&Path) -> Result<(Reference, [u8; 32])> + Send + Sync>;

/// The references that are supplied with `--references`, read when a frame needs them.
pub struct ReferenceCache {
    files: Vec<PathBuf>,
    infos: Vec<ReferenceInfo>,
    read: Read,
    /// Most memory of references between two frames, bytes.
    budget: u64,
    held: Mutex<Held>,
}

#[derive(Default)]
struct Held {
    /// References by file, each with the count of requests at its last use.
    references: BTreeMap<usize, (u64, Arc<Reference>)>,
    asked: u64,
    memory: u64,
    most_memory: u64,
}

impl ReferenceCache {
    /// The references in `files` for a job on `terms` of a scene with `recentring`. Those that were used
    /// last are held, up to `budget` bytes.
    pub fn new(
        files: Vec<PathBuf>,
        terms: Compatibility,
        recentring: Recentring,
        budget: u64,
    ) -> Self {
        let read = move |file: &Path| {
            let found = exr::read_attribute(file, ATTRIBUTE, LARGEST)?.ok_or_else(|| {
                Error::input(
                    file,
                    "cannot serve as a reference: it holds no traced points\n  \
                     help: frames rendered to exr with --policy surface and --aovs reference do",
                )
            })?;
            decode(file, &found.bytes, &terms, &recentring, found.most_pixels)
        };
        Self::reading(files, Box::new(read), budget)
    }

    fn reading(files: Vec<PathBuf>, read: Read, budget: u64) -> Self {
        Self { files, infos: Vec::new(), read, budget, held: Mutex::default() }
    }

    /// Reads the `file`-th file; holds its reference if it `is_kept`.
    ///
    /// # Errors
    /// The file cannot be read, or its reference cannot be used for this job.
    pub fn look(&self, file: usize, is_kept: bool) -> Result<ReferenceInfo> {
        let (reference, hash) = (self.read)(&self.files[file])?;
        let info = ReferenceInfo::of(file, hash, &reference);
        if is_kept {
            let mut held = self.held();
            held.put(file, Arc::new(reference));
            held.shrink(self.budget);
        }
        Ok(info)
    }

    /// Sets the references to choose from; frames depend on their order. References without samples are left out.
    pub fn serve(&mut self, infos: Vec<ReferenceInfo>) {
        self.infos = infos.into_iter().filter(|info| info.samples > 0).collect();
    }

    /// The most memory that references took at a time so far, bytes.
    pub fn most_memory(&self) -> u64 {
        self.held().most_memory
    }

    /// The references that a frame seen by `camera` (scene space) is inferred from.
    ///
    /// # Errors
    /// One of them cannot be read, or has changed.
    pub fn nearest(&self, camera: &Camera) -> Result<Vec<Arc<Reference>>> {
        let mut held = self.held();
        let mut found = Vec::new();
        for info in nearest(&self.infos, camera) {
            found.push(match held.get(info.file) {
                Some(reference) => reference,
                None => held.put(info.file, Arc::new(self.read_again(info)?)),
            });
        }
        held.shrink(self.budget);
        Ok(found)
    }

    fn read_again(&self, info: &ReferenceInfo) -> Result<Reference> {
        let file = &self.files[info.file];
        match (self.read)(file)? {
            (reference, hash) if hash == info.hash => Ok(reference),
            _ => Err(Error::input(file, "this reference has changed since the job began")),
        }
    }

    fn held(&self) -> MutexGuard<'_, Held> {
        self.held.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Held {
    fn get(&mut self, file: usize) -> Option<Arc<Reference>> {
        self.asked += 1;
        let (last, reference) = self.references.get_mut(&file)?;
        *last = self.asked;
        Some(Arc::clone(reference))
    }

    fn put(&mut self, file: usize, reference: Arc<Reference>) -> Arc<Reference> {
        self.asked += 1;
        self.memory += reference.memory();
        self.most_memory = self.most_memory.max(self.memory);
        self.references.insert(file, (self.asked, Arc::clone(&reference)));
        reference
    }

    /// Drops the references that were used longest ago until the rest take at most `budget` bytes.
    fn shrink(&mut self, budget: u64) {
        while self.memory > budget {
            let oldest = self.references.iter().min_by_key(|(_, (last, _))| *last);
            let Some(file) = oldest.map(|(file, _)| *file) else { return };
            let gone = self.references.remove(&file);
            self.memory -= gone.map_or(0, |(_, reference)| reference.memory());
        }
    }
}

/// A frame's `own` references, then those `supplied` for it. If any are supplied, references with many
/// samples come before those with few, since the first two are always searched, and key frames that were
/// themselves inferred have few samples.
pub(super) fn with_supplied<'r>(
    own: Vec<&'r Reference>,
    supplied: &'r [Arc<Reference>],
) -> Vec<&'r Reference> {
    if supplied.is_empty() {
        return own;
    }
    let mut all = own;
    all.extend(supplied.iter().map(|r| &**r));
    let most = all.iter().map(|r| r.len()).max().unwrap_or(0);
    all.sort_by_key(|r| 2 * r.len() < most);
    all
}

/// The supplied references that a frame seen by `camera` (scene space) is inferred from. In-between frames
/// have few samples, so the nearest references alone would not do. First come the two nearest references
/// with at least half as many samples as the one with the most, then the nearest of the others.
fn nearest<'c>(supplied: &'c [ReferenceInfo], camera: &Camera) -> Vec<&'c ReferenceInfo> {
    let most = supplied.iter().map(|c| c.samples).max().unwrap_or(0);
    let farthest = supplied.iter().map(|c| c.eye.distance(camera.eye)).fold(0.0, f64::max);
    let apart = |c: &ReferenceInfo| {
        let eyes = c.eye.distance(camera.eye) / farthest.max(f64::MIN_POSITIVE);
        let turn: DVec3 = c.forward - camera.forward;
        eyes + 0.5 * turn.length()
    };
    let mut all: Vec<(f64, &ReferenceInfo)> = supplied.iter().map(|c| (apart(c), c)).collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (dense, others): (Vec<_>, Vec<_>) =
        all.into_iter().partition(|(_, c)| 2 * c.samples >= most);
    let rest = dense.iter().skip(DENSE).chain(&others);
    let mut rest: Vec<_> = rest.copied().collect();
    rest.sort_by(|a, b| a.0.total_cmp(&b.0));
    let chosen = dense.into_iter().take(DENSE).chain(rest.into_iter().take(OTHERS));
    chosen.map(|(_, c)| c).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inference::{Channels, SurfacePoint, TracedPoint, TracedPoints};
    use crate::math::Vec3;
    use crate::reuse::evidence::ProbeFindings;
    use crate::reuse::store::ReferenceRecord;
    use crate::scene::{Pose, Settings};

    fn camera(x: f64) -> Camera {
        let eye = DVec3::new(x, 0.0, 0.0);
        let pose = Pose { eye, target: eye - DVec3::Z, up: DVec3::Y, roll_degrees: 0.0 };
        Camera::new(&pose, 40.0, 64, 64).expect("a camera")
    }

    fn reference(x: f64, points: u32) -> Reference {
        let point = SurfacePoint {
            p: -DVec3::Z,
            n: Vec3::Z,
            geom_id: 0,
            footprint: 0.01,
            cos: 1.0,
            direct: true,
            samples: 1,
        };
        let points = (0..points).map(|i| TracedPoint { x: i % 64, y: i / 64, point }).collect();
        let traced = TracedPoints { ratios: vec![1.0; 4096], points, lights: Vec::new() };
        Reference::new(Reference::SUPPLIED, &camera(x), &traced, 1)
    }

    fn infos(references: &[Reference]) -> Vec<ReferenceInfo> {
        (0..).zip(references).map(|(i, r)| ReferenceInfo::of(i, [i as u8; 32], r)).collect()
    }

    #[test]
    fn references_with_many_samples_come_first_only_if_some_are_supplied() {
        let own = [reference(0.0, 3), reference(1.0, 900), reference(2.0, 4)];
        let places = |supplied: &[Arc<Reference>]| -> Vec<f64> {
            let all = with_supplied(own.iter().collect(), supplied);
            all.iter().map(|r| r.eye().x).collect()
        };
        assert_eq!(places(&[]), [0.0, 1.0, 2.0]);
        let supplied = [reference(7.0, 1000), reference(5.0, 6)].map(Arc::new);
        assert_eq!(places(&supplied), [1.0, 7.0, 0.0, 2.0, 5.0]);
    }

    #[test]
    fn two_references_with_many_samples_come_before_the_nearest_others() {
        let mut all: Vec<Reference> = (0..20).map(|i| reference(f64::from(i), 5)).collect();
        all.extend([0.5, 9.0, 19.5].map(|x| reference(x, 1000)));
        let all = infos(&all);
        let places =
            |x| -> Vec<f64> { nearest(&all, &camera(x)).iter().map(|c| c.eye.x).collect() };
        assert_eq!(places(18.9), [19.5, 9.0, 19.0, 18.0, 17.0, 16.0, 15.0, 14.0]);
        assert_eq!(places(0.4)[..3], [0.5, 9.0, 0.0]);
        assert!(nearest(&[], &camera(0.0)).is_empty());
    }

    /// Forty references along a line, named by where they stand, and what was read of them.
    fn cache(budget: u64) -> (ReferenceCache, Arc<Mutex<Vec<usize>>>) {
        let reads = Arc::new(Mutex::new(Vec::new()));
        let theirs = Arc::clone(&reads);
        let read = move |file: &Path| {
            let place: u8 = file.to_str().and_then(|name| name.parse().ok()).expect("a place");
            theirs.lock().expect("no panic").push(usize::from(place));
            Ok((reference(f64::from(place), 100), [place; 32]))
        };
        let files = (0..40).map(|place: u8| place.to_string().into()).collect();
        let mut cache = ReferenceCache::reading(files, Box::new(read), budget);
        cache.serve((0..40).map(|file| cache.look(file, file == 5).expect("there")).collect());
        reads.lock().expect("no panic").clear();
        (cache, reads)
    }

    #[test]
    fn only_needed_references_are_read_and_once_while_there_is_room() {
        let one = reference(0.0, 100).memory();
        let ask = |cache: &ReferenceCache, x| cache.nearest(&camera(x)).expect("readable").len();
        let (wide, reads) = cache(100 * one);
        for x in [4.0, 4.0, 5.0] {
            assert_eq!(ask(&wide, x), 8);
        }
        let mut read = std::mem::take(&mut *reads.lock().expect("no panic"));
        assert!(!read.contains(&5) && read.iter().all(|file| *file < 12), "{read:?}");
        let count = read.len();
        read.sort();
        read.dedup();
        assert_eq!(read.len(), count, "read twice");
        // What there is no room for is read again, and the eight of a frame always serve.
        let (narrow, reads) = cache(3 * one);
        assert_eq!((ask(&narrow, 4.0), ask(&narrow, 4.0)), (8, 8));
        assert!(reads.lock().expect("no panic").len() > 8);
        assert_eq!(narrow.held().references.len(), 3);
    }

    #[test]
    fn a_small_file_cannot_claim_a_large_frame() {
        let settings = Settings::default();
        let terms = Compatibility::of("w", &Channels::default(), &settings);
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("f.exr");
        let look = |camera: &Camera| {
            let record = ReferenceRecord {
                terms: &terms,
                frame: 1,
                camera,
                crop: None,
                traced: &TracedPoints::default(),
                findings: &ProbeFindings::default(),
                settings: "",
            };
            let record = record.encode().expect("few points");
            let mut channels = Vec::new();
            exr::push_vectors(&mut channels, ["R", "G", "B"], &[Vec3::ZERO; 64 * 64]);
            let own = Some((ATTRIBUTE, &record[..]));
            let bytes = exr::encode_with(64, 64, &channels, "", own).expect("encoded");
            std::fs::write(&path, bytes).expect("written");
            let (files, recentring) = (vec![path.clone()], Recentring::IDENTITY);
            ReferenceCache::new(files, terms.clone(), recentring, 0).look(0, false)
        };
        look(&camera(0.0)).expect("a black frame is small, and still large enough");
        let large = Camera { width: 32768, height: 32768, ..camera(0.0) };
        let error = look(&large).expect_err("refused").to_string();
        assert!(error.contains("claims 32768x32768 pixels"), "{error}");
    }

    #[test]
    fn a_file_that_has_changed_is_refused_by_name() {
        let (mut cache, _) = cache(0);
        cache.infos[3].hash = [99; 32];
        let error = cache.nearest(&camera(3.0)).expect_err("refused").to_string();
        assert!(error.starts_with("3: this reference has changed"), "{error}");
    }
}
