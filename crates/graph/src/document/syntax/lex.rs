//! Tokens of the graph file's notation, each with its span; comments are separate.

use std::ops::Range;

use crate::diagnostic::Diagnostic;

/// The kind of a token.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TokenKind {
    /// `(`, `[` or `{`.
    Open(Bracket),
    /// `)`, `]` or `}`.
    Close(Bracket),
    Comma,
    Colon,
    /// Something that begins like a number; whether it is one is checked when it is read.
    Number,
    /// A bare word.
    Word,
    /// A string in quotes.
    Text,
    /// An unclosed string; already reported.
    Broken,
}

/// A pair of brackets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Bracket {
    Round,
    Square,
    Curly,
}

impl Bracket {
    pub(crate) const fn open(self) -> char {
        match self {
            Self::Round => '(',
            Self::Square => '[',
            Self::Curly => '{',
        }
    }

    pub(crate) const fn close(self) -> char {
        match self {
            Self::Round => ')',
            Self::Square => ']',
            Self::Curly => '}',
        }
    }
}

/// A token.
#[derive(Clone, Debug)]
pub(crate) struct Token {
    pub(crate) kind: TokenKind,
    /// Offsets of its first byte and of the byte after it, in four bytes each: a text has many tokens.
    start: u32,
    end: u32,
}

impl Token {
    pub(super) const fn start(&self) -> usize {
        self.start as usize
    }

    pub(super) const fn end(&self) -> usize {
        self.end as usize
    }

    pub(crate) const fn span(&self) -> Range<usize> {
        self.start()..self.end()
    }
}

/// A comment.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Comment {
    pub(crate) span: Range<usize>,
    /// True if it runs to the end of its line.
    pub(crate) line: bool,
}

/// Tokens, comments and problems, in file order.
#[derive(Debug, Default)]
pub(crate) struct Lexed {
    pub(crate) tokens: Vec<Token>,
    pub(crate) comments: Vec<Comment>,
    pub(crate) mistakes: Mistakes,
}

/// The largest number of syntax errors that are listed.
pub(super) const MAX_PROBLEMS: usize = 100;

/// A text with more syntax errors is not read to its end: it is not a graph file.
const MAX_MISTAKES: usize = 10_000;

/// Syntax errors: the first of them, and the offsets of all.
#[derive(Debug, Default)]
pub(crate) struct Mistakes {
    /// At most one more than are listed, which shows that there are more.
    pub(crate) first: Vec<Diagnostic>,
    pub(crate) places: Vec<usize>,
}

impl Mistakes {
    pub(super) fn push(&mut self, problem: Diagnostic) {
        self.places.push(problem.span.start);
        if self.first.len() <= MAX_PROBLEMS {
            self.first.push(problem);
        }
    }

    /// Returns true if the rest of the text is not worth reading.
    pub(super) const fn is_hopeless(&self) -> bool {
        self.places.len() > MAX_MISTAKES
    }
}

/// Splits a source. Every byte belongs to a token, a comment, white space or a problem.
pub(crate) fn lex(source: &str) -> Lexed {
    let mut out = Lexed::default();
    let mut at = if source.starts_with('\u{feff}') { 3 } else { 0 };
    if u32::try_from(source.len()).is_err() {
        out.mistakes.push(Diagnostic::error("syntax", 0..0, "the text has more than 4 GiB"));
        return out;
    }
    while let Some(c) = source[at..].chars().next().filter(|_| !out.mistakes.is_hopeless()) {
        let start = at;
        let rest = &source[at..];
        let single = match c {
            '(' => Some(TokenKind::Open(Bracket::Round)),
            '[' => Some(TokenKind::Open(Bracket::Square)),
            '{' => Some(TokenKind::Open(Bracket::Curly)),
            ')' => Some(TokenKind::Close(Bracket::Round)),
            ']' => Some(TokenKind::Close(Bracket::Square)),
            '}' => Some(TokenKind::Close(Bracket::Curly)),
            ',' => Some(TokenKind::Comma),
            ':' => Some(TokenKind::Colon),
            _ => None,
        };
        let kind = if let Some(kind) = single {
            at += 1;
            kind
        } else if c.is_whitespace() {
            at += c.len_utf8();
            continue;
        } else if rest.starts_with("//") {
            at += rest.find('\n').unwrap_or(rest.len());
            // A carriage return before the line feed is white space, not part of the comment.
            let end = start + source[start..at].trim_end().len();
            out.comments.push(Comment { span: start..end, line: true });
            continue;
        } else if rest.starts_with("/*") {
            at = block_comment(source, start, &mut out.mistakes);
            out.comments.push(Comment { span: start..at, line: false });
            continue;
        } else if c == '"' {
            text(source, start, &mut at, &mut out.mistakes)
        } else if let Some(len) = single_quoted(rest) {
            at += len;
            let problem = Diagnostic::error("syntax", start..at, "text needs double quotes");
            out.mistakes.push(problem.hint(format!("write \"{}\"", &source[start + 1..at - 1])));
            TokenKind::Text
        } else if let Some(hashes) = raw_text_hashes(rest) {
            raw_text(source, start, hashes, &mut at, &mut out.mistakes)
        } else if c.is_ascii_digit() || matches!(c, '+' | '-' | '.') {
            at += rest.find(|c: char| !is_number_char(c)).unwrap_or(rest.len());
            TokenKind::Number
        } else if is_word_start(c) {
            at += rest.find(|c: char| !is_word_char(c)).unwrap_or(rest.len());
            TokenKind::Word
        } else {
            at += rest.find(|c: char| !is_stray(c)).unwrap_or(rest.len()).max(c.len_utf8());
            out.mistakes.push(stray(source, start..at));
            continue;
        };
        out.tokens.push(Token { kind, start: start as u32, end: at as u32 });
    }
    out
}

/// Length in bytes of a string in single quotes, as in other notations.
fn single_quoted(rest: &str) -> Option<usize> {
    let inner = rest.strip_prefix('\'')?;
    let len = inner.find(['\'', '\n', '"'])?;
    inner[len..].starts_with('\'').then_some(len + 2)
}

fn is_number_char(c: char) -> bool {
    c.is_alphanumeric() || matches!(c, '+' | '-' | '.' | '_')
}

fn is_word_start(c: char) -> bool {
    c.is_alphabetic() || c == '_'
}

fn is_word_char(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// Returns true if no token begins with the character.
fn is_stray(c: char) -> bool {
    !(is_number_char(c) || c.is_whitespace() || matches!(c, '(' | '[' | '{' | ')' | ']' | '}' | ',' | ':' | '"' | '/'))
}

fn stray(source: &str, span: Range<usize>) -> Diagnostic {
    let text: String =
        source[span.clone()].chars().take(20).map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect();
    let problem = Diagnostic::error("syntax", span, format!("`{text}` has no meaning here"));
    match text.chars().next() {
        Some('\'' | '`' | '“' | '”' | '‘' | '’') => problem.hint("write text in double quotes: \"…\""),
        Some('#') => problem.hint("a comment begins with `//`"),
        Some('=') => problem.hint("a name and its value are written `name: value`"),
        Some(';') => problem.hint("separate items in brackets by commas"),
        _ => problem.hint("remove it"),
    }
}

/// The end of a block comment, which may contain others.
fn block_comment(source: &str, start: usize, problems: &mut Mistakes) -> usize {
    let bytes = source.as_bytes();
    let (mut depth, mut at) = (0_usize, start);
    while at < bytes.len() {
        match &bytes[at..bytes.len().min(at + 2)] {
            b"/*" => {
                depth += 1;
                at += 2;
            }
            b"*/" => {
                depth -= 1;
                at += 2;
                if depth == 0 {
                    return at;
                }
            }
            _ => at += 1,
        }
    }
    problems
        .push(Diagnostic::error("syntax", start..start + 2, "the comment is not closed").hint("close it with `*/`"));
    source.len()
}

/// Finds the end of a string in quotes. A string ends on its line, so that a missing quote spoils one line, not the
/// file.
fn text(source: &str, start: usize, at: &mut usize, problems: &mut Mistakes) -> TokenKind {
    let mut chars = source[start + 1..].char_indices();
    while let Some((i, c)) = chars.next() {
        match c {
            '"' => {
                *at = start + 1 + i + 1;
                return TokenKind::Text;
            }
            '\n' => break,
            // A line feed cannot be escaped.
            '\\' if !chars.as_str().starts_with(['\n', '\r']) => {
                chars.next();
            }
            _ => {}
        }
    }
    unclosed_text(source, start, at, problems)
}

/// Ends an unclosed string before the brackets and commas at the end of its line, which probably do not belong to it.
fn unclosed_text(source: &str, start: usize, at: &mut usize, problems: &mut Mistakes) -> TokenKind {
    let line = source[start..].split('\n').next().unwrap_or("");
    let text = line.trim_end_matches(|c: char| c.is_whitespace() || matches!(c, ',' | ')' | ']' | '}'));
    *at = start + text.len().max(1);
    let problem = Diagnostic::error("syntax", start..*at, "the text is not closed on its line");
    problems.push(problem.hint("close it with `\"`"));
    TokenKind::Broken
}

/// Number of `#` of a raw string `r"…"` or `r#"…"#`.
fn raw_text_hashes(rest: &str) -> Option<usize> {
    let rest = rest.strip_prefix('r')?;
    let hashes = rest.bytes().take_while(|b| *b == b'#').count();
    rest[hashes..].starts_with('"').then_some(hashes)
}

fn raw_text(source: &str, start: usize, hashes: usize, at: &mut usize, problems: &mut Mistakes) -> TokenKind {
    let body = start + 2 + hashes;
    let line = source[body..].split('\n').next().unwrap_or("");
    let closing = format!("\"{}", "#".repeat(hashes));
    match line.find(&closing) {
        Some(end) => {
            *at = body + end + closing.len();
            TokenKind::Text
        }
        None => unclosed_text(source, start, at, problems),
    }
}

/// The contents of a string token.
///
/// # Errors
/// The place of an invalid escape sequence, from the token's start.
pub(crate) fn decode_text(token: &str) -> Result<String, Range<usize>> {
    if let Some(hashes) = raw_text_hashes(token) {
        let inner = token.get(2 + hashes..token.len().saturating_sub(1 + hashes)).unwrap_or("");
        return Ok(inner.to_owned());
    }
    let body = &token[1..token.len() - 1];
    let mut out = String::with_capacity(body.len());
    let mut chars = body.char_indices();
    while let Some((at, c)) = chars.next() {
        if c != '\\' {
            out.push(c);
            continue;
        }
        let escape = chars.next().map(|(_, c)| c);
        let plain = match escape {
            Some('n') => Some('\n'),
            Some('r') => Some('\r'),
            Some('t') => Some('\t'),
            Some('0') => Some('\0'),
            Some(c @ ('\\' | '"' | '\'')) => Some(c),
            Some('x') => code(&mut chars, 2),
            Some('u') if chars.as_str().starts_with('{') => {
                chars.next();
                let digits = chars.as_str().find('}').filter(|n| *n <= 6);
                let found = digits.and_then(|n| code(&mut chars, n));
                chars.next();
                found
            }
            _ => None,
        };
        match plain {
            Some(c) => out.push(c),
            None => return Err(1 + at..1 + at + 1 + escape.map_or(0, char::len_utf8)),
        }
    }
    Ok(out)
}

/// The character whose code is the next `digits` hexadecimal digits.
fn code(chars: &mut std::str::CharIndices<'_>, digits: usize) -> Option<char> {
    let text = chars.as_str().get(..digits)?;
    if !text.bytes().all(|b| b.is_ascii_hexdigit()) {
        return None;
    }
    for _ in 0..digits {
        chars.next();
    }
    char::from_u32(u32::from_str_radix(text, 16).ok()?)
}

/// A string as a token, with escape sequences where necessary.
pub(crate) fn quote(text: &str) -> String {
    let mut out = String::with_capacity(text.len() + 2);
    out.push('"');
    for c in text.chars() {
        match c {
            '"' => out.push_str("\\\""),
            '\\' => out.push_str("\\\\"),
            '\n' => out.push_str("\\n"),
            '\r' => out.push_str("\\r"),
            '\t' => out.push_str("\\t"),
            c if c.is_control() => out.push_str(&format!("\\u{{{:x}}}", u32::from(c))),
            c => out.push(c),
        }
    }
    out.push('"');
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_are_read_and_written() {
        for text in ["", "a\"b\\c", "tab\tand\nline", "\u{7}", "höhe", "\u{10ffff}"] {
            assert_eq!(decode_text(&quote(text)).as_deref(), Ok(text));
        }
        assert_eq!(decode_text(r##"r#"a"\b"#"##).as_deref(), Ok(r#"a"\b"#));
        assert_eq!(decode_text(r#""\x41\u{e9}""#).as_deref(), Ok("Aé"));
        assert_eq!(decode_text(r#""ab\q""#), Err(3..5));
        assert_eq!(decode_text(r#""\u{110000}""#), Err(1..3));
    }

    #[test]
    fn mistakes_spoil_their_line_only() {
        let lexed = lex("a: \"open\nb: 'x', /* /* c */ */ é = ; // end\r\n/* open");
        let messages: Vec<&str> = lexed.mistakes.first.iter().map(|p| p.message.as_str()).collect();
        assert_eq!(
            messages,
            [
                "the text is not closed on its line",
                "text needs double quotes",
                "`=` has no meaning here",
                "`;` has no meaning here",
                "the comment is not closed"
            ]
        );
        assert_eq!(lexed.comments.len(), 3);
        assert!(lexed.comments[1].line && !lexed.comments[0].line);
    }
}
