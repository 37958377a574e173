//! Pages that open from disk without a network: HTML with styles, scripts, plots and pictures in it.
//!
//! * [`job`] is the page of a render: player, charts, tables.
//! * [`accuracy`] is the page of a sweep: error against time, image pairs, tables.
//!
//! Both are plain data to be filled in, with words and figures ready to be read; `to_html` sets them.
//! [`Picture`]s go in as data URIs, plots are made of [`Chart`]s, [`Scatter`]s and [`Timeline`]s.
//! All scripts can be used by keyboard, too; without scripts the plots and tables are still shown.
//! A policy in each page's head forbids every request.
//!
//! Text in plots is HTML over the drawing, placed in per cent: it keeps its size on a narrow screen.

pub mod accuracy;
mod axis;
mod chart;
pub mod job;
mod picture;
mod plot;
mod scatter;
mod table;
mod timeline;
pub mod words;

pub use axis::{Axis, Tick};
pub use chart::{Chart, Series};
pub use picture::Picture;
pub use plot::Plot;
pub use scatter::{Point, Scatter};
pub use table::Table;
pub use timeline::{Span, Timeline};

use crate::error::{Error, Result};
use askama::Template;

/// Styles that both pages share.
const STYLE: &str = include_str!("../../templates/page.css");
/// Scripts that both pages share.
const SCRIPT: &str = include_str!("../../templates/page.js");

fn set(page: &impl Template) -> Result<String> {
    page.render().map_err(|e| Error::Failed(format!("cannot set the page: {e}")))
}

/// Text that may stand in HTML and in an attribute.
fn escaped(text: &str) -> String {
    let escape = |c: char| match c {
        '&' => "&amp;".to_string(),
        '<' => "&lt;".into(),
        '>' => "&gt;".into(),
        '"' => "&quot;".into(),
        c => c.into(),
    };
    text.chars().map(escape).collect()
}

/// Text as HTML, with the options of the command line set as such: no line is broken within one.
fn with_options(text: &str) -> String {
    let word = |word: &str| match word.starts_with("--") {
        true => {
            let end = word.trim_end_matches([':', ',', '.', ';']);
            format!("<code>{}</code>{}", escaped(end), &word[end.len()..])
        }
        false => escaped(word),
    };
    text.split(' ').map(word).collect::<Vec<_>>().join(" ")
}

/// `value` as JSON that may stand in a script element: nothing in it can end one.
fn json_for_script(value: &impl serde::Serialize) -> Result<String> {
    let text = serde_json::to_string(value)
        .map_err(|e| Error::Failed(format!("cannot write JSON: {e}")))?;
    Ok(text.replace('<', "\\u003c"))
}

#[cfg(test)]
mod tests {
    #[test]
    fn json_cannot_end_its_script() {
        let text = super::json_for_script(&"</script><!--").expect("plain data");
        assert!(!text.contains('<'), "{text}");
        let back: String = serde_json::from_str(&text).expect("JSON");
        assert_eq!(back, "</script><!--");
    }

    #[test]
    fn options_are_set_as_such() {
        assert_eq!(
            super::with_options("<b> --spp 4: less, --cutoff."),
            "&lt;b&gt; <code>--spp</code> 4: less, <code>--cutoff</code>."
        );
    }
}
