//! Joined sides: what random fields and shaders do where a world is periodic.
//!
//! A field that is a function of position has no reason to be equal at opposite sides. Before the eastern and the
//! southern side of a periodic world it therefore turns into itself beyond the western and the northern side: with f
//! the field and L the size of the world, f(x) cos θ + f(x − L) sin θ, where θ rises smoothly from 0 to a right angle at
//! the side. As the squares of the weights add up to 1, the field keeps its standard deviation, unless the world is so
//! small that f(x) and f(x − L) are alike: then the weights themselves add up to 1.

use orograph_graph::{
    Edge, Window, World,
    gpu::{Number, Rows, Scalar},
};

use super::{
    lines::Ends,
    math::{self, smoothstep},
};

/// Across a world that is shorter than so many of the longest waves, a random field is much like itself.
const LEAST_WAVES: f64 = 0.5;

/// How a field changes into itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Weights {
    /// The squares of the weights add up to 1: for random fields whose mean is 0, of waves up to this length.
    Random { longest_m: f64 },
    /// The weights add up to 1: for surfaces.
    Mean,
}

/// The joined sides of a world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Joins {
    size_m: [f64; 2],
    /// The width of the zone in which a field changes; 0 where sides are not joined.
    zone_m: [f64; 2],
    weights: Weights,
}

impl Joins {
    /// The joins of a world, in zones of `zone_m` metres, or of half the world where that is less. None where no sides
    /// are joined.
    #[must_use]
    pub fn of(world: &World, zone_m: f64, weights: Weights) -> Option<Self> {
        let sides = world.boundary;
        let zone = |axis: usize| {
            let is_joined = [[sides.west, sides.east], [sides.north, sides.south]][axis].contains(&Edge::Periodic);
            if is_joined { zone_m.min(0.5 * world.size[axis]) } else { 0.0 }
        };
        let joins = Self { size_m: world.size, zone_m: [zone(0), zone(1)], weights };
        (joins.zone_m != [0.0; 2]).then_some(joins)
    }

    /// The same place of the world between its joined sides.
    #[must_use]
    #[inline]
    pub fn inside(&self, place_m: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|axis| {
            let (at, size) = (place_m[axis], self.size_m[axis]);
            if self.zone_m[axis] > 0.0 { at - size * (at / size).floor() } else { at }
        })
    }

    /// Returns true if a field is another one at a place between the joined sides than without them.
    #[must_use]
    #[inline]
    pub fn changes(&self, inside_m: [f64; 2]) -> bool {
        (0..2).any(|axis| inside_m[axis] > self.size_m[axis] - self.zone_m[axis])
    }

    /// A field at a place of a world with or without joined sides, of which `field` is the value without.
    #[must_use]
    #[inline]
    pub fn apply(joins: Option<&Self>, place_m: [f64; 2], field: impl Fn([f64; 2]) -> f64) -> f64 {
        match joins {
            Some(joins) => joins.blend(place_m, field),
            None => field(place_m),
        }
    }

    /// A field at a place, of which `field` is the value without joined sides.
    #[must_use]
    pub fn blend(&self, place_m: [f64; 2], field: impl Fn([f64; 2]) -> f64) -> f64 {
        let inside = self.inside(place_m);
        if !self.changes(inside) {
            return field(inside);
        }
        let [[west, beyond_west], [north, beyond_north]] = [0, 1].map(|axis| self.weights(axis, inside[axis]));
        let shares = [
            ([0.0, 0.0], west * north),
            ([1.0, 0.0], beyond_west * north),
            ([0.0, 1.0], west * beyond_north),
            ([1.0, 1.0], beyond_west * beyond_north),
        ];
        let value = |(beyond, share): ([f64; 2], f64)| {
            let place = [0, 1].map(|axis: usize| inside[axis] - beyond[axis] * self.size_m[axis]);
            if share == 0.0 { 0.0 } else { share * field(place) }
        };
        shares.into_iter().map(value).sum()
    }

    /// The weights of a field at a place along an axis, and a world further back.
    fn weights(&self, axis: usize, at_m: f64) -> [f64; 2] {
        let zone_m = self.zone_m[axis];
        if zone_m == 0.0 {
            return [1.0, 0.0];
        }
        let share = smoothstep((at_m - (self.size_m[axis] - zone_m)) / zone_m);
        match self.weights {
            Weights::Random { longest_m } if share > 0.0 && self.size_m[axis] >= LEAST_WAVES * longest_m => {
                let angle = std::f64::consts::FRAC_PI_2 * share;
                [math::cos(angle), math::sin(angle)]
            }
            Weights::Random { .. } | Weights::Mean => [1.0 - share, share],
        }
    }
}

/// The numbers of a shader that reads neighbours across joined sides.
pub const NUMBERS: [(&str, Number); 2] = [("k_wraps_x", Number::U32), ("k_wraps_y", Number::U32)];

/// Which axes of a window are joined, for [`NUMBERS`].
#[must_use]
pub fn numbers(window: &Window) -> [(&'static str, Scalar); 2] {
    [0, 1].map(|axis| (NUMBERS[axis].0, Scalar::U32(u32::from(Ends::of(window, axis) == Ends::Wrap))))
}

/// The rows that a pass reads `around` its own: all where they go on at the other end.
#[must_use]
pub fn rows(window: &Window, around: u32) -> Rows {
    if around > 0 && Ends::of(window, 1) == Ends::Wrap { Rows::All } else { Rows::Around(around) }
}

#[cfg(test)]
mod tests {
    use orograph_graph::Boundary;

    use super::*;
    use crate::testing::world;

    fn joined(sides: Boundary) -> World {
        World { boundary: sides, ..world(100, 80, 10.0) }
    }

    /// A field of large values with a slope that no world repeats.
    fn field([x, y]: [f64; 2]) -> f64 {
        math::sin(0.013 * x + 0.7) + math::cos(0.021 * y) + 0.001 * x * math::sin(0.01 * y)
    }

    #[test]
    fn a_field_goes_on_across_joined_sides_with_its_slope() {
        for weights in [Weights::Random { longest_m: 300.0 }, Weights::Random { longest_m: 3e3 }, Weights::Mean] {
            let joins = Joins::of(&joined(Boundary::all(Edge::Periodic)), 200.0, weights).expect("joined sides");
            let at = |place| joins.blend(place, field);
            for along in [3.0, 333.0, 640.0, 790.0] {
                for (here, beyond, step) in [
                    ([1e-6, along], [1000.0 - 1e-6, along], [1.0, 0.0]),
                    ([along, 1e-6], [along, 800.0 - 1e-6], [0.0, 1.0]),
                ] {
                    assert!((at(here) - at(beyond)).abs() < 1e-6, "{weights:?} {along}");
                    // the slope on both sides
                    let [dx, dy] = step.map(|step| 1e-3 * step);
                    let inward = (at([here[0] + dx, here[1] + dy]) - at(here)) / 1e-3;
                    let outward = (at(beyond) - at([beyond[0] - dx, beyond[1] - dy])) / 1e-3;
                    assert!((inward - outward).abs() < 1e-4, "{weights:?} {along}: {inward} {outward}");
                }
                // whole worlds further on
                assert!((at([along, 44.0]) - at([along - 3000.0, 44.0 + 1600.0])).abs() < 1e-9);
            }
            assert_eq!(at([500.0, 300.0]), field([500.0, 300.0]));
        }
    }

    #[test]
    fn other_sides_and_surfaces_of_one_height_stay() {
        assert_eq!(Joins::of(&joined(Boundary::all(Edge::Wall)), 200.0, Weights::Random { longest_m: 300.0 }), None);
        let sides = Boundary { north: Edge::Periodic, south: Edge::Periodic, ..Boundary::all(Edge::Open) };
        let joins = Joins::of(&joined(sides), 1e9, Weights::Mean).expect("joined sides");
        // half of the world, and not along x
        assert_eq!(joins.blend([990.0, 399.0], field), field([990.0, 399.0]));
        assert_ne!(joins.blend([990.0, 600.0], field), field([990.0, 600.0]));
        assert_eq!(joins.blend([-20.0, 30.0], field), field([-20.0, 30.0]));
        for y in [-300.0, 0.0, 399.0, 500.0, 799.9] {
            assert!((joins.blend([5.0, y], |_| 7.0) - 7.0).abs() < 1e-12);
        }
    }
}
