//! The lights whose ratios samples have, where lights are selected. Samples of one cell have the same, so that
//! each list is kept once.

use crate::inference::channel_of;
use std::collections::HashMap;

/// The light of each channel of each sample.
#[derive(Debug, Clone, Default)]
pub(super) struct LightLists {
    channels: usize,
    /// The lists, one after another.
    lists: Vec<u32>,
    /// For each sample where its list begins; empty where each channel has the same light everywhere.
    of_sample: Vec<u32>,
}

impl LightLists {
    /// The lists of samples that are points in this `order`; `lights` has those of all points.
    pub fn of(lights: &[u32], order: &[u32], channels: usize) -> Self {
        let mut own = Self { channels, ..Self::default() };
        if lights.is_empty() {
            return own;
        }
        let mut known: HashMap<&[u32], u32> = HashMap::new();
        for point in order {
            let list = &lights[*point as usize * channels..][..channels];
            let next = own.lists.len() as u32;
            let at = *known.entry(list).or_insert(next);
            if at == next {
                own.lists.extend(list);
            }
            own.of_sample.push(at);
        }
        own
    }

    /// Index of the light `asked[k]` in the list of lights of `sample`; `None` if the sample has no ratio of that
    /// light. Where `asked` is empty all points have the same lights, so it is `k`.
    #[inline]
    pub fn channel(&self, sample: u32, asked: &[u32], k: usize) -> Option<usize> {
        if asked.is_empty() {
            return Some(k);
        }
        let first = *self.of_sample.get(sample as usize)? as usize;
        channel_of(&self.lists[first..][..self.channels], asked, k)
    }

    /// Memory, bytes.
    pub fn memory(&self) -> u64 {
        (size_of_val(&self.lists[..]) + size_of_val(&self.of_sample[..])) as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inference::NO_LIGHT;

    #[test]
    fn equal_lists_are_kept_once_and_lights_are_found_in_them() {
        let lights = [5, 9, 9, 7, 5, 9, 3, NO_LIGHT];
        let lists = LightLists::of(&lights, &[2, 1, 0, 3], 2);
        assert_eq!(lists.memory(), 6 * 4 + 4 * 4);
        // Samples are points 2, 1, 0 and 3.
        let found = |sample, light| lists.channel(sample, &[light, NO_LIGHT], 0);
        assert_eq!([0, 1, 2, 3].map(|s| found(s, 9)), [Some(1), Some(0), Some(1), None]);
        assert_eq!(lists.channel(3, &[3, NO_LIGHT], 1), None);
    }
}
