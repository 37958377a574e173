//! JSON with places: every value knows its path in the file, so that errors name it.

use crate::error::{Diagnostic, Result};
use serde_json::Value;
use std::collections::BTreeSet;
use std::path::Path;

/// A value of the file, and where it stands.
#[derive(Debug, Clone)]
pub(super) struct Json<'a> {
    file: &'a Path,
    value: &'a Value,
    /// As in `meshes[0].primitives[1]`; empty at the top.
    path: String,
}

impl<'a> Json<'a> {
    /// The top of the file.
    pub fn top(file: &'a Path, value: &'a Value) -> Self {
        Self { file, value, path: String::new() }
    }

    /// Where the value stands, as in `meshes[0].primitives[1]`.
    pub fn path(&self) -> &str {
        &self.path
    }

    /// A message about this value.
    pub fn fault(&self, message: impl AsRef<str>) -> Diagnostic {
        let message = message.as_ref();
        match self.path.as_str() {
            "" => Diagnostic::new(self.file, message),
            path => Diagnostic::new(self.file, format!("{path}: {message}")),
        }
    }

    /// The value of `key`; `None` where there is none, or where this is no object.
    pub fn get(&self, key: &str) -> Option<Self> {
        let value = self.value.get(key)?;
        let path = if self.path.is_empty() { key.into() } else { format!("{}.{key}", self.path) };
        Some(Self { file: self.file, value, path })
    }

    /// The value of `key`.
    ///
    /// Errors: there is none.
    pub fn required(&self, key: &str) -> Result<Self> {
        self.get(key).ok_or_else(|| self.fault(format!("`{key}` is missing")).into())
    }

    /// The extension `name` of this object.
    pub fn extension(&self, name: &str) -> Option<Self> {
        self.get("extensions")?.get(name)
    }

    /// Adds the names of all extensions that this value and what it holds have to `names`; what programs keep for themselves
    /// does not count.
    pub fn collect_extensions(&self, names: &mut BTreeSet<&'a str>) {
        collect_extensions(self.value, names);
    }

    /// The elements of the array `key`; none where there is no such key.
    ///
    /// Errors: another kind of value.
    pub fn list(&self, key: &str) -> Result<Vec<Self>> {
        self.get(key).map_or(Ok(Vec::new()), |list| list.elements())
    }

    /// The elements of this array.
    pub fn elements(&self) -> Result<Vec<Self>> {
        let Value::Array(values) = self.value else { return self.wrong("an array") };
        let element = |(at, value)| {
            let path = format!("{}[{at}]", self.path);
            Self { file: self.file, value, path }
        };
        Ok(values.iter().enumerate().map(element).collect())
    }

    /// The text `key`.
    pub fn text(&self, key: &str) -> Result<Option<&'a str>> {
        self.get(key).map(|value| value.as_text()).transpose()
    }

    /// This value as text.
    pub fn as_text(&self) -> Result<&'a str> {
        self.value.as_str().map_or_else(|| self.wrong("a text"), Ok)
    }

    /// The number `key`, finite: JSON has no others.
    pub fn number(&self, key: &str) -> Result<Option<f64>> {
        self.get(key).map(|value| value.as_number()).transpose()
    }

    /// The number `key` from `least` to `most`, or `default` where there is none.
    pub fn number_within(&self, key: &str, [least, most]: [f64; 2], default: f64) -> Result<f64> {
        let Some(value) = self.get(key) else { return Ok(default) };
        let number = value.as_number()?;
        if (least..=most).contains(&number) {
            return Ok(number);
        }
        let show = |x: f64| if x.abs() < 1e6 { x.to_string() } else { format!("{x:e}") };
        let range = match most {
            f64::MAX => format!("{} or more", show(least)),
            most => format!("from {} to {}", show(least), show(most)),
        };
        let number = show(number);
        Err(value.fault(format!("{number} is out of range; it is {range}")).into())
    }

    fn as_number(&self) -> Result<f64> {
        let number = self.value.as_f64().filter(|number| number.is_finite());
        number.map_or_else(|| self.wrong("a number"), Ok)
    }

    /// The `N` numbers of the array `key`.
    pub fn numbers<const N: usize>(&self, key: &str) -> Result<Option<[f64; N]>> {
        let Some(list) = self.get(key) else { return Ok(None) };
        let wrong = || list.wrong(&format!("an array of {N} numbers"));
        let Value::Array(values) = list.value else { return wrong() };
        let numbers: Option<Vec<f64>> = values.iter().map(Value::as_f64).collect();
        match numbers.and_then(|numbers| <[f64; N]>::try_from(numbers).ok()) {
            Some(numbers) if numbers.iter().all(|x| x.is_finite()) => Ok(Some(numbers)),
            _ => wrong(),
        }
    }

    /// The first numbers of the array `key`, at most `most`.
    pub fn first_numbers(&self, key: &str, most: usize) -> Result<Option<Vec<f64>>> {
        let Some(list) = self.get(key) else { return Ok(None) };
        let wrong = || list.wrong("an array of numbers");
        let Value::Array(values) = list.value else { return wrong() };
        let numbers: Option<Vec<f64>> = values.iter().take(most).map(Value::as_f64).collect();
        numbers.map_or_else(wrong, |numbers| Ok(Some(numbers)))
    }

    /// The whole number `key`, not negative. Some programs write such numbers with a point.
    pub fn whole(&self, key: &str) -> Result<Option<usize>> {
        self.get(key).map(|value| value.as_whole()).transpose()
    }

    /// This value as a whole number, not negative.
    pub fn as_whole(&self) -> Result<usize> {
        let of_float = |x: f64| {
            let is_whole = x >= 0.0 && x <= (1u64 << 53) as f64 && x.fract() == 0.0;
            is_whole.then_some(x as u64)
        };
        let whole = self.value.as_u64().or_else(|| self.value.as_f64().and_then(of_float));
        match whole.and_then(|whole| usize::try_from(whole).ok()) {
            Some(whole) => Ok(whole),
            None => self.wrong("a whole number"),
        }
    }

    /// The number `key` of one of `count` things of the kind `what`.
    pub fn index(&self, key: &str, count: usize, what: &str) -> Result<Option<usize>> {
        self.get(key).map(|value| value.as_index(count, what)).transpose()
    }

    /// This value as the number of one of `count` things of the kind `what`.
    pub fn as_index(&self, count: usize, what: &str) -> Result<usize> {
        let index = self.as_whole()?;
        if index < count {
            return Ok(index);
        }
        let message = format!("there is no {what} {index} (from 0): the file has {count}");
        Err(self.fault(message).into())
    }

    /// The truth value `key`.
    pub fn truth(&self, key: &str) -> Result<Option<bool>> {
        let Some(value) = self.get(key) else { return Ok(None) };
        value.value.as_bool().map_or_else(|| value.wrong("true or false"), |truth| Ok(Some(truth)))
    }

    fn wrong<T>(&self, wanted: &str) -> Result<T> {
        let found = match self.value {
            Value::Null => "null",
            Value::Bool(_) => "true or false",
            Value::Number(_) => "a number",
            Value::String(_) => "a text",
            Value::Array(_) => "an array",
            Value::Object(_) => "an object",
        };
        // An array of the wrong length is an array too.
        let other = if wanted.contains(found) { "another" } else { found };
        Err(self.fault(format!("expected {wanted}, found {other}")).into())
    }
}

/// No deeper than a parsed file nests.
fn collect_extensions<'a>(value: &'a Value, names: &mut BTreeSet<&'a str>) {
    match value {
        Value::Array(values) => values.iter().for_each(|value| collect_extensions(value, names)),
        Value::Object(members) => {
            for (key, value) in members.iter().filter(|(key, _)| *key != "extras") {
                if let ("extensions", Value::Object(extensions)) = (key.as_str(), value) {
                    names.extend(extensions.keys().map(String::as_str));
                }
                collect_extensions(value, names);
            }
        }
        _ => {}
    }
}
