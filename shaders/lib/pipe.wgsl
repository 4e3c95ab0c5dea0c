// The sides of the world and the rim of crates/nodes/src/erosion/hydraulic_pipe/device.rs. Cells outside of the terrain,
// which are NaN on the CPU, are `HOLE` here: drivers may assume that there is no NaN. It needs the math and
// the sides of shaders/lib.

const HOLE: f32 = 1e30;

fn is_hole(v: f32) -> bool { return !(abs(v) < p.k_highest); }

fn least(a: f32, b: f32) -> f32 { return select(b, a, a < b); }

fn most(a: f32, b: f32) -> f32 { return select(b, a, a > b); }

fn positive(v: f32) -> f32 { return select(0.0, v, v > 0.0); }

/// 1 / x for normal x above 0, within 1e-6.
fn inverse(x: f32) -> f32 {
    var t = bitcast<f32>(0x7ef30000u - bitcast<u32>(x));
    t = t * (2.00125 - x * t);
    return t * (2.000001 - x * t);
}

/// A discharge, limited to the fraction that its cell of origin can supply.
fn limited(discharge: f32, before: f32, after: f32) -> f32 {
    return discharge * select(after, before, discharge > 0.0);
}

/// 0 for water thinner than the film, 1 from three times its depth on.
fn film_of(depth: f32) -> f32 { return smooth_step((depth * p.k_per_film - 1.0) * 0.5); }

/// The bed at a height: `HOLE` outside of the terrain.
fn bed_from(height: f32) -> f32 { return select(height, HOLE, is_hole(height)); }

/// The column that stands for one beyond the sides: from the other end in a periodic world, otherwise the nearest.
fn column_of(x: i32) -> u32 {
    if (p.side_west == SIDE_PERIODIC) {
        return (u32(x + i32(p.nx))) % p.nx;
    }
    return u32(clamp(x, 0, i32(p.nx) - 1));
}

/// The row, as the column.
fn row_of(y: i32) -> u32 {
    if (p.side_north == SIDE_PERIODIC) {
        return (u32(y + i32(p.ny))) % p.ny;
    }
    return u32(clamp(y, 0, i32(p.ny) - 1));
}

/// Whether the bed of a cell is fixed, as it lies on a side at base level.
fn is_held(x: u32, y: u32) -> bool {
    return (x == 0u && p.side_west == SIDE_BASE) || (x + 1u == p.nx && p.side_east == SIDE_BASE)
        || (y == 0u && p.side_north == SIDE_BASE) || (y + 1u == p.ny && p.side_south == SIDE_BASE);
}

// The rim has numbers of the cells at the sides, west, east, north and south, one list after the other: by how much the
// land beyond them is lower; the discharge through the faces on the east and the south side of the world, after a step
// and before friction; and the water and the solids that have left.

fn rim_west(y: u32) -> u32 { return y; }
fn rim_east(y: u32) -> u32 { return p.ny + y; }
fn rim_north(x: u32) -> u32 { return 2u * p.ny + x; }
fn rim_south(x: u32) -> u32 { return 2u * p.ny + p.nx + x; }
fn face_east(y: u32) -> u32 { return 2u * (p.nx + p.ny) + y; }
fn face_south(x: u32) -> u32 { return 2u * (p.nx + p.ny) + p.ny + x; }
fn driven_east(y: u32) -> u32 { return 3u * (p.nx + p.ny) + y; }
fn driven_south(x: u32) -> u32 { return 3u * (p.nx + p.ny) + p.ny + x; }
fn water_left(side: u32) -> u32 { return 4u * (p.nx + p.ny) + side; }
fn solid_left(side: u32) -> u32 { return 6u * (p.nx + p.ny) + side; }
