// A Gaussian filter along one axis, from the raster `before` to the raster `after`; see
// crates/nodes/src/numerics/smooth.rs. It needs shaders/lib/lines.
//
// A workgroup filters a tile of LINES lines and LENGTH cells along them, of which each invocation has eight adjacent
// cells of a line. Cells on both sides are read into the workgroup's memory for TAPS weights at a time. From there each
// invocation takes four to the left and four to the right for four weights, and keeps the eight before them.

const LINES = 8u;
const LENGTH = 64u;
const TAPS = 64u;

/// Places of a line in the workgroup's memory: one is left out after eight cells, so that eight invocations beside each
/// other read eight banks, and lines begin at other ones.
const SPREAD = 152u;

/// Cells to the left of the tile and then those to the right, LENGTH + TAPS on each line; results at the end.
var<workgroup> tile: array<f32, 2432>;

fn place_of(line: u32, c: u32) -> u32 { return line * SPREAD + c + c / 8u; }

/// A cell on a line, or that which stands for one beyond its ends. A tile may have more lines than the raster.
fn cell_on(line: u32, place: i32, columns: bool) -> f32 {
    if (columns) {
        return before[at(min(line, p.nx - 1u), line_index(place, p.ny, p.k_wraps != 0u))];
    }
    return before[at(line_index(place, p.nx, p.k_wraps != 0u), min(line, p.ny - 1u))];
}

/// The line and the place on it of a number of a pass over `count` cells of each line of a tile: numbers beside each
/// other have cells beside each other in a row of the raster.
fn spot_of(number: u32, count: u32, columns: bool) -> vec2<u32> {
    if (columns) {
        return vec2<u32>(number % LINES, number / LINES);
    }
    return vec2<u32>(number / count, number % count);
}

/// Reads the cells of all lines of the tile from two places on.
fn gather(own: u32, line: u32, left: i32, right: i32, columns: bool) {
    for (var k = 0u; k < LINES * (LENGTH + TAPS); k += 64u) {
        let spot = spot_of(k + own, LENGTH + TAPS, columns);
        let place = place_of(spot.x, spot.y);
        tile[place] = cell_on(line + spot.x, left + i32(spot.y), columns);
        tile[LINES * SPREAD + place] = cell_on(line + spot.x, right + i32(spot.y), columns);
    }
}

fn four(place: u32) -> vec4<f32> {
    return vec4<f32>(tile[place], tile[place + 1u], tile[place + 2u], tile[place + 3u]);
}

fn put(place: u32, cells: vec4<f32>) {
    tile[place] = cells.x;
    tile[place + 1u] = cells.y;
    tile[place + 2u] = cells.z;
    tile[place + 3u] = cells.w;
}

/// Level ground stays as it is: differences from the first of the eight cells are summed.
fn smooth_tile(group: vec3<u32>, own: u32, columns: bool) {
    let corner = vec2<u32>(group.x, group.y + p.row) * select(vec2<u32>(LENGTH, LINES), vec2<u32>(LINES, LENGTH), columns);
    let line = select(corner.y, corner.x, columns);
    let start = i32(select(corner.x, corner.y, columns));
    let last = i32(select(p.nx, p.ny, columns)) - 1;
    let own_line = own / 8u;
    let own_place = place_of(own_line, 8u * (own % 8u));
    let level = cell_on(line + own_line, min(start + i32(8u * (own % 8u)), last), columns);
    // the cells from a distance to the left on, and from the same distance to the right on
    var left_0 = vec4<f32>();
    var left_1 = vec4<f32>();
    var sum_0 = vec4<f32>();
    var sum_1 = vec4<f32>();
    for (var reach = p.k_reach; reach > 0; reach -= i32(TAPS)) {
        workgroupBarrier();
        gather(own, line, start - reach, start + reach - i32(TAPS), columns);
        workgroupBarrier();
        let from_right = own_place + LINES * SPREAD + TAPS + TAPS / 8u;
        left_0 = four(own_place) - level;
        left_1 = four(own_place + 4u) - level;
        var right_0 = four(from_right) - level;
        var right_1 = four(from_right + 4u) - level;
        let turns = u32(min(reach, i32(TAPS))) / 4u;
        for (var turn = 0u; turn < turns; turn++) {
            let ahead = 4u * turn + turn / 2u;
            let weight = weights[u32(reach) / 4u - turn];
            let left_2 = four(own_place + 9u + ahead) - level;
            let right = four(from_right - 5u - ahead) - level;
            sum_0 += weight.w * (left_0 + right_0);
            sum_1 += weight.w * (left_1 + right_1);
            sum_0 += weight.z * (vec4<f32>(left_0.yzw, left_1.x) + vec4<f32>(right.w, right_0.xyz));
            sum_1 += weight.z * (vec4<f32>(left_1.yzw, left_2.x) + vec4<f32>(right_0.w, right_1.xyz));
            sum_0 += weight.y * (vec4<f32>(left_0.zw, left_1.xy) + vec4<f32>(right.zw, right_0.xy));
            sum_1 += weight.y * (vec4<f32>(left_1.zw, left_2.xy) + vec4<f32>(right_0.zw, right_1.xy));
            sum_0 += weight.x * (vec4<f32>(left_0.w, left_1.xyz) + vec4<f32>(right.yzw, right_0.x));
            sum_1 += weight.x * (vec4<f32>(left_1.w, left_2.xyz) + vec4<f32>(right_0.yzw, right_1.x));
            left_0 = left_1;
            left_1 = left_2;
            right_1 = right_0;
            right_0 = right;
        }
    }
    // the cells themselves are at a distance of 0 now
    sum_0 += weights[0].x * left_0;
    sum_1 += weights[0].x * left_1;
    workgroupBarrier();
    put(own_place, level + sum_0);
    put(own_place + 4u, level + sum_1);
    workgroupBarrier();
    for (var k = 0u; k < LINES * LENGTH; k += 64u) {
        let spot = spot_of(k + own, LENGTH, columns);
        let cell = corner + select(spot.yx, spot, columns);
        if (!is_outside(cell)) {
            after[at(cell.x, cell.y)] = tile[place_of(spot.x, spot.y)];
        }
    }
}

@compute @workgroup_size(64)
fn smooth_x(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) own: u32) {
    smooth_tile(group, own, false);
}

@compute @workgroup_size(64)
fn smooth_y(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) own: u32) {
    smooth_tile(group, own, true);
}
