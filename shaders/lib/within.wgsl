/// 1 within a range, falling to 0 over `falloff` outside of it.
fn within(value: f32, low: f32, high: f32, falloff: f32) -> f32 {
    var sharpness = 3.4028235e38;
    if (falloff > 0.0) {
        sharpness = 1.0 / falloff;
    }
    let outside = max(max(low - value, value - high), 0.0);
    return smooth_step(1.0 - min(outside * sharpness, 1.0));
}
