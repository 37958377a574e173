//! Adaptive camera samples where they are hard: four pilot samples of a pixel hit fine textures, thin bars, the outlines of
//! cut-outs, discs of confusion and small highlights only by chance. With as many rays, uniform samples are never nearer to
//! the truth.

#![allow(clippy::print_stdout, reason = "shows what it measured")]

#[path = "common/hard_samples.rs"]
mod hard_samples;
#[path = "common/moves.rs"]
mod moves;

use hard_samples::{BARS, CUT_OUTS, Case, DEFOCUS, HIGHLIGHTS, TEXTURES, gains};

fn assert_never_worse(case: &Case) {
    let gain = gains(case, (96, 54), &[8], &(0..6), &[(4, 16)])[0];
    println!("{}: {gain:.2} dB", case.name);
    assert!(gain > 0.0, "{}: {gain:.2} dB", case.name);
}

#[test]
fn fine_textures_are_found() {
    assert_never_worse(&TEXTURES);
}

#[test]
fn bars_thinner_than_a_pixel_are_found() {
    assert_never_worse(&BARS);
}

#[test]
fn outlines_of_cut_outs_are_found() {
    assert_never_worse(&CUT_OUTS);
}

#[test]
fn what_is_out_of_focus_is_found() {
    assert_never_worse(&DEFOCUS);
}

#[test]
fn highlights_of_rough_mirrors_are_found() {
    assert_never_worse(&HIGHLIGHTS);
}
