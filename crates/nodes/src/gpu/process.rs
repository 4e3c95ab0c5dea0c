//! Processes whose state is on a device.

use std::sync::{Arc, Mutex};

use orograph_graph::{
    Job, Moment, NodeError, Outputs, ParamValues, Process,
    gpu::{BeginSteps, Recorder, Steps},
};

use super::{
    Gpu, lock,
    run::{Kept, Run, Stop},
};

/// A process on a device.
struct OnDevice {
    gpu: Arc<Gpu>,
    state: Mutex<State>,
}

/// What a process keeps between its steps.
struct State {
    steps: Box<dyn Steps>,
    kept: Kept,
    /// True after the device has failed.
    has_failed: bool,
}

/// Starts a process. Returns None, after a warning, if the device fails.
pub(super) fn begin(gpu: Arc<Gpu>, begin: BeginSteps, job: &Job<'_>) -> Result<Option<Box<dyn Process>>, NodeError> {
    let (mut kept, mut steps) = (Kept::default(), None);
    let record = |recorder: &mut dyn Recorder| {
        steps = Some(begin(job, recorder)?);
        Ok(())
    };
    match call(&gpu, job, &mut kept, record) {
        Ok(_) => Ok(steps.map(|steps| {
            let state = Mutex::new(State { steps, kept, has_failed: false });
            Box::new(OnDevice { gpu, state }) as Box<dyn Process>
        })),
        Err(Stop::Node(error)) => Err(error),
        Err(Stop::Trouble(trouble)) => {
            gpu.decline(job, &trouble);
            Ok(None)
        }
    }
}

/// Runs what `record` records with the buffers that are kept; returns the wanted outputs.
fn call(
    gpu: &Gpu,
    job: &Job<'_>,
    kept: &mut Kept,
    record: impl FnOnce(&mut dyn Recorder) -> Result<(), NodeError>,
) -> Result<Outputs, Stop> {
    let _turn = gpu.turn.take(job).map_err(Stop::Node)?;
    gpu.memory.device.check()?;
    let mut run = Run::resume(gpu, job, kept)?;
    let recorded = record(&mut run);
    let outputs = run.leave(recorded, kept)?;
    // those who watch the process read them on the host
    outputs.fetch().map_err(|error| super::Trouble::Lost(error.0))?;
    Ok(outputs)
}

impl OnDevice {
    /// Calls the process; an error of the device is noted.
    fn call(
        &self,
        job: &Job<'_>,
        code: impl FnOnce(&mut dyn Steps, &mut dyn Recorder) -> Result<(), NodeError>,
    ) -> Result<Outputs, NodeError> {
        let mut state = lock(&self.state);
        let State { steps, kept, has_failed } = &mut *state;
        call(&self.gpu, job, kept, |recorder| code(&mut **steps, recorder)).map_err(|stop| match stop {
            Stop::Node(error) => error,
            Stop::Trouble(trouble) => {
                self.gpu.decline(job, &trouble);
                *has_failed = true;
                NodeError::failed(trouble.to_string())
            }
        })
    }
}

impl Process for OnDevice {
    fn moment(&self) -> Moment {
        lock(&self.state).steps.moment()
    }

    fn step(&mut self, job: &Job<'_>) -> Result<(), NodeError> {
        self.call(job, |steps, recorder| steps.step(job, recorder)).map(|_| ())
    }

    fn outputs(&self, job: &Job<'_>) -> Result<Outputs, NodeError> {
        self.call(job, |steps, recorder| steps.outputs(job, recorder))
    }

    fn take(&mut self, params: &ParamValues) -> bool {
        lock(&self.state).steps.take(params)
    }

    fn has_lost_device(&self) -> bool {
        lock(&self.state).has_failed
    }
}
