//! Blends one colour over another by a mask, in linear light.
//!
//! The modes are those of the World Wide Web Consortium's "Compositing and Blending Level 1" (2015), applied in linear
//! light; the standard's default is encoded sRGB.

use orograph_graph::memory::copied;

use crate::{
    numerics::{
        cells::{BLOCK, blocks, samples},
        simd::simd,
    },
    prelude::*,
};

/// Planes of a colour.
const PLANES: usize = 3;

choice! {
    /// How the colour above is blended with the one below.
    pub enum Mode {
        /// The colour above covers the one below.
        Cover = "cover",
        /// It filters, as tinted glass or shade does: a · b.
        Multiply = "multiply",
        /// It is projected on top: 1 − (1 − a)(1 − b).
        Screen = "screen",
        /// It filters the dark half and is projected on the bright half: more contrast. Half is a light of 0.5.
        Overlay = "overlay",
        /// Its light is added, up to white.
        Add = "add",
        /// Its light is subtracted, down to black.
        Subtract = "subtract",
        /// The darker of both, for red, green and blue each.
        Darken = "darken",
        /// The brighter of both, for red, green and blue each.
        Lighten = "lighten",
    }
}

params! {
    /// How the colour above is blended with the one below.
    mode: Mode = Mode::Cover, One, ..;
}

inputs! {
    /// Colour below.
    below: Colour;
    /// Colour above.
    above: Colour;
    /// Where `above` is applied: fully at 1, not at all at 0.
    mask: Mask = 1.0, 0.0..=1.0;
}

outputs! {
    /// The mixed colours, linear RGB.
    colour: Colour;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Blend",
    category: "render",
    summary: "One colour over another by a mask: covering, shading, tinting, in linear light.",
    doc: include_str!("blend.md"),
    sources: &["World Wide Web Consortium, 2015, Compositing and Blending Level 1"],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    cpu: run,
    gpu: Some(&GPU),
    resolution: Resolution::Cells("shading below depends on the cells of its terrain"),
    example: "below: \"tint\", above: \"relief.colour\", mask: \"mask\", mode: multiply",
    ..Node::DEFAULT
};

static SHADER: Shader = Shader {
    name: "render/blend",
    source: wgsl!("render/blend"),
    library: &[],
    values: &[],
    slots: &[Slot::input("below"), Slot::input("above"), Slot::input("mask"), Slot::output("colour")],
};

static GPU: GpuKernel = GpuKernel {
    shaders: &[&SHADER],
    passes: Passes::Recorded(record),
    tolerance: &[Tolerance::ROUNDING],
    ..GpuKernel::DEFAULT
};

fn record(_: &Job<'_>, recorder: &mut dyn Recorder) -> Result<(), NodeError> {
    (0..PLANES).try_for_each(|plane| {
        recorder.pass(&Pass {
            shader: &SHADER,
            entry: "main",
            bind: &[
                ("below", Bind::Input("below", plane)),
                ("above", Bind::Input("above", plane)),
                ("out_colour", Bind::Output("colour", plane)),
            ],
            values: &[],
            over: Over::Cells(Rows::Around(0)),
        })
    })
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let Inputs { below, above, mask } = Inputs::read(job)?;
    let mode = Params::read(job.params).mode;
    let len = job.window().len();
    let mut out = copied(below.samples())?;
    for (plane, (out, above)) in out.chunks_mut(len).zip(above.samples().chunks(len)).enumerate() {
        blocks(job, [plane, plane + 1].map(|third| third as f32 / 3.0), out, |cells, first| {
            let mut spare = [0.0; BLOCK];
            let mask = samples(mask, first, cells.len(), &mut spare);
            blend(cells, &above[first..][..mask.len()], mask, mode);
        })?;
    }
    Ok(Given { colour: Some(Field::with_planes(job.window(), PLANES, out)) }.into())
}

#[inline(always)]
fn each(below: &mut [f32], above: &[f32], mask: &[f32], mode: impl Fn(f32, f32) -> f32) {
    for ((below, &above), &mask) in below.iter_mut().zip(above).zip(mask) {
        let whole = mode(*below, above);
        let mixed = *below + (whole - *below) * mask;
        // a rounded sum may differ from `whole` in the last bit
        *below = if mask < 1.0 { mixed } else { whole };
    }
}

simd! {
    fn blend(below: &mut [f32], above: &[f32], mask: &[f32], mode: Mode) {
        match mode {
            Mode::Cover => each(below, above, mask, |_, b| b),
            Mode::Multiply => each(below, above, mask, |a, b| a * b),
            Mode::Screen => each(below, above, mask, |a, b| a + b - a * b),
            Mode::Overlay => each(below, above, mask, |a, b| {
                let (dark, bright) = (2.0 * a * b, 1.0 - 2.0 * (1.0 - a) * (1.0 - b));
                if a < 0.5 { dark } else { bright }
            }),
            Mode::Add => each(below, above, mask, |a, b| (a + b).min(1.0)),
            Mode::Subtract => each(below, above, mask, |a, b| (a - b).max(0.0)),
            Mode::Darken => each(below, above, mask, |a, b| a.min(b)),
            Mode::Lighten => each(below, above, mask, |a, b| a.max(b)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{at_every_level, run, run_in, with_params, world};

    fn colour(shift: usize) -> Field {
        let window = Window::whole(world(37, 11, 5.0));
        let samples = (0..3 * window.len()).map(|at| ((at * 7919 + shift) % 257) as f32 / 256.0);
        Field::with_planes(window, 3, samples.collect())
    }

    fn mask(value: f32) -> Field {
        Field::constant(*colour(0).window(), value)
    }

    #[test]
    fn a_full_mask_gives_what_the_mode_says_and_an_empty_one_what_was_there() {
        let (below, above) = (colour(0), colour(101));
        for (mode, of) in [
            ("cover", (|_, b| b) as fn(f32, f32) -> f32),
            ("multiply", |a, b| a * b),
            ("screen", |a, b| 1.0 - (1.0 - a) * (1.0 - b)),
            ("overlay", |a, b| if a < 0.5 { 2.0 * a * b } else { 1.0 - 2.0 * (1.0 - a) * (1.0 - b) }),
            ("add", |a, b| (a + b).min(1.0)),
            ("subtract", |a, b| (a - b).max(0.0)),
            ("darken", f32::min),
            ("lighten", f32::max),
        ] {
            let params = with_params(&NODE, &format!("mode={mode}"));
            let given =
                |mask: &Field| run(&NODE, &params, &[("below", &below), ("above", &above), ("mask", mask)], "colour");
            assert_eq!(given(&mask(0.0)), below, "{mode}");
            let (full, half) = (given(&mask(1.0)), given(&mask(0.5)));
            for at in 0..full.samples().len() {
                let (a, b) = (below.samples()[at], above.samples()[at]);
                assert!((full.samples()[at] - of(a, b)).abs() < 1e-6, "{mode} {a} {b}"); // single precision
                assert!((half.samples()[at] - (a + of(a, b)) / 2.0).abs() < 1e-6, "{mode} {a} {b}");
                assert!((0.0..=1.0).contains(&full.samples()[at]), "{mode} {a} {b}");
            }
        }
    }

    #[test]
    fn a_full_cover_is_the_colour_above_to_the_last_bit() {
        let (below, above) = (colour(0), colour(101));
        let params = ParamValues::defaults(&NODE.specs());
        assert_eq!(run(&NODE, &params, &[("below", &below), ("above", &above)], "colour"), above);
    }

    #[test]
    fn threads_and_simd_levels_give_the_same_bits() {
        let (below, above) = (colour(0), colour(101));
        let params = with_params(&NODE, "mode=overlay");
        let inputs = [("below", &below), ("above", &above), ("mask", &mask(0.3))];
        assert_eq!(run_in(1, &NODE, &params, &inputs), run_in(4, &NODE, &params, &inputs));
        at_every_level(|| run_in(2, &NODE, &params, &inputs));
    }
}
