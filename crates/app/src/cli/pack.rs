//! `orograph pack` and `orograph unpack`: a graph with all files that it reads, as one archive.

use std::path::PathBuf;

use orograph_graph::bytes;

use crate::{
    files::archive::{self, EXTENSION},
    report::{
        failure::Failure,
        problems,
        terminal::{self, Page, counted},
    },
};

/// Packs a graph with the graph files and the imported files that it reads into one archive
///
/// `run`, `watch`, `check`, `render` and `diff` accept the archive instead of the graph. Only graphs and rasters are
/// packed. Equal files give equal archives.
#[derive(Debug, clap::Args)]
pub struct PackArgs {
    /// Graph file
    #[arg(value_name = "GRAPH.ron")]
    file: PathBuf,
    /// Archive to write; by default beside the graph, with its name
    #[arg(short, long, value_name = "FILE.orograph")]
    out: Option<PathBuf>,
    /// Also pack files that are not in the graph's folder
    ///
    /// They get a new path in the archive, and the packed graph refers to them there. Without this option they are
    /// refused, because a graph of somebody else can name any file that you may read. Links are followed first.
    #[arg(long)]
    outside: bool,
}

impl PackArgs {
    pub(super) fn run(self) -> Result<(), Failure> {
        if archive::is_archive(&self.file) {
            return Err(Failure::wrong(format!("`{}` is already packed", self.file.display())));
        }
        let out = self.out.unwrap_or_else(|| self.file.with_extension(EXTENSION));
        if !archive::is_archive(&out) {
            return Err(Failure::wrong(format!("`{}` does not end with .{EXTENSION}", out.display()))
                .hint(format!("write `-o {}`", out.with_extension(EXTENSION).display())));
        }
        let document = problems::load_sound(&self.file, &orograph_nodes::registry(), false)?;
        let packed = archive::pack(&document, &self.file, &out, self.outside)?;
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
/// Never writes outside the folder. An archive is refused, and nothing is left behind, if it has entries that are not
/// plain files, paths that lead outside the folder, hidden files, a duplicate name, more than 10,000 files or more than
/// 4 GiB.
#[derive(Debug, clap::Args)]
pub struct UnpackArgs {
    /// Archive
    #[arg(value_name = "FILE.orograph")]
    file: PathBuf,
    /// Folder to create; by default in the current folder, with the name of the archive
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
}

impl UnpackArgs {
    pub(super) fn run(self) -> Result<(), Failure> {
        if !archive::is_archive(&self.file) {
            return Err(Failure::wrong(format!("`{}` does not end with .{EXTENSION}", self.file.display()))
                .hint("`orograph pack` creates archives"));
        }
        let folder = self.out.or_else(|| self.file.file_stem().map(PathBuf::from)).unwrap_or_default();
        let unpacked = archive::unpack(&self.file, &folder)?;
        let page = Page::stdout();
        let graph = folder.join(unpacked.graph).display().to_string();
        let files = page.dim(&counted(unpacked.files, "file"));
        terminal::print(&format!("{} {}  {files}\n", page.good("unpacked"), page.name(&graph)))
    }
}
