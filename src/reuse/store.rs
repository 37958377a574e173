//! A frame's traced points as bytes, so that a later job of the same scene can take them as a
//! [`Reference`].
//!
//! The bytes are an attribute of the frame's exr file. Channels would not do: a pixel may have several
//! points, seen in mirrors or on two surfaces, and a compositor should not show twenty channels that mean
//! nothing to it. The layout: `MAGIC`, the BLAKE3 of all that
//! follows, the length of a JSON `Head` and the head, the camera (world space, f64), then points and
//! findings as `columns` encodes them. Little endian throughout.
//!
//! Reading checks that tracing could have produced every number.

use super::Reference;
use super::columns::{self, deflated, inflated, take, take_u32};
use super::evidence::{Finding, LitCounts, ProbeFindings};
use super::risk::LEVELS;
use crate::error::{Error, Result};
use crate::inference::{Channel, Channels, SurfacePoint, TracedPoint, TracedPoints, most_ratio};
use crate::math::Vec3;
use crate::scene::{Camera, Recentring, Rect, Settings};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Name of the attribute of an exr file that holds the record.
pub const ATTRIBUTE: &str = "tweenrayReference";
/// First bytes of a record; the last letter is the layout's version.
const MAGIC: &[u8; 8] = b"twrayrf6";
/// Number of 32-bit words of a point, without its ratios and the numbers of their lights.
const WORDS: usize = 12;
/// Bytes of a finding.
const FINDING: usize = 3 * 4;
/// Flag in the word of a finding's level: check rays agreed.
const AGREED: u32 = 1 << 8;
/// Largest squared error of a finding, from black to white: squares of a display step.
const MOST_ERROR: f32 = 255.0 * 255.0;
/// Most bytes of a head.
const MOST_HEAD: usize = 1 << 20;
/// Bit that marks points seen directly, above their number of samples.
const DIRECT: u32 = 1 << 31;
/// Most cells of a footprint's size along an edge of the scene.
const MOST_CELLS: f32 = 1e12;

/// The properties that a reference and a job must have in common.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Compatibility {
    /// Hash of the world, without the shot.
    pub world: String,
    /// Whether the scene is traced about its own centre.
    pub recentre: bool,
    /// The lights whose ratios are kept.
    pub lights: Vec<String>,
    /// For each light the shadow rays of a pixel: camera samples times shadow samples.
    pub rays: Vec<u32>,
    /// Whether every point has its own list of lights, as in scenes of many lights; else all have the same.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub selected: bool,
}

/// Names of the primary colours.
const COLOURS: [&str; 3] = ["red", "green", "blue"];

/// The head of a record.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Head {
    terms: Compatibility,
    /// The frame's number in its own shot; reported, never used.
    frame: u32,
    /// Settings as text; reported, never used.
    settings: String,
    points: usize,
    findings: usize,
    /// Of the points that the frame's probes saw: how many were lit, and how many of these were known.
    lit: u64,
    known: u64,
}

impl Compatibility {
    /// The compatibility of references of a job, by the hash of its `world`, its `channels` and its samples.
    pub fn of(world: &str, channels: &Channels, settings: &Settings) -> Self {
        let name = |channel| match channel {
            Channel::Area(index, _) if channels.colours() == 1 => format!("light {}", index + 1),
            Channel::Area(index, part) => {
                format!("light {}, {}", index + 1, COLOURS[part as usize])
            }
            Channel::Selected(slot, _) if channels.colours() == 1 => {
                format!("selected light {}", slot + 1)
            }
            Channel::Selected(slot, part) => {
                format!("selected light {}, {}", slot + 1, COLOURS[part as usize])
            }
            // How many lights are too weak to count depends on the exposure.
            Channel::Tail(part) => {
                format!("part {} of the weak lights, exposure {}", part + 1, settings.exposure)
            }
            Channel::Sky(_) if channels.sky().len() == 1 => "sky".into(),
            Channel::Sky(part) => format!("part {} of the sky", part + 1),
        };
        let rays = |c| super::cost::rays_of(c, settings).saturating_mul(settings.spp);
        Self {
            world: world.into(),
            recentre: settings.rules.recentre,
            lights: channels.iter().map(name).collect(),
            rays: channels.iter().map(rays).collect(),
            selected: channels.slots() > 0,
        }
    }

    /// Words of a point.
    fn words(&self) -> usize {
        WORDS + self.lights.len() * if self.selected { 2 } else { 1 }
    }

    /// Why references of a job with the compatibility `other` cannot be used here; `None` if they can.
    fn refusal(&self, other: &Self) -> Option<String> {
        let Self { world, recentre, lights, rays, selected: _ } = self;
        if *world != other.world {
            return Some("it shows another scene".into());
        }
        if *recentre != other.recentre {
            return Some("it was rendered with another --recentre".into());
        }
        if *lights != other.lights {
            let list = |lights: &[String]| match lights {
                [] => "none".to_string(),
                lights => lights.join(", "),
            };
            let (theirs, ours) = (list(&other.lights), list(lights));
            return Some(format!("it keeps the shadowing of {theirs}, this job that of {ours}"));
        }
        let pairs = rays.iter().zip(&other.rays).zip(lights);
        let few = { pairs }.find(|((own, theirs), _)| theirs < own);
        few.map(|((own, theirs), light)| {
            format!(
                "it was rendered with {theirs} shadow rays a pixel to {light}, fewer than the {own} \
                 of this job: frames would be noisier than traced ones"
            )
        })
    }
}

/// The traced points of a frame with its camera and findings, as they go into a file.
pub struct ReferenceRecord<'a> {
    /// The compatibility that jobs must have to use the record.
    pub terms: &'a Compatibility,
    /// Number of the frame.
    pub frame: u32,
    /// The frame's camera, world space.
    pub camera: &'a Camera,
    /// Points outside of the crop are left out; `None` keeps all points.
    pub crop: Option<Rect>,
    /// The traced points, scene space.
    pub traced: &'a TracedPoints,
    /// The findings of the frame's probes.
    pub findings: &'a ProbeFindings,
    /// Settings in words.
    pub settings: &'a str,
}

impl ReferenceRecord<'_> {
    /// The record as bytes, which do not depend on points outside of the crop. `None` where there would be too
    /// many.
    pub fn encode(&self) -> Option<Vec<u8>> {
        // `order` takes what lies in the crop.
        let Self { terms, frame, camera, crop: _, traced: _, findings, settings } = *self;
        let channels = terms.lights.len();
        let order = self.order();
        let head = Head {
            terms: terms.clone(),
            frame,
            settings: settings.into(),
            points: order.len(),
            findings: findings.list.len(),
            lit: findings.lit.all,
            known: findings.lit.known,
        };
        let words = terms.words();
        size_of_record(head.points, words, head.findings)?;
        let word = |i: usize, column| self.word(order[i], column, channels);
        let mut raw = columns::planes(order.len(), words, word);
        raw.extend(findings.list.iter().flat_map(finding_bytes));
        let json = serde_json::to_vec(&head).ok()?;
        let mut body = (json.len() as u32).to_le_bytes().to_vec();
        body.extend(json);
        body.extend(camera.encode());
        body.extend(deflated(&raw)?);
        Some([MAGIC.as_slice(), blake3::hash(&body).as_bytes(), &body].concat())
    }

    /// Indices of the points in the crop, row by row: their order in memory depends on the tiles that were traced.
    fn order(&self) -> Vec<usize> {
        let points = &self.traced.points;
        let is_in = |p: &TracedPoint| {
            let inside = |c: &Rect| (c.x0..c.x1).contains(&p.x) && (c.y0..c.y1).contains(&p.y);
            self.crop.as_ref().is_none_or(inside)
        };
        let mut order: Vec<usize> = (0..points.len()).filter(|i| is_in(&points[*i])).collect();
        order.sort_by_key(|i| (points[*i].y, points[*i].x));
        order
    }

    fn word(&self, i: usize, column: usize, channels: usize) -> u32 {
        let TracedPoint { x, y, point } = self.traced.points[i];
        let SurfacePoint { p, n, geom_id, footprint, cos, direct, samples } = point;
        let flag = if direct { DIRECT } else { 0 };
        match column {
            0 => x,
            1 => y,
            2 => geom_id,
            3 => samples.min(DIRECT - 1) | flag,
            4..7 => (p[column - 4] as f32).to_bits(),
            7..10 => n[column - 7].to_bits(),
            10 => footprint.to_bits(),
            11 => cos.to_bits(),
            _ if column < WORDS + channels => {
                match self.traced.ratios[i * channels + column - WORDS] {
                    // One NaN, whatever its bits were.
                    ratio if ratio.is_nan() => f32::NAN.to_bits(),
                    ratio => ratio.to_bits(),
                }
            }
            _ => self.traced.lights[i * channels + column - WORDS - channels],
        }
    }
}

/// Decodes the bytes of [`ReferenceRecord::encode`] for a job of the compatibility `terms`, in a scene with
/// `recentring`: the reference and the hash of its bytes. A reference takes memory by its camera's pixels, of
/// which there are at most `most_pixels`. `path` is for messages.
///
/// # Errors
/// [`Error::Input`] if the bytes are damaged, are no record, have another compatibility, or claim more pixels.
pub fn decode(
    path: &Path,
    bytes: &[u8],
    terms: &Compatibility,
    recentring: &Recentring,
    most_pixels: u64,
) -> Result<(Reference, [u8; 32])> {
    let refuse = |why: String| Error::input(path, format!("cannot serve as a reference: {why}"));
    let damaged = || refuse("its record of traced points is damaged".into());
    let Some(rest) = bytes.strip_prefix(MAGIC) else {
        return Err(refuse("its record is of another version of tweenray".into()));
    };
    let (hash, mut body) = rest.split_first_chunk::<32>().ok_or_else(damaged)?;
    if blake3::hash(body).as_bytes() != hash {
        return Err(damaged());
    }
    let length = take_u32(&mut body).ok_or_else(damaged)?;
    let json = take(&mut body, length).filter(|j| j.len() <= MOST_HEAD).ok_or_else(damaged)?;
    let head: Head = serde_json::from_slice(json).map_err(|_| damaged())?;
    if let Some(why) = terms.refusal(&head.terms) {
        return Err(refuse(why));
    }
    let camera = take(&mut body, Camera::BYTES).and_then(Camera::decode).ok_or_else(damaged)?;
    let Camera { width, height, .. } = camera;
    if u64::from(width) * u64::from(height) > most_pixels {
        return Err(refuse(format!(
            "its record claims {width}x{height} pixels, more than it can have"
        )));
    }
    let (traced, findings) = record_of(body, &head, terms, &camera).ok_or_else(damaged)?;
    let camera = camera.to_scene(recentring);
    let reference = Reference::new(Reference::SUPPLIED, &camera, &traced, terms.lights.len());
    Ok((reference.with_findings(findings), *hash))
}

/// Size of `points` of so many `words`, and of `findings`, bytes; `None` where it is too large.
fn size_of_record(points: usize, words: usize, findings: usize) -> Option<usize> {
    columns::size_of(points, words, findings.checked_mul(FINDING)?)
}

fn record_of(
    body: &[u8],
    head: &Head,
    terms: &Compatibility,
    camera: &Camera,
) -> Option<(TracedPoints, ProbeFindings)> {
    let words = terms.words();
    let raw = inflated(body, size_of_record(head.points, words, head.findings)?)?;
    let (points, findings) = raw.split_at_checked(4 * words * head.points)?;
    let list: Option<Vec<Finding>> = findings.chunks_exact(FINDING).map(finding_of).collect();
    let lit = LitCounts { all: head.lit, known: head.known };
    let findings = ProbeFindings { list: list?, lit };
    let traced = points_of(points, head.points, terms, camera)?;
    (lit.known <= lit.all).then_some((traced, findings))
}

fn finding_bytes(finding: &Finding) -> [u8; FINDING] {
    let Finding { level, agreed, error, noise } = *finding;
    let flag = if agreed { AGREED } else { 0 };
    let mut bytes = [0; FINDING];
    let words = [error.to_bits(), noise.to_bits(), u32::from(level) | flag];
    for (to, word) in bytes.chunks_exact_mut(4).zip(words) {
        to.copy_from_slice(&word.to_le_bytes());
    }
    bytes
}

/// Decodes the bytes of [`finding_bytes`]; `None` for numbers that no probe can find.
fn finding_of(mut bytes: &[u8]) -> Option<Finding> {
    let mut words = [0; FINDING / 4];
    for word in &mut words {
        *word = take_u32(&mut bytes)? as u32;
    }
    let [error, noise, flags] = words;
    let [error, noise] = [error, noise].map(f32::from_bits);
    let (level, agreed) = (flags & !AGREED, flags & AGREED != 0);
    let level = u8::try_from(level).ok().filter(|level| usize::from(*level) < LEVELS)?;
    let is_sound = error.abs() <= MOST_ERROR && (0.0..=MOST_ERROR).contains(&noise);
    is_sound.then_some(Finding { level, agreed, error, noise })
}

fn points_of(
    raw: &[u8],
    count: usize,
    terms: &Compatibility,
    camera: &Camera,
) -> Option<TracedPoints> {
    let columns = WORDS + terms.lights.len();
    let word = |i: usize, column: usize| columns::word(raw, count, i, column);
    let mut traced = TracedPoints::default();
    for i in 0..count {
        let float = |column: usize| f32::from_bits(word(i, column));
        let vector = |first: usize| Vec3::new(float(first), float(first + 1), float(first + 2));
        let flags = word(i, 3);
        let point = SurfacePoint {
            p: vector(4).as_dvec3(),
            n: vector(7),
            geom_id: word(i, 2),
            footprint: float(10),
            cos: float(11),
            direct: flags & DIRECT != 0,
            samples: flags & !DIRECT,
        };
        let (x, y) = (word(i, 0), word(i, 1));
        let ratios = (WORDS..columns).map(float);
        let lights = (columns..terms.words()).map(|column| word(i, column));
        let is_sound = x < camera.width
            && y < camera.height
            && is_point(&point)
            && ratios.clone().enumerate().all(|(channel, ratio)| {
                let most = most_ratio(lights.clone().nth(channel).as_ref());
                ratio.is_nan() || (0.0..=most).contains(&ratio)
            });
        if !is_sound {
            return None;
        }
        traced.points.push(TracedPoint { x, y, point });
        traced.ratios.extend(ratios);
        // Any number will do: no point has a light that there is not.
        traced.lights.extend(lights);
    }
    Some(traced)
}

/// Whether tracing can have produced the point.
fn is_point(point: &SurfacePoint) -> bool {
    let SurfacePoint { p, n, geom_id: _, footprint, cos, direct: _, samples } = *point;
    let p = p.as_vec3();
    p.is_finite()
        && (n.length() - 1.0).abs() < 1e-3
        && footprint.is_finite()
        && footprint > 0.0
        && p.abs().max_element() / footprint < MOST_CELLS
        && (-1.0..=1.001).contains(&cos)
        && samples > 0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inference::{sky_light, tail_light};
    use crate::math::DVec3;
    use crate::scene::Pose;

    fn terms() -> Compatibility {
        let lights = vec!["light 1".to_string(), "sky".into()];
        let (world, recentre, rays, selected) = ("w".into(), true, vec![16, 64], false);
        Compatibility { world, recentre, lights, rays, selected }
    }

    fn camera() -> Camera {
        let eye = DVec3::new(0.1, 0.2, 5.0 / 3.0);
        let pose = Pose { eye, target: DVec3::ZERO, up: DVec3::Y, roll_degrees: 0.0 };
        Camera::new(&pose, 40.0, 8, 6).expect("a camera")
    }

    fn traced() -> TracedPoints {
        let point = |x: u32, y: u32| SurfacePoint {
            p: DVec3::new(f64::from(x) / 8.0, f64::from(y) / 8.0, 0.25),
            n: Vec3::Z,
            geom_id: 3,
            footprint: 0.125,
            cos: 0.5,
            direct: (x + y) % 3 > 0,
            samples: 1 + x,
        };
        let places = (0..6).flat_map(|y| (0..8).map(move |x| (x, y)));
        let points: Vec<_> =
            places.map(|(x, y)| TracedPoint { x, y, point: point(x, y) }).collect();
        let ratio = |i: usize| if i % 5 == 0 { f32::NAN } else { i as f32 / 100.0 };
        TracedPoints { points, ratios: (0..96).map(ratio).collect(), lights: Vec::new() }
    }

    fn findings() -> ProbeFindings {
        let one = Finding { level: 7, agreed: true, error: -0.5, noise: 0.25 };
        let list = vec![one, Finding { level: 0, agreed: false, error: 9.0, noise: 0.0 }];
        ProbeFindings { list, lit: LitCounts { all: 3, known: 2 } }
    }

    fn encoded(traced: &TracedPoints, crop: Option<Rect>) -> Vec<u8> {
        seen_by(&camera(), traced, crop)
    }

    fn seen_by(camera: &Camera, traced: &TracedPoints, crop: Option<Rect>) -> Vec<u8> {
        let (terms, findings) = (terms(), findings());
        let (terms, findings, settings) = (&terms, &findings, "spp 1");
        let kept = ReferenceRecord { terms, frame: 7, camera, crop, traced, findings, settings };
        kept.encode().expect("small enough")
    }

    fn read(bytes: &[u8], terms: &Compatibility) -> Result<Reference> {
        decode(Path::new("f.exr"), bytes, terms, &Recentring::IDENTITY, 48).map(|(r, _)| r)
    }

    #[test]
    fn a_reference_is_decoded_as_it_was_encoded() {
        let back = read(&encoded(&traced(), None), &terms()).expect("whole");
        let own = Reference::new(Reference::SUPPLIED, &camera(), &traced(), 2);
        let own = own.with_findings(findings());
        // By text, since NaN does not equal itself.
        assert_eq!(format!("{back:?}"), format!("{own:?}"));
    }

    #[test]
    fn where_lights_are_selected_every_point_says_whose_its_ratios_are() {
        let terms = Compatibility { selected: true, ..terms() };
        let light = |i: u32| match i % 2 {
            0 if i < 48 => i / 8,
            0 => tail_light(5, 1),
            _ => sky_light(0),
        };
        let lights: Vec<u32> = (0..96).map(light).collect();
        let mut traced = TracedPoints { lights, ..traced() };
        // The tail's stand-in may be less than what arrives.
        traced.ratios[50] = 16.0;
        let (camera, findings) = (camera(), findings());
        let (camera, traced, findings, settings) = (&camera, &traced, &findings, "spp 1");
        let crop = None;
        let record =
            ReferenceRecord { terms: &terms, frame: 7, camera, crop, traced, findings, settings };
        let back = read(&record.encode().expect("small enough"), &terms).expect("whole");
        let own = Reference::new(Reference::SUPPLIED, camera, traced, 2);
        assert_eq!(format!("{back:?}"), format!("{:?}", own.with_findings(findings.clone())));
        // No other light's ratio is above 1.
        let mut wrong = traced.clone();
        wrong.ratios[0] = 16.0;
        let record = ReferenceRecord { traced: &wrong, ..record };
        assert!(read(&record.encode().expect("small enough"), &terms).is_err());
    }

    #[test]
    fn the_bytes_do_not_depend_on_points_outside_the_crop() {
        let crop = Rect { x0: 2, y0: 1, x1: 7, y1: 4 };
        let (all, mut some) = (traced(), TracedPoints::default());
        for (i, t) in all.points.iter().enumerate().rev() {
            if t.x >= 2 && t.y < 4 {
                some.points.push(*t);
                some.ratios.extend(&all.ratios[2 * i..2 * i + 2]);
            }
        }
        assert_eq!(encoded(&all, Some(crop)), encoded(&some, Some(crop)));
    }

    #[test]
    fn every_damaged_byte_and_every_cut_is_refused() {
        let bytes = encoded(&traced(), None);
        for i in 0..bytes.len() {
            let mut damaged = bytes.clone();
            damaged[i] ^= 0x10;
            assert!(read(&damaged, &terms()).is_err(), "byte {i}");
            assert!(read(&bytes[..i], &terms()).is_err(), "cut at {i}");
        }
    }

    /// Bytes whose hash is right, whatever is in them: made by hand.
    fn forged(change: impl Fn(&mut Vec<u8>)) -> Vec<u8> {
        let mut body = encoded(&traced(), None)[40..].to_vec();
        change(&mut body);
        [MAGIC.as_slice(), blake3::hash(&body).as_bytes(), &body].concat()
    }

    #[test]
    fn forged_lengths_counts_and_numbers_are_refused() {
        let json_at = 4;
        let replace = |body: &mut Vec<u8>, from: &str, to: &str| {
            let length = u32::from_le_bytes(body[..4].try_into().expect("four")) as usize;
            let json = String::from_utf8(body[json_at..json_at + length].to_vec()).expect("text");
            assert!(json.contains(from));
            let json = json.replace(from, to);
            body.splice(json_at..json_at + length, json.bytes());
            body[..4].copy_from_slice(&(json.len() as u32).to_le_bytes());
        };
        for count in ["0", "47", "49", "99999999", "18446744073709551615"] {
            let to = format!("\"points\":{count}");
            let bytes = forged(|b| replace(b, "\"points\":48", &to));
            assert!(read(&bytes, &terms()).is_err(), "{count}");
        }
        assert!(read(&forged(|b| b[..4].fill(0xff)), &terms()).is_err());
        assert!(read(&forged(|b| b.clear()), &terms()).is_err());
        assert!(read(&forged(|_| ()), &terms()).is_ok());
        let changes: [fn(&mut TracedPoints); 8] = [
            |t| t.points[5].point.p.x = f64::NAN,
            |t| t.points[5].point.n = Vec3::ZERO,
            |t| t.points[5].point.footprint = 0.0,
            |t| t.points[5].point.footprint = f32::INFINITY,
            |t| t.points[5].point.p.x = 1e30,
            |t| t.points[5].x = 8,
            |t| t.points[5].point.samples = 0,
            |t| t.ratios[6] = 1.5,
        ];
        for (i, change) in changes.iter().enumerate() {
            let mut wrong = traced();
            change(&mut wrong);
            assert!(read(&encoded(&wrong, None), &terms()).is_err(), "change {i}");
        }
    }

    /// It would take some 40 GB.
    #[test]
    fn a_claim_of_too_many_pixels_is_refused_before_memory_is_taken() {
        let large = Camera { width: 32768, height: 32768, ..camera() };
        let error = read(&seen_by(&large, &traced(), None), &terms()).expect_err("refused");
        assert!(error.to_string().contains("claims 32768x32768 pixels"), "{error}");
    }

    #[test]
    fn references_of_another_compatibility_are_refused_by_name() {
        let bytes = encoded(&traced(), None);
        let says = |change: fn(&mut Compatibility)| {
            let mut other = terms();
            change(&mut other);
            read(&bytes, &other).expect_err("refused").to_string()
        };
        assert!(says(|t| t.world = "v".into()).contains("f.exr"));
        assert!(says(|t| t.world = "v".into()).contains("another scene"));
        assert!(says(|t| t.recentre = false).contains("--recentre"));
        assert!(says(|t| drop(t.lights.pop())).contains("light 1, sky, this job that of light 1"));
        assert!(says(|t| t.rays[1] = 65).contains("64 shadow rays a pixel to sky"));
        let mut fewer = terms();
        fewer.rays[0] = 4;
        assert!(read(&bytes, &fewer).is_ok());
    }
}
