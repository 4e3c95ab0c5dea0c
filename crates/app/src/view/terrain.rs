//! The terrain that the 3D view draws.

use glam::{DVec2, DVec3};
use orograph_graph::{Field, Window};

use super::{
    bounds::{Bounds, LEAF},
    camera::Ray,
    error::ViewError,
    ray::{Hit, Surface, in_grid},
};
use crate::export::picture;

/// Maximum number of cells along a side, which every graphics device supports. Larger terrain is reduced by averaging
/// blocks of cells.
pub(super) const MOST_CELLS: u32 = 8192;

/// The terrain to draw: heights, and optionally what lies on them, of the same window.
#[derive(Clone, Debug)]
pub struct Terrain {
    height: Field,
    colour: Option<Field>,
    water: Option<Field>,
    mask: Option<Field>,
    /// The fraction of each cell that lines cover.
    lines: Option<Field>,
    ground: Bounds,
    /// Bounds including the water, if there is any.
    surface: Option<Bounds>,
    range: [f64; 2],
    /// The original window, before cells are merged.
    window: Window,
}

/// What lies on a terrain, each of the window of its heights.
#[derive(Clone, Copy, Debug, Default)]
pub struct Cover<'a> {
    /// Colours: linear RGB, three planes.
    pub colour: Option<&'a Field>,
    /// Depths of water in metres.
    pub water: Option<&'a Field>,
    /// A mask, drawn over the colours.
    pub mask: Option<&'a Field>,
    /// The fraction of each cell that lines cover, drawn over the colours.
    pub lines: Option<&'a Field>,
}

impl Terrain {
    /// A terrain from heights.
    ///
    /// # Errors
    /// When a height is not a number.
    pub fn new(height: &Field) -> Result<Self, ViewError> {
        let window = *height.window();
        let height = picture::shrunk(height, MOST_CELLS);
        let finite = height.plane(0).iter().all(|h| h.is_finite());
        let Some((low, high)) = height.range(0).filter(|_| finite) else {
            return Err(ViewError::Terrain("some heights are not numbers".to_owned()));
        };
        let ground = bounds(&height, None);
        let range = [low, high].map(f64::from);
        Ok(Self { height, colour: None, water: None, mask: None, lines: None, ground, surface: None, range, window })
    }

    /// Adds what lies on it.
    ///
    /// # Errors
    /// When a field has another window.
    pub fn covered(mut self, cover: Cover<'_>) -> Result<Self, ViewError> {
        let Cover { colour, water, mask, lines } = cover;
        self.colour = colour.map(|colour| self.fitted(colour, 3, "colours")).transpose()?;
        self.water = water.map(|depth| self.fitted(depth, 1, "water depths")).transpose()?;
        self.mask = mask.map(|mask| self.fitted(mask, 1, "a mask")).transpose()?;
        self.lines = lines.map(|lines| self.fitted(lines, 1, "lines")).transpose()?;
        self.surface = self.water.as_ref().map(|water| bounds(&self.height, Some(water)));
        Ok(self)
    }

    fn fitted(&self, field: &Field, planes: usize, what: &str) -> Result<Field, ViewError> {
        if field.window().cells != self.window.cells || field.planes() != planes {
            let [nx, ny] = self.window.cells;
            let [mx, my] = field.window().cells;
            return Err(ViewError::Terrain(format!("{what} of {mx} x {my} cells do not fit heights of {nx} x {ny}")));
        }
        Ok(picture::shrunk(field, MOST_CELLS))
    }

    /// Drawn cells along x and y.
    #[must_use]
    pub const fn cells(&self) -> [u32; 2] {
        self.height.window().cells
    }

    /// Side of a drawn cell in metres.
    #[must_use]
    pub fn cell_m(&self) -> f64 {
        self.height.window().cell_m()
    }

    /// Extent in metres from west to east and from north to south.
    #[must_use]
    pub fn size_m(&self) -> [f64; 2] {
        self.cells().map(|n| f64::from(n) * self.cell_m())
    }

    /// Lowest and highest height in metres.
    #[must_use]
    pub const fn range(&self) -> [f64; 2] {
        self.range
    }

    /// The centre of the terrain, at half its relief.
    #[must_use]
    pub fn middle(&self, exaggeration: f64) -> DVec3 {
        let [w, h] = self.size_m();
        DVec3::new(0.5 * w, 0.5 * (self.range[0] + self.range[1]) * exaggeration, 0.5 * h)
    }

    /// The elevation of the bottom of the walls in metres: a tenth of the extent below the lowest height, or a fraction
    /// of the relief if that is more.
    #[must_use]
    pub fn base(&self, exaggeration: f64) -> f64 {
        let [w, h] = self.size_m();
        let relief = self.range[1] - self.range[0];
        self.range[0] - (0.035 * w.max(h) / exaggeration.max(1e-9)).max(0.12 * relief)
    }

    /// Points that enclose the terrain: corners of squares at their highest elevation, and corners of the base.
    pub(super) fn hull(&self, exaggeration: f64) -> Vec<DVec3> {
        /// Maximum number of squares along a side.
        const MOST: u32 = 24;
        let bounds = self.bounds();
        let longer = (self.cells()[0].max(self.cells()[1]) + 1).div_ceil(1 << LEAF);
        let level = longer.div_ceil(MOST).next_power_of_two().ilog2();
        let side_m = f64::from((1_u32 << LEAF) << level) * self.cell_m();
        let [w, h] = self.size_m();
        let squares = (0..MOST).flat_map(|j| (0..MOST).map(move |i| (i, j)));
        let tops = squares.filter_map(|(i, j)| {
            let [_, high] = bounds.range(level, i, j)?;
            let at = |k: u32, most: f64| (f64::from(k) * side_m).min(most);
            Some(
                [(i, j), (i + 1, j), (i, j + 1), (i + 1, j + 1)]
                    .map(|(i, j)| DVec3::new(at(i, w), f64::from(high) * exaggeration, at(j, h))),
            )
        });
        let base = self.base(exaggeration) * exaggeration;
        let corners = [[0.0, 0.0], [w, 0.0], [0.0, h], [w, h]].map(|[x, z]| DVec3::new(x, base, z));
        tops.flatten().chain(corners).collect()
    }

    /// The height at a position in metres from the north-west corner, x east and y south; outside, the height of the
    /// nearest edge.
    #[must_use]
    pub fn height_at(&self, place: [f64; 2]) -> f64 {
        self.ground().height(DVec2::from_array(place) / self.cell_m() + 0.5)
    }

    /// The first hit of a camera ray on the terrain. Returns None for a ray that enters through a wall.
    #[must_use]
    pub fn cast(&self, ray: &Ray, exaggeration: f64) -> Option<Hit> {
        if !(exaggeration.is_finite() && exaggeration > 0.0 && ray.origin.is_finite() && ray.direction.is_finite()) {
            return None;
        }
        let (in_grid, unit_m) = in_grid(ray, self.cell_m(), exaggeration);
        let way = self.ground().meet(&in_grid)?;
        let at = in_grid.origin + in_grid.direction * way;
        let [nx, ny] = self.cells();
        let place = DVec2::new(at.x, at.z);
        let cell = (place - 0.5).floor().clamp(DVec2::ZERO, DVec2::new(f64::from(nx - 1), f64::from(ny - 1)));
        Some(Hit {
            place: ((place - 0.5) * self.cell_m()).to_array(),
            height: at.y,
            cell: [cell.x as u32, cell.y as u32],
            distance: way * unit_m,
        })
    }

    fn ground(&self) -> Surface<'_> {
        Surface { samples: self.height.plane(0), cells: self.cells(), bounds: &self.ground }
    }

    /// Bounds of the drawn surface.
    pub(super) fn bounds(&self) -> &Bounds {
        self.surface.as_ref().unwrap_or(&self.ground)
    }

    pub(super) const fn height(&self) -> &Field {
        &self.height
    }

    pub(crate) const fn colour(&self) -> Option<&Field> {
        self.colour.as_ref()
    }

    pub(super) const fn water(&self) -> Option<&Field> {
        self.water.as_ref()
    }

    pub(super) const fn mask(&self) -> Option<&Field> {
        self.mask.as_ref()
    }

    pub(super) const fn lines(&self) -> Option<&Field> {
        self.lines.as_ref()
    }
}

fn bounds(height: &Field, water: Option<&Field>) -> Bounds {
    let [nx, ny] = height.window().cells.map(|n| n as usize);
    let heights = height.plane(0);
    match water {
        None => Bounds::new([nx, ny], |x, y| heights[y * nx + x]),
        Some(water) => {
            let water = water.plane(0);
            Bounds::new([nx, ny], |x, y| heights[y * nx + x] + water[y * nx + x].max(0.0))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::field;

    #[test]
    fn a_ray_from_above_meets_the_land_where_it_is() {
        let height = field([60, 40], 25.0, |x, y| 100.0 + 0.3 * x - 0.1 * y);
        let terrain = Terrain::new(&height).expect("heights");
        for exaggeration in [1.0, 3.0] {
            let eye = DVec3::new(700.0, 3000.0, 500.0);
            let target = DVec3::new(400.0, 0.0, 300.0);
            let ray = Ray { origin: eye, direction: (target - eye).normalize() };
            let hit = terrain.cast(&ray, exaggeration).expect("meets");
            let [x, y] = hit.place;
            assert!((hit.height - (100.0 + 0.3 * x - 0.1 * y)).abs() < 1e-3, "{hit:?}");
            let seen = DVec3::new(x, hit.height * exaggeration, y);
            assert!((ray.origin + ray.direction * hit.distance - seen).length() < 1e-6);
            assert_eq!(hit.cell, [(x / 25.0) as u32, (y / 25.0) as u32]);
            assert!((terrain.height_at([x, y]) - hit.height).abs() < 1e-6);
        }
    }

    #[test]
    fn what_does_not_fit_is_refused() {
        let height = field([6, 4], 25.0, |x, _| x);
        let terrain = Terrain::new(&height).expect("heights");
        let with = |cover: Cover<'_>| terrain.clone().covered(cover).is_ok();
        assert!(!with(Cover { water: Some(&field([6, 5], 25.0, |_, _| 0.0)), ..Cover::default() }));
        assert!(!with(Cover { colour: Some(&height), ..Cover::default() }));
        assert!(with(Cover { mask: Some(&height), lines: Some(&height), ..Cover::default() }));
        assert!(Terrain::new(&field([6, 4], 25.0, |x, _| if x > 80.0 { f64::NAN } else { x })).is_err());
    }
}
