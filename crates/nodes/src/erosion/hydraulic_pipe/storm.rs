//! The storm from start to end, sweep by sweep, with the strokes painted during it.

use std::borrow::Cow;

use orograph_graph::{Edge, Moment, Process, memory::zeroed};

use super::{
    Given, Inputs, Params, Wants,
    band::State,
    budget::{self, Sums},
    course::Course,
    painted::Painted,
    physics::Physics,
    run::{Pacing, Run},
    spread::{self, NARROWEST},
    warm,
};
use crate::{numerics::par, prelude::*};

/// A storm in progress.
pub(super) struct Storm {
    course: Course,
    physics: Physics,
    run: Run,
    painted: Painted,
    pacing: Pacing,
    /// Water at the start, and painted rain, in m³.
    water_start: f64,
    water_painted: f64,
}

/// Tells where gullies have another width than `width`.
fn warn_of_width(job: &Job<'_>, width_m: f64) {
    let (window, cell_m) = (job.window(), job.cell_m());
    let kept_m = spread::kept_m(width_m, [window.nx(), window.ny()], cell_m);
    let [cell_m, rounded_m] = [cell_m, kept_m].map(|length_m| (length_m * 100.0).round() / 100.0);
    if kept_m > width_m {
        job.warn(format!(
            "a `width` of {width_m} m is less than {NARROWEST} cells of {cell_m} m: gullies are {rounded_m} m wide, and \
             narrower on smaller cells; use smaller cells or a larger `width`"
        ));
    } else if kept_m < width_m {
        job.warn(format!(
            "a `width` of {width_m} m is more than a quarter of the world: erosion is spread over {rounded_m} m"
        ));
    }
}

/// Returns the constants of a run, and warns of a width that it does not keep.
///
/// # Errors
/// When only one of two opposite sides is periodic.
pub(super) fn checked(job: &Job<'_>, params: &Params) -> Result<Physics, NodeError> {
    let boundary = job.world().boundary;
    for (one, other, names) in
        [(boundary.west, boundary.east, "west and east"), (boundary.north, boundary.south, "north and south")]
    {
        if (one == Edge::Periodic) != (other == Edge::Periodic) {
            return Err(NodeError::failed_with_hint(
                format!("of the sides {names} one is periodic and the other is not"),
                "make both `periodic`, or neither, in the world's `boundary`",
            ));
        }
    }
    let physics = Physics::new(params, job.cell_m());
    warn_of_width(job, physics.width_m);
    Ok(physics)
}

impl Storm {
    pub fn new(job: &Job<'_>) -> Result<Self, NodeError> {
        let course = Course::new(job.params);
        let physics = checked(job, &course.params)?;
        let inputs = Inputs::read(job)?;
        let painted = Painted::new(job, &inputs, &course.params);
        let scene = painted.scene(job, physics)?;
        let mut run = Run::new(&scene, inputs.regolith);
        if let Some(depths) = warm::depths(job, &inputs, &course.params)? {
            run.fill(&depths);
        }
        let water_start = budget::water(&run, &scene);
        Ok(Self { course, physics, run, painted, pacing: Pacing::default(), water_start, water_painted: 0.0 })
    }

    /// Returns the fraction of the run that is done.
    pub fn fraction(&self) -> f32 {
        self.course.fraction()
    }

    /// Returns the current terrain and water as a preview.
    pub fn glimpse(&self, job: &Job<'_>) -> Outputs {
        let (window, land) = (job.window(), self.painted.land(job).unwrap_or_default());
        let (nx, ny) = (window.nx(), window.ny());
        let raster = |row: &dyn Fn(usize) -> Vec<f32>| Field::new(window, (0..ny).flat_map(row).collect());
        let height = raster(&|j| {
            let land = &land[j * nx..][..nx];
            land.iter().zip(self.run.row(State::Change, j)).map(|(land, change)| land + change).collect()
        });
        let water = raster(&|j| self.run.row(State::Water, j)[..nx].to_vec());
        Given { height: Some(height), water: Some(water), ..Given::default() }.into()
    }
}

impl Process for Storm {
    fn moment(&self) -> Moment {
        self.course.moment()
    }

    fn step(&mut self, job: &Job<'_>) -> Result<(), NodeError> {
        let (now, due) = (self.moment().now, self.course.due());
        if !due.is_empty() {
            self.painted.paint(&self.course.params.strokes.0[due.clone()], job, self.fraction())?;
            self.course.acted = due.end;
        }
        let scene = self.painted.scene(job, self.physics)?;
        let drops = self.painted.drops(&scene);
        let before_s = self.pacing.time_s;
        self.course.left_s = self.run.sweep(&scene, self.course.left_s, &mut self.pacing, job)?;
        let cell_m2 = job.cell_m() * job.cell_m();
        self.water_painted += drops * cell_m2 * (self.pacing.time_s - before_s) / 3.6e6;
        self.course.since_s = Some(now);
        Ok(())
    }

    fn outputs(&self, job: &Job<'_>) -> Result<Outputs, NodeError> {
        let mut painted = Cow::Borrowed(&self.painted);
        let due = self.course.due();
        if !due.is_empty() {
            painted.to_mut().paint(&self.course.params.strokes.0[due], job, self.fraction())?;
        }
        let scene = painted.dry_scene(job, self.physics)?;
        let run = &self.run;
        let report = || {
            let cell_m2 = job.cell_m() * job.cell_m();
            let water_in = budget::rain(&scene) * cell_m2 * self.pacing.time_s / 3.6e6 + self.water_painted;
            budget::report(&Sums::of(run, &scene), &self.physics, &self.pacing, self.water_start, water_in)
        };

        let window = job.window();
        let nx = window.nx();
        let per_second = if self.pacing.time_s > 0.0 { (1.0 / self.pacing.time_s) as f32 } else { 0.0 };
        let raster = |row: &(dyn Fn(usize, &mut [f32]) + Sync)| {
            let mut samples = zeroed(window.len())?;
            par::rows_within(job, [self.fraction(); 2], &mut samples, row).map(|()| samples)
        };
        let field = |row: &(dyn Fn(usize, &mut [f32]) + Sync)| raster(row).map(|samples| Field::new(window, samples));
        let copy = |state: State| field(&|j, out| out.copy_from_slice(&run.row(state, j)[..nx]));
        let rest = || {
            field(&|j, out| {
                for ((out, land), change) in out.iter_mut().zip(&scene.land[j * nx..]).zip(run.row(State::Change, j)) {
                    *out = if *change == 0.0 { *land } else { land + change };
                }
            })
        };
        let flow = || {
            field(&|j, out| {
                out.iter_mut().zip(run.flow(j)).for_each(|(out, flow)| *out = flow * per_second);
            })
        };
        let velocity = || {
            let mut velocity = raster(&|j, out| run.velocity(&self.physics, j, 0, out))?;
            velocity.extend(raster(&|j, out| run.velocity(&self.physics, j, 1, out))?);
            Ok::<_, NodeError>(Field::with_planes(window, 2, velocity))
        };
        let wants = Wants::of(job);
        Ok(Given {
            height: wants.height.then(rest).transpose()?,
            water: wants.water.then(|| copy(State::Water)).transpose()?,
            velocity: wants.velocity.then(velocity).transpose()?,
            sediment: wants.sediment.then(|| copy(State::Sediment)).transpose()?,
            deposition: wants.deposition.then(|| copy(State::Change)).transpose()?,
            flow: wants.flow.then(flow).transpose()?,
            report: wants.report.then(report),
        }
        .into())
    }

    fn take(&mut self, values: &ParamValues) -> bool {
        self.course.take(values)
    }
}

#[cfg(test)]
mod tests {
    use orograph_graph::{Cancel, Fallback, InputValue, ParamValue, Stroke, Tool, Value, Warnings};

    use super::{super::NODE, *};
    use crate::testing::{at_every_level, field, outputs, run_in, with_params, world};

    /// A valley that falls to the south, between hills.
    fn valley() -> Field {
        field(world(48, 140, 10.0), |x, y| {
            400.0 - 0.05 * y + 0.1 * (x - 240.0).abs() + 4.0 * libm::sin(x / 31.0 + y / 23.0)
        })
    }

    fn stroke(tool: Tool, strength: f64, time: f64, points: &[[f64; 2]]) -> Stroke {
        Stroke { tool, radius: 60.0, strength, hardness: 0.5, time, points: points.to_vec() }
    }

    fn params(changes: &str, strokes: &[Stroke]) -> ParamValues {
        let mut params = with_params(&NODE, changes);
        params.set("strokes", ParamValue::Strokes(strokes.to_vec()));
        params
    }

    /// Calls with a job on that land.
    fn on<T>(land: &Field, params: &ParamValues, code: impl FnOnce(&Job<'_>) -> T) -> T {
        let input = |input: &orograph_graph::Input| match (input.name, input.fallback) {
            ("height", _) => InputValue::Value(Value::Field(land.clone())),
            (_, Fallback::Constant { default, .. }) => InputValue::Constant(default),
            _ => InputValue::Absent,
        };
        code(&Job {
            node: &NODE,
            params,
            inputs: NODE.inputs.iter().map(input).collect(),
            window: *land.window(),
            wanted: orograph_graph::Wanted::ALL,
            folder: std::path::PathBuf::new(),
            cancel: Cancel::default(),
            progress: &|fraction| assert!((0.0..=1.0).contains(&fraction)),
            level: orograph_graph::LevelJob::default(),
            warnings: Warnings::default(),
            glimpses: None,
        })
    }

    fn begun(land: &Field, params: &ParamValues) -> Box<dyn Process> {
        on(land, params, |job| super::super::begin(job).expect("begins"))
    }

    fn steps(storm: &mut dyn Process, land: &Field, params: &ParamValues, most: usize) -> usize {
        on(land, params, |job| {
            let mut count = 0;
            while count < most && !storm.moment().is_over() {
                storm.step(job).expect("goes on");
                count += 1;
            }
            count
        })
    }

    const ALL: [fn(f64, f64) -> Stroke; 4] = [
        |time, y| stroke(Tool::Raise, 12.0, time, &[[100.0, y], [380.0, y]]),
        |time, y| stroke(Tool::Rain, 800.0, time, &[[240.0, y]]),
        |time, y| stroke(Tool::Lower, 7.0, time, &[[240.0, y - 100.0], [240.0, y + 100.0]]),
        |time, y| stroke(Tool::Erase, 0.6, time, &[[200.0, y], [280.0, y]]),
    ];

    #[test]
    fn step_by_step_it_is_the_run() {
        let land = valley();
        let strokes: Vec<Stroke> =
            ALL.iter().zip([300.0, 0.0, 90.5, 200.0]).map(|(make, at)| make(at, 600.0)).collect();
        for strokes in [&[][..], &strokes] {
            let params = params("duration=420, courant=0.1", strokes);
            let mut storm = begun(&land, &params);
            assert!(steps(&mut *storm, &land, &params, usize::MAX) > 20);
            let stepped = on(&land, &params, |job| storm.outputs(job).expect("there"));
            assert_eq!(stepped, outputs(&NODE, &params, &[("height", &land)]).expect("runs"));
        }
    }

    #[test]
    fn what_is_painted_on_the_way_is_what_a_run_with_it_gives() {
        let land = valley();
        let mut strokes = Vec::new();
        let mut all = params("duration=420, courant=0.1", &strokes);
        let mut storm = begun(&land, &all);
        for make in ALL {
            steps(&mut *storm, &land, &all, 9);
            let moment = storm.moment();
            assert!(moment.since.is_some_and(|since| since < moment.time()) && moment.time() <= moment.now);
            let before = on(&land, &all, |job| storm.outputs(job).expect("there"));
            strokes.push(make(moment.time(), 700.0));
            all = params("duration=420, courant=0.1", &strokes);
            assert!(storm.take(&all));
            let after = on(&land, &all, |job| storm.outputs(job).expect("there"));
            let moves = matches!(strokes[strokes.len() - 1].tool, Tool::Raise | Tool::Lower);
            assert_eq!(before != after, moves, "it is seen at once, before the next step");
        }
        assert!(steps(&mut *storm, &land, &all, usize::MAX) > 4);
        let stepped = on(&land, &all, |job| storm.outputs(job).expect("there"));
        assert_eq!(stepped, outputs(&NODE, &all, &[("height", &land)]).expect("runs"));
        assert!(!storm.take(&params("duration=420, courant=0.1", &strokes[1..])), "it has happened");
        assert!(
            !storm.take(&params("duration=420, courant=0.1", &[&strokes[..], &[ALL[0](1.0, 700.0)]].concat())),
            "too late"
        );
        assert!(!storm.take(&params("duration=421, courant=0.1", &strokes)), "another storm");
        assert!(storm.take(&params("duration=420, courant=0.1", &[&strokes[..], &[ALL[0](420.0, 700.0)]].concat())));
    }

    /// Painted rain counts in the water balance, and moved ground in neither balance: both close within 1e-5, as
    /// without strokes.
    #[test]
    fn painting_takes_part_in_the_balances() {
        let land = valley();
        let strokes = [ALL[0](60.0, 700.0), ALL[1](60.0, 500.0), ALL[3](150.0, 500.0)];
        let water_in = |strokes: &[Stroke]| {
            let found = outputs(&NODE, &params("duration=300, courant=0.1", strokes), &[("height", &land)]);
            let report = found.expect("runs").take("report").expect("declared");
            let balance = |of: &str| report.as_report().and_then(|report| report.balance_of(of)).expect("a balance");
            assert!(balance("water").error.abs() < 1e-5 && balance("sediment").error.abs() < 1e-5, "{report:?}");
            balance("water").get("rain").expect("a volume")
        };
        let [none, whole, dried] = [1, 2, 3].map(|count| water_in(&strokes[..count]));
        // the weight of a disc of radius R whose inner half is hard has the integral 0.575 π R²; the first sweep
        // after 60 s begins within 6 s, and cells are a sixth of the radius
        let expected = 0.575 * std::f64::consts::PI * 60.0 * 60.0 * 800.0 / 3.6e6 * 240.0;
        assert!(((whole - none) / expected - 0.99).abs() < 0.03, "{whole} {none} {expected}");
        assert!(dried - none > 0.5 * (whole - none) && dried < whole - 0.1 * (whole - none), "{dried} {whole}");
    }

    /// A world 480 m wide on cells of 10 m has room for widths of 50 to 120 m.
    #[test]
    fn a_width_that_cannot_be_kept_is_told() {
        let land = valley();
        for (width, told) in
            [("0", None), ("20", Some("50 m wide")), ("50", None), ("120", None), ("200", Some("over 120 m"))]
        {
            let params = params(&format!("width={width}"), &[]);
            let warnings = on(&land, &params, |job| {
                Storm::new(job).expect("begins");
                job.warnings.take()
            });
            assert_eq!(warnings.len(), usize::from(told.is_some()), "{width}: {warnings:?}");
            assert!(told.is_none_or(|told| warnings[0].contains(told)), "{width}: {warnings:?}");
        }
        let webgl = params("law=webgl_erosion, transport=maccormack", &[]);
        assert!(on(&land, &webgl, |job| Storm::new(job).map(|_| job.warnings.take().len()).expect("begins")) == 0);
    }

    #[test]
    fn threads_and_widths_of_vectors_give_the_same_bits() {
        let land = valley();
        let strokes: Vec<Stroke> = ALL.iter().zip([0.0, 20.0, 40.0, 60.0]).map(|(make, at)| make(at, 700.0)).collect();
        let params = params("duration=120", &strokes);
        assert_eq!(run_in(1, &NODE, &params, &[("height", &land)]), run_in(3, &NODE, &params, &[("height", &land)]));
        at_every_level(|| run_in(2, &NODE, &params, &[("height", &land)]));
    }
}
