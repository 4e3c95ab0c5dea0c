//! What lies at a stratigraphic height: the lookup that every reader of [`Strata`](orograph_graph::Strata) uses.

use orograph_graph::{Column, Layer};

use super::math;

/// Sections of the column for each layer, at least: a lookup is one section and rarely more than one layer further.
const SECTIONS_PER_LAYER: usize = 4;
/// The fewest sections of a column.
const FEWEST_SECTIONS: usize = 64;

/// A column that can be looked up in constant time, whatever the number of its layers.
#[derive(Clone, Debug)]
pub struct Beds {
    /// Depth of the base of each layer below the top of the first, in metres.
    bases: Vec<f64>,
    /// The layer at the top of each section of equal thickness.
    sections: Vec<u32>,
    per_section: f64,
    top_m: f64,
    repeats: bool,
    cosine: f64,
    /// The mean hardness by thickness.
    pub mean_hardness: f64,
    /// One over the hardness of each layer.
    pub weakness: Vec<f64>,
    /// Tangent of the steepest slope of each layer; infinite for 90°.
    pub tangents: Vec<f64>,
}

/// A layer where it is in the column.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bed {
    /// Its number, from 0 for the first of the table.
    pub layer: usize,
    /// Stratigraphic height of its top, in metres; without end above the first layer.
    pub top_m: f64,
    /// Stratigraphic height of its base, in metres; without end below the last layer.
    pub base_m: f64,
}

impl Beds {
    /// The lookup of a column for processes: neighbours of equal hardness and steepest slope are one bed, so that
    /// contacts without a contrast change nothing.
    #[must_use]
    pub fn of_rock(column: &Column) -> Self {
        let mut layers: Vec<Layer> = Vec::new();
        for layer in &column.layers {
            match layers.last_mut() {
                Some(last) if last.hardness == layer.hardness && last.repose == layer.repose => {
                    last.thickness += layer.thickness;
                }
                _ => layers.push(*layer),
            }
        }
        let repeats = column.repeats && layers.len() > 1;
        Self::new(&layers, repeats, column)
    }

    /// The lookup of a column for its layers as they are.
    #[must_use]
    pub fn of_layers(column: &Column) -> Self {
        Self::new(&column.layers, column.repeats, column)
    }

    fn new(layers: &[Layer], repeats: bool, column: &Column) -> Self {
        let mut depth = 0.0;
        let bases: Vec<f64> = layers
            .iter()
            .map(|layer| {
                depth += layer.thickness;
                depth
            })
            .collect();
        let count = (SECTIONS_PER_LAYER * bases.len()).max(FEWEST_SECTIONS);
        let section_m = depth / count as f64;
        let layer_at = |section: usize| {
            let top = section as f64 * section_m;
            bases.partition_point(|base| *base <= top).min(bases.len() - 1) as u32
        };
        let tangent = |layer: &Layer| match layer.repose {
            repose if repose < 90.0 => math::tan(repose.to_radians()),
            _ => f64::INFINITY,
        };
        Self {
            sections: (0..count).map(layer_at).collect(),
            per_section: 1.0 / section_m,
            top_m: column.top_m,
            repeats,
            cosine: column.cosine,
            mean_hardness: layers.iter().map(|layer| layer.thickness * layer.hardness).sum::<f64>() / depth,
            weakness: layers.iter().map(|layer| 1.0 / layer.hardness).collect(),
            tangents: layers.iter().map(tangent).collect(),
            bases,
        }
    }

    /// One over the hardness of the softest layer.
    #[must_use]
    pub fn weakest(&self) -> f64 {
        self.weakness.iter().copied().fold(0.0, f64::max)
    }

    /// The mean of one over the hardness, by thickness.
    #[must_use]
    pub fn mean_weakness(&self) -> f64 {
        let tops = std::iter::once(&0.0).chain(&self.bases);
        let parts = self.bases.iter().zip(tops).zip(&self.weakness);
        parts.map(|((base, top), weakness)| (base - top) * weakness).sum::<f64>() / self.bases[self.bases.len() - 1]
    }

    /// The cosine of the dip: how much higher in the column a metre higher in the ground is.
    #[must_use]
    pub const fn cosine(&self) -> f64 {
        self.cosine
    }

    /// The layer at a stratigraphic height. A contact belongs to the layer below it.
    #[must_use]
    #[inline]
    pub fn at(&self, height_m: f64) -> Bed {
        let last = self.bases.len() - 1;
        let total = self.bases[last];
        let (mut depth, mut top_m) = (self.top_m - height_m, self.top_m);
        if self.repeats {
            let rounds = floor(depth / total);
            depth -= rounds * total;
            top_m -= rounds * total;
        }
        let section = ((depth.max(0.0) * self.per_section) as usize).min(self.sections.len() - 1);
        let mut layer = self.sections[section] as usize;
        while layer < last && self.bases[layer] <= depth {
            layer += 1;
        }
        self.bed(layer, top_m)
    }

    /// The layer below one.
    #[must_use]
    pub fn below(&self, bed: Bed) -> Bed {
        let last = self.bases.len() - 1;
        if bed.layer < last {
            return self.bed(bed.layer + 1, bed.base_m + self.bases[bed.layer]);
        }
        if self.repeats { self.bed(0, bed.base_m) } else { bed }
    }

    /// The layer above one.
    #[must_use]
    pub fn above(&self, bed: Bed) -> Bed {
        if bed.layer > 0 {
            return self.bed(bed.layer - 1, bed.top_m + self.bases[bed.layer - 1]);
        }
        let last = self.bases.len() - 1;
        if self.repeats { self.bed(last, bed.top_m + self.bases[last]) } else { bed }
    }

    /// A layer of the column whose first layer has its top at `top_m`.
    fn bed(&self, layer: usize, top_m: f64) -> Bed {
        let last = self.bases.len() - 1;
        let top = match layer {
            0 if !self.repeats => f64::INFINITY,
            0 => top_m,
            _ => top_m - self.bases[layer - 1],
        };
        let base = if !self.repeats && layer == last { f64::NEG_INFINITY } else { top_m - self.bases[layer] };
        Bed { layer, top_m: top, base_m: base }
    }
}

/// The largest whole number below or at `value`, which is less than 2⁶³ in magnitude.
///
/// `f64::floor` is a function call where kernels are compiled for machines without SSE 4.1.
#[inline(always)]
fn floor(value: f64) -> f64 {
    let whole = value as i64 as f64;
    if whole > value { whole - 1.0 } else { whole }
}

/// [`Beds`] under every cell.
#[derive(Clone, Copy, Debug)]
pub struct Ground<'a> {
    /// The column.
    pub beds: &'a Beds,
    /// What is subtracted in the stratigraphic height of each cell, in metres.
    pub offset: &'a [f32],
}

impl Ground<'_> {
    /// The layer of a cell at an elevation.
    #[must_use]
    #[inline]
    pub fn at(&self, cell: usize, elevation_m: f64) -> Bed {
        self.beds.at(self.beds.cosine * elevation_m - f64::from(self.offset[cell]))
    }

    /// The elevation of the top of a layer in a cell.
    #[must_use]
    pub fn top_m(&self, cell: usize, bed: Bed) -> f64 {
        let up = bed.top_m + f64::from(self.offset[cell]);
        if self.beds.cosine > 0.0 { up / self.beds.cosine } else { f64::INFINITY }
    }

    /// The elevation of the base of a layer in a cell.
    #[must_use]
    pub fn base_m(&self, cell: usize, bed: Bed) -> f64 {
        let up = bed.base_m + f64::from(self.offset[cell]);
        if self.beds.cosine > 0.0 { up / self.beds.cosine } else { f64::NEG_INFINITY }
    }

    /// One over the hardness of a cell at an elevation.
    #[must_use]
    #[inline]
    pub fn weakness(&self, cell: usize, elevation_m: f64) -> f64 {
        self.beds.weakness[self.at(cell, elevation_m).layer]
    }

    /// The tangent of the steepest slope of a cell at an elevation.
    #[must_use]
    #[inline]
    pub fn tangent(&self, cell: usize, elevation_m: f64) -> f64 {
        self.beds.tangents[self.at(cell, elevation_m).layer]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn column(thicknesses: &[f64], repeats: bool) -> Column {
        let layers = thicknesses.iter().map(|&thickness| Layer { thickness, ..Layer::USUAL }).collect();
        Column { layers, top_m: 100.0, repeats, cosine: 1.0 }
    }

    #[test]
    fn heights_have_the_layer_of_the_table() {
        let extended = Beds::of_layers(&column(&[10.0, 30.0, 5.0], false));
        for (height, layer, top, base) in [
            (1e6, 0, f64::INFINITY, 90.0),
            (100.0, 0, f64::INFINITY, 90.0),
            (90.1, 0, f64::INFINITY, 90.0),
            (90.0, 1, 90.0, 60.0),
            (60.1, 1, 90.0, 60.0),
            (60.0, 2, 60.0, f64::NEG_INFINITY),
            (-1e6, 2, 60.0, f64::NEG_INFINITY),
        ] {
            assert_eq!(extended.at(height), Bed { layer, top_m: top, base_m: base }, "{height}");
        }
        let repeated = Beds::of_layers(&column(&[10.0, 30.0, 5.0], true));
        for (height, layer, top, base) in [
            (100.0, 0, 100.0, 90.0),
            (55.0, 0, 55.0, 45.0),
            (55.1, 2, 60.0, 55.0),
            (100.1, 2, 105.0, 100.0),
            (-350.0, 0, -350.0, -360.0),
        ] {
            assert_eq!(repeated.at(height), Bed { layer, top_m: top, base_m: base }, "{height}");
        }
    }

    #[test]
    fn layers_of_equal_rock_are_one_bed() {
        for repeats in [false, true] {
            let beds = Beds::of_rock(&column(&[10.0; 200], repeats));
            assert_eq!(beds.at(-700.0), Bed { layer: 0, top_m: f64::INFINITY, base_m: f64::NEG_INFINITY });
        }
        let mut banded = column(&[10.0, 20.0, 30.0, 40.0], false);
        banded.layers[2].hardness = 5.0;
        let beds = Beds::of_rock(&banded);
        assert_eq!(beds.at(95.0), Bed { layer: 0, top_m: f64::INFINITY, base_m: 70.0 });
        assert_eq!(beds.at(69.0), Bed { layer: 1, top_m: 70.0, base_m: 40.0 });
    }

    #[test]
    fn a_walk_down_finds_what_a_lookup_finds() {
        let thicknesses: Vec<f64> = (0..997_u32).map(|k| 0.01 + f64::from(k * 7919 % 1000) / 8.0).collect();
        for repeats in [false, true] {
            let beds = Beds::of_layers(&column(&thicknesses, repeats));
            let mut bed = beds.at(150.0);
            for _ in 0..2500 {
                let below = beds.below(bed);
                if below == bed {
                    assert!(!repeats && bed.layer == 996);
                    break;
                }
                // a hair below the contact, because sums of thicknesses are rounded
                let found = beds.at(bed.base_m - 1e-6);
                assert!(found.layer == below.layer && (found.base_m - below.base_m).abs() < 1e-6 || found == below);
                let above = beds.above(below);
                assert!(above.layer == bed.layer && (above.base_m - bed.base_m).abs() < 1e-6, "{above:?} {bed:?}");
                bed = below;
            }
        }
    }
}
