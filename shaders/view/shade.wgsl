// Shadows of the terrain on itself. Sunlight comes in parallel lines. Each line is swept once, starting at the side of
// the sun; the highest ray so far, which falls with the elevation of the sun, is the height below which the sun is
// hidden. This is done for the upper and the lower limb of the sun, so that shadows soften with distance. The lines are
// skewed against the cells: consecutive steps are one row apart and shift sideways by a fraction of a cell.

@group(2) @binding(0) var shade_out: texture_storage_2d<rg32float, write>;

const NONE = -1e30;

fn top_at(cell: vec2i) -> f32 {
    return max(ground_at(cell) + water_at(cell), frame.heights.z) * frame.exaggeration;
}

@compute @workgroup_size(64)
fn sweep(@builtin(global_invocation_id) id: vec3u) {
    let line = i32(id.x);
    if line >= frame.sweep_lines.w {
        return;
    }
    let x_first = frame.sweep_lines.x == 0;
    let steps = frame.sweep_lines.z;
    let minor_cells = f32(select(frame.cells.x, frame.cells.y, x_first));
    let fall = frame.sweep_fall.xy * frame.sweep.y;
    var high = vec2f(NONE);
    for (var step = 0; step < steps; step++) {
        high -= fall;
        textureStore(shade_out, vec2i(line, step), vec4f(high, 0.0, 0.0));
        let major = i32(f32(select(steps - 1 - step, step, frame.sweep_lines.y == 1)) * frame.sweep.w);
        let minor = (f32(line) - frame.sweep.z + frame.sweep.x * f32(step)) * frame.sweep.w;
        if minor >= -0.5 && minor <= minor_cells - 0.5 {
            let m = i32(floor(minor));
            let a = top_at(select(vec2i(m, major), vec2i(major, m), x_first));
            let b = top_at(select(vec2i(m + 1, major), vec2i(major, m + 1), x_first));
            high = max(high, vec2f(mix(a, b, minor - floor(minor))));
        }
    }
}

@group(3) @binding(0) var<uniform> around: Frame; // of the terrain around the inset
@group(3) @binding(1) var around_shade: texture_2d<f32>;

// The sweep over an inset. Lines start with the shadows of the terrain around it, which also remain on the edge.
@compute @workgroup_size(64)
fn sweep_inset(@builtin(global_invocation_id) id: vec3u) {
    let line = i32(id.x);
    if line >= frame.sweep_lines.w {
        return;
    }
    let x_first = frame.sweep_lines.x == 0;
    let steps = frame.sweep_lines.z;
    let minor_cells = f32(select(frame.cells.x, frame.cells.y, x_first));
    let fall = frame.sweep_fall.xy * frame.sweep.y;
    var high = vec2f(NONE);
    var was_inside = false;
    for (var step = 0; step < steps; step++) {
        let major = i32(f32(select(steps - 1 - step, step, frame.sweep_lines.y == 1)) * frame.sweep.w);
        let minor = (f32(line) - frame.sweep.z + frame.sweep.x * f32(step)) * frame.sweep.w;
        let cell = select(vec2f(minor, f32(major)), vec2f(f32(major), minor), x_first);
        let outer = swept(around_shade, around.sweep, around.sweep_lines, in_cells_around(cell, vec2f(around.cells)));
        high = select(outer, high - fall, was_inside);
        was_inside = minor >= -0.5 && minor <= minor_cells - 0.5;
        let share = select(0.0, inset_share(cell + 0.5), was_inside);
        var shade = mix(outer, high, share);
        // at least as soft as either of them is drawn (lighting.wgsl)
        shade.x = max(shade.x, shade.y + 0.12 * mix(around.cell_m, frame.cell_m, share));
        textureStore(shade_out, vec2i(line, step), vec4f(shade, 0.0, 0.0));
        if was_inside {
            let m = i32(floor(minor));
            let a = top_at(select(vec2i(m, major), vec2i(major, m), x_first));
            let b = top_at(select(vec2i(m + 1, major), vec2i(major, m + 1), x_first));
            high = max(high, vec2f(mix(a, b, minor - floor(minor))));
        }
    }
}
