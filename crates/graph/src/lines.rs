//! Polylines in the world, such as rivers and the shores of lakes as vector features.

use serde::{Deserialize, Serialize};

/// Lines that may flow into each other.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Lines {
    /// In an order that the node documents.
    pub lines: Vec<Line>,
    /// The areas that the lines bound, in the order of the lines; empty if lines are not the rings of areas.
    pub areas: Vec<Area>,
    /// True if the lines have no elevations of their own: they lie on the terrain that they are used with.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub draped: bool,
}

/// A water surface that rings bound, such as a lake.
///
/// A ring is a line whose last vertex is its first. The outer ring of each part runs counter-clockwise with north up;
/// its holes follow it and run clockwise.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Area {
    /// Number of lines that are its rings: those that follow the rings of the area before.
    pub rings: u32,
    /// Elevation of its surface in metres.
    pub level_m: f64,
    /// Largest depth below the surface in metres.
    pub depth_m: f64,
    /// In square metres.
    pub area_m2: f64,
    /// In cubic metres.
    pub volume_m3: f64,
    /// Where it spills: metres to the east and to the south of the world's north-west corner.
    pub spill_m: [f64; 2],
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

impl Area {
    /// Its numbers in declaration order.
    pub(crate) const fn numbers(&self) -> [f64; 6] {
        let [x, y] = self.spill_m;
        [self.level_m, self.depth_m, self.area_m2, self.volume_m3, x, y]
    }

    /// The area with these numbers.
    pub(crate) const fn from_numbers(rings: u32, [level_m, depth_m, area_m2, volume_m3, x, y]: [f64; 6]) -> Self {
        Self { rings, level_m, depth_m, area_m2, volume_m3, spill_m: [x, y] }
    }
}

impl Lines {
    /// Lines that bound no areas.
    #[must_use]
    pub const fn open(lines: Vec<Line>) -> Self {
        Self { lines, areas: Vec::new(), draped: false }
    }

    /// Returns each area with its rings.
    pub fn rings(&self) -> impl Iterator<Item = (&Area, &[Line])> {
        self.areas.iter().scan(self.lines.as_slice(), |left, area| {
            let (rings, rest) = left.split_at_checked(area.rings as usize)?;
            *left = rest;
            Some((area, rings))
        })
    }

    /// Approximate size in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let lines = self.lines.iter().map(|line| size_of::<Line>() + size_of_val(line.vertices.as_slice()));
        lines.sum::<usize>() + size_of_val(self.areas.as_slice())
    }

    /// A message on the first number that is not finite, line that refers to a missing one, or ring that is not closed.
    /// Returns None when there is none.
    pub(crate) fn fault(&self) -> Option<String> {
        let rings = self.areas.iter().map(|area| area.rings as usize).sum::<usize>();
        if !self.areas.is_empty() && rings != self.lines.len() {
            return Some(format!("returned {} lines for {rings} rings", self.lines.len()));
        }
        let is_open =
            |line: &Line| line.vertices.first().map(|v| v.position_m) != line.vertices.last().map(|v| v.position_m);
        if let Some(at) =
            self.lines.iter().position(|line| !self.areas.is_empty() && (line.vertices.len() < 4 || is_open(line)))
        {
            return Some(format!("returned line {at}, which is not a closed ring"));
        }
        if let Some(odd) = self.areas.iter().flat_map(Area::numbers).find(|v| !v.is_finite()) {
            return Some(format!("returned {odd} in an area"));
        }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn areas_own_the_rings_that_follow_each_other() {
        let ring = |x: f64| {
            let vertex = |[east, south]: [f64; 2]| Vertex { position_m: [x + east, south], ..Vertex::default() };
            let corners = [[0.0, 0.0], [0.0, 1.0], [1.0, 1.0], [0.0, 0.0]];
            Line { order: 1, downstream: None, vertices: corners.map(vertex).to_vec() }
        };
        let area = |rings| Area { rings, ..Area::default() };
        let lines = Lines { areas: vec![area(2), area(1)], ..Lines::open(vec![ring(0.0), ring(2.0), ring(4.0)]) };
        assert_eq!(lines.fault(), None);
        let counts: Vec<usize> = lines.rings().map(|(_, rings)| rings.len()).collect();
        assert_eq!(counts, [2, 1]);
        assert!(Lines { areas: vec![area(2)], ..lines.clone() }.fault().is_some());
        let odd = Area { level_m: f64::NAN, ..area(3) };
        assert!(Lines { areas: vec![odd], ..lines.clone() }.fault().is_some());
        let mut open = lines;
        open.lines[1].vertices.pop();
        assert!(open.fault().is_some());
        assert_eq!(Lines::open(open.lines).fault(), None, "without areas, lines need not be closed");
    }
}
