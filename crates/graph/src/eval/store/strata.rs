//! Strata as a state: one raster, the offset, and the numbers of the column.

use std::{io, sync::Arc};

use super::entry::damaged;
use crate::{
    colour::Srgb,
    field::Field,
    param::Layer,
    state::State,
    strata::{Column, Strata},
    world::Window,
};

/// Numbers of a layer: thickness, hardness, repose, and red, green and blue.
const PER_LAYER: usize = 6;

/// The state that stands for strata.
pub(super) fn encode(strata: &Strata) -> State {
    let column = strata.column();
    let layer = |layer: &Layer| {
        let [red, green, blue] = layer.colour.0.map(f64::from);
        [layer.thickness, layer.hardness, layer.repose, red, green, blue]
    };
    let head = [column.top_m, f64::from(u8::from(column.repeats)), column.cosine];
    let numbers = head.into_iter().chain(column.layers.iter().flat_map(layer)).collect();
    State { rasters: vec![strata.offset().samples().to_vec()], numbers }
}

/// The strata that a state stands for.
///
/// # Errors
/// When it stands for none.
pub(super) fn decode(mut state: State, window: &Window) -> io::Result<Strata> {
    let wrong = || damaged("does not hold strata");
    let offset = state.rasters.pop().filter(|offset| offset.len() == window.len()).ok_or_else(wrong)?;
    let ([top_m, repeats, cosine], layers) = state.numbers.split_first_chunk().ok_or_else(wrong)?;
    let (layers, rest) = layers.as_chunks::<PER_LAYER>();
    if layers.is_empty() || !rest.is_empty() || !state.rasters.is_empty() {
        return Err(wrong());
    }
    let layer = |[thickness, hardness, repose, red, green, blue]: &[f64; PER_LAYER]| Layer {
        thickness: *thickness,
        hardness: *hardness,
        repose: *repose,
        colour: Srgb([*red, *green, *blue].map(|part| part as u8)),
    };
    let layers = layers.iter().map(layer).collect();
    let column = Column { layers, top_m: *top_m, repeats: *repeats != 0.0, cosine: *cosine };
    Ok(Strata::new(Arc::new(column), Field::new(*window, offset)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::World;

    #[test]
    fn strata_come_back_as_they_were() {
        let window = Window::whole(World { cells: [2, 1], size: [20.0, 10.0], ..World::default() });
        let hard = Layer { thickness: 0.1, hardness: 4.0, repose: 71.5, colour: Srgb([1, 2, 255]) };
        let column = Column { layers: vec![hard, Layer::USUAL], top_m: -3.5, repeats: true, cosine: 0.5 };
        let strata = Strata::new(Arc::new(column), Field::new(window, vec![1.0, -2.0]));
        let state = encode(&strata);
        assert_eq!(decode(state.clone(), &window).expect("strata"), strata);
        for numbers in [0, 2, 3, 8] {
            let cut = State { numbers: state.numbers[..numbers].to_vec(), ..state.clone() };
            assert!(decode(cut, &window).is_err());
        }
        let narrow = Window { cells: [1, 1], ..window };
        assert!(decode(state, &narrow).is_err());
    }
}
