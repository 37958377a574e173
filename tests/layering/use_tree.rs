//! The tree of a `use` to its paths.

use super::lexer::Token;

/// One path of a `use`.
pub struct Leaf {
    /// Its segments, without a `*` or a `self` at the end.
    pub path: Vec<String>,
    /// The name that it makes; `None` for all names of the module (`*`).
    pub name: Option<String>,
    /// Line of its last segment, from 1.
    pub line: usize,
}

/// The paths between `use` and `;`.
pub fn leaves(tokens: &[Token]) -> Vec<Leaf> {
    let mut found = Vec::new();
    let mut path: Vec<&Token> = Vec::new();
    // For each open brace, how many segments stand before it.
    let mut open: Vec<usize> = Vec::new();
    for token in tokens {
        match token.text.as_str() {
            "::" => {}
            "{" => open.push(path.len()),
            "," | "}" => {
                end(&path, open.last(), &mut found);
                if token.text == "}" {
                    open.pop();
                }
                path.truncate(open.last().copied().unwrap_or(0));
            }
            _ => path.push(token),
        }
    }
    end(&path, open.last(), &mut found);
    found
}

/// The path that ends here, if one was begun since the brace that opened after `before` segments.
fn end(path: &[&Token], before: Option<&usize>, found: &mut Vec<Leaf>) {
    if path.len() <= before.copied().unwrap_or(0) {
        return;
    }
    let line = path[path.len() - 1].line;
    let mut segments: Vec<String> = path.iter().map(|t| t.text.clone()).collect();
    let alias = match segments.iter().position(|s| s == "as") {
        Some(at) => segments.drain(at..).next_back(),
        None => None,
    };
    if segments.len() > 1 && segments.last().is_some_and(|s| s == "self") {
        segments.pop();
    }
    let is_glob = segments.last().is_some_and(|s| s == "*");
    if is_glob {
        segments.pop();
    }
    let name = (!is_glob).then(|| alias.or(segments.last().cloned()).unwrap_or_default());
    found.push(Leaf { path: segments, name, line });
}
