//! The water at the start of a run with known drainage: full lakes, and rivers at normal depth.
//!
//! Filling lakes and rivers takes most of the time of a storm on real terrain. With the drainage area A from
//! [`crate::numerics::drained`] and the rain p the discharge per width of a cell is q = p A / dx, and by Manning's
//! formula it is steady at the depth (q n / √S)^(3/5), where S is the slope of the level that the water follows.

use super::{Inputs, Params, flow::HIGHEST, physics::Scheme};
use crate::{
    numerics::{drained::Drained, math, par, routing::Grid},
    prelude::*,
};

/// The smallest slope of a river's bed: flatter ground belongs to lakes.
const LEAST_SLOPE: f64 = 1e-3;

/// Returns the depth of water in metres at the start, per cell. Returns None when no flow is wired.
///
/// # Errors
/// When the world is too small to drain, or [`NodeError::Cancelled`].
pub(super) fn depths(job: &Job<'_>, inputs: &Inputs<'_>, params: &Params) -> Result<Option<Vec<f32>>, NodeError> {
    let Some(flow) = inputs.flow else { return Ok(None) };
    job.check()?;
    let grid = Grid::new(&job.window())?;
    let flow = Drained::read(flow);
    let heights = inputs.height.samples();
    let rain = inputs.rain;
    let sum: f64 = (0..heights.len()).map(|at| f64::from(rain.at(at).max(0.0))).sum();
    let rain_m_per_s = sum / heights.len() as f64 / 3.6e6;
    let cell_m = job.cell_m();
    let depth = |cell: usize| {
        let level = flow.level_m[cell];
        if heights[cell].abs() >= HIGHEST || level > heights[cell] {
            return (level - heights[cell]).max(0.0);
        }
        let Some(way) = flow.way(cell).filter(|_| params.scheme == Scheme::Inertial) else { return 0.0 };
        let receiver = grid.neighbour(cell as u32, way);
        let drop_m = receiver.map_or(0.0, |receiver| f64::from(level - flow.level_m[receiver as usize]));
        let run_m = if way % 2 == 0 { cell_m } else { cell_m * std::f64::consts::SQRT_2 };
        let slope = (drop_m / run_m).max(LEAST_SLOPE);
        let discharge = rain_m_per_s * f64::from(flow.area_m2[cell]) / cell_m;
        math::pow(discharge * params.roughness / slope.sqrt(), 0.6) as f32
    };
    Ok(Some(par::map(heights.len(), depth)))
}

#[cfg(test)]
mod tests {
    use orograph_graph::{Boundary, Edge, World};

    use super::super::NODE;
    use crate::{
        hydrology::flow,
        prelude::*,
        testing::{field, outputs, with_params, world},
    };

    fn flow_of(height: &Field) -> Field {
        let mut found = outputs(&flow::NODE, &with_params(&flow::NODE, ""), &[("height", height)]).expect("drains");
        found.take("flow").expect("declared").as_field().expect("a field").clone()
    }

    fn water(height: &Field, flow: Option<&Field>, changes: &str) -> (Field, f64) {
        let mut fields = vec![("height", height)];
        fields.extend(flow.map(|flow| ("flow", flow)));
        let mut found = outputs(&NODE, &with_params(&NODE, changes), &fields).expect("runs");
        let report = found.take("report").expect("declared");
        let error = report.as_report().and_then(|report| report.balance_of("water")).expect("a balance").error;
        (found.take("water").expect("declared").as_field().expect("a field").clone(), error)
    }

    #[test]
    fn lakes_are_full_from_the_start() {
        let pit = field(world(21, 21, 10.0), |x, y| (0.2 * libm::hypot(x - 105.0, y - 105.0)).min(12.0));
        let drained = flow_of(&pit);
        let (water, _) = water(&pit, Some(&drained), "duration=0");
        // the pass is one of the cells where the plateau begins; terrain there has its own film
        for (at, (&depth, &height)) in water.samples().iter().zip(pit.samples()).enumerate() {
            if height < 11.0 {
                assert_eq!(depth, drained.plane(3)[at] - height);
            }
        }
        assert!(water.samples()[10 * 21 + 10] > 10.0);
    }

    /// A valley whose rivers take about twenty minutes to fill: its final water is there from the start, within the
    /// differences between the depths of four faces and of one path down.
    #[test]
    fn a_warm_run_is_where_a_cold_one_ends() {
        let sides = Boundary { west: Edge::Wall, east: Edge::Wall, north: Edge::Wall, south: Edge::Open };
        let world = World { boundary: sides, ..world(64, 96, 20.0) };
        let valley = field(world, |x, y| 0.15 * (x - 640.0).abs() + 0.05 * (1920.0 - y));
        let drained = flow_of(&valley);
        let held = |flow: Option<&Field>, seconds: u32| {
            let (water, error) = water(&valley, flow, &format!("duration={seconds},acceleration=0"));
            assert!(error.abs() < 1e-4, "the water at the start is in the balance: {error}");
            water.samples().iter().map(|depth| f64::from(*depth)).sum::<f64>()
        };
        let (end, cold, warm) = (held(None, 7200), held(None, 60), held(Some(&drained), 60));
        assert!(cold < 0.5 * end, "{cold} {end}");
        assert!((warm / end - 1.0).abs() < 0.15, "{warm} {end}");
    }
}
