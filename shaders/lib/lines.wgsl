// Lines of cells beyond their ends; see `Ends` of crates/nodes/src/numerics/lines.rs.

/// The cell of a line of `count` cells at a place, which a line that wraps repeats; -1 beyond the ends of others.
fn cell_in_line(v: i32, count: u32, wraps: bool) -> i32 {
    let n = i32(count);
    if (v >= 0 && v < n) {
        return v;
    }
    return select(-1, ((v % n) + n) % n, wraps);
}

/// The cell of a line of `count` cells that stands for one beyond its ends: from the other end, or its mirror image.
fn line_index(v: i32, count: u32, wraps: bool) -> u32 {
    let n = i32(count);
    if (v >= 0 && v < n) {
        return u32(v);
    }
    let period = select(2 * n, n, wraps);
    let place = ((v % period) + period) % period;
    return u32(select(2 * n - 1 - place, place, place < n));
}
