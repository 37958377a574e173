//! The source paper's cache: colours of pixels ("Optimized Ray Tracing for Single Scene Renders",
//! 2023). Kept as a baseline beside the lookup of surface points; never traces.
//!
//! The cache has a list of entries for each pixel: frame, colour, and the distance that the camera ray
//! travelled. A later frame looks up the nearest entry before it and the nearest after it. If
//! their colours and their distances agree, the pixel's colour is interpolated between the two
//! in time; else the pixel must be traced, which makes a new entry (a *discovery*). The cache knows
//! nothing about surfaces. So it misses a surface that passes through a pixel between two entries, and
//! blurs differences below the epsilon.
//!
//! Where the paper leaves a detail open, the simplest choice is taken:
//! * Entries of one pixel are compared with each other, since an inferred pixel has no distance of
//!   its own without tracing it; and only the two around the frame in time, since entries further
//!   away say less.
//! * Colours are compared channel by channel in linear radiance, distances by their difference as a
//!   share of the nearer one. A ray that hits nothing travels infinitely far.
//! * Only traced pixels and uploaded pictures make entries; inferred pixels do not.
//! * The paper hashes pixels to lists. Here the entries lie frame by frame, so that those of a frame
//!   that is not needed any more can be dropped; lookups have the same results.

use super::columns::{self, deflated, inflated};
use crate::film::{Provenance, ProvenanceKind};
use crate::math::Rgb;
use crate::scene::ReuseSettings;

/// Words of an entry: its pixel, its colour, its distance.
const WORDS: usize = 5;

/// The condition under which two entries of a pixel agree.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AgreementRule {
    /// Largest difference in any channel, linear radiance.
    pub colour_epsilon: f32,
    /// Largest difference of the distances, as a share of the nearer one.
    pub distance_epsilon: f32,
}

/// A known pixel of one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Entry {
    /// Index of the pixel, row by row.
    pub pixel: u32,
    /// Linear radiance.
    pub rgb: Rgb,
    /// From the eye to the first hit, world units; infinite where nothing is hit, NaN where it is
    /// not known, which agrees with any distance.
    pub distance: f32,
}

/// The known colours of one frame: of all its pixels, or of those that were traced (its discoveries).
#[derive(Debug, Clone, Default, PartialEq)]
pub struct KnownColours {
    /// Number of the frame, from 1.
    pub frame: u32,
    /// Each pixel at most once.
    pub entries: Vec<Entry>,
}

/// An inferred pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InferredColour {
    /// Linear radiance.
    pub rgb: Rgb,
    /// Frame of the pixel's last known entry up to this frame.
    pub before: u32,
    /// Frame of the pixel's first known entry from this frame on.
    pub after: u32,
    /// Difference of the two entries' distances, as a share of the nearer one; 0 where either is unknown.
    pub distance: f32,
}

impl AgreementRule {
    /// The rule with the epsilons of `settings`.
    pub fn of(settings: &ReuseSettings) -> Self {
        let ReuseSettings { colour_epsilon, distance_epsilon, .. } = *settings;
        Self { colour_epsilon, distance_epsilon }
    }

    /// Whether `a` and `b` agree.
    pub fn agree(&self, a: &Entry, b: &Entry) -> bool {
        let apart = (a.rgb - b.rgb).abs().max_element();
        // What is not finite agrees with nothing, however large the epsilon.
        apart.is_finite() && apart <= self.colour_epsilon && self.distances_agree(a, b)
    }

    fn distances_agree(&self, a: &Entry, b: &Entry) -> bool {
        let (a, b) = (a.distance, b.distance);
        let unknown = a.is_nan() || b.is_nan();
        unknown || a == b || distance_difference(a, b) <= self.distance_epsilon
    }

    /// The colours of the `pixels` pixels of `frame`, inferred from `known` (in any order); `None` where a pixel
    /// must be traced.
    pub fn infer(
        &self,
        known: &[&KnownColours],
        frame: u32,
        pixels: usize,
    ) -> Vec<Option<InferredColour>> {
        let before = nearest(known.iter().filter(|k| k.frame <= frame), frame, pixels);
        let after = nearest(known.iter().filter(|k| k.frame >= frame), frame, pixels);
        let pairs = before.into_iter().zip(after);
        pairs.map(|(before, after)| self.between(before?, after?, frame)).collect()
    }

    fn between(
        &self,
        (before, a): (u32, &Entry),
        (after, b): (u32, &Entry),
        frame: u32,
    ) -> Option<InferredColour> {
        let step = (frame - before) as f32 / (after - before).max(1) as f32;
        // Equal colours stay what they are to the last bit.
        let rgb = a.rgb + (b.rgb - a.rgb) * step;
        // Not a number where a distance is unknown.
        let distance = distance_difference(a.distance, b.distance).max(0.0);
        self.agree(a, b).then_some(InferredColour { rgb, before, after, distance })
    }
}

/// Difference of two distances as a share of the nearer one; infinite where only one hits.
pub fn distance_difference(a: f32, b: f32) -> f32 {
    if a == b { 0.0 } else { (a - b).abs() / a.min(b) }
}

/// For each pixel the entry nearest to `frame` in time, with its frame.
fn nearest<'a>(
    known: impl Iterator<Item = &'a &'a KnownColours>,
    frame: u32,
    pixels: usize,
) -> Vec<Option<(u32, &'a Entry)>> {
    let mut known: Vec<&KnownColours> = known.copied().collect();
    known.sort_by_key(|k| std::cmp::Reverse(k.frame.abs_diff(frame)));
    let mut nearest = vec![None; pixels];
    for (k, entry) in known.iter().flat_map(|k| k.entries.iter().map(move |e| (k.frame, e))) {
        nearest[entry.pixel as usize] = Some((k, entry));
    }
    nearest
}

impl KnownColours {
    /// The entries as bytes: their number, then a record of each in the codec of references. `None`
    /// where there are too many.
    pub fn encode(&self) -> Option<Vec<u8>> {
        columns::size_of(self.entries.len(), WORDS, 0)?;
        let raw = columns::planes(self.entries.len(), WORDS, |i, column| {
            let Entry { pixel, rgb, distance } = self.entries[i];
            [pixel, rgb.x.to_bits(), rgb.y.to_bits(), rgb.z.to_bits(), distance.to_bits()][column]
        });
        Some([&(self.entries.len() as u32).to_le_bytes()[..], &deflated(&raw)?].concat())
    }

    /// Decodes the bytes that [`encode`](Self::encode) made, for frames of `pixels` pixels; `None` for other
    /// bytes.
    pub fn decode(frame: u32, mut bytes: &[u8], pixels: u32) -> Option<Self> {
        let count = columns::take_u32(&mut bytes)?;
        let raw = inflated(bytes, columns::size_of(count, WORDS, 0)?)?;
        let entry = |i: usize| {
            let word = |column| columns::word(&raw, count, i, column);
            let float = |column| f32::from_bits(word(column));
            let pixel = Some(word(0)).filter(|pixel| *pixel < pixels)?;
            Some(Entry { pixel, rgb: Rgb::new(float(1), float(2), float(3)), distance: float(4) })
        };
        Some(Self { frame, entries: (0..count).map(entry).collect::<Option<_>>()? })
    }

    /// Bytes that the entries take in memory.
    pub fn memory(&self) -> u64 {
        size_of_val(&self.entries[..]) as u64
    }
}

impl InferredColour {
    /// The provenance of the pixel in `frame`. A pixel of an uploaded frame is neither traced nor
    /// inferred.
    pub fn provenance(&self, frame: u32) -> Provenance {
        let Self { before, after, distance, .. } = *self;
        if before == frame {
            return Provenance::default();
        }
        let nearer = if frame - before <= after - frame { before } else { after };
        Provenance { kind: ProvenanceKind::Both, frame: nearer, distance }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RULE: AgreementRule = AgreementRule { colour_epsilon: 0.1, distance_epsilon: 0.25 };

    fn known(frame: u32, pixels: &[(u32, f32, f32)]) -> KnownColours {
        let entry = |&(pixel, grey, distance)| Entry { pixel, rgb: Rgb::splat(grey), distance };
        KnownColours { frame, entries: pixels.iter().map(entry).collect() }
    }

    /// The value of frame 3 at pixel 0, which is known in frames 1 and 5.
    fn middle(rule: AgreementRule, a: (f32, f32), b: (f32, f32)) -> Option<f32> {
        let (a, b) = (known(1, &[(0, a.0, a.1)]), known(5, &[(0, b.0, b.1)]));
        rule.infer(&[&a, &b], 3, 1)[0].map(|i| i.rgb.x)
    }

    #[test]
    fn colours_and_distances_must_agree_both() {
        assert_eq!(middle(RULE, (0.5, 4.0), (0.5625, 5.0)), Some(0.53125));
        assert_eq!(middle(RULE, (0.5, 4.0), (0.61, 4.0)), None);
        assert_eq!(middle(RULE, (0.5, 4.0), (0.5, 5.1)), None);
        assert_eq!(middle(RULE, (0.5, 5.1), (0.5, 4.0)), None);
    }

    #[test]
    fn one_channel_is_enough_to_disagree() {
        let entry = |rgb| Entry { pixel: 0, rgb, distance: 1.0 };
        let (grey, bluish) = (Rgb::splat(0.5), Rgb::new(0.5, 0.5, 0.7));
        assert!(!RULE.agree(&entry(grey), &entry(bluish)));
    }

    #[test]
    fn the_sky_agrees_with_itself_only_and_the_unknown_with_all() {
        let (sky, unknown) = (f32::INFINITY, f32::NAN);
        assert!(middle(RULE, (0.5, sky), (0.5, sky)).is_some());
        assert!(middle(RULE, (0.5, sky), (0.5, 4.0)).is_none());
        for distance in [sky, unknown, 4.0] {
            assert!(middle(RULE, (0.5, unknown), (0.5, distance)).is_some());
            assert!(middle(RULE, (0.5, unknown), (0.7, distance)).is_none());
        }
    }

    #[test]
    fn no_epsilon_asks_for_equality_and_an_infinite_one_for_finite_numbers() {
        let none = AgreementRule { colour_epsilon: 0.0, distance_epsilon: 0.0 };
        assert_eq!(middle(none, (0.3, 4.0), (0.3, 4.0)), Some(0.3));
        assert_eq!(middle(none, (0.3, 4.0), (0.300_001, 4.0)), None);
        assert_eq!(middle(none, (0.3, 4.0), (0.3, 4.000_001)), None);
        let all = AgreementRule { colour_epsilon: f32::INFINITY, distance_epsilon: f32::INFINITY };
        assert_eq!(middle(all, (0.0, 4.0), (9.0, f32::INFINITY)), Some(4.5));
        for odd in [f32::NAN, f32::INFINITY] {
            assert_eq!(middle(all, (odd, 4.0), (0.0, 4.0)), None);
            assert_eq!(middle(all, (odd, 4.0), (odd, 4.0)), None);
        }
    }

    #[test]
    fn the_nearest_entries_count_whatever_their_order() {
        // Frame 4 knows pixel 1 only; pixel 2 is known on one side only.
        let frames = [
            known(1, &[(0, 0.0, 1.0), (1, 0.0, 1.0), (2, 0.0, 1.0)]),
            known(4, &[(1, 1.0, 1.0)]),
            known(9, &[(0, 0.08, 1.0), (1, 1.04, 1.0)]),
        ];
        for order in [[0, 1, 2], [2, 1, 0], [1, 2, 0]] {
            let list = order.map(|i| &frames[i]);
            let found = RULE.infer(&list, 5, 3);
            let at = |i: usize| found[i].map(|f| (f.rgb.x, f.before, f.after));
            assert_eq!(at(0), Some((0.04, 1, 9)));
            assert_eq!(at(1).map(|f| (f.1, f.2)), Some((4, 9)));
            assert!((at(1).expect("inferred").0 - 1.008).abs() < 1e-6);
            assert_eq!(at(2), None);
        }
    }

    #[test]
    fn a_known_frame_keeps_its_own_colours() {
        let frames = [known(1, &[(0, 0.0, 1.0)]), known(2, &[(0, 9.0, f32::NAN)])];
        let found = RULE.infer(&[&frames[0], &frames[1]], 2, 1)[0].expect("known");
        assert_eq!((found.rgb.x, found.provenance(2)), (9.0, Provenance::default()));
    }

    #[test]
    fn entries_are_decoded_as_encoded_and_other_bytes_are_refused() {
        let colours = known(3, &[(0, 0.5, 1.0), (7, -0.0, f32::INFINITY)]);
        let bytes = colours.encode().expect("few");
        assert_eq!(KnownColours::decode(3, &bytes, 8), Some(colours));
        assert_eq!(KnownColours::decode(3, &bytes, 7), None);
        assert!((0..bytes.len()).all(|i| KnownColours::decode(3, &bytes[..i], 8).is_none()));
        let many = [&[0xff; 4], &bytes[4..]].concat();
        assert_eq!(KnownColours::decode(3, &many, 8), None);
    }

    #[test]
    fn the_nearer_frame_is_named() {
        let inferred = InferredColour { rgb: Rgb::ZERO, before: 1, after: 9, distance: 0.0 };
        let source = |frame| inferred.provenance(frame);
        assert_eq!((source(3).frame, source(7).frame), (1, 9));
        assert_eq!(source(3).kind, ProvenanceKind::Both);
    }
}
