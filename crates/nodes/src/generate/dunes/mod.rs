//! Dunes in closed form: transverse ridges and barchans, with a gentle windward side and a slip face at repose on the
//! lee side.
//!
//! Proportions of barchans after P. Hersen (2004), "On the crescentic shape of barchan dunes": one and a half times as
//! wide as long, about eleven times as wide as high. Differences: profiles are prescribed, not computed from wind and
//! sand.

mod crescents;
mod defects;
mod ridges;

use crate::{numerics::math, prelude::*};

choice! {
    /// Kind of dunes.
    pub enum Form {
        /// Long ridges across the wind: for plenty of sand.
        Transverse = "transverse",
        /// Crescents on bare ground, whose horns point downwind: for little sand.
        Barchan = "barchan",
    }
}

params! {
    /// Kind of dunes.
    form: Form = Form::Transverse, One, ..;
    /// Distance between crests, or the mean distance between crescents.
    wavelength: f64 = 600.0, Metres, 0.1..=1e6, soft 20..=4000;
    /// Height of ridges, or of the largest crescents.
    height: f64 = 36.0, Metres, 0.0..=1e5, soft 1..=300;
    /// Direction that the wind blows towards, clockwise from north.
    azimuth: f64 = 60.0, Degrees, -360.0..=360.0, soft 0..=360;
    /// Angle of the slip face.
    repose: f64 = 33.0, Degrees, 10.0..=45.0, soft 30..=35;
    /// How much ridges wind and vary in height: 0 for straight, even ridges.
    waviness: f64 = 0.5, One, 0.0..=1.0, when form = "transverse";
    /// How many ridges end between two others, or have a gap: 0 for ridges without ends.
    defects: f64 = 0.6, One, 0.0..=1.0, when form = "transverse";
    /// How much crescents differ: in size, in the length of their horns, in direction, and in number from place to place.
    variety: f64 = 0.7, One, 0.0..=1.0, when form = "barchan";
    /// Random seed of the dunes.
    seed: Seed = Seed(0), Count, ..;
}

outputs! {
    /// Height above the ground.
    height: Height;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Dunes",
    version: 3,
    migrations: &[
        Migration { from: 1, steps: &[Step::Keep { name: "variety", value: "0" }] },
        Migration { from: 2, steps: &[Step::Keep { name: "defects", value: "0" }] },
    ],
    category: "generate",
    summary: "Sand dunes: transverse ridges or barchans with slip faces.",
    doc: include_str!("page.md"),
    sources: &[
        "P. Hersen (2004), On the crescentic shape of barchan dunes, European Physical Journal B 37, 507-514",
        "N. Lancaster (1995), Geomorphology of Desert Dunes, Routledge",
        "R. C. Ewing, G. Kocurek and L. W. Lake (2006), Pattern analysis of dune-field parameters, Earth Surface Processes \
         and Landforms 31, 1176-1191",
    ],
    outputs: Given::PORTS,
    params: Params::specs,
    scratch: Scratch::Bytes(scratch),
    cpu: run,
    example: "wavelength: 1800, height: 110, waviness: 0.4",
    ..Node::DEFAULT
};

/// Memory that the kernel needs in addition to its inputs and outputs.
fn scratch(sizing: &Sizing<'_>) -> u64 {
    match Params::read(sizing.params).form {
        // displacement and lowering of crests, and two slopes
        Form::Transverse => sizing.cells(16.0),
        Form::Barchan => 0,
    }
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let params = Params::read(job.params);
    let slip = math::tan(params.repose.to_radians());
    let most_m = match params.form {
        // half of the wavelength is available for the slip face
        Form::Transverse => 0.5 * params.wavelength * slip,
        // no farther than the neighbouring lattice squares
        Form::Barchan => params.wavelength / REACH,
    };
    if params.height > most_m {
        return Err(NodeError::failed_with_hint(
            "the dunes are too high for their distance",
            format!("write `height: {}` or less", orograph_graph::plain((most_m * 10.0).floor() / 10.0)),
        ));
    }
    let samples = match params.form {
        Form::Transverse => params.ridges(job, slip)?,
        Form::Barchan => params.crescents(job, slip)?,
    };
    Ok(Given { height: Some(Field::new(job.window(), samples)) }.into())
}

/// Distance from a barchan's centre to its farthest point, in heights, with a margin.
const REACH: f64 = 9.0;
/// Salts of the noise that bends crests, of the noise that lowers them, and of their ends.
const SALTS: [u32; 3] = [0x6a09_e667, 0xbb67_ae85, 0x3c6e_f372];

/// Returns the index of the lattice square of a position.
fn square(at_m: f64, width_m: f64) -> i64 {
    (at_m / width_m).floor().clamp(-2_147_483_648.0, 2_147_483_647.0) as i64
}

impl Params {
    /// Returns the unit vector of the wind direction.
    fn wind(&self) -> [f64; 2] {
        let azimuth = self.azimuth.to_radians();
        [math::sin(azimuth), -math::cos(azimuth)]
    }
}

#[cfg(test)]
mod tests;
