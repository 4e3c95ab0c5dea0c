//! Memory of `Flow` in addition to its inputs and outputs, in bytes per cell, at the stage that needs the most.

use super::{Inputs, Params, Routing, Sinks, Wants};
use crate::prelude::Sizing;

/// Bytes per cell for the number of missing donors and the order of cells.
const DRAINAGE: f64 = 5.0;
/// Bytes per cell for the fractions from its eight neighbours, the set of its receivers, and the number of missing
/// donors.
const SHARES: f64 = 34.0;

/// Returns the scratch memory of the node.
pub fn scratch(sizing: &Sizing<'_>) -> u64 {
    let (params, wants) = (Params::read(sizing.params), Wants::among(sizing.wanted));
    let when = |is: bool, bytes: f64| if is { bytes } else { 0.0 };
    let [area, discharge] = [wants.area || wants.flow, wants.discharge || wants.flow];
    let fills = wants.flow || wants.conditioned || wants.lake_depth || wants.lake;
    let spreads = (area || discharge) && params.routing != Routing::D8;
    let finds = fills || params.depressions != Sinks::Keep;

    // codes; labels and donors of basins
    let found = 1.0 + when(finds, 5.0);
    let crossed = when(params.depressions == Sinks::Fill, 4.0);
    let level = when(fills || spreads && params.depressions != Sinks::Keep, 4.0);
    // the cut bed and the sills
    let filled = level + when(level > 0.0 && params.depressions == Sinks::Breach, 5.0);

    let uneven = sizing.is_wired(Inputs::PORTS, "runoff");
    let (sums, order) = match (spreads, uneven && discharge) {
        (true, _) => (8.0, SHARES),
        (false, false) => (4.0, DRAINAGE),
        (false, true) => (if area { 16.0 } else { 8.0 }, DRAINAGE),
    };
    let order = order + when(params.depressions == Sinks::Jump, sums);
    let gathered = when(area, 4.0) + when(discharge, 4.0);
    // with dispersed flow and variable runoff, the area exists before the discharge is summed
    let early = when(spreads && uneven && area && discharge, 4.0);
    let gathers = when(area || discharge, (sums + order + early).max(sums + gathered));

    let depth = when(wants.lake_depth || wants.lake, 4.0);
    let direction = when(wants.direction || wants.flow, 4.0);
    let end = gathered + depth + when(wants.lake, 4.0) + direction + when(wants.flow, 16.0);

    // the flow output has four planes, the others one
    let given = 4.0 * wants.count() as f64 + when(wants.flow, 12.0);
    let peak = found + crossed.max(filled).max(level + gathers.max(end));
    sizing.cells((peak - given).max(0.0))
}
