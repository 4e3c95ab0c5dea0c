//! The numbers of a kernel of many passes, and sides of the world as shaders number them.

use std::ops::Deref;

use orograph_graph::Edge;

use crate::prelude::{Number, Scalar};

/// The numbers that the shaders of a kernel have besides those of the declaration, in one order.
pub(crate) struct Numbers(Vec<(&'static str, Scalar)>);

impl Numbers {
    /// All of them 0.
    pub fn new(values: &[(&'static str, Number)]) -> Self {
        let zero = |number| match number {
            Number::F32 => Scalar::F32(0.0),
            Number::I32 => Scalar::I32(0),
            Number::U32 => Scalar::U32(0),
        };
        Self(values.iter().map(|&(name, number)| (name, zero(number))).collect())
    }

    /// Changes one.
    pub fn put(&mut self, name: &str, value: Scalar) {
        let known = self.0.iter_mut().find(|(known, _)| *known == name);
        debug_assert!(known.is_some(), "no shader has a number `{name}`");
        if let Some((_, known)) = known {
            *known = value;
        }
    }
}

impl Deref for Numbers {
    type Target = [(&'static str, Scalar)];

    fn deref(&self) -> &Self::Target {
        &self.0
    }
}

/// A side of the world as `shaders/lib/sides` numbers it.
pub(crate) const fn side(edge: Edge) -> Scalar {
    Scalar::U32(match edge {
        Edge::Open | Edge::Inland => 0,
        Edge::Base => 1,
        Edge::Wall => 2,
        Edge::Periodic => 3,
    })
}
