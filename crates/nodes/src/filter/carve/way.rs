//! The bed's elevation along a line.

use orograph_graph::{Field, Line};

use super::{Course, Params, course::course};
use crate::numerics::{
    along::{averaged, distance, evenly, graded},
    lines::Ends,
    math,
    noise::place::{self, along},
};

/// A point on the centre line of the bed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    pub at_m: [f64; 2],
    pub elevation_m: f64,
    /// Half width of the bed.
    pub half_m: f64,
    /// Height of the bed's edges above its centre line, unless the profile is flat.
    pub depth_m: f64,
    /// Widths of the banks to the right and to the left, as a factor.
    pub banks: [f64; 2],
}

/// A polyline of such points.
#[derive(Clone, Debug)]
pub struct Way {
    pub places: Vec<Place>,
}

/// A point along a path.
#[derive(Clone, Copy)]
struct Step {
    at_m: [f64; 2],
    /// The segment of the path, and the place on it from 0 to 1.
    piece: usize,
    t: f64,
    /// Fraction of the whole path, the length up to the point, and that of the path.
    share: f64,
    way_m: f64,
    whole_m: f64,
}

/// Maximum number of points of a path.
const MOST: f64 = 200_000.0;
/// Maximum number of points of a path over the width of the bed and its banks.
const FINE: f64 = 64.0;
/// The same for a path that winds: its finest bends are longer.
const WINDING: f64 = 24.0;

impl Way {
    /// Creates the way of a line with elevations.
    pub fn of_line(line: &Line, params: &Params) -> Self {
        let places = line.vertices.iter().map(|vertex| {
            let depth_m = vertex.depth_m.max(params.depth);
            Place {
                at_m: vertex.position_m,
                elevation_m: vertex.elevation_m - depth_m,
                half_m: 0.5 * vertex.width_m.max(params.width),
                depth_m: depth_m.max(0.0),
                banks: [1.0; 2],
            }
        });
        Self { places: places.collect() }.on_course(params)
    }

    /// Creates the way of a line without elevations on the terrain, with points a cell apart or, for wide beds, a
    /// [`FINE`]th of the width that the bed changes.
    pub fn of_draped(line: &Line, params: &Params, land: &Field) -> Self {
        let path: Vec<[f64; 2]> = line.vertices.iter().map(|vertex| vertex.position_m).collect();
        Self::on_land(params, land, &path, FINE, |step| Place {
            at_m: step.at_m,
            elevation_m: elevation(land, step.at_m),
            half_m: {
                let [from, to] = [line.vertices[step.piece].width_m, line.vertices[step.piece + 1].width_m];
                0.5 * (from + (to - from) * step.t).max(params.width)
            },
            depth_m: params.depth.max(0.0),
            banks: [1.0; 2],
        })
    }

    /// Creates the way of the path on the terrain. Points are a cell apart or, for wide beds, a [`FINE`]th or a
    /// [`WINDING`]th of the width that the bed changes.
    pub fn of_path(params: &Params, land: &Field, seed: u32) -> Self {
        let path = course(params, seed);
        let fine = if path == params.path.0 { FINE } else { WINDING };
        Self::on_land(params, land, &path, fine, |Step { at_m, share, way_m, whole_m, .. }| {
            let [wide, deep] = params.grown(share);
            Place {
                at_m,
                elevation_m: elevation(land, at_m) + (1.0 - deep) * params.depth,
                half_m: 0.5 * params.width * wide,
                depth_m: params.depth.max(0.0) * deep,
                banks: params.banks([way_m, whole_m], wide, seed),
            }
        })
    }

    /// Creates the way along a path, with points that are at most a `fine`th of the width of the bed and its banks
    /// apart. `place` gives a point with the elevation of the terrain; the way's are eased and lie `depth` below.
    fn on_land(
        params: &Params,
        land: &Field,
        path: &[[f64; 2]],
        fine: f64,
        mut place: impl FnMut(Step) -> Place,
    ) -> Self {
        let lengths: Vec<f64> = path.windows(2).map(|pair| distance(pair[0], pair[1])).collect();
        let whole: f64 = lengths.iter().sum();
        let wide_m = params.width + 2.0 * params.bank;
        let step = land.window().cell_m().max(whole / MOST).max(wide_m / fine);
        let count = (whole / step).ceil().max(1.0) as usize;
        let steps = evenly(&lengths, count).enumerate().map(|(k, on)| {
            let [start, end] = [path[on.piece], path[on.piece + 1]];
            let at_m = [0, 1].map(|axis| start[axis] + (end[axis] - start[axis]) * on.t);
            let share = k as f64 / count as f64;
            place(Step { at_m, piece: on.piece, t: on.t, share, way_m: on.way_m, whole_m: whole })
        });
        let mut places: Vec<Place> = steps.collect();
        // two box filters in sequence form a triangular kernel as long as the easing
        let side = (0.25 * params.easing * count as f64 / whole.max(1e-9)).round() as usize;
        let mut elevations: Vec<f64> = places.iter().map(|place| place.elevation_m).collect();
        for _ in 0..2 {
            elevations = averaged(&elevations, side);
        }
        for (place, elevation) in places.iter_mut().zip(elevations) {
            place.elevation_m = elevation - params.depth;
        }
        Self { places }.on_course(params)
    }

    fn on_course(mut self, params: &Params) -> Self {
        let places = &mut self.places;
        match params.course {
            Course::Land => {}
            Course::Graded => {
                let lengths: Vec<f64> = places.windows(2).map(|pair| distance(pair[0].at_m, pair[1].at_m)).collect();
                let elevations: Vec<f64> = places.iter().map(|place| place.elevation_m).collect();
                for (place, elevation_m) in places.iter_mut().zip(graded(&elevations, &lengths, params.grade)) {
                    place.elevation_m = elevation_m;
                }
            }
            Course::Downhill => {
                let mut lowest = f64::INFINITY;
                for place in places {
                    lowest = lowest.min(place.elevation_m);
                    place.elevation_m = lowest;
                }
            }
            Course::Straight => {
                let ends = [places[0], places[places.len() - 1]].map(|place| place.elevation_m);
                let lengths: Vec<f64> = places.windows(2).map(|pair| distance(pair[0].at_m, pair[1].at_m)).collect();
                let whole: f64 = lengths.iter().sum();
                let mut way = 0.0;
                for (place, next) in places.iter_mut().zip(lengths.into_iter().chain([0.0])) {
                    let t = if whole > 0.0 { way / whole } else { 0.0 };
                    place.elevation_m = ends[0] * (1.0 - t) + ends[1] * t;
                    way += next;
                }
            }
        }
        self
    }
}

/// How the widths of a stream and its depths grow with the way along it: its discharge is in proportion to its area,
/// which grows as its length to the power of 1.7 (J. T. Hack, 1957), width as its square root and depth as its power of
/// 0.4 (L. B. Leopold and T. Maddock, 1953).
const GROWTH: [f64; 2] = [0.85, 0.68];

impl Params {
    /// Returns width and depth at a fraction of the way, as fractions of those at the end.
    fn grown(&self, share: f64) -> [f64; 2] {
        GROWTH.map(|power| 1.0 - self.widening + self.widening * math::pow(share, power))
    }

    /// Returns the factors of the banks' widths on either side.
    fn banks(&self, [way_m, whole_m]: [f64; 2], wide: f64, seed: u32) -> [f64; 2] {
        let bank_m = (0.5 * self.width + self.bank).max(1e-3 * whole_m);
        let ends = math::smoothstep(way_m.min(whole_m - way_m) / bank_m);
        // banks of a narrow start are narrower, but no less than half
        let grown = 0.5 + 0.5 * wide;
        [101, 102].map(|side| {
            let key = place::key(seed, side);
            let uneven = 0.5 * along(way_m / (1.9 * bank_m), key) + 0.3 * along(way_m / (0.7 * bank_m), key ^ 1);
            grown * (1.0 + self.raggedness * ends * uneven)
        })
    }
}

/// Returns the terrain height at a point by bilinear interpolation.
fn elevation(land: &Field, at_m: [f64; 2]) -> f64 {
    let window = land.window();
    let cells = [0, 1].map(|axis| {
        let n = window.cells[axis] as usize;
        let at = at_m[axis] / window.cell_m() - 0.5;
        // beyond the edge the value at the edge; in a periodic world the value on the other side
        let at = if Ends::of(window, axis) == Ends::Wrap { at } else { at.clamp(0.0, n as f64 - 1.0) };
        let left = at.floor();
        let index = |k: i64| Ends::of(window, axis).index(left as i64 + k, n);
        ([index(0), index(1)], at - left)
    });
    let ([columns, rows], [x, y]) = ([cells[0].0, cells[1].0], [cells[0].1, cells[1].1]);
    let along = |row: usize| {
        let value = |column: usize| f64::from(land.samples()[row * window.nx() + column]);
        value(columns[0]) * (1.0 - x) + value(columns[1]) * x
    };
    along(rows[0]) * (1.0 - y) + along(rows[1]) * y
}
