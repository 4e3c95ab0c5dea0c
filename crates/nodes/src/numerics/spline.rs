//! Cubic curves through points of the plane.

/// Returns the unit vector from a point to another, or zero if they are equal.
#[must_use]
pub fn tangent(from: [f64; 2], to: [f64; 2]) -> [f64; 2] {
    let [x, y] = [to[0] - from[0], to[1] - from[1]];
    let long = (x * x + y * y).sqrt();
    if long > 0.0 { [x / long, y / long] } else { [0.0; 2] }
}

/// Returns the place and the slope of a cubic at `t`, whose slopes at both ends are blended with the straight line.
#[must_use]
pub fn hermite([a, b]: [[f64; 2]; 2], [at_a, at_b]: [[f64; 2]; 2], t: f64) -> [[f64; 2]; 2] {
    let (t2, t3) = (t * t, t * t * t);
    let place = |axis: usize| {
        (2.0 * t3 - 3.0 * t2 + 1.0) * a[axis]
            + (t3 - 2.0 * t2 + t) * at_a[axis]
            + (3.0 * t2 - 2.0 * t3) * b[axis]
            + (t3 - t2) * at_b[axis]
    };
    let slope = |axis: usize| {
        6.0 * (t - t2) * (b[axis] - a[axis])
            + (3.0 * t2 - 4.0 * t + 1.0) * at_a[axis]
            + (3.0 * t2 - 2.0 * t) * at_b[axis]
            // where straight stretches begin, the cubic stands still
            + 1e-6 * (b[axis] - a[axis])
    };
    [[place(0), place(1)], [slope(0), slope(1)]]
}
