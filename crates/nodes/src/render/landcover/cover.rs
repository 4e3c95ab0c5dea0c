//! The law of the cover: how much of a place each kind of ground has, and the colour of the whole.

use super::{
    Params,
    reflectance::{BROADLEAF, CONIFER, DARK_SOIL, DEEP_WATER, DRY_GRASS, DRY_SOIL, GRASS, SNOW, WATER_PER_M},
};
use crate::numerics::{math, noise::place::Octaves};

/// Gaps between trees are in shade: light from a forest, as a fraction of that from its leaves.
const CANOPY: f32 = 0.7;
/// Light from wet ground, as a fraction of that from dry ground.
const WET: f32 = 0.55;
/// Depth of water within which the ground beside it is wet, as if it were above the water by that much.
const SHORE_M: f32 = 0.5;
/// Fresh debris is brighter than weathered rock.
const FRESH: f32 = 1.15;

/// What lies at a place.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Ground {
    pub(super) height: f32,
    /// In degrees.
    pub(super) slope: f32,
    /// Reflectance of the rock.
    pub(super) rock: [f32; 3],
    /// Thickness that erosion has removed.
    pub(super) wear: f32,
    /// Thickness of loose material.
    pub(super) deposits: f32,
    /// Drainage area in m².
    pub(super) area: f32,
    pub(super) moisture: f32,
    pub(super) exposed: f32,
    pub(super) snow: f32,
    /// Depth of water.
    pub(super) water: f32,
}

/// The law, for one set of parameters.
pub(super) struct Cover {
    bare_from: f32,
    bare_width: f32,
    tree_line: f32,
    grass_line: f32,
    forest: f32,
    dryness: f32,
    per_wear: f32,
    per_deposit: f32,
    moist_area: f32,
    bare_water: bool,
    /// Patches of forest and grass.
    patches: Octaves,
    /// Woods and open country, which patches gather into, with the weights of both in a patch.
    regions: Octaves,
    weights: [f32; 2],
    /// Changes of tone within them.
    tones: Octaves,
}

impl Cover {
    pub(super) fn new(params: &Params, cell_m: f64, seed: u32) -> Self {
        let octaves = |wavelength_m, [count, salt]: [u32; 2], gain| Octaves {
            wavelength_m,
            count,
            gain,
            cell_m,
            seed: orograph_graph::mix(seed ^ salt),
        };
        Self {
            bare_from: params.bare_from as f32,
            bare_width: (params.bare_to - params.bare_from).max(0.1) as f32,
            tree_line: params.tree_line as f32,
            grass_line: params.grass_line as f32,
            forest: params.forest as f32,
            dryness: params.dryness as f32,
            per_wear: (1.0 / params.wear_depth) as f32,
            per_deposit: (1.0 / params.deposit_depth) as f32,
            moist_area: params.moist_area as f32,
            bare_water: params.bare_water,
            patches: octaves(params.patch_size, [4, 0x51], 0.6),
            regions: octaves(8.0 * params.patch_size, [3, 0x53], 0.8),
            weights: [(1.0 - params.grouping * params.grouping).sqrt(), params.grouping].map(|weight| weight as f32),
            tones: octaves(0.31 * params.patch_size, [4, 0x52], 0.6),
        }
    }

    /// The colour of a place, and its weights of rock, soil and debris, plants, and snow.
    pub(super) fn of(&self, ground: &Ground, place: [f64; 2]) -> [f32; 7] {
        // standard deviations of about 1
        let own = 3.0 * self.patches.at(place) as f32;
        let [alone, together] = self.weights;
        let patch = if together > 0.0 { alone * own + together * 2.6 * self.regions.at(place) as f32 } else { own };
        let tone = 3.0 * self.tones.at(place) as f32;

        let wet = self.moisture(ground, patch);
        let worn = 1.0 - math::lane::exp(-ground.wear * self.per_wear);
        let steep = rise((ground.slope + 2.0 * tone - self.bare_from) / self.bare_width);
        let loose = 1.0 - math::lane::exp(-ground.deposits * self.per_deposit);
        // nothing grows or freezes under water, and all of it counts as soil
        let emerged = if self.bare_water && ground.water > 0.0 { 1.0 - rise(ground.water / SHORE_M) } else { 1.0 };
        let bare = (1.0 - (1.0 - steep) * (1.0 - worn)) * (1.0 - 0.85 * loose);
        let snow = ground.snow * emerged;

        // belts of elevation, uneven by 60 m; exposed ground is like ground some 150 m higher
        let height = ground.height + 60.0 * patch + 150.0 * ground.exposed;
        let grows = 1.0 - rise((height - self.grass_line) / 300.0 + 0.5);
        let timber = 1.0 - rise((height - self.tree_line) / 160.0 + 0.5);
        let soil_left = (1.0 - bare) * (1.0 - 0.6 * loose * (1.0 - wet));
        // a forest covers the share of the patches that the parameter asks for, and more where it is moist
        let share = (self.forest * (1.0 - 0.7 * self.dryness) + 0.35 * wet - 0.3 * ground.exposed).clamp(0.0, 1.0);
        // woods keep to slopes, meadows to level ground
        let place = patch + 0.13 * (ground.slope - 18.0).clamp(-18.0, 18.0);
        let wooded = if share <= 0.0 { 0.0 } else { rise((place - threshold(share)) * 0.8 + 0.5) };
        let trees = wooded * timber * soil_left * emerged;
        let dense = (1.0 - 0.75 * self.dryness * (1.0 - wet) - 0.25 * ground.exposed).clamp(0.0, 1.0);
        let grass = soil_left * grows * dense * rise(0.85 + 0.2 * tone) * emerged;
        let plants = trees + grass * (1.0 - trees);

        let withered = self.dryness * (1.0 - 0.8 * wet) + 0.2 * ground.exposed + 0.08 * tone;
        let straw = withered.max(0.0) * withered.clamp(0.0, 1.0).sqrt();
        // conifers in the upper half of the forest belt
        let conifers = rise((height - self.tree_line) / 900.0 + 1.0 + 0.3 * tone);
        let soil = mix(DRY_SOIL, DARK_SOIL, (0.75 + 0.25 * wet - 0.65 * self.dryness + 0.1 * tone).clamp(0.0, 1.0));
        let scree = ground.rock.map(|part| (part * FRESH).min(1.0));
        let earth = mix(mix(soil, scree, 0.2), scree, loose.max(1.0 - grows));
        let shade = 1.0 + 0.10 * tone;
        let rock = ground.rock.map(|part| part * shade);
        let mut colour = mix(earth, mix(GRASS, DRY_GRASS, straw), grass);
        colour = mix(colour, mix(BROADLEAF, CONIFER, conifers).map(|part| part * CANOPY), trees);
        colour = mix(colour, rock, bare * (1.0 - trees));
        colour = mix(colour, SNOW, snow);
        if ground.water > 0.0 {
            colour = under_water(colour, ground.water);
        }
        let dry = 1.0 - snow;
        let stone = bare * (1.0 - plants) * dry * emerged;
        let green = plants * dry;
        let [red, green_light, blue] = colour.map(|part| part.clamp(0.0, 1.0));
        [red, green_light, blue, stone, (dry - stone - green).max(0.0), green, snow]
    }

    /// How moist the ground is, from 0 to 1.
    fn moisture(&self, ground: &Ground, patch: f32) -> f32 {
        let along = if ground.area > 0.0 {
            rise(0.5 + 0.35 * math::lane::log2(ground.area / self.moist_area) / 3.3)
        } else {
            0.0
        };
        (ground.moisture.max(along) + 0.05 * patch - 0.3 * ground.exposed).clamp(0.0, 1.0)
    }
}

/// The value that a normal variable exceeds with this probability, to 0.05: what a patch must exceed to be wooded.
fn threshold(share: f32) -> f32 {
    // logistic approximation
    let odds = ((1.0 - share) / share).clamp(1e-3, 1e3);
    math::lane::log2(odds) * (std::f32::consts::LN_2 / 1.702)
}

/// Rises smoothly from 0 to 1 between 0 and 1.
fn rise(t: f32) -> f32 {
    math::lane::smoothstep(t)
}

fn mix(a: [f32; 3], b: [f32; 3], share: f32) -> [f32; 3] {
    [0, 1, 2].map(|part| a[part] + (b[part] - a[part]) * share)
}

/// The colour of wet ground through water of a depth: absorbed on the way down and up.
fn under_water(ground: [f32; 3], depth_m: f32) -> [f32; 3] {
    let saturated = rise(depth_m / SHORE_M);
    [0, 1, 2].map(|part| {
        let passes = math::lane::exp(-2.0 * WATER_PER_M[part] * depth_m);
        let bottom = ground[part] * (1.0 + (WET - 1.0) * saturated);
        DEEP_WATER[part] + (bottom - DEEP_WATER[part]) * passes
    })
}
