//! Lines in the world: what rivers are as objects.

use serde::{Deserialize, Serialize};

/// Lines that may flow into each other.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Lines {
    /// In an order that the node which made them states.
    pub lines: Vec<Line>,
}

/// A line from its upper end to its lower.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Line {
    /// Rank in its network, from 1; of rivers, Strahler's order.
    pub order: u32,
    /// The place, in [`Lines::lines`], of the line that begins where this one ends.
    pub downstream: Option<u32>,
    /// At least two.
    pub vertices: Vec<Vertex>,
}

/// A point of a line and what is known there.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Vertex {
    /// Metres to the east and to the south of the world's north-west corner.
    pub position_m: [f64; 2],
    /// Elevation in metres.
    pub elevation_m: f64,
    /// Width of the line across, in metres.
    pub width_m: f64,
    /// Depth in metres.
    pub depth_m: f64,
    /// Area that drains through here, in square metres.
    pub area_m2: f64,
}

impl Vertex {
    /// The vertex a share `t` of the way to another, all of its numbers linear between the two.
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

    /// Its numbers in the order of their declaration.
    pub(crate) const fn numbers(&self) -> [f64; 6] {
        let [x, y] = self.position_m;
        [x, y, self.elevation_m, self.width_m, self.depth_m, self.area_m2]
    }

    /// The vertex of such numbers.
    pub(crate) const fn from_numbers([x, y, elevation_m, width_m, depth_m, area_m2]: [f64; 6]) -> Self {
        Self { position_m: [x, y], elevation_m, width_m, depth_m, area_m2 }
    }
}

impl Lines {
    /// Bytes its contents take, roughly.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.lines.iter().map(|line| size_of::<Line>() + size_of_val(line.vertices.as_slice())).sum()
    }

    /// The first number that is not finite, or line that flows nowhere, in words.
    pub(crate) fn fault(&self) -> Option<String> {
        self.lines.iter().enumerate().find_map(|(at, line)| {
            if line.vertices.len() < 2 {
                return Some(format!("gave line {at} with {} vertices; it takes two", line.vertices.len()));
            }
            if line.downstream.is_some_and(|next| next as usize >= self.lines.len()) {
                return Some(format!("gave line {at} that flows into one that is not there"));
            }
            let odd = line.vertices.iter().flat_map(Vertex::numbers).find(|v| !v.is_finite())?;
            Some(format!("gave {odd} in line {at}"))
        })
    }
}
