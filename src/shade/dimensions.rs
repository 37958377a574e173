//! The one table of random dimensions.
//!
//! A pair of random numbers is a function of seed, frame, pixel, sample and dimension
//! ([`PixelSampler`](crate::sampling::PixelSampler)). Two uses of one pixel's sampler never share a dimension.

use crate::sampling::mix;

/// The place of a camera sample in its pixel. This, [`LENS`] and [`of_lobe`] are of the pixel's own sampler: paths do
/// not depend on the frame, so that reuse compares the same surface points. Lights' are of the frame's sampler.
pub(super) const FILM: u32 = 0;

/// Where a camera sample passes the lens.
pub(super) const LENS: u32 = 1;

/// The branch of a path that a camera ray is.
pub(super) const ROOT: u32 = 1;

/// The branch that the `child`th direction, 0 to 2, of all lobes leads to from the end of `branch`. Branches of a tree 31 deep,
/// or 20 where there are third directions, which have numbers of their own, have different numbers; those from number 2^31 on have random
/// ones, lest a path meets the same random number at each further bounce.
pub(super) fn branch(branch: u32, child: u32) -> u32 {
    const DEEP: u32 = 1 << 31;
    let number = match child {
        2 => 1 << 20,
        _ => child,
    };
    if branch < DEEP {
        branch.wrapping_mul(2).wrapping_add(number)
    } else {
        mix(u64::from(branch) << 2 | u64::from(child)) as u32 | DEEP
    }
}

/// The direction that a lobe at the end of a branch is sampled in, of which the first is the `child`th of all: counted from
/// above, where no light's are, those of a second lobe from the middle.
pub(super) fn of_lobe(branch: u32, child: u32) -> u32 {
    (u32::MAX >> child).wrapping_sub(branch)
}

/// A light as seen from the end of a branch of a path: `light` is its number among the scene's `lights`, the
/// sky last.
pub(super) fn of_light(branch: u32, light: u32, lights: usize) -> u32 {
    branch.wrapping_mul(lights as u32 + 1).wrapping_add(light)
}

/// What lights are chosen from the tail, and where on them samples lie, stand beside the lights where lights are
/// selected: as further `lights` of [`of_light`].
pub(super) const TAIL: usize = 2;

/// In fog, where light is scattered along the ray of a branch and where samples lie on each of so many `lights` and the sky
/// are drawn: so many further `lights` of [`of_light`].
pub(super) fn of_fog(lights: usize) -> usize {
    2 * (lights + 1)
}

/// The light that a sample chooses, and the place on it, of `lights`, the last two of which are the [`TAIL`].
pub(super) fn of_tail(branch: u32, lights: usize) -> [u32; 2] {
    // The sky's number, and those of fog, come before.
    [lights as u32 - 1, lights as u32].map(|number| of_light(branch, number, lights))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn deep_paths_do_not_meet_the_same_numbers_again() {
        for child in [0, 1, 2] {
            let mut branches = BTreeSet::new();
            let mut deepest = ROOT;
            for _ in 0..1024 {
                deepest = branch(deepest, child);
                assert!(branches.insert(deepest), "{} deep", branches.len());
            }
        }
    }
}
