//! Plain English: phrases that are hard to read do not return. Names, strings, comments and documents are checked;
//! docs/glossary.md lists the terms to use.

use std::path::{Path, PathBuf};

/// Phrases, each with a better wording. Only whole words match: `anew` does not match in `renewal`.
const BANNED: &[(&str, &str)] = &[
    ("anew", "again, or say what is repeated"),
    ("is waited for", "name who waits: the window waits for the worker"),
    ("says no", "refuses, returns false"),
    ("in place of", "instead of; replaces"),
    ("is told", "name what reports or reads it"),
    ("are told", "name what reports or reads it"),
    ("in words", "as text"),
    ("land in three dimensions", "the 3D view"),
    ("has a hand in", "controls"),
    ("knows no", "is independent of"),
    ("who watches", "name the viewer or observer"),
    ("who asks", "the caller"),
    ("who changes", "contributors"),
    ("what is held", "name the thing"),
    ("take it up", "recover"),
    ("throw the dice", "randomise seed"),
    ("keep in sight", "pin to viewport"),
    ("stands back", "is greyed out"),
    ("is no news", "is not reported"),
    ("the bench", "the live run"),
];

/// Places where a phrase is right: the end of a file name, and the phrase.
const EXCEPTIONS: &[(&str, &str)] = &[
    ("suite/phrases.rs", ""),
    // lists the phrases not to use
    ("docs/glossary.md", ""),
    // machine words
    ("numerics/rank/sweep.rs", "in words"),
    ("raster/ascii.rs", "in words"),
];

fn files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display())) {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            files(&path, found);
        } else if path
            .extension()
            .is_some_and(|extension| ["rs", "md", "ron", "wgsl"].iter().any(|known| extension == *known))
        {
            found.push(path);
        }
    }
}

/// Returns true if the text contains the phrase as whole words.
fn has(text: &str, phrase: &str) -> bool {
    let is_word = |c: Option<char>| c.is_some_and(|c| c.is_alphanumeric() || c == '_');
    text.match_indices(phrase)
        .any(|(at, _)| !is_word(text[..at].chars().next_back()) && !is_word(text[at + phrase.len()..].chars().next()))
}

#[test]
fn no_banned_phrase_is_used() {
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut all = ["README.md", "ARCHITECTURE.md"].map(|name| root.join(name)).to_vec();
    for folder in ["crates", "docs", "graphs", "shaders", "tests"] {
        files(&root.join(folder), &mut all);
    }
    all.sort();
    assert!(all.len() > 300, "{} files", all.len());
    let mut found = Vec::new();
    for path in all {
        let name = path.strip_prefix(&root).unwrap_or(&path).display().to_string();
        let text = std::fs::read_to_string(&path).expect("a text").to_lowercase();
        for (number, line) in (1..).zip(text.lines()) {
            let is_excepted = |phrase: &str| {
                EXCEPTIONS
                    .iter()
                    .any(|(end, excepted)| name.ends_with(end) && (excepted.is_empty() || *excepted == phrase))
            };
            let banned = BANNED.iter().filter(|(phrase, _)| has(line, phrase) && !is_excepted(phrase));
            found.extend(banned.map(|(phrase, instead)| format!("{name}:{number}: `{phrase}`; write: {instead}")));
        }
    }
    assert!(found.is_empty(), "\n{}", found.join("\n"));
}

#[test]
fn phrases_are_found_as_words() {
    assert!(has("it is read anew.", "anew") && !has("a renewal; anew_ and janew", "anew"));
}
