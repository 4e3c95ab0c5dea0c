//! Cells that files leave without data (`--holes`).

use orograph_graph::{Field, OutputDecl, PortType, Window};
use orograph_nodes::numerics::{par, voids::is_void};

use super::OutputOptions;
use crate::{export::engine::Engine, report::failure::Failure};

/// The cells of a window that are written without data.
#[derive(Debug)]
pub struct Holes {
    window: Window,
    is_hole: Vec<bool>,
}

impl Holes {
    /// Returns the holes where a mask is below one half.
    #[must_use]
    pub fn of(mask: &Field) -> Self {
        Self { window: *mask.window(), is_hole: par::map_of(mask.plane(0), |known| is_void(*known)) }
    }

    /// Returns rows of a raster with NaN in the holes.
    pub(super) fn punch(&self, band: &Field) -> Field {
        let (window, nx) = (*band.window(), self.window.nx());
        let first = (window.origin[1] - self.window.origin[1]) as usize * nx;
        let is_hole = &self.is_hole[first..first + window.len()];
        let mut samples = band.samples().to_vec();
        for plane in samples.chunks_exact_mut(window.len()) {
            par::change_with(plane, is_hole, |v, is_hole| {
                if *is_hole {
                    *v = f32::NAN;
                }
            });
        }
        Field::with_planes(window, band.planes(), samples)
    }
}

/// Returns true if the files of an output have the holes: those of numbers, but of pictures and weights none.
pub(super) fn has_holes(output: &OutputDecl, options: &OutputOptions) -> bool {
    match output.ty {
        PortType::Height => true,
        PortType::Mask | PortType::Scalar(_) | PortType::AnyScalar | PortType::Vector(_) => {
            options.ends(output.ty).is_empty()
        }
        _ => false,
    }
}

/// Refuses holes in files that cannot have them.
///
/// # Errors
/// When an output is written as integer codes.
pub fn check(outputs: &[OutputDecl], options: &OutputOptions) -> Result<(), Failure> {
    for output in outputs.iter().filter(|output| options.holes.is_some() && has_holes(output, options)) {
        let written = match options.engine.filter(|_| !options.ends(output.ty).is_empty()) {
            Some(Engine::Godot) => continue,
            Some(engine) => engine.title(),
            None if options.format.largest_code().is_some() => options.format.name(),
            None => continue,
        };
        let what = format!("`{}` cannot have holes: {written} has no value for cells without data", output.name);
        return Err(Failure::wrong(what).hint("write `--format` exr, tiff, cog or r32, or `--engine godot`"));
    }
    Ok(())
}
