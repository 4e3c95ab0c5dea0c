//! The shores of lakes as polygons: rings along the edges of cells, with the data of each lake.

use orograph_graph::{Area, Job, Line, Lines, NodeError};

use super::find::Lakes;
use crate::numerics::{outlines, routing::Grid};

/// Returns the shores of all lakes, with the data of each lake.
///
/// # Errors
/// [`NodeError::Cancelled`], or not enough memory.
pub(super) fn outlines(job: &Job<'_>, grid: &Grid, lakes: &Lakes) -> Result<Lines, NodeError> {
    // parts and lakes are numbered by their first cells, so that each lake's parts are in order
    let mut of_lakes: Vec<Vec<Line>> = lakes.all.iter().map(|_| Vec::new()).collect();
    for part in outlines::parts(job, grid.nx, &lakes.of)? {
        let number = part.region as usize - 1;
        let level_m = f64::from(lakes.all[number].level_m);
        of_lakes[number].extend(part.rings.iter().map(|ring| outlines::line(ring, job.cell_m(), 1, |_| level_m)));
    }
    let cell_m2 = job.cell_m() * job.cell_m();
    let areas = lakes.all.iter().zip(&of_lakes).map(|(lake, rings)| Area {
        rings: rings.len() as u32,
        level_m: f64::from(lake.level_m),
        depth_m: f64::from(lake.depth_m),
        area_m2: cell_m2 * f64::from(lake.cells),
        volume_m3: cell_m2 * lake.depths_m,
        spill_m: job.window().centre_m(lake.sill as usize % grid.nx, lake.sill as usize / grid.nx),
    });
    Ok(Lines { areas: areas.collect(), ..Lines::open(of_lakes.into_iter().flatten().collect()) })
}
