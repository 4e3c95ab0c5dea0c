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

/// Numbers of a shader with the library `smooth`.
pub const VALUES: &[(&str, Number)] = &[("k_reach", Number::I32), ("k_period", Number::U32), ("k_wraps", Number::U32)];
/// The values of a pass that does not smooth.
pub const NO_VALUES: [(&str, Scalar); 3] =
    [("k_reach", Scalar::I32(0)), ("k_period", Scalar::U32(0)), ("k_wraps", Scalar::U32(0))];
/// Slots of such a shader, in addition to its own: the raster to smooth.
pub const BEFORE: Slot = Slot::cells("before", "f32");
/// The weights.
pub const WEIGHTS: Slot = Slot::words("weights", "f32");
/// The smoothed raster.
pub const AFTER: Slot = Slot::cells("after", "f32").written();

/// The filter alone.
pub static SHADER: Shader = Shader {
    name: "lib/smooth",
    source: wgsl::SMOOTH,
    library: &[wgsl::LINES],
    values: VALUES,
    slots: &[BEFORE, WEIGHTS, AFTER],
};

/// Records the filter with a standard deviation in cells, along rows and then along columns. `share` is the start and
/// end of this part of the job's progress.
///
/// # Errors
/// Those of the recorder.
pub fn smooth(
    job: &Job<'_>,
    recorder: &mut dyn Recorder,
    shader: &'static Shader,
    from: Bind,
    sigma_cells: f64,
    share: [f32; 2],
) -> Result<ScratchId, NodeError> {
    let rasters = [recorder.scratch(Size::Cells)?, recorder.scratch(Size::Cells)?];
    smooth_into(job, recorder, shader, from, sigma_cells, share, rasters)?;
    Ok(rasters[1])
}

/// As [`smooth`], into the second of two rasters by way of the first.
///
/// # Errors
/// Those of the recorder.
pub fn smooth_into(
    job: &Job<'_>,
    recorder: &mut dyn Recorder,
    shader: &'static Shader,
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
        let weights = if exceeds { repeated(&filter, ends.period(n)) } else { once(&filter) };
        let words: Vec<u32> = weights.iter().map(|weight| (*weight as f32).to_bits()).collect();
        let table = recorder.table(&words)?;
        let reach = weights.len() - 1;
        // along columns, ends and repetitions may be far away
        let rows = match (axis, exceeds || ends == Ends::Wrap) {
            (0, _) => Rows::Around(0),
            (_, true) => Rows::All,
            (_, false) => Rows::Around(u32::try_from(reach).unwrap_or(u32::MAX)),
        };
        let period = if exceeds { weights.len() } else { 0 };
        recorder.pass(&Pass {
            shader,
            entry,
            bind: &[("before", before), ("weights", Bind::Scratch(table)), ("after", Bind::Scratch(after))],
            values: &[
                ("k_reach", Scalar::I32(i32::try_from(reach).unwrap_or(i32::MAX))),
                ("k_period", Scalar::U32(u32::try_from(period).unwrap_or(u32::MAX))),
                ("k_wraps", Scalar::U32(u32::from(ends == Ends::Wrap))),
            ],
            over: Over::Cells(rows),
        })?;
        before = Bind::Scratch(after);
        job.advance([0.5 * (share[0] + share[1]), share[1]][axis])?;
    }
    Ok(())
}

/// The weights of the cell itself and of those on either side.
fn once(filter: &Gaussian) -> Vec<f64> {
    let reach = filter.reach();
    let mut lines = vec![[0.0; LANES]; 4 * reach + 1];
    lines[2 * reach][0] = 1.0;
    filter.apply(&mut lines, &mut Vec::new(), 0);
    lines[reach..=2 * reach].iter().map(|lane| lane[0]).collect()
}

/// The weights of lines that repeat after that many cells.
fn repeated(filter: &Gaussian, period: usize) -> Vec<f64> {
    let mut lines = vec![[0.0; LANES]; period];
    lines[0][0] = 1.0;
    filter.apply_to_period(&mut lines, &mut Vec::new());
    lines.iter().map(|lane| lane[0]).collect()
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
        let weights = repeated(&Gaussian::new(300.0), 40);
        assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        assert!((1..40).all(|k| (weights[k] - weights[40 - k]).abs() < 1e-12));
    }
}
