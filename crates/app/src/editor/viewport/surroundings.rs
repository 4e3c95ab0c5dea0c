//! What a picture on the map depends on besides the output that it shows.

use orograph_graph::{Field, PortType};

use super::{
    Shown,
    look::Look,
    shown::{finer, shown},
    surface::Parts,
};
use crate::{editor::Session, export::picture};

/// The port, the revision, the step and the cells of an output.
pub(super) type Age = (String, u64, u64, [u32; 2]);

/// The outputs around the shown one.
#[derive(Clone, Default)]
pub(super) struct Surroundings {
    beside: Beside,
    /// The depth of the water on heights.
    water: Option<Shown>,
}

#[derive(Clone, Default)]
enum Beside {
    #[default]
    Nothing,
    /// Heights on the other side of a comparison, which share the tints.
    Compared(Shown),
    /// The terrain on which a mask or numbers lie, or a finer part of it, and the whole, which the light fits.
    Ground { part: Shown, whole: Shown },
}

impl Surroundings {
    /// What belongs to an output on the map with these settings; `other` is what it is compared with.
    pub(super) fn of(session: &Session, look: &Look, shown: &Shown, other: Option<&Shown>) -> Self {
        let named = |name: Option<String>| self::shown(session, &name?);
        match shown.ty {
            PortType::Height => Self {
                beside: other
                    .filter(|other| other.ty == PortType::Height)
                    .map_or(Beside::Nothing, |other| Beside::Compared(other.clone())),
                water: named(Parts::water_of(session, shown.name(), look)),
            },
            PortType::Mask | PortType::Scalar(_) => Self {
                beside: named(Parts::ground_of(session, &shown.port))
                    .map_or(Beside::Nothing, |whole| Beside::Ground { part: whole.clone(), whole }),
                water: None,
            },
            _ => Self::default(),
        }
    }

    /// The same with finer parts, as far as they are built.
    pub(super) fn finer(&self, session: &Session) -> Self {
        let finest = |whole: &Shown| finer(session, whole).unwrap_or_else(|| whole.clone());
        let beside = match &self.beside {
            Beside::Ground { whole, .. } => Beside::Ground { part: finest(whole), whole: whole.clone() },
            other => other.clone(),
        };
        Self { beside, water: self.water.as_ref().map(finest) }
    }

    /// The outputs below and on the shown one.
    pub(super) fn names(&self) -> impl Iterator<Item = String> {
        let under = match &self.beside {
            Beside::Ground { whole, .. } => Some(whole),
            Beside::Compared(_) | Beside::Nothing => None,
        };
        under.into_iter().chain(&self.water).map(|part| part.port.clone())
    }

    /// The age of what is beside and of the water.
    pub(super) fn ages(&self) -> [Option<Age>; 2] {
        let age = |part: &Shown| (part.port.clone(), part.revision, part.step, part.field.window().cells);
        let beside = match &self.beside {
            Beside::Nothing => None,
            Beside::Compared(part) | Beside::Ground { part, .. } => Some(part),
        };
        [beside, self.water.as_ref()].map(|part| part.map(age))
    }

    /// Their samples, around those of the `whole` shown output.
    pub(super) fn fields<'a>(&'a self, whole: &'a Field) -> picture::Around<'a> {
        let beside = match &self.beside {
            Beside::Nothing => picture::Beside::Nothing,
            Beside::Compared(heights) => picture::Beside::Compared(&heights.field),
            Beside::Ground { part, whole } => picture::Beside::Ground { part: &part.field, whole: &whole.field },
        };
        picture::Around { whole, beside, water: self.water.as_ref().map(|water| &water.field) }
    }
}
