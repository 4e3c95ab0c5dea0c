//! `--window`: a part of the world, in metres.

use std::str::FromStr;

use orograph_graph::{Unit, Window, World};

use crate::report::failure::Failure;

/// A typed part of the world: `X,Y,W x H` from the north-west corner, each with a unit or in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Part {
    /// Position of its north-west corner in the world in metres, x east and y south.
    corner_m: [f64; 2],
    /// Extent in metres.
    size_m: [f64; 2],
}

impl FromStr for Part {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let form = || format!("`{text}` is not a window; write `X,Y,W x H`, such as `4 km,6 km,2 km x 2 km`");
        let mut parts = text.split(',');
        let (Some(x), Some(y), Some(size), None) = (parts.next(), parts.next(), parts.next(), parts.next()) else {
            return Err(form());
        };
        let (width, height) = size.split_once(['x', 'X', '×']).ok_or_else(form)?;
        let metres = |text: &str| match Unit::Metres.parse(text) {
            Ok(metres) if metres.is_finite() => Ok(metres),
            Ok(_) => Err(form()),
            Err(error) => Err(error.to_string()),
        };
        let part = Self { corner_m: [metres(x)?, metres(y)?], size_m: [metres(width)?, metres(height)?] };
        if part.size_m.iter().any(|size| *size <= 0.0) {
            return Err(format!("`{text}` has no extent; both sides of a window must be above zero"));
        }
        Ok(part)
    }
}

impl Part {
    /// The window of the world, widened to whole cells.
    ///
    /// # Errors
    /// When it is not within the world.
    pub fn window(&self, world: World) -> Result<Window, Failure> {
        let cell_m = world.cell_m();
        let mut window = Window::whole(world);
        for axis in 0..2 {
            let (from, to) = (self.corner_m[axis], self.corner_m[axis] + self.size_m[axis]);
            // A millionth of a cell is a rounding error, not another cell.
            const ROUNDING: f64 = 1e-6;
            let first = (from / cell_m + ROUNDING).floor();
            let end = (to / cell_m - ROUNDING).ceil().max(first + 1.0);
            if first < 0.0 || end > f64::from(world.cells[axis]) {
                return Err(self.outside(&world));
            }
            window.origin[axis] = first as u32;
            window.cells[axis] = (end - first) as u32;
        }
        Ok(window)
    }

    fn outside(&self, world: &World) -> Failure {
        let metres = |v: f64| Unit::Metres.display(v);
        let [x, y] = self.corner_m;
        let [right, bottom] = [x + self.size_m[0], y + self.size_m[1]];
        let [width, height] = world.size.map(metres);
        Failure::wrong(format!(
            "`--window` from ({}, {}) to ({}, {}) is not within the world of {width} x {height}",
            metres(x),
            metres(y),
            metres(right),
            metres(bottom)
        ))
        .hint("a window ends at the sides of the world, also at periodic ones; build two and join them")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn world() -> World {
        World { size: [1000.0, 500.0], cells: [100, 50], ..World::default() }
    }

    fn window(text: &str) -> Result<([u32; 2], [u32; 2]), Failure> {
        let part: Part = text.parse().expect("a window");
        part.window(world()).map(|window| (window.origin, window.cells))
    }

    #[test]
    fn a_window_is_widened_to_whole_cells() {
        assert_eq!(window("0,0,1 km x 500 m"), Ok(([0, 0], [100, 50])));
        assert_eq!(window("0.1 km, 200 m, 300x100"), Ok(([10, 20], [30, 10])));
        assert_eq!(window("101,205,5 x 5"), Ok(([10, 20], [1, 1])), "smaller than a cell");
        assert_eq!(window("105,205,10 x 1"), Ok(([10, 20], [2, 1])), "across two cells");
        assert_eq!(window("990,490,10 x 10"), Ok(([99, 49], [1, 1])));
        // 0.3 / 0.1 is not quite 3
        let tenths = World { size: [1.0, 1.0], cells: [10, 10], ..World::default() };
        let part: Part = "0.3,0.6,0.1x0.1".parse().expect("a window");
        assert_eq!(part.window(tenths).map(|window| (window.origin, window.cells)), Ok(([3, 6], [1, 1])));
    }

    #[test]
    fn a_window_outside_the_world_is_refused() {
        for text in ["-1,0,10x10", "995,0,10x10", "0,495,10x10", "2 km,0,10x10", "0,0,1e300x10"] {
            let failure = window(text).expect_err(text);
            assert!(failure.message.contains("not within the world of 1 km x 500 m"), "{failure}");
        }
    }

    #[test]
    fn invalid_windows_are_refused() {
        for text in
            ["", "1,2", "1,2,3", "1,2,3x", "1,2,3x4,5", "a,2,3x4", "1 Myr,0,3x4", "0,0,0x4", "0,0,4x-1", "nan,0,1x1"]
        {
            assert!(text.parse::<Part>().is_err(), "{text}");
        }
    }
}
