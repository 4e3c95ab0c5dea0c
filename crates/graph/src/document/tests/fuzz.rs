//! Hostile files: no panic, no hang, and invariants that hold for every file.

use proptest::prelude::*;

use super::*;
use crate::Severity;

/// Tokens of the notation.
const PIECES: [&str; 46] = [
    "(",
    ")",
    "[",
    "]",
    "{",
    "}",
    ":",
    ",",
    "\"",
    "'",
    "//",
    "/*",
    "*/",
    "\n",
    "\r\n",
    " ",
    "\\",
    "r#\"",
    "\"#",
    "#",
    "-",
    "1e999",
    "NaN",
    "-inf",
    "0x",
    "1_0",
    "\"a\"",
    "\"a.b\"",
    "\"2 km\"",
    "nodes",
    "outputs",
    "world",
    "expect",
    "\"relief\"",
    "\"in\"",
    "(0, inf)",
    "layout",
    "format",
    "cells: 99999999999",
    "version: 2",
    "Ridged",
    "Thermal(",
    "é",
    "\u{feff}",
    "\0",
    "\u{202e}",
];

fn pieces() -> impl Strategy<Value = String> {
    prop::collection::vec(prop::sample::select(PIECES.to_vec()), 0..60).prop_map(|pieces| pieces.concat())
}

/// A valid file, damaged: bytes replaced, cut off, repeated, or tokens inserted.
fn damaged() -> impl Strategy<Value = String> {
    let change = (0..ALPS.len(), prop::sample::select(PIECES.to_vec()), 0..12_usize);
    (prop::collection::vec(change, 1..5), 0..ALPS.len() * 2).prop_map(|(changes, cut)| {
        let mut source = ALPS.as_bytes().to_vec();
        for (at, piece, removed) in changes {
            let at = at.min(source.len());
            let end = (at + removed).min(source.len());
            source.splice(at..end, piece.bytes());
        }
        source.truncate(cut);
        String::from_utf8_lossy(&source).into_owned()
    })
}

/// A valid file with comments, white space and commas wherever they are allowed, and numbers in unusual notation.
fn disguised() -> impl Strategy<Value = String> {
    let gap = prop::sample::select(vec![
        "",
        "",
        "",
        " ",
        "\n",
        "\n\n\n",
        " // c\n",
        "/* d */",
        "\t/* e\n */ ",
        "\r\n",
        "// f\n// g\n\n",
    ]);
    (prop::collection::vec(gap, 400), any::<bool>()).prop_map(|(gaps, commas)| {
        let lexed = crate::document::syntax::lex::lex(ALPS);
        let mut out = String::new();
        for (i, token) in lexed.tokens.iter().enumerate() {
            let text = &ALPS[token.span()];
            let closes = matches!(text, ")" | "}");
            let before = i.checked_sub(1).map_or("", |i| &ALPS[lexed.tokens[i].span()]);
            // The brackets of a position and the file's last one, with a comma before, are valid as well.
            if commas && closes && !matches!(before, "," | "(" | "{") {
                out.push(',');
            }
            out.push_str(gaps[i % gaps.len()]);
            out.push_str(text);
        }
        out.push_str(gaps[0]);
        out
    })
}

fn check_any(source: &str) -> Result<(), TestCaseError> {
    let document = Document::parse(source, &registry());
    prop_assert_eq!(document.source(), source);
    let mut before = 0;
    for problem in document.problems() {
        prop_assert!(problem.span.start >= before && problem.span.end >= problem.span.start, "{problem:?}");
        prop_assert!(problem.span.end <= source.len() && source.is_char_boundary(problem.span.start), "{problem:?}");
        prop_assert!(!problem.message.is_empty() && problem.render(source, "f").ends_with('\n'));
        before = problem.span.start;
    }
    prop_assert!(document.world().check().is_ok());
    prop_assert_eq!(document.has_errors(), document.problems().iter().any(|p| p.severity == Severity::Error));
    if let Ok(form) = format_source(source) {
        prop_assert_eq!(format_source(&form), Ok(form.clone()), "not idempotent");
        let again = Document::parse(form.as_str(), &registry());
        prop_assert_eq!(diff(&document, &again), Vec::<String>::new());
        let codes = |d: &Document| {
            let mut codes: Vec<_> = d.problems().iter().map(|p| (p.code, p.message.clone())).collect();
            codes.sort();
            codes
        };
        prop_assert_eq!(codes(&document), codes(&again), "{}", form);
        prop_assert_eq!(comments(source), comments(&form), "{}", form);
    }
    Ok(())
}

fn comments(source: &str) -> Vec<String> {
    crate::document::syntax::lex::lex(source).comments.into_iter().map(|c| source[c.span].to_owned()).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn any_text_is_read(source in prop_oneof![any::<String>(), pieces(), damaged()]) {
        check_any(&source)?;
    }

    #[test]
    fn any_bytes_are_refused_or_read(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        check_any(&String::from_utf8_lossy(&bytes))?;
    }

    #[test]
    fn a_disguise_does_not_change_the_meaning(source in disguised()) {
        let document = parse(&source);
        prop_assert_eq!(document.problems(), &[], "{}", source);
        prop_assert_eq!(diff(&parse(ALPS), &document), Vec::<String>::new());
        prop_assert!(ron2::ast::parse_document(&source).is_ok(), "{}", source);
        check_any(&source)?;
    }
}

#[test]
fn large_and_hostile_files_are_read_without_delay() {
    let n = 30_000;
    let many = |one: &dyn Fn(usize) -> String| {
        let nodes: String = (0..n).map(one).collect();
        format!("(nodes: {{\n{nodes}}}, outputs: {{ \"o\": \"n0\" }})")
    };
    let chain = parse(&many(&|i| match i + 1 == n {
        true => format!("\"n{i}\": Ridged,\n"),
        false => format!("\"n{i}\": StreamPower(height: \"n{}\"),\n", i + 1),
    }));
    assert_eq!((chain.problems().len(), chain.nodes().len()), (0, n));
    let circle = parse(&many(&|i| format!("\"n{i}\": StreamPower(height: \"n{}\"),\n", (i + 1) % n)));
    assert_eq!(circle.problems().len(), 1);
    let pairs = parse(&many(&|i| format!("\"n{i}\": StreamPower(height: \"n{}\"),\n", i ^ 1)));
    assert_eq!(pairs.problems().len(), 101, "only so many problems are listed");
    let wrong = parse(&many(&|i| format!("\"n{i}\": Rigded(x: 1),\n")));
    assert_eq!(wrong.problems().len(), 101);
    for text in ["(", "[", "{", "a(", "(a:", "({\"a\":", "/*", "\"", "//\n", ",", ":", "-", "é"] {
        let source = text.repeat(100_000);
        assert!(parse(&source).has_errors(), "{text}");
        let inside = format!("(nodes: {{ \"a\": Ridged(profile: {source}");
        assert!(parse(&inside).has_errors(), "{text}");
    }
}
