//! What a level leaves to the next one.

use orograph_graph::{
    State,
    memory::{OutOfMemory, copied, with_capacity},
};

use super::Frame;
use crate::{erosion::stream_power::land::Land, prelude::*};

/// The land of a level at the time at which the next one begins, read from a [`State`].
///
/// Heights are rounded to single precision once per level, to 0.1 mm at 1 km: the next level interpolates them.
pub struct Checkpoint<'a> {
    /// Its cells.
    pub frame: Frame,
    /// Heights at the start of the run and at the end of the level, in metres. Empty where the next level begins at the
    /// start.
    pub heights: [&'a [f32]; 2],
    /// Sediment, where there is deposition.
    pub loose: Option<Loose<'a>>,
    /// Cells of the rim of `inland` sides through which rivers leave, in rising order.
    pub gates: Vec<u32>,
    /// Years that have passed.
    pub time_yr: f64,
    /// The time in which the land answers a change, in years, measured on the coarsest level.
    pub response_yr: f64,
}

/// Loose material per cell, in metres.
#[derive(Clone, Copy, Debug)]
pub struct Loose<'a> {
    /// What joins the rivers at the next step.
    pub debris: &'a [f32],
    /// What lies on the rock.
    pub thickness: &'a [f32],
}

impl<'a> Checkpoint<'a> {
    /// Reads the state of a level on these cells.
    ///
    /// # Errors
    /// When it is that of other cells, because the level below did not follow the node's declaration.
    pub fn read(state: &'a State, frame: Frame) -> Result<Self, NodeError> {
        let cells = frame.outer.len();
        let wrong = || NodeError::failed("the state of the level below is on other cells");
        let [response_yr, time_yr, gates @ ..] = &*state.numbers else { return Err(wrong()) };
        let (heights, loose): ([&[f32]; 2], _) = match &*state.rasters {
            [] => ([&[]; 2], None),
            [start, end] => ([&**start, &**end], None),
            [start, end, debris, thickness] => ([&**start, &**end], Some(Loose { debris, thickness })),
            _ => return Err(wrong()),
        };
        if state.rasters.iter().any(|raster| raster.len() != cells) {
            return Err(wrong());
        }
        let gates = gates.iter().map(|gate| *gate as u32).collect();
        Ok(Self { frame, heights, loose, gates, time_yr: *time_yr, response_yr: *response_yr })
    }

    /// The state of a level after which the next one begins at the start.
    #[must_use]
    pub fn of_start(gates: &[u32], response_yr: f64) -> State {
        State { rasters: Vec::new(), numbers: numbers(response_yr, 0.0, gates) }
    }
}

fn numbers(response_yr: f64, time_yr: f64, gates: &[u32]) -> Vec<f64> {
    [response_yr, time_yr].into_iter().chain(gates.iter().map(|gate| f64::from(*gate))).collect()
}

impl Land<'_> {
    /// What the next level goes on with.
    ///
    /// # Errors
    /// [`OutOfMemory`].
    pub fn state(&self, start: &[f32], response_yr: f64) -> Result<State, OutOfMemory> {
        let single = |metres: &[f64]| {
            let mut found = with_capacity(metres.len())?;
            found.extend(metres.iter().map(|metres| *metres as f32));
            Ok(found)
        };
        let mut rasters = vec![copied(start)?, single(&self.heights)?];
        if let Some((debris, thickness)) = self.loose() {
            rasters.push(single(debris)?);
            rasters.push(copied(thickness)?);
        }
        Ok(State { rasters, numbers: numbers(response_yr, self.time_yr(), self.gates()) })
    }
}
