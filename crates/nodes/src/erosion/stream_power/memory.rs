//! What a run holds beside its inputs and outputs, in bytes per cell: during its last step, or while its outputs are
//! made.

use super::{
    Inputs, Method, NODE, Params, Receivers, Wants,
    inland::Inland,
    levels::{Ladder, has_levels},
};
use crate::prelude::*;

/// What a run on the cells of a level or between two of them holds.
pub fn scratch(sizing: &Sizing<'_>) -> u64 {
    let (params, wants) = (Params::read(sizing.params), Wants::among(sizing.wanted));
    let if_wired = |input: &str, bytes: f64| if sizing.is_wired(Inputs::PORTS, input) { bytes } else { 0.0 };
    let when = |is: bool, bytes: f64| if is { bytes } else { 0.0 };
    // a number above 0 makes sediment too, but is not known here: it counts as a wire where sediment is read
    let settles = sizing.is_wired(Inputs::PORTS, "deposition");
    // a level that keeps its state follows the sediment
    let keeps = has_levels(&params) && sizing.wanted.contains(NODE.outputs.len());
    let thickness = wants.sediment || wants.erosion || keeps;
    // outputs with a value per cell
    let given = 4.0 * (wants.count() - usize::from(wants.report)) as f64;
    let has_steps = params.duration > 0.0 || params.method == Method::Analytical;
    let (lowered, flux) =
        (when(has_steps && wants.erosion_rate, 8.0), when(has_steps && (wants.sediment_flux || wants.report), 8.0));

    // heights, areas and sediment, which outputs are made of
    let left = 8.0 + 4.0 + if_wired("rain", 4.0) + when(settles && thickness, 4.0);
    // codes, the order of the drainage, whose room basins and donors have first where no sediment settles
    let land = left
        + 1.0
        + 5.0
        + when(settles, 5.0)
        + if_wired("repose", 4.0)
        // the layer at the surface, and its steepest slope
        + if_wired("strata", 6.0)
        + when(params.receivers == Receivers::RhoInfinity, 1.0)
        + when(settles, 8.0)
        // the mean area of the headwaters, areas that cut floors, the factor of the rock and the slope it stands at
        + when(params.headwater_area > 0.0, 4.0)
        + when(params.valley_width > 0.0, 4.0)
        // how saturated the ground is
        + when(params.headwater_area > 0.0 && params.gullies > 0.0, 4.0)
        // the ground
        + when(params.headwater_area > 0.0 && params.roughness > 0.0, 4.0)
        + when(params.headwater_area > 0.0 && params.headwater_variation > 0.0, 4.0)
        + when(params.variation_size > 0.0 && (params.variation > 0.0 || params.repose_variation > 0.0), 4.0)
        + when(params.variation_size > 0.0 && params.repose_variation > 0.0, 4.0);
    let step = if !has_steps {
        0.0
    } else if params.method == Method::Analytical {
        // the way of each cell and its ancestor, and the land before
        44.0
    } else if settles {
        // heights before, the water's surface, what arrives, which water fills, beds and flux; for powers what was
        // found and tangents
        when(wants.erosion_rate || wants.sediment || keeps, 8.0) + 57.0 + when(params.n != 1.0, 24.0)
    } else {
        2.0 * lowered + flux
    };
    // knolls are drawn out between two steps: heights, directions, an octave, the same drawn out and the sum
    let has_ribs = params.headwater_area > 0.0 && params.roughness > 0.0 && params.ribs > 0.0;
    // where results come from, and what is taken from there
    let is_displaced = params.headwater_area > 0.0 && params.irregularity > 0.0;
    let step = step.max(when(has_ribs, 17.0)).max(when(is_displaced, 16.0 + lowered + flux));
    // outputs are made one after another, and each change is dropped when it has become one
    let before_rate = [wants.height, wants.area, wants.erosion, wants.erosion_rate];
    let before_rate = 4.0 * before_rate.iter().filter(|wanted| **wanted).count() as f64;
    let end = (flux + given).max(when(wants.erosion_rate, lowered + flux + before_rate));
    let inside = sizing.window.len() as f64;
    let (cells, copies, cut) = match Inland::around(sizing.window, &params) {
        // all inputs with the margin, and one output after another without it
        Some(inland) => (inland.cells() as f64, 4.0 * sizing.wired.iter().filter(|wired| **wired).count() as f64, 4.0),
        None => (inside, 0.0, 0.0),
    };
    let during_a_step = cells * (land + step + copies);
    let at_the_end = cells * (left + end + copies) + cut * inside;
    (during_a_step.max(at_the_end) - given * inside).max(0.0) as u64
}

/// The state for a finer level: heights and sediment with the margin, gates and times.
pub fn state(sizing: &Sizing<'_>) -> u64 {
    let params = Params::read(sizing.params);
    if !has_levels(&params) || !Ladder::new(sizing.window, &params).is_level() {
        return 0;
    }
    let cells = Inland::around(sizing.window, &params).map_or(sizing.window.len(), |inland| inland.cells());
    let rasters = if sizing.is_wired(Inputs::PORTS, "deposition") { 4 } else { 2 };
    (4 * rasters * cells + 1024) as u64
}
