//! `orograph pack` and `orograph unpack`: a graph with all that it reads, as one file.

use std::path::PathBuf;

use orograph_graph::bytes;

use crate::{
    archive::{self, EXTENSION},
    failure::Failure,
    problems,
    terminal::{self, Page, counted},
};

/// Packs a graph with the graph files and the imported files that it reads into one archive
///
/// `run`, `check`, `render` and `diff` take the archive in place of the graph. Files that do not lie below the graph's
/// folder get a place in the archive, and the graph names them there. Equal files give equal archives.
#[derive(Debug, clap::Args)]
pub struct PackArgs {
    /// Graph file
    #[arg(value_name = "GRAPH.ron")]
    file: PathBuf,
    /// Archive to write; beside the graph and named like it unless said otherwise
    #[arg(short, long, value_name = "FILE.orograph")]
    out: Option<PathBuf>,
}

impl PackArgs {
    pub(super) fn run(self) -> Result<(), Failure> {
        if archive::is_archive(&self.file) {
            return Err(Failure::wrong(format!("`{}` is packed already", self.file.display())));
        }
        let out = self.out.unwrap_or_else(|| self.file.with_extension(EXTENSION));
        if !archive::is_archive(&out) {
            return Err(Failure::wrong(format!("`{}` does not end with .{EXTENSION}", out.display()))
                .hint(format!("write `-o {}`", out.with_extension(EXTENSION).display())));
        }
        let document = problems::load_sound(&self.file, &orograph_nodes::registry(), false)?;
        let packed = archive::pack(&document, &self.file, &out)?;
        let page = Page::stdout();
        let moved = packed.moved.iter().map(|(from, to)| format!("{} is `{to}` in it\n", from.display()));
        let moved: String = moved.collect();
        terminal::print(&format!(
            "{moved}{} {}  {}\n",
            page.good("packed"),
            page.name(&out.display().to_string()),
            page.dim(&format!("{}, {}", counted(packed.names.len(), "file"), bytes(packed.bytes)))
        ))
    }
}

/// Unpacks an archive into a new folder
///
/// Nothing is written outside the folder, whatever the archive says: one with other than plain files, with names that lead
/// elsewhere, with the same name twice or with more than 4 GiB is refused, and leaves nothing.
#[derive(Debug, clap::Args)]
pub struct UnpackArgs {
    /// Archive
    #[arg(value_name = "FILE.orograph")]
    file: PathBuf,
    /// Folder to make; named like the archive, in the current folder, unless said otherwise
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
}

impl UnpackArgs {
    pub(super) fn run(self) -> Result<(), Failure> {
        if !archive::is_archive(&self.file) {
            return Err(Failure::wrong(format!("`{}` does not end with .{EXTENSION}", self.file.display()))
                .hint("`orograph pack` makes archives"));
        }
        let folder = self.out.or_else(|| self.file.file_stem().map(PathBuf::from)).unwrap_or_default();
        let unpacked = archive::unpack(&self.file, &folder)?;
        let page = Page::stdout();
        let graph = folder.join(unpacked.graph).display().to_string();
        let files = page.dim(&counted(unpacked.files, "file"));
        terminal::print(&format!("{} {}  {files}\n", page.good("unpacked"), page.name(&graph)))
    }
}
