// From linear light to the screen: haze, exposure, tone curve, encoding for the screen, and dither of one code against
// banding. Each sample of a pixel passes the tone curve on its own, so that edges against a bright sky are as smooth as
// others.

@group(3) @binding(0) var light_map: texture_multisampled_2d<f32>;
@group(3) @binding(1) var depth_map: texture_depth_multisampled_2d;
@group(3) @binding(2) var haze_map: texture_2d<f32>;

@vertex
fn finish_vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    return whole_picture(index);
}

// The haze of the four nearest pixels of the half-resolution texture, weighted towards those at the same distance.
fn haze_at(pixel: vec2f, far: f32) -> vec3f {
    let last = vec2i(textureDimensions(haze_map)) - 1;
    let at = (pixel - 0.5) * 0.5;
    let corner = vec2i(floor(at));
    let part = at - floor(at);
    var sum = vec4f(0.0);
    for (var k = 0; k < 4; k++) {
        let offset = vec2i(k & 1, k >> 1u);
        let one = textureLoad(haze_map, clamp(corner + offset, vec2i(0), last), 0);
        let near = select(1.0 - part, part, offset == vec2i(1));
        let apart = (one.a - far) / far * 30.0;
        sum += vec4f(one.rgb, 1.0) * (near.x * near.y * exp(-apart * apart) + 1e-5 * f32(one.a > 0.0));
    }
    return sum.rgb / max(sum.a, 1e-12);
}

// White balance: neutral grey for a grey surface under the sun and sky of an afternoon.
const WHITE = vec3f(0.93, 1.0, 1.12);

const LUMINANCE = vec3f(0.2126, 0.7152, 0.0722);

// A tone curve after T. Sobotka's AgX (2022): colours are moved slightly towards grey, pass a sigmoid of the logarithm
// of light per channel, so that bright colours lose saturation instead of shifting in hue, and are moved out again. The
// sigmoid with two powers is his; the mix with grey and its inverse are our own.
fn tone(light: vec3f) -> vec3f {
    const LOW = -10.0;  // stops below middle grey
    const HIGH = 6.5;   // stops above it
    const GREY = 0.12;
    let given = max(light * WHITE * exp2(frame.exposure), vec3f(0.0));
    let x = mix(given, vec3f(dot(given, LUMINANCE)), GREY);
    let stops = clamp(log2(max(x, vec3f(1e-8)) / 0.18), vec3f(LOW), vec3f(HIGH));
    let middle = -LOW / (HIGH - LOW);
    let at = stops / (HIGH - LOW); // 0 at middle grey
    let below = sigmoid(at, middle, 0.46, 3.0);
    let above = sigmoid(at, 1.0 - middle, 0.54, 3.25);
    let curve = 0.46 + select(above, below, at < vec3f(0.0));
    // linear values of a screen with gamma 2.2
    let back = pow(max(curve, vec3f(0.0)), vec3f(2.2));
    let drawn = mix(vec3f(dot(back, LUMINANCE)), back, 1.0 / (1.0 - GREY));
    return pow(clamp(drawn, vec3f(0.0), vec3f(1.0)), vec3f(1.0 / 2.2));
}

// A sigmoid, steep in the middle, that reaches `end` at a distance of `reach`.
fn sigmoid(x: vec3f, reach: f32, end: f32, power: f32) -> vec3f {
    const SLOPE = 2.55;
    let ratio = SLOPE * reach / end;
    let scale = pow(pow(ratio, power) - 1.0, 1.0 / power); // so that it reaches `end`
    let y = SLOPE * x;
    return y / pow(1.0 + pow(abs(y) * scale / (SLOPE * reach), vec3f(power)), vec3f(1.0 / power));
}

fn to_linear(code: vec3f) -> vec3f {
    return select(pow((code + 0.055) / 1.055, vec3f(2.4)), code / 12.92, code <= vec3f(0.04045));
}

@fragment
fn finish_fragment(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let pixel = vec2i(at.xy);
    let ahead = way_through(at.xy);
    let stretch = length(ahead);
    var sum = vec3f(0.0);
    for (var k = 0; k < 4; k++) {
        var light = textureLoad(light_map, pixel, k).rgb;
        let depth = textureLoad(depth_map, pixel, k);
        if depth > 0.0 && frame.air.y > 0.0 {
            let far = stretch * frame.forward.w / depth;
            light = light * exp(-haze_depth(ahead / stretch, far)) + haze_at(at.xy, far * frame.air.w);
        }
        sum += tone(light);
    }
    let grain = fract(52.9829189 * fract(dot(floor(at.xy), vec2f(0.06711056, 0.00583715)))) - 0.5;
    let code = sum * 0.25 + grain / 255.0;
    return vec4f(select(to_linear(code), code, frame.flags.w == 1u), 1.0);
}
