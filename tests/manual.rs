//! `tweenray manual`: a page for each command that the help lists, and a completion for each shell.

use std::path::Path;
use std::process::Command;

fn tweenray(arguments: &[&Path]) -> std::process::Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_tweenray"));
    command.args(arguments).output().expect("it starts")
}

#[test]
fn every_listed_command_has_a_page_and_every_shell_a_completion() {
    let prefix = tempfile::tempdir().expect("a folder");
    let output = tweenray(&[Path::new("manual"), prefix.path()]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let help = String::from_utf8(tweenray(&[Path::new("--help")]).stdout).expect("text");
    let listed = help.split("Commands:\n").nth(1).expect("a list").split("\n\n").next();
    // Further lines of a description are indented more.
    let names = listed.expect("a list").lines().filter_map(|line| line.strip_prefix("  "));
    let names =
        names.filter(|line| !line.starts_with(' ')).filter_map(|line| line.split(' ').next());
    let names: Vec<&str> = names.filter(|name| *name != "help").collect();
    assert!(names.contains(&"render") && !names.contains(&"manual"), "{names:?}");
    let share = prefix.path().join("share");
    let read = |path: &str| std::fs::read_to_string(share.join(path)).expect(path);
    for name in &names {
        let page = read(&format!("man/man1/tweenray-{name}.1"));
        assert!(page.contains(".SH SYNOPSIS") && page.contains(name), "{page}");
    }
    assert!(read("man/man1/tweenray-render.1").contains("shadow\\-samples"));
    assert_eq!(std::fs::read_dir(share.join("man/man1")).expect("pages").count(), names.len() + 1);
    for path in [
        "bash-completion/completions/tweenray",
        "zsh/site-functions/_tweenray",
        "fish/vendor_completions.d/tweenray.fish",
    ] {
        assert!(read(path).contains("shadow-samples"), "{path}");
    }
}

#[test]
fn a_prefix_that_cannot_be_written_is_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("file");
    std::fs::write(&file, "").expect("a file");
    let output = tweenray(&[Path::new("manual"), &file]);
    assert_eq!(output.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&output.stderr).contains("file"));
}
