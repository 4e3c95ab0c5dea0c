// What every shader of the view knows: the picture's uniform (crates/app/src/view/uniforms.rs) and the land's textures.
// Places are metres relative to the eye unless said otherwise: x east, y up (exaggerated), z south.

struct Frame {
    projection: mat4x4f,
    right: vec4f,      // half the picture at distance 1
    up: vec4f,
    forward: vec4f,    // w: near distance
    sun: vec4f,        // towards it; w: tangent of half the angle of view
    eye: vec4f,        // metres; w: height above the highest land
    eye_line: vec2i,   // the eye in grid lines of the mesh, whole part
    eye_part: vec2f,   // and the rest
    cells: vec2u,
    cell_m: f32,
    exaggeration: f32,
    heights: vec4f,    // lowest above the sea, highest, sea; base of the walls (exaggerated)
    size: vec2f,       // pixels
    seconds: f32,
    exposure: f32,
    overlay: vec4f,    // contour interval and opacity, mask opacity, haze
    air: vec4f,        // haze: metres to where it begins, density a metre, height of its layer; 1 / extent
    sky: vec4f,        // altitude of the eye in km
    sweep: vec4f,      // shadows: sideways shift a step, metres a step, first line, cells a step
    sweep_lines: vec4i, // 0 steps along x, 1 along y; 1 forwards; steps; lines
    sweep_fall: vec4f, // fall of the lines of sight a metre, for the lower and the upper limb of the sun
    open: vec4f,       // cells of a texel of the map of open sky; reach in cells
    background: vec4f, // light behind the land; w: 1 where it is the sky's
    flags: vec4u,      // colouring, show levels, shadows, encode
    lines: vec4u,      // mesh: last grid line along x and y, first one; what is drawn: 0 all, 1 around the inset, 2 the inset
    grid: vec4f,       // mesh: cells a line, metres a line, the edge's distance from the outermost lines in lines;
                       // longer side of the land in metres
    inset: vec4f,      // the inset's rectangle in metres: west, north, east, south
    inset_cells: vec4f, // its corner in metres; its cells a metre
    over: vec4f,       // from the map (0 to 1) of what is drawn to the whole land's: first and size
    sides: vec4f,      // of the inset, in its cells from its corner; far away where they are on the land's edge
    corner: vec4f,     // of what is drawn in metres from the whole land's; 1 / cells of the inset's band
}

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var smooth_sampler: sampler;
@group(0) @binding(2) var slant_sampler: sampler; // anisotropic

const PI = 3.14159265;

// A triangle over the whole picture.
fn whole_picture(index: u32) -> vec4f {
    return vec4f(f32((index << 1u) & 2u) * 2.0 - 1.0, f32(index & 2u) * 2.0 - 1.0, 0.0, 1.0);
}

// The way from the eye through a pixel, with length 1 along where it looks.
fn way_through(pixel: vec2f) -> vec3f {
    let at = pixel / frame.size * 2.0 - 1.0;
    return frame.forward.xyz + frame.right.xyz * at.x - frame.up.xyz * at.y;
}
