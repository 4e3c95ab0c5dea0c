//! Steps from an older version of a node's declaration to the next.

/// One step: what a file written for version `from` must say to mean the same in version `from + 1`.
#[derive(Clone, Copy, Debug)]
pub struct Migration {
    /// The version it starts from.
    pub from: u32,
    /// What changes.
    pub steps: &'static [Step],
}

/// A change that a migration makes to what a file says of a node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Step {
    /// A parameter or an input has a new name.
    Rename {
        /// The old name.
        from: &'static str,
        /// The new name.
        to: &'static str,
    },
    /// A default changed: write the old one, as RON, where the file says nothing.
    Keep {
        /// The parameter or input.
        name: &'static str,
        /// Its old default.
        value: &'static str,
    },
    /// A parameter or an input is gone and had no effect.
    Drop {
        /// Its name.
        name: &'static str,
    },
    /// A number is now in another unit.
    Scale {
        /// The parameter or input.
        name: &'static str,
        /// New value for each old one.
        factor: f64,
    },
    /// A level of the sea is now the world's `sea_level`. Where neither the file nor another node says it, the world takes the
    /// node's; a disagreement is a problem of the file.
    SeaLevel {
        /// The parameter that it was.
        name: &'static str,
        /// Its old default: up to it there was no sea.
        none: f64,
    },
}
