//! Heights at vertices. A raster of this program has cells that fill the world; engines and meshes have vertices that span it
//! from edge to edge, n a side with n - 1 squares between them. The outermost vertices, half a cell outside the centres of
//! the outermost cells, have the heights of these.

use orograph_graph::{Field, NodeError, Window, World};
use orograph_nodes::raster::{GoOn, GridAxis, resample};

/// Width and height of what a field covers, in metres.
#[must_use]
pub fn extent(field: &Field) -> [f64; 2] {
    field.window().cells.map(|n| f64::from(n) * field.window().cell_m())
}

/// Metres between vertices that span what a field covers.
#[must_use]
pub fn spacing(field: &Field, vertices: [u32; 2]) -> [f64; 2] {
    let size = extent(field);
    [0, 1].map(|axis| size[axis] / f64::from(vertices[axis] - 1))
}

/// Heights at vertices that span what a field covers from edge to edge, at least two along each axis.
///
/// # Errors
/// [`NodeError::Cancelled`] when `go_on` said no.
pub fn at_vertices(field: &Field, vertices: [u32; 2], go_on: GoOn<'_>) -> Result<Field, NodeError> {
    let axis = |axis: usize| {
        let source = field.window().cells[axis];
        let step = f64::from(source) / f64::from(vertices[axis] - 1);
        GridAxis { source: source as usize, offset: -0.5 * step, step }
    };
    let check = || if go_on() { Ok(()) } else { Err(NodeError::Cancelled) };
    let samples = resample(field.plane(0), [axis(0), axis(1)], [0, 0], vertices, None, &check)?;
    let spacing = spacing(field, vertices);
    let size = [0, 1].map(|axis| spacing[axis] * f64::from(vertices[axis]));
    let world = World { size, cells: vertices, ..field.window().world };
    Ok(Field::new(Window::whole(world), samples))
}
