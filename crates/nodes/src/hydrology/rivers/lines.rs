//! Lines along channels, one for each link between heads, junctions and ends.

use orograph_graph::{Job, Line, Lines, NodeError, Vertex};

use super::{
    Params, Sections,
    network::Network,
    shape::{simplified, smoothed},
};
use crate::numerics::{
    drained::Drained,
    par,
    routing::{
        Grid,
        code::{STEPS, direction, has_receiver},
    },
};

/// Returns the links in the order of their first cells. A link of a single cell at the border of the world has no line.
/// Lines across a periodic side continue beyond it.
///
/// # Errors
/// [`NodeError::Cancelled`].
pub fn trace(
    job: &Job<'_>,
    grid: &Grid,
    drained: &Drained<'_>,
    network: &Network,
    sections: &Sections,
    params: &Params,
) -> Result<Lines, NodeError> {
    let inflows = network.inflows(job, grid)?;
    let rows = par::collect(0..grid.ny, |_, y| {
        job.check()?;
        let cells = (y * grid.nx..(y + 1) * grid.nx)
            .filter(|&cell| network.orders[cell] > 0 && inflows[cell] != 1 && has_receiver(network.codes[cell]));
        Ok::<_, NodeError>(cells.map(|cell| cell as u32).collect::<Vec<u32>>())
    })?;
    let starts = rows.concat();
    let links = Links { job, grid, drained, network, inflows, sections };
    let lines = par::collect(&starts, |_, &start| {
        job.check()?;
        let (vertices, end) = links.follow(start);
        let vertices = smoothed(simplified(vertices, params.simplify), params.smooth);
        let downstream = starts.binary_search(&end).ok().map(|at| at as u32);
        Ok::<_, NodeError>(Line { order: u32::from(network.orders[start as usize]), downstream, vertices })
    })?;
    Ok(Lines::open(lines))
}

struct Links<'a> {
    job: &'a Job<'a>,
    grid: &'a Grid,
    drained: &'a Drained<'a>,
    network: &'a Network,
    inflows: Vec<u8>,
    sections: &'a Sections,
}

impl Links<'_> {
    /// Returns the vertices from a link's first cell to its last, and the last cell.
    fn follow(&self, start: u32) -> (Vec<Vertex>, u32) {
        let cell_m = self.job.cell_m();
        let window = self.job.window();
        let mut cell = start;
        let mut position_m = window.centre_m(cell as usize % self.grid.nx, cell as usize / self.grid.nx);
        let mut vertices = vec![self.vertex(cell, position_m)];
        loop {
            let code = self.network.codes[cell as usize];
            if !has_receiver(code) {
                return (vertices, cell);
            }
            cell = self.grid.receiver(cell, code);
            let (east, south) = STEPS[direction(code)];
            position_m = [position_m[0] + f64::from(east) * cell_m, position_m[1] + f64::from(south) * cell_m];
            let mut vertex = self.vertex(cell, position_m);
            let joins = self.inflows[cell as usize] != 1;
            if joins && let Some(last) = vertices.last() {
                // the river downstream of a junction has its own width and depth
                vertex = Vertex { position_m, elevation_m: vertex.elevation_m, ..*last };
            }
            vertices.push(vertex);
            if joins {
                return (vertices, cell);
            }
        }
    }

    fn vertex(&self, cell: u32, position_m: [f64; 2]) -> Vertex {
        let at = |samples: &[f32]| f64::from(samples[cell as usize]);
        Vertex {
            position_m,
            elevation_m: at(self.drained.level_m),
            width_m: at(&self.sections.width_m),
            depth_m: at(&self.sections.depth_m),
            area_m2: at(self.drained.area_m2),
        }
    }
}
