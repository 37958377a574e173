//! Pages that open from disk without a network: HTML with styles, scripts, plots and pictures in it.
//!
//! * [`job`] is the page of a render: player, charts, tables.
//! * [`accuracy`] is the page of a sweep: error against time, image pairs, tables.
//!
//! Both are plain data to be filled in, with words and figures ready to be read; `to_html` sets them.
//! [`Picture`]s go in as data URIs, plots are made of [`Chart`]s, [`Scatter`]s and [`Timeline`]s.
//! What scripts do can be done by keyboard, too; without scripts the plots and tables still stand.
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
}
