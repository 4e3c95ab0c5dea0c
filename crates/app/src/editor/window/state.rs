//! What the editor stores between runs, in its own folder: recent files, the theme, the files that examples read.
//! Nothing in it is required; without such a folder nothing is stored.

use std::{
    fs,
    path::{Path, PathBuf},
};

use directories::ProjectDirs;

/// The variable that sets another folder.
const VARIABLE: &str = "OROGRAPH_STATE";
/// Maximum number of recent files.
const MOST: usize = 12;

/// The folder, as an absolute path. Returns None when the system has none. Journals of graphs without a name are in it
/// as well.
pub(crate) fn folder() -> Option<PathBuf> {
    if let Some(folder) = std::env::var_os(VARIABLE).filter(|folder| !folder.is_empty()) {
        return std::path::absolute(folder).ok();
    }
    let dirs = ProjectDirs::from("", "", "orograph")?;
    Some(dirs.state_dir().unwrap_or_else(|| dirs.data_local_dir()).to_owned())
}

/// The stored text of this name. Returns None when there is none.
pub(crate) fn read(name: &str) -> Option<String> {
    fs::read_to_string(folder()?.join(name)).ok()
}

/// Stores a text; a failure is ignored, because the state is only a convenience.
pub(crate) fn write(name: &str, text: &str) {
    if let Some(folder) = folder()
        && fs::create_dir_all(&folder).is_ok()
    {
        let _ = fs::write(folder.join(name), text);
    }
}

/// The recently opened or saved graph files, the latest first.
#[derive(Debug)]
pub(crate) struct Recent {
    paths: Vec<PathBuf>,
    /// The file of the window, once it is in the list.
    present: Option<PathBuf>,
}

impl Recent {
    const NAME: &'static str = "recent.txt";

    /// Loads the list.
    pub(crate) fn load() -> Self {
        let text = read(Self::NAME).unwrap_or_default();
        Self { paths: text.lines().map(PathBuf::from).collect(), present: None }
    }

    /// The files that still exist.
    pub(crate) fn files(&self) -> Vec<PathBuf> {
        self.paths.iter().filter(|path| path.is_file()).cloned().collect()
    }

    /// Adds the file of the window to the list.
    pub(crate) fn see(&mut self, path: Option<&Path>) {
        if path == self.present.as_deref() {
            return;
        }
        self.present = path.map(Path::to_owned);
        let Some(path) = path else { return };
        let path = whole_path(path);
        // Other windows may have changed the list.
        self.paths = Self::load().paths;
        self.paths.retain(|other| *other != path);
        self.paths.insert(0, path);
        self.paths.truncate(MOST);
        let lines: Vec<String> = self.paths.iter().map(|path| path.display().to_string()).collect();
        write(Self::NAME, &lines.join("\n"));
    }
}

/// The path that a file has from every folder.
pub(crate) fn whole_path(path: &Path) -> PathBuf {
    path.canonicalize().unwrap_or_else(|_| path.to_owned())
}
