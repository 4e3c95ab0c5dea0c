//! The hardness of the rock below each cell of a band.
//!
//! It is looked up again only where the surface of the rock has come near the top or the base of its layer.

use crate::numerics::beds::Ground;

/// Cells that are checked together.
const CHUNK: usize = 64;
/// No layer is trusted so near to its top and base, in metres, and in parts of their elevation: more than their rounding.
const MARGIN_M: f64 = 0.01;
const MARGIN: f64 = 1e-6;
/// The least cosine of the dip at which layers are trusted: elevations of contacts of steeper ones are too inexact.
const LEAST_COSINE: f64 = 1e-6;

/// What the last lookup of each cell found.
#[derive(Debug)]
pub(super) struct Contacts {
    nx: usize,
    /// Elevations of the surface of the rock between which the lookup is known to find the same layer.
    lows: Vec<f32>,
    highs: Vec<f32>,
    weakness: Vec<f32>,
}

impl Contacts {
    /// `rows` rows of `nx` cells of which nothing is known.
    pub fn new(nx: usize, rows: usize) -> Self {
        let cells = nx * rows;
        Self { nx, lows: vec![f32::INFINITY; cells], highs: vec![f32::NEG_INFINITY; cells], weakness: vec![1.0; cells] }
    }

    /// One over the hardness of the rock below the `loose` ground of a bed, in a row of the band that is `world_row` of
    /// the world.
    pub fn weakness(
        &mut self,
        row: usize,
        world_row: usize,
        ground: &Ground<'_>,
        bed: &[f32],
        loose: &[f32],
    ) -> &[f32] {
        let cells = row * self.nx..(row + 1) * self.nx;
        let lows = self.lows[cells.clone()].chunks_mut(CHUNK);
        let highs = self.highs[cells.clone()].chunks_mut(CHUNK);
        let weakness = self.weakness[cells.clone()].chunks_mut(CHUNK);
        let surface = bed.chunks(CHUNK).zip(loose.chunks(CHUNK));
        for (k, (((lows, highs), weakness), (bed, loose))) in lows.zip(highs).zip(weakness).zip(surface).enumerate() {
            if all_within(lows, highs, bed, loose) {
                continue;
            }
            let first = world_row * self.nx + k * CHUNK;
            let bounds = lows.iter_mut().zip(highs).zip(weakness);
            for (i, (((low, high), weakness), (bed, loose))) in bounds.zip(bed.iter().zip(loose)).enumerate() {
                let rock = bed - loose;
                // false for NaN too
                if rock > *low && rock < *high {
                    continue;
                }
                let found = ground.at(first + i, f64::from(rock));
                *weakness = ground.beds.weakness[found.layer] as f32;
                if ground.beds.cosine() < LEAST_COSINE {
                    continue;
                }
                let margin = |elevation_m: f64| MARGIN_M + MARGIN * elevation_m.abs();
                let (base_m, top_m) = (ground.base_m(first + i, found), ground.top_m(first + i, found));
                *low = if base_m.is_finite() { (base_m + margin(base_m)) as f32 } else { base_m as f32 };
                *high = if top_m.is_finite() { (top_m - margin(top_m)) as f32 } else { top_m as f32 };
            }
        }
        &self.weakness[cells]
    }
}

/// True if the surface of the rock is between the bounds of its cell everywhere.
fn all_within(lows: &[f32], highs: &[f32], bed: &[f32], loose: &[f32]) -> bool {
    let n = bed.len();
    let (lows, highs, loose) = (&lows[..n], &highs[..n], &loose[..n]);
    let mut within = true;
    for i in 0..n {
        let rock = bed[i] - loose[i];
        within &= (rock > lows[i]) & (rock < highs[i]);
    }
    within
}

#[cfg(test)]
mod tests {
    use orograph_graph::{Column, Layer};

    use super::*;
    use crate::numerics::beds::Beds;

    /// Surfaces that wander through a column of rock have the hardness of a lookup in each step, to the bit, whatever
    /// the dip and the thickness of its layers.
    #[test]
    fn what_is_kept_is_what_a_lookup_finds() {
        let mut state = 9_u32;
        let mut random = move || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(state >> 8) / f64::from(1 << 24)
        };
        let (nx, rows) = (100, 2);
        for (thickest_m, cosine, repeats) in
            [(30.0, 1.0, false), (30.0, 0.8, true), (1e-3, 1.0, false), (200.0, 1e-6, false), (200.0, 6e-17, true)]
        {
            let layer = |k: u32, random: f64| Layer {
                thickness: thickest_m * (0.1 + random),
                hardness: f64::from(k + 1),
                ..Layer::USUAL
            };
            let layers: Vec<Layer> = (0..12).map(|k| layer(k, random())).collect();
            let beds = Beds::of_rock(&Column { layers, top_m: 100.0, repeats, cosine });
            // contacts lie at the first of every ten cells, whatever the dip
            let contact = beds.at(60.0).base_m;
            let place = |cell: usize, random: f64| {
                if cell.is_multiple_of(10) { -contact as f32 } else { (40.0 * random - 20.0) as f32 }
            };
            let offset: Vec<f32> = (0..nx * rows).map(|cell| place(cell, random())).collect();
            let ground = Ground { beds: &beds, offset: &offset };
            let mut contacts = Contacts::new(nx, rows);
            let mut bed: Vec<f32> = (0..nx).map(|_| (200.0 * random() - 50.0) as f32).collect();
            let loose: Vec<f32> = (0..nx).map(|_| random() as f32).collect();
            bed[7] = f32::NAN;
            for step in 0..300 {
                let found = contacts.weakness(1, 1, &ground, &bed, &loose);
                for i in 0..nx {
                    let expected = ground.weakness(nx + i, f64::from(bed[i] - loose[i])) as f32;
                    assert_eq!(found[i].to_bits(), expected.to_bits(), "{cosine} {thickest_m}: step {step}, cell {i}");
                }
                bed.iter_mut().for_each(|bed| *bed += (4.0 * random() - 2.1) as f32);
            }
        }
    }
}
