//! Which frames of a move are rendered in a trial, and how key frames and in-between frames weigh.

use crate::scene::{Policy, Settings};
use crate::sequence::Pyramid;
use std::collections::BTreeSet;

/// The frames of a move of `count` frames that a sweep renders: pairs of neighbours, so that flicker
/// shows, at the start, the middle and the end; all frames of a short move. The first and the last frame
/// of a move are always traced whole.
pub fn chosen_frames(count: u32) -> Vec<u32> {
    if count <= 6 {
        return (1..=count).collect();
    }
    let middle = 1 + (count - 2) / 2;
    vec![1, 2, middle, middle + 1, count - 1, count]
}

/// The frames that are rendered where only times are wanted: the first, and two neighbours.
pub(super) fn timed_frames(count: u32) -> Vec<u32> {
    if count <= 4 {
        return (1..=count).collect();
    }
    let third = (count / 3).max(2);
    vec![1, third, third + 1]
}

/// How a setting divides a move into key frames, which are traced whole, and in-between frames.
#[derive(Debug, Clone, Copy)]
pub struct Cut {
    /// `None` where every frame is traced whole.
    pyramid: Option<Pyramid>,
    /// By its key frames the frames are weighed. Where every frame is traced whole it is that of the settings' segment,
    /// so that frames weigh alike under policies surface and off.
    weighed: Pyramid,
}

impl Cut {
    /// The division of a move of `frames` frames under `settings`. `looks_up` says whether frames look up
    /// any light in others.
    pub fn of(settings: &Settings, frames: u32, looks_up: bool) -> Self {
        let segment = match settings.reuse.policy {
            Policy::Off => None,
            Policy::Surface => looks_up.then_some(settings.reuse.segment),
            Policy::Colour => Some((frames - 1).max(1)),
        };
        let pyramid = |segment| Pyramid { segment, frames };
        let weighed = pyramid(segment.unwrap_or(settings.reuse.segment));
        Self { pyramid: segment.map(pyramid), weighed }
    }

    /// Number of key frames of the move.
    pub fn keys(&self) -> u32 {
        self.pyramid.map_or(self.weighed.frames, |pyramid| pyramid.keys())
    }

    /// `frames` with all frames that they are inferred from.
    pub fn with_ancestors(&self, frames: &[u32]) -> Vec<u32> {
        let ancestors = |f: &u32| self.pyramid.map_or(Vec::new(), |pyramid| pyramid.ancestors(*f));
        let mut all: BTreeSet<u32> = frames.iter().flat_map(ancestors).collect();
        all.extend(frames);
        all.into_iter().collect()
    }

    /// The mean over the move of values measured on some frames, by number: the means over key frames and
    /// over in-between frames, weighed by how many the move has. A kind without a value is left out. Frames weigh alike
    /// under policies surface and off: an error that differs from frame to frame must not seem to differ between them.
    pub fn mean(&self, measured: impl Iterator<Item = (u32, f64)>) -> f64 {
        let mut sums = [(0.0, 0.0); 2];
        for (frame, value) in measured {
            let (sum, count) = &mut sums[usize::from(self.weighed.is_key(frame))];
            *sum += value;
            *count += 1.0;
        }
        let Pyramid { frames, .. } = self.weighed;
        let keys = self.weighed.keys();
        let weights = [f64::from(frames - keys), f64::from(keys)];
        let kinds = || sums.iter().zip(weights).filter(|((_, count), _)| *count > 0.0);
        let total: f64 = kinds().map(|((sum, count), weight)| weight * sum / count).sum();
        total / kinds().map(|(_, weight)| weight).sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chosen_frames_are_neighbours_from_the_first_to_the_last() {
        assert_eq!(chosen_frames(3), [1, 2, 3]);
        assert_eq!(chosen_frames(7), [1, 2, 3, 4, 6, 7]);
        assert_eq!(chosen_frames(24), [1, 2, 12, 13, 23, 24]);
        assert_eq!(timed_frames(24), [1, 8, 9]);
        for count in 1..200 {
            let frames = chosen_frames(count);
            let rises = |frames: &[u32]| frames.windows(2).all(|w| w[0] < w[1]);
            assert!(frames[0] == 1 && frames.last() == Some(&count), "{count}: {frames:?}");
            assert!(rises(&frames), "{count}: {frames:?}");
            let has = |frame: u32| frames.contains(&frame);
            let follows = |f: &u32| has(f + 1) || (*f > 1 && has(f - 1));
            assert!(count == 1 || frames.iter().all(follows), "{count}: {frames:?}");
            // The gaps between pairs are alike.
            let gaps: Vec<u32> =
                frames.windows(2).map(|w| w[1] - w[0]).filter(|g| *g > 1).collect();
            assert!(gaps.iter().all(|gap| gap.abs_diff(gaps[0]) <= 1), "{count}: {frames:?}");
            let timed = timed_frames(count);
            assert!(timed[0] == 1 && rises(&timed) && timed.iter().all(|f| *f <= count));
        }
    }

    #[test]
    fn key_frames_weigh_by_their_number() {
        let settings = Settings::default();
        let cut = Cut::of(&settings, 65, true);
        // Two key frames of 65.
        let mean = cut.mean([(1, 10.0), (2, 1.0), (3, 3.0)].into_iter());
        assert!((mean - (2.0 * 10.0 + 63.0 * 2.0) / 65.0).abs() < 1e-12);
        assert_eq!(cut.mean([(2, 1.0)].into_iter()), 1.0);
        assert_eq!(cut.with_ancestors(&[1, 17]), [1, 17, 33, 65]);
        let off = Cut::of(&settings, 65, false);
        // The same frames weigh alike where all are traced.
        assert_eq!(off.mean([(1, 1.0), (2, 3.0)].into_iter()), (2.0 + 63.0 * 3.0) / 65.0);
        assert_eq!(off.with_ancestors(&[17]), [17]);
    }
}
