//! The scene file's JSON schema, from the very types that read it.

use super::SceneFile;
use serde_json::{Map, Value};

/// The schema of a type that is read by hand, written out wherever the type is used.
macro_rules! inline_schema {
    (for [$($generic:tt)*] $type:ty, |$generator:pat_param| $schema:expr) => {
        impl<$($generic)*> schemars::JsonSchema for $type {
            fn inline_schema() -> bool {
                true
            }

            fn schema_name() -> std::borrow::Cow<'static, str> {
                std::any::type_name::<Self>().into()
            }

            fn json_schema($generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
                $schema
            }
        }
    };
    ($type:ty, |$generator:pat_param| $schema:expr) => {
        inline_schema!(for [] $type, |$generator| $schema);
    };
}
pub(super) use inline_schema;

/// The scene file's JSON schema (draft 2020-12), for editors.
pub fn schema() -> Value {
    let mut schema = schemars::schema_for!(SceneFile).to_value();
    drop_null(&mut schema);
    schema
}

/// An optional key may be absent; schemars also allows it to be null, which TOML has not.
fn drop_null(schema: &mut Value) {
    match schema {
        Value::Object(map) => {
            drop_null_here(map);
            map.values_mut().for_each(drop_null);
        }
        Value::Array(items) => items.iter_mut().for_each(drop_null),
        _ => {}
    }
}

fn drop_null_here(map: &mut Map<String, Value>) {
    if map.get("default").is_some_and(Value::is_null) {
        map.remove("default");
    }
    if let Some(Value::Array(types)) = map.get_mut("type") {
        types.retain(|t| t != "null");
        if let [only] = types.as_slice() {
            let only = only.clone();
            map.insert("type".into(), only);
        }
    }
    if let Some(Value::Array(values)) = map.get_mut("enum") {
        values.retain(|value| !value.is_null());
    }
    let Some(Value::Array(choices)) = map.get_mut("anyOf") else { return };
    choices.retain(|c| c.get("type") != Some(&Value::from("null")));
    if let [Value::Object(only)] = choices.as_mut_slice() {
        // The key's own description stays.
        let only = std::mem::take(only);
        map.remove("anyOf");
        only.into_iter().for_each(|(key, value)| {
            map.entry(key).or_insert(value);
        });
    }
}
