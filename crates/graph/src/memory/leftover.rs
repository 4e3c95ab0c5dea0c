//! Files and folders under temporary names.

use std::path::Path;

use super::{Note, Notes};

/// Number of paths at a time, and total bytes of their names.
const MOST: usize = 16;
const LONGEST: usize = 4096;

/// The byte before a path that is removed with its contents, and that before a folder that is removed if it is empty.
const TEMPORARY: u8 = b'-';
const AROUND: u8 = b'+';

static LEFTOVERS: Notes<MOST, LONGEST> = Notes::new();

/// Paths that are removed if the program ends for lack of memory before this is dropped.
#[derive(Debug)]
#[must_use = "the paths are forgotten when this is dropped"]
pub struct Leftover(#[expect(dead_code, reason = "it is dropped")] Note<MOST, LONGEST>);

impl Leftover {
    /// Registers files, or folders with their contents, and the folders that were created for them, innermost first;
    /// these are removed if they are empty. If a path is too long to be registered, neither it nor the others are
    /// removed.
    pub fn note(temporary: &[&Path], around: &[&Path]) -> Self {
        let mut text = Vec::new();
        for (paths, mark) in [(temporary, TEMPORARY), (around, AROUND)] {
            for path in paths {
                text.push(mark);
                text.extend_from_slice(path.as_os_str().as_encoded_bytes());
                text.push(0);
            }
        }
        Self(LEFTOVERS.add(&text))
    }
}

/// The kind of a path among the leftovers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Left {
    /// A file or a folder that is removed with its contents.
    Temporary,
    /// A folder that is removed if it is empty.
    Around,
}

/// Reads the paths that are left over if the program ends now, in the order in which they can be removed: first all
/// temporary ones, then the folders around them. Each is terminated by a zero byte. Does not allocate.
pub fn each_leftover(mut read: impl FnMut(&[u8], Left)) {
    for (kind, left) in [(TEMPORARY, Left::Temporary), (AROUND, Left::Around)] {
        LEFTOVERS.each(|paths| {
            for path in paths.split_inclusive(|byte| *byte == 0) {
                if let [mark, path @ ..] = path
                    && *mark == kind
                {
                    read(path, left);
                }
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_there_until_they_are_dropped() {
        let paths = || {
            let mut paths = Vec::new();
            each_leftover(|path, left| paths.push((String::from_utf8(path.to_vec()).expect("text"), left)));
            // other tests register paths meanwhile
            paths.retain(|(path, _)| path.starts_with("/this test"));
            paths
        };
        let note = Leftover::note(
            &["/this test/out/.part".as_ref(), "/this test/out/.lock".as_ref()],
            &["/this test/out".as_ref(), "/this test".as_ref()],
        );
        let names = ["/this test/out/.part\0", "/this test/out/.lock\0", "/this test/out\0", "/this test\0"];
        let names = names.map(str::to_owned);
        let kinds = [Left::Temporary, Left::Temporary, Left::Around, Left::Around];
        assert_eq!(paths(), names.into_iter().zip(kinds).collect::<Vec<_>>());
        drop(note);
        // a folder can be noted before what is in it
        let around = Leftover::note(&[], &["/this test".as_ref()]);
        let inside = Leftover::note(&["/this test/.lock".as_ref()], &[]);
        assert_eq!(paths().iter().map(|(_, left)| *left).collect::<Vec<_>>(), [Left::Temporary, Left::Around]);
        drop((around, inside));
        let long = Leftover::note(&[format!("/this test/{}", "a".repeat(5000)).as_ref()], &[]);
        assert!(paths().is_empty(), "half a path is another path");
        drop(long);
    }
}
