//! Glaciers whose ice flows on a device.

use orograph_graph::{InputValue, Moment, Process, gpu::Steps};

use super::{
    super::{
        glacier::{Flow, Glacier},
        march::march,
    },
    ice::{DeviceIce, Marching},
};
use crate::prelude::*;

/// Glaciers in progress: all but the flow of the ice is on the host.
pub(super) struct DeviceGlacier {
    glacier: Glacier,
    ice: DeviceIce,
}

impl DeviceGlacier {
    pub fn new(job: &Job<'_>, recorder: &mut dyn Recorder) -> Result<Self, NodeError> {
        job.inputs.iter().try_for_each(InputValue::fetch)?;
        let glacier = Glacier::new(job)?;
        let Flow::Full { sheet, .. } = &glacier.flow else {
            return Err(NodeError::failed("ice flows on a device with the full method alone"));
        };
        let ice = DeviceIce::new(&glacier, sheet, recorder)?;
        Ok(Self { glacier, ice })
    }
}

impl Steps for DeviceGlacier {
    fn moment(&self) -> Moment {
        self.glacier.moment()
    }

    fn step(&mut self, job: &Job<'_>, recorder: &mut dyn Recorder) -> Result<(), NodeError> {
        let Self { glacier, ice } = self;
        if glacier.done >= glacier.steps() {
            return Ok(());
        }
        let shift_m = glacier.shift_m(glacier.done);
        let years = glacier.params.relaxation;
        if let Flow::Full { sheet, pace, .. } = &mut glacier.flow {
            ice.begin(recorder, sheet, shift_m)?;
            let mut ledger = march(job, &mut Marching { ice: &mut *ice, recorder: &mut *recorder }, pace, years)?;
            ice.end(recorder, sheet, &mut ledger)?;
            glacier.ledger.join(&ledger);
        }
        glacier.carve(job, shift_m)?;
        job.glimpse(|| glacier.glimpse(job));
        Ok(())
    }

    fn outputs(&mut self, job: &Job<'_>, recorder: &mut dyn Recorder) -> Result<(), NodeError> {
        let outputs = self.glacier.outputs(job)?;
        outputs.into_iter_named().for_each(|(name, value)| recorder.give(name, value));
        Ok(())
    }

    fn take(&mut self, params: &ParamValues) -> bool {
        self.glacier.take(params)
    }
}
