//! The rules themselves: from sources and floors to a list of violations.

use super::lexer::{Token, tokens};
use super::modules::{self, RootName, module_of, root_names};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Which room stands on which floor.
pub struct Floors(BTreeMap<String, u32>);

/// One source file.
pub struct Source {
    /// Path from the project's root, with `/`.
    path: String,
    /// Module path inside the crate; `None` outside a room.
    module: Option<modules::Path>,
    tokens: Vec<Token>,
}

impl Floors {
    /// Reads `// Floor N` comments and the `pub mod` lines below each.
    pub fn read(lib: &str) -> Result<Self, String> {
        let mut floors = BTreeMap::new();
        let mut current = None;
        for line in lib.lines().map(str::trim) {
            if let Some(rest) = line.strip_prefix("// Floor ") {
                let digits = rest.split(|c: char| !c.is_ascii_digit()).next().unwrap_or_default();
                current = Some(digits.parse().map_err(|_| format!("no number in {line:?}"))?);
            } else if let Some((_, name)) = line.split_once("mod ").filter(|(before, _)| {
                matches!(before.trim(), "" | "pub" | "pub(crate)") && line.ends_with(';')
            }) {
                let name = name.trim_end_matches(';').to_string();
                let floor = current.ok_or_else(|| format!("module {name} stands on no floor"))?;
                floors.insert(name, floor);
            }
        }
        Ok(Self(floors))
    }

    fn of(&self, room: &str) -> Option<u32> {
        self.0.get(room).copied()
    }
}

impl Source {
    /// A source of which the text is known.
    pub fn new(path: &str, text: &str) -> Self {
        Self { path: path.to_string(), module: module_of(path), tokens: tokens(text) }
    }

    /// Reads a file.
    pub fn read(path: &Path) -> Self {
        let text = std::fs::read_to_string(path).expect("a readable source file");
        Self::new(&path.to_string_lossy(), &text)
    }
}

/// Every breach of the rules, as `file:line: rule`.
pub fn violations(floors: &Floors, sources: &[Source]) -> Vec<String> {
    let mut found = Vec::new();
    let mut ground = BTreeMap::new();
    for source in sources {
        check_unsafe(source, &mut found);
        let Some(module) = &source.module else { continue };
        check_prints(source, module, &mut found);
        check_imports(floors, source, module, &mut ground, &mut found);
    }
    check_circle(&ground, &mut found);
    found
}

fn check_unsafe(source: &Source, found: &mut Vec<String>) {
    let path = &source.path;
    if path.starts_with("src/embree/") || path.starts_with("src/cluster/mpi") {
        return;
    }
    for token in source.tokens.iter().filter(|t| t.text == "unsafe") {
        found.push(format!(
            "{path}:{}: unsafe belongs in ffi/, src/embree/, src/cluster/mpi.rs and src/cluster/mpi/ only",
            token.line
        ));
    }
}

fn check_prints(source: &Source, module: &modules::Path, found: &mut Vec<String>) {
    if module[0] == "cli" || module.iter().any(|name| name == "tests") {
        return;
    }
    let printers = ["print", "println", "eprint", "eprintln", "dbg"];
    walk(&source.tokens, |i, modules| {
        let [word, bang, ..] = &source.tokens[i..] else { return };
        let tests = modules.contains(&"tests");
        if bang.text == "!" && printers.contains(&word.text.as_str()) && !tests {
            found.push(format!(
                "{}:{}: {}! prints, and only src/cli and src/main.rs talk to a person",
                source.path, word.line, word.text
            ));
        }
    });
}

/// Edges of the import graph of floor 0, each with the line that makes it.
type Ground = BTreeMap<String, BTreeMap<String, String>>;

fn check_imports(
    floors: &Floors,
    source: &Source,
    module: &modules::Path,
    ground: &mut Ground,
    found: &mut Vec<String>,
) {
    let room = module[0].as_str();
    let Some(floor) = floors.of(room) else {
        found.push(format!("{}: room {room} stands on no floor in src/lib.rs", source.path));
        return;
    };
    for RootName { name, line } in root_names(module, &source.tokens) {
        let place = format!("{}:{line}", source.path);
        match floors.of(&name) {
            _ if name == room => {}
            None => found.push(format!("{place}: crate::{name} names no room of src/lib.rs")),
            Some(0) if floor == 0 => {
                ground.entry(room.to_string()).or_default().insert(name, place);
            }
            Some(other) if other >= floor => found.push(format!(
                "{place}: {room} (floor {floor}) imports {name} (floor {other}), which is {}",
                if other == floor { "on the same floor" } else { "on a higher floor" }
            )),
            Some(_) => {}
        }
    }
}

/// Rooms of floor 0 may import one another as long as they form no circle.
fn check_circle(ground: &Ground, found: &mut Vec<String>) {
    let mut left: BTreeSet<&String> = ground.keys().collect();
    // Take away rooms whose imports are all gone; what cannot be taken away is in a circle, or
    // leads to one.
    loop {
        let free: Vec<&String> =
            left.iter().copied().filter(|r| ground[*r].keys().all(|n| !left.contains(n))).collect();
        if free.is_empty() {
            break;
        }
        free.iter().for_each(|room| _ = left.remove(*room));
    }
    if !left.is_empty() {
        let edges: Vec<String> = left
            .iter()
            .flat_map(|r| {
                ground[*r].iter().map(move |(to, place)| format!("{r} -> {to} ({place})"))
            })
            .collect();
        found.push(format!("floor 0 imports in a circle: {}", edges.join(", ")));
    }
}

/// Calls `visit` with the index of every token and the names of the inline modules around it.
fn walk(tokens: &[Token], mut visit: impl FnMut(usize, &[&str])) {
    let mut modules: Vec<&str> = Vec::new();
    // For each open brace, whether it opened a module.
    let mut braces: Vec<bool> = Vec::new();
    for (i, token) in tokens.iter().enumerate() {
        visit(i, &modules);
        match token.text.as_str() {
            "{" => {
                let module = i >= 2 && tokens[i - 2].text == "mod";
                if module {
                    modules.push(&tokens[i - 1].text);
                }
                braces.push(module);
            }
            "}" if braces.pop() == Some(true) => _ = modules.pop(),
            _ => {}
        }
    }
}
