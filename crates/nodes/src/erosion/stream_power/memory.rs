//! What a run holds beside its inputs and outputs, in bytes per cell, at the largest of its stages.

use super::{Inputs, Method, Params, Receivers, Schedule, Wants};
use crate::prelude::*;

/// The scratch of the node.
pub fn scratch(sizing: &Sizing<'_>) -> u64 {
    let (params, wants) = (Params::read(sizing.params), Wants::among(sizing.wanted));
    let if_wired = |input: &str, bytes: f64| if sizing.is_wired(Inputs::PORTS, input) { bytes } else { 0.0 };
    let when = |is: bool, bytes: f64| if is { bytes } else { 0.0 };
    // a number above 0 makes sediment too, but is not known here: it counts as a wire where sediment is read
    let settles = sizing.is_wired(Inputs::PORTS, "deposition");
    let given = 4.0 * wants.count() as f64;
    let (lowered, flux) = (when(wants.erosion_rate, 8.0), when(wants.sediment_flux, 8.0));

    // heights, codes, basins with donors, the order of the drainage, areas
    let land = 8.0
        + 1.0
        + 5.0
        + 5.0
        + 4.0
        + if_wired("rain", 4.0)
        + if_wired("repose", 4.0)
        + when(params.receivers == Receivers::RhoInfinity, 1.0)
        + when(settles, 8.0 + when(wants.sediment, 4.0));
    let step = if params.method == Method::Analytical {
        // the way of each cell and its ancestor
        40.0
    } else if settles {
        // heights before, the water's surface, what arrives, beds and flux; for powers what was found and tangents
        when(wants.erosion_rate || wants.sediment, 8.0) + 56.0 + when(params.n != 1.0, 24.0)
    } else {
        lowered + flux + when(wants.erosion_rate, 8.0)
    };
    let wired = sizing.wired.iter().filter(|wired| **wired).count() as f64;
    let coarse = when(
        params.method == Method::Implicit && params.schedule == Schedule::CoarseToFine,
        // a land of a quarter of the cells and its inputs, and the heights that it gives
        0.25 * (land + 4.0 * wired) + 8.0,
    );
    // outputs are made one after another, and each change is dropped when it has become one
    let before_rate = [wants.height, wants.area, wants.erosion, wants.erosion_rate];
    let before_rate = 4.0 * before_rate.iter().filter(|wanted| **wanted).count() as f64;
    let end = (flux + given).max(when(wants.erosion_rate, lowered + flux + before_rate));
    sizing.cells(land + step.max(coarse).max(end) - given)
}
