// Discharge through faces, from the rasters `west` and `north` and the `rim`; it needs shaders/lib/pipe.

/// The discharge through a west face, or the east side of the world.
fn west_at(x: u32, y: u32) -> f32 {
    if (x < p.nx) {
        return west[at(x, y)];
    }
    return rim[face_east(y)];
}

/// The discharge through a north face, or the south side of the world.
fn north_at(x: u32, y: u32) -> f32 {
    if (y < p.ny) {
        return north[at(x, y)];
    }
    return rim[face_south(x)];
}
