//! Files and folders under temporary names.

use std::path::Path;

use super::{Note, Notes};

/// As many at a time, and bytes of their paths together.
const MOST: usize = 16;
const LONGEST: usize = 4096;

static LEFTOVERS: Notes<MOST, LONGEST> = Notes::new();

/// Paths that are removed when the program ends for lack of memory, until this is dropped.
#[derive(Debug)]
#[must_use = "the paths are forgotten when this is dropped"]
pub struct Leftover(#[expect(dead_code, reason = "it is dropped")] Note<MOST, LONGEST>);

impl Leftover {
    /// A file or a folder with everything in it, and folders around it that were made for it, the innermost first, which go
    /// if nothing else is in them. Where a path cannot be noted because of its length, none is removed.
    pub fn note(temporary: &Path, around: &[&Path]) -> Self {
        let mut text = Vec::new();
        for path in [temporary].iter().chain(around) {
            text.extend_from_slice(path.as_os_str().as_encoded_bytes());
            text.push(0);
        }
        Self(LEFTOVERS.add(&text))
    }
}

/// What a path among the leftovers is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Left {
    /// A file or a folder that goes with everything in it.
    Temporary,
    /// A folder that goes if it is empty.
    Around,
}

/// Reads the paths that are left over when the program ends now, in the order in which they can be removed, each with a zero
/// byte at its end. Does not allocate.
pub fn each_leftover(mut read: impl FnMut(&[u8], Left)) {
    LEFTOVERS.each(|paths| {
        let mut left = Left::Temporary;
        for path in paths.split_inclusive(|byte| *byte == 0) {
            read(path, left);
            left = Left::Around;
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_there_until_they_are_dropped() {
        let paths = || {
            let mut paths = Vec::new();
            each_leftover(|path, left| paths.push((String::from_utf8(path.to_vec()).expect("text"), left)));
            // other tests leave things over meanwhile
            paths.retain(|(path, _)| path.starts_with("/this test"));
            paths
        };
        let note = Leftover::note("/this test/out/.part".as_ref(), &["/this test/out".as_ref(), "/this test".as_ref()]);
        let names = ["/this test/out/.part\0", "/this test/out\0", "/this test\0"].map(str::to_owned);
        let kinds = [Left::Temporary, Left::Around, Left::Around];
        assert_eq!(paths(), names.into_iter().zip(kinds).collect::<Vec<_>>());
        drop(note);
        let long = Leftover::note(format!("/this test/{}", "a".repeat(5000)).as_ref(), &[]);
        assert!(paths().is_empty(), "half a path is another path");
        drop(long);
    }
}
