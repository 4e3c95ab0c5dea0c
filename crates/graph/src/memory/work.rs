//! The names of running nodes.

use super::{Note, Notes};

/// The largest number of nodes that are named, and the longest name in bytes.
const MOST: usize = 32;
const LONGEST: usize = 64;

static RUNNING: Notes<MOST, LONGEST> = Notes::new();

/// Registers a running node until the guard is dropped. It is named if the program runs out of memory.
pub fn running(name: &str) -> Note<MOST, LONGEST> {
    let end = name.floor_char_boundary(LONGEST);
    RUNNING.add(&name.as_bytes()[..end])
}

/// Reads the names of the running nodes. Does not allocate.
pub fn each_running(read: impl FnMut(&[u8])) {
    RUNNING.each(read);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_there_while_nodes_run() {
        let names = || {
            let mut names = Vec::new();
            each_running(|name| names.push(String::from_utf8(name.to_vec()).expect("text")));
            names
        };
        // other tests run nodes meanwhile
        let has = |name: &str| names().iter().any(|running| running == name);
        let first = running("this test's first node");
        let second = running("this test's second node");
        assert!(has("this test's first node") && has("this test's second node"));
        drop(first);
        assert!(!has("this test's first node") && has("this test's second node"));
        drop(second);
        let long = running(&"ö".repeat(100));
        assert!(has(&"ö".repeat(32)));
        drop(long);
        let many: Vec<_> = (0..2 * MOST).map(|_| running("this test's crowd")).collect();
        assert!(names().len() == MOST);
        drop(many);
        assert!(!has("this test's crowd"));
    }
}
