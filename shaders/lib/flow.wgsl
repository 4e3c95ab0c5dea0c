// The raster of crates/nodes/src/numerics/routing (`grid`, `code`): neighbours in the order E, NE, N, NW, W, SW, S, SE, and
// receivers as their number, `PIT` where water stays, `OUTLET` where it leaves the world. It needs shaders/lib/lines.

const NOWHERE: u32 = 0xffffffffu;
const PIT: u32 = 32u;
const OUTLET: u32 = 64u;

const SIDE_CLOSED: u32 = 0u;
const SIDE_BASE: u32 = 1u;
const SIDE_OPEN: u32 = 2u;

/// The index of a neighbour, or `NOWHERE`.
fn beside(cell: vec2<u32>, way: u32) -> u32 {
    let dx = select(select(0, -1, way >= 3u && way <= 5u), 1, way <= 1u || way == 7u);
    let dy = select(select(0, 1, way >= 5u), -1, way >= 1u && way <= 3u);
    let x = cell_in_line(i32(cell.x) + dx, p.nx, p.k_wrap_x != 0u);
    let y = cell_in_line(i32(cell.y) + dy, p.ny, p.k_wrap_y != 0u);
    if (x < 0 || y < 0) {
        return NOWHERE;
    }
    return u32(y) * p.nx + u32(x);
}

fn cell_at(index: u32) -> vec2<u32> { return vec2<u32>(index % p.nx, index / p.nx); }

fn opposite(way: u32) -> u32 { return way ^ 4u; }

/// How water leaves the world at a cell.
fn outlet_of(cell: vec2<u32>) -> u32 {
    let west = select(SIDE_CLOSED, p.k_west, cell.x == 0u);
    let east = select(SIDE_CLOSED, p.k_east, cell.x + 1u == p.nx);
    let north = select(SIDE_CLOSED, p.k_north, cell.y == 0u);
    let south = select(SIDE_CLOSED, p.k_south, cell.y + 1u == p.ny);
    if (west == SIDE_BASE || east == SIDE_BASE || north == SIDE_BASE || south == SIDE_BASE) {
        return SIDE_BASE;
    }
    return max(max(west, east), max(north, south));
}

/// A number in the order of heights; -0 comes before +0.
fn ordered(v: f32) -> u32 {
    let bits = bitcast<u32>(v);
    return select(bits | 0x80000000u, ~bits, (bits & 0x80000000u) != 0u);
}

fn from_ordered(bits: u32) -> f32 {
    return bitcast<f32>(select(~bits, bits & 0x7fffffffu, (bits & 0x80000000u) != 0u));
}
