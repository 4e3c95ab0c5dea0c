//! Writes a whole raster with the row writer.

use std::path::Path;

use orograph_graph::Field;

#[cfg(doc)]
use super::Problem;
use super::{Content, Finished, Format, GoOn, Meta, RasterError, Sidecar, Writer, Writing};

/// Writes all rows of a field.
pub(super) fn whole(
    path: &Path,
    content: Content,
    field: &Field,
    beside: Option<&Meta>,
    go_on: GoOn<'_>,
) -> Result<Finished, RasterError> {
    let mut writer = Writer::begin(path, *field.window(), content.over(field))?;
    writer.rows(field, go_on)?;
    writer.finish(beside, go_on)
}

/// Writes a plane of a field and its sidecar. Returns the sidecar.
///
/// # Errors
/// [`Problem::Unwritable`] if either file cannot be written, [`Problem::NotFinite`] if a format of codes cannot
/// represent it, [`Problem::Stopped`] soon after `go_on` returns false; earlier files of these names are then
/// unchanged.
pub fn write(
    path: &Path,
    format: Format,
    field: &Field,
    writing: Writing,
    meta: &Meta,
    go_on: GoOn<'_>,
) -> Result<Sidecar, RasterError> {
    let finished = whole(path, Content::Numbers(format, writing), field, Some(meta), go_on)?;
    Ok(finished.sidecar.unwrap_or_default())
}

/// Writes three planes of linear RGB, 0 to 1, as an 8-bit sRGB picture.
///
/// # Errors
/// [`Problem::Unwritable`], and [`Problem::Stopped`] soon after `go_on` returns false; an earlier file of this name is
/// then unchanged. [`Problem::Misfit`] if the field has fewer than three planes.
pub fn write_colour(path: &Path, field: &Field, go_on: GoOn<'_>) -> Result<(), RasterError> {
    whole(path, Content::Colour, field, None, go_on).map(|_| ())
}
