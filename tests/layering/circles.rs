//! Files of one room import one another in no circle.
//!
//! A module inside another may use what that one defines, as a function's inner block may; this is no
//! import. Everything else that one file uses of another is: what a parent uses of its children, and what a
//! child uses of any file but its parents.

use super::modules::FileUse;
use std::collections::{BTreeMap, BTreeSet};

/// A use that closes a circle and may stay for now.
pub struct Allowed {
    /// The file that uses something.
    pub from: &'static str,
    /// The file that defines it.
    pub to: &'static str,
    /// What stands in the way of taking it out.
    pub why: &'static str,
}

/// Every circle that `allowed` does not open, with files and lines; and every entry of `allowed` that
/// opens none.
pub fn violations(uses: &[FileUse], allowed: &[Allowed]) -> Vec<String> {
    let imports: Vec<&FileUse> = uses.iter().filter(|u| is_import(u)).collect();
    let is_allowed = |u: &FileUse| allowed.iter().find(|a| a.from == u.from && a.to == u.to);
    let strict: Vec<&FileUse> =
        imports.iter().copied().filter(|u| is_allowed(u).is_none()).collect();
    let mut found: Vec<String> = circles(&strict).iter().map(|circle| report(circle)).collect();
    for entry in allowed {
        let stays =
            |u: &&FileUse| is_allowed(u).is_none_or(|a| (a.from, a.to) == (entry.from, entry.to));
        let with: Vec<&FileUse> = imports.iter().copied().filter(stays).collect();
        let closes = |u: &FileUse| u.from == entry.from && u.to == entry.to;
        if !circles(&with).iter().flatten().any(|u| closes(u)) {
            let Allowed { from, to, why } = entry;
            found
                .push(format!("{from} -> {to} ({why}) closes no circle: leave it out of the list"));
        }
    }
    found
}

/// Whether the rule of this page counts it.
fn is_import(u: &FileUse) -> bool {
    let stem = |file: &str| file.trim_end_matches(".rs").trim_end_matches("/mod").to_string();
    let is_parent = stem(&u.from).starts_with(&format!("{}/", stem(&u.to)));
    room(&u.from) == room(&u.to) && !is_parent
}

/// `light` of `src/light/quad.rs` or `src/light.rs`.
fn room(file: &str) -> &str {
    let inside = file.strip_prefix("src/").unwrap_or(file);
    inside.split(['/', '.']).next().unwrap_or(inside)
}

/// The imports inside each circle: inside each set of files that all lead to one another.
fn circles<'a>(imports: &[&'a FileUse]) -> Vec<Vec<&'a FileUse>> {
    let mut next: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for u in imports {
        next.entry(&u.from).or_default().push(&u.to);
    }
    let reached: BTreeMap<&str, BTreeSet<&str>> =
        next.keys().map(|file| (*file, reach(&next, file))).collect();
    let leads = |a: &str, b: &str| reached.get(a).is_some_and(|all| all.contains(b));
    let mut by_circle: BTreeMap<&str, Vec<&FileUse>> = BTreeMap::new();
    for u in imports.iter().filter(|u| leads(&u.to, &u.from)) {
        // The first file of a circle stands for it.
        let first = reached[u.from.as_str()].iter().find(|file| leads(file, &u.from));
        by_circle.entry(first.unwrap_or(&u.from.as_str())).or_default().push(*u);
    }
    by_circle.into_values().collect()
}

/// Every file that `file` leads to.
fn reach<'a>(next: &BTreeMap<&str, Vec<&'a str>>, file: &'a str) -> BTreeSet<&'a str> {
    let mut reached = BTreeSet::new();
    let mut open = vec![file];
    while let Some(at) = open.pop() {
        open.extend(next.get(at).into_iter().flatten().filter(|to| reached.insert(**to)));
    }
    reached
}

fn report(circle: &[&FileUse]) -> String {
    let files: BTreeSet<&str> = circle.iter().map(|u| u.from.as_str()).collect();
    let lines = circle.iter().map(|u| {
        let FileUse { from, to, line, path } = u;
        format!("\n    {from}:{line}: {path} of {to}")
    });
    let files: Vec<&str> = files.into_iter().collect();
    format!(
        "files that import one another in a circle: {}{}",
        files.join(", "),
        lines.collect::<String>()
    )
}

#[cfg(test)]
mod tests {
    use super::{Allowed, violations};
    use crate::layering::modules::Modules;

    fn check(files: &[(&str, &str)], allowed: &[Allowed]) -> Vec<String> {
        violations(&Modules::read_texts(files).uses, allowed)
    }

    const ROOM: (&str, &str) = ("src/scene/mod.rs", "mod a;\nmod b;\npub use a::A;\npub use b::*;");
    const A: (&str, &str) = ("src/scene/a.rs", "\nuse super::b::B;\npub struct A;");
    const B: (&str, &str) = ("src/scene/b.rs", "pub struct B;\nfn f(a: &super::A) {}");
    const B_ALONE: (&str, &str) = ("src/scene/b.rs", "pub struct B;");

    #[test]
    fn a_circle_is_refused_with_its_files_and_lines() {
        let found = check(&[ROOM, A, B], &[]);
        assert_eq!(found.len(), 1, "{found:#?}");
        for word in ["src/scene/a.rs:2: super::b::B", "src/scene/b.rs:2: super::A"] {
            assert!(found[0].contains(word), "{found:#?}");
        }
        assert_eq!(check(&[ROOM, A, B_ALONE], &[]), [""; 0]);
    }

    #[test]
    fn re_exports_lead_to_the_file_that_defines_the_name() {
        for path in ["crate::scene::{A}", "super::A as Other", "super::super::scene::A"] {
            let b = format!("pub struct B;\nuse {path};");
            assert_eq!(check(&[ROOM, A, ("src/scene/b.rs", &b)], &[]).len(), 1, "{path}");
        }
        let a = ("src/scene/a.rs", "use super::B;\npub struct A;");
        assert_eq!(check(&[ROOM, a, B], &[]).len(), 1, "through *");
    }

    #[test]
    fn a_child_may_use_its_parent_which_uses_it_but_its_parent_is_no_detour() {
        let parent = ("src/scene/a.rs", "mod part;\npub struct A;\nfn f() { part::f() }");
        let part = ("src/scene/a/part.rs", "pub fn f(a: super::A) {}");
        assert_eq!(check(&[ROOM, parent, part, B], &[]), [""; 0]);
        let part = ("src/scene/a/part.rs", "pub fn f(b: crate::scene::b::B) {}");
        assert_eq!(check(&[ROOM, parent, part, B], &[]).len(), 1);
    }

    #[test]
    fn tests_and_other_rooms_are_not_looked_at() {
        let b = ("src/scene/b.rs", "pub struct B;\nmod tests { use super::super::A; }");
        assert_eq!(check(&[ROOM, A, b], &[]), [""; 0]);
        let b = ("src/film/b.rs", "pub struct B;\nuse crate::scene::A;");
        let a = ("src/scene/a.rs", "use crate::film::b::B;\npub struct A;");
        assert_eq!(check(&[("src/film.rs", "pub mod b;"), ROOM, a, b], &[]), [""; 0]);
    }

    #[test]
    fn an_allowed_use_opens_its_circle_and_no_more_than_needed_is_allowed() {
        let entry = |from, to| Allowed { from, to, why: "later" };
        let list = [entry("src/scene/b.rs", "src/scene/a.rs")];
        assert_eq!(check(&[ROOM, A, B], &list), [""; 0]);
        let found = check(&[ROOM, A, B_ALONE], &list);
        assert!(found.len() == 1 && found[0].contains("closes no circle"), "{found:#?}");
    }
}
