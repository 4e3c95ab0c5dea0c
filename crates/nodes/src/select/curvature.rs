//! Terrain curvature at a length in metres: along the fall line, across it, and mean.

use orograph_graph::memory::zeroed;

use crate::{
    numerics::{
        gaussian::Gaussian,
        joins,
        lines::{Ends, separable},
        par, smooth,
    },
    prelude::*,
    wgsl,
};

choice! {
    /// Kind of curvature.
    pub enum Kind {
        /// ½ ∇²z: positive in hollows, negative on crests; soil creep follows it.
        Mean = "mean",
        /// Along the fall line: positive where the slope eases (concave), negative where it steepens.
        Profile = "profile",
        /// Across the fall line, in the plane of the slope: positive where water converges, negative where it
        /// diverges.
        Tangential = "tangential",
    }
}

params! {
    /// Kind of curvature.
    kind: Kind = Kind::Mean, One, ..;
    /// Length below which detail is smoothed away first: the standard deviation of a Gaussian; 0 does not smooth.
    radius: f64 = 50.0, Metres, 0.0..=1e5, soft 0..=1000;
}

inputs! {
    /// Terrain height.
    height: Height;
}

outputs! {
    /// Curvature, positive in hollows.
    curvature: Scalar(PerMetre);
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Curvature",
    category: "select",
    summary: "Curvature of the ground: hollows and crests, smoothed over a length in metres.",
    doc: include_str!("curvature.md"),
    sources: &[
        "J. Krcho (1973), Morphometric analysis of relief on the basis of geometric aspect of field theory, Acta Geographica \
         Universitatis Comenianae 1, 7-233",
        "L. W. Zevenbergen and C. R. Thorne (1987), Quantitative analysis of land surface topography, Earth Surface Processes and \
         Landforms 12, 47-56",
    ],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    reach: Reach::Metres(|params, cell_m| Gaussian::reach_m(Params::read(params).radius, cell_m) + cell_m),
    scratch: Scratch::Bytes(scratch),
    cpu: run,
    gpu: Some(&GPU),
    example: "height: \"base\", radius: 600, kind: tangential",
    ..Node::DEFAULT
};

static SHADER: Shader = Shader {
    name: "select/curvature",
    source: wgsl!("select/curvature"),
    library: &[wgsl::LINES],
    values: &joins::NUMBERS,
    slots: &[Slot::cells("before", "f32"), Slot::output("curvature")],
};

static GPU: GpuKernel = GpuKernel {
    shaders: &[&smooth::SHADER, &SHADER],
    passes: Passes::Recorded(record),
    // second differences magnify the rounding of heights; on nearly level ground it turns the fall line
    tolerance: &[Tolerance::relative(1e-9).and_absolute(1e-7).except(0.02)],
    ..GpuKernel::DEFAULT
};

fn record(job: &Job<'_>, recorder: &mut dyn Recorder) -> Result<(), NodeError> {
    let sigma_cells = Params::read(job.params).radius / job.cell_m();
    let height = Bind::Input("height", 0);
    let smoothed = if sigma_cells > 0.0 {
        Bind::Scratch(smooth::smooth(job, recorder, height, sigma_cells, [0.0, 0.8])?)
    } else {
        height
    };
    recorder.pass(&Pass {
        shader: &SHADER,
        entry: "main",
        bind: &[("before", smoothed)],
        values: &joins::numbers(&job.window()),
        over: Over::Cells(joins::rows(&job.window(), 1)),
    })
}

/// Memory that the kernel needs in addition to its inputs and outputs.
fn scratch(sizing: &Sizing<'_>) -> u64 {
    // the smoothed terrain
    sizing.cells(4.0).max(Gaussian::bytes(Params::read(sizing.params).radius, &sizing.window))
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let params = Params::read(job.params);
    let (nx, ny) = (job.window().nx(), job.window().ny());
    let height = Inputs::read(job)?.height.samples();
    let smoothed = separable(job, [0.0, 0.6], height, &Gaussian::new(params.radius / job.cell_m()))?;
    let cell_m = job.cell_m();
    let [across, down] = [0, 1].map(|axis| Ends::of(&job.window(), axis));
    let mut out = zeroed(smoothed.len())?;
    par::rows_within(job, [0.6, 1.0], &mut out, |j, row| {
        let line = |j: usize| &smoothed[j * nx..][..nx];
        let beside = |at: usize, count: usize, ends: Ends| [-1, 1].map(|step| ends.index(at as i64 + step, count));
        let [above, below] = beside(j, ny, down);
        let (north, middle, south) = (line(above), line(j), line(below));
        for (i, out) in row.iter_mut().enumerate() {
            let inside = i > 0 && i + 1 < nx;
            let [west, east] = if inside { [i - 1, i + 1] } else { beside(i, nx, across) };
            let at = |line: &[f32], i: usize| f64::from(line[i]);
            let centre = at(middle, i);
            let p = (at(middle, east) - at(middle, west)) / (2.0 * cell_m);
            let q = (at(south, i) - at(north, i)) / (2.0 * cell_m);
            let r = ((at(middle, east) - centre) + (at(middle, west) - centre)) / (cell_m * cell_m);
            let t = ((at(south, i) - centre) + (at(north, i) - centre)) / (cell_m * cell_m);
            let s =
                ((at(south, east) - at(south, west)) - (at(north, east) - at(north, west))) / (4.0 * cell_m * cell_m);
            *out = bend(params.kind, [p, q], [r, s, t]) as f32;
        }
    })?;
    Ok(Given { curvature: Some(Field::new(job.window(), out)) }.into())
}

/// Squared slope below which terrain counts as level: a millimetre in ten kilometres.
const LEVEL: f64 = 1e-14;

fn bend(kind: Kind, [p, q]: [f64; 2], [r, s, t]: [f64; 3]) -> f64 {
    let steep = p * p + q * q;
    let stretch = (1.0 + steep).sqrt();
    match kind {
        Kind::Profile if steep > LEVEL => {
            (p * p * r + 2.0 * p * q * s + q * q * t) / (steep * stretch * stretch * stretch)
        }
        Kind::Tangential if steep > LEVEL => (q * q * r - 2.0 * p * q * s + p * p * t) / (steep * stretch),
        Kind::Mean | Kind::Profile | Kind::Tangential => 0.5 * (r + t),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{field, run as result, with_params, world};

    fn middle(land: &Field, changes: &str) -> f64 {
        let curvature = result(&NODE, &with_params(&NODE, changes), &[("height", land)], "curvature");
        f64::from(curvature.samples()[20 * 41 + 20])
    }

    /// Surfaces of known curvature: a bowl, a gutter that falls along its axis, a vertical curve.
    #[test]
    fn quadratic_surfaces_have_their_curvature() {
        let place = world(41, 41, 10.0);
        let (x0, y0) = (205.0, 205.0);
        let bowl = field(place, |x, y| 1e-3 * ((x - x0) * (x - x0) + (y - y0) * (y - y0)));
        let gutter = field(place, |x, y| 2e-3 * (x - x0) * (x - x0) + 0.5 * y);
        let bend = field(place, |_, y| 2e-3 * (y - y0) * (y - y0) + 0.5 * y);
        let (stretch, near) = (1.25_f64.sqrt(), |found: f64, expected: f64| {
            assert!((found - expected).abs() < 2e-6, "{found} {expected}"); // heights of 200 m in single precision
        });
        near(middle(&bowl, "radius=0,kind=mean"), 2e-3);
        near(middle(&bowl, "radius=0,kind=profile"), 2e-3);
        near(middle(&gutter, "radius=0,kind=tangential"), 4e-3 / stretch);
        near(middle(&gutter, "radius=0,kind=profile"), 0.0);
        near(middle(&bend, "radius=0,kind=profile"), 4e-3 / (stretch * stretch * stretch));
        near(middle(&bend, "radius=0,kind=tangential"), 0.0);
        // a Gaussian preserves the second derivatives of a quadratic surface
        near(middle(&bowl, "radius=20,kind=mean"), 2e-3);
    }
}
