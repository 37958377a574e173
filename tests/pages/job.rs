//! The page of a render.

use super::{browser, look, tweenray};
use std::path::Path;

/// Lights, a mirror, glass: nothing is missing from the page.
const SCENE: &str = r#"
[camera]
fov = 40
frames = 9
pan = { from = [-1, 1.5, 5], to = [1, 1.5, 5], target = [0, 0.5, 0] }

[settings]
size = [96, 54]
spp = 2
shadow_samples = 32
sky_samples = 32

[sky]
radiance = 0.2
lights = true

[[light]]
quad = { centre = [0, 4, 1], normal = "-y", size = [1, 1], radiance = 12 }

[material.white]
diffuse = 0.7

[material.mirror]
mirror = 0.8

[[mesh]]
name = "floor"
quad = { corner = [-5, 0, 5], edges = [[10, 0, 0], [0, 0, -10]] }
material = "white"

[[sphere]]
centre = [-0.8, 0.6, 0]
radius = 0.6
material = "white"

[[sphere]]
centre = [0.8, 0.6, 0]
radius = 0.6
material = "mirror"
"#;

pub fn scene(folder: &Path) {
    std::fs::write(folder.join("scene.toml"), SCENE).expect("written");
}

#[test]
fn player_maps_charts_and_keys() {
    let Some(mut browser) = browser() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    scene(folder.path());
    tweenray(folder.path(), "render scene.toml -o o/f_##.png --maps --no-video -q");
    tweenray(folder.path(), "report o");
    let page = folder.path().join("o/f.report.html");
    browser.open(&page, (1400, 900), false);
    let shown = |n: u32| format!("document.querySelector('#screen').dataset.shown === '{n}'");
    browser.wait(&shown(1));
    assert_eq!(browser.number("document.querySelectorAll('.chart').length"), 4.0);
    assert!(browser.text("document.querySelector('#command').textContent").contains("--maps"));

    // By keyboard.
    browser.press("ArrowRight");
    browser.wait(&shown(2));
    assert!(browser.text("document.querySelector('#told').textContent").starts_with("Frame 2:"));
    browser.press("End");
    browser.wait(&shown(9));
    browser.press("ArrowRight");
    browser.wait(&shown(9));
    browser.press("Home");
    browser.wait(&shown(1));
    browser.press(" ");
    browser.wait("+document.querySelector('#screen').dataset.shown > 3");
    assert_eq!(browser.text("document.querySelector('#play').textContent"), "Pause");
    browser.press(" ");
    assert_eq!(browser.text("document.querySelector('#play').textContent"), "Play");

    // By mouse: the scrubber's middle, the end of a chart, a button.
    browser.click("#scrub", (0.5, 0.5));
    browser.wait(&shown(5));
    browser.click(".chart .canvas", (0.99, 0.5));
    browser.wait(&shown(9));
    browser.click("#back", (0.5, 0.5));
    browser.wait(&shown(8));
    let cursor = "document.querySelector('.cursor').style.left";
    assert!(browser.text(cursor).starts_with("83.3"), "frame 8 of 9");

    // A map lies over the frame at the strength that is asked for, and the frame comes back.
    let pixel = "[...document.querySelector('#screen').getContext('2d').getImageData(48, 45, 1, 1).data].join()";
    let plain = browser.text(pixel);
    browser.press("m");
    browser.wait("document.querySelector('#screen').dataset.map === 'provenance'");
    let painted = browser.text(pixel);
    assert_ne!(plain, painted);
    browser.value("strength = document.querySelector('#strength'); strength.value = 0; strength.dispatchEvent(new Event('input'))");
    browser.wait(&format!("{pixel} === '{plain}'"));
    browser.click("[data-map='']", (0.5, 0.5));
    browser.wait("document.querySelector('#screen').dataset.map === ''");

    // With the focus on the scrubber its own keys move it, the others are the page's.
    browser.value("document.querySelector('#scrub').focus()");
    browser.press("Home");
    browser.wait(&shown(1));
    browser.press("ArrowRight");
    browser.wait(&shown(2));
    browser.press("m");
    browser.wait("document.querySelector('#screen').dataset.map === 'provenance'");
    browser.press(" ");
    browser.wait("document.querySelector('#play').textContent === 'Pause'");
    browser.press(" ");
    browser.wait("document.querySelector('#play').textContent === 'Play'");
    browser.was_quiet();
    look(&mut browser, &page, "report");
}

#[test]
fn an_unfinished_job_has_a_page_too() {
    let Some(mut browser) = browser() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    scene(folder.path());
    tweenray(folder.path(), "render scene.toml -o o/f_##.exr --frames 1..3 --maps --no-video -q");
    tweenray(folder.path(), "report o -o page.html");
    let page = folder.path().join("page.html");
    browser.open(&page, (800, 900), false);
    browser.wait("document.querySelector('#screen').dataset.shown === '1'");
    let state = browser.text("document.querySelector('header p').textContent");
    assert!(state.contains("3 of the move's 9 frames"), "{state}");
    assert_eq!(browser.number("document.querySelectorAll('#maps button').length"), 5.0);
    browser.was_quiet();
}
