//! Steps from an older version of a node's declaration to the next.

/// One step: the change to a file written for version `from` that keeps its meaning in version `from + 1`.
#[derive(Clone, Copy, Debug)]
pub struct Migration {
    /// The version it starts from.
    pub from: u32,
    /// The changes.
    pub steps: &'static [Step],
}

/// A change that a migration makes to the arguments of a node in a file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Step {
    /// A parameter or an input has a new name.
    Rename {
        /// The old name.
        from: &'static str,
        /// The new name.
        to: &'static str,
    },
    /// A default changed: write the old one, as RON, if the file has no value.
    Keep {
        /// The parameter or input.
        name: &'static str,
        /// Its old default.
        value: &'static str,
    },
    /// A parameter or an input without effect was removed.
    Drop {
        /// Its name.
        name: &'static str,
    },
    /// A number is now in another unit.
    Scale {
        /// The parameter or input.
        name: &'static str,
        /// Factor from the old value to the new.
        factor: f64,
    },
    /// A sea level of a node is now the world's `sea_level`. If neither the world nor another node has one, the world
    /// takes this one; contradicting levels are a problem of the file.
    SeaLevel {
        /// The name of the old parameter.
        name: &'static str,
        /// Its old default: at or below it there was no sea.
        none: f64,
    },
}
