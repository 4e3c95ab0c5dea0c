//! Random numbers and parameters from a seed.

use orograph_graph::{Kind, ParamValue, mix};

use crate::run::options;

/// Random numbers from a seed.
#[derive(Clone, Debug)]
pub struct Draw(pub u32);

impl Draw {
    fn next(&mut self) -> u32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9);
        mix(self.0)
    }

    /// A random number below another.
    pub fn below(&mut self, end: usize) -> usize {
        self.next() as usize % end
    }

    /// A random number from 0 to 1.
    pub fn share(&mut self) -> f64 {
        f64::from(self.next()) / f64::from(u32::MAX)
    }

    /// One of a list.
    pub fn one<T: Clone>(&mut self, of: &[T]) -> T {
        of[self.below(of.len())].clone()
    }

    /// A random parameter value: from the range of its slider, sometimes an end of the hard range. Returns None to
    /// leave the default.
    pub fn value(&mut self, kind: &Kind) -> Option<ParamValue> {
        let (kept, extreme) = (self.share() < 0.4, self.share() < 0.15);
        let share = self.share();
        match kind {
            _ if kept => None,
            Kind::Float { hard, .. } if extreme => Some(ParamValue::Float(self.one(hard))),
            Kind::Float { soft: [low, high], .. } => Some(ParamValue::Float(low + share * (high - low))),
            Kind::Int { soft: [low, high], .. } => {
                Some(ParamValue::Int((low + (share * (high - low + 1) as f64) as i64).min(*high)))
            }
            Kind::Seed { .. } => Some(ParamValue::Seed(self.next())),
            Kind::Choice { .. } | Kind::Bool { .. } => Some(self.one(&options(kind))),
            _ => None,
        }
    }
}
