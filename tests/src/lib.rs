//! Shared by the tests of the whole registry: terrain to feed to nodes, ways to run one node, golden files.

mod bless;
mod counting;
mod land;
mod look;
mod pictures;
mod resolution;
mod run;
mod scratch;
mod valleys;

pub use bless::{blessing, golden_folder, write_golden};
pub use counting::Counting;
pub use land::{LAND, SELECTION, world};
pub use look::Look;
pub use pictures::{picture, pictures_folder};
pub use resolution::{Difference, differences};
pub use run::{
    Case, REACHING, cases, data_folder, evaluate, evaluate_window, example, inputs, options, others, pictured, plain,
    reaching, set, wired,
};
pub use scratch::{Scratch, scratch, scratches};
pub use valleys::Valleys;
