//! Which file defines what, and which file uses what of which other.
//!
//! A use is a path in the code: in a `use`, or anywhere else if it begins with `crate`, `super`, `self`
//! or a child module. It leads to the file that defines the name: a re-export is followed. Inline modules
//! called `tests` are left out. Methods that an `impl` adds to a type of another file are not seen.

use super::lexer::{Token, tokens};
use super::use_tree::{Leaf, leaves};
use std::collections::{BTreeMap, BTreeSet};

/// A module path below the crate's root: `["output", "manifest"]`.
pub type Path = Vec<String>;

/// All modules of a crate.
#[derive(Default)]
pub struct Modules {
    modules: BTreeMap<Path, Module>,
}

/// What one module holds.
#[derive(Default)]
struct Module {
    file: String,
    /// Names of items and of inline modules.
    items: BTreeSet<String>,
    /// Names that `use` brings, and the paths that they stand for.
    bindings: BTreeMap<String, Path>,
    /// Paths of `use path::*`.
    globs: Vec<Path>,
}

/// A public type.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct PublicType {
    /// Its name.
    pub name: String,
    /// The file that defines it.
    pub file: String,
    /// Line, from 1.
    pub line: usize,
}

/// One file uses an item that another defines.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct FileUse {
    /// The file that uses it.
    pub from: String,
    /// The file that defines it.
    pub to: String,
    /// Where the first use stands.
    pub line: usize,
    /// The path as written there, from the crate's root.
    pub path: String,
}

/// What files hold.
#[derive(Default)]
pub struct Found {
    /// All public types.
    pub types: Vec<PublicType>,
    /// Every pair of files of which one uses the other, once.
    pub uses: Vec<FileUse>,
}

/// The name right below the crate's root through which a path leads.
pub struct RootName {
    /// The name; `self` for the root itself, or for all that lies below it.
    pub name: String,
    /// Line, from 1.
    pub line: usize,
}

/// A path as it stands in the code of `module`.
struct Written {
    module: Path,
    path: Path,
    line: usize,
}

/// A `pub use`, which makes `name`, or all names of a module.
struct Export {
    path: Written,
    name: Option<String>,
}

/// A file read into items and paths.
#[derive(Default)]
struct Scan {
    modules: Vec<(Path, Module)>,
    types: Vec<PublicType>,
    paths: Vec<Written>,
    exports: Vec<Export>,
    /// All paths in inline modules called `tests`.
    of_tests: Vec<Written>,
    /// Every word outside `use`.
    words: BTreeSet<String>,
}

impl Modules {
    /// Reads files, each a path as `src/room/part.rs` and its text.
    pub fn read_texts(files: &[(&str, &str)]) -> Found {
        let scans: Vec<(&str, Scan)> = files
            .iter()
            .filter_map(|(file, text)| {
                Some((*file, Scan::of(file, module_of(file)?, &tokens(text))))
            })
            .collect();
        let mut all = Self::default();
        let mut found = Found::default();
        let mut paths = Vec::new();
        for (file, scan) in scans {
            all.modules.extend(scan.modules);
            found.types.extend(scan.types);
            let is_used = |e: &Export| e.name.as_ref().is_some_and(|n| scan.words.contains(n));
            let exports = scan.exports.into_iter().filter(is_used).map(|export| export.path);
            paths.extend(scan.paths.into_iter().chain(exports).map(|path| (file, path)));
        }
        for (file, Written { module, path, line }) in paths {
            let to = all.file_of(&module, &path, 0).filter(|to| to != file);
            let path = path.join("::");
            found.uses.extend(to.map(|to| FileUse { from: file.to_string(), to, line, path }));
        }
        found.uses.sort();
        found.uses.dedup_by(|b, a| (&a.from, &a.to) == (&b.from, &b.to));
        found
    }

    /// The file that defines what `path`, written in module `from`, leads to; `None` outside the crate.
    fn file_of(&self, from: &Path, path: &[String], depth: usize) -> Option<String> {
        let (at, rest) = start(from, path)?;
        if rest.len() == path.len() && !self.knows(&at, &rest[0]) {
            return None;
        }
        self.walk(at, rest, depth)
    }

    fn knows(&self, module: &Path, name: &str) -> bool {
        let child = [module.as_slice(), &[name.to_string()]].concat();
        self.modules.contains_key(&child)
            || self.modules.get(module).is_some_and(|m| m.bindings.contains_key(name))
    }

    fn walk(&self, mut at: Path, mut rest: &[String], depth: usize) -> Option<String> {
        while let Some((name, tail)) = rest.split_first() {
            let child = [at.as_slice(), std::slice::from_ref(name)].concat();
            if self.modules.contains_key(&child) {
                (at, rest) = (child, tail);
                continue;
            }
            let module = self.modules.get(&at)?;
            // A circle of re-exports does not compile; the limit is for text that does not.
            if module.items.contains(name) || depth > 20 {
                break;
            }
            if let Some(bound) = module.bindings.get(name) {
                return self.file_of(&at, &[bound.as_slice(), tail].concat(), depth + 1);
            }
            let through = |glob: &Path| {
                let path = [glob.as_slice(), rest].concat();
                self.file_of(&at, &path, depth + 1)
            };
            return module.globs.iter().find_map(through).or(Some(module.file.clone()));
        }
        Some(self.modules.get(&at)?.file.clone())
    }
}

/// The module to which the first words of `path`, written in module `from`, lead, and the names behind them;
/// `None` beyond the crate's root.
fn start<'p>(from: &Path, path: &'p [String]) -> Option<(Path, &'p [String])> {
    let mut at = from.clone();
    let mut rest = path;
    while let Some((head, tail)) = rest.split_first() {
        match head.as_str() {
            "crate" => at.clear(),
            "self" => {}
            "super" => _ = at.pop()?,
            _ => break,
        }
        rest = tail;
    }
    Some((at, rest))
}

/// Where the paths in a file of module `module` that begin at the crate's root lead first, tests included.
pub fn root_names(module: &Path, tokens: &[Token]) -> Vec<RootName> {
    let Scan { paths, exports, of_tests, .. } = Scan::of("", module.clone(), tokens);
    let exports = exports.into_iter().map(|export| export.path);
    let name = |Written { module, path, line }: Written| {
        let (at, rest) = start(&module, &path)?;
        let is_rooted = at.is_empty() && rest.len() < path.len();
        let name = rest.first().map_or("self", String::as_str).to_string();
        is_rooted.then_some(RootName { name, line })
    };
    paths.into_iter().chain(exports).chain(of_tests).filter_map(name).collect()
}

/// Module path of a file of `src`; `None` for the crate's root and other files.
pub fn module_of(file: &str) -> Option<Path> {
    let inside = file.strip_prefix("src/")?.strip_suffix(".rs")?;
    let inside = inside.strip_suffix("/mod").unwrap_or(inside);
    (!matches!(inside, "lib" | "main")).then(|| inside.split('/').map(String::from).collect())
}

impl Scan {
    fn of(file: &str, module: Path, tokens: &[Token]) -> Self {
        let mut scan = Self::default();
        scan.block(tokens, 0, module, file);
        scan
    }

    /// Reads a module's items from token `i` on; returns the index past its closing brace.
    fn block(&mut self, tokens: &[Token], mut i: usize, path: Path, file: &str) -> usize {
        let mut module = Module { file: file.to_string(), ..Module::default() };
        // Braces of functions, types and the like that are open.
        let mut depth = 0;
        while let Some(token) = tokens.get(i) {
            let word = token.text.as_str();
            let after = |n: usize| tokens.get(i + n).map_or("", |t| t.text.as_str());
            match word {
                "{" => depth += 1,
                "}" if depth == 0 => break,
                "}" => depth -= 1,
                "use" => {
                    i = self.read_use(tokens, i, &path, (depth == 0).then_some(&mut module));
                    continue;
                }
                "mod" if after(2) == "{" => {
                    let child = [path.as_slice(), &[after(1).to_string()]].concat();
                    i = match after(1) {
                        "tests" => self.tests(tokens, i + 3, child, file),
                        _ => self.block(tokens, i + 3, child, file),
                    };
                    continue;
                }
                "struct" | "enum" | "union" | "trait" | "type" | "fn" | "const" | "static"
                    if depth == 0 =>
                {
                    module.items.insert(after(1).to_string());
                    if is_type(word) && is_public(tokens, i) {
                        let (name, file) = (after(1).to_string(), file.to_string());
                        self.types.push(PublicType { name, file, line: token.line });
                    }
                }
                "macro_rules" => _ = module.items.insert(after(2).to_string()),
                _ => {}
            }
            let starts = i == 0 || tokens[i - 1].text != "::";
            if starts && after(1) == "::" && is_word(word) {
                let (module, line) = (path.clone(), token.line);
                self.paths.push(Written { module, path: plain_path(tokens, i), line });
            }
            self.words.insert(word.to_string());
            i += 1;
        }
        self.modules.push((path, module));
        i + 1
    }

    /// Reads the paths of a module called `tests`, as [`block`](Self::block) does.
    fn tests(&mut self, tokens: &[Token], i: usize, path: Path, file: &str) -> usize {
        let mut inside = Self::default();
        let end = inside.block(tokens, i, path, file);
        self.of_tests.extend(inside.paths);
        self.of_tests.extend(inside.exports.into_iter().map(|export| export.path));
        self.of_tests.extend(inside.of_tests);
        end
    }

    /// Reads the `use` at token `i` of the module `within`; returns the index past its `;`. `module` takes
    /// the names.
    fn read_use(
        &mut self,
        tokens: &[Token],
        i: usize,
        within: &Path,
        mut module: Option<&mut Module>,
    ) -> usize {
        let is_export =
            matches!(i.checked_sub(1).map(|b| tokens[b].text.as_str()), Some("pub" | ")"));
        let end = (i..tokens.len()).find(|e| tokens[*e].text == ";").unwrap_or(tokens.len());
        for Leaf { path, name, line } in leaves(&tokens[i + 1..end]) {
            match (module.as_deref_mut(), &name) {
                (Some(m), Some(name)) => _ = m.bindings.insert(name.clone(), path.clone()),
                (Some(m), None) => m.globs.push(path.clone()),
                (None, _) => {}
            }
            let path = Written { module: within.clone(), path, line };
            match is_export {
                true => self.exports.push(Export { path, name }),
                false => self.paths.push(path),
            }
        }
        end + 1
    }
}

fn is_type(word: &str) -> bool {
    matches!(word, "struct" | "enum" | "union" | "trait" | "type")
}

/// Whether the item whose keyword is token `i` is `pub` or `pub(crate)`.
fn is_public(tokens: &[Token], i: usize) -> bool {
    let before: Vec<&str> =
        tokens[i.saturating_sub(4)..i].iter().map(|t| t.text.as_str()).collect();
    before.ends_with(&["pub"]) || before.ends_with(&["pub", "(", "crate", ")"])
}

fn is_word(text: &str) -> bool {
    text.starts_with(|c: char| c.is_alphabetic() || c == '_')
}

/// The words joined by `::` from token `i` on.
fn plain_path(tokens: &[Token], mut i: usize) -> Path {
    let mut path = vec![tokens[i].text.clone()];
    while let [colons, word, ..] = &tokens[i + 1..] {
        if colons.text != "::" || !is_word(&word.text) {
            break;
        }
        path.push(word.text.clone());
        i += 2;
    }
    path
}
