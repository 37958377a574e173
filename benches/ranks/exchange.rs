//! How many discoveries a message should carry.

use crate::real::{Line, Stage};
use crate::{median, spread};
use tweenray::scene::limits::MAX_EXCHANGE;

/// The last is all that a frame left.
const MOST: [u32; 6] = [100, 1_000, 10_000, 100_000, 1_000_000, MAX_EXCHANGE];
const RANKS: u32 = 4;

pub fn report(turns: usize) {
    for (policy, kind) in [("surface", "references"), ("colour", "discoveries")] {
        let words = format!("--size 640x360 --spp 4 --segment 4 --policy {policy}");
        println!(
            "33 frames of reflective_spheres, {words}, {RANKS} ranks of one thread; ratios to all in one"
        );
        println!("  most discoveries  messages       MB   wall                     core seconds");
        let stage = Stage::of("reflective_spheres");
        let line = |most: u32| {
            let words = format!("{words} --exchange {most}");
            Line { ranks: RANKS, threads: 1, frames: 33, words }
        };
        let mut took = vec![Vec::new(); MOST.len()];
        let mut sent = vec![(0, 0); MOST.len()];
        let mut frames = Vec::new();
        for _ in 0..turns {
            for (i, most) in MOST.into_iter().enumerate() {
                let ran = stage.run(&line(most));
                took[i].push((ran.wall(), ran.cpu));
                sent[i] = ran.sent(kind);
                frames.push(stage.frames());
            }
        }
        assert!(frames.iter().all(|other| *other == frames[0]), "bytes differ");
        for (i, most) in MOST.into_iter().enumerate() {
            let ratios = |of: fn(&(f64, f64)) -> f64| -> Vec<f64> {
                took[i].iter().zip(&took[MOST.len() - 1]).map(|(a, b)| of(a) / of(b)).collect()
            };
            let most = if most == MAX_EXCHANGE { "all".into() } else { most.to_string() };
            let (messages, bytes) = sent[i];
            let (wall, core) = (spread(&ratios(|t| t.0)), spread(&ratios(|t| t.1)));
            println!("  {most:>16}  {messages:8}  {:7.1}   {wall:22}   {core}", bytes as f64 / 1e6);
        }
        let all = took.last().unwrap();
        let (wall, core) = (median(all.iter().map(|t| t.0)), median(all.iter().map(|t| t.1)));
        println!(
            "  all in one: {wall:.2} s, {core:.2} s of a core, start included; no byte differed"
        );
    }
}
