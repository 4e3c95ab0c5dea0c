//! Measures of real terrain: seven elevation models and their quarters, at cells of 80 to 100 m.

use std::sync::LazyLock;

/// A line per tile: the model, the tile (`whole`, `nw`, `ne`, `sw`, `se`), and its measures.
static TABLE: &str = include_str!("real.csv");

/// A tile of a real elevation model.
#[derive(Clone, Debug)]
pub struct Tile {
    /// The model, such as `glencoe`.
    pub model: &'static str,
    /// `whole`, or the quarter: `nw`, `ne`, `sw`, `se`.
    pub part: &'static str,
    values: Vec<f64>,
}

/// The measures of all tiles.
#[derive(Debug)]
pub struct Real {
    names: Vec<&'static str>,
    /// Tiles in the order of the table.
    pub tiles: Vec<Tile>,
}

impl Real {
    /// The table of the program.
    #[must_use]
    pub fn table() -> &'static Self {
        static READ: LazyLock<Real> = LazyLock::new(|| Real::read(TABLE));
        &READ
    }

    fn read(text: &'static str) -> Self {
        let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
        let names = lines.next().map_or_else(Vec::new, |line| line.into_iter().skip(2).collect());
        let number = |text: &&str| text.parse().unwrap_or(f64::NAN);
        let tiles = lines.filter(|line| line.len() > 2).map(|line| Tile {
            model: line[0],
            part: line[1],
            values: line[2..].iter().map(number).collect(),
        });
        Self { names, tiles: tiles.collect() }
    }

    /// Values of a measure of the tiles that `chosen` accepts; those that could not be measured are left out.
    pub fn values<'a>(&'a self, measure: &str, chosen: impl Fn(&Tile) -> bool + 'a) -> impl Iterator<Item = f64> + 'a {
        let column = self.names.iter().position(|name| *name == measure);
        let tiles = self.tiles.iter().filter(move |tile| chosen(tile));
        tiles.filter_map(move |tile| column.map(|column| tile.values[column])).filter(|value| value.is_finite())
    }
}

/// Mean and standard deviation; NaN for fewer than two values.
pub(super) fn spread(values: &[f64]) -> [f64; 2] {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let square: f64 = values.iter().map(|value| (value - mean) * (value - mean)).sum();
    [mean, (square / (count - 1.0)).sqrt()]
}
