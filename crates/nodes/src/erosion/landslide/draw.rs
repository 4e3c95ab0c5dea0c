//! When and where slopes are tested: a Poisson process in space and time.
//!
//! Every square of 1 km in the world has its own process, whose waiting times, places and sizes are hashes of the
//! square, the number of the event and the seed. Events therefore do not depend on the cells, and a longer run begins
//! with the events of a shorter one.

use orograph_graph::{Job, NodeError, mix};

use super::Params;
use crate::numerics::math;

/// Side of the squares in metres.
const SQUARE_M: f64 = 1000.0;
/// Maximum number of tests in a run.
pub(super) const MOST_TESTS: f64 = 2e6;
/// Scars shorter than this number of cells are not resolved.
pub(super) const RESOLVED_CELLS: f64 = 3.0;

/// What may fail.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// Rock, on a plane.
    Rock,
    /// Soil, over the rock.
    Soil,
}

/// A test of a slope.
#[derive(Clone, Copy, Debug)]
pub(super) struct Test {
    pub time_yr: f64,
    /// Hash of the event, from which everything else about it is drawn.
    key: u32,
    square: [u32; 2],
    pub kind: Kind,
}

/// What is drawn for a test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Draw {
    X,
    Y,
    Length,
    Chance,
    Dip,
    Strike,
    Width,
    Outline,
}

/// Returns a number between 0 and 1, without its ends, from a hash.
pub(super) fn unit(hash: u32) -> f64 {
    (f64::from(hash) + 0.5) * (1.0 / 4_294_967_296.0)
}

impl Test {
    /// Returns a number between 0 and 1 for a property of the event.
    pub fn unit(&self, draw: Draw) -> f64 {
        unit(self.hash(draw))
    }

    /// Returns a hash for a property of the event.
    pub fn hash(&self, draw: Draw) -> u32 {
        mix(self.key ^ mix(0x51D3_0000 + draw as u32))
    }

    /// Returns the place in metres from the world's corner.
    pub fn place_m(&self) -> [f64; 2] {
        let [x, y] = [Draw::X, Draw::Y].map(|draw| self.unit(draw));
        [SQUARE_M * (f64::from(self.square[0]) + x), SQUARE_M * (f64::from(self.square[1]) + y)]
    }

    /// Returns the length of the weak zone in metres: a power law between `smallest` and `largest`, such that areas
    /// have the density A^(−`size_exponent`).
    pub fn length_m(&self, params: &Params) -> f64 {
        let (smallest, largest) = (params.smallest, params.largest.max(params.smallest));
        // the exponent of the number of lengths that are exceeded
        let power = 2.0 * (params.size_exponent - 1.0);
        let left = 1.0 - math::pow(smallest / largest, power);
        smallest * math::pow(1.0 - self.unit(Draw::Length) * left, -1.0 / power)
    }
}

/// The tests of a run in order of time, and the number of those that cells are too coarse for.
pub(super) struct Tests {
    pub resolved: Vec<Test>,
    pub unresolved: usize,
}

/// Draws the tests of a run, of soil too if `with_soil`.
///
/// # Errors
/// If there are more than [`MOST_TESTS`], or [`NodeError::Cancelled`].
pub(super) fn tests(job: &Job<'_>, params: &Params, with_soil: bool) -> Result<Tests, NodeError> {
    let size = job.world().size;
    let rates = [(Kind::Rock, params.rate), (Kind::Soil, if with_soil { params.soil_rate } else { 0.0 })];
    let area_km2 = size[0] * size[1] * 1e-6;
    let expected = rates.iter().map(|(_, rate)| rate * 1e-3 * params.duration * area_km2).sum::<f64>();
    if expected > MOST_TESTS {
        return Err(NodeError::failed_with_hint(
            format!("{expected:.0} places would be tested in {area_km2:.0} km²; the most is {MOST_TESTS:.0}"),
            "lower `rate`, `soil_rate` or `duration`",
        ));
    }
    let coarsest_m = params.largest.max(params.smallest) / RESOLVED_CELLS;
    if job.cell_m() > coarsest_m {
        return Ok(Tests { resolved: Vec::new(), unresolved: expected.round() as usize });
    }
    let squares = size.map(|side| (side / SQUARE_M).ceil().max(1.0) as u32);
    let mut tests = Tests { resolved: Vec::new(), unresolved: 0 };
    for row in 0..squares[1] {
        job.check()?;
        for column in 0..squares[0] {
            for (kind, rate) in rates {
                // per year in a square
                let rate = rate * 1e-3 * SQUARE_M * SQUARE_M * 1e-6;
                let own = mix(row ^ mix(column ^ mix(job.seed() ^ mix(0x51D3_1000 + kind as u32))));
                let mut time_yr = 0.0;
                for number in 0_u32.. {
                    let key = mix(own ^ mix(number.wrapping_mul(0x9E37_79B9)));
                    time_yr -= math::ln(unit(key)) / rate;
                    // a rate of 0 waits for ever
                    if time_yr.is_nan() || time_yr > params.duration {
                        break;
                    }
                    let test = Test { time_yr, key: mix(key ^ 0x2545_F491), square: [column, row], kind };
                    let [x, y] = test.place_m();
                    if x >= size[0] || y >= size[1] {
                        continue;
                    }
                    if test.length_m(params) < RESOLVED_CELLS * job.cell_m() {
                        tests.unresolved += 1;
                    } else {
                        tests.resolved.push(test);
                    }
                }
            }
        }
    }
    tests.resolved.sort_unstable_by(|a, b| a.time_yr.total_cmp(&b.time_yr).then(a.key.cmp(&b.key)));
    Ok(tests)
}
