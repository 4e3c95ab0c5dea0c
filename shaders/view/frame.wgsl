// Shared by all shaders of the 3D view: the uniform of the picture (crates/app/src/view/uniforms.rs). Positions are
// metres relative to the camera unless stated otherwise: x east, y up (exaggerated), z south.

struct Frame {
    projection: mat4x4f,
    right: vec4f,      // half the width of the picture at distance 1
    up: vec4f,
    forward: vec4f,    // w: near distance
    sun: vec4f,        // direction to it; w: tangent of half the field of view
    eye: vec4f,        // metres; w: height above the highest terrain
    eye_line: vec2i,   // camera in grid lines of the mesh, whole part
    eye_part: vec2f,   // and fraction
    cells: vec2u,
    cell_m: f32,
    exaggeration: f32,
    heights: vec4f,    // lowest above the sea, highest, sea; base of the walls (exaggerated)
    size: vec2f,       // pixels
    seconds: f32,
    exposure: f32,
    overlay: vec4f,    // contour interval and opacity, mask opacity, haze
    air: vec4f,        // haze: metres to its beginning, density per metre, height of its layer; 1 / extent
    sky: vec4f,        // altitude of the camera in km; ground texture: amount, metres of its largest forms
    sweep: vec4f,      // shadows: sideways shift per step, metres per step, first line, cells per step
    sweep_lines: vec4i, // steps along 0 x or 1 y; 1 forward; steps; lines
    sweep_fall: vec4f, // fall of the light per metre, for the lower and the upper limb of the sun
    open: vec4f,       // cells per texel of the sky visibility; reach in cells
    background: vec4f, // background colour; w: 1 to draw the sky
    flags: vec4u,      // colouring, show levels, shadows, encode
    lines: vec4u,      // mesh: last grid line along x and y, first line; draw 0 all, 1 around the inset, 2 the inset
    grid: vec4f,       // mesh: cells per line, metres per line, distance of the edge from the outermost lines in lines;
                       // longer side of the terrain in metres
    inset: vec4f,      // rectangle of the inset in metres: west, north, east, south
    inset_cells: vec4f, // its corner in metres; its cells per metre
    over: vec4f,       // offset and size of the drawn map in that of the whole terrain (0 to 1)
    sides: vec4f,      // of the inset, in its cells from its corner; far away for sides on the edge of the terrain
    corner: vec4f,     // of the drawn map in metres from that of the whole terrain; 1 / band of the inset in cells
    clouds: vec4f,     // value of the noise at their edges, above 1 for none; 1 / length of the largest; their height
}

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var smooth_sampler: sampler;
@group(0) @binding(2) var slant_sampler: sampler; // anisotropic

const PI = 3.14159265;

// A triangle that covers the whole picture.
fn whole_picture(index: u32) -> vec4f {
    return vec4f(f32((index << 1u) & 2u) * 2.0 - 1.0, f32(index & 2u) * 2.0 - 1.0, 0.0, 1.0);
}

// The ray from the camera through a pixel; its length along the camera's direction is 1.
fn way_through(pixel: vec2f) -> vec3f {
    let at = pixel / frame.size * 2.0 - 1.0;
    return frame.forward.xyz + frame.right.xyz * at.x - frame.up.xyz * at.y;
}
