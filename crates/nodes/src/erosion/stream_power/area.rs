//! Drainage area, weighted by rain, and its power in the law.

use super::incision::Law;
use crate::{
    hydrology::engine::{Drainage, Grid},
    math,
    prelude::*,
};

/// Drainage area of every cell. Where it rains p times the mean, a cell counts p times: discharge over the mean rain.
#[derive(Debug)]
pub struct Area<'a> {
    drained: Drained<'a>,
    /// m² of a cell that counts once.
    cell_m2: f64,
    critical_m2: f64,
    m: f64,
    /// Aᵐ by number of cells where rain is even. Nearly all cells drain few others: theirs are computed beforehand.
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
    /// Areas of `cells` cells, unknown until [`Self::accumulate`]. The power `m` is that of `critical_m2` below it.
    #[must_use]
    pub fn new(law: &Law, cells: usize, rain: Lane<'a>, cell_m2: f64, critical_m2: f64, m: f64) -> Self {
        let mut area = match rain {
            Lane::Constant(rain) => {
                let drained = Drained::Cells(vec![0; cells]);
                Self { drained, cell_m2: cell_m2 * share(rain), critical_m2, m, powers: Vec::new() }
            }
            Lane::Samples(rain) => {
                let drained = Drained::Rain { sums: vec![0.0; cells], rain };
                Self { drained, cell_m2, critical_m2, m, powers: Vec::new() }
            }
        };
        if matches!(area.drained, Drained::Cells(_)) {
            area.powers = (0..4096).map(|cells| area.compute(law, f64::from(cells.max(1)))).collect();
        }
        area
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

    /// The factor Aᵐ of the law, as a coefficient.
    #[must_use]
    #[inline(always)]
    pub fn power(&self, law: &Law, cell: usize) -> f64 {
        match &self.drained {
            Drained::Cells(cells) => {
                let cells = cells[cell];
                self.powers.get(cells as usize).copied().unwrap_or_else(|| self.compute(law, f64::from(cells)))
            }
            Drained::Rain { sums, .. } => self.compute(law, sums[cell]),
        }
    }

    fn compute(&self, law: &Law, drained: f64) -> f64 {
        law.coefficient(math::pow((drained * self.cell_m2).max(self.critical_m2), self.m))
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
        let even = |rain: f32, critical_m2: f64| {
            let mut area = Area::new(&law, 3, Lane::Constant(rain), 100.0, critical_m2, 0.5);
            area.drained = Drained::Cells(vec![1, 4, 40_000]);
            [0, 1, 2].map(|cell| area.power(&law, cell))
        };
        assert_eq!(even(1.0, 0.0), [10.0, 20.0, 2000.0]);
        assert_eq!(even(4.0, 0.0), [20.0, 40.0, 4000.0]);
        assert_eq!(even(0.0, 0.0), [0.0; 3]);
        assert_eq!(even(-3.0, 900.0), [30.0; 3]);
        let rain = [1.0; 3];
        let mut uneven = Area::new(&law, 3, Lane::Samples(&rain), 100.0, 900.0, 0.5);
        uneven.drained = Drained::Rain { sums: vec![0.0, 16.0, 40_000.0], rain: &rain };
        assert_eq!([0, 1, 2].map(|cell| uneven.power(&law, cell)), [30.0, 40.0, 2000.0]);
        assert_eq!(uneven.m2(1), 1600.0);
    }
}
