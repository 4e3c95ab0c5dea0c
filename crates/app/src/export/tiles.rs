//! The division of a raster into equal tiles, for engines that load a world in parts.

use std::{fmt, str::FromStr};

use orograph_graph::Window;

use crate::report::failure::Failure;

/// Columns and rows of tiles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tiles {
    columns: u32,
    rows: u32,
}

impl Tiles {
    /// Maximum number of tiles along a side.
    pub const MOST: u32 = 64;
    /// A single tile: the whole raster.
    pub const WHOLE: Self = Self { columns: 1, rows: 1 };

    /// Tiles of these columns and rows. Returns None for a single one.
    #[must_use]
    pub fn of([columns, rows]: [u32; 2]) -> Option<Self> {
        let tiles = Self { columns: columns.clamp(1, Self::MOST), rows: rows.clamp(1, Self::MOST) };
        Some(tiles).filter(|tiles| *tiles != Self::WHOLE)
    }

    /// Columns and rows.
    #[must_use]
    pub const fn counts(self) -> [u32; 2] {
        [self.columns, self.rows]
    }

    /// Column and row of each tile, row by row from the north-west.
    pub fn each(self) -> impl Iterator<Item = [u32; 2]> {
        (0..self.rows).flat_map(move |row| (0..self.columns).map(move |column| [column, row]))
    }

    /// The cells of a tile, to the nearest whole number.
    #[must_use]
    pub fn cells(self, whole: [u32; 2]) -> [u32; 2] {
        let counts = self.counts();
        [0, 1].map(|axis| ((whole[axis] + counts[axis] / 2) / counts[axis]).max(1))
    }

    /// The samples of the whole raster whose tiles have `tile` samples, of which neighbours share `shared`.
    #[must_use]
    pub fn whole(self, tile: [u32; 2], shared: u32) -> [u32; 2] {
        let counts = self.counts();
        [0, 1].map(|axis| counts[axis] * (tile[axis] - shared) + shared)
    }

    /// The name of a tile's file: `height.png` becomes `height_x0_y0.png`.
    #[must_use]
    pub fn name(name: &str, [column, row]: [u32; 2]) -> String {
        let (stem, end) = name.rsplit_once('.').unwrap_or((name, ""));
        format!("{stem}_x{column}_y{row}.{end}")
    }

    /// The window of a tile, of a raster whose tiles share `shared` samples along their common edges.
    #[must_use]
    pub fn window(self, whole: &Window, tile: [u32; 2], shared: u32) -> Window {
        let counts = self.counts();
        let steps = [0, 1].map(|axis| (whole.cells[axis] - shared) / counts[axis]);
        let origin = [0, 1].map(|axis| whole.origin[axis] + tile[axis] * steps[axis]);
        Window { origin, cells: steps.map(|step| step + shared), ..*whole }
    }

    /// Refuses cells that tiles of cells do not divide.
    ///
    /// # Errors
    /// The failure names cell counts that they divide.
    pub fn check(self, cells: [u32; 2]) -> Result<(), Failure> {
        let counts = self.counts();
        let Some(axis) = [0, 1].into_iter().find(|&axis| !cells[axis].is_multiple_of(counts[axis])) else {
            return Ok(());
        };
        let (count, [nx, ny]) = (counts[axis], cells);
        let below = (cells[axis] / count).max(1) * count;
        let message = format!("{nx} x {ny} cells cannot be divided into {self} equal tiles");
        let which = ["columns", "rows"][axis];
        let hint =
            format!("choose `--cells` that give a multiple of {count} {which}, such as {below} or {}", below + count);
        Err(Failure::wrong(message).hint(hint))
    }
}

impl FromStr for Tiles {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (columns, rows) = text.split_once(['x', 'X', '×']).unwrap_or((text, text));
        let count = |text: &str| text.trim().parse().ok().filter(|count| (1..=Self::MOST).contains(count));
        match (count(columns), count(rows)) {
            (Some(columns), Some(rows)) => Ok(Self { columns, rows }),
            _ => Err(format!("expected a number of tiles per side such as `4` or `4x2`, at most {}", Self::MOST)),
        }
    }
}

impl fmt::Display for Tiles {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(to, "{}x{}", self.columns, self.rows)
    }
}

#[cfg(test)]
mod tests {
    use orograph_graph::{Field, World};

    use super::*;

    #[test]
    fn tiles_are_written_and_read_as_columns_by_rows() {
        let parse = |text: &str| text.parse::<Tiles>();
        assert_eq!(parse("4"), Ok(Tiles { columns: 4, rows: 4 }));
        assert_eq!(parse("4x2").expect("tiles").to_string(), "4x2");
        for wrong in ["", "0", "65", "4x", "4x0", "-1", "2.5", "axb", "4294967296"] {
            assert!(parse(wrong).is_err(), "{wrong}");
        }
        assert_eq!(Tiles::name("ground.first.png", [3, 0]), "ground.first_x3_y0.png");
    }

    #[test]
    fn tiles_of_cells_divide_the_raster_and_those_of_vertices_share_edges() {
        let tiles = Tiles { columns: 3, rows: 2 };
        let field = |cells: [u32; 2]| {
            let world = World { size: cells.map(f64::from), cells, ..World::default() };
            Field::new(Window::whole(world), (0..cells[0] * cells[1]).map(|cell| cell as f32).collect())
        };
        let cells = field([12, 8]);
        let last = cells.crop(&tiles.window(cells.window(), [2, 1], 0));
        assert_eq!((last.window().origin, last.window().cells), ([8, 4], [4, 4]));
        assert_eq!(last.samples()[0], 56.0);
        let vertices = field(tiles.whole([5, 4], 1));
        assert_eq!(vertices.window().cells, [13, 7]);
        let [west, east] = [[0, 0], [1, 0]].map(|tile| vertices.crop(&tiles.window(vertices.window(), tile, 1)));
        assert_eq!((west.window().cells, east.window().origin), ([5, 4], [4, 0]));
        assert!((0..4).all(|row| west.samples()[row * 5 + 4] == east.samples()[row * 5]));
        assert_eq!(tiles.check([12, 8]), Ok(()));
        let refused = tiles.check([13, 8]).expect_err("13 columns");
        assert!(refused.hint.expect("a hint").contains("12 or 15"));
    }
}
