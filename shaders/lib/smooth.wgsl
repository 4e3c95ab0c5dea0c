// A Gaussian filter along one axis, from the raster `before` to the raster `after`; see
// crates/nodes/src/numerics/smooth.rs. It needs shaders/lib/lines.

fn along_x(x: i32, y: u32) -> f32 { return before[at(line_index(x, p.nx, p.k_wraps != 0u), y)]; }

fn along_y(x: u32, y: i32) -> f32 { return before[at(x, line_index(y, p.ny, p.k_wraps != 0u))]; }

/// Level ground stays as it is: differences from the cell itself are summed.
@compute @workgroup_size(64)
fn smooth_x(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let x = i32(cell.x);
    let i = at(cell.x, cell.y);
    let here = before[i];
    var sum = 0.0;
    if (p.k_period != 0u) {
        for (var k = 1; k < i32(p.k_period); k++) {
            sum += weights[k] * (along_x(x + k, cell.y) - here);
        }
    } else if (x >= p.k_reach && x + p.k_reach < i32(p.nx)) {
        // far from the sides no cell has to be looked up
        for (var k = u32(p.k_reach); k > 0u; k--) {
            sum += weights[k] * ((before[i - k] - here) + (before[i + k] - here));
        }
    } else {
        for (var k = p.k_reach; k > 0; k--) {
            sum += weights[k] * ((along_x(x - k, cell.y) - here) + (along_x(x + k, cell.y) - here));
        }
    }
    after[i] = here + sum;
}

@compute @workgroup_size(64)
fn smooth_y(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = cell_of(id);
    if (is_outside(cell)) {
        return;
    }
    let y = i32(cell.y);
    let i = at(cell.x, cell.y);
    let here = before[i];
    var sum = 0.0;
    if (p.k_period != 0u) {
        for (var k = 1; k < i32(p.k_period); k++) {
            sum += weights[k] * (along_y(cell.x, y + k) - here);
        }
    } else if (y >= p.k_reach && y + p.k_reach < i32(p.ny)) {
        var above = i - u32(p.k_reach) * p.nx;
        var below = i + u32(p.k_reach) * p.nx;
        for (var k = p.k_reach; k > 0; k--) {
            sum += weights[k] * ((before[above] - here) + (before[below] - here));
            above += p.nx;
            below -= p.nx;
        }
    } else {
        for (var k = p.k_reach; k > 0; k--) {
            sum += weights[k] * ((along_y(cell.x, y - k) - here) + (along_y(cell.x, y + k) - here));
        }
    }
    after[i] = here + sum;
}
