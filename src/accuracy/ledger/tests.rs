use super::*;
use crate::math::Rgb;
use std::io::Write;

fn terms(size: &str) -> Map<String, Value> {
    Map::from_iter([("size".to_string(), Value::from(size)), ("spp".to_string(), Value::from(4))])
}

fn entry(turn: u32, candidate: usize) -> TrialRecord {
    let errors = Errors {
        mse: 0.0,
        rmse_steps: 0.0,
        psnr: f64::INFINITY,
        ssim: 1.0,
        flip: 0.0,
        share_over_2: 0.0,
        flicker: None,
    };
    TrialRecord { turn, candidate, seconds: 0.1, errors: errors.into(), ..TrialRecord::default() }
}

#[test]
fn measured_rows_come_back_and_a_torn_line_does_not() {
    let folder = tempfile::tempdir().expect("a folder");
    let open = || Ledger::open(folder.path(), &terms("8x8"), false).expect("opens");
    let mut first = open();
    first.append(entry(0, 0)).and_then(|()| first.append(entry(0, 1))).expect("written");
    let trials = folder.path().join("trials.jsonl");
    let torn = &std::fs::read(&trials).expect("there")[..70];
    let mut file = std::fs::OpenOptions::new().append(true).open(&trials).expect("opens");
    file.write_all(torn).expect("written");

    let mut second = open();
    assert_eq!(second.entries().len(), 2);
    assert!(second.has(0, 1) && !second.has(1, 0));
    second.append(entry(1, 0)).expect("written");
    let third = open();
    let runs: Vec<u32> = third.entries().iter().map(|entry| entry.run).collect();
    assert_eq!((runs, third.runs()), (vec![1, 1, 2], 2));
    let errors = Errors::from(third.entries()[0].errors);
    assert!(errors.psnr.is_infinite() && errors.ssim == 1.0);
}

#[test]
fn other_settings_are_refused_and_measured_anew_when_that_is_asked_for() {
    let folder = tempfile::tempdir().expect("a folder");
    let open = |size, anew| Ledger::open(folder.path(), &terms(size), anew);
    open("8x8", false).and_then(|mut l| l.append(entry(0, 0))).expect("written");
    std::fs::write(folder.path().join("mine.txt"), "kept").expect("written");
    let refused = open("9x9", false).err().expect("refused").to_string();
    assert!(refused.contains("size was 8x8, now it is 9x9"), "{refused}");
    assert!(open("9x9", true).expect("anew").entries().is_empty());
    assert!(folder.path().join("mine.txt").exists());
    assert!(open("9x9", false).is_ok());
}

#[test]
fn the_reference_comes_back_bit_for_bit_and_only_the_last_is_kept() {
    let folder = tempfile::tempdir().expect("a folder");
    let ledger = Ledger::open(folder.path(), &terms("8x8"), false).expect("opens");
    assert!(ledger.reference().is_none());
    for number in 0..2 {
        let value = |i: u32| Rgb::new(0.1, (i as f32).sqrt(), 1.0 + number as f32);
        let rgb = (0..6).map(value).collect();
        let image = Image { width: 3, height: 2, rgb, encoding: Encoding::Srgb };
        let frames = Frames::from([(1, image.clone()), (8, image)]);
        let change = (number > 0).then_some(0.25);
        let doubling = Doubling { number, spp: 32 << number, change, frames };
        ledger.keep_reference(&doubling, 0.1).expect("written");
        let (back, wanted) = ledger.reference().expect("there");
        assert_eq!(
            (back.number, back.spp, back.change, wanted),
            (number, 32 << number, change, 0.1)
        );
        assert!(back.frames == doubling.frames, "{number}");
    }
    let exr = std::fs::read_dir(folder.path()).expect("a folder").flatten();
    let exr = exr.filter(|e| e.path().extension().is_some_and(|end| end == "exr")).count();
    assert_eq!(exr, 2);
}
