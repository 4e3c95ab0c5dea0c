//! Writes the files of one output as its rows are ready.

use orograph_graph::{Cancel, Field, OutputDecl, PortType, Window};
use orograph_nodes::raster::{self, Content, GoOn, Meta, Writer};
use serde_json::{Map, Value};

use super::{
    Import, OutputFolder,
    folder::Staged,
    holes::has_holes,
    names::{PREVIEW, is_described, quantity, rasters, sidecar, views, written},
};
use crate::{
    export::{
        engine::Exported,
        mesh::Mesh,
        picture::{Shrinking, View, of_height},
        tiles::Tiles,
    },
    report::failure::Failure,
};

/// Maximum number of pixels along the longer side of a preview.
const PREVIEW_SIDE: u32 = 2048;

/// Writes the files of one output: rasters, and for heights a preview and a mesh.
///
/// It accepts bands of rows from north to south and buffers a few megabytes of them, or, if it [cannot
/// stream](Self::is_streamable), the whole raster as one band. No file has its final name before
/// [`OutputFolder::commit`]; dropped before [`Self::finish`], it leaves nothing.
pub struct OutputWriter<'a> {
    folder: &'a OutputFolder,
    output: OutputDecl,
    window: Window,
    rasters: Vec<Raster>,
    preview: Option<Shrinking>,
    /// Number of rows written.
    done: u32,
}

/// A raster that is being written.
struct Raster {
    name: String,
    writer: Writer,
    /// The import settings for an engine.
    import: Map<String, Value>,
    tile: [u32; 2],
    /// The part of the world that a tile of its cells shows.
    shows: Window,
}

impl<'a> OutputWriter<'a> {
    pub(super) fn new(folder: &'a OutputFolder, output: &OutputDecl, window: Window) -> Self {
        let has_preview = views(output, &folder.options).iter().any(|name| name.ends_with(PREVIEW));
        let preview = has_preview.then(|| Shrinking::new(&window, 1, PREVIEW_SIDE));
        Self { folder, output: output.clone(), window, rasters: Vec::new(), preview, done: 0 }
    }

    /// Returns true if it accepts rows as they are ready. Files for engines, tiles and meshes need the whole raster, and
    /// so do codes over the raster's own range.
    #[must_use]
    pub fn is_streamable(&self) -> bool {
        let (options, ty) = (&self.folder.options, self.output.ty);
        let is_mesh = options.mesh.is_some() && ty == PortType::Height;
        options.ends(ty).is_empty() && options.tiles().is_none() && !is_mesh && !self.content(0).needs_whole()
    }

    /// The encoding of a plane without an engine.
    fn content(&self, plane: usize) -> Content {
        let options = &self.folder.options;
        match self.output.ty {
            PortType::Colour => Content::Colour,
            PortType::Normal => Content::Normal,
            PortType::Weights => Content::Weights,
            ty => Content::numbers(ty, options.format, options.dither).of_plane(plane),
        }
    }

    /// Writes the next rows: a field whose window is a band of the output's window, or all of it if the output cannot
    /// stream.
    ///
    /// # Errors
    /// When they cannot be written, are not the next rows, or the build is cancelled.
    pub fn rows(&mut self, band: &Field, cancel: &Cancel) -> Result<(), Failure> {
        let go_on = || !cancel.is_cancelled();
        if *band.window() != self.window && !self.is_streamable() {
            return Err(self.misfit("it is written whole, and a part of it came"));
        }
        let holes = self.folder.holes.as_ref().filter(|_| has_holes(&self.output, &self.folder.options));
        let punched = holes.map(|holes| holes.punch(band));
        let numbers = punched.as_ref().unwrap_or(band);
        if self.rasters.is_empty() {
            self.begin(numbers, &go_on)?;
        } else {
            for raster in &mut self.rasters {
                raster.writer.rows(numbers, &go_on).map_err(|error| self.folder.failure(&raster.name, error))?;
            }
        }
        if let Some(preview) = &mut self.preview {
            preview.rows(band);
        }
        if let Some(name) = self.mesh_name() {
            self.write_mesh(&name, band, &go_on)?;
        }
        self.done += band.window().cells[1];
        Ok(())
    }

    /// Opens the files and writes the first rows.
    fn begin(&mut self, band: &Field, go_on: GoOn<'_>) -> Result<(), Failure> {
        let (options, ty) = (&self.folder.options, self.output.ty);
        let names = rasters(&self.output, options);
        let tiles = options.tiles().unwrap_or(Tiles::WHOLE);
        let names = names.chunks(tiles.each().count());
        if let Some(engine) = options.engine.filter(|_| !options.ends(ty).is_empty()) {
            let pieces = engine.fit(&Exported { ty, value: band, tiles, dither: options.dither, go_on });
            let pieces = pieces.map_err(|_| Failure::stopped())?;
            let written = written(&self.output, pieces.len());
            let pieces = pieces.into_iter().zip(written).filter(|(_, is)| *is).map(|(piece, _)| piece);
            for (piece, names) in pieces.zip(names) {
                for (tile, name) in tiles.each().zip(names) {
                    let field = piece.field.crop(&tiles.window(piece.field.window(), tile, piece.shared));
                    let raster = self.open(name, *field.window(), piece.content, &field, go_on)?;
                    let (mut import, shows) = (piece.import.clone(), tiles.window(&self.window, tile, 0));
                    if !shows.is_whole() {
                        engine.place(&mut import, &shows);
                    }
                    self.rasters.push(Raster { import, tile, shows, ..raster });
                }
            }
            return Ok(());
        }
        for (plane, names) in names.enumerate() {
            let content = self.content(plane).over(band);
            for (tile, name) in tiles.each().zip(names) {
                let window = tiles.window(&self.window, tile, 0);
                // a single tile has the rows that have come
                let rows = if tiles == Tiles::WHOLE { band.clone() } else { band.crop(&window) };
                let raster = self.open(name, window, content, &rows, go_on)?;
                self.rasters.push(Raster { tile, ..raster });
            }
        }
        Ok(())
    }

    fn open(
        &self,
        name: &str,
        window: Window,
        content: Content,
        rows: &Field,
        go_on: GoOn<'_>,
    ) -> Result<Raster, Failure> {
        let path = self.folder.place(name);
        let writer = Writer::begin(&path, window, content.over(rows));
        let mut writer = writer.map_err(|error| self.folder.failure(name, error))?;
        writer.rows(rows, go_on).map_err(|error| self.folder.failure(name, error))?;
        Ok(Raster { name: name.to_owned(), writer, import: Map::new(), tile: [0; 2], shows: window })
    }

    /// The name of the mesh. Returns None when no mesh is requested.
    fn mesh_name(&self) -> Option<String> {
        views(&self.output, &self.folder.options).into_iter().find(|name| !name.ends_with(PREVIEW))
    }

    fn write_mesh(&self, name: &str, height: &Field, go_on: GoOn<'_>) -> Result<(), Failure> {
        let options = &self.folder.options;
        let Some(format) = options.mesh else { return Ok(()) };
        let mesh = Mesh::of(height, options.triangles, go_on).map_err(|_| Failure::stopped())?;
        let written = raster::replace(&self.folder.place(name), |to| mesh.write(format, to));
        written.map_err(|error| self.folder.failure(name, error))
    }

    /// Completes the files; `key` is the hash of everything the output depends on.
    ///
    /// # Errors
    /// When they cannot be written, rows are missing, or the build is cancelled.
    pub fn finish(mut self, key: &str, cancel: &Cancel) -> Result<(), Failure> {
        let go_on = || !cancel.is_cancelled();
        if self.done != self.window.cells[1] {
            return Err(self.misfit("it ends before its last row"));
        }
        let mut files = Vec::new();
        let is_described = is_described(&self.output, &self.folder.options, &self.window);
        for raster in std::mem::take(&mut self.rasters) {
            self.finish_raster(raster, is_described, (key, &go_on), &mut files)?;
        }
        if let Some(preview) = self.preview.take() {
            let name = format!("{}{PREVIEW}", self.output.name);
            let picture = of_height(&preview.finish(), View::Map);
            let written = raster::write_colour(&self.folder.place(&name), &picture, &go_on);
            written.map_err(|error| self.folder.failure(&name, error))?;
            files.push(self.folder.staged(&self.output, &name, "picture", None)?);
        }
        if let Some(name) = self.mesh_name() {
            files.push(self.folder.staged(&self.output, &name, "mesh", None)?);
        }
        self.folder.add(&self.output, files);
        Ok(())
    }

    fn finish_raster(
        &self,
        raster: Raster,
        is_described: bool,
        (key, go_on): (&str, GoOn<'_>),
        files: &mut Vec<Staged>,
    ) -> Result<(), Failure> {
        let Raster { name, writer, import, tile, shows } = raster;
        let (folder, output) = (self.folder, &self.output);
        let import = Some(import).filter(|import| !import.is_empty());
        let meta = Meta {
            quantity: quantity(output.ty).to_owned(),
            unit: output.ty.unit().symbol().to_owned(),
            supersample: Some(folder.supersample).filter(|factor| *factor > 1),
            graph_hash: Some(key.to_owned()),
            import: import.clone(),
            shows: Some(shows),
        };
        let finished = writer.finish(is_described.then_some(&meta), go_on);
        let finished = finished.map_err(|error| folder.failure(&name, error))?;
        // an earlier side file would describe this raster
        files.push(Staged { name: sidecar(&name), is_new: is_described, written: None });
        let mut staged = folder.staged(output, &name, quantity(output.ty), finished.range)?;
        if let Some(written) = &mut staged.written {
            written.is_described = is_described;
            written.import =
                folder.options.engine.zip(import).map(|(engine, settings)| Import { engine, tile, settings });
        }
        files.push(staged);
        Ok(())
    }

    /// A programming error of the caller.
    fn misfit(&self, what: &str) -> Failure {
        Failure::unable(format!("`{}` cannot be written: {what}", self.output.name))
    }
}
