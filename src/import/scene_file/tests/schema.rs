//! The JSON schema and the user's page agree with the types.

use super::*;
use serde_json::Value;
use std::collections::BTreeSet;

const PAGE: &str = include_str!("../../../../docs/scene-format.md");

/// Every key of every table in the schema.
fn keys(schema: &Value, found: &mut BTreeSet<String>) {
    match schema {
        Value::Object(map) => {
            if let Some(Value::Object(properties)) = map.get("properties") {
                found.extend(properties.keys().cloned());
            }
            map.values().for_each(|v| keys(v, found));
        }
        Value::Array(items) => items.iter().for_each(|v| keys(v, found)),
        _ => {}
    }
}

fn all_keys() -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    keys(&schema(), &mut found);
    found
}

#[test]
fn toml_has_no_null() {
    assert!(!schema().to_string().contains("null"));
}

#[test]
fn the_schema_is_strict_and_described() {
    fn check(schema: &Value) {
        match schema {
            Value::Object(map) => {
                if let Some(Value::Object(properties)) = map.get("properties") {
                    let open = map.get("additionalProperties") != Some(&Value::Bool(false));
                    assert!(!open, "open table: {schema}");
                    for (key, property) in properties {
                        // The kind of a light or step is described beside its one key.
                        let described = property.get("description").is_some()
                            || map.get("description").is_some();
                        assert!(described, "no description: {key}");
                    }
                }
                map.values().for_each(check);
            }
            Value::Array(items) => items.iter().for_each(check),
            _ => {}
        }
    }
    let schema = schema();
    assert_eq!(schema["$schema"], "https://json-schema.org/draft/2020-12/schema");
    check(&schema);
}

#[test]
fn ranges_and_defaults_are_in_the_schema() {
    let text = schema().to_string();
    let settings = &schema()["$defs"]["Settings"]["properties"];
    assert_eq!(settings["spp"]["anyOf"][0]["maximum"], 65_536);
    assert_eq!(settings["shadow_samples"]["anyOf"][0]["maximum"], 65_536);
    assert_eq!(settings["spp"]["default"], serde_json::json!([4, 16]));
    assert_eq!(settings["cutoff"]["default"], 0.001);
    let reuse = &schema()["$defs"]["Reuse"]["properties"];
    assert_eq!(
        (&reuse["segment"]["maximum"], &reuse["probes"]["default"]),
        (&1_000_000.into(), &0.01.into())
    );
    assert_eq!(settings["size"]["default"], serde_json::json!([640, 360]));
    let fov = &schema()["$defs"]["Camera"]["properties"]["fov"];
    assert_eq!((&fov["exclusiveMaximum"], &fov["default"]), (&180.into(), &40.0.into()));
    assert!(text.contains("\"terrain\"") && text.contains("W/(m² sr)"));
}

#[test]
fn the_page_names_every_key() {
    let named = |key: &String| {
        let forms = [format!("`{key}`"), format!("## `[{key}]`"), format!("## `[[{key}]]`")];
        forms.iter().any(|form| PAGE.contains(form))
    };
    let missing: Vec<String> = all_keys().into_iter().filter(|key| !named(key)).collect();
    assert!(missing.is_empty(), "docs/scene-format.md does not name {missing:?}");
}

#[test]
fn every_key_in_the_page_is_one() {
    let keys = all_keys();
    for row in PAGE.lines().filter(|l| l.starts_with("| `")) {
        let key = row.split('`').nth(1).unwrap_or_default();
        assert!(keys.contains(key), "docs/scene-format.md explains `{key}`, which is no key");
    }
}

#[test]
fn every_example_in_the_page_is_a_scene() {
    let blocks: Vec<&str> =
        PAGE.split("```toml\n").skip(1).filter_map(|rest| rest.split("```").next()).collect();
    assert!(blocks.len() >= 6);
    for block in blocks {
        let source = Source { path: "docs/scene-format.md".into(), text: block.into() };
        if let Err(e) = SceneFile::parse(&source) {
            panic!("{e}\n{block}");
        }
    }
}

/// Defaults that the schema states are those of the page's tables.
#[test]
fn the_page_states_the_true_defaults() {
    let schema = schema();
    let tables = schema["$defs"].as_object().expect("tables").values();
    let rows: Vec<Vec<&str>> = PAGE
        .lines()
        .filter(|l| l.starts_with("| `"))
        .map(|l| l.split('|').map(str::trim).collect())
        .collect();
    let properties = tables.filter_map(|t| t.get("properties")?.as_object()).flatten();
    for (key, property) in properties.filter(|(key, _)| *key != "rules") {
        let Some(default) = property.get("default") else { continue };
        let number = default.as_f64().map(|x| x.to_string());
        let shown = number.unwrap_or_else(|| default.to_string().replace(',', ", "));
        let stated = rows
            .iter()
            .filter(|row| row[1] == format!("`{key}`"))
            .any(|row| row[3].trim_matches('`').replace(".0", "") == shown.replace(".0", ""));
        // An empty list is a key that may as well be absent.
        assert!(stated || shown == "[]", "docs/scene-format.md: `{key}` defaults to {shown}");
    }
}
