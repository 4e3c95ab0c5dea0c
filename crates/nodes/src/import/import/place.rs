//! Where the cells of the world lie in the raster.

use std::path::Path;

use orograph_graph::{GeoPlace, memory::zeroed};

use super::{Params, Placement, Resampled, beyond};
use crate::{
    prelude::*,
    raster::{Cell, GridAxis, Head, Warp, WarpError},
};

/// The cells onto which a raster is resampled along its own axes.
pub(super) struct Grid {
    pub(super) axes: [GridAxis; 2],
    pub(super) origin: [u32; 2],
    pub(super) cells: [u32; 2],
    /// The value beyond the raster; None if its edge continues.
    pub(super) beyond: Option<f32>,
    /// The same for the mask of known cells.
    pub(super) known_beyond: Option<f32>,
}

/// How the cells of the world get the values of a raster.
pub(super) enum Mapping {
    /// Its rows and columns are parallel to theirs.
    Aligned([GridAxis; 2]),
    /// It is in another coordinate system.
    Warped(Box<Warp>),
}

impl Mapping {
    pub(super) fn new(job: &Job<'_>, params: &Params, path: &Path, head: &Head) -> Result<Self, NodeError> {
        if params.placement != Placement::Place {
            return scaled(job, params, path, head).map(Self::Aligned);
        }
        let Some(place) = job.place() else {
            let what = "the world has no place on Earth, but `placement: place` needs one";
            return Err(NodeError::failed_with_hint(what, "add `place` to `world`, as `orograph new` does"));
        };
        match warp(Some(place), params, head, &job.window()) {
            Ok(Some(warp)) => Ok(Self::Warped(Box::new(warp))),
            Ok(None) => placed(job, place, path, head).map(Self::Aligned),
            Err(error) => Err(NodeError::failed_with_hint(
                format!("`{}` cannot be placed: {error}", path.display()),
                match error {
                    WarpError::Apart => "compare its corner with that of the world's `place`".to_owned(),
                    WarpError::NoSystem => {
                        "write its code into it, with `gdal_translate -a_srs EPSG:N in.tif out.tif`, or \
                                            into `NAME.prj` beside an ASCII grid"
                            .to_owned()
                    }
                    WarpError::NotMetric(_) => "choose a world in metres, as `orograph new` does".to_owned(),
                    _ => format!("reproject it: `gdalwarp -t_srs EPSG:{} in.tif out.tif`", place.epsg),
                },
            )),
        }
    }

    /// The cells onto which the raster is resampled first.
    pub(super) fn grid(&self, job: &Job<'_>, params: &Params) -> Grid {
        match self {
            Self::Aligned(axes) => {
                let Window { origin, cells, .. } = job.window();
                Grid { axes: *axes, origin, cells, beyond: beyond(params), known_beyond: Some(0.0) }
            }
            Self::Warped(warp) => {
                let Warp { axes, origin, cells, .. } = **warp;
                Grid { axes, origin, cells, beyond: None, known_beyond: None }
            }
        }
    }

    /// Brings what was resampled onto the cells of the window.
    pub(super) fn onto_cells(&self, job: &Job<'_>, params: &Params, read: Resampled) -> Result<Resampled, NodeError> {
        let Self::Warped(warp) = self else { return Ok(read) };
        let sample = |grid: Vec<f32>, beyond: Option<f32>| {
            let mut out = zeroed(job.window().len())?;
            warp.sample(&grid, beyond, &mut out, &|| job.check())?;
            Ok::<_, NodeError>(out)
        };
        let value = sample(read.value, beyond(params))?;
        let data = read.data.map(|data| sample(data, Some(0.0))).transpose()?;
        Ok(Resampled { value, data, voids: read.voids })
    }

    /// What is worth knowing about it.
    pub(super) fn remarks(&self) -> Vec<String> {
        if let Self::Warped(warp) = self { warp.remarks.clone() } else { Vec::new() }
    }
}

/// Returns the warp of a raster that is in another coordinate system than the world. Returns None if it is in the same
/// one, or not placed by its coordinates.
pub(super) fn warp(
    place: Option<GeoPlace>,
    params: &Params,
    head: &Head,
    window: &Window,
) -> Result<Option<Warp>, WarpError> {
    let Some(place) = place.filter(|_| params.placement == Placement::Place) else { return Ok(None) };
    if matches!(head.cell, Some(Cell::Metres(_))) && head.unit_m == 1.0 && head.epsg == Some(place.epsg) {
        return Ok(None);
    }
    Warp::new(head, place, window).map(Some)
}

/// Returns the mapping of the world's cells to those of a raster at its scale, or stretched.
fn scaled(job: &Job<'_>, params: &Params, path: &Path, head: &Head) -> Result<[GridAxis; 2], NodeError> {
    let of_file = || head.cell_m().map_err(|problem| problem.of(path));
    let size = match params.placement {
        // the size of its own cells does not matter
        Placement::Stretch => None,
        _ if params.cell > 0.0 => Some([params.cell; 2]),
        _ => of_file()?,
    };
    let axis = |axis: usize| {
        let (source, target) = ([head.columns, head.rows][axis], f64::from(job.world().cells[axis]));
        let (step, offset) = match (params.placement, size) {
            (Placement::Stretch, _) | (_, None) => (source as f64 / target, 0.0),
            (Placement::Corner, Some(size)) => (job.cell_m() / size[axis], 0.0),
            (_, Some(size)) => {
                let step = job.cell_m() / size[axis];
                (step, 0.5 * (source as f64 - target * step))
            }
        };
        GridAxis { source, offset, step }.snapped()
    };
    Ok([axis(0), axis(1)])
}

/// Returns the mapping of the world's cells to those of a raster of the same coordinate system.
fn placed(job: &Job<'_>, place: GeoPlace, path: &Path, head: &Head) -> Result<[GridAxis; 2], NodeError> {
    let size = head.cell_m().map_err(|problem| problem.of(path))?;
    let (Some(corner), Some(size)) = (head.origin, size) else {
        let what = format!("`{}` does not say where it lies", path.display());
        return Err(NodeError::failed_with_hint(what, "choose another `placement`"));
    };
    let offset = [place.corner_m[0] - corner[0], corner[1] - place.corner_m[1]];
    let axes = [0, 1].map(|axis| {
        let (source, offset) = ([head.columns, head.rows][axis], offset[axis] / size[axis]);
        GridAxis { source, offset, step: job.cell_m() / size[axis] }.snapped_to_cells()
    });
    let meets = |axis: usize| {
        let GridAxis { source, offset, step } = axes[axis];
        offset < source as f64 && offset + step * f64::from(job.world().cells[axis]) > 0.0
    };
    if !(meets(0) && meets(1)) {
        let what = format!("`{}` lies outside of the world", path.display());
        return Err(NodeError::failed_with_hint(what, "compare its corner with that of the world's `place`"));
    }
    Ok(axes)
}
