//! Rust text to tokens: enough to find paths, keywords and macro names, with their lines.

/// An identifier or keyword, a `::`, or one other character. Comments, strings, characters and
/// numbers are left out; lifetimes too.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Token {
    /// What stands there.
    pub text: String,
    /// Line, from 1.
    pub line: usize,
}

/// All tokens of `source`.
pub fn tokens(source: &str) -> Vec<Token> {
    let mut lexer = Lexer { chars: source.chars().collect(), at: 0, line: 1 };
    let mut all = Vec::new();
    while let Some(token) = lexer.next_token() {
        all.push(token);
    }
    all
}

struct Lexer {
    chars: Vec<char>,
    at: usize,
    line: usize,
}

impl Lexer {
    fn peek(&self, ahead: usize) -> char {
        self.chars.get(self.at + ahead).copied().unwrap_or('\0')
    }

    fn skip(&mut self, count: usize) {
        let end = (self.at + count).min(self.chars.len());
        self.line += self.chars[self.at..end].iter().filter(|c| **c == '\n').count();
        self.at = end;
    }

    fn next_token(&mut self) -> Option<Token> {
        while self.at < self.chars.len() {
            let (c, next) = (self.peek(0), self.peek(1));
            match (c, next) {
                ('/', '/') => self.skip_while(|c| c != '\n'),
                ('/', '*') => self.block_comment(),
                ('"', _) => self.string(),
                ('\'', _) => self.char_or_lifetime(),
                (':', ':') => return Some(self.take(2)),
                _ if c.is_whitespace() => self.skip(1),
                _ if c.is_ascii_digit() => self.skip_while(is_word),
                _ if is_word(c) => {
                    if let Some(token) = self.word() {
                        return Some(token);
                    }
                }
                _ => return Some(self.take(1)),
            }
        }
        None
    }

    fn take(&mut self, count: usize) -> Token {
        let token =
            Token { text: self.chars[self.at..self.at + count].iter().collect(), line: self.line };
        self.skip(count);
        token
    }

    fn skip_while(&mut self, belongs: impl Fn(char) -> bool) {
        while self.at < self.chars.len() && belongs(self.peek(0)) {
            self.skip(1);
        }
    }

    fn block_comment(&mut self) {
        let mut depth = 0;
        while self.at < self.chars.len() {
            match (self.peek(0), self.peek(1)) {
                ('/', '*') => depth += 1,
                ('*', '/') => depth -= 1,
                _ => {
                    self.skip(1);
                    continue;
                }
            }
            self.skip(2);
            if depth == 0 {
                return;
            }
        }
    }

    /// From the opening `"` to the closing one.
    fn string(&mut self) {
        self.skip(1);
        while self.at < self.chars.len() && self.peek(0) != '"' {
            self.skip(if self.peek(0) == '\\' { 2 } else { 1 });
        }
        self.skip(1);
    }

    /// From the first `#` or `"` after the `r`.
    fn raw_string(&mut self) {
        let hashes = (0..).take_while(|i| self.peek(*i) == '#').count();
        self.skip(hashes + 1);
        while self.at < self.chars.len() {
            let closes = self.peek(0) == '"' && (1..=hashes).all(|i| self.peek(i) == '#');
            self.skip(1);
            if closes {
                self.skip(hashes);
                return;
            }
        }
    }

    fn char_or_lifetime(&mut self) {
        if self.peek(1) == '\\' {
            self.skip(3);
            self.skip_while(|c| c != '\'');
            self.skip(1);
        } else if self.peek(2) == '\'' {
            self.skip(3);
        } else {
            self.skip(1);
            self.skip_while(is_word);
        }
    }

    /// An identifier, or nothing where it is the prefix of a string.
    fn word(&mut self) -> Option<Token> {
        let length = (0..).take_while(|i| is_word(self.peek(*i))).count();
        let token = self.take(length);
        let raw = matches!(token.text.as_str(), "r" | "br" | "cr");
        if raw && (self.peek(0) == '"' || self.peek(0) == '#' && "\"#".contains(self.peek(1))) {
            self.raw_string();
            return None;
        }
        // The prefixes b and c need no care: what follows lexes as a plain string.
        Some(token)
    }
}

fn is_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}
