//! The passes of a storm.

use orograph_graph::gpu::{ScratchId, Size};

use super::{
    super::physics::{Pace, Physics, Scheme, Transport},
    CARRY, EXCHANGE, LIMIT, LOAD, SLIP, SPREAD, WATER,
};
use crate::{numbers::Numbers, prelude::*};

/// The rasters of a storm, and what the passes over them share.
pub(super) struct Rasters {
    /// All buffers by the names of their variables.
    buffers: Vec<(&'static str, Bind)>,
    /// Numbers of the run, and of the step.
    values: Numbers,
    /// Passes in a periodic world, or with tables of all cells, read any row.
    reads_all: bool,
}

impl Rasters {
    pub fn new(values: Numbers, reads_all: bool) -> Self {
        Self { buffers: Vec::new(), values, reads_all }
    }

    /// Binds a buffer to the slots of a name.
    pub fn bind(&mut self, name: &'static str, id: ScratchId) {
        self.buffers.push((name, Bind::Scratch(id)));
    }

    pub fn buffer(
        &mut self,
        recorder: &mut dyn Recorder,
        name: &'static str,
        size: Size,
    ) -> Result<ScratchId, NodeError> {
        let id = recorder.scratch(size)?;
        self.bind(name, id);
        Ok(id)
    }

    /// A raster of zeros.
    pub fn zeros(&mut self, recorder: &mut dyn Recorder, name: &'static str) -> Result<ScratchId, NodeError> {
        let id = self.buffer(recorder, name, Size::Cells)?;
        recorder.clear(id).map(|()| id)
    }

    /// A pass in which a cell reads that many rows around its own.
    pub fn pass(
        &self,
        recorder: &mut dyn Recorder,
        shader: &'static Shader,
        entry: &'static str,
        around: u32,
    ) -> Result<(), NodeError> {
        let rows = if self.reads_all { Rows::All } else { Rows::Around(around) };
        let (bind, values) = (&self.buffers, &self.values);
        recorder.pass(&Pass { shader, entry, bind, values, over: Over::Cells(rows) })
    }

    /// Changes a number.
    pub fn put(&mut self, name: &str, value: Scalar) {
        self.values.put(name, value);
    }

    pub fn pace(&mut self, pace: &Pace) {
        for (name, value) in floats(pace) {
            self.put(name, Scalar::F32(value));
        }
    }

    /// What a step does.
    pub fn step(&self, recorder: &mut dyn Recorder, physics: &Physics, pace: &Pace) -> Result<(), NodeError> {
        let mut pass = |shader, entry, around| self.pass(recorder, shader, entry, around);
        pass(&LOAD, "main", 0)?;
        match physics.scheme {
            Scheme::Inertial => {
                pass(&WATER, "drive", 2)?;
                pass(&WATER, "rub", 2)?;
            }
            Scheme::Pipes => pass(&WATER, "pipes", 2)?,
        }
        pass(&LIMIT, "supply", 1)?;
        pass(&LIMIT, "main", 1)?;
        pass(&EXCHANGE, "main", 1)?;
        match physics.transport {
            Transport::Upwind => pass(&CARRY, "upwind", 1)?,
            Transport::SemiLagrangian => pass(&CARRY, "trace", 1)?,
            Transport::MacCormack => {
                pass(&CARRY, "predict", 1)?;
                pass(&CARRY, "correct", 1)?;
            }
        }
        if pace.dries() {
            pass(&CARRY, "dry", 0)?;
        }
        Ok(())
    }

    /// Spreads what a sweep has eroded, and lets ground slide.
    pub fn settle(&mut self, recorder: &mut dyn Recorder, distances: &[usize]) -> Result<(), NodeError> {
        if !distances.is_empty() {
            self.pass(recorder, &SPREAD, "gather", 0)?;
            self.pass(recorder, &SPREAD, "mark", 1)?;
            for &distance in distances {
                self.put("k_distance", Scalar::I32(i32::try_from(distance).unwrap_or(i32::MAX)));
                self.pass(recorder, &SPREAD, "average", u32::try_from(distance).unwrap_or(u32::MAX))?;
                for (name, _) in &mut self.buffers {
                    *name = match *name {
                        "spread" => "next",
                        "next" => "spread",
                        other => other,
                    };
                }
            }
            self.pass(recorder, &SLIP, "replace", 0)?;
        }
        self.pass(recorder, &SLIP, "level", 0)?;
        self.pass(recorder, &SLIP, "supply", 1)?;
        self.pass(recorder, &SLIP, "apply", 1)
    }
}

/// The numbers of a step by their names in the shaders.
fn floats(pace: &Pace) -> [(&'static str, f32); 26] {
    [
        ("k_dt", pace.dt_s),
        ("k_step", pace.step),
        ("k_rain", pace.rain_m),
        ("k_push", pace.push),
        ("k_steepest", pace.steepest_m),
        ("k_friction", pace.friction),
        ("k_critical", pace.critical),
        ("k_section", pace.section_m),
        ("k_damping", pace.damping),
        ("k_per_film", pace.per_film),
        ("k_per_deep", pace.per_deep),
        ("k_tilt", pace.tilt),
        ("k_tilt_floor", pace.tilt_floor),
        ("k_shear", pace.shear),
        ("k_capacity", pace.capacity),
        ("k_thickest", pace.thickest),
        ("k_settling", pace.settling),
        ("k_entrainment", pace.entrainment),
        ("k_rock", pace.rock),
        ("k_acceleration", pace.acceleration),
        ("k_per_acceleration", pace.per_acceleration),
        ("k_most", pace.most_m),
        ("k_bite", pace.bite_m[0]),
        ("k_bite_deeper", pace.bite_m[1]),
        ("k_evaporation", pace.evaporation),
        ("k_infiltration", pace.infiltration_m),
    ]
}
