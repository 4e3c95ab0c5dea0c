// Functions of crates/nodes/src/numerics/math.rs (`lane`), step by step the same: those of WGSL differ from driver to
// driver.

/// 0 at 0 and below, 1 at 1 and above, and the cubic 3 t² - 2 t³ in between.
fn smooth_step(v: f32) -> f32 {
    let t = select(0.0, v, v > 0.0);
    let u = select(1.0, t, t < 1.0);
    return u * u * (3.0 - 2.0 * u);
}

/// The sign of `sign` on the magnitude of `v`.
fn copy_sign(v: f32, sign: f32) -> f32 {
    return bitcast<f32>((bitcast<u32>(v) & 0x7fffffffu) | (bitcast<u32>(sign) & 0x80000000u));
}

/// Weights of four consecutive values at a position from 0 to 1 between the second and the third.
fn catmull_rom(t: f32) -> vec4<f32> {
    let r = 1.0 - t;
    return vec4<f32>(
        -0.5 * t * (r * r), 1.0 + t * t * (1.5 * t - 2.5), 1.0 + r * r * (1.5 * r - 2.5), -0.5 * r * (t * t),
    );
}

/// Arc tangent in radians.
fn arc_tangent(x: f32) -> f32 {
    let t = abs(x);
    let steep = t > 2.4142137;
    let middle = t > 0.41421357;
    let above = select(t - 1.0, -1.0, steep);
    let below = select(t + 1.0, t, steep);
    let offset = select(0.78539816339, 1.57079632679, steep);
    var r = t;
    if (middle) {
        r = above / below;
    }
    let z = r * r;
    let q = ((0.08053722 * z - 0.13877677) * z + 0.1997771) * z - 0.3333295;
    let angle = r + r * z * q;
    return copy_sign(select(angle, offset + angle, middle), x);
}

/// 1 / √x for x above 0, and 1e18 below 1e-36. Drivers may multiply in any order; without that limit the square of `t`
/// would be infinite.
fn inverse_root(v: f32) -> f32 {
    let x = max(v, 1e-36);
    let half = 0.5 * x;
    var t = bitcast<f32>(0x5f376908u - (bitcast<u32>(x) >> 1u));
    t = t * (1.5008789 - half * t * t);
    return t * (1.5000006 - half * t * t);
}

/// Logarithm to base 2; that of 0 is -126.
fn log_2(x: f32) -> f32 {
    let bits = bitcast<i32>(max(x, 1.17549435e-38));
    let k = (bits - 0x3f3504f3) >> 23u;
    let m = bitcast<f32>(bits - (k << 23u));
    let z = (m - 1.0) / (m + 1.0);
    let z2 = z * z;
    let series = 1.0 + z2 * (0.33333334 + z2 * (0.2 + z2 * (0.14285715 + z2 * 0.11111111)));
    return f32(k) + z * series * 2.8853901;
}

/// 2 to the power of x; 0 below -100, and 2¹²⁷ above 127.
fn exp_2(v: f32) -> f32 {
    let x = clamp(v, -126.0, 127.0);
    let whole = round(x);
    let r = (x - whole) * 0.6931472;
    let tail = 0.041666668 + r * (0.008333334 + r * (0.0013888889 + r * 0.0001984127));
    let e = 1.0 + r * (1.0 + r * (0.5 + r * (0.16666667 + r * tail)));
    let result = e * bitcast<f32>((i32(whole) + 127) << 23u);
    return select(0.0, result, x > -100.0);
}

/// x to the power of y for x of 0 or more; any power of 0 is 0.
fn power(x: f32, y: f32) -> f32 {
    return select(0.0, exp_2(y * log_2(x)), x > 0.0);
}

/// `new` where the mask is 1, `old` where it is 0, both exactly, and the weighted mean in between.
fn masked(old: f32, new_value: f32, mask: f32) -> f32 {
    return old * (1.0 - mask) + new_value * mask;
}
