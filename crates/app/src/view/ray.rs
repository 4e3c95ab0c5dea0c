//! Casts rays on the terrain: descends a pyramid of heights, then intersects a bilinear patch.
//!
//! A. Tevs, I. Ihrke, H.-P. Seidel, 2008, Maximum mipmaps for fast, accurate, and scalable dynamic height field
//! rendering. Squares that the ray passes above are skipped; in the smallest ones a quadratic equation is solved for
//! each patch.

use glam::{DVec2, DVec3};

use super::{
    bounds::{Bounds, LEAF},
    camera::Ray,
};

/// The hit of a ray on the terrain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Position in metres from the north-west corner, x east and y south.
    pub place: [f64; 2],
    /// Height of the terrain there in metres, not exaggerated.
    pub height: f64,
    /// The cell of the hit.
    pub cell: [u32; 2],
    /// Distance from the ray's origin in metres, in the exaggerated space of the camera.
    pub distance: f64,
}

/// A surface, bilinear between samples.
#[derive(Clone, Copy, Debug)]
pub(super) struct Surface<'a> {
    pub(super) samples: &'a [f32],
    pub(super) cells: [u32; 2],
    pub(super) bounds: &'a Bounds,
}

impl Surface<'_> {
    /// Heights at the corners of a patch: north-west, north-east, south-west, south-east.
    fn corners(&self, i: u32, j: u32) -> [f64; 4] {
        let [nx, ny] = self.cells;
        let (x0, x1) = (i.saturating_sub(1), i.min(nx - 1));
        let (y0, y1) = (j.saturating_sub(1), j.min(ny - 1));
        [(x0, y0), (x1, y0), (x0, y1), (x1, y1)]
            .map(|(x, y)| f64::from(self.samples[y as usize * nx as usize + x as usize]))
    }

    /// The height at grid coordinates.
    pub(super) fn height(&self, at: DVec2) -> f64 {
        let [nx, ny] = self.cells.map(f64::from);
        let at = at.clamp(DVec2::splat(0.5), DVec2::new(nx + 0.5, ny + 0.5));
        let (i, j) = (at.x.floor(), at.y.floor());
        let [a, b, c, d] = self.corners(i as u32, j as u32);
        let (u, v) = (at.x - i, at.y - j);
        a + (b - a) * u + (c - a) * v + (a - b - c + d) * u * v
    }

    /// The distance along a ray to its first hit on the surface from above. The ray is in grid coordinates: x and z
    /// count patches, y is a height. Returns None for a ray that enters through a side, below the surface.
    pub(super) fn meet(&self, ray: &Ray) -> Option<f64> {
        let [nx, ny] = self.cells.map(|n| f64::from(n) + 0.5);
        let (from, to) = span(ray, [0.5, 0.5], [nx, ny], [0.0, f64::INFINITY])?;
        let start = ray.origin + ray.direction * from;
        if start.y < self.height(DVec2::new(start.x, start.z)) {
            return None;
        }
        self.descend(ray, self.bounds.top(), 0, 0, from, to)
    }

    fn descend(&self, ray: &Ray, level: u32, i: u32, j: u32, from: f64, to: f64) -> Option<f64> {
        let [_, high] = self.bounds.range(level, i, j)?;
        let lowest = (ray.origin.y + ray.direction.y * from).min(ray.origin.y + ray.direction.y * to);
        if lowest > f64::from(high) {
            return None;
        }
        let mut parts = [(0.0, 0.0, 0, 0); 1 << (2 * LEAF)];
        let mut count = 0;
        let (side, step) = if level == 0 { (1 << LEAF, 1.0) } else { (2, f64::from(1_u32 << (LEAF + level - 1))) };
        for (a, b) in (0..side).flat_map(|b| (0..side).map(move |a| (a, b))) {
            let (ci, cj) = (i * side + a, j * side + b);
            let low = [f64::from(ci) * step, f64::from(cj) * step];
            if let Some((t0, t1)) = span(ray, low, low.map(|v| v + step), [from, to]) {
                parts[count] = (t0, t1, ci, cj);
                count += 1;
            }
        }
        let parts = &mut parts[..count];
        parts.sort_by(|a, b| a.0.total_cmp(&b.0));
        parts.iter().find_map(|&(t0, t1, ci, cj)| match level {
            0 => self.patch(ray, ci, cj, t0, t1),
            _ => self.descend(ray, level - 1, ci, cj, t0, t1),
        })
    }

    /// The first distance in `from..=to` at which the ray meets a patch.
    fn patch(&self, ray: &Ray, i: u32, j: u32, from: f64, to: f64) -> Option<f64> {
        if i > self.cells[0] || j > self.cells[1] {
            return None;
        }
        let [a, b, c, d] = self.corners(i, j);
        let (p, q, r) = (b - a, c - a, a - b - c + d);
        // height of the ray above the patch: f(s) = f0 + f1 s + f2 s², with s counted from the entry
        let at = ray.origin + ray.direction * from;
        let (u, v) = (at.x - f64::from(i), at.z - f64::from(j));
        let (du, dv) = (ray.direction.x, ray.direction.z);
        let f0 = at.y - (a + p * u + q * v + r * u * v);
        let f1 = ray.direction.y - (p * du + q * dv + r * (u * dv + v * du));
        let f2 = -r * du * dv;
        // tolerance: rounding may put a ray slightly above the edge on which it enters
        let slack = 1e-9 * (1.0 + at.y.abs());
        if f0.abs() <= slack && f1 <= 0.0 {
            return Some(from);
        }
        roots(f0, f1, f2).into_iter().find(|s| *s >= 0.0 && *s <= to - from + slack).map(|s| from + s)
    }
}

/// The real roots of `f0 + f1 s + f2 s²`, the smaller first; NaN if there are none.
fn roots(f0: f64, f1: f64, f2: f64) -> [f64; 2] {
    let under = f1 * f1 - 4.0 * f2 * f0;
    if under < 0.0 {
        return [f64::NAN; 2];
    }
    // the form without cancellation
    let q = -0.5 * (f1 + under.sqrt().copysign(f1));
    let (one, two) = (f0 / q, q / f2);
    if one < two {
        [one, two]
    } else if two.is_finite() {
        [two, one]
    } else {
        [one, f64::NAN]
    }
}

/// The range of `within` in which a ray is above a rectangle. Returns None if it is nowhere.
fn span(ray: &Ray, low: [f64; 2], high: [f64; 2], within: [f64; 2]) -> Option<(f64, f64)> {
    let [mut from, mut to] = within;
    for (o, d, low, high) in
        [(ray.origin.x, ray.direction.x, low[0], high[0]), (ray.origin.z, ray.direction.z, low[1], high[1])]
    {
        if d == 0.0 {
            if o < low || o > high {
                return None;
            }
            continue;
        }
        let (a, b) = ((low - o) / d, (high - o) / d);
        from = from.max(a.min(b));
        to = to.min(a.max(b));
    }
    (from <= to).then_some((from, to))
}

/// Converts a ray from the camera's space to grid coordinates; also returns the metres per unit of distance.
pub(super) fn in_grid(ray: &Ray, cell_m: f64, exaggeration: f64) -> (Ray, f64) {
    let half = DVec3::new(0.5, 0.0, 0.5);
    let scale = DVec3::new(1.0 / cell_m, 1.0 / exaggeration, 1.0 / cell_m);
    // a unit of distance is one cell, so that numbers have similar magnitudes in worlds of any size
    (Ray { origin: ray.origin * scale + half, direction: ray.direction * scale * cell_m }, cell_m)
}

#[cfg(test)]
mod tests {
    use orograph_nodes::numerics::math;

    use super::*;

    struct Terrain {
        samples: Vec<f32>,
        cells: [u32; 2],
        bounds: Bounds,
    }

    impl Terrain {
        fn new(cells: [u32; 2], height: impl Fn(usize, usize) -> f32 + Sync) -> Self {
            let [nx, ny] = cells.map(|n| n as usize);
            let samples = (0..nx * ny).map(|at| height(at % nx, at / nx)).collect();
            Self { samples, cells, bounds: Bounds::new([nx, ny], height) }
        }

        fn surface(&self) -> Surface<'_> {
            Surface { samples: &self.samples, cells: self.cells, bounds: &self.bounds }
        }

        /// Small steps along the ray, then halving.
        fn march(&self, ray: &Ray) -> Option<f64> {
            let surface = self.surface();
            let [nx, ny] = self.cells.map(|n| f64::from(n) + 0.5);
            let (from, to) = span(ray, [0.5, 0.5], [nx, ny], [0.0, f64::INFINITY])?;
            let above = |t: f64| {
                let at = ray.origin + ray.direction * t;
                at.y - surface.height(DVec2::new(at.x, at.z))
            };
            if above(from) < 0.0 {
                return None;
            }
            let steps = 40_000;
            let to = to.min(from + 1e4);
            let at = |k: usize| from + (to - from) * k as f64 / steps as f64;
            let first = (1..=steps).find(|k| above(at(*k)) < 0.0)?;
            let (mut a, mut b) = (at(first - 1), at(first));
            for _ in 0..60 {
                let m = 0.5 * (a + b);
                if above(m) < 0.0 { b = m } else { a = m }
            }
            Some(a)
        }
    }

    #[test]
    fn rays_meet_what_small_steps_find() {
        let rough = |x: usize, y: usize| {
            let hash = (x as u32).wrapping_mul(0x9e37_79b9) ^ (y as u32).wrapping_mul(0x85eb_ca6b);
            let hash = (hash ^ (hash >> 15)).wrapping_mul(0x2c1b_3c6d);
            (hash >> 24) as f32 / 64.0 + 6.0 * math::f32::sin((x * x + y * y) as f32 * 0.004)
        };
        let mut hits = 0;
        for cells in [[70, 45], [8, 8], [1, 1], [3, 90]] {
            let terrain = Terrain::new(cells, rough);
            let [w, h] = cells.map(f64::from);
            for k in 0..60 {
                let turn = f64::from(k) * 0.7 + 0.05;
                let origin = DVec3::new(
                    w * 0.5 + (w + 20.0) * math::cos(turn),
                    14.0 + 0.6 * f64::from(k % 11),
                    h * 0.5 + (h + 20.0) * math::sin(turn),
                );
                let target = DVec3::new(w * 0.1 * f64::from(k % 9 + 1), 2.0, h * 0.1 * f64::from(k % 7 + 2));
                let ray = Ray { origin, direction: (target - origin).normalize() };
                let (found, marched) = (terrain.surface().meet(&ray), terrain.march(&ray));
                match (found, marched) {
                    // steps of a fortieth of a patch miss thinner peaks
                    (Some(found), Some(marched)) => assert!(found <= marched + 1e-6, "{found} {marched}"),
                    (found, marched) => assert_eq!(found.is_some(), marched.is_some(), "{ray:?} {found:?} {marched:?}"),
                }
                if let Some(t) = found {
                    hits += 1;
                    let at = ray.origin + ray.direction * t;
                    let height = terrain.surface().height(DVec2::new(at.x, at.z));
                    assert!((at.y - height).abs() < 1e-7, "{} {height}", at.y);
                    assert!((marched.expect("both") - t).abs() < 0.3);
                }
            }
        }
        assert!(hits > 60, "{hits}");
    }

    #[test]
    fn plain_cases_are_exact() {
        let flat = Terrain::new([40, 30], |_, _| 5.0);
        let down = Ray { origin: DVec3::new(8.0, 100.0, 8.0), direction: DVec3::NEG_Y };
        assert_eq!(flat.surface().meet(&down), Some(95.0));
        let beside = Ray { origin: DVec3::new(0.2, 100.0, 8.0), direction: DVec3::NEG_Y };
        assert_eq!(flat.surface().meet(&beside), None);
        let up = Ray { origin: DVec3::new(8.0, 100.0, 8.0), direction: DVec3::Y };
        assert_eq!(flat.surface().meet(&up), None);
        let through_a_side = Ray { origin: DVec3::new(-10.0, 2.0, 8.0), direction: DVec3::X };
        assert_eq!(flat.surface().meet(&through_a_side), None);
        let along_an_edge =
            Ray { origin: DVec3::new(-10.0, 25.0, 8.0), direction: DVec3::new(1.0, -1.0, 0.0).normalize() };
        let way = flat.surface().meet(&along_an_edge).expect("meets");
        assert!((way - 20.0 * 2.0_f64.sqrt()).abs() < 1e-9);
        let slope = Terrain::new([64, 64], |x, _| x as f32);
        // sample x is at grid line x + 1
        let ray = Ray { origin: DVec3::new(60.0, 40.0, 20.0), direction: DVec3::NEG_X };
        let way = slope.surface().meet(&ray);
        assert_eq!(way, None, "it starts below the land, as seen from there");
        let ray = Ray { origin: DVec3::new(10.0, 40.0, 20.3), direction: DVec3::X };
        assert!((slope.surface().meet(&ray).expect("meets") - 31.0).abs() < 1e-9);
    }
}
