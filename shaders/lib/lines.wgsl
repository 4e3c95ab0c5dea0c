// Lines of cells beyond their ends; see `Ends` of crates/nodes/src/numerics/lines.rs. Divisions are behind branches: they
// would take most of the time of kernels that look at many cells.

/// The cell of a line of `count` cells at a place, which a line that wraps repeats; -1 beyond the ends of others.
fn cell_in_line(v: i32, count: u32, wraps: bool) -> i32 {
    if (u32(v) < count) {
        return v;
    }
    if (!wraps) {
        return -1;
    }
    let n = i32(count);
    return ((v % n) + n) % n;
}

/// The cell of a line of `count` cells that stands for one beyond its ends: from the other end, or its mirror image.
fn line_index(v: i32, count: u32, wraps: bool) -> u32 {
    if (u32(v) < count) {
        return u32(v);
    }
    let n = i32(count);
    let period = select(2 * n, n, wraps);
    var place = v;
    if (place < -period || place >= period) {
        place = place % period;
    }
    if (place < 0) {
        place += period;
    }
    return u32(select(2 * n - 1 - place, place, place < n));
}
