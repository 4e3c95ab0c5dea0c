//! An inset: a part of the terrain at finer cells.
//!
//! Along its edge the inset is blended with the coarse terrain over a band: heights, depths of water, colours and mask
//! here, slopes and shadows in the shaders (`shaders/view/inset.wgsl`). On the edge itself it equals the coarse
//! terrain, so that there is no step. A side on the edge of the terrain has no band.

use glam::DVec3;
use orograph_graph::Field;
use rayon::prelude::*;

use super::{
    bounds::{Bounds, LEAF},
    camera::Ray,
    error::ViewError,
    ray::Hit,
    terrain::{Cover, MOST_CELLS, Terrain},
};
use crate::export::samples::Samples;

/// Width of the band in coarse cells.
const BAND_CELLS: f64 = 3.0;
/// Maximum width of the band as a fraction of the shorter side of the inset.
const MOST_OF_SIDE: f64 = 0.125;
/// Maximum density of grid lines relative to the coarse ones, as a power of two.
const MOST_FINER: u32 = 8;
/// Position of a side without a band, in cells: far away.
const NO_SIDE: f64 = 1e9;

/// A part of a terrain at finer cells, blended with it along its edge.
#[derive(Clone, Debug)]
pub struct Inset {
    /// The part, after blending.
    terrain: Terrain,
    /// Offset in metres from the north-west corner of the terrain to that of the inset.
    corner: [f64; 2],
    /// Positions of the sides with a band, in cells of the inset: west, north, east, south.
    sides: [f64; 4],
    /// Width of the band in cells of the inset.
    band: f64,
    /// Grid lines per coarse cell, as a power of two.
    finer: u32,
    /// Bounds of the terrain including the inset.
    bounds: Bounds,
}

impl Inset {
    /// Blends a part with the terrain. Both have the same optional fields ([`Cover`]).
    ///
    /// # Errors
    /// When the part has more cells than can be drawn, is not within the terrain, or has other fields.
    pub fn new(coarse: &Terrain, part: &Terrain) -> Result<Self, ViewError> {
        let (outer, inner) = (coarse.height().window(), part.height().window());
        let (wide, fine) = (outer.cell_m(), inner.cell_m());
        let corner_of = |window: &orograph_graph::Window| window.origin.map(|cells| f64::from(cells) * window.cell_m());
        let corner = [0, 1].map(|axis| corner_of(inner)[axis] - corner_of(outer)[axis]);
        let end = [0, 1].map(|axis| corner[axis] + part.size_m()[axis]);
        let size = coarse.size_m();
        let within = (0..2).all(|axis| corner[axis] >= -fine && end[axis] <= size[axis] + wide);
        let cells = inner.cells;
        if !within || fine > wide || cells.into_iter().max() > Some(MOST_CELLS) || cells.into_iter().min() < Some(2) {
            return Err(ViewError::Terrain("the finer part is not within the terrain".to_owned()));
        }
        let last = cells.map(|cells| f64::from(cells) - 0.5);
        // a side within one cell of the edge of the terrain
        let side = |axis: usize| if corner[axis] < fine { -NO_SIDE } else { 0.5 };
        let far_side = |axis: usize| if end[axis] > size[axis] - fine { NO_SIDE } else { last[axis] };
        let shorter = f64::from(cells[0].min(cells[1]));
        let mut inset = Self {
            terrain: part.clone(),
            corner,
            sides: [side(0), side(1), far_side(0), far_side(1)],
            band: (BAND_CELLS * wide / fine).min(MOST_OF_SIDE * shorter),
            finer: (0..MOST_FINER).find(|power| wide < fine * f64::from(1_u32 << *power) * 1.001).unwrap_or(MOST_FINER),
            bounds: coarse.bounds().clone(),
        };
        let joined = |coarse: Option<&Field>, part: Option<&Field>| match (coarse, part) {
            (Some(coarse), Some(part)) => Ok(Some(inset.joined(coarse, part))),
            (None, None) => Ok(None),
            _ => Err(ViewError::Terrain("the finer part and the terrain have different fields".to_owned())),
        };
        let colour = joined(coarse.colour(), part.colour())?;
        let water = joined(coarse.water(), part.water())?;
        let mask = joined(coarse.mask(), part.mask())?;
        let lines = joined(coarse.lines(), part.lines())?;
        let cover =
            Cover { colour: colour.as_ref(), water: water.as_ref(), mask: mask.as_ref(), lines: lines.as_ref() };
        inset.terrain = Terrain::new(&inset.joined(coarse.height(), part.height()))?.covered(cover)?;
        inset.bounds = inset.widened(coarse);
        Ok(inset)
    }

    /// The weight of the inset at a position in its cells: 0 on a side, 1 beyond the band.
    fn share(&self, [x, y]: [f64; 2]) -> f64 {
        let [west, north, east, south] = self.sides;
        let near = (x - west).min(east - x).min(y - north).min(south - y);
        let t = (near / self.band).clamp(0.0, 1.0);
        t * t * (3.0 - 2.0 * t)
    }

    /// A field of the part, blended with that of the coarse terrain.
    fn joined(&self, coarse: &Field, part: &Field) -> Field {
        let window = *part.window();
        let (fine, wide) = (window.cell_m(), coarse.window().cell_m());
        let (nx, ny) = (window.nx(), window.ny());
        let sampler = Samples::of(coarse);
        let planes = part.planes().min(coarse.planes());
        let rows = (0..planes * ny).into_par_iter().flat_map_iter(|row| {
            let (plane, j) = (row / ny, row % ny);
            let sampler = &sampler;
            (0..nx).map(move |i| {
                let own = part.plane(plane)[j * nx + i];
                let place = [i as f64 + 0.5, j as f64 + 0.5];
                let share = self.share(place) as f32;
                if share >= 1.0 {
                    return own;
                }
                let at = [0, 1].map(|axis| (self.corner[axis] + place[axis] * fine) / wide - 0.5);
                let around = sampler.at(plane, at);
                around + share * (own - around)
            })
        });
        Field::with_planes(window, planes, rows.collect())
    }

    /// Bounds of the coarse terrain, widened by the heights of the inset.
    fn widened(&self, coarse: &Terrain) -> Bounds {
        let ratio = coarse.cell_m() / self.terrain.cell_m();
        let [nx, ny] = self.terrain.cells();
        let top = |x: u32, y: u32| {
            let at = y as usize * nx as usize + x as usize;
            let depth = self.terrain.water().map_or(0.0, |water| water.plane(0)[at].max(0.0));
            self.terrain.height().plane(0)[at] + depth
        };
        // cells of the inset that affect the surface between two grid lines of the coarse terrain
        let span = |axis: usize, square: usize| {
            let side = f64::from(1_u32 << LEAF);
            let corner = self.corner[axis] / self.terrain.cell_m();
            let line = |line: f64| (line - 0.5) * ratio - corner;
            let first = (line(square as f64 * side) - 1.5).floor().max(0.0) as u32;
            let end = (line((square + 1) as f64 * side) + 1.5).ceil();
            first..(end.max(0.0) as u32).min([nx, ny][axis])
        };
        coarse.bounds().widened(|i, j| {
            let (columns, rows) = (span(0, i), span(1, j));
            let all = rows.flat_map(|y| columns.clone().map(move |x| top(x, y)));
            let range = all.fold([f32::INFINITY, f32::NEG_INFINITY], |[lo, hi], v| [lo.min(v), hi.max(v)]);
            (range[0] <= range[1]).then_some(range)
        })
    }

    /// The rectangle that the inset covers, in metres from the corner of the terrain: west, north, east, south. A side
    /// runs through the centres of the outermost cells, where the inset equals the coarse terrain, or beyond the edge
    /// of the terrain.
    #[must_use]
    pub fn rectangle(&self) -> [f64; 4] {
        [0, 1, 2, 3].map(|side| self.corner[side % 2] + self.sides[side] * self.terrain.cell_m())
    }

    /// Returns true if the inset covers a position in metres from the corner of the terrain.
    #[must_use]
    pub fn covers(&self, [x, y]: [f64; 2]) -> bool {
        let [west, north, east, south] = self.rectangle();
        (west..east).contains(&x) && (north..south).contains(&y)
    }

    /// The first hit of a ray on the terrain including the inset. A hit on the inset has the cell of the inset.
    #[must_use]
    pub fn cast(&self, coarse: &Terrain, ray: &Ray, exaggeration: f64) -> Option<Hit> {
        let corner = DVec3::new(self.corner[0], 0.0, self.corner[1]);
        let own = self.terrain.cast(&Ray { origin: ray.origin - corner, ..*ray }, exaggeration).map(|hit| {
            let place = [0, 1].map(|axis| hit.place[axis] + self.corner[axis]);
            Hit { place, ..hit }
        });
        let around = coarse.cast(ray, exaggeration);
        match (own.filter(|hit| self.covers(hit.place)), around) {
            (Some(own), Some(around)) if around.distance < own.distance && !self.covers(around.place) => Some(around),
            (own, around) => own.or(around),
        }
    }

    /// The height at a position of the terrain including the inset.
    #[must_use]
    pub fn height_at(&self, coarse: &Terrain, place: [f64; 2]) -> f64 {
        if self.covers(place) {
            return self.terrain.height_at([0, 1].map(|axis| place[axis] - self.corner[axis]));
        }
        coarse.height_at(place)
    }

    pub(super) const fn terrain(&self) -> &Terrain {
        &self.terrain
    }

    pub(super) const fn corner(&self) -> [f64; 2] {
        self.corner
    }

    pub(super) const fn sides(&self) -> [f64; 4] {
        self.sides
    }

    pub(super) const fn band(&self) -> f64 {
        self.band
    }

    pub(super) const fn finer(&self) -> u32 {
        self.finer
    }

    pub(super) const fn bounds(&self) -> &Bounds {
        &self.bounds
    }
}

#[cfg(test)]
mod tests {
    use orograph_graph::{Window, World};

    use super::*;
    use crate::testing::field;

    fn slope(x: f64, y: f64) -> f64 {
        100.0 + 0.3 * x - 0.2 * y
    }

    /// A part of a world of 64 x 64 cells of 10 m, at cells of 2.5 m.
    fn part(origin: [u32; 2], cells: [u32; 2], value: impl Fn(f64, f64) -> f64) -> Terrain {
        let world = World { size: [640.0; 2], cells: [256; 2], ..World::default() };
        let window = Window { world, origin, cells };
        let samples = (0..window.len()).map(|at| {
            let [x, y] = window.centre_m(at % window.nx(), at / window.nx());
            value(x, y) as f32
        });
        Terrain::new(&Field::new(window, samples.collect())).expect("heights")
    }

    fn coarse() -> Terrain {
        Terrain::new(&field([64, 64], 10.0, slope)).expect("heights")
    }

    #[test]
    fn a_part_is_the_coarse_land_on_its_edge_and_itself_inside() {
        let inset = Inset::new(&coarse(), &part([64, 96], [128, 96], |x, y| slope(x, y) + 20.0)).expect("a part");
        assert_eq!((inset.finer(), inset.rectangle()), (2, [161.25, 241.25, 478.75, 478.75]));
        let above = |[x, y]: [f64; 2]| inset.height_at(&coarse(), [x, y]) - slope(x, y);
        for edge in [[161.25, 300.0], [478.74, 300.0], [300.0, 241.25], [300.0, 478.74], [100.0, 100.0]] {
            assert!(above(edge).abs() < 0.01, "{edge:?}: {}", above(edge));
        }
        assert!((above([320.0, 360.0]) - 20.0).abs() < 1e-3 && (2.0..18.0).contains(&above([176.0, 360.0])));
        let [low, high] = inset.bounds().range(0, 4, 4).expect("a square");
        // between 315 m and 395 m: the coarse terrain is below, the inset above
        assert!(f64::from(low) < slope(320.0, 390.0) && f64::from(high) > slope(390.0, 320.0) + 19.0);
    }

    #[test]
    fn a_part_on_the_lands_edge_has_no_band_there() {
        let inset = Inset::new(&coarse(), &part([0, 96], [128, 160], |x, y| slope(x, y) + 20.0)).expect("a part");
        let [west, _, east, south] = inset.rectangle();
        assert!(west < 0.0 && south > 640.0 && (east - 318.75).abs() < 1e-9);
        assert!((inset.height_at(&coarse(), [2.0, 500.0]) - slope(2.0, 500.0) - 20.0).abs() < 0.5);
    }

    #[test]
    fn a_ray_meets_the_part_where_it_lies() {
        let coarse = coarse();
        let inset = Inset::new(&coarse, &part([64, 96], [128, 96], |x, y| slope(x, y) + 20.0)).expect("a part");
        for (target, more) in [([320.0, 360.0], 20.0), ([60.0, 100.0], 0.0)] {
            let eye = DVec3::new(330.0, 900.0, 500.0);
            let place = DVec3::new(target[0], slope(target[0], target[1]) + more, target[1]);
            let ray = Ray { origin: eye, direction: (place - eye).normalize() };
            let hit = inset.cast(&coarse, &ray, 1.0).expect("meets");
            assert!((hit.place[0] - target[0]).abs() < 0.05 && (hit.place[1] - target[1]).abs() < 0.05, "{hit:?}");
            assert!((hit.height - place.y).abs() < 0.05);
        }
    }

    #[test]
    fn what_is_no_part_is_refused() {
        let other = Terrain::new(&field([64, 64], 100.0, slope)).expect("heights");
        assert!(Inset::new(&coarse(), &other).is_err());
        let wet = part([64, 96], [128, 96], slope);
        let depth = wet.height().clone();
        let wet = wet.covered(Cover { water: Some(&depth), ..Cover::default() }).expect("fits");
        assert!(Inset::new(&coarse(), &wet).is_err());
    }
}
