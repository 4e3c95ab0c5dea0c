//! The world: its size in metres, its cells and its boundary; and the window of it that a raster covers.

use serde::Serialize;

/// The boundary condition at one side of the world, for water, sediment and ice.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Edge {
    /// A fixed base level: water and sediment leave, the elevation stays.
    #[default]
    Base,
    /// Water and sediment leave; the elevation is free.
    Open,
    /// Nothing crosses this side.
    Wall,
    /// Water and sediment that leave on this side enter on the opposite one.
    Periodic,
    /// Terrain continues beyond this side: erosion by rivers also runs on a margin of [`World::MARGIN`] of the shorter
    /// side, which is cut off.
    Inland,
}

impl Edge {
    /// Every kind of edge with its name in a file.
    pub const NAMES: [(&'static str, Self); 5] = [
        ("inland", Self::Inland),
        ("base", Self::Base),
        ("open", Self::Open),
        ("wall", Self::Wall),
        ("periodic", Self::Periodic),
    ];

    /// Its name in a file.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Base => "base",
            Self::Open => "open",
            Self::Wall => "wall",
            Self::Periodic => "periodic",
            Self::Inland => "inland",
        }
    }
}

/// The four sides of the world. Row 0 of a raster is north, column 0 is west.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize)]
pub struct Boundary {
    /// Left column.
    pub west: Edge,
    /// Right column.
    pub east: Edge,
    /// First row.
    pub north: Edge,
    /// Last row.
    pub south: Edge,
}

impl Boundary {
    /// The same kind of edge on all four sides.
    #[must_use]
    pub const fn all(edge: Edge) -> Self {
        Self { west: edge, east: edge, north: edge, south: edge }
    }
}

/// Where on Earth a world lies.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct GeoPlace {
    /// EPSG code of a projected coordinate system whose unit is the metre.
    pub epsg: u32,
    /// Easting and northing of the world's north-west corner, in metres.
    pub corner_m: [f64; 2],
}

impl GeoPlace {
    /// The lowest and the highest code that a GeoTIFF can hold.
    pub const CODES: [u32; 2] = [1024, 32_766];
    /// The largest easting or northing in metres: more than around the Earth.
    pub const MOST_M: f64 = 1e8;
    /// Systems that are not in metres on the ground, but common: geographic ones, and Web Mercator.
    pub const NOT_METRIC: [u32; 11] = [4326, 4258, 4267, 4269, 4283, 4617, 4979, 7844, 3857, 3785, 3395];

    fn check(&self) -> Result<(), WorldError> {
        let [low, high] = Self::CODES;
        if !(low..=high).contains(&self.epsg) || Self::NOT_METRIC.contains(&self.epsg) {
            return Err(WorldError::System(self.epsg));
        }
        match self.corner_m.into_iter().find(|metres| metres.is_nan() || metres.abs() > Self::MOST_M) {
            Some(metres) => Err(WorldError::Corner(metres)),
            None => Ok(()),
        }
    }
}

/// The world that a raster file fills.
#[derive(Clone, Debug, PartialEq)]
pub struct Extent {
    /// Width and height in metres.
    pub size: [f64; 2],
    /// Cells along x and y.
    pub cells: [u32; 2],
    /// Where it lies, if the file says it.
    pub place: Option<GeoPlace>,
    /// What is assumed about the file, each a sentence without a full stop.
    pub remarks: Vec<String>,
}

impl Extent {
    /// A world of this size, with defaults for the rest.
    #[must_use]
    pub fn world(&self) -> World {
        World { size: self.size, cells: self.cells, place: self.place, ..World::default() }
    }
}

/// Size, resolution and seed: all properties of the terrain that do not belong to a node.
///
/// The value of cell (i, j) is taken at its centre, `((i + 0.5) d, (j + 0.5) d)` metres from the world's north-west
/// corner; x runs east, y south. Cells are square.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct World {
    /// Width and height in metres.
    pub size: [f64; 2],
    /// Cells along x and y.
    pub cells: [u32; 2],
    /// Seed of all random numbers.
    pub seed: u32,
    /// Kind of each side.
    pub boundary: Boundary,
    /// Elevation of the sea in metres; lower terrain is under water. `None` for a world without a sea.
    pub sea_level: Option<f64>,
    /// Where it lies. `None` for a world that is nowhere on Earth.
    pub place: Option<GeoPlace>,
}

/// Why a world cannot be evaluated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum WorldError {
    /// No cells.
    #[error("a world of {0} x {1} cells is empty; give it at least 1 x 1")]
    Empty(u32, u32),
    /// More cells than a raster of this program can have.
    #[error("a world of {0} x {1} cells needs {memory} for a single layer; the limit is {side} cells a side and {most} in all",
        memory = scaled(4.0 * f64::from(*.0) * f64::from(*.1)), side = World::MAX_SIDE, most = World::MAX_CELLS)]
    TooLarge(u32, u32),
    /// A size that is not positive and finite.
    #[error("a world of {0} x {1} m has no extent; both must be above zero and finite")]
    NoExtent(f64, f64),
    /// Cells that are too small.
    #[error("cells of {0:e} m are too small; the smallest are {least} m, a micrometre", least = World::LEAST_CELL_M)]
    TooFine(f64),
    /// A side that is too long.
    #[error("a world of {0:e} m a side is too large; the longest is {most} m", most = World::MOST_SIDE_M)]
    TooWide(f64),
    /// Cells that are not square.
    #[error("cells would be {0} x {1} m; they must be square, so choose cells in the ratio of the size")]
    NotSquare(f64, f64),
    /// A sea level outside the range of heights and depths on Earth.
    #[error("a sea at {0} m is not within {low} to {high} m", low = World::SEA_LEVELS[0], high = World::SEA_LEVELS[1])]
    SeaLevel(f64),
    /// A coordinate system that is not in metres on the ground.
    #[error("EPSG:{0} is not a projected coordinate system in metres")]
    System(u32),
    /// Coordinates beyond the Earth.
    #[error("{0} m is not an easting or a northing on Earth; the largest are {most} m", most = GeoPlace::MOST_M)]
    Corner(f64),
}

/// A number of bytes as text: `1.5 GiB`.
#[must_use]
pub fn bytes(count: u64) -> String {
    if count < 1024 { format!("{count} B") } else { scaled(count as f64) }
}

/// A number of at least 1024 bytes as text, also one beyond 64 bits.
fn scaled(count: f64) -> String {
    let mut value = count / 1024.0;
    for unit in ["KiB", "MiB", "GiB", "TiB", "PiB"] {
        if value < 1024.0 {
            return format!("{value:.1} {unit}");
        }
        value /= 1024.0;
    }
    format!("{value:.1} EiB")
}

impl Default for World {
    /// 16.384 km per side, 1024 cells per side, seed 0, base level on all sides, no sea, nowhere on Earth.
    fn default() -> Self {
        let boundary = Boundary::default();
        Self { size: [16384.0, 16384.0], cells: [1024, 1024], seed: 0, boundary, sea_level: None, place: None }
    }
}

impl World {
    /// Width of the margin beyond `inland` sides, as a fraction of the world's shorter side.
    pub const MARGIN: f64 = 0.1;
    /// The largest number of cells along a side: rasters are indexed by `u32`, and lattice phases assume 16-bit cell
    /// numbers.
    pub const MAX_SIDE: u32 = 65_536;
    /// The largest number of cells, 2 GiB per layer: the links of a cell with its eight neighbours are numbered in 32
    /// bits.
    pub const MAX_CELLS: u64 = 1 << 29;
    /// The lowest and the highest sea level in metres: beyond the depths and heights of the Earth.
    pub const SEA_LEVELS: [f64; 2] = [-12_000.0, 12_000.0];

    /// The smallest side of a cell in metres: a micrometre. Neither a length divided by a cell nor the fourth power of
    /// a cell is then near the limits of numbers.
    pub const LEAST_CELL_M: f64 = 1e-6;
    /// The longest side of a world in metres: 100 000 km, beyond any planet with ground.
    pub const MOST_SIDE_M: f64 = 1e8;

    /// Returns true if both worlds differ at most in sea level and place, so that a raster of one fits the other.
    #[must_use]
    pub fn has_cells_of(&self, other: &Self) -> bool {
        *self == Self { sea_level: self.sea_level, place: self.place, ..*other }
    }

    /// Side of a cell in metres.
    #[must_use]
    pub fn cell_m(&self) -> f64 {
        self.size[0] / f64::from(self.cells[0])
    }

    /// The same world with `nx` cells along x, and as many along y as make the cells square.
    ///
    /// If the size is not a whole number of such cells, the nearest number is taken; [`Self::check`] then returns an
    /// error.
    #[must_use]
    pub fn with_cells_along_x(self, nx: u32) -> Self {
        let ratio = self.size[1] / self.size[0];
        if nx == 0 || !ratio.is_finite() || ratio <= 0.0 {
            return Self { cells: [nx, nx], ..self };
        }
        // The conversion saturates, which the check rejects as well.
        Self { cells: [nx, ((f64::from(nx) * ratio).round() as u32).max(1)], ..self }
    }

    /// Checks size, cell count, size and squareness of cells, sea level and place.
    ///
    /// # Errors
    /// [`WorldError`], with the values that are wrong.
    pub fn check(&self) -> Result<(), WorldError> {
        let [nx, ny] = self.cells;
        let [w, h] = self.size;
        if nx == 0 || ny == 0 {
            return Err(WorldError::Empty(nx, ny));
        }
        if nx > Self::MAX_SIDE || ny > Self::MAX_SIDE || u64::from(nx) * u64::from(ny) > Self::MAX_CELLS {
            return Err(WorldError::TooLarge(nx, ny));
        }
        if !(w.is_finite() && h.is_finite() && w > 0.0 && h > 0.0) {
            return Err(WorldError::NoExtent(w, h));
        }
        let (dx, dy) = (w / f64::from(nx), h / f64::from(ny));
        // the smallest cells may have been rounded
        if dx.min(dy) < Self::LEAST_CELL_M * (1.0 - 1e-9) {
            return Err(WorldError::TooFine(dx.min(dy)));
        }
        if w.max(h) > Self::MOST_SIDE_M {
            return Err(WorldError::TooWide(w.max(h)));
        }
        if (dx - dy).abs() > 1e-6 * dx {
            return Err(WorldError::NotSquare(dx, dy));
        }
        let [low, high] = Self::SEA_LEVELS;
        match self.sea_level {
            Some(level) if !(low..=high).contains(&level) => Err(WorldError::SeaLevel(level)),
            _ => self.place.map_or(Ok(()), |place| place.check()),
        }
    }
}

/// A rectangle of the world's cells: the extent of a raster.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Window {
    /// The world it is a part of.
    pub world: World,
    /// Column and row of its first cell in the world.
    pub origin: [u32; 2],
    /// Cells along x and y.
    pub cells: [u32; 2],
}

impl Window {
    /// The whole of a world.
    #[must_use]
    pub const fn whole(world: World) -> Self {
        Self { world, origin: [0, 0], cells: world.cells }
    }

    /// Columns.
    #[must_use]
    pub const fn nx(&self) -> usize {
        self.cells[0] as usize
    }

    /// Rows.
    #[must_use]
    pub const fn ny(&self) -> usize {
        self.cells[1] as usize
    }

    /// Number of cells.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.nx() * self.ny()
    }

    /// Returns true if it has no cells.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Side of a cell in metres.
    #[must_use]
    pub fn cell_m(&self) -> f64 {
        self.world.cell_m()
    }

    /// World position in metres of the centre of the window's cell (i, j).
    #[must_use]
    pub fn centre_m(&self, i: usize, j: usize) -> [f64; 2] {
        let d = self.cell_m();
        [(f64::from(self.origin[0]) + i as f64 + 0.5) * d, (f64::from(self.origin[1]) + j as f64 + 0.5) * d]
    }

    /// Column and row of the window's cell at a world position in metres. Returns None outside the window.
    #[must_use]
    pub fn cell_at(&self, [x, y]: [f64; 2]) -> Option<[usize; 2]> {
        let along = |at: f64, axis: usize| {
            let cell = (at / self.cell_m()).floor() - f64::from(self.origin[axis]);
            (0.0..f64::from(self.cells[axis])).contains(&cell).then_some(cell as usize)
        };
        Some([along(x, 0)?, along(y, 1)?])
    }

    /// The place of the window's own north-west corner, in a world with a place.
    #[must_use]
    pub fn place(&self) -> Option<GeoPlace> {
        let [east, south] = self.origin.map(|cells| f64::from(cells) * self.cell_m());
        self.world.place.map(|GeoPlace { epsg, corner_m: [x, y] }| GeoPlace { epsg, corner_m: [x + east, y - south] })
    }

    /// Returns true if it is the whole world.
    #[must_use]
    pub fn is_whole(&self) -> bool {
        self.origin == [0, 0] && self.cells == self.world.cells
    }

    /// The window grown by `reach_m` metres on each side, rounded up to cells and clipped to the world.
    #[must_use]
    pub fn grown(&self, reach_m: f64) -> Self {
        let halo = (reach_m / self.cell_m() - 1e-9).ceil().clamp(0.0, f64::from(u32::MAX / 4)) as u32;
        let mut out = *self;
        for axis in 0..2 {
            let first = self.origin[axis].saturating_sub(halo);
            let end = (self.origin[axis] + self.cells[axis]).saturating_add(halo).min(self.world.cells[axis]);
            out.origin[axis] = first;
            out.cells[axis] = end - first;
        }
        out
    }

    /// The smallest window that contains this one and another of the same world.
    #[must_use]
    pub fn union(&self, other: &Self) -> Self {
        let mut out = *self;
        for axis in 0..2 {
            let first = self.origin[axis].min(other.origin[axis]);
            let end = (self.origin[axis] + self.cells[axis]).max(other.origin[axis] + other.cells[axis]);
            out.origin[axis] = first;
            out.cells[axis] = end - first;
        }
        out
    }

    /// Returns true if every cell of `other` is in this window. Both are in the same world; the sea level may differ.
    #[must_use]
    pub fn contains(&self, other: &Self) -> bool {
        self.world.has_cells_of(&other.world)
            && (0..2).all(|axis| {
                self.origin[axis] <= other.origin[axis]
                    && other.origin[axis] + other.cells[axis] <= self.origin[axis] + self.cells[axis]
            })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn worlds_that_cannot_be_are_refused() {
        let world = World::default();
        assert_eq!(world.check(), Ok(()));
        assert!(matches!(World { cells: [0, 5], ..world }.check(), Err(WorldError::Empty(..))));
        let huge = World { cells: [1_000_000_000, 1], ..world };
        assert!(huge.check().expect_err("too many").to_string().contains("3.7 GiB"));
        // more bytes than 64 bits can count
        let most = World { cells: [u32::MAX; 2], ..world };
        assert!(most.check().expect_err("too many").to_string().contains("64.0 EiB"));
        // 10^9 cells, with an allowed number along each side, and the maximum
        let square = |side: u32| World { cells: [side; 2], ..world };
        assert!(square(31_623).check().expect_err("too many").to_string().contains("536870912 in all"));
        assert_eq!(World { size: [2.0, 1.0], cells: [32_768, 16_384], ..world }.check(), Ok(()));
        assert!(matches!(World { size: [f64::NAN, 1.0], ..world }.check(), Err(WorldError::NoExtent(..))));
        assert!(matches!(World { cells: [1024, 512], ..world }.check(), Err(WorldError::NotSquare(..))));
        // 16 cells of a micrometre, and a world of 100 000 km, are the limits
        let sized = |side: f64| World { size: [side; 2], cells: [16; 2], ..world };
        assert_eq!((sized(16.0 * 1e-6).check(), sized(1e8).check()), (Ok(()), Ok(())));
        for side in [1.5e-5, 1e-30, f64::MIN_POSITIVE] {
            assert!(matches!(sized(side).check(), Err(WorldError::TooFine(_))), "{side}");
        }
        for side in [1.001e8, 1e300] {
            assert!(matches!(sized(side).check(), Err(WorldError::TooWide(_))), "{side}");
        }
        for level in [f64::NAN, f64::INFINITY, -12_000.1, 12_000.1] {
            let world = World { sea_level: Some(level), ..world };
            assert!(matches!(world.check(), Err(WorldError::SeaLevel(..))), "{level}");
        }
        assert_eq!(World { sea_level: Some(-12_000.0), ..world }.check(), Ok(()));
    }

    #[test]
    fn a_window_grows_up_to_the_edges() {
        let world = World::default(); // cells of 16 m
        let window = Window { world, origin: [2, 100], cells: [10, 10] };
        let grown = window.grown(64.0);
        assert_eq!((grown.origin, grown.cells), ([0, 96], [16, 18]));
        assert!(grown.contains(&window) && !window.contains(&grown));
        assert!(window.grown(1e9).is_whole());
        assert_eq!(window.grown(0.0), window);
    }

    #[test]
    fn a_place_does_not_depend_on_the_sea() {
        let dry = Window::whole(World::default());
        let wet = Window::whole(World { sea_level: Some(3.0), ..World::default() });
        assert!(dry != wet && dry.contains(&wet) && wet.contains(&dry));
        let seeded = Window::whole(World { seed: 1, sea_level: Some(3.0), ..World::default() });
        assert!(!wet.contains(&seeded));
    }

    #[test]
    fn a_union_is_the_smallest_window_around_both() {
        let world = World::default();
        let a = Window { world, origin: [10, 20], cells: [5, 5] };
        let b = Window { world, origin: [12, 0], cells: [10, 3] };
        assert_eq!(a.union(&b), Window { world, origin: [10, 0], cells: [12, 25] });
        assert_eq!(a.union(&a), a);
    }
}
