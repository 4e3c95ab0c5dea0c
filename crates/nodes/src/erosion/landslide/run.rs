//! A run: tests of slopes one after another, and what becomes of those that fail.

use std::borrow::Cow;

use orograph_graph::{Job, Lane, NodeError, memory::zeroed};

use super::{
    Inputs, Params,
    draw::{self, Draw, Kind, Test},
    land::{Land, ROUNDING_M, Room},
    noise::Bumps,
    record::{Event, Record},
    runout::{Law, reach, run_out},
    soil::{self, Soil},
    wedge::{self, GRAVITY, Strength},
};
use crate::numerics::{
    beds::{Beds, Ground},
    math,
    ribs::ribs,
    rock::{Bodies, Knolls, tangent},
    voids,
    waves::SHORTEST_CELLS,
};

/// A scar of a slide must have at least this number of cells.
const FEWEST_CELLS: usize = 3;

/// The slides of a run.
pub(super) struct Slides<'a> {
    /// Heights at the start, without voids.
    pub start: Cow<'a, [f32]>,
    pub land: Land,
    events: Vec<Event>,
    tested: usize,
    unresolved: usize,
}

/// Returns the tangents of the steepest slopes of `StreamPower` for the same parameters; relative to those of layers,
/// where there are some.
fn steepest(job: &Job<'_>, params: &Params, inputs: &Inputs<'_>) -> Result<Vec<f32>, NodeError> {
    let varies = params.variation_size > 0.0 && params.repose_variation > 0.0;
    let has_layers = inputs.strata.is_some();
    let mut steepest = if varies {
        let bodies = Bodies { longest_m: params.variation_size, shortest_m: SHORTEST_CELLS * job.cell_m() };
        let softness = bodies.softness(job)?;
        bodies.steepest(job, inputs.repose, params.repose_variation, &softness)?
    } else if has_layers {
        vec![1.0]
    } else {
        match inputs.repose {
            Lane::Constant(repose) => vec![tangent(repose) as f32],
            Lane::Samples(repose) => repose.iter().map(|repose| tangent(*repose) as f32).collect(),
        }
    };
    for (cell, steepest) in steepest.iter_mut().enumerate().filter(|_| varies && has_layers) {
        let mean = tangent(inputs.repose.at(cell));
        *steepest = if steepest.is_finite() && mean.is_finite() && mean > 0.0 {
            (f64::from(*steepest) / mean) as f32
        } else {
            1.0
        };
    }
    Ok(steepest)
}

/// Returns the mean tangent of the steepest slopes, where slopes are limited: that by which `StreamPower` raises knolls.
fn mean_steepest(strength: &Strength<'_>, heights: &[f32]) -> f64 {
    let tangents = heights.iter().enumerate().map(|(cell, height)| strength.tangent(cell, f64::from(*height)));
    let (sum, count) = tangents
        .filter(|tangent| tangent.is_finite())
        .fold((0.0, 0.0), |(sum, count), tangent| (sum + tangent, count + 1.0));
    if count > 0.0 { sum / count } else { 0.0 }
}

/// The thickness of soil: 0 in voids and where it is negative.
fn metres(soil: f32) -> f64 {
    if soil.is_finite() { f64::from(soil).max(0.0) } else { 0.0 }
}

impl<'a> Slides<'a> {
    /// Runs the whole time.
    ///
    /// # Errors
    /// Sides that do not match, too many tests, [`NodeError::Cancelled`], or not enough memory.
    pub fn happen(job: &'a Job<'_>, params: &Params, inputs: &Inputs<'a>) -> Result<Self, NodeError> {
        let start = voids::filled(job, inputs.height.samples())?;
        let mut thickness: Vec<f64> = Vec::new();
        if let Some(soil) = inputs.soil {
            thickness = zeroed(start.len())?;
            let is_negative = |soil: f32| soil < 0.0;
            if soil.samples().iter().any(|soil| is_negative(*soil)) {
                job.warn("`soil` is negative in some places, where it counts as 0");
            }
            thickness.iter_mut().zip(soil.samples()).for_each(|(thickness, soil)| *thickness = metres(*soil));
        }
        let tests = draw::tests(job, params, inputs.soil.is_some())?;
        let land = Land::new(&job.window(), &start, thickness)?;
        let mut slides =
            Self { start, land, events: Vec::new(), tested: tests.resolved.len(), unresolved: tests.unresolved };
        if tests.resolved.is_empty() {
            return Ok(slides);
        }
        let steepest = steepest(job, params, inputs)?;
        let beds = inputs.strata.map(|strata| (Beds::of_rock(strata.column()), strata.offset().samples()));
        let mut strength = Strength {
            steepest: match &steepest[..] {
                [one] => Lane::Constant(*one),
                cells => Lane::Samples(cells),
            },
            layers: beds.as_ref().map(|(beds, offset)| Ground { beds, offset }),
            shaken: math::atan(params.shaking),
            cohesion: params.cohesion,
            unit_weight: params.density * GRAVITY,
            knolls: &[],
        };
        let knolls = Knolls::new(job, params.knolls, params.headwater_area.sqrt());
        let mut knolls = ribs(job, &knolls, &slides.start, params.ribs)?;
        if !knolls.is_empty() {
            let mean = mean_steepest(&strength, &slides.start) as f32;
            knolls.iter_mut().for_each(|knoll| *knoll *= mean);
            strength.knolls = &knolls;
        }
        let soil = Soil::new(params);
        let wet = |cell: usize| match f64::from(inputs.wetness.at(cell)) {
            wet if wet.is_finite() => wet,
            _ => 0.0,
        };
        let mut room = Room::new(slides.start.len())?;
        let count = tests.resolved.len();
        for (k, test) in tests.resolved.iter().enumerate() {
            if k.is_multiple_of(64) {
                job.advance(0.95 * k as f32 / count as f32)?;
            }
            let cells = match test.kind {
                Kind::Rock => match wedge::fails(&slides.land, &strength, test, params) {
                    Some(scar) => scar.cells(&slides.land, &mut room),
                    None => continue,
                },
                Kind::Soil => soil::cells(&slides.land, &soil, &wet, test, params, &mut room),
            };
            if cells.len() >= FEWEST_CELLS {
                slides.slide(params, test, &cells, &mut room);
            }
        }
        Ok(slides)
    }

    /// Lets the cells of a scar slide to the given depths.
    fn slide(&mut self, params: &Params, test: &Test, cells: &[(u32, f64)], room: &mut Room) {
        let land = &mut self.land;
        let cell_m2 = land.cell_m2();
        let crown = cells
            .iter()
            .map(|(cell, _)| *cell as usize)
            .fold(cells[0].0 as usize, |crown, cell| if land.ground[cell] > land.ground[crown] { cell } else { crown });
        let crown_m = land.ground[crown];
        let volume_m3 = cells.iter().map(|(_, depth)| depth * cell_m2).sum::<f64>();
        let sources: Vec<(u32, f64)> =
            cells.iter().map(|(cell, depth)| (*cell, land.remove(*cell as usize, *depth, params.bulking))).collect();
        let moved_m3: f64 = sources.iter().map(|(_, volume)| volume).sum();
        let size_m = math::pow(moved_m3, 1.0 / 3.0);
        let law = Law {
            sheet_m: size_m / params.spread,
            steepest: math::tan(params.deposit_slope.to_radians()),
            reach: reach(params.reach, moved_m3),
            bumps: Bumps::new(land, size_m.max(4.0 * land.cell_m), test.hash(Draw::Outline) ^ 0x00FF_00FF),
        };
        let came = run_out(land, room, law, &sources, (crown, crown_m));
        self.events.push(Event {
            kind: test.kind,
            place_m: test.place_m(),
            time_yr: test.time_yr,
            area_m2: cells.len() as f64 * cell_m2,
            volume_m3,
            runout_m: came.runout_m,
            drop_m: came.drop_m,
        });
    }

    /// Returns the record of the run.
    pub fn record(&self, params: &Params, inputs: &Inputs<'_>) -> Record {
        let (land, start) = (&self.land, &self.start);
        let lost = |now: &dyn Fn(usize) -> f64, then: &dyn Fn(usize) -> f64| {
            let lost = (0..start.len()).map(|cell| then(cell) - now(cell)).filter(|lost| lost.abs() > ROUNDING_M);
            land.cell_m2() * lost.sum::<f64>()
        };
        let soil = |cell: usize| land.soil.get(cell).copied().unwrap_or(0.0);
        let soil_before = |cell: usize| inputs.soil.map_or(0.0, |soil| metres(soil.samples()[cell]));
        Record {
            events: self.events.clone(),
            tested: self.tested,
            unresolved: self.unresolved,
            ledger: land.ledger,
            bulking: params.bulking,
            rock_m3: lost(&|cell| land.ground[cell] - land.debris[cell] - soil(cell), &|cell| {
                f64::from(start[cell]) - soil_before(cell)
            }),
            soil_m3: inputs.soil.map(|_| lost(&soil, &soil_before)),
            debris_m3: land.cell_m2() * land.debris.iter().sum::<f64>(),
        }
    }
}
