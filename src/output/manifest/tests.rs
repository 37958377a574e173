//! Jobs that meet in one folder.

use super::*;
use std::sync::atomic::{AtomicU32, Ordering};

fn header(seed: u32) -> Header {
    let settings = serde_json::json!({ "seed": seed });
    Header { manifest: FORMAT, settings, ..Header::default() }
}

fn row(frame: u32) -> Row {
    let line = format!(
        "{{\"frame\":{frame},\"file\":\"f\",\"view\":\"v\",\"recipe\":\"r\",\"blake3\":\"b\",\"bytes\":1,\
         \"seconds\":1.0,\"rays\":{}}}",
        serde_json::to_string(&RayCounts::default()).expect("JSON")
    );
    serde_json::from_str(&line).expect("a row")
}

fn frames(path: &Path) -> Vec<u32> {
    let manifest = Manifest::read(path).expect("readable").expect("there");
    manifest.rows.into_keys().collect()
}

fn names(folder: &Path) -> usize {
    fs::read_dir(folder).expect("a folder").count()
}

#[test]
fn rows_appended_after_their_part_was_merged_are_not_lost() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("f.manifest.jsonl");
    Manifest::create(&path, &header(0), &[]).expect("created");
    let part = part_path(&path, &header(0), 3);
    let mut journal = Journal::open(&part).expect("opened");
    journal.append(&row(1)).expect("written");
    Manifest::merge_parts(&path, &header(0)).expect("merged");
    assert!(!part.exists());
    journal.append(&row(2)).expect("written");
    let now = Manifest::as_of_now(&path).expect("read").expect("there");
    assert!(now.rows.into_keys().eq([1, 2]));
    Manifest::merge_parts(&path, &header(0)).expect("merged");
    assert_eq!((frames(&path), names(folder.path())), (vec![1, 2], 1));
}

#[test]
fn rows_are_never_written_under_another_header() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("f.manifest.jsonl");
    Manifest::create(&path, &header(0), &[]).expect("created");
    let mut own = Journal::of(&path, &header(0)).expect("opened");
    let mut part = Journal::open(&part_path(&path, &header(0), 1)).expect("opened");
    own.append(&row(1)).expect("written");
    Manifest::create(&path, &header(7), &[]).expect("replaced");
    let error = own.append(&row(2)).expect_err("refused").to_string();
    assert!(error.contains("seed is 7 there, 0 here"), "{error}");
    part.append(&row(3)).expect("written");
    Manifest::merge_parts(&path, &header(7)).expect("merged");
    assert!(frames(&path).is_empty());
    let now = Manifest::as_of_now(&path).expect("read").expect("there");
    assert!(now.rows.is_empty());
}

#[test]
fn another_file_format_is_named_first_and_a_missing_setting_is_not_set() {
    let png = Header { files: "f_####.png".into(), ..header(0) };
    let settings = serde_json::json!({ "seed": 0, "reuse": { "maps": false } });
    let exr = Header { files: "f_####.exr".into(), settings, ..header(0) };
    let told = |before: &Header, now: &Header| {
        before.first_difference(now).expect("they differ").was_and_is()
    };
    assert_eq!(told(&png, &exr), "file format was png, now it is exr");
    let other = Header { files: "f_####.png".into(), ..exr };
    assert_eq!(told(&png, &other), "maps was not set, now it is false");
}

#[test]
fn ranges_of_samples_are_named_as_on_the_command_line() {
    let of = |settings| Header { settings, ..header(0) };
    let one = of(serde_json::json!({ "spp": 4, "shadow_samples": 16 }));
    let range = of(serde_json::json!({ "spp": 4, "most_spp": 8, "shadow_samples": 16,
        "least_shadow_samples": 2 }));
    let told = |before: &Header, now: &Header| {
        before.first_difference(now).expect("they differ").was_and_is()
    };
    let both = told(&one, &range);
    let light = told(
        &one,
        &of(serde_json::json!({ "spp": 4, "shadow_samples": 16,
        "least_shadow_samples": 2 })),
    );
    assert_eq!(light, "shadow-samples was 16, now it is 2..16");
    assert!(["spp was 4, now it is 4..8", &light].contains(&&*both), "{both}");
    let null = of(serde_json::json!({ "spp": 4, "most_spp": null, "shadow_samples": 16 }));
    assert_eq!(one.first_difference(&null), None);
}

#[test]
fn an_incomplete_line_affects_no_other() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("f.manifest.jsonl");
    Manifest::create(&path, &header(0), &[row(1)]).expect("created");
    let mut text = fs::read_to_string(&path).expect("text");
    text += "{\"frame\":2,";
    fs::write(&path, text).expect("torn");
    Journal::of(&path, &header(0)).expect("opened").append(&row(3)).expect("written");
    assert_eq!(frames(&path), [1, 3]);
}

/// Four ranks append as fast as they can, rank 0 to the manifest, while others take in, rewrite and survey.
#[test]
fn no_order_of_events_loses_a_row() {
    const ROWS: u32 = 150;
    let folder = tempfile::tempdir().expect("a folder");
    let path = &folder.path().join("f.manifest.jsonl");
    Manifest::create(path, &header(0), &[]).expect("created");
    let running = &AtomicU32::new(4);
    std::thread::scope(|scope| {
        for rank in 0..4 {
            scope.spawn(move || {
                let header = header(0);
                let mut journal = match rank {
                    0 => Journal::of(path, &header),
                    rank => Journal::open(&part_path(path, &header, rank)),
                }
                .expect("opened");
                for n in 1..=ROWS {
                    journal.append(&row(rank * ROWS + n)).expect("written");
                }
                running.fetch_sub(1, Ordering::Relaxed);
            });
        }
        for number in 0..3 {
            scope.spawn(move || {
                while running.load(Ordering::Relaxed) > 0 {
                    match number {
                        2 => Manifest::rewrite(path, |found| {
                            (found.header, found.rows.into_values().collect())
                        }),
                        _ => Manifest::merge_parts(path, &header(0)),
                    }
                    .expect("done");
                }
            });
        }
    });
    Manifest::merge_parts(path, &header(0)).expect("merged");
    assert!(frames(path).into_iter().eq(1..=4 * ROWS));
    assert_eq!(names(folder.path()), 1);
}
