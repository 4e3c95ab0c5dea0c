//! Voids of rasters, and rasters without them.

use std::borrow::Cow;

use orograph_graph::{Job, NodeError, memory::copied};

use super::par;
use crate::raster::fill_voids;

/// Returns true where a mask says that nothing is known: below one half.
#[must_use]
#[inline(always)]
pub fn is_void(known: f32) -> bool {
    known.is_nan() || known < 0.5
}

/// Returns the samples of the job's window with voids, which are not finite, filled from around them; 0 if there is no
/// number at all.
///
/// # Errors
/// [`NodeError::Cancelled`], or not enough memory.
pub fn filled<'a>(job: &Job<'_>, samples: &'a [f32]) -> Result<Cow<'a, [f32]>, NodeError> {
    if !par::any(samples, |sample| !sample.is_finite()) {
        return Ok(Cow::Borrowed(samples));
    }
    let mut filled = copied(samples)?;
    par::change(&mut filled, |sample| *sample = if sample.is_finite() { *sample } else { f32::NAN });
    fill_voids(job.window().nx(), job.window().ny(), &mut filled, &|| job.check())?;
    par::change(&mut filled, |sample| *sample = if sample.is_nan() { 0.0 } else { *sample });
    Ok(Cow::Owned(filled))
}
