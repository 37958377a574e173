//! Differences between two headers, in words.

use super::Header;
use std::collections::BTreeMap;

/// Name of the scene's hash in messages.
pub(super) const SCENE: &str = "scene content";
/// Most parts of a scene that are named.
const MOST: usize = 3;

/// A setting in which two headers differ.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct HeaderDifference {
    /// Name of the setting as on the command line, or of something else that differs.
    pub name: String,
    /// Its value in the manifest.
    pub before: String,
    /// Its value now.
    pub now: String,
    /// Which parts of the scene differ, in words, if the scene differs and its parts are known.
    parts: Option<String>,
}

impl HeaderDifference {
    /// `spp was 4, now it is 16`.
    pub fn was_and_is(&self) -> String {
        match &self.parts {
            Some(parts) => format!("{} has changed: {parts}", self.name),
            None => format!("{} was {}, now it is {}", self.name, self.before, self.now),
        }
    }

    /// `spp is 4 there, 16 here`.
    pub fn there_and_here(&self) -> String {
        match &self.parts {
            Some(parts) => format!("{} is another there: here {parts}", self.name),
            None => format!("{} is {} there, {} here", self.name, self.before, self.now),
        }
    }
}

impl Header {
    /// The first entry in which a job with the header `now` would differ from this one.
    pub fn first_difference(&self, now: &Self) -> Option<HeaderDifference> {
        let (before, after) = (self.entries(), now.entries());
        let names = after.iter().chain(&before).map(|(name, _)| name);
        let value = |entries: &[(String, String)], name: &str| {
            let found = entries.iter().find(|(n, _)| n == name);
            found.map_or_else(|| "not set".to_string(), |(_, v)| v.clone())
        };
        let difference = |name: &String| HeaderDifference {
            name: name.clone(),
            before: value(&before, name),
            now: value(&after, name),
            parts: None,
        };
        let first = names.map(difference).find(|d| d.before != d.now)?;
        let parts = (first.name == SCENE).then(|| changes(&self.scene_parts, &now.scene_parts));
        Some(HeaderDifference { parts: parts.flatten(), ..first })
    }
}

/// Which parts have changed, are gone or are new; `None` if parts are not known or all are equal.
fn changes(before: &BTreeMap<String, String>, now: &BTreeMap<String, String>) -> Option<String> {
    // What an older version wrote has none.
    if before.is_empty() || now.is_empty() {
        return None;
    }
    let changed = now.iter().filter_map(|(name, hash)| match before.get(name) {
        None => Some(format!("{name} is new")),
        Some(was) => (was != hash).then(|| format!("{name} is not the same")),
    });
    let gone = before.keys().filter(|name| !now.contains_key(*name));
    let all: Vec<String> = changed.chain(gone.map(|name| format!("{name} is gone"))).collect();
    let more = match all.len().saturating_sub(MOST) {
        0 => String::new(),
        n => format!(", and {n} more"),
    };
    (!all.is_empty()).then(|| all[..all.len().min(MOST)].join(", ") + &more)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header(parts: &[(&str, &str)]) -> Header {
        let pair = |(name, hash): &(&str, &str)| (name.to_string(), hash.to_string());
        let scene_hash = format!("{parts:?}");
        Header { scene_hash, scene_parts: parts.iter().map(pair).collect(), ..Header::default() }
    }

    #[test]
    fn parts_of_the_scene_are_named_and_no_hash_is_shown() {
        let before = header(&[("light 1", "a"), ("material `red`", "b"), ("the sky", "c")]);
        let now = header(&[
            ("light 1", "a"),
            ("material `red`", "d"),
            ("the sky", "c"),
            ("mesh 1 `x`", "e"),
        ]);
        let d = before.first_difference(&now).expect("they differ");
        let told = "scene content has changed: material `red` is not the same, mesh 1 `x` is new";
        assert_eq!(d.was_and_is(), told);
        let d = now.first_difference(&header(&[])).expect("they differ");
        assert!(
            d.was_and_is().starts_with("scene content was [("),
            "an older manifest has no parts"
        );
        let none = header(&[("a", "a")]);
        let told = before.first_difference(&none).expect("they differ").there_and_here();
        assert_eq!(
            told,
            "scene content is another there: here a is new, light 1 is gone, material `red` is gone, and 1 more"
        );
    }
}
