//! What the law needs to know of the link from a cell to its receiver.

use super::{area::Area, bedrock::Bedrock, ground::Ground, incision::Law, rock::Rock, winding::Winding};
use crate::numerics::{
    math,
    routing::{Grid, code, receivers},
};

/// The links of one step.
pub struct Links<'a> {
    law: &'a Law,
    rock: &'a Rock<'a>,
    area: &'a Area<'a>,
    tangents: &'a [u8],
    /// By direction of steepest descent, for links across a side and across a corner.
    lengths_m: [[f64; 256]; 2],
    /// Δt / dⁿ in the same order.
    bases: [[f64; 256]; 2],
    /// K Δt / dⁿ as a coefficient, where K is the same everywhere.
    everywhere: Option<[[f64; 256]; 2]>,
    /// Where rock is layered.
    bedrock: Option<&'a Bedrock<'a>>,
    /// Where slopes are rough: the ground and the cells that it lies on.
    rough: Option<(&'a Ground, &'a Grid)>,
    /// Where rivers wind: what makes them.
    winding: Option<&'a Winding>,
}

impl<'a> Links<'a> {
    /// Links of cells of `cell_m` for a step of `step_yr` and the slope exponent `n`. `tangents` are the directions of
    /// steepest descent of random receivers; without them links are as long as the way to the receiver's centre.
    #[must_use]
    pub fn new(
        law: &'a Law,
        rock: &'a Rock<'a>,
        area: &'a Area<'a>,
        tangents: &'a [u8],
        cell_m: f64,
        step_yr: f64,
        n: f64,
    ) -> Self {
        let lengths_m = [false, true].map(|diagonal| {
            std::array::from_fn::<_, 256, _>(|tangent| cell_m * receivers::length(diagonal, tangent as u8))
        });
        let bases = lengths_m.map(|row| row.map(|length_m| step_yr / math::pow(length_m, n)));
        let everywhere = rock.everywhere().map(|k| bases.map(|row| row.map(|base| law.coefficient(k * base))));
        Self { law, rock, area, tangents, lengths_m, bases, everywhere, bedrock: None, rough: None, winding: None }
    }

    /// The same links in layers of rock.
    #[must_use]
    pub fn in_layers(self, bedrock: Option<&'a Bedrock<'a>>) -> Self {
        Self { bedrock, ..self }
    }

    /// The same links on rough ground.
    #[must_use]
    pub fn on_ground(self, ground: &'a Ground, grid: &'a Grid) -> Self {
        Self { rough: (!ground.is_even()).then_some((ground, grid)), ..self }
    }

    /// The same links where rivers wind.
    #[must_use]
    pub fn of_beds(self, winding: &'a Winding) -> Self {
        Self { winding: Some(winding), ..self }
    }

    /// How much steeper the ground makes the way of a cell to its receiver; 1 without a receiver.
    #[must_use]
    #[inline(always)]
    pub fn steeper(&self, cell: usize, code: u8) -> f64 {
        match self.rough {
            Some((ground, grid)) if code::has_receiver(code) => {
                let [diagonal, along] = self.way(cell, code);
                let length_m = self.lengths_m[diagonal][along];
                ground.steeper(cell, grid.receiver(cell as u32, code) as usize, length_m)
            }
            _ => 1.0,
        }
    }

    /// Where a link is in the tables: whether it is diagonal, and its direction of steepest descent.
    #[inline(always)]
    fn way(&self, cell: usize, code: u8) -> [usize; 2] {
        let diagonal = usize::from(code::is_diagonal(code::direction(code)));
        match self.tangents.get(cell) {
            Some(tangent) if code & code::TURNED == 0 => [diagonal, usize::from(*tangent)],
            _ => [diagonal, 255 * diagonal],
        }
    }

    /// The coefficient C = K Aᵐ Δt / dⁿ of a cell's link, as [`Law::left`] takes it, and in metres the
    /// length over which an even slope would drop as far as the link does: d, on rough ground longer or shorter.
    #[must_use]
    #[inline(always)]
    pub fn of(&self, cell: usize, code: u8) -> (f64, f64) {
        let [diagonal, along] = self.way(cell, code);
        let without_area = match &self.everywhere {
            Some(coefficients) => coefficients[diagonal][along],
            None => self.law.coefficient(self.rock.erodibility(cell) * self.bases[diagonal][along]),
        };
        let coefficient = self.law.times(without_area, self.area.power(self.law, cell));
        let coefficient = match self.bedrock {
            Some(bedrock) => self.law.times(coefficient, self.law.coefficient(bedrock.weakness(cell))),
            None => coefficient,
        };
        let coefficient = self.rock.vary(self.law, cell, coefficient);
        let coefficient = match self.winding {
            Some(winding) => winding.vary(self.law, cell, self.area.m2(cell), coefficient),
            None => coefficient,
        };
        let length_m = self.lengths_m[diagonal][along];
        if self.rough.is_none() {
            return (coefficient, length_m);
        }
        let steeper = self.steeper(cell, code);
        (self.law.times(coefficient, self.law.coefficient(1.0 / steeper)), length_m * steeper)
    }
}
