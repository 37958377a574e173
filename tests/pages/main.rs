//! The pages in a real browser: they work by mouse and by keyboard, complain of nothing and ask for
//! nothing.
//!
//! Chromium is Debian's package of that name (`./x test` installs it); another one is named by the
//! environment variable `TWEENRAY_CHROMIUM`. With `TWEENRAY_SCREENSHOTS=FOLDER` the pages are left
//! there as pictures, 400 and 1400 pixels wide.

mod accuracy;
mod browser;
mod job;

use browser::Browser;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A browser, or a word about why there is none.
#[allow(clippy::print_stderr, reason = "a test that skips says so")]
fn browser() -> Option<Browser> {
    let Some(name) = browser::installed() else {
        eprintln!(
            "SKIPPED: no Chromium here; install Debian's package `chromium` (./x test does), or name one \
             in TWEENRAY_CHROMIUM"
        );
        return None;
    };
    Some(Browser::start(&name))
}

/// Runs the program in `folder` with `line`, split at blanks.
fn tweenray(folder: &Path, line: &str) {
    let output = Command::new(env!("CARGO_BIN_EXE_tweenray"))
        .args(line.split_whitespace())
        .current_dir(folder)
        .output()
        .expect("the program starts");
    assert!(output.status.success(), "{line}\n{}", String::from_utf8_lossy(&output.stderr));
}

/// Names the elements that end beyond the window.
const STICKS_OUT: &str = "[...document.querySelectorAll('body *')]\
    .filter(e => e.getBoundingClientRect().right > innerWidth)\
    .map(e => e.tagName + '.' + e.className + ': ' + e.textContent.trim().slice(0, 60)).join('; ')";

/// Opens the page wide and narrow, light and dark; nothing may stick out to the side.
fn look(browser: &mut Browser, page: &Path, name: &str) {
    for (width, dark) in [(400, false), (1400, false), (1400, true)] {
        browser.open(page, (width, 900), dark);
        let sticks_out = browser.number("document.documentElement.scrollWidth - innerWidth");
        let what = if sticks_out > 0.0 { browser.text(STICKS_OUT) } else { String::new() };
        assert!(sticks_out <= 0.0, "{name} is {sticks_out} pixels too wide at {width}: {what}");
        let ground = browser.text("getComputedStyle(document.body).backgroundColor");
        assert_eq!(ground == "rgb(255, 255, 255)", !dark, "{name}: {ground}");
        if let Some(folder) = std::env::var_os("TWEENRAY_SCREENSHOTS").map(PathBuf::from) {
            std::fs::create_dir_all(&folder).expect("a folder for screenshots");
            let scheme = if dark { "-dark" } else { "" };
            browser.screenshot(&folder.join(format!("{name}-{width}{scheme}.png")));
        }
    }
    browser.was_quiet();
}
