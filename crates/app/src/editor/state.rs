//! What the editor remembers between its windows, in a folder of its own: files opened lately, the theme, copies of what
//! examples read. Nothing of it is needed; where there is no such folder nothing is remembered.

use std::{
    fs,
    path::{Path, PathBuf},
};

use directories::ProjectDirs;

/// The variable that names another folder.
const VARIABLE: &str = "OROGRAPH_STATE";
/// The most files that are remembered.
const MOST: usize = 12;

/// The folder, whole; `None` where the system names none. Journals of graphs without a name are in it as well.
pub(super) fn folder() -> Option<PathBuf> {
    if let Some(folder) = std::env::var_os(VARIABLE).filter(|folder| !folder.is_empty()) {
        return std::path::absolute(folder).ok();
    }
    let dirs = ProjectDirs::from("", "", "orograph")?;
    Some(dirs.state_dir().unwrap_or_else(|| dirs.data_local_dir()).to_owned())
}

/// What is remembered under a name.
pub(super) fn read(name: &str) -> Option<String> {
    fs::read_to_string(folder()?.join(name)).ok()
}

/// Remembers something; it is only a convenience, so that a folder that cannot be written to is no matter.
pub(super) fn write(name: &str, text: &str) {
    if let Some(folder) = folder()
        && fs::create_dir_all(&folder).is_ok()
    {
        let _ = fs::write(folder.join(name), text);
    }
}

/// The graph files that were opened or saved lately, the last one first.
#[derive(Debug)]
pub(super) struct Recent {
    paths: Vec<PathBuf>,
    /// The file of the window, once it is among them.
    present: Option<PathBuf>,
}

impl Recent {
    const NAME: &'static str = "recent.txt";

    /// Those that are remembered.
    pub(super) fn load() -> Self {
        let text = read(Self::NAME).unwrap_or_default();
        Self { paths: text.lines().map(PathBuf::from).collect(), present: None }
    }

    /// Those that still exist.
    pub(super) fn files(&self) -> Vec<PathBuf> {
        self.paths.iter().filter(|path| path.is_file()).cloned().collect()
    }

    /// Notes which file the window shows.
    pub(super) fn see(&mut self, path: Option<&Path>) {
        if path == self.present.as_deref() {
            return;
        }
        self.present = path.map(Path::to_owned);
        let Some(path) = path else { return };
        let path = path.canonicalize().unwrap_or_else(|_| path.to_owned());
        // Other windows have their own.
        self.paths = Self::load().paths;
        self.paths.retain(|other| *other != path);
        self.paths.insert(0, path);
        self.paths.truncate(MOST);
        let lines: Vec<String> = self.paths.iter().map(|path| path.display().to_string()).collect();
        write(Self::NAME, &lines.join("\n"));
    }
}
