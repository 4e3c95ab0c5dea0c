//! The folders of exports: a proposal for each graph, and which graph has written which file.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use crate::{editor::Session, report::terminal::counted};

/// Files that a question names.
const NAMED: usize = 4;

/// The graphs that have written files, or are about to.
#[derive(Debug, Default)]
pub(super) struct Folders {
    writers: BTreeMap<PathBuf, Writer>,
}

/// A graph: that of a file, or a document without one by its number.
#[derive(Clone, Debug, PartialEq)]
enum Writer {
    File(PathBuf),
    Nameless(u64),
}

impl Writer {
    fn of(session: &Session) -> Self {
        session.path().map_or_else(|| Self::Nameless(session.number()), |path| Self::File(path.to_owned()))
    }

    /// Returns true if it is the document of a session, which may have got a file since.
    fn is(&self, session: &Session) -> bool {
        *self == Self::of(session) || *self == Self::Nameless(session.number())
    }
}

impl Folders {
    /// The folder to propose: the first of `out`, `out 2` and so on that no other graph of this window has written to,
    /// and that is empty if the graph has no file.
    pub(super) fn proposal(&self, session: &Session) -> PathBuf {
        let beside = session.path().and_then(Path::parent).map(Path::to_owned);
        let home = beside.or_else(|| std::env::current_dir().ok()).unwrap_or_default();
        let first = home.canonicalize().unwrap_or(home).join("out");
        let is_own = |folder: &PathBuf| {
            let place = real(folder);
            let mut others = self.writers.iter().filter(|(file, _)| file.starts_with(&place));
            others.all(|(_, writer)| writer.is(session)) && (session.path().is_some() || is_free(folder))
        };
        in_turn(first.clone()).find(is_own).unwrap_or(first)
    }

    /// Those of some files that are there, and that the graph of a session has not written.
    pub(super) fn of_others(
        &self,
        files: &[PathBuf],
        session: &Session,
        is_there: impl Fn(&Path) -> bool,
    ) -> Vec<PathBuf> {
        let is_own = |file: &PathBuf| self.writers.get(file).is_some_and(|writer| writer.is(session));
        files.iter().filter(|file| !is_own(file) && is_there(file)).cloned().collect()
    }

    /// From now on, files are those of the graph of a session.
    pub(super) fn take(&mut self, files: &[PathBuf], session: &Session) {
        self.writers.extend(files.iter().map(|file| (file.clone(), Writer::of(session))));
    }
}

/// A folder, then the same with numbers behind its name.
pub(super) fn in_turn(first: PathBuf) -> impl Iterator<Item = PathBuf> {
    let name = first.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let numbered = move |number: u32| match number {
        1 => first.clone(),
        number => first.with_file_name(format!("{name} {number}")),
    };
    (1..=u32::MAX).map(numbered)
}

/// Returns true if a folder is empty, or not there.
pub(super) fn is_free(folder: &Path) -> bool {
    !folder.exists() || folder.read_dir().is_ok_and(|mut entries| entries.next().is_none())
}

/// A folder without links, as far as it exists.
pub(super) fn real(folder: &Path) -> PathBuf {
    let whole = std::path::absolute(folder).unwrap_or_else(|_| folder.to_owned());
    let known = |above: &Path| Some(above.canonicalize().ok()?.join(whole.strip_prefix(above).ok()?));
    whole.ancestors().find_map(known).unwrap_or_else(|| whole.clone())
}

/// What an export would replace, as text.
pub(super) fn what(files: &[PathBuf]) -> String {
    let names: Vec<_> = files.iter().filter_map(|file| file.file_name()).map(|name| name.to_string_lossy()).collect();
    let more = match names.len().saturating_sub(NAMED) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    let (count, named) = (counted(files.len(), "file"), names[..names.len().min(NAMED)].join(", "));
    format!("The export would replace {count} that this graph has not written: {named}{more}.")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_is_followed_by_numbered_ones() {
        let folders: Vec<PathBuf> = in_turn(PathBuf::from("/land/out")).take(3).collect();
        assert_eq!(folders, ["/land/out", "/land/out 2", "/land/out 3"].map(PathBuf::from));
    }

    #[test]
    fn a_question_names_some_files() {
        let files: Vec<PathBuf> = ["a", "b", "c", "d", "e"].map(PathBuf::from).to_vec();
        assert!(what(&files[..1]).ends_with("1 file that this graph has not written: a."));
        assert!(what(&files).ends_with("5 files that this graph has not written: a, b, c, d and 1 more."));
    }

    #[test]
    fn links_to_a_folder_lead_to_the_same_files() {
        let place = tempfile::tempdir().expect("a folder");
        let (folder, link) = (place.path().join("land"), place.path().join("link"));
        std::fs::create_dir(&folder).expect("made");
        if cfg!(unix) {
            #[cfg(unix)]
            std::os::unix::fs::symlink(&folder, &link).expect("made");
            assert_eq!(real(&link.join("out")), real(&folder.join("out")), "before `out` is there");
            std::fs::create_dir(folder.join("out")).expect("made");
            assert_eq!(real(&link.join("out")), real(&folder.join("out")));
        }
        assert!(is_free(&folder.join("none")) && is_free(&folder.join("out")) && !is_free(place.path()));
    }
}
