//! Writes a whole raster: the row writer with all rows at once.

use std::path::Path;

use orograph_graph::Field;

#[cfg(doc)]
use super::Problem;
use super::{Content, Finished, Format, GoOn, Meta, RasterError, Sidecar, Writer, Writing};

/// Writes a field whole.
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

/// Writes a plane of a field, and its sidecar; returns the sidecar.
///
/// # Errors
/// [`Problem::Unwritable`] when either file cannot be written, [`Problem::NotFinite`] when a format of codes cannot hold it,
/// [`Problem::Stopped`] soon after `go_on` has become false; earlier files of these names are then as they were.
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
/// [`Problem::Unwritable`], and [`Problem::Stopped`] soon after `go_on` has become false; an earlier file of this name is
/// then as it was. [`Problem::Misfit`] when the field has fewer than three planes.
pub fn write_colour(path: &Path, field: &Field, go_on: GoOn<'_>) -> Result<(), RasterError> {
    whole(path, Content::Colour, field, None, go_on).map(|_| ())
}
