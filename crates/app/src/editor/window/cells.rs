//! The preview resolution of each graph file, kept between runs.

use std::path::PathBuf;

use super::state;
use crate::editor::Session;

/// The stored file, and the most graph files in it.
const NAME: &str = "cells.txt";
const MOST: usize = 400;

/// Gives each document that the window opens the preview resolution that was last chosen for its file.
#[derive(Debug, Default)]
pub(crate) struct KeptCells {
    /// The document that has it already.
    opened: Option<u64>,
}

impl KeptCells {
    /// Sets the resolution of a document that was just opened.
    pub(crate) fn follow(&mut self, session: &mut Session) {
        if self.opened.replace(session.number()) == Some(session.number()) {
            return;
        }
        let Some(path) = session.path().map(state::whole_path) else { return };
        let kept = stored().into_iter().find(|(other, _)| *other == path);
        if let Some((_, cells)) = kept {
            session.set_cells(cells);
        }
    }
}

/// Sets the preview resolution, and keeps it for the file of the document.
pub(crate) fn choose(session: &mut Session, cells: u32) {
    session.set_cells(cells);
    let Some(path) = session.path().map(state::whole_path) else { return };
    let mut kept = stored();
    kept.retain(|(other, _)| *other != path);
    kept.insert(0, (path, cells));
    kept.truncate(MOST);
    let lines: Vec<String> = kept.iter().map(|(path, cells)| format!("{cells}\t{}", path.display())).collect();
    state::write(NAME, &lines.join("\n"));
}

/// The stored resolutions, the latest first.
fn stored() -> Vec<(PathBuf, u32)> {
    let text = state::read(NAME).unwrap_or_default();
    text.lines().filter_map(read).collect()
}

fn read(line: &str) -> Option<(PathBuf, u32)> {
    let (cells, path) = line.split_once('\t')?;
    let cells = cells.parse().ok().filter(|cells| *cells > 0)?;
    Some((path.into(), cells))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn damaged_lines_are_left_out() {
        assert_eq!(read("256\t/a b/c.ron"), Some(("/a b/c.ron".into(), 256)));
        for line in ["", "256", "0\t/a.ron", "-1\t/a.ron", "many\t/a.ron"] {
            assert_eq!(read(line), None, "{line}");
        }
    }
}
