//! Polylines in the world, such as rivers as vector features.

use serde::{Deserialize, Serialize};

/// Lines that may flow into each other.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Lines {
    /// In an order that the node documents.
    pub lines: Vec<Line>,
}

/// A line from its upper to its lower end.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Line {
    /// Order in its network, from 1; for rivers, the Strahler order.
    pub order: u32,
    /// Index in [`Lines::lines`] of the line that begins where this one ends.
    pub downstream: Option<u32>,
    /// At least two.
    pub vertices: Vec<Vertex>,
}

/// A point of a line with its attributes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Vertex {
    /// Metres to the east and to the south of the world's north-west corner.
    pub position_m: [f64; 2],
    /// Elevation in metres.
    pub elevation_m: f64,
    /// Width across the line, in metres.
    pub width_m: f64,
    /// Depth in metres.
    pub depth_m: f64,
    /// Drainage area at this point, in square metres.
    pub area_m2: f64,
}

impl Vertex {
    /// The vertex at the fraction `t` of the way to another; all numbers are interpolated linearly.
    #[must_use]
    pub fn towards(&self, other: &Self, t: f64) -> Self {
        let between = |from: f64, to: f64| from + (to - from) * t;
        Self {
            position_m: [0, 1].map(|axis| between(self.position_m[axis], other.position_m[axis])),
            elevation_m: between(self.elevation_m, other.elevation_m),
            width_m: between(self.width_m, other.width_m),
            depth_m: between(self.depth_m, other.depth_m),
            area_m2: between(self.area_m2, other.area_m2),
        }
    }

    /// Its numbers in declaration order.
    pub(crate) const fn numbers(&self) -> [f64; 6] {
        let [x, y] = self.position_m;
        [x, y, self.elevation_m, self.width_m, self.depth_m, self.area_m2]
    }

    /// The vertex with these numbers.
    pub(crate) const fn from_numbers([x, y, elevation_m, width_m, depth_m, area_m2]: [f64; 6]) -> Self {
        Self { position_m: [x, y], elevation_m, width_m, depth_m, area_m2 }
    }
}

impl Lines {
    /// Approximate size in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.lines.iter().map(|line| size_of::<Line>() + size_of_val(line.vertices.as_slice())).sum()
    }

    /// A message on the first number that is not finite or line that refers to a missing one. Returns None when there
    /// is none.
    pub(crate) fn fault(&self) -> Option<String> {
        self.lines.iter().enumerate().find_map(|(at, line)| {
            if line.vertices.len() < 2 {
                return Some(format!("returned line {at} with {} vertices; a line needs two", line.vertices.len()));
            }
            if line.downstream.is_some_and(|next| next as usize >= self.lines.len()) {
                return Some(format!("returned line {at}, which flows into a line that does not exist"));
            }
            let odd = line.vertices.iter().flat_map(Vertex::numbers).find(|v| !v.is_finite())?;
            Some(format!("returned {odd} in line {at}"))
        })
    }
}
