//! The example graphs, with their pictures; they are part of the program.
//!
//! An example opens as a copy without a file, so that saving asks for a name and the example never changes. The files
//! that examples read (a raster, another graph) are written to the folder of [`state`], where the copy finds them;
//! saving the copy copies them too.
//!
//! The pictures in `graphs/pictures` are made by `orograph render graphs/NAME.ron --cells 240 -o
//! graphs/pictures/NAME.png`, with `--output` where [`EXAMPLES`] has one; that of `badlands` with 480 cells, at half size.

use std::{fs, io::Write as _, path::Path};

use egui::{Align, Context, Id, Label, Layout, RichText, ScrollArea, Sense, Ui, vec2};
use orograph_graph::files::{self, Access, Part};

use crate::editor::{
    FileCommand,
    window::{names::Named as _, state, theme},
};

/// An example graph.
struct Example {
    /// The name of its file, without the extension.
    name: &'static str,
    /// Its title.
    title: &'static str,
    text: &'static str,
    picture: &'static [u8],
}

macro_rules! examples {
    ($($name:literal $title:literal $(output $output:literal)?;)+) => {
        &[$(Example {
            name: $name,
            title: $title,
            text: include_str!(concat!("../../../../../graphs/", $name, ".ron")),
            picture: include_bytes!(concat!("../../../../../graphs/pictures/", $name, ".png")),
        }),+]
    };
}

/// The example graphs, the simplest first. `output` is the output in the picture; without it, the height.
const EXAMPLES: &[Example] = examples! {
    "alps" "Alps";
    "hello" "A first range";
    "ridges" "Ridges and rivers";
    "scree" "Cliffs and scree";
    "isles" "Islands" output "colour";
    "gullies" "Gullies after a storm" output "after";
    "rivers" "Rivers and lakes" output "map";
    "fault" "A fault and its escarpment" output "map";
    "mesas" "Mesas" output "colour";
    "belts" "Vegetation belts" output "colour";
    "painted" "Painted for an engine" output "colour";
    "glen" "A Highland glen" output "relief";
    "canyon" "A canyon in layered rock" output "map";
    "two_ranges" "Two ranges from one graph";
    "carve_dem" "A real landscape, eroded further" output "after";
    "fjords" "A fjord coast";
    "himalaya" "A very high range";
    "highlands" "Moors and glens";
    "badlands" "Badlands" output "colour";
    "foldbelt" "A fold belt";
    "coast_range" "A dissected coastal range";
    "basin_and_range" "Basins and ranges" output "colour";
    "terraces" "Terraced fields" output "colour";
    "ridge" "A reusable range";
    "amplify" "A coarse model with gullies" output "after";
    "talus_dem" "Real mountains with talus" output "after";
    "rivers_dem" "Rivers of a real landscape" output "map";
    "flood_dem" "A flood in real canyons" output "map";
};

/// The files that examples read, by their relative paths.
const READ: &[(&str, &[u8])] = &[
    ("data/bigtujunga_512_30m.tif", include_bytes!("../../../../../graphs/data/bigtujunga_512_30m.tif")),
    ("ridge.ron", include_bytes!("../../../../../graphs/ridge.ron")),
];

/// The dialog of the examples.
#[derive(Default)]
pub(crate) struct Gallery {
    cards: Cards,
}

/// The examples as a grid of pictures.
#[derive(Default)]
pub(super) struct Cards {
    /// The pictures, once they are decoded.
    pictures: Vec<Option<egui::TextureHandle>>,
    /// Why an example could not be opened.
    failure: Option<String>,
}

/// Side of a picture in points.
const SIDE: f32 = 132.0;
/// Gap between them, and width of the scroll bar.
const GAP: f32 = 12.0;
const BAR: f32 = 10.0;

impl Gallery {
    /// Shows the dialog above everything. Returns None until it is closed; then the inner value is the chosen example,
    /// or None.
    pub(crate) fn ui(&mut self, context: &Context) -> Option<Option<FileCommand>> {
        let mut chosen = None;
        let modal = theme::modal(context, Id::new("gallery")).show(context, |ui| {
            let room = ui.ctx().content_rect().size();
            let columns = ((room.x - 80.0) / (SIDE + GAP)).floor().clamp(1.0, 5.0);
            ui.set_width(Cards::width(columns));
            ui.heading("Examples");
            ui.add(Label::new(RichText::new("Each opens as an unsaved copy.").weak()).wrap());
            chosen = self.cards.ui(ui, columns, (room.y - 150.0).max(80.0));
            ui.add_space(6.0);
            if ui.button("Cancel").clicked() {
                ui.close();
            }
        });
        if chosen.is_some() {
            return Some(chosen);
        }
        modal.should_close().then_some(None)
    }
}

impl Cards {
    /// The width of so many columns; the scroll bar is beside the last one.
    pub(super) fn width(columns: f32) -> f32 {
        columns * (SIDE + GAP) - GAP + BAR
    }

    /// Shows the pictures in columns. Returns the command that opens a copy of the clicked example.
    pub(super) fn ui(&mut self, ui: &mut Ui, columns: f32, height: f32) -> Option<FileCommand> {
        if self.pictures.is_empty() {
            self.pictures = EXAMPLES.iter().map(|example| texture(ui.ctx(), example)).collect();
        }
        if let Some(failure) = &self.failure {
            ui.colored_label(ui.visuals().error_fg_color, failure);
        }
        let mut chosen = None;
        ScrollArea::vertical().max_height(height).show(ui, |ui| {
            ui.spacing_mut().item_spacing = vec2(GAP, GAP);
            ui.set_max_width(columns * (SIDE + GAP));
            ui.horizontal_wrapped(|ui| {
                for (example, picture) in EXAMPLES.iter().zip(&self.pictures) {
                    if card(ui, example, picture.as_ref()) {
                        chosen = Some(example);
                    }
                }
            });
        });
        match chosen.map(copy)? {
            Ok(command) => Some(command),
            Err(reason) => {
                self.failure = Some(reason);
                None
            }
        }
    }
}

/// The command that opens a copy of an example by its name. Returns None when there is no such example, or its files
/// cannot be written.
pub(super) fn opened(name: &str) -> Option<FileCommand> {
    EXAMPLES.iter().find(|example| example.name == name).and_then(|example| copy(example).ok())
}

/// An example with its picture. Returns true if it was clicked.
fn card(ui: &mut Ui, example: &Example, picture: Option<&egui::TextureHandle>) -> bool {
    let layout = Layout::top_down(Align::LEFT);
    let inner = ui.allocate_ui_with_layout(vec2(SIDE, SIDE + 40.0), layout, |ui| {
        ui.set_width(SIDE);
        ui.spacing_mut().item_spacing.y = 4.0;
        let sized = egui::vec2(SIDE, SIDE);
        let response = match picture {
            Some(picture) => {
                // the central square
                let shown = egui::Vec2::splat(picture.size_vec2().min_elem()) / picture.size_vec2();
                let centre = egui::Rect::from_center_size(egui::pos2(0.5, 0.5), shown);
                let image = egui::Image::from_texture((picture.id(), sized)).uv(centre).corner_radius(4.0);
                ui.add(image.fit_to_exact_size(sized).sense(Sense::click()).alt_text(example.title))
            }
            None => ui.allocate_response(sized, Sense::click()).named(format!("picture of {}", example.title)),
        };
        if response.hovered() {
            let stroke = egui::Stroke::new(2.0, ui.visuals().hyperlink_color);
            ui.painter().rect_stroke(response.rect, 4.0, stroke, egui::StrokeKind::Outside);
        }
        let title = ui.add(Label::new(example.title).wrap().sense(Sense::click()));
        let clicked = response.clicked() || title.clicked();
        response.on_hover_text(about(example.text));
        clicked
    });
    inner.inner
}

/// The comment at the start of a graph.
fn about(text: &str) -> String {
    let lines = text.lines().map_while(|line| line.trim().strip_prefix("//"));
    lines.map(str::trim).collect::<Vec<_>>().join(" ")
}

fn texture(context: &Context, example: &Example) -> Option<egui::TextureHandle> {
    let mut reader = png::Decoder::new(std::io::Cursor::new(example.picture)).read_info().ok()?;
    let mut bytes = vec![0; reader.output_buffer_size()?];
    let frame = reader.next_frame(&mut bytes).ok()?;
    if frame.color_type != png::ColorType::Rgb || frame.bit_depth != png::BitDepth::Eight {
        return None;
    }
    let size = [frame.width as usize, frame.height as usize];
    let image = egui::ColorImage::from_rgb(size, &bytes[..frame.buffer_size()]);
    Some(context.load_texture(example.name, image, egui::TextureOptions::LINEAR))
}

/// A copy of an example, with the files that it reads.
///
/// # Errors
/// When the files cannot be written.
fn copy(example: &Example) -> Result<FileCommand, String> {
    let folder =
        state::folder().map_or_else(|| std::env::temp_dir().join("orograph"), |folder| folder.join("examples"));
    place(&folder)
        .map_err(|error| format!("cannot write the files that the examples read to {}: {error}", folder.display()))?;
    Ok(FileCommand::Copy { name: example.name.to_owned(), text: example.text.to_owned(), folder })
}

/// Writes the files that examples read into a folder, unless they exist.
fn place(folder: &Path) -> std::io::Result<()> {
    for (name, bytes) in READ {
        let path = folder.join(name);
        let is_as_long = fs::metadata(&path).is_ok_and(|there| there.len() == bytes.len() as u64);
        if is_as_long && fs::read(&path).is_ok_and(|there| there == *bytes) {
            continue;
        }
        if let Some(parent) = path.parent() {
            files::create_folders(parent, files::Access::Usual)?;
        }
        // Another window may do the same, so the file must appear whole.
        let mut part = Part::begin(&path, Access::Usual)?;
        part.write_all(bytes)?;
        part.persist()?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use orograph_graph::Document;

    use super::*;

    #[test]
    fn every_example_is_valid_and_finds_its_files() {
        let folder = tempfile::tempdir().expect("a folder");
        let folder = folder.path().join("examples");
        place(&folder).expect("written");
        place(&folder).expect("there already");
        let registry = orograph_nodes::registry();
        for example in EXAMPLES {
            let document = Document::parse_in(example.text, &folder, &registry);
            assert_eq!(document.problems(), [], "{}", example.name);
            assert!(document.path().is_none());
            for file in document.files() {
                assert!(file.is_file(), "{} reads {}", example.name, file.display());
            }
            assert!(!about(example.text).is_empty() && example.picture.len() < 150_000, "{}", example.name);
        }
    }
}
