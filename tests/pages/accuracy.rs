//! The page of a sweep.

use super::{browser, job, look, tweenray};

#[test]
fn plot_points_slider_and_heat_map() {
    let Some(mut browser) = browser() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    job::scene(folder.path());
    let line = "accuracy scene.toml -o a --turns 2 --reference-spp 64 --size 64x36 --threads 2 \
                --knobs reuse,samples,intersection,tree,oracle,writing,combinations -q";
    tweenray(folder.path(), line);
    let page = folder.path().join("a/report.html");
    browser.open(&page, (1400, 900), false);
    browser.wait("document.querySelector('#screen').dataset.shown === 'slide 0 1 50'");

    // The default is chosen; another point is, by mouse and by keyboard.
    let chosen = "document.querySelector('#detail').dataset.id";
    assert_eq!(browser.text(chosen), "0");
    assert!(browser.text("document.querySelector('#detail').textContent").starts_with("default"));
    // The fastest that is not the default: which one, and whether any is slower, times decide.
    let fastest = "[...document.querySelectorAll('#plots > div:first-child .point')] \
                   .filter((point) => point.dataset.id !== '0') \
                   .sort((a, b) => parseFloat(a.style.left) - parseFloat(b.style.left))[0]";
    let id = browser.text(&format!("{fastest}.dataset.id"));
    browser.value(&format!("{fastest}.focus()"));
    browser.wait(&format!("{chosen} === '{id}'"));
    let place = "parseFloat(document.activeElement.style.left)";
    let before = browser.number(place);
    browser.press("ArrowRight");
    let after = browser.number(place);
    assert!(after >= before, "{before} {after}");
    assert_ne!(browser.text(chosen), id);
    let points =
        browser.number("document.querySelectorAll('#plots > div:first-child .point').length");
    assert!(points > 12.0, "{points}");

    // By keyboard alone: through the measures of error to the points.
    browser.value("document.activeElement.blur()");
    browser.value("document.querySelector('[data-show=\"RMSE\"]').focus()");
    let is_point = "document.activeElement.matches('.point')";
    for _ in 0..8 {
        if browser.value(is_point) == false {
            browser.press("Tab");
        }
    }
    assert_eq!(browser.value(is_point), true);
    let focused = browser.text("document.activeElement.dataset.id");
    assert_eq!(browser.text(chosen), focused);
    browser.value("document.querySelector('[data-show=\"Pixels off\"]').focus()");
    browser.press("Enter");
    browser.wait("!document.querySelector('[data-of=\"Pixels off\"]').hidden");

    // Another measure of error.
    browser.click("[data-show='FLIP']", (0.5, 0.5));
    browser.wait("!document.querySelector('[data-of=\"FLIP\"]').hidden");
    assert_eq!(browser.value("document.querySelector('[data-of=\"RMSE\"]').hidden"), true);
    // A point that has a picture brings it to the left; the default's is the first.
    browser.value("document.querySelector('[data-of=\"FLIP\"] .point.default').click()");
    browser.wait("document.querySelector('#left').value === '0'");

    // The slider, by keyboard and by dragging: what is left of it is the left picture.
    browser.value("document.querySelector('#slider').focus()");
    browser.press("Home");
    browser.wait("document.querySelector('#screen').dataset.shown === 'slide 0 1 0'");
    let all = "[...document.querySelector('#screen').getContext('2d').getImageData(0, 0, 64, 36).data].join()";
    let right = browser.text(all);
    browser.press("End");
    browser.wait("document.querySelector('#screen').dataset.shown === 'slide 0 1 100'");
    let left = browser.text(all);
    assert_ne!(left, right, "default and reference are not the same");
    browser.click("#screen", (0.25, 0.5));
    browser.wait("document.querySelector('#screen').dataset.shown === 'slide 0 1 25'");

    // Where they differ: nowhere from itself, somewhere from the reference.
    // The key does it from the slider too.
    browser.value("document.querySelector('#slider').focus()");
    browser.press("h");
    browser.wait("document.querySelector('#screen').dataset.shown.startsWith('heat')");
    browser.press("h");
    browser.wait("document.querySelector('#screen').dataset.shown.startsWith('slide')");
    browser.press("h");
    browser.wait("document.querySelector('#screen').dataset.shown.startsWith('heat')");
    let told = "document.querySelector('#told').textContent";
    assert!(!browser.text(told).contains("the furthest by 0."), "{}", browser.text(told));
    browser.value("right = document.querySelector('#right'); right.value = 0; right.dispatchEvent(new Event('change'))");
    browser.wait(&format!(
        "{told} === '0.00 % of the pixels differ by more than 2/255, the furthest by 0.'"
    ));
    browser.was_quiet();
    look(&mut browser, &page, "accuracy");

    // The same for other programs.
    let csv = std::fs::read_to_string(folder.path().join("a/accuracy.csv")).expect("there");
    let columns = csv.lines().next().expect("a head").split(',').count();
    assert!(csv.lines().all(|line| line.split(',').count() == columns), "{csv}");
    // With the page's intervals and rays by kind.
    let cell = |line: usize, name: &str| {
        let all: Vec<&str> =
            csv.lines().map(|line| line.split(',').collect::<Vec<_>>()).nth(line).expect("a line");
        let at = csv.lines().next().expect("a head").split(',').position(|head| head == name);
        all[at.expect("a column")].parse::<f64>().expect("a figure")
    };
    let cpu = ["cpu_seconds_low", "cpu_seconds", "cpu_seconds_high"].map(|name| cell(1, name));
    assert!(cpu[0] <= cpu[1] && cpu[1] <= cpu[2], "{cpu:?}");
    let json = std::fs::read(folder.path().join("a/accuracy.json")).expect("there");
    let json: serde_json::Value = serde_json::from_slice(&json).expect("JSON");
    let rows = json["rows"].as_array().expect("rows");
    assert_eq!(rows.len() as f64, points);
    for kind in ["camera", "shadow_area", "retry"] {
        assert_eq!(Some(cell(1, &format!("rays_{kind}"))), rows[0]["rays"][kind].as_f64());
    }
    assert_eq!(rows.len(), csv.lines().count() - 1);
    let error = |options: &str| {
        let row = rows.iter().find(|row| row["options"] == options).expect("a row");
        row["errors"]["rmse_steps"].as_f64().expect("a figure")
    };
    assert!(error("--spp 8") < error("") && error("") < error("--spp 1"), "{csv}");
    assert_eq!(json["oracle"]["change"]["over_2"], 0);
    let writing = &json["writing"];
    assert!(writing["frame_seconds"].as_f64() >= writing["sync_seconds"].as_f64(), "{writing}");
    assert!(writing["checkpoint"][1].as_u64() > Some(1000), "{writing}");
    let low = rows.iter().find(|row| row["options"] == "--build-quality low").expect("a row");
    assert!(low["build_seconds"]["estimate"].as_f64() > Some(0.0), "{low}");
}
