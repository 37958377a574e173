//! Which frames a frame is inferred from.
//!
//! The shot is cut into segments of a fixed number of frames, whose ends are key frames. Inside,
//! the middle frame is inferred from both ends, then the quarters from these three, and so on. So
//! a frame depends on its segment's ends and a handful of frames between, whichever rank renders it and
//! whichever other frames are rendered.

/// The segments of a shot, and which of its frames are inferred from which.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pyramid {
    /// Frames from one key frame to the next.
    pub segment: u32,
    /// Frames of the shot.
    pub frames: u32,
}

impl Pyramid {
    /// One segment of a whole shot of `frames` frames.
    pub fn whole(frames: u32) -> Self {
        Self { segment: frames.saturating_sub(1).max(1), frames }
    }

    /// Whether `frame` is a key frame: a segment's end, or the shot's.
    pub fn is_key(&self, frame: u32) -> bool {
        (frame - 1) % self.segment == 0 || frame == self.frames
    }

    /// Number of the segment of `frame`, from 0; a key frame belongs to the segment that it ends, whose
    /// frames need it first.
    pub fn segment_of(&self, frame: u32) -> u32 {
        frame.saturating_sub(2) / self.segment
    }

    /// First and last frame of the segment that `frame`, which is no key frame, lies in.
    fn ends(&self, frame: u32) -> (u32, u32) {
        let first = self.segment_of(frame) * self.segment + 1;
        (first, first.saturating_add(self.segment).min(self.frames))
    }

    /// The frames that `frame` is inferred from: the segment's ends, then the frames between, the
    /// nearest first. None for a key frame.
    pub fn ancestors(&self, frame: u32) -> Vec<u32> {
        if self.is_key(frame) {
            return Vec::new();
        }
        let (mut low, mut high) = self.ends(frame);
        let mut all = vec![low, high];
        loop {
            let middle = middle(low, high);
            if middle == frame {
                break;
            }
            all.push(middle);
            if frame < middle { high = middle } else { low = middle }
        }
        all[2..].sort_by_key(|other| (other.abs_diff(frame), *other));
        all
    }

    /// `frames` in the order that needs the fewest references at a time: segment by segment, each
    /// frame after its ancestors.
    pub fn order(&self, frames: &[u32]) -> Vec<u32> {
        let mut ordered = frames.to_vec();
        let place =
            |frame: &u32| (self.segment_of(*frame), !self.is_key(*frame), self.place(*frame));
        ordered.sort_by_cached_key(place);
        ordered
    }

    /// Sort key of a frame in its segment: frames sorted by it come after the frames that they need.
    fn place(&self, frame: u32) -> Vec<bool> {
        if self.is_key(frame) {
            return Vec::new();
        }
        let (mut low, mut high) = self.ends(frame);
        let mut turns = Vec::new();
        loop {
            let middle = middle(low, high);
            if middle == frame {
                return turns;
            }
            turns.push(frame > middle);
            if frame < middle { high = middle } else { low = middle }
        }
    }

    /// All frames, each after its ancestors and as early as a frame of its segment needs it.
    pub fn by_need(&self) -> Vec<u32> {
        let mut frames = Vec::with_capacity(self.frames as usize);
        let mut low = 1;
        if self.frames > 0 {
            frames.push(low);
        }
        while low < self.frames {
            let high = low.saturating_add(self.segment).min(self.frames);
            frames.push(high);
            between(low, high, &mut frames);
            low = high;
        }
        frames
    }

    /// Number of key frames.
    pub fn keys(&self) -> u32 {
        self.frames.saturating_sub(1).div_ceil(self.segment) + self.frames.min(1)
    }

    /// `frames`, cut into lists that share no in-between references, each in order.
    pub fn batches(&self, frames: &[u32]) -> Vec<Vec<u32>> {
        let ordered = self.order(frames);
        let segments = ordered.chunk_by(|a, b| self.segment_of(*a) == self.segment_of(*b));
        segments.map(<[u32]>::to_vec).collect()
    }

    /// Like [`batches`](Self::batches), but a key frame is the first of the list of the segment that it starts. So
    /// if each list is made by another rank, no rank waits for a frame that another makes last.
    pub fn rank_batches(&self, frames: &[u32]) -> Vec<Vec<u32>> {
        let started = |frame: &u32| (frame - 1) / self.segment;
        let mut ordered = self.order(frames);
        ordered.sort_by_key(|frame| (started(frame), !self.is_key(*frame)));
        ordered.chunk_by(|a, b| started(a) == started(b)).map(<[u32]>::to_vec).collect()
    }
}

/// Appends the frames between `low` and `high` to `frames`, each after its ancestors.
fn between(low: u32, high: u32, frames: &mut Vec<u32>) {
    if high - low > 1 {
        let middle = middle(low, high);
        frames.push(middle);
        between(low, middle, frames);
        between(middle, high, frames);
    }
}

fn middle(low: u32, high: u32) -> u32 {
    low + (high - low) / 2
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn the_textbook_order_of_nine_frames() {
        let pyramid = Pyramid { segment: 8, frames: 9 };
        assert_eq!(pyramid.order(&(1..=9).collect::<Vec<_>>()), [1, 9, 5, 3, 2, 4, 7, 6, 8]);
        assert_eq!(pyramid.ancestors(4), [1, 9, 3, 5]);
        assert_eq!(pyramid.ancestors(5), [1, 9]);
        assert!(pyramid.ancestors(9).is_empty());
    }

    #[test]
    fn every_frame_comes_after_its_ancestors_in_its_segment() {
        for (segment, frames) in [(1, 5), (2, 9), (8, 9), (32, 100), (64, 64), (64, 65), (7, 30)] {
            let pyramid = Pyramid { segment, frames };
            let all: Vec<u32> = (1..=frames).collect();
            let longest = segment.min(frames - 1);
            let depth = if longest < 2 { 0 } else { 1 + longest.next_power_of_two().ilog2() };
            let order = pyramid.order(&all);
            assert_eq!(order.iter().collect::<BTreeSet<_>>().len(), frames as usize);
            let place = |frame| order.iter().position(|f| *f == frame);
            for frame in 1..=frames {
                let ancestors = pyramid.ancestors(frame);
                assert!(ancestors.len() <= depth as usize, "{pyramid:?} {frame}");
                for other in ancestors {
                    assert!(place(other) < place(frame));
                    let further = pyramid.ancestors(other);
                    let known = pyramid.ancestors(frame);
                    assert!(further.iter().all(|f| known.contains(f)), "{frame} by {other}");
                }
            }
        }
    }

    #[test]
    fn by_need_every_frame_comes_once_after_all_its_ancestors() {
        for (segment, frames) in [(8, 9), (8, 20), (1, 5), (64, 3), (7, 1), (4, 0)] {
            let pyramid = Pyramid { segment, frames };
            let order = pyramid.by_need();
            assert_eq!(order.iter().collect::<BTreeSet<_>>().len(), frames as usize);
            assert_eq!(order.len(), frames as usize);
            let place = |frame| order.iter().position(|f| *f == frame);
            for frame in 1..=frames {
                assert!(pyramid.ancestors(frame).iter().all(|f| place(*f) < place(frame)));
            }
            let keys = (1..=frames).filter(|f| pyramid.is_key(*f)).count();
            assert_eq!(pyramid.keys() as usize, keys, "{pyramid:?}");
        }
        let longer = Pyramid { segment: 8, frames: 50 }.by_need();
        assert_eq!(Pyramid { segment: 8, frames: 25 }.by_need(), longer[..25]);
    }

    #[test]
    fn a_longer_shot_changes_no_whole_segment() {
        let (short, long) =
            (Pyramid { segment: 8, frames: 20 }, Pyramid { segment: 8, frames: 50 });
        for frame in 1..=17 {
            assert_eq!(short.ancestors(frame), long.ancestors(frame));
        }
    }

    #[test]
    fn batches_hold_every_frame_once() {
        let pyramid = Pyramid { segment: 4, frames: 11 };
        let batches = pyramid.batches(&[2, 3, 7, 11, 5]);
        assert_eq!(batches, [vec![5, 3, 2], vec![7], vec![11]]);
        let batches = pyramid.rank_batches(&[2, 3, 7, 11, 5]);
        assert_eq!(batches, [vec![3, 2], vec![5, 7], vec![11]]);
    }
}
