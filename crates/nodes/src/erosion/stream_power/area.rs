//! Drainage area, weighted by rain, and its power in the law.

use std::ops::Range;

use super::incision::Law;
use crate::{
    numerics::{
        math, par,
        routing::{Drainage, Grid, code},
    },
    prelude::*,
};

/// On levels, this many half cells are added to the area that soaks half of the ground. Otherwise cells as large as gullies
/// would stand less steep than small ones: by 4 % of the mean slope between 256 and 1024 cells.
const DRIER: f32 = 3.0;
/// The drainage area of a reference river.
pub const REFERENCE_M2: f64 = 1e6;

/// Drainage areas below this share of A₀ are headwaters.
const HEADWATERS: f64 = 0.2;
/// The share of a step in the mean of the last ones.
const NEWEST: f32 = 0.15;
/// Numbers of cells whose power is computed beforehand.
const POWERS: u32 = 4096;
/// Standard deviations at which the waves of A₀ are cut off: cells must hold the shortest hillslopes.
const CUT_OFF: [f32; 2] = [-1.0, 2.0];
/// By how much harder rock is where A₀ varies, so that slopes keep their mean: the logarithm, per squared deviation.
const HARDER: f64 = 0.04;

/// Drainage area of every cell. Where it rains p times the mean, a cell counts p times: discharge over the mean rain.
#[derive(Debug)]
pub struct Area<'a> {
    drained: Drained<'a>,
    /// m² of a cell that counts once.
    cell_m2: f64,
    critical_m2: f64,
    headwater_m2: f64,
    /// A₀ᵐ, which the law adds to Aᵐ.
    headwater: f64,
    m: f64,
    /// The root of A₀ᵐ over its mean, of each cell; empty where A₀ is the same everywhere.
    headwaters: Vec<f32>,
    /// The factor by which all rock is harder where A₀ varies.
    harder: f64,
    /// The area that cuts, where that is not the cell's own: floors of valleys are cut by their river.
    widened: Vec<f32>,
    /// Areas that are given to many cells, and Aᵐ + A₀ᵐ of each.
    frequent: [(f32, f64); 2],
    /// The mean of what drained through each cell over the last steps, in cells. Where it is below `spread_below` it is
    /// what cuts: the water of one step runs in one line of cells, that of many steps over the whole slope.
    spread: Vec<f32>,
    spread_below: f32,
    /// Steps in the mean.
    spread_steps: u32,
    scheme: Scheme,
    /// Aᵐ + A₀ᵐ by number of cells where rain is even. Nearly all cells drain few others: theirs are computed
    /// beforehand.
    powers: Vec<f64>,
}

/// What drains through each cell, its own share included.
#[derive(Debug)]
enum Drained<'a> {
    /// The number of cells; the same rain falls on all.
    Cells(Vec<u32>),
    /// The sum of the rain on them.
    Rain { sums: Vec<f64>, rain: &'a [f32] },
}

impl<'a> Area<'a> {
    /// Areas of `cells` cells, unknown until [`Self::accumulate`].
    #[must_use]
    pub fn new(law: &Law, cells: usize, rain: Lane<'a>, cell_m2: f64, heads: Heads, scheme: Scheme) -> Self {
        let (critical_m2, m, headwater) = (heads.critical_m2, heads.m, heads.power());
        let (drained, cell_m2) = match rain {
            Lane::Constant(rain) => (Drained::Cells(vec![0; cells]), cell_m2 * share(rain)),
            Lane::Samples(rain) => (Drained::Rain { sums: vec![0.0; cells], rain }, cell_m2),
        };
        let spread_below = (HEADWATERS * heads.headwater_m2 / cell_m2).min(f64::from(POWERS - 2)) as f32;
        let (powers, widened, spread) = (Vec::new(), Vec::new(), Vec::new());
        let mut area = Self {
            drained,
            cell_m2,
            critical_m2,
            headwater_m2: heads.headwater_m2,
            headwater,
            m,
            headwaters: Vec::new(),
            harder: 1.0,
            widened,
            frequent: [(f32::NAN, 0.0); 2],
            spread,
            spread_below,
            spread_steps: 0,
            scheme,
            powers,
        };
        area.powers = (0..POWERS).map(|cells| area.compute(law, f64::from(cells.max(1)))).collect();
        area
    }

    /// Lets A₀ vary in waves of so many standard deviations.
    pub fn vary_headwaters(&mut self, deviation: f64, mut waves: Vec<f32>) {
        let half = 0.5 * self.m * deviation;
        par::change(&mut waves, |root| {
            *root = math::exp(half * f64::from(root.clamp(CUT_OFF[0], CUT_OFF[1]))) as f32;
        });
        self.headwaters = waves;
        self.harder = math::exp(HARDER * deviation * deviation);
    }

    /// Adds up what drains through each cell, and orders the cells for it.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn accumulate(
        &mut self,
        job: &Job<'_>,
        grid: &Grid,
        codes: &[u8],
        drainage: &mut Drainage,
    ) -> Result<(), NodeError> {
        match &mut self.drained {
            Drained::Cells(cells) => {
                cells.fill(1);
                drainage.accumulate(job, grid, codes, cells)
            }
            Drained::Rain { sums, rain } => {
                sums.iter_mut().zip(*rain).for_each(|(sum, &rain)| *sum = share(rain));
                drainage.accumulate(job, grid, codes, sums)
            }
        }
    }

    /// The area in m².
    #[must_use]
    pub fn m2(&self, cell: usize) -> f64 {
        match &self.drained {
            Drained::Cells(cells) => f64::from(cells[cell]) * self.cell_m2,
            Drained::Rain { sums, .. } => sums[cell] * self.cell_m2,
        }
    }

    /// The cells that drain an area or more.
    #[must_use]
    pub fn at_least(&self, area_m2: f64) -> AtLeast<'_> {
        match &self.drained {
            Drained::Cells(cells) => {
                let drains = |cells: u32| f64::from(cells) * self.cell_m2 >= area_m2;
                let near = (area_m2 / self.cell_m2) as u32;
                // rounding may move the limit by a cell
                let least = (near.saturating_sub(1)..=near.saturating_add(1)).find(|cells| drains(*cells));
                AtLeast::Cells { cells, least }
            }
            Drained::Rain { sums, .. } => AtLeast::Rain { sums, cell_m2: self.cell_m2, area_m2 },
        }
    }

    /// Keeps the areas alone, and nothing that only another step would need.
    #[must_use]
    pub fn end(self) -> Self {
        Self { headwaters: Vec::new(), widened: Vec::new(), spread: Vec::new(), ..self }
    }

    /// Takes the areas of a step into the mean of the last ones.
    pub fn spread(&mut self) {
        if self.spread_below < 1.0 {
            return;
        }
        self.spread_steps += 1;
        let newest = match self.scheme {
            Scheme::SingleGrid => NEWEST,
            Scheme::Level => NEWEST.max(1.0 / self.spread_steps as f32),
        };
        let Self { drained, spread, .. } = self;
        let drained = &*drained;
        let cells = match drained {
            Drained::Cells(cells) => cells.len(),
            Drained::Rain { sums, .. } => sums.len(),
        };
        let now = |cell: usize| match drained {
            Drained::Cells(cells) => cells[cell] as f32,
            Drained::Rain { sums, .. } => sums[cell] as f32,
        };
        if spread.is_empty() {
            spread.extend((0..cells).map(&now));
        }
        par::change_at(spread, |cell, mean| *mean += newest * (now(cell) - *mean));
    }

    /// A₀ in m².
    #[must_use]
    pub const fn headwater_m2(&self) -> f64 {
        self.headwater_m2
    }

    /// What drains through some cells per metre of their contours, at most `most` times what soaks half of the ground:
    /// `saturated_m2` through a cell whose water leaves along a row or a column, times A₀ᵐ over its mean.
    pub fn wetness(&self, saturated_m2: f64, most: f32, codes: &[u8], cells: Range<usize>, wetness: &mut [f32]) {
        let (saturated, less) = (self.cells_of(saturated_m2), self.less());
        match &self.drained {
            Drained::Cells(drained) => {
                let drained = &drained[cells.clone()];
                wetness.iter_mut().zip(drained).for_each(|(wetness, drained)| *wetness = *drained as f32);
            }
            Drained::Rain { sums, .. } => {
                let sums = &sums[cells.clone()];
                wetness.iter_mut().zip(sums).for_each(|(wetness, sum)| *wetness = *sum as f32);
            }
        }
        if let Some(spread) = self.spread.get(cells.clone()) {
            for (wetness, mean) in wetness.iter_mut().zip(spread) {
                *wetness = if *mean < self.spread_below { *mean } else { *wetness };
            }
        }
        if let Some(roots) = self.headwaters.get(cells.clone()) {
            let share = |(wetness, root): (&mut f32, &f32)| *wetness = (*wetness - less) / (saturated * root * root);
            wetness.iter_mut().zip(roots).for_each(share);
        } else {
            wetness.iter_mut().for_each(|wetness| *wetness = (*wetness - less) / saturated);
        }
        for (wetness, code) in wetness.iter_mut().zip(&codes[cells]) {
            *wetness = wetness.clamp(0.0, most) * code::length(*code) as f32;
        }
    }

    /// The share of the ground that is saturated with so much of [`Self::wetness`], as a function of its own.
    pub fn saturated(&self, saturated_m2: f64) -> impl Fn(f32) -> f32 + use<> {
        let dry = 1.0 + DRIER * self.less() / self.cells_of(saturated_m2);
        move |wetness| wetness / (wetness + dry)
    }

    fn cells_of(&self, area_m2: f64) -> f32 {
        (area_m2 / self.cell_m2) as f32
    }

    /// By how many cells less than drain through a cell count.
    const fn less(&self) -> f32 {
        match self.scheme {
            Scheme::SingleGrid => 0.0,
            Scheme::Level => 0.5,
        }
    }

    /// The override of the drainage area of a cell in m²; 0 for none.
    #[cfg(test)]
    pub fn widened_m2(&self, cell: usize) -> f64 {
        f64::from(self.widened[cell])
    }

    /// An area of which so many cells drain through each cell.
    #[cfg(test)]
    pub fn with_drained(self, cells: Vec<u32>) -> Self {
        Self { drained: Drained::Cells(cells), ..self }
    }

    /// Overrides of the drainage area in m², at first 0: they apply where they are larger than the cell's own area.
    ///
    /// Many cells will be given one of the areas `frequent_m2`, whose power is computed beforehand.
    pub fn widened(&mut self, law: &Law, frequent_m2: [f64; 2]) -> &mut [f32] {
        self.frequent = frequent_m2.map(|area_m2| {
            let area_m2 = area_m2 as f32;
            (area_m2, self.compute(law, f64::from(area_m2) / self.cell_m2))
        });
        self.widened.clear();
        let cells = match &self.drained {
            Drained::Cells(cells) => cells.len(),
            Drained::Rain { sums, .. } => sums.len(),
        };
        self.widened.resize(cells, 0.0);
        &mut self.widened
    }

    /// The factor Aᵐ + A₀ᵐ of the law, as a coefficient. Where A₀ᵐ is f times its mean, all of it is divided by √f.
    #[must_use]
    #[inline(always)]
    pub fn power(&self, law: &Law, cell: usize) -> f64 {
        let power = self.power_of_the_mean(law, cell);
        match self.headwaters.get(cell) {
            Some(&root) => {
                let root = f64::from(root);
                law.coefficient((law.value(power) + (root * root - 1.0) * self.headwater) / (root * self.harder))
            }
            None => power,
        }
    }

    /// The factor with the mean of A₀.
    #[inline(always)]
    fn power_of_the_mean(&self, law: &Law, cell: usize) -> f64 {
        if let Some(&widened) = self.widened.get(cell)
            && f64::from(widened) > self.m2(cell)
        {
            return match self.frequent.iter().find(|(area_m2, _)| *area_m2 == widened) {
                Some((_, power)) => *power,
                None => self.compute(law, f64::from(widened) / self.cell_m2),
            };
        }
        if let Some(&mean) = self.spread.get(cell)
            && mean < self.spread_below
        {
            let mean = f64::from(mean);
            let whole = mean as usize;
            let [low, high] = [self.powers[whole], self.powers[whole + 1]];
            return low + (high - low) * (mean - whole as f64);
        }
        match &self.drained {
            Drained::Cells(cells) => {
                let cells = cells[cell];
                self.powers.get(cells as usize).copied().unwrap_or_else(|| self.compute(law, f64::from(cells)))
            }
            Drained::Rain { sums, .. } => self.compute(law, sums[cell]),
        }
    }

    /// Aᵐ + A₀ᵐ where hardly anything drains, as a number: half a cell where no other area is given.
    #[must_use]
    pub fn least_power(&self) -> f64 {
        if self.headwater > 0.0 {
            return self.headwater;
        }
        math::pow(self.critical_m2.max(0.5 * self.cell_m2), self.m)
    }

    fn compute(&self, law: &Law, drained: f64) -> f64 {
        let drained = match self.scheme {
            Scheme::SingleGrid => drained,
            Scheme::Level => (drained - 0.5).max(0.0),
        };
        law.coefficient(math::pow((drained * self.cell_m2).max(self.critical_m2), self.m) + self.headwater)
    }
}

/// See [`Area::at_least`].
pub enum AtLeast<'a> {
    Cells {
        cells: &'a [u32],
        /// The least number of cells; None is more than there are.
        least: Option<u32>,
    },
    Rain {
        sums: &'a [f64],
        cell_m2: f64,
        area_m2: f64,
    },
}

impl AtLeast<'_> {
    /// Whether a cell drains the area.
    #[must_use]
    #[inline(always)]
    pub fn has(&self, cell: usize) -> bool {
        match self {
            Self::Cells { cells, least } => least.is_some_and(|least| cells[cell] >= least),
            Self::Rain { sums, cell_m2, area_m2 } => sums[cell] * cell_m2 >= *area_m2,
        }
    }
}

/// What counts as the area of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scheme {
    /// What drains through it, and in headwaters the mean of that over the last steps.
    SingleGrid,
    /// Half a cell less, which is the mean along the cell, so that it depends less on the cells; and in headwaters the
    /// mean of all steps until those are many, as levels have few.
    Level,
}

/// Where rivers begin.
#[derive(Clone, Copy, Debug)]
pub struct Heads {
    /// Smaller areas cut as this one does.
    pub critical_m2: f64,
    /// A₀: what the debris flows of the headwaters are worth in drainage area.
    pub headwater_m2: f64,
    /// The exponent of the area.
    pub m: f64,
}

impl Heads {
    /// A₀ᵐ; 0 where A₀ is 0.
    #[must_use]
    pub fn power(&self) -> f64 {
        if self.headwater_m2 > 0.0 { math::pow(self.headwater_m2, self.m) } else { 0.0 }
    }
}

/// Rain as a share of the mean.
fn share(rain: f32) -> f64 {
    if rain > 0.0 { f64::from(rain) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_power_is_that_of_the_weighted_area_above_the_critical_one() {
        let law = Law::new(1.0);
        let heads = |critical_m2: f64| Heads { critical_m2, headwater_m2: 0.0, m: 0.5 };
        let even = |rain: f32, critical_m2: f64| {
            let mut area = Area::new(&law, 3, Lane::Constant(rain), 100.0, heads(critical_m2), Scheme::SingleGrid);
            area.drained = Drained::Cells(vec![1, 4, 40_000]);
            [0, 1, 2].map(|cell| area.power(&law, cell))
        };
        assert_eq!(even(1.0, 0.0), [10.0, 20.0, 2000.0]);
        assert_eq!(even(4.0, 0.0), [20.0, 40.0, 4000.0]);
        assert_eq!(even(0.0, 0.0), [0.0; 3]);
        assert_eq!(even(-3.0, 900.0), [30.0; 3]);
        let mut of_cells = Area::new(&law, 3, Lane::Constant(1.0), 100.0, heads(0.0), Scheme::SingleGrid);
        of_cells.drained = Drained::Cells(vec![15, 16, 40_000]);
        let rain = [1.0; 3];
        let mut uneven = Area::new(&law, 3, Lane::Samples(&rain), 100.0, heads(900.0), Scheme::SingleGrid);
        uneven.drained = Drained::Rain { sums: vec![0.0, 16.0, 40_000.0], rain: &rain };
        assert_eq!([0, 1, 2].map(|cell| uneven.power(&law, cell)), [30.0, 40.0, 2000.0]);
        assert_eq!(uneven.m2(1), 1600.0);
        for least_m2 in [0.0, 1600.0, 1600.1, 4e6, 1e20, f64::INFINITY] {
            for area in [&uneven, &of_cells] {
                let rivers = area.at_least(least_m2);
                assert_eq!([0, 1, 2].map(|cell| rivers.has(cell)), [0, 1, 2].map(|cell| area.m2(cell) >= least_m2));
            }
        }
    }

    /// Half of the ground is saturated where the given area drains, in proportion to A₀ᵐ where A₀ varies, and along a
    /// diagonal, where fewer cells drain through a cell, with less.
    #[test]
    fn ground_is_saturated_where_much_drains() {
        let heads = Heads { critical_m2: 0.0, headwater_m2: 1e4, m: 0.5 };
        let area = |scheme: Scheme| {
            let area = Area::new(&Law::new(1.0), 4, Lane::Constant(1.0), 100.0, heads, scheme);
            area.with_drained(vec![1, 9, 81, 4_000_000])
        };
        let straight = [0_u8; 4];
        let found = |area: &Area<'_>, codes: &[u8]| {
            let mut found = [0.0; 4];
            area.wetness(900.0, 20.0, codes, 0..4, &mut found);
            found
        };
        let single = area(Scheme::SingleGrid);
        assert_eq!(found(&single, &straight), [1.0 / 9.0, 1.0, 9.0, 20.0]);
        for (wetness, expected) in [(1.0 / 9.0, 0.1), (1.0, 0.5), (9.0, 0.9)] {
            assert!((single.saturated(900.0)(wetness) - expected).abs() < 1e-7, "{wetness}");
        }
        // half a cell less of what drains, and the whole is drier by three times as much
        let level = area(Scheme::Level);
        assert_eq!(found(&level, &straight)[..2], [0.5 / 9.0, 8.5 / 9.0]);
        assert!((level.saturated(900.0)(8.5 / 9.0) - 8.5 / 19.0).abs() < 1e-6);
        let diagonal = (0..8).find(|direction| code::is_diagonal(*direction)).expect("a diagonal") as u8;
        assert_eq!(found(&single, &[diagonal; 4])[1], std::f32::consts::SQRT_2);
        let mut varied = area(Scheme::SingleGrid);
        // (A₀ / mean)ᵐ is 9 in the second cell
        varied.vary_headwaters(math::ln(9.0), vec![0.0, 2.0, 0.0, 0.0]);
        let wetness = found(&varied, &straight);
        // 1e-6: the root of A₀ᵐ is kept in single precision
        assert!((wetness[1] - 1.0 / 9.0).abs() < 1e-6 && wetness[2] == 9.0, "{wetness:?}");
        // the mean of the last steps counts in headwaters: 1, then 0.15 of the way to 11
        let mut spread = area(Scheme::SingleGrid);
        spread.spread();
        spread = spread.with_drained(vec![11, 9, 81, 4_000_000]);
        spread.spread();
        let wetness = found(&spread, &straight);
        assert!((wetness[0] - 2.5 / 9.0).abs() < 1e-6 && wetness[1] == 1.0, "{wetness:?}");
    }

    /// Where A₀ is four times its mean, the law is (√A + 2 √A₀) / √2 of it, for any exponent n.
    #[test]
    fn long_hillslopes_have_hard_rock() {
        for n in [1.0, 1.3] {
            let law = Law::new(n);
            let heads = Heads { critical_m2: 0.0, headwater_m2: 1e4, m: 0.5 };
            let mut area = Area::new(&law, 2, Lane::Constant(1.0), 100.0, heads, Scheme::SingleGrid);
            area.drained = Drained::Cells(vec![400, 400]);
            let deviation = std::f64::consts::LN_2;
            area.vary_headwaters(deviation, vec![2.0, 0.0]);
            let harder = math::exp(HARDER * deviation * deviation);
            let expected = [400.0 / std::f64::consts::SQRT_2, 300.0];
            for (cell, expected) in expected.into_iter().enumerate() {
                let found = law.value(area.power(&law, cell)) * harder;
                // 1e-7: roots are kept in single precision
                assert!((found / expected - 1.0).abs() < 1e-7, "{n}, {cell}: {found} {expected}");
            }
        }
    }
}
