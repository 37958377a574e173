//! Mixing bits.

/// A bijection that mixes all 64 bits (SplitMix64's finaliser: Stafford, 2011; Steele et al., 2014).
pub fn mix(v: u64) -> u64 {
    let mut v = v.wrapping_add(0x9e37_79b9_7f4a_7c15);
    v = (v ^ (v >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    v = (v ^ (v >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    v ^ (v >> 31)
}
