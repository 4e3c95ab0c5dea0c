//! Moves, rotates and stretches a field in the world.

use orograph_graph::memory::zeroed;

use super::mix;
use crate::numerics::{
    gaussian::Gaussian,
    lines::{Ends, separable},
};
use crate::{
    numerics::{math, par},
    prelude::*,
};

choice! {
    /// Values beyond the edges of the world.
    pub enum Outside {
        /// The mirrored terrain.
        Mirror = "mirror",
        /// The terrain of the opposite side.
        Wrap = "wrap",
        /// The values at the edge.
        Edge = "edge",
        /// The value `level`.
        Level = "level",
    }
}

params! {
    /// Distance by which the field is moved, to the east and to the south.
    offset: [f64; 2] = [0.0, 0.0], Metres, -1e7..=1e7;
    /// Angle by which it is rotated about the pivot, clockwise.
    rotation: f64 = 0.0, Degrees, -360.0..=360.0, soft -180..=180;
    /// Factor by which it is scaled about the pivot.
    stretch: f64 = 1.0, One, 0.01..=100.0, soft 0.25..=4;
    /// Centre of rotation and scaling, before the field is moved; from the world's north-west corner.
    pivot: Position = Position([8192.0, 8192.0]), Metres, -1e7..=1e7;
    /// Values beyond the edges of the world.
    outside: Outside = Outside::Mirror, One, ..;
    /// The value beyond the edges, in the unit of the input, for `level`.
    level: f64 = 0.0, One, -1e9..=1e9, soft -1000..=5000, when outside = "level";
    /// Also multiplies values by `stretch`, so that slopes stay the same.
    keep_slopes: bool = false, One, ..;
}

inputs! {
    /// Field to transform.
    value: AnyScalar;
    /// Where the result replaces the input: fully at 1, not at all at 0.
    mask: Mask = 1.0, 0.0..=1.0;
}

outputs! {
    /// The transformed values, with the meaning of the input.
    value: SameAs(value);
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Transform",
    category: "filter",
    summary: "Moves, rotates and scales a field, in metres.",
    doc: include_str!("transform.md"),
    sources: &["E. Catmull and R. Rom (1974), A class of local interpolating splines"],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    reach: Reach::World,
    scratch: Scratch::Bytes(scratch),
    cpu: run,
    example: "value: \"base\", offset: (600, -400), rotation: 30, stretch: 1.6",
    ..Node::DEFAULT
};

/// Positions are rounded to this fraction of a cell, so that those on cell centres are exact.
const ROUNDED: f64 = 1_048_576.0;

/// Memory that the kernel needs in addition to its inputs and outputs.
fn scratch(sizing: &Sizing<'_>) -> u64 {
    let Params { offset, rotation, stretch, .. } = Params::read(sizing.params);
    let stays = offset == [0.0; 2] && rotation == 0.0;
    if stretch >= 1.0 || (stays && stretch == 1.0) {
        return 0;
    }
    let sigma = 0.4 * (1.0 / (stretch * stretch) - 1.0).sqrt();
    sizing.cells(4.0).max(Gaussian::bytes(sigma * sizing.window.cell_m(), &sizing.window))
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let Inputs { value, mask } = Inputs::read(job)?;
    let params = Params::read(job.params);
    let window = job.window();
    if params.offset == [0.0; 2] && params.rotation == 0.0 && params.stretch == 1.0 {
        return Ok(Given { value: Some(value.clone()) }.into());
    }
    let smoothed;
    let source = if params.stretch < 1.0 {
        let sigma = 0.4 * (1.0 / (params.stretch * params.stretch) - 1.0).sqrt();
        smoothed = separable(job, [0.0, 0.4], value.samples(), &Gaussian::new(sigma))?;
        &smoothed
    } else {
        value.samples()
    };
    let (low, high) = value.range(0).unwrap_or((0.0, 0.0));
    let source = Source { samples: source, range: [low, high], cells: [window.nx(), window.ny()], params: &params };
    let factor = if params.keep_slopes { params.stretch as f32 } else { 1.0 };
    let angle = params.rotation.to_radians();
    let [cos, sin] = [math::cos(angle), math::sin(angle)].map(|part| part / params.stretch);
    let cell_m = job.cell_m();
    let mut out = zeroed(window.len())?;
    par::rows_within(job, [0.4, 0.9], &mut out, |j, row| {
        for (i, out) in row.iter_mut().enumerate() {
            let place = window.centre_m(i, j);
            let [x, y] = [0, 1].map(|axis| place[axis] - params.pivot[axis] - params.offset[axis]);
            let from = [params.pivot[0] + x * cos + y * sin, params.pivot[1] + y * cos - x * sin];
            *out = factor * source.at(from.map(|metres| ((metres / cell_m - 0.5) * ROUNDED).round() / ROUNDED));
        }
    })?;
    mix(job, value.samples(), &mut out, mask)?;
    Ok(Given { value: Some(Field::new(window, out)) }.into())
}

/// The world's samples.
struct Source<'a> {
    samples: &'a [f32],
    /// Minimum and maximum.
    range: [f32; 2],
    cells: [usize; 2],
    params: &'a Params,
}

impl Source<'_> {
    /// Returns the value at a position in cells from the centre of the first cell.
    fn at(&self, place: [f64; 2]) -> f32 {
        let [nx, ny] = self.cells;
        let beyond = |axis: usize| place[axis] < -0.5 || place[axis] > self.cells[axis] as f64 - 0.5;
        if self.params.outside == Outside::Level && (beyond(0) || beyond(1)) {
            return self.params.level as f32;
        }
        let left = place.map(f64::floor);
        let columns = [-1, 0, 1, 2].map(|k| self.index(left[0] as i64 + k, nx));
        let rows = [-1, 0, 1, 2].map(|k| self.index(left[1] as i64 + k, ny) * nx);
        if place == left {
            return self.samples[rows[1] + columns[1]];
        }
        let across = math::catmull_rom(place[0] - left[0]);
        let down = math::catmull_rom(place[1] - left[1]);
        let along = |row: usize| -> f64 {
            columns.into_iter().zip(across).map(|(column, across)| across * f64::from(self.samples[row + column])).sum()
        };
        let sum: f64 = rows.into_iter().zip(down).map(|(row, down)| down * along(row)).sum();
        (sum as f32).clamp(self.range[0], self.range[1])
    }

    fn index(&self, at: i64, n: usize) -> usize {
        match self.params.outside {
            Outside::Mirror => Ends::Mirror.index(at, n),
            Outside::Wrap => Ends::Wrap.index(at, n),
            Outside::Edge | Outside::Level => at.clamp(0, n as i64 - 1) as usize,
        }
    }
}

#[cfg(test)]
mod tests {
    use orograph_graph::ParamValue;

    use super::*;
    use crate::testing::{field, run as result, run_in, with_params, world};

    fn transformed(land: &Field, offset: [f64; 2], pivot: [f64; 2], changes: &str) -> Field {
        let mut params = with_params(&NODE, changes);
        params.set("offset", ParamValue::Point(offset));
        params.set("pivot", ParamValue::Point(pivot));
        result(&NODE, &params, &[("value", land)], "value")
    }

    fn rough(nx: u32, ny: u32, cell_m: f64) -> Field {
        field(world(nx, ny, cell_m), |x, y| 300.0 * libm::sin(x * y * 0.01) + x)
    }

    #[test]
    fn no_change_whole_cells_and_quarter_turns_copy_bits() {
        let land = rough(40, 30, 3.3);
        assert_eq!(transformed(&land, [0.0; 2], [17.0, 5.0], ""), land);
        let moved = transformed(&land, [33.0, -9.9], [0.0; 2], "outside=wrap");
        for (at, &found) in moved.samples().iter().enumerate() {
            let from = (at / 40 + 3) % 30 * 40 + (at % 40 + 30) % 40;
            assert_eq!(found, land.samples()[from], "{at}");
        }
        let land = rough(37, 37, 3.3);
        let turned = transformed(&land, [0.0; 2], [37.0 * 1.65; 2], "rotation=90");
        for (at, &found) in turned.samples().iter().enumerate() {
            // clockwise: the west side becomes the north side
            assert_eq!(found, land.samples()[(36 - at % 37) * 37 + at / 37], "{at}");
        }
        let whole = transformed(&land, [0.0; 2], [37.0 * 1.65; 2], "rotation=360");
        assert_eq!(whole, land);
    }

    /// A hill in closed form is at its new position, on cells of any size.
    #[test]
    fn a_hill_is_where_it_was_sent() {
        let hill = |x: f64, y: f64| 500.0 * libm::exp(-(x * x + 2.0 * y * y) / 8_000.0);
        for cell_m in [10.0, 5.0] {
            let n = (1000.0 / cell_m) as u32;
            let land = field(world(n, n, cell_m), |x, y| hill(x - 300.0, y - 400.0));
            let top = f64::from(land.range(0).expect("finite").1);
            for (stretch, tolerance) in [(1.0, 0.5), (1.7, 0.5), (0.6, 6.0)] {
                let found = transformed(
                    &land,
                    [100.0, 50.0],
                    [500.0; 2],
                    &format!("rotation=35,stretch={stretch},outside=edge"),
                );
                let (sin, cos) = (libm::sin(35.0_f64.to_radians()), libm::cos(35.0_f64.to_radians()));
                for (at, &found) in found.samples().iter().enumerate() {
                    let [x, y] = land.window().centre_m(at % n as usize, at / n as usize);
                    let [x, y] = [(x - 600.0) / stretch, (y - 550.0) / stretch];
                    // the cell nearest to the summit is lower than it
                    let expected = hill(x * cos + y * sin + 200.0, y * cos - x * sin + 100.0).min(top);
                    assert!((f64::from(found) - expected).abs() < tolerance, "{stretch} {x} {y}: {found} {expected}");
                }
            }
        }
    }

    #[test]
    fn beyond_the_edges_is_what_was_chosen() {
        let land = field(world(20, 20, 10.0), |x, _| x);
        let at = |outside: &str| transformed(&land, [50.0, 0.0], [0.0; 2], outside).samples()[1];
        assert_eq!(at("outside=mirror"), 35.0);
        assert_eq!(at("outside=wrap"), 165.0);
        assert_eq!(at("outside=edge"), 5.0);
        assert_eq!(at("outside=level,level=-77"), -77.0);
    }

    #[test]
    fn slopes_are_kept_if_asked_for_and_threads_do_not_matter() {
        let slope = field(world(60, 50, 10.0), |x, _| 0.5 * x);
        let found = transformed(&slope, [0.0; 2], [300.0, 0.0], "stretch=3,keep_slopes=true");
        let row = &found.samples()[1500..1560];
        // cells of the east and west edges read mirrored terrain
        assert!(row.windows(2).skip(5).take(48).all(|pair| (pair[1] - pair[0] - 5.0).abs() < 1e-3), "{row:?}");
        let params = with_params(&NODE, "rotation=12,stretch=0.4");
        assert_eq!(run_in(1, &NODE, &params, &[("value", &slope)]), run_in(3, &NODE, &params, &[("value", &slope)]));
    }
}
