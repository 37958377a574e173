//! One meaning, one name: no two public types share a name.
//!
//! Public is what says `pub` or `pub(crate)`; a type that only its parent module sees may be called as it is
//! called there.

use super::modules::PublicType;
use std::collections::{BTreeMap, BTreeSet};

/// A name that several files may define.
pub struct Allowed {
    /// The name.
    pub name: &'static str,
    /// The files, all of them.
    pub files: &'static [&'static str],
    /// Why.
    pub why: &'static str,
}

/// Every name that is defined twice and not in `allowed` with just these files, and every entry of
/// `allowed` that is not so.
pub fn violations(types: &[PublicType], allowed: &[Allowed]) -> Vec<String> {
    let mut places: BTreeMap<&str, Vec<&PublicType>> = BTreeMap::new();
    for public in types {
        places.entry(&public.name).or_default().push(public);
    }
    places.retain(|_, places| places.len() > 1);
    let mut found = Vec::new();
    for (name, places) in &places {
        let files: BTreeSet<&str> = places.iter().map(|p| p.file.as_str()).collect();
        let is_so = |a: &Allowed| a.name == *name && files == a.files.iter().copied().collect();
        if !allowed.iter().any(is_so) {
            let places: Vec<String> =
                places.iter().map(|p| format!("{}:{}", p.file, p.line)).collect();
            found.push(format!("{name} names {} types: {}", places.len(), places.join(", ")));
        }
    }
    for Allowed { name, why, .. } in allowed.iter().filter(|a| !places.contains_key(a.name)) {
        found.push(format!("{name} ({why}) is defined once: leave it out of the list"));
    }
    found
}

#[cfg(test)]
mod tests {
    use super::{Allowed, violations};
    use crate::layering::modules::Modules;

    const FIRST: (&str, &str) = ("src/scene/a.rs", "\npub struct Row { pub x: u8 }");

    fn check(second: &str, allowed: &[Allowed]) -> Vec<String> {
        let files = [FIRST, ("src/film/b.rs", second)];
        violations(&Modules::read_texts(&files).types, allowed)
    }

    #[test]
    fn a_second_type_of_a_name_is_refused_with_both_places() {
        for text in ["pub enum Row { A }", "pub(crate) trait Row {}", "pub type Row = u8;"] {
            let found = check(text, &[]);
            assert_eq!(found.len(), 1, "{text}");
            assert!(found[0].contains("src/scene/a.rs:2, src/film/b.rs:1"), "{found:?}");
        }
    }

    #[test]
    fn private_types_and_what_only_a_parent_sees_may_share_a_name() {
        for text in [
            "struct Row;",
            "pub(super) struct Row;",
            "pub fn Row() {}",
            "pub mod m { struct Row; }",
        ] {
            assert_eq!(check(text, &[]), [""; 0], "{text}");
        }
        assert_eq!(
            check("impl T for X { type Row = u8; }\nmod tests { pub struct Row; }", &[]),
            [""; 0]
        );
        assert_eq!(check("pub mod m { pub struct Row; }", &[]).len(), 1);
    }

    #[test]
    fn allowed_names_are_allowed_for_their_files_and_while_needed() {
        let allowed = |files| [Allowed { name: "Row", files, why: "of two tables" }];
        let list = allowed(&["src/scene/a.rs", "src/film/b.rs"]);
        assert_eq!(check("pub struct Row;", &list), [""; 0]);
        assert_eq!(check("struct Row;", &list).len(), 1);
        assert_eq!(check("pub struct Row;", &allowed(&["src/scene/a.rs", "src/x.rs"])).len(), 1);
    }
}
