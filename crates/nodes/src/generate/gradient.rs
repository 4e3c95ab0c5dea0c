//! A linear ramp between two values: along a line, outwards from a point, or around it.

use orograph_graph::memory::zeroed;

use crate::{
    numerics::{math, par},
    prelude::*,
    quantity::{self, Quantity},
    wgsl,
};

choice! {
    /// Direction in which values change.
    pub enum Form {
        /// Along a straight line, with `centre` halfway.
        Linear = "linear",
        /// From `centre` outwards.
        Radial = "radial",
        /// Around `centre`, one turn clockwise from `azimuth`.
        Angular = "angular",
    }
}

choice! {
    /// Values beyond the end.
    pub enum Beyond {
        /// The last value continues.
        Hold = "hold",
        /// The change starts again from the first value.
        Repeat = "repeat",
        /// It goes back and forth.
        Mirror = "mirror",
    }
}

params! {
    /// Direction in which values change.
    form: Form = Form::Linear, One, ..;
    /// Value at the start.
    from: f64 = 0.0, One, -1e9..=1e9, soft -1000..=1000;
    /// Value at the end.
    to: f64 = 1000.0, One, -1e9..=1e9, soft -1000..=2000;
    /// Centre, from the world's north-west corner.
    centre: Position = Position([8192.0, 8192.0]), Metres, -1e7..=1e7;
    /// Direction of the change, or where the turn begins, clockwise from north.
    azimuth: f64 = 90.0, Degrees, -360.0..=360.0, soft 0..=360, when form = "linear" | "angular";
    /// Distance from the start to the end; not used by `angular`.
    length: f64 = 16000.0, Metres, 0.01..=1e7, soft 100..=30000, when form = "linear" | "radial";
    /// Values beyond the end. A mirrored turn has its end halfway round and no seam.
    beyond: Beyond = Beyond::Hold, One, ..;
    /// Quantity of the values, which decides where they may be wired.
    quantity: Quantity = Quantity::Height, One, ..;
}

outputs! {
    /// The value in every cell.
    value: Chosen(quantity::port_type);
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Gradient",
    category: "generate",
    summary: "A linear change between two values: along a line, outwards or around a point.",
    doc: include_str!("gradient.md"),
    outputs: Given::PORTS,
    params: Params::specs,
    cpu: run,
    gpu: Some(&GPU),
    example: "form: radial, from: 900, to: 0, length: 7000",
    ..Node::DEFAULT
};

static GPU: GpuKernel = GpuKernel {
    shaders: &[&Shader {
        name: "generate/gradient",
        source: wgsl!("generate/gradient"),
        library: &[wgsl::MATH],
        values: &[
            ("from_centre_x", Number::F32),
            ("from_centre_y", Number::F32),
            ("sine", Number::F32),
            ("cosine", Number::F32),
            ("start", Number::F32),
            ("change", Number::F32),
        ],
        slots: &[Slot::output("value")],
    }],
    passes: Passes::point(values),
    // positions in single precision: not for ramps of a few cells far from their centre
    covers: |params| {
        let params = Params::read(params);
        let near = params.centre.iter().all(|v| v.abs() <= 1e5);
        near && params.length >= 100.0 && quantity::check(params.quantity, &[params.from, params.to]).is_ok()
    },
    // a repeated ramp and the seam of a turn jump
    tolerance: &[Tolerance::relative(5e-5).except(0.01)],
    ..GpuKernel::DEFAULT
};

/// The centre of the first cell from that of the ramp, the direction, and the values.
fn values(job: &Job<'_>) -> Vec<(&'static str, Scalar)> {
    let params = Params::read(job.params);
    let azimuth = params.azimuth.to_radians();
    let [x, y] = job.window().centre_m(0, 0);
    [
        ("from_centre_x", x - params.centre[0]),
        ("from_centre_y", y - params.centre[1]),
        ("sine", math::sin(azimuth)),
        ("cosine", math::cos(azimuth)),
        ("start", params.from),
        ("change", params.to - params.from),
    ]
    .map(|(name, value)| (name, Scalar::F32(value as f32)))
    .to_vec()
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let params = Params::read(job.params);
    quantity::check(params.quantity, &[params.from, params.to])?;
    let window = job.window();
    let azimuth = params.azimuth.to_radians();
    let (cos, sin) = (math::cos(azimuth), math::sin(azimuth));
    let mut values = zeroed(window.len())?;
    par::rows(job, &mut values, |j, row| {
        for (i, value) in row.iter_mut().enumerate() {
            let [x, y] = window.centre_m(i, j);
            let (dx, dy) = (x - params.centre[0], y - params.centre[1]);
            // distance ahead in the direction of the azimuth, and to its right
            let (ahead, right) = (dx * sin - dy * cos, dx * cos + dy * sin);
            let way = match params.form {
                Form::Linear => 0.5 + ahead / params.length,
                Form::Radial => (dx * dx + dy * dy).sqrt() / params.length,
                Form::Angular => params.turn(math::atan2(right, ahead)),
            };
            let share = match params.beyond {
                Beyond::Hold => way.clamp(0.0, 1.0),
                Beyond::Repeat => way.rem_euclid(1.0),
                Beyond::Mirror => 1.0 - (way.rem_euclid(2.0) - 1.0).abs(),
            };
            *value = (params.from + (params.to - params.from) * share) as f32;
        }
    })?;
    Ok(Given { value: Some(Field::new(window, values)) }.into())
}

impl Params {
    /// Returns an angle in turns, 0 to 1, or 0 to 2 if it is to be mirrored.
    fn turn(&self, angle: f64) -> f64 {
        let turns = (angle / std::f64::consts::TAU).rem_euclid(1.0);
        if self.beyond == Beyond::Mirror { 2.0 * turns } else { turns }
    }
}

#[cfg(test)]
mod tests {
    use orograph_graph::ParamValue;

    use super::*;
    use crate::testing::{outputs_on, with_params, world};

    /// On 10 x 10 cells of 100 m with the ramp centred on the world.
    fn value(changes: &str, at: [usize; 2]) -> f32 {
        let mut params = with_params(&NODE, changes);
        params.set("centre", ParamValue::Point([500.0, 500.0]));
        let mut outputs = outputs_on(Window::whole(world(10, 10, 100.0)), &NODE, &params, &[]).expect("a result");
        let value = outputs.take("value").expect("an output");
        value.as_field().expect("a field").samples()[at[1] * 10 + at[0]]
    }

    #[test]
    fn a_line_a_circle_and_a_turn() {
        // 150 m of 400 m east of the centre
        assert_eq!(value("length=400,from=10,to=20", [6, 4]), 10.0 + 10.0 * (0.5 + 150.0 / 400.0));
        assert_eq!(value("length=400,from=10,to=20", [9, 4]), 20.0);
        assert_eq!(value("length=400,azimuth=0,from=0,to=1", [4, 4]), 0.5 + 50.0 / 400.0);
        let r = math::hypot(150.0, 250.0);
        assert_eq!(value("form=radial,length=400,from=10,to=20", [6, 7]), (10.0 + 10.0 * r / 400.0) as f32);
        // north-east of the centre, an eighth of a turn from north
        assert_eq!(value("form=angular,azimuth=0,from=0,to=80", [7, 2]), 10.0);
        assert_eq!(value("form=angular,azimuth=0,from=0,to=80,beyond=mirror", [7, 2]), 20.0);
        assert_eq!(value("form=angular,azimuth=0,from=0,to=80,beyond=mirror", [2, 2]), 20.0);
    }

    #[test]
    fn beyond_the_end_it_holds_repeats_or_goes_back() {
        // 350 m east of the centre: at 2.25 lengths
        assert_eq!(value("length=200,from=0,to=4", [8, 4]), 4.0);
        assert_eq!(value("length=200,from=0,to=4,beyond=repeat", [8, 4]), 1.0);
        assert_eq!(value("length=200,from=0,to=4,beyond=mirror", [8, 4]), 1.0);
        assert_eq!(value("length=200,from=0,to=4,beyond=mirror", [7, 4]), 1.0);
    }

    #[test]
    fn a_mask_beyond_0_to_1_is_refused() {
        let params = with_params(&NODE, "quantity=mask");
        let error = outputs_on(Window::whole(world(8, 8, 10.0)), &NODE, &params, &[]);
        assert!(matches!(error, Err(NodeError::Failed { hint: Some(_), .. })));
    }
}
