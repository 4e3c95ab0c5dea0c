//! Moving a document to another folder, with its file names rewritten.

use std::path::{Component, Path, PathBuf};

use crate::document::{Document, subgraph::Home};

impl Document {
    /// Reads the files that it names again, in case they have changed.
    pub fn look_again(&mut self) {
        self.read_again();
    }

    /// Turns the document into one without a file, keeping its history. The file names in it, unchanged, are relative
    /// to the given folder.
    pub fn set_folder(&mut self, folder: impl Into<PathBuf>) {
        self.home = Home { folder: folder.into(), ..Home::default() };
        self.read_again();
    }

    /// Turns the document into the text of another file, keeping its history. If the folder changes, relative file
    /// names are rewritten to refer to the same files, as one step for [`Self::undo`]; returns true if any were.
    ///
    /// In a text with syntax errors, file names stay unchanged.
    pub fn move_to(&mut self, path: &Path) -> bool {
        let from = self.folder().to_owned();
        let to = path.parent().unwrap_or(Path::new(""));
        let adapted = self.with_file_names(&|_, _, file| led_from(file, &from, to)).ok();
        self.home = Home::of_file(path);
        self.read_again();
        adapted.is_some_and(|text| self.replace(&text))
    }
}

/// The file name relative to folder `to` of a file named relative to folder `from`. Returns None when it is the same.
fn led_from(file: &str, from: &Path, to: &Path) -> Option<String> {
    if Path::new(file).is_absolute() {
        return None;
    }
    let (from, to) = (place(from)?, place(to)?);
    if from == to {
        return None;
    }
    let target = normal(&from.join(file));
    let shared = target.components().zip(to.components()).take_while(|(a, b)| a == b).count();
    if shared == 0 {
        // Another disk.
        return Some(target.to_string_lossy().into_owned());
    }
    let up = to.components().skip(shared).map(|_| "..".into());
    let down = target.components().skip(shared).map(|part| part.as_os_str().to_string_lossy());
    Some(up.chain(down).collect::<Vec<_>>().join("/"))
}

/// The absolute path of a folder, with links resolved.
fn place(folder: &Path) -> Option<PathBuf> {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    folder.canonicalize().or_else(|_| std::path::absolute(folder).map(|path| normal(&path))).ok()
}

/// A path without `.` and `..`.
fn normal(path: &Path) -> PathBuf {
    let mut out = PathBuf::new();
    for part in path.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir => {
                out.pop();
            }
            part => out.push(part),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_lead_to_the_same_files() {
        let from = |file: &str, from: &str, to: &str| led_from(file, Path::new(from), Path::new(to));
        assert_eq!(from("a.tif", "/none/x", "/none/x"), None);
        assert_eq!(from("a.tif", "/none/x", "/none/y").as_deref(), Some("../x/a.tif"));
        assert_eq!(from("a.tif", "/none/x", "/none").as_deref(), Some("x/a.tif"));
        assert_eq!(from("../data/a.tif", "/none/x", "/none").as_deref(), Some("data/a.tif"));
        assert_eq!(from("./a.tif", "/none", "/none/x/y").as_deref(), Some("../../a.tif"));
        assert_eq!(from("/data/a.tif", "/none/x", "/none"), None);
    }
}
