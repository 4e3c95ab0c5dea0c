//! The Gaussian filter of [`super::gaussian`] on a graphics device: the weights of all its boxes together, cell by cell.
//!
//! One weight for each cell in reach costs more than boxes from about a hundred cells on, but sums of boxes in single
//! precision would drift. Where the filter is longer than the world, the weights of all repetitions are added up first.

use orograph_graph::gpu::{ScratchId, Size};

use super::{
    gaussian::Gaussian,
    lines::{Ends, LANES, LineFilter},
};
use crate::{prelude::*, wgsl};

/// Cells of a tile across and along the lines that are filtered.
const LINES: u32 = 8;
const LENGTH: u32 = 64;

/// The filter.
pub static SHADER: Shader = Shader {
    name: "lib/smooth",
    source: wgsl!("lib/smooth"),
    library: &[wgsl::LINES],
    values: &[("k_reach", Number::I32), ("k_wraps", Number::U32)],
    slots: &[Slot::cells("before", "f32"), Slot::words("weights", "vec4<f32>"), Slot::cells("after", "f32").written()],
};

/// Records the filter with a standard deviation in cells, along rows and then along columns. `share` is the start and
/// end of this part of the job's progress.
///
/// # Errors
/// Those of the recorder.
pub fn smooth(
    job: &Job<'_>,
    recorder: &mut dyn Recorder,
    from: Bind,
    sigma_cells: f64,
    share: [f32; 2],
) -> Result<ScratchId, NodeError> {
    let rasters = [recorder.scratch(Size::Cells)?, recorder.scratch(Size::Cells)?];
    smooth_into(job, recorder, from, sigma_cells, share, rasters)?;
    Ok(rasters[1])
}

/// As [`smooth`], into the second of two rasters by way of the first.
///
/// # Errors
/// Those of the recorder.
pub fn smooth_into(
    job: &Job<'_>,
    recorder: &mut dyn Recorder,
    from: Bind,
    sigma_cells: f64,
    share: [f32; 2],
    rasters: [ScratchId; 2],
) -> Result<(), NodeError> {
    let (window, filter) = (job.window(), Gaussian::new(sigma_cells));
    let mut before = from;
    for (axis, (entry, after)) in ["smooth_x", "smooth_y"].into_iter().zip(rasters).enumerate() {
        let (n, world) = (window.cells[axis] as usize, window.world.cells[axis] as usize);
        let (ends, exceeds) = (Ends::of(&window, axis), filter.exceeds(world));
        let table = table(if exceeds { repeated(&filter, ends.period(n)) } else { once(&filter) });
        let weights = recorder.table(&table)?;
        let reach = u32::try_from(table.len() - 4).unwrap_or(u32::MAX);
        // along columns, ends and repetitions may be far away
        let rows = match (axis, exceeds || ends == Ends::Wrap) {
            (0, _) => Rows::Around(0),
            (_, true) => Rows::All,
            // cells are read in parts as long as a tile
            (_, false) => Rows::Around(reach.saturating_add(LENGTH)),
        };
        recorder.pass(&Pass {
            shader: &SHADER,
            entry,
            bind: &[("before", before), ("weights", Bind::Scratch(weights)), ("after", Bind::Scratch(after))],
            values: &[
                ("k_reach", Scalar::I32(i32::try_from(reach).unwrap_or(i32::MAX))),
                ("k_wraps", Scalar::U32(u32::from(ends == Ends::Wrap))),
            ],
            over: Over::Tiles([[LENGTH, LINES], [LINES, LENGTH]][axis], rows),
        })?;
        before = Bind::Scratch(after);
        job.advance([0.5 * (share[0] + share[1]), share[1]][axis])?;
    }
    Ok(())
}

/// The words of weights: first that of the cell itself, then those of the cells on either side, four at a time.
fn table(mut weights: Vec<f64>) -> Vec<u32> {
    let middle = [weights.remove(0), 0.0, 0.0, 0.0];
    // a turn looks at four cells at least
    weights.resize(weights.len().next_multiple_of(4).max(4), 0.0);
    middle.iter().chain(&weights).map(|weight| (*weight as f32).to_bits()).collect()
}

/// The weights of the cell itself and of those on either side.
fn once(filter: &Gaussian) -> Vec<f64> {
    let reach = filter.reach();
    let mut lines = vec![[0.0; LANES]; 4 * reach + 1];
    lines[2 * reach][0] = 1.0;
    filter.apply(&mut lines, &mut Vec::new(), 0);
    lines[reach..=2 * reach].iter().map(|lane| lane[0]).collect()
}

/// The same of lines that repeat after that many cells, within one period: half a period away on either side is the same
/// cell.
fn repeated(filter: &Gaussian, period: usize) -> Vec<f64> {
    let mut lines = vec![[0.0; LANES]; period];
    lines[0][0] = 1.0;
    filter.apply_to_period(&mut lines, &mut Vec::new());
    let share = |k: usize| if k > 0 && 2 * k == period { 0.5 } else { 1.0 };
    (0..=period / 2).map(|k| share(k) * lines[k][0]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_add_up_to_one_and_fall_on_either_side() {
        for sigma in [0.0, 0.7, 3.9, 4.0, 23.0] {
            let weights = once(&Gaussian::new(sigma));
            let sum = weights[0] + 2.0 * weights[1..].iter().sum::<f64>();
            assert!((sum - 1.0).abs() < 1e-12, "{sigma}: {sum}");
            assert!(weights.windows(2).all(|pair| pair[0] >= pair[1]), "{sigma}");
        }
        for period in [1, 2, 39, 40] {
            let weights = repeated(&Gaussian::new(300.0), period);
            let sum = weights[0] + 2.0 * weights[1..].iter().sum::<f64>();
            assert!((sum - 1.0).abs() < 1e-12, "{period}: {sum}");
        }
    }
}
