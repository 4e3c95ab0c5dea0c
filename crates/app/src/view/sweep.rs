//! The parameters of the shadow sweep in `shaders/view/shade.wgsl`.

use orograph_nodes::numerics::math;

use super::{sun::Sun, terrain::Terrain};

/// Maximum number of steps of a sweep; larger terrain is swept at every second cell, or fewer.
const MOST_STEPS: u32 = 2048;
/// Radius of the sun's disc in degrees, with a little of the bright sky around it.
const LIMB_DEG: f64 = 0.35;

/// Parallel lines away from the sun.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sweep {
    /// The axis along which steps go: 0 for x, 1 for y.
    pub(super) axis: i32,
    /// True if steps go east or south.
    pub(super) forward: bool,
    /// Number of steps of a line.
    pub(super) steps: u32,
    /// Number of lines.
    pub(super) lines: u32,
    /// Cells per step along the axis.
    pub(super) cells: u32,
    /// Sideways shift of a line per step, in steps.
    pub(super) shift: f64,
    /// Offset of the line through the first cell.
    pub(super) first: f64,
    /// Length of a step in metres.
    pub(super) step_m: f64,
    /// Fall of the light per metre, for the lower and the upper limb of the sun.
    pub(super) fall: [f64; 2],
}

/// Cells per step.
fn stride(terrain: &Terrain) -> u32 {
    let [nx, ny] = terrain.cells();
    nx.max(ny).div_ceil(MOST_STEPS)
}

/// Maximum number of lines and steps of a sweep over this terrain.
pub(super) fn largest(terrain: &Terrain) -> [u32; 2] {
    let stride = stride(terrain);
    let [nx, ny] = terrain.cells().map(|n| (n - 1) / stride + 1);
    [nx + ny + 2, nx.max(ny)]
}

impl Sweep {
    pub(super) fn new(terrain: &Terrain, sun: &Sun) -> Self {
        let towards = sun.towards();
        let level = math::hypot(towards.x, towards.z);
        let away = if level > 1e-9 { [-towards.x / level, -towards.z / level] } else { [1.0, 0.0] };
        let axis = usize::from(away[0].abs() < away[1].abs());
        let stride = stride(terrain);
        let steps = terrain.cells().map(|n| (n - 1) / stride + 1);
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
            step_m: f64::from(stride) * terrain.cell_m() / away[axis].abs(),
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
        let terrain = Terrain::new(&field([90, 40], 20.0, |_, _| 0.0)).expect("heights");
        let [most_lines, most_steps] = largest(&terrain);
        for azimuth in 0..72 {
            let sun = Sun { azimuth_deg: f64::from(azimuth) * 5.0, elevation_deg: 20.0 };
            let sweep = Sweep::new(&terrain, &sun);
            assert!(sweep.lines <= most_lines && sweep.steps <= most_steps && sweep.shift.abs() <= 1.0 + 1e-12);
            let across = f64::from(terrain.cells()[1 - sweep.axis as usize] - 1);
            for step in [0.0, f64::from(sweep.steps - 1)] {
                for minor in [0.0, across] {
                    let line = minor - sweep.shift * step + sweep.first;
                    assert!(line >= -1e-9 && line <= f64::from(sweep.lines - 1) + 1e-9, "{azimuth} {line}");
                }
            }
        }
    }
}
