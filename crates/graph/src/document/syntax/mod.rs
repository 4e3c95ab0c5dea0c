//! The syntax tree of a graph file, with the spans of everything in it; parsing continues after a mistake.

pub(crate) mod format;
pub(crate) mod lex;
pub(crate) mod literal;
pub(crate) mod splice;

use std::ops::Range;

use self::lex::{Bracket, Comment, MAX_PROBLEMS, Mistakes, Token, TokenKind, decode_text, lex};
use crate::diagnostic::Diagnostic;

/// Brackets nested deeper than this are refused; a graph file needs six.
const MAX_DEPTH: usize = 64;

/// The fields of a graph file.
pub(super) const FIELDS: [&str; 12] = [
    "format",
    "world",
    "inputs",
    "parameters",
    "nodes",
    "muted",
    "outputs",
    "expect",
    "layout",
    "reroutes",
    "notes",
    "frames",
];

/// A file as a tree. Spans are byte offsets into the source it was parsed from.
#[derive(Clone, Debug, Default)]
pub(super) struct Tree {
    /// The outermost value; `None` for an empty file.
    pub(super) root: Option<Expr>,
    /// All comments, in file order.
    pub(super) comments: Vec<Comment>,
}

/// A value with its span.
#[derive(Clone, Debug)]
pub(super) struct Expr {
    pub(super) span: Range<usize>,
    pub(super) kind: ExprKind,
}

/// The kind of a value.
#[derive(Clone, Debug)]
pub(super) enum ExprKind {
    /// Something that begins like a number.
    Number,
    /// A bare word.
    Word,
    /// A string in quotes, decoded.
    Text(String),
    /// Items in brackets.
    Group(Box<Group>),
    /// Nothing, or something that could not be read; already reported.
    Bad,
}

/// Items in brackets, with or without a name before them.
#[derive(Clone, Debug)]
pub(super) struct Group {
    /// The word before the brackets.
    pub(super) name: Option<Range<usize>>,
    pub(super) bracket: Bracket,
    /// Offset of the opening bracket.
    pub(super) open: usize,
    /// Offset of the closing bracket; `None` where it is missing.
    pub(super) close: Option<usize>,
    pub(super) items: Vec<Item>,
}

/// One item in brackets.
#[derive(Clone, Debug)]
pub(super) struct Item {
    pub(super) key: Option<Box<Key>>,
    pub(super) value: Expr,
    /// Offset of the comma after it.
    pub(super) comma: Option<usize>,
}

/// The name of an item in brackets.
#[derive(Clone, Debug)]
pub(super) struct Key {
    pub(super) span: Range<usize>,
    pub(super) text: String,
}

impl Expr {
    /// The brackets. Returns None when the value is something else.
    pub(super) fn as_group(&self) -> Option<&Group> {
        match &self.kind {
            ExprKind::Group(group) => Some(group),
            _ => None,
        }
    }
}

impl Group {
    /// Position of the item of that name.
    pub(super) fn position(&self, name: &str) -> Option<usize> {
        self.items.iter().position(|item| item.key.as_ref().is_some_and(|key| key.text == name))
    }

    /// The item of that name.
    pub(super) fn get(&self, name: &str) -> Option<&Item> {
        self.items.get(self.position(name)?)
    }
}

impl Item {
    /// From its name, or from its value if it has none, to its end without the comma.
    pub(super) fn span(&self) -> Range<usize> {
        self.key.as_ref().map_or(self.value.span.start, |key| key.span.start)..self.value.span.end
    }
}

/// Parses a source; always returns a tree, with all syntax errors.
pub(super) fn parse(source: &str) -> (Tree, Vec<Diagnostic>) {
    let lexed = lex(source);
    let mut parser = Parser {
        source,
        tokens: &lexed.tokens,
        strays: &lexed.mistakes.places,
        next: 0,
        open: Vec::new(),
        problems: Mistakes::default(),
        unclosed: false,
        too_deep: false,
    };
    let root = (!lexed.tokens.is_empty()).then(|| parser.value());
    if let Some(token) = parser.peek() {
        let (message, hint) = match root.as_ref().map(|root| &root.kind) {
            Some(ExprKind::Group(_)) => (
                "the file continues after its closing bracket",
                "remove what follows, or look for a bracket that closes too early",
            ),
            _ => (
                "a graph file needs round brackets around it",
                "a graph file is `( format: 1, nodes: { … }, outputs: { … } )`",
            ),
        };
        parser.problems.push(Diagnostic::error("syntax", token.span(), message).hint(hint));
    }
    let found = parser.problems.first;
    let mut problems = lexed.mistakes.first;
    problems.extend(found);
    problems.sort_by_key(|problem| problem.span.start);
    if problems.len() > MAX_PROBLEMS {
        problems.truncate(MAX_PROBLEMS);
        let end = problems.last().map_or(0, |problem| problem.span.end);
        problems.push(Diagnostic::error("syntax", end..end, "there are more syntax errors after these"));
    }
    (Tree { root, comments: lexed.comments }, problems)
}

/// Parses a single value, such as one typed on a command line. Returns None when the text is not exactly one value.
pub(super) fn parse_value(source: &str) -> Option<Expr> {
    let (tree, problems) = parse(source);
    if problems.is_empty() && tree.comments.is_empty() { tree.root } else { None }
}

struct Parser<'a> {
    source: &'a str,
    tokens: &'a [Token],
    /// Offsets of characters in the source that are not tokens, ascending.
    strays: &'a [usize],
    next: usize,
    /// Open brackets, from the outermost.
    open: Vec<Bracket>,
    problems: Mistakes,
    /// True if a missing closing bracket was reported at the end of the file.
    unclosed: bool,
    /// True if too deep nesting was reported.
    too_deep: bool,
}

impl<'a> Parser<'a> {
    fn peek(&self) -> Option<&'a Token> {
        self.tokens.get(self.next)
    }

    fn peek_kind(&self, ahead: usize) -> Option<TokenKind> {
        self.tokens.get(self.next + ahead).map(|token| token.kind)
    }

    fn problem(&mut self, span: Range<usize>, message: impl Into<String>, hint: &str) {
        self.problems.push(Diagnostic::error("syntax", span, message).hint(hint));
    }

    /// Returns true if something that is not a token, and was already reported, precedes the next token.
    fn after_stray(&self) -> bool {
        let next = self.peek().map_or(self.source.len(), |token| token.start());
        let first = self.strays.partition_point(|at| *at < self.last_end());
        self.strays.get(first).is_some_and(|at| *at < next)
    }

    /// The end of the previous token.
    fn last_end(&self) -> usize {
        self.next.checked_sub(1).map_or(0, |at| self.tokens[at].end())
    }

    /// A value; [`ExprKind::Bad`], without consuming a token, if none begins here.
    fn value(&mut self) -> Expr {
        let Some(token) = self.peek() else {
            let end = self.last_end();
            return Expr { span: end..end, kind: ExprKind::Bad };
        };
        let span = token.span();
        match token.kind {
            TokenKind::Number => {
                self.next += 1;
                self.number(span)
            }
            TokenKind::Text => {
                self.next += 1;
                let kind = self.text(&span).map_or(ExprKind::Bad, ExprKind::Text);
                Expr { span, kind }
            }
            TokenKind::Broken => {
                self.next += 1;
                Expr { span, kind: ExprKind::Bad }
            }
            TokenKind::Word => {
                self.next += 1;
                if self.peek_kind(0) == Some(TokenKind::Open(Bracket::Round)) {
                    self.group(Bracket::Round, Some(span))
                } else {
                    Expr { span, kind: ExprKind::Word }
                }
            }
            TokenKind::Open(bracket) => self.group(bracket, None),
            TokenKind::Close(_) | TokenKind::Comma | TokenKind::Colon => {
                let end = self.last_end();
                Expr { span: end..end, kind: ExprKind::Bad }
            }
        }
    }

    /// A number; reports a unit that follows it without quotes.
    fn number(&mut self, span: Range<usize>) -> Expr {
        if let Some(token) = self.peek()
            && token.kind == TokenKind::Word
            && self.source[span.end..token.start()].chars().all(|c| c == ' ')
            && !matches!(self.peek_kind(1), Some(TokenKind::Colon | TokenKind::Open(_)))
        {
            let place = span.start..token.end();
            let hint = format!("write \"{}\"", &self.source[place.clone()]);
            self.problem(place.clone(), "a number with a unit needs quotes", &hint);
            self.next += 1;
            return Expr { span: place, kind: ExprKind::Bad };
        }
        Expr { span, kind: ExprKind::Number }
    }

    fn text(&mut self, span: &Range<usize>) -> Option<String> {
        match decode_text(&self.source[span.clone()]) {
            Ok(text) => Some(text),
            Err(escape) => {
                let place = span.start + escape.start..(span.start + escape.end).min(span.end);
                self.problem(place, "unknown escape sequence", "write a backslash as `\\\\`; paths may use `/`");
                None
            }
        }
    }

    /// Items in brackets, from the opening one.
    fn group(&mut self, bracket: Bracket, name: Option<Range<usize>>) -> Expr {
        let open = self.tokens[self.next].start();
        let start = name.as_ref().map_or(open, |name| name.start);
        if self.open.len() >= MAX_DEPTH {
            return self.skip_nested(start);
        }
        self.next += 1;
        self.open.push(bracket);
        let mut group = Group { name, bracket, open, close: None, items: Vec::new() };
        loop {
            match self.peek().map(|token| token.kind) {
                Some(TokenKind::Close(close)) if close == bracket => {
                    group.close = Some(self.tokens[self.next].start());
                    self.next += 1;
                    break;
                }
                Some(TokenKind::Close(close)) if self.open.contains(&close) => {
                    self.not_closed(open, bracket);
                    break;
                }
                None => {
                    if !self.unclosed {
                        self.unclosed = true;
                        self.not_closed(open, bracket);
                    }
                    break;
                }
                _ if self.problems.is_hopeless() => break,
                _ if self.belongs_outside(bracket) => {
                    self.not_closed(open, bracket);
                    break;
                }
                Some(TokenKind::Close(_) | TokenKind::Comma | TokenKind::Colon) => {
                    let token = &self.tokens[self.next];
                    let text = &self.source[token.span()];
                    self.problem(token.span(), format!("expected a value, found `{text}`"), "remove it");
                    self.next += 1;
                }
                Some(_) => {
                    let item = self.item(bracket);
                    group.items.push(item);
                }
            }
        }
        self.open.pop();
        Expr { span: start..self.last_end(), kind: ExprKind::Group(Box::new(group)) }
    }

    /// Returns true if the next token can only belong to the surrounding brackets, so that these were not closed.
    fn belongs_outside(&self, bracket: Bracket) -> bool {
        let keyed = self.peek_kind(1) == Some(TokenKind::Colon);
        let Some(outer) = self.open.len().checked_sub(2).map(|at| self.open[at]) else { return false };
        keyed
            && match self.peek_kind(0) {
                Some(TokenKind::Text) => bracket == Bracket::Round && outer == Bracket::Curly,
                Some(TokenKind::Word) if outer == Bracket::Round => match bracket {
                    Bracket::Round => false,
                    Bracket::Square => true,
                    // A name in curly brackets may just lack its quotes.
                    Bracket::Curly => {
                        let word = &self.source[self.tokens[self.next].span()];
                        self.open.len() == 2 && FIELDS.contains(&word)
                    }
                },
                _ => false,
            }
    }

    fn not_closed(&mut self, open: usize, bracket: Bracket) {
        let message = format!("`{}` is not closed", bracket.open());
        self.problem(open..open + 1, message, &format!("close it with `{}`", bracket.close()));
    }

    /// Skips brackets that are nested too deep.
    fn skip_nested(&mut self, start: usize) -> Expr {
        if !self.too_deep {
            self.too_deep = true;
            let place = self.tokens[self.next].span();
            let message = format!("brackets are nested deeper than {MAX_DEPTH}");
            self.problem(place, message, "a graph file needs about six levels; was a bracket repeated?");
        }
        let mut depth = 0_usize;
        while let Some(token) = self.peek() {
            match token.kind {
                TokenKind::Open(_) => depth += 1,
                TokenKind::Close(_) => depth = depth.saturating_sub(1),
                _ => {}
            }
            self.next += 1;
            if depth == 0 {
                break;
            }
        }
        // Unclosed brackets around it follow from the same mistake.
        self.unclosed = true;
        Expr { span: start..self.last_end(), kind: ExprKind::Bad }
    }

    /// An item in brackets, with its comma.
    fn item(&mut self, bracket: Bracket) -> Item {
        let lacks_colon = self.lacks_colon(bracket);
        let key = if lacks_colon || self.peek_kind(1) == Some(TokenKind::Colon) { self.key(bracket) } else { None };
        if let Some(key) = key.as_ref().filter(|_| lacks_colon) {
            let end = key.span.end;
            self.problem(end..end, format!("a colon is missing after `{}`", key.text), "write it as `name: value`");
        }
        let value = self.value();
        let bad = matches!(value.kind, ExprKind::Bad);
        // Tokens missing around unclosed brackets follow from that mistake.
        let unclosed = value.as_group().is_some_and(|group| group.close.is_none());
        match &key {
            Some(key) if bad && value.span.is_empty() && !self.after_stray() => {
                self.problem(key.span.clone(), format!("`{}` has no value", key.text), "write it after the colon");
            }
            None if bracket == Bracket::Curly && !bad && !unclosed => {
                let hint = "items in `{ }` are written `\"name\": value`";
                self.problem(value.span.clone(), "this has no name", hint);
            }
            _ => {}
        }
        let comma = (self.peek_kind(0) == Some(TokenKind::Comma)).then(|| self.tokens[self.next].start());
        if comma.is_some() {
            self.next += 1;
        } else if self.begins_item() && !unclosed && !self.belongs_outside(bracket) && !self.after_stray() {
            let end = self.last_end();
            self.problem(end..end, "a comma is missing", "separate items in brackets by commas");
        }
        Item { key, value, comma }
    }

    fn begins_item(&self) -> bool {
        self.begins_value(0)
    }

    fn begins_value(&self, ahead: usize) -> bool {
        matches!(
            self.peek_kind(ahead),
            Some(TokenKind::Open(_) | TokenKind::Number | TokenKind::Word | TokenKind::Text | TokenKind::Broken)
        )
    }

    /// Returns true if what follows can only be a name and its value without the colon between.
    fn lacks_colon(&self, bracket: Bracket) -> bool {
        let is_name = match bracket {
            // `Name(` is a value
            Bracket::Round => {
                self.peek_kind(0) == Some(TokenKind::Word) && self.peek_kind(1) != Some(TokenKind::Open(Bracket::Round))
            }
            Bracket::Curly => self.peek_kind(0) == Some(TokenKind::Text),
            Bracket::Square => false,
        };
        is_name && self.begins_value(1) && self.peek_kind(2) != Some(TokenKind::Colon)
    }

    /// A name with its colon, if it has one.
    fn key(&mut self, bracket: Bracket) -> Option<Box<Key>> {
        let token = &self.tokens[self.next];
        let span = token.span();
        let text = match token.kind {
            TokenKind::Word => self.source[span.clone()].to_owned(),
            // A name with an invalid escape sequence, already reported, is used as written.
            TokenKind::Text => self.text(&span).unwrap_or_else(|| self.source[span.clone()].to_owned()),
            _ => return None,
        };
        match (bracket, token.kind) {
            (Bracket::Square, _) => self.problem(span.clone(), "items in `[ ]` have no names", "remove the name"),
            (Bracket::Curly, TokenKind::Word) => {
                self.problem(span.clone(), format!("the name `{text}` needs quotes here"), "write it as \"name\"");
            }
            (Bracket::Round, TokenKind::Text) => {
                self.problem(
                    span.clone(),
                    format!("the name `{text}` must not have quotes here"),
                    "write it without quotes",
                );
            }
            _ => {}
        }
        self.next += 1 + usize::from(self.peek_kind(1) == Some(TokenKind::Colon));
        Some(Box::new(Key { span, text }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn messages(source: &str) -> Vec<String> {
        parse(source).1.into_iter().map(|p| format!("{}: {}", p.span.start, p.message)).collect()
    }

    #[test]
    fn each_mistake_is_reported_once() {
        assert_eq!(messages("(a: 1 b: 2)"), ["5: a comma is missing"]);
        assert_eq!(messages("(a 1, b: 2)"), ["2: a colon is missing after `a`"]);
        assert_eq!(
            messages("(n: {\"a\" P(x [1, 2])})"),
            ["8: a colon is missing after `a`", "12: a colon is missing after `x`"]
        );
        assert_eq!(messages("(a b: 2)"), ["2: a comma is missing"]);
        assert_eq!(messages("(a: 1; b: 2)"), ["5: `;` has no meaning here"]);
        assert_eq!(messages("(a: 'x', b: ?)"), ["4: text needs double quotes", "12: `?` has no meaning here"]);
        assert_eq!(messages("(a: , b: 2)"), ["1: `a` has no value"]);
        assert_eq!(messages("({\"a\": P(x: 1, \"b\": Q(y: 2)})"), ["8: `(` is not closed"]);
        assert_eq!(messages("(n: {\"a\": P, layout: {})"), ["4: `{` is not closed"]);
        assert_eq!(messages("((((1"), ["3: `(` is not closed"]);
        assert_eq!(messages("(a: 1))"), ["6: the file continues after its closing bracket"]);
        assert_eq!(messages("{a: 1}"), ["1: the name `a` needs quotes here"]);
        assert_eq!(messages("(a: [1, 2)"), ["4: `[` is not closed"]);
        assert_eq!(messages("(a: 1, , b: 2)"), ["7: expected a value, found `,`"]);
        assert_eq!(messages("(a: \"\\q\")"), ["5: unknown escape sequence"]);
        assert_eq!(messages("(size: 3 km, a: 1)"), ["7: a number with a unit needs quotes"]);
        assert_eq!(messages("(n: {\"a\": \"b },\n o: 1)"), ["10: the text is not closed on its line"]);
        assert_eq!(messages("(nodes: {a: P}, b: 1)"), ["9: the name `a` needs quotes here"]);
        assert_eq!(messages("nodes: {}"), ["5: a graph file needs round brackets around it"]);
    }

    #[test]
    fn deep_nesting_is_refused_at_once() {
        for text in ["(", "[", "{", "a(", "[[", "(a:"] {
            let source = text.repeat(100_000);
            let (_, problems) = parse(&source);
            assert_eq!(problems.len(), 1, "{text}: {problems:?}");
            assert!(problems[0].message.contains("deeper than 64"));
        }
        let closed = format!("{}{}", "(".repeat(50_000), ")".repeat(50_000));
        assert_eq!(parse(&closed).1.len(), 1);
    }

    #[test]
    fn endless_mistakes_take_linear_time_and_are_cut_short() {
        let source = format!("(nodes: {{{}}})", "1,".repeat(300_000));
        assert_eq!(parse(&source).1.len(), MAX_PROBLEMS + 1);
    }
}
