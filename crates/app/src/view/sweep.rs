//! How the sun's shadows are swept over the land: the numbers that `shaders/view/shade.wgsl` needs.

use orograph_nodes::numerics::math;

use super::{land::Land, sun::Sun};

/// The most steps of a sweep; larger land is swept at every second cell, or more seldom.
const MOST_STEPS: u32 = 2048;
/// Half the sun's disc in degrees, with a little of the bright sky around it.
const LIMB_DEG: f64 = 0.35;

/// Lines of sight away from the sun.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sweep {
    /// 0 where steps go along x, 1 along y.
    pub(super) axis: i32,
    /// Whether steps go towards the east or the south.
    pub(super) forward: bool,
    /// Steps of a line.
    pub(super) steps: u32,
    /// Lines.
    pub(super) lines: u32,
    /// Cells of a step along the axis.
    pub(super) cells: u32,
    /// Sideways shift of a line from step to step, in steps.
    pub(super) shift: f64,
    /// Where the line through the first cell begins.
    pub(super) first: f64,
    /// Metres of a step.
    pub(super) step_m: f64,
    /// Fall of a line of sight a metre, for the lower and the upper limb of the sun.
    pub(super) fall: [f64; 2],
}

/// Cells of a step.
fn stride(land: &Land) -> u32 {
    let [nx, ny] = land.cells();
    nx.max(ny).div_ceil(MOST_STEPS)
}

/// Lines and steps of the largest sweep that a land may need.
pub(super) fn largest(land: &Land) -> [u32; 2] {
    let stride = stride(land);
    let [nx, ny] = land.cells().map(|n| (n - 1) / stride + 1);
    [nx + ny + 2, nx.max(ny)]
}

impl Sweep {
    pub(super) fn new(land: &Land, sun: &Sun) -> Self {
        let towards = sun.towards();
        let level = math::hypot(towards.x, towards.z);
        let away = if level > 1e-9 { [-towards.x / level, -towards.z / level] } else { [1.0, 0.0] };
        let axis = usize::from(away[0].abs() < away[1].abs());
        let stride = stride(land);
        let steps = land.cells().map(|n| (n - 1) / stride + 1);
        let shift = away[1 - axis] / away[axis].abs();
        let across = shift * f64::from(steps[axis] - 1);
        let height = sun.elevation_deg.clamp(0.5, 89.0);
        Self {
            axis: axis as i32,
            forward: away[axis] > 0.0,
            steps: steps[axis],
            lines: steps[1 - axis] + across.abs().ceil() as u32 + 1,
            cells: stride,
            shift,
            first: across.max(0.0),
            step_m: f64::from(stride) * land.cell_m() / away[axis].abs(),
            fall: [-LIMB_DEG, LIMB_DEG].map(|limb| math::tan((height + limb).to_radians())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::field;

    #[test]
    fn lines_pass_every_cell_at_every_azimuth() {
        let land = Land::new(&field([90, 40], 20.0, |_, _| 0.0)).expect("heights");
        let [most_lines, most_steps] = largest(&land);
        for azimuth in 0..72 {
            let sun = Sun { azimuth_deg: f64::from(azimuth) * 5.0, elevation_deg: 20.0 };
            let sweep = Sweep::new(&land, &sun);
            assert!(sweep.lines <= most_lines && sweep.steps <= most_steps && sweep.shift.abs() <= 1.0 + 1e-12);
            let across = f64::from(land.cells()[1 - sweep.axis as usize] - 1);
            for step in [0.0, f64::from(sweep.steps - 1)] {
                for minor in [0.0, across] {
                    let line = minor - sweep.shift * step + sweep.first;
                    assert!(line >= -1e-9 && line <= f64::from(sweep.lines - 1) + 1e-9, "{azimuth} {line}");
                }
            }
        }
    }
}
