//! The inner loops of shallow ice: slopes, faces and tridiagonal systems.

use crate::numerics::simd::simd;

/// Systems that are solved side by side.
pub(super) const LANES: usize = 8;

/// Density of ice times gravity, in Pa/m: 910 kg/m³ and 9.81 m/s².
pub(super) const WEIGHT: f64 = 910.0 * 9.81;

/// How ice flows.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rheology {
    /// Γ, in m⁻³ yr⁻¹.
    pub deformation: f64,
    /// Σ, in m⁻² yr⁻¹.
    pub sliding: f64,
    /// Yield stress over the weight of ice, in metres; infinite for none.
    pub yield_m: f64,
}

impl Rheology {
    /// From Glen's rate factor in Pa⁻³ yr⁻¹, the sliding coefficient in m yr⁻¹ Pa⁻³ and the yield stress in Pa.
    pub fn new(rate_factor: f64, sliding: f64, yield_pa: f64) -> Self {
        let cubed = WEIGHT * WEIGHT * WEIGHT;
        Self { deformation: 0.4 * rate_factor * cubed, sliding: sliding * cubed, yield_m: yield_pa / WEIGHT }
    }
}

/// The difference of two surfaces, at most the thickness of the higher one.
#[inline(always)]
fn difference(level: f64, depth: f64, other: f64, below: f64) -> f64 {
    let drop = level - other;
    let most = if drop < depth { drop } else { depth };
    if most > -below { most } else { -below }
}

simd! {
    /// The slope at cells from the three surfaces and thicknesses along a line.
    pub(super) fn tilts(levels: [&[f64]; 3], depths: [&[f64]; 3], half_inverse: f64, out: &mut [f64]) {
        let count = out.len();
        let [l0, l1, l2] = levels.map(|row| &row[..count]);
        let [d0, d1, d2] = depths.map(|row| &row[..count]);
        for i in 0..count {
            let one = difference(l0[i], d0[i], l1[i], d1[i]);
            let two = difference(l1[i], d1[i], l2[i], d2[i]);
            out[i] = (one + two) * half_inverse;
        }
    }
}

simd! {
    /// Fluxes through faces, and their derivatives by the thickness before and (negative) after the face. `depths` are
    /// those of two cells before and two after it, `levels` and `across`, the slope along the face, of one before and
    /// one after.
    pub(super) fn faces(
        rheology: &Rheology,
        depths: [&[f64]; 4],
        levels: [&[f64]; 2],
        across: [&[f64]; 2],
        inverse: f64,
        out: [&mut [f64]; 3],
    ) {
        let [flux, gain, loss] = out;
        let count = flux.len();
        let (gain, loss) = (&mut gain[..count], &mut loss[..count]);
        let [d0, d1, d2, d3] = depths.map(|row| &row[..count]);
        let [l1, l2] = levels.map(|row| &row[..count]);
        let [a0, a1] = across.map(|row| &row[..count]);
        let (deformation, sliding, yield_m) = (rheology.deformation, rheology.sliding, rheology.yield_m);
        for i in 0..count {
            let drop = l1[i] - l2[i];
            let forward = drop > 0.0;
            // loaded in any case: with loads in the branches, the compiler gathers from addresses
            let [d0, d1, d2, d3] = [d0[i], d1[i], d2[i], d3[i]];
            let up = if forward { d1 } else { d2 };
            let down = if forward { d2 } else { d1 };
            let behind = if forward { d0 } else { d3 };
            let (rise, fall) = (up - behind, down - up);
            let product = rise * fall;
            let slope = if product > 0.0 { product / (rise + fall) } else { 0.0 };
            let depth = up + slope;
            let depth = if depth > 0.0 { depth } else { 0.0 };

            let normal = drop * inverse;
            let tilt = 0.5 * (a0[i] + a1[i]);
            let own = normal * normal;
            let square = own + tilt * tilt;
            let most = yield_m / depth;
            let most = most * most;
            let yields = square > most;
            let square = if yields { most } else { square };
            let squared = depth * depth;
            let shear = deformation * depth;
            let conductance = squared * squared * (shear + sliding);
            // nothing flows from nothing, however large `most` is
            let diffusivity = if depth > 0.0 { conductance * square } else { 0.0 };
            let growth = if yields { 0.0 } else { 2.0 * own * conductance };
            let powers = if yields { 3.0 * shear + 2.0 * sliding } else { 5.0 * shear + 4.0 * sliding };
            let stiff = (diffusivity + growth) * inverse;
            let size = if forward { normal } else { -normal };
            let wave = if depth > 0.0 { powers * squared * depth * square * size } else { 0.0 };
            flux[i] = diffusivity * normal;
            gain[i] = if forward { stiff + wave } else { stiff };
            loss[i] = if forward { stiff } else { stiff + wave };
        }
    }
}

/// Eight tridiagonal systems.
pub(super) struct Lines {
    /// The right-hand sides, and after [`Self::solve`] the solutions.
    pub right: Vec<[f64; LANES]>,
    diagonal: Vec<[f64; LANES]>,
    other: Vec<[f64; LANES]>,
}

impl Lines {
    pub fn new(count: usize) -> Self {
        let zeros = || vec![[0.0; LANES]; count];
        Self { right: zeros(), diagonal: zeros(), other: zeros() }
    }

    /// Solves (1 + r (gₖ₊₁ + lₖ)) δₖ − r gₖ δₖ₋₁ − r lₖ₊₁ δₖ₊₁ = `right`ₖ for the first `count` cells, with r the `scale`,
    /// cyclically if the line `wraps`. A line that wraps must have three cells, or gains and losses of 0.
    pub fn solve(&mut self, count: usize, [gains, losses]: [&[[f64; LANES]]; 2], scale: f64, wraps: bool) {
        let faces = [&gains[..=count], &losses[..=count]];
        let (right, diagonal) = (&mut self.right[..count], &mut self.diagonal[..count]);
        if wraps && count >= 3 {
            cyclic(right, diagonal, &mut self.other[..count], faces, scale);
        } else {
            open(right, diagonal, faces, scale);
        }
    }
}

simd! {
    fn open(
        right: &mut [[f64; LANES]],
        diagonal: &mut [[f64; LANES]],
        faces: [&[[f64; LANES]]; 2],
        scale: f64,
    ) {
        assemble(diagonal, faces, scale);
        eliminate(right, diagonal, faces, scale);
    }
}

simd! {
    /// By the formula of Sherman and Morrison.
    fn cyclic(
        right: &mut [[f64; LANES]],
        diagonal: &mut [[f64; LANES]],
        other: &mut [[f64; LANES]],
        faces: [&[[f64; LANES]]; 2],
        scale: f64,
    ) {
        let last = right.len() - 1;
        let mut corners = [[0.0; LANES]; 3];
        let adjust = |diagonal: &mut [[f64; LANES]], corners: &mut [[f64; LANES]; 3]| {
            assemble(diagonal, faces, scale);
            for lane in 0..LANES {
                let pivot = -diagonal[0][lane];
                let (top, bottom) = (-scale * faces[0][0][lane], -scale * faces[1][last + 1][lane]);
                diagonal[0][lane] -= pivot;
                diagonal[last][lane] -= top * bottom / pivot;
                (corners[0][lane], corners[1][lane], corners[2][lane]) = (pivot, top, bottom);
            }
        };
        adjust(diagonal, &mut corners);
        other.fill([0.0; LANES]);
        other[0] = corners[0];
        other[last] = corners[2];
        eliminate(other, diagonal, faces, scale);
        adjust(diagonal, &mut corners);
        eliminate(right, diagonal, faces, scale);
        let mut factors = [0.0; LANES];
        for lane in 0..LANES {
            let share = corners[1][lane] / corners[0][lane];
            factors[lane] =
                (right[0][lane] + share * right[last][lane]) / (1.0 + other[0][lane] + share * other[last][lane]);
        }
        for (right, other) in right.iter_mut().zip(other.iter()) {
            for lane in 0..LANES {
                right[lane] -= factors[lane] * other[lane];
            }
        }
    }
}

#[inline(always)]
fn assemble(diagonal: &mut [[f64; LANES]], [gains, losses]: [&[[f64; LANES]]; 2], scale: f64) {
    // as one array: over lines, the compiler would gather and scatter
    let lines = diagonal.as_flattened_mut().iter_mut();
    for ((diagonal, gains), losses) in lines.zip(gains[1..].as_flattened()).zip(losses.as_flattened()) {
        *diagonal = 1.0 + scale * (gains + losses);
    }
}

/// Thomas's elimination; the diagonal becomes the inverses of the pivots.
#[inline(always)]
fn eliminate(
    right: &mut [[f64; LANES]],
    diagonal: &mut [[f64; LANES]],
    [gains, losses]: [&[[f64; LANES]]; 2],
    scale: f64,
) {
    let count = right.len();
    for k in 1..count {
        let (before, here) = diagonal.split_at_mut(k);
        let (solved, right) = right.split_at_mut(k);
        for lane in 0..LANES {
            let inverse = 1.0 / before[k - 1][lane];
            before[k - 1][lane] = inverse;
            let factor = scale * gains[k][lane] * inverse;
            here[0][lane] -= factor * (scale * losses[k][lane]);
            right[0][lane] += factor * solved[k - 1][lane];
        }
    }
    for lane in 0..LANES {
        let inverse = 1.0 / diagonal[count - 1][lane];
        diagonal[count - 1][lane] = inverse;
        right[count - 1][lane] *= inverse;
    }
    for k in (0..count - 1).rev() {
        let (here, after) = right.split_at_mut(k + 1);
        for lane in 0..LANES {
            here[k][lane] = (here[k][lane] + scale * losses[k + 1][lane] * after[0][lane]) * diagonal[k][lane];
        }
    }
}
