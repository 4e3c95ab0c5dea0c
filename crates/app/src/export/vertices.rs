//! Resampling of a raster to another grid. Rasters of this program have cells that fill the world; engines and meshes
//! have vertices that span it from edge to edge, n per side with n - 1 squares between them. The outermost vertices,
//! half a cell outside the centres of the outermost cells, get the values of those cells. Pixels of a texture fill the
//! world as cells do.

use orograph_graph::{Field, NodeError, Window, World};
use orograph_nodes::raster::{GoOn, GridAxis, resample};

/// Width and height of the area of a field, in metres.
#[must_use]
pub fn extent(field: &Field) -> [f64; 2] {
    field.window().cells.map(|n| f64::from(n) * field.window().cell_m())
}

/// Spacing in metres of vertices that span the area of a field.
#[must_use]
pub fn spacing(field: &Field, vertices: [u32; 2]) -> [f64; 2] {
    let size = extent(field);
    [0, 1].map(|axis| size[axis] / f64::from(vertices[axis] - 1))
}

/// All planes at vertices that span the area of a field from edge to edge, at least two along each axis.
///
/// # Errors
/// [`NodeError::Cancelled`] when `go_on` returns false.
pub fn at_vertices(field: &Field, vertices: [u32; 2], go_on: GoOn<'_>) -> Result<Field, NodeError> {
    let axes = [0, 1].map(|axis| {
        let source = field.window().cells[axis];
        let step = f64::from(source) / f64::from(vertices[axis] - 1);
        GridAxis { source: source as usize, offset: -0.5 * step, step }
    });
    let spacing = spacing(field, vertices);
    regrid(field, axes, vertices, [0, 1].map(|axis| spacing[axis] * f64::from(vertices[axis])), go_on)
}

/// All planes in pixels that fill the area of a field: averages of smaller cells, cubic interpolation between larger
/// ones.
///
/// # Errors
/// [`NodeError::Cancelled`] when `go_on` returns false.
pub fn at_pixels(field: &Field, pixels: [u32; 2], go_on: GoOn<'_>) -> Result<Field, NodeError> {
    if pixels == field.window().cells {
        return Ok(field.clone());
    }
    let axes = [0, 1].map(|axis| {
        let source = field.window().cells[axis];
        GridAxis { source: source as usize, offset: 0.0, step: f64::from(source) / f64::from(pixels[axis]) }
    });
    regrid(field, axes, pixels, extent(field), go_on)
}

fn regrid(
    field: &Field,
    axes: [GridAxis; 2],
    cells: [u32; 2],
    size: [f64; 2],
    go_on: GoOn<'_>,
) -> Result<Field, NodeError> {
    let check = || if go_on() { Ok(()) } else { Err(NodeError::Cancelled) };
    let mut samples = Vec::new();
    for plane in 0..field.planes() {
        let taken = resample(field.plane(plane), axes, [0, 0], cells, None, &check)?;
        if samples.is_empty() {
            samples = taken;
        } else {
            samples.extend_from_slice(&taken);
        }
    }
    let world = World { size, cells, ..field.window().world };
    Ok(Field::with_planes(Window::whole(world), field.planes(), samples))
}
