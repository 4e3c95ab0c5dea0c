//! Floors of valleys: a river cuts over the whole width of its valley, not along a line.
//!
//! A river that drains the area A wanders over a floor of the width w = w₁ (A / 1 km²)^0.4 min(1, 0.1 / S) √s, narrower
//! where it is steep, and wider where rock is softer than the mean by the factor s. Along the valley it also varies, by
//! the factor of [`Floors`]. The river's area counts for all cells of a disc of that width, less towards the rim; where
//! discs overlap the largest counts, so that the order does not matter. Only the law of incision sees it: what drains
//! where stays as it is.
//!
//! The foot of the slope beside a floor, or beside a river narrower than a cell, is worn in the same way, by a part of
//! the area. Without it valleys are sharp: in real elevation models with cells of 30 to 90 m the ground one cell beside
//! a river has 0.17 to 0.29 of the rise to three cells beside it, and a sharp valley a third. Smooth ground, as in files
//! of version 5 and before, has neither foot nor floors that follow the rock.

use orograph_graph::{Job, NodeError, Window, World, mix};

use super::Land;
use crate::{
    erosion::stream_power::{Params, area::REFERENCE_M2},
    numerics::{math, par, rock::MOST_DEVIATIONS, routing::code, variation::Variation, waves::Waves},
};

/// The power of the drainage area that the width goes with.
const POWER: f64 = 0.4;
/// The slope above which floors are narrower.
const STEEP: f64 = 0.1;
/// The widest floor, as a radius in cells.
const WIDEST_CELLS: f64 = 64.0;

/// The width of the foot of a slope beside a river, in cells.
const FOOT_CELLS: f64 = 1.25;
/// The area that wears a foot is at most so many A₀. More makes channels straighter than real ones.
const FOOT_AREAS: f64 = 1.0;
/// Rivers that drain less than so many A₀ have none.
const LEAST_FOOT_AREAS: f64 = 0.5;
/// The power of the softness of rock that the width goes with.
const SOFTNESS: f64 = 0.5;

/// The longest waves in which the width of floors varies, in √A₀, and the shortest, in the longest. Shorter ones would
/// make beads of a floor that is wider than they are.
const VARIATION_WAVES: [f64; 2] = [12.0, 0.2];
/// Their spectral slope.
const VARIATION_SLOPE: f64 = 3.5;

/// How wide floors are.
pub struct Floors {
    /// The width in metres of a valley that drains 1 km².
    width_m: f64,
    /// ρ: how gradually they rise to the slopes.
    rounding: f64,
    /// A factor of the width.
    variation: Option<Variation>,
}

impl Floors {
    /// As the parameters say.
    #[must_use]
    pub fn new(job: &Job<'_>, params: &Params) -> Self {
        let seed = mix(job.seed() ^ mix(0x5EED_0004));
        let hillslope_m = params.headwater_area.sqrt();
        let varied = Self::varied(params.valley_width, params.valley_variation, hillslope_m, seed, job.world());
        Self { rounding: params.valley_rounding, ..varied }
    }

    /// Floors whose width varies in proportion to hillslopes of this length.
    fn varied(width_m: f64, deviation: f64, hillslope_m: f64, seed: u32, world: &World) -> Self {
        let longest_m = VARIATION_WAVES[0] * hillslope_m;
        let varies = width_m > 0.0 && deviation > 0.0 && longest_m > 0.0;
        let waves = Waves { longest_m, spectral_slope: VARIATION_SLOPE, stretch: 1.0, grain: 0.6, seed };
        let sampler = || waves.sampler(VARIATION_WAVES[1] * longest_m, world);
        let most = [f64::from(MOST_DEVIATIONS); 2];
        Self { width_m, rounding: 0.0, variation: varies.then(|| Variation { deviation, waves: sampler(), most }) }
    }

    /// How much wider than a flat floor the disc is, so that the area that counts over it is the same.
    fn wider(&self) -> f64 {
        (1.0 + self.rounding).sqrt()
    }

    /// The part of a river's area that counts where 1 − d² / r² is `inside`.
    #[inline(always)]
    fn part(&self, inside: f64) -> f64 {
        if self.rounding > 0.0 { math::pow(inside, 1.0 + 2.0 * self.rounding) } else { inside }
    }

    /// The factor of the width at a position in metres. Its mean is close to one.
    fn factor(&self, place_m: [f64; 2]) -> f64 {
        let of = |varied: &Variation| math::exp(varied.log(place_m) - 0.5 * varied.deviation * varied.deviation);
        self.variation.as_ref().map_or(1.0, of)
    }
}

/// A river in a cell: the cell, the radius of its floor in cells, or 0 where that is narrower than a cell, and the area
/// in m².
type Reach = (u32, f32, f64);

impl Land<'_> {
    /// Lets the rivers of the last routing cut their floors.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn widen(&mut self, job: &Job<'_>) -> Result<(), NodeError> {
        if self.floors.width_m <= 0.0 {
            return Ok(());
        }
        let (nx, ny) = (self.grid.nx, self.grid.ny);
        let reaches: Vec<Vec<Reach>> = par::collect((0..ny).step_by(8), |_, first| {
            job.check()?;
            Ok::<_, NodeError>(self.reaches(first * nx..(first + 8).min(ny) * nx, &job.window()))
        })?;
        let (foot_m2, joined) = (FOOT_AREAS * self.feet_m2(), self.grid.wraps());
        let foot =
            |cells: f64, area_m2: f64| foot_m2.min(area_m2) * (1.0 - (cells / FOOT_CELLS) * (cells / FOOT_CELLS));
        let (codes, floors) = (&self.codes, &self.floors);
        // beside a river and beside one that passes, in cells
        let beside_cells = [1.0, 0.5_f64.sqrt()];
        let widened = self.area.widened(&self.law, beside_cells.map(|cells| foot(cells, f64::INFINITY)));
        let grid = &self.grid;
        let mut raise = |x: isize, y: isize, area_m2: f64| {
            let ([x, y], is_inside) = grid.nearest([x as i32, y as i32]);
            if is_inside {
                let widened = &mut widened[y * nx + x];
                *widened = widened.max(area_m2 as f32);
            }
        };
        for (cell, radius, area_m2) in reaches.into_iter().flatten() {
            let (x, y) = ((cell as usize % nx) as isize, (cell as usize / nx) as isize);
            if radius > 0.0 {
                let radius = f64::from(radius);
                let rim = (radius + 0.5) * (radius + 0.5);
                let far = (radius + if foot_m2 > 0.0 { FOOT_CELLS } else { 0.5 }) as isize;
                // no farther than the cells go
                let [across, down] = [(x, nx, joined[0]), (y, ny, joined[1])].map(|(at, count, is_joined)| {
                    if is_joined { -far..=far } else { (-at).max(-far)..=(count as isize - 1 - at).min(far) }
                });
                for (dx, dy) in down.flat_map(|dy| across.clone().map(move |dx| (dx, dy))) {
                    let square = (dx * dx + dy * dy) as f64;
                    let counts_m2 = area_m2 * floors.part((1.0 - square / rim).max(0.0));
                    raise(x + dx, y + dy, counts_m2.max(foot((square.sqrt() - radius).max(0.0), area_m2)));
                }
                continue;
            }
            // a river that runs diagonally passes half a diagonal from two of its neighbours
            let (east, south) = code::STEPS[code::direction(codes[cell as usize])];
            let [beside, passed] = beside_cells.map(|cells| foot(cells, area_m2));
            for (dx, dy) in [(-1, 0), (1, 0), (0, -1), (0, 1)] {
                let is_passed = east * south != 0 && (dx == east || dy == south);
                raise(x + dx as isize, y + dy as isize, if is_passed { passed } else { beside });
            }
        }
        Ok(())
    }

    /// A₀ where slopes have a foot, else 0.
    fn feet_m2(&self) -> f64 {
        if self.ground.has_feet() { self.area.headwater_m2() } else { 0.0 }
    }

    /// Rivers with a floor or a foot among some cells.
    fn reaches(&self, cells: std::ops::Range<usize>, window: &Window) -> Vec<Reach> {
        let width_m = self.floors.width_m;
        // below it a floor is narrower than a cell, unless it is 1.6 times as wide as others of its area
        let floor_m2 = 0.3 * REFERENCE_M2 * math::pow(self.cell_m / width_m, 1.0 / POWER);
        let (headwater_m2, wider) = (self.feet_m2(), self.floors.wider());
        let least_m2 = if headwater_m2 > 0.0 { floor_m2.min(LEAST_FOOT_AREAS * headwater_m2) } else { floor_m2 };
        let reach = |cell: usize| -> Option<Reach> {
            let (area_m2, code) = (self.area.m2(cell), self.codes[cell]);
            if area_m2 < least_m2 || !code::has_receiver(code) {
                return None;
            }
            if area_m2 < floor_m2 {
                return Some((cell as u32, 0.0, area_m2));
            }
            let receiver = self.grid.receiver(cell as u32, code) as usize;
            let slope = (self.heights[cell] - self.heights[receiver]) / (code::length(code) * self.cell_m);
            let narrowed = if slope > STEEP { STEEP / slope } else { 1.0 };
            let softer = if headwater_m2 > 0.0 { math::pow(self.rock.softer(cell), SOFTNESS) } else { 1.0 };
            let varied = self.floors.factor(window.centre_m(cell % self.grid.nx, cell / self.grid.nx));
            let width_m = width_m * math::pow(area_m2 / REFERENCE_M2, POWER) * narrowed * softer * varied;
            let radius = 0.5 * width_m / self.cell_m;
            let radius = if radius >= 0.5 { (radius * wider).min(WIDEST_CELLS) } else { 0.0 };
            (radius > 0.0 || headwater_m2 > 0.0).then_some((cell as u32, radius as f32, area_m2))
        };
        cells.filter_map(reach).collect()
    }
}

#[cfg(test)]
mod tests {
    use orograph_graph::{Boundary, Edge, World};

    use super::{super::Footing, *};
    use crate::{
        erosion::stream_power::{Inputs, NODE},
        prelude::*,
        testing,
    };

    /// Cells along a valley and across it.
    const VALLEY: [usize; 2] = [60, 81];

    /// Beside the river of a straight valley, the part of its area that each cell has is that of the definition.
    fn section(job: &Job<'_>) -> Result<Outputs, NodeError> {
        let (params, start) = (Params::read(job.params), Inputs::read(job)?.height);
        let mut land = Land::new(job, &params, start, Footing::default())?;
        land.route(job, Some(0))?;
        land.widen(job)?;
        let [nx, ny] = VALLEY;
        let (row, middle) = (ny / 2, nx / 2);
        // what the disc of a cell of the river gives to a cell this far along the river and across it
        let given_m2 = |x: usize, across: usize| {
            let area_m2 = land.area.m2(row * nx + x);
            let width_m = params.valley_width * math::pow(area_m2 / REFERENCE_M2, POWER);
            let radius = 0.5 * width_m * (1.0 + params.valley_rounding).sqrt() / land.cell_m;
            let square = (x.abs_diff(middle).pow(2) + across.pow(2)) as f64;
            let inside = 1.0 - square / ((radius + 0.5) * (radius + 0.5));
            if inside > 0.0 { area_m2 * math::pow(inside, 1.0 + 2.0 * params.valley_rounding) } else { 0.0 }
        };
        // the slopes to either side have rills that drain 40 cells at most
        let rill_m2 = 40.0 * land.cell_m * land.cell_m;
        let expected_m2 = |across| (0..nx).map(|x| given_m2(x, across)).fold(0.0, f64::max);
        let floor: Vec<usize> = (1..=35).filter(|across| expected_m2(*across) > rill_m2).collect();
        assert!((8..30).contains(&floor.len()), "{floor:?}");
        for across in 1..=35 {
            let (expected_m2, found_m2) = (expected_m2(across), land.area.widened_m2((row + across) * nx + middle));
            // areas and radii in single precision
            let is_floor = (found_m2 / expected_m2 - 1.0).abs() < 1e-5;
            assert!(
                if floor.contains(&across) { is_floor } else { found_m2 <= rill_m2 },
                "{across}: {found_m2} {expected_m2}"
            );
        }
        Ok(Outputs::default())
    }

    #[test]
    fn a_floor_has_the_section_of_its_definition() {
        let [nx, ny] = VALLEY;
        let boundary = Boundary { west: Edge::Open, ..Boundary::all(Edge::Wall) };
        let world = World { boundary, ..testing::world(nx as u32, ny as u32, 30.0) };
        let middle_m = 30.0 * (ny / 2) as f64 + 15.0;
        let height = testing::field(world, |x, y| 0.001 * x + 0.2 * (y - middle_m).abs());
        let node = Node { cpu: section, inputs: NODE.inputs, params: NODE.params, reads_sea: true, ..Node::DEFAULT };
        for rounding in ["0", "1", "2"] {
            let changes =
                format!("valley_rounding={rounding},valley_width=500,valley_variation=0,roughness=0,headwater_area=0");
            testing::outputs(&node, &testing::with_params(&NODE, &changes), &[("height", &height)]).expect("a section");
        }
    }

    /// A valley along joined sides has the same floor on both of them.
    fn joined_section(job: &Job<'_>) -> Result<Outputs, NodeError> {
        let (params, start) = (Params::read(job.params), Inputs::read(job)?.height);
        let mut land = Land::new(job, &params, start, Footing::default())?;
        land.route(job, Some(0))?;
        land.widen(job)?;
        let [nx, ny] = VALLEY;
        // rills on the slopes drain 40 cells at most, and not the same on both sides
        let rill_m2 = 40.0 * land.cell_m * land.cell_m;
        let mut compared = 0;
        for (x, across) in (0..nx).flat_map(|x| (1..=35).map(move |across| (x, across))) {
            let sides = [across, ny - across].map(|row| land.area.widened_m2(row * nx + x));
            if sides.iter().all(|side| *side > 1.2 * rill_m2) {
                let [north, south] = sides;
                assert!((north / south - 1.0).abs() < 0.1, "{x} {across}: {north} {south}");
                compared += 1;
            }
        }
        assert!(compared > 5 * nx, "{compared}");
        Ok(Outputs::default())
    }

    #[test]
    fn floors_go_on_across_joined_sides() {
        let [nx, ny] = VALLEY;
        let joined = Boundary { north: Edge::Periodic, south: Edge::Periodic, ..Boundary::all(Edge::Wall) };
        let boundary = Boundary { west: Edge::Open, ..joined };
        let world = World { boundary, ..testing::world(nx as u32, ny as u32, 30.0) };
        let size_m = 30.0 * ny as f64;
        let height = testing::field(world, |x, y| 0.001 * x + 0.2 * (y - 15.0).min(size_m - (y - 15.0)));
        let node =
            Node { cpu: joined_section, inputs: NODE.inputs, params: NODE.params, reads_sea: true, ..Node::DEFAULT };
        let changes = "valley_width=500,valley_variation=0,roughness=0,headwater_area=0";
        testing::outputs(&node, &testing::with_params(&NODE, changes), &[("height", &height)]).expect("a section");
    }

    /// The area that counts over a disc is that of a flat floor, however gradually the floor rises; the more it does, the less
    /// counts in the middle, and the more beyond the width.
    #[test]
    fn rounded_floors_count_as_much_as_flat_ones() {
        const STEP: f64 = 0.01;
        let squares: Vec<f64> =
            (-250..=250).flat_map(|y| (-250..=250).map(move |x| f64::from(x * x + y * y) * STEP * STEP)).collect();
        let mut last = [f64::INFINITY, 0.0];
        for rounding in [0.0, 0.5, 1.0, 3.0] {
            let floors = Floors { rounding, ..Floors::varied(25.0, 0.0, 700.0, 3, &testing::world(9, 9, 30.0)) };
            let counts = |within: std::ops::Range<f64>| {
                let square = |square: &&f64| within.contains(&square.sqrt());
                let part = |square: &f64| floors.part((1.0 - square / (floors.wider() * floors.wider())).max(0.0));
                STEP * STEP * squares.iter().filter(square).map(part).sum::<f64>()
            };
            // half of the disc of a flat floor, of the radius 1; squares of a hundredth of it
            assert!((counts(0.0..2.5) / (0.5 * std::f64::consts::PI) - 1.0).abs() < 0.01, "{rounding}");
            let [middle, beyond] = [counts(0.0..0.7), counts(1.0..2.5)];
            assert!(middle < last[0] && beyond >= last[1], "{rounding}: {middle} {beyond}");
            last = [middle, beyond];
        }
    }

    /// Along many valleys the width keeps its mean and has the deviation of the parameter.
    #[test]
    fn floors_widen_and_narrow_about_their_width() {
        let world = testing::world(9, 9, 30.0);
        let floors = Floors::varied(25.0, 0.5, 700.0, 3, &world);
        let places = (0..400).flat_map(|x| (0..400).map(move |y| [f64::from(x) * 1e3, f64::from(y) * 1e3]));
        let factors: Vec<f64> = places.map(|place_m| floors.factor(place_m)).collect();
        let mean = |values: &mut dyn Iterator<Item = f64>| values.sum::<f64>() / factors.len() as f64;
        let width = mean(&mut factors.iter().copied());
        let log = mean(&mut factors.iter().map(|factor| math::ln(*factor)));
        let spread = mean(&mut factors.iter().map(|factor| (math::ln(*factor) - log) * (math::ln(*factor) - log)));
        // 2300 waves in 160 000 places: two percent; three octaves have 0.93 of the deviation of all
        assert!((width - 1.0).abs() < 0.05 && (spread.sqrt() - 0.5).abs() < 0.06, "{width} {}", spread.sqrt());
        // hardly any change over the length of a hillslope
        let change = math::ln(floors.factor([5e4, 5e4]) / floors.factor([5e4, 5.07e4]));
        assert!(change.abs() < 0.3, "{change}");
        for (width_m, deviation, hillslope_m) in [(25.0, 0.0, 700.0), (25.0, 0.5, 0.0), (0.0, 0.5, 700.0)] {
            assert_eq!(Floors::varied(width_m, deviation, hillslope_m, 3, &world).factor([5e4, 5e4]), 1.0);
        }
    }
}
