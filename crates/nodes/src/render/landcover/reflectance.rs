//! Reflectances of rock, soil, plants, snow and water in red, green and blue light.
//!
//! Linear sRGB under daylight (D65), computed with the colour matching functions of C. Wyman, P.-P. Sloan and P.
//! Shirley (2013) from spectra of the ECOSTRESS library: S. K. Meerdink, S. J. Hook, D. A. Roberts and E. A. Abbott,
//! 2019, The ECOSTRESS spectral library version 1.0, Remote Sensing of Environment 230, 111196. Rocks are medians of 3
//! to 26 samples of a kind; the others are single samples. Water absorbs as measured by R. M. Pope and E. S. Fry, 1997,
//! Absorption spectrum of pure water, Applied Optics 36, 8710-8723.

use orograph_graph::choice;

choice! {
    /// Kinds of rock, by colour.
    pub enum Rock {
        /// Felsic plutonic rock: pale, pinkish.
        Granite = "granite",
        /// Banded metamorphic rock: pale grey.
        Gneiss = "gneiss",
        /// Dark foliated rock.
        Schist = "schist",
        /// Dark mafic lava.
        Basalt = "basalt",
        /// Grey intermediate lava.
        Andesite = "andesite",
        /// Pale, warm grey.
        Limestone = "limestone",
        /// Tan.
        Sandstone = "sandstone",
        /// Stained by iron oxide.
        RedSandstone = "red_sandstone",
        /// Dark grey.
        Shale = "shale",
    }
}

impl Rock {
    /// Its reflectance.
    pub const fn reflectance(self) -> [f32; 3] {
        match self {
            Self::Granite => [0.342, 0.277, 0.229],
            Self::Gneiss => [0.321, 0.305, 0.272],
            Self::Schist => [0.114, 0.097, 0.090],
            Self::Basalt => [0.108, 0.105, 0.095],
            Self::Andesite => [0.224, 0.212, 0.187],
            Self::Limestone => [0.278, 0.216, 0.169],
            Self::Sandstone => [0.331, 0.217, 0.165],
            Self::RedSandstone => [0.373, 0.157, 0.105],
            Self::Shale => [0.155, 0.154, 0.134],
        }
    }
}

/// Dry light yellowish brown clay.
pub const DRY_SOIL: [f32; 3] = [0.490, 0.367, 0.210];
/// Moist black loam.
pub const DARK_SOIL: [f32; 3] = [0.080, 0.047, 0.020];
/// Green grass.
pub const GRASS: [f32; 3] = [0.074, 0.092, 0.035];
/// Dry grass.
pub const DRY_GRASS: [f32; 3] = [0.395, 0.296, 0.196];
/// Deciduous trees.
pub const BROADLEAF: [f32; 3] = [0.061, 0.094, 0.055];
/// Conifers.
pub const CONIFER: [f32; 3] = [0.056, 0.093, 0.045];
/// Snow of medium grains.
pub const SNOW: [f32; 3] = [0.968, 0.982, 0.985];
/// What deep clear water scatters back.
pub const DEEP_WATER: [f32; 3] = [0.008, 0.022, 0.036];
/// Absorption of pure water at 650, 550 and 450 nm, per metre (Pope and Fry 1997), with 0.05 for what floats in it.
pub const WATER_PER_M: [f32; 3] = [0.34 + 0.05, 0.0565 + 0.05, 0.0092 + 0.05];
