// The ice grid; see crates/nodes/src/erosion/glacial/grid.rs. Rasters of the ground and of thickness have two rows and
// columns beyond each side, and the ground there is the surface beyond the side less the thickness there. It needs shaders/lib/sides.

const PAD = 2u;

/// Whether an invocation has no cell.
fn is_beyond(spot: vec2<u32>) -> bool { return spot.x >= p.k_nx || spot.y >= p.k_ny; }

/// The place of a cell in a raster without cells beyond the sides.
fn inside(spot: vec2<u32>) -> u32 { return spot.y * p.k_nx + spot.x; }

fn stride() -> u32 { return p.k_nx + 2u * PAD; }

/// The place of a cell in a raster with cells beyond the sides.
fn padded(i: u32, j: u32) -> u32 { return (j + PAD) * stride() + i + PAD; }

/// The place of the west face of a cell, or of the face east of a row.
fn west_of(i: u32, j: u32) -> u32 { return j * (p.k_nx + 1u) + i; }

/// The place of the north face of a cell, or of the face south of a column.
fn north_of(i: u32, j: u32) -> u32 { return j * p.k_nx + i; }

/// The kind of the side before (0) or behind (1) a line along x (0) or y (1).
fn side_of(columns: bool, last: bool) -> u32 {
    if (columns) {
        return select(p.side_north, p.side_south, last);
    }
    return select(p.side_west, p.side_east, last);
}
