//! Stretches a field to a range by its own values.

use orograph_graph::memory::copied;

use crate::{
    numerics::{cells::blocks, distribution},
    prelude::*,
    quantity::Quantity,
};

choice! {
    /// Which values of the field become the ends of the range.
    pub enum Measure {
        /// Its lowest and highest value.
        Range = "range",
        /// Two of its percentiles.
        Percentiles = "percentiles",
        /// A number of standard deviations below and above its mean.
        Deviation = "deviation",
    }
}

params! {
    /// Which values of the field become the ends of the range.
    measure: Measure = Measure::Range, One, ..;
    /// Percentages of the cells that lie below the two ends.
    percentiles: [f64; 2] = [2.0, 98.0], One, 0.0..=100.0, when measure = "percentiles";
    /// Standard deviations from the mean to either end.
    deviations: f64 = 2.0, One, 0.01..=100.0, soft 0.5..=4, when measure = "deviation";
    /// Output for the lower and the upper end, in the unit of `quantity`.
    to: [f64; 2] = [0.0, 1000.0], One, -1e12..=1e12;
    /// Quantity of the result; a mask is clamped to 0..1.
    quantity: Quantity = Quantity::Height, One, ..;
    /// Clamps values beyond the ends to the ends.
    clamp: bool = false, One, ..;
}

inputs! {
    /// Field to stretch.
    value: AnyScalar;
}

outputs! {
    /// The stretched values.
    value: Chosen(crate::quantity::port_type);
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Normalise",
    category: "combine",
    summary: "Stretches a field so that its lowest and highest values become two given values.",
    doc: include_str!("normalise.md"),
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    reach: Reach::World,
    refuses: Some(refuses),
    cpu: run,
    gpu: Some(&GPU),
    example: "value: \"base\", measure: percentiles, to: (200, 1500)",
    ..Node::DEFAULT
};

static SHADER: Shader = Shader {
    name: "combine/normalise",
    source: wgsl!("combine/normalise"),
    library: &[],
    values: &[],
    slots: &[Slot::words("ends", "atomic<u32>").updated(), Slot::input("value"), Slot::output("value")],
};

static GPU: GpuKernel = GpuKernel {
    shaders: &[&SHADER],
    passes: Passes::Recorded(record),
    // percentiles and deviations need sums in double precision
    covers: |params| Params::read(params).measure == Measure::Range,
    tolerance: &[Tolerance::relative(1e-6)],
    ..GpuKernel::DEFAULT
};

fn record(job: &Job<'_>, recorder: &mut dyn Recorder) -> Result<(), NodeError> {
    let ends = recorder.table(&[0, 0])?;
    for entry in ["measure", "main"] {
        recorder.pass(&Pass {
            shader: &SHADER,
            entry,
            bind: &[("ends", Bind::Scratch(ends))],
            values: &[],
            over: Over::Cells(Rows::Around(0)),
        })?;
        job.advance(0.5)?;
    }
    Ok(())
}

/// Refuses percentiles between which nothing lies.
fn refuses(stated: &Stated<'_>) -> Result<(), NodeError> {
    let Params { measure, percentiles: [low, high], .. } = Params::read(stated.params);
    if measure == Measure::Percentiles && low >= high {
        return Err(NodeError::failed_with_hint(
            format!("nothing lies between percentile {low} and percentile {high}"),
            "give `percentiles` two numbers of which the second is higher",
        ));
    }
    Ok(())
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    refuses(&Stated::of_job(job))?;
    let params = Params::read(job.params);
    let value = Inputs::read(job)?.value;
    let [low, high] = ends(&params, value.samples(), job.window().nx())?;
    job.advance(0.4)?;
    let is_mask = params.quantity == Quantity::Mask;
    let [to_low, to_high] = params.to;
    if [low, high] == params.to && !params.clamp && !is_mask {
        return Ok(Given { value: Some(value.clone()) }.into());
    }
    let map = |x: f32| {
        let share = if high > low { (f64::from(x) - low) / (high - low) } else { 0.5 };
        let share = if params.clamp { share.clamp(0.0, 1.0) } else { share };
        let value = to_low * (1.0 - share) + to_high * share;
        let value = if is_mask { value.clamp(0.0, 1.0) } else { value };
        value.clamp(-f64::from(f32::MAX), f64::from(f32::MAX)) as f32
    };
    let mut out = copied(value.samples())?;
    blocks(job, [0.4, 1.0], &mut out, |cells, _| cells.iter_mut().for_each(|cell| *cell = map(*cell)))?;
    Ok(Given { value: Some(Field::new(job.window(), out)) }.into())
}

/// Returns the values that are mapped to the ends of the range.
fn ends(params: &Params, samples: &[f32], nx: usize) -> Result<[f64; 2], NodeError> {
    match params.measure {
        Measure::Range => {
            let pick = |pick: fn(f32, f32) -> f32| f64::from(samples.iter().copied().fold(samples[0], pick));
            Ok([pick(f32::min), pick(f32::max)])
        }
        Measure::Percentiles => {
            let [low, high] = params.percentiles;
            let mut sorted = samples.to_vec();
            Ok([low, high].map(|percent| {
                let rank = (0.01 * percent * (sorted.len() - 1) as f64).round() as usize;
                f64::from(*sorted.select_nth_unstable_by(rank, f32::total_cmp).1)
            }))
        }
        Measure::Deviation => {
            let (mean, deviation) = distribution::moments(samples, nx);
            // the mean of a constant field is exact only to rounding
            let deviation = if deviation > 1e-9 * mean.abs() { deviation } else { 0.0 };
            Ok([-1.0, 1.0].map(|side| mean + side * params.deviations * deviation))
        }
    }
}

#[cfg(test)]
mod tests {
    use orograph_graph::ParamValue;

    use super::*;
    use crate::testing::{field, moments, outputs, run as result, run_in, with_params, world};

    fn hills() -> Field {
        field(world(101, 50, 5.0), |x, y| 300.0 * libm::sin(x * 0.05 + y * 0.02) * libm::cos(y * 0.3) + x)
    }

    fn normalised(land: &Field, changes: &str, to: [f64; 2]) -> Field {
        let mut params = with_params(&NODE, changes);
        params.set("to", ParamValue::Point(to));
        result(&NODE, &params, &[("value", land)], "value")
    }

    #[test]
    fn ends_are_exact_and_twice_is_once() {
        for to in [[0.0, 1000.0], [-333.3, 17.0], [50.0, -2.5]] {
            let found = normalised(&hills(), "", to);
            let (low, high) = found.range(0).expect("finite");
            assert_eq!((low, high), (to[0].min(to[1]) as f32, to[0].max(to[1]) as f32));
        }
        for changes in ["", "measure=percentiles"] {
            let once = normalised(&hills(), changes, [0.0, 1000.0]);
            assert_eq!(normalised(&once, changes, [0.0, 1000.0]), once, "{changes}");
        }
    }

    #[test]
    fn percentiles_and_deviations_are_those_of_the_result() {
        let found = normalised(&hills(), "measure=percentiles", [0.0, 100.0]);
        let below = |level: f32| found.samples().iter().filter(|&&v| v < level).count() as f64 / 5050.0;
        assert!((below(0.0) - 0.02).abs() < 1e-3 && (below(100.0) - 0.98).abs() < 1e-3);
        let found = normalised(&hills(), "measure=deviation,deviations=3", [-60.0, 60.0]);
        let (mean, deviation) = moments(found.samples());
        assert!(mean.abs() < 1e-4 && (deviation - 20.0).abs() < 1e-4, "{mean} {deviation}");
        let clamped = normalised(&hills(), "measure=deviation,deviations=1,clamp=true", [-60.0, 60.0]);
        assert_eq!(clamped.range(0), Some((-60.0, 60.0)));
        let mask = normalised(&hills(), "measure=deviation,quantity=mask", [-3.0, 4.0]);
        assert_eq!(mask.range(0), Some((0.0, 1.0)));
    }

    #[test]
    fn level_land_is_in_the_middle_and_empty_ranges_are_refused() {
        let level = field(world(30, 7, 5.0), |_, _| 812.3);
        for changes in ["", "measure=percentiles", "measure=deviation"] {
            let found = normalised(&level, changes, [100.0, 200.0]);
            assert!(found.samples().iter().all(|&v| v == 150.0), "{changes}");
        }
        let mut params = with_params(&NODE, "measure=percentiles");
        params.set("percentiles", ParamValue::Point([60.0, 60.0]));
        let error = outputs(&NODE, &params, &[("value", &level)]).expect_err("nothing between").to_string();
        assert!(error.contains("percentile 60"), "{error}");
    }

    #[test]
    fn threads_do_not_matter() {
        for changes in ["measure=deviation", "measure=percentiles"] {
            let params = with_params(&NODE, changes);
            let land = hills();
            assert_eq!(run_in(1, &NODE, &params, &[("value", &land)]), run_in(3, &NODE, &params, &[("value", &land)]));
        }
    }
}
