//! Shared by the tests of the whole registry: terrain to feed to nodes, ways to run one node, golden files.

mod bless;
mod counting;
mod draw;
pub mod gpu;
mod land;
mod look;
mod pictures;
pub mod relief;
mod resolution;
mod run;
mod scratch;
pub mod soak;
mod validation;

pub use bless::{blessing, golden_folder, write_golden};
pub use counting::Counting;
pub use draw::Draw;
pub use land::{LAND, SELECTION, world};
pub use look::Look;
pub use pictures::{picture, pictures_folder};
pub use resolution::{Difference, differences};
pub use run::{
    Case, REACHING, STEPPED, cases, data_folder, evaluate, evaluate_window, example, extreme_worlds, inputs, layered,
    lengths, one_step_of_ice, options, others, plain, reaching, set, wired,
};
pub use scratch::{Scratch, scratch, scratch_in, scratches};
pub use validation::{MODELS, PRESETS, root, validation_hash};
