//! Horizons on a graphics device: the same samples of the same smoothed terrain, one direction in each pass.

use std::ops::Range;

use orograph_graph::gpu::{ScratchId, Size};

use super::{Look, Rays, STEEPEST, sigma};
use crate::{
    numerics::{joins, smooth},
    prelude::*,
    wgsl,
};

/// Rasters that a pass reads: with all other buffers the eight that every device can bind.
const LANDS: usize = 4;
/// The names of their slots.
const NAMES: [&str; LANDS] = ["land_0", "land_1", "land_2", "land_3"];

/// The shader of a node whose input `height` is the terrain.
pub static SHADER: Shader = Shader {
    name: "lib/horizon",
    source: wgsl::HORIZON,
    library: &[wgsl::LINES],
    values: &[
        ("k_first", Number::U32),
        ("k_end", Number::U32),
        ("k_goes_on", Number::U32),
        joins::NUMBERS[0],
        joins::NUMBERS[1],
        ("k_steepest", Number::F32),
    ],
    slots: &[
        Slot::input("height"),
        Slot::words("looks", "Look"),
        Slot::cells(NAMES[0], "f32"),
        Slot::cells(NAMES[1], "f32"),
        Slot::cells(NAMES[2], "f32"),
        Slot::cells(NAMES[3], "f32"),
        Slot::cells("tangents", "f32").updated(),
    ],
};

/// The shader that adds up what is hidden of the sky, of a node with the parameter `exaggeration`.
pub static SKY: Shader = Shader {
    name: "lib/sky",
    source: wgsl::SKY,
    library: &[],
    values: &[("k_goes_on", Number::U32)],
    slots: &[Slot::cells("tangents", "f32"), Slot::cells("sums", "f32").updated()],
};

/// Terrain on the device for which horizons are recorded.
pub struct Horizons {
    looks: ScratchId,
    /// The terrain, and that of each smoothing level.
    lands: Vec<Bind>,
    /// For each direction, ranges of samples in the table: each in levels that one pass reads.
    parts: Vec<Vec<Part>>,
    joined: [(&'static str, Scalar); 2],
    rows: Rows,
}

/// A range of samples in the table, and the first level that it reads.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Part {
    samples: [u32; 2],
    level: usize,
}

impl Horizons {
    /// Records the smoothing of the input `height`. `share` is the part of the job's progress.
    ///
    /// # Errors
    /// Those of the recorder.
    pub fn new(job: &Job<'_>, recorder: &mut dyn Recorder, share: [f32; 2], rays: &Rays) -> Result<Self, NodeError> {
        let levels = rays.levels();
        let each = (share[1] - share[0]) / levels.max(1) as f32;
        let mut lands = vec![Bind::Input("height", 0)];
        let mut between = None;
        for level in 1..=levels {
            let from = share[0] + each * (level - 1) as f32;
            let way = between.map_or_else(|| recorder.scratch(Size::Cells), Ok)?;
            between = Some(way);
            let (part, rasters) = ([from, from + each], [way, recorder.scratch(Size::Cells)?]);
            smooth::smooth_into(job, recorder, lands[0], sigma(level), part, rasters)?;
            lands.push(Bind::Scratch(rasters[1]));
        }
        let looks = recorder.table(&rays.rays.iter().flatten().flat_map(words).collect::<Vec<_>>())?;
        let window = job.window();
        let reach = rays.rays.iter().flatten().flat_map(|look| [look.first[1], look.second[1]].map(i64::unsigned_abs));
        let reach = u32::try_from(reach.max().unwrap_or(0)).unwrap_or(u32::MAX);
        let (joined, rows) = (joins::numbers(&window), joins::rows(&window, reach));
        Ok(Self { looks, lands, parts: parts(rays), joined, rows })
    }

    /// Returns the number of directions.
    pub fn rays(&self) -> usize {
        self.parts.len()
    }

    /// Records the tangents of the horizon in one direction: what [`super::Horizon::tangents`] returns for all cells.
    ///
    /// # Errors
    /// Those of the recorder.
    pub fn tangents(&self, recorder: &mut dyn Recorder, ray: usize, into: ScratchId) -> Result<(), NodeError> {
        for (number, part) in self.parts[ray].iter().enumerate() {
            let lands = NAMES.into_iter().zip(self.lands[part.level..].iter().copied());
            let bind: Vec<(&'static str, Bind)> =
                lands.chain([("looks", Bind::Scratch(self.looks)), ("tangents", Bind::Scratch(into))]).collect();
            let [first, end] = part.samples;
            recorder.pass(&Pass {
                shader: &SHADER,
                entry: "look",
                bind: &bind,
                values: &[
                    ("k_first", Scalar::U32(first)),
                    ("k_end", Scalar::U32(end)),
                    ("k_goes_on", Scalar::U32(u32::from(number > 0))),
                    self.joined[0],
                    self.joined[1],
                    ("k_steepest", Scalar::F32(STEEPEST)),
                ],
                over: Over::Cells(self.rows),
            })?;
        }
        Ok(())
    }

    /// Records the sum of the squared sines of the horizon angles in some directions: their number times the hidden part
    /// of the light of an even sky. `share` is the part of the job's progress.
    ///
    /// # Errors
    /// Those of the recorder.
    pub fn hidden(
        &self,
        job: &Job<'_>,
        recorder: &mut dyn Recorder,
        share: [f32; 2],
        rays: Range<usize>,
    ) -> Result<ScratchId, NodeError> {
        let [tangents, sums] = [recorder.scratch(Size::Cells)?, recorder.scratch(Size::Cells)?];
        let (first, count) = (rays.start, rays.len());
        for ray in rays {
            self.tangents(recorder, ray, tangents)?;
            recorder.pass(&Pass {
                shader: &SKY,
                entry: "hide",
                bind: &[("tangents", Bind::Scratch(tangents)), ("sums", Bind::Scratch(sums))],
                values: &[("k_goes_on", Scalar::U32(u32::from(ray > first)))],
                over: Over::Cells(Rows::Around(0)),
            })?;
            job.advance(share[0] + (share[1] - share[0]) * (ray - first + 1) as f32 / count as f32)?;
        }
        Ok(sums)
    }
}

/// The words of a sample.
fn words(look: &Look) -> [u32; 8] {
    let [first, second] = [look.first, look.second].map(|cell| cell.map(|v| v as i32 as u32));
    let land = (look.level % LANDS) as u32;
    [first[0], first[1], second[0], second[1], look.share.to_bits(), look.per_m.to_bits(), land, 0]
}

/// Divides the samples of each direction, whose levels ascend.
fn parts(rays: &Rays) -> Vec<Vec<Part>> {
    let mut start = 0;
    let mut of_ray = |looks: &Vec<Look>| {
        let same = |a: &Look, b: &Look| a.level / LANDS == b.level / LANDS;
        let parts = looks.chunk_by(same).map(|looks| {
            let samples = [start, start + looks.len() as u32];
            start = samples[1];
            Part { samples, level: looks[0].level / LANDS * LANDS }
        });
        parts.collect()
    };
    rays.rays.iter().map(&mut of_ray).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::world;

    /// All samples of all directions are read once, in order, each in a pass that binds its level.
    #[test]
    fn parts_cover_the_samples() {
        let rays = Rays::new([0.0, 45.0, 100.0], 5000.0, &world(9000, 9000, 1.0), 0.3);
        assert!(rays.levels() > LANDS);
        let mut next = 0;
        for (looks, parts) in rays.rays.iter().zip(parts(&rays)) {
            assert!(parts.len() > 1);
            let start = next;
            for Part { samples, level } in parts {
                assert!(samples[0] == next && samples[1] > next);
                next = samples[1];
                for look in &looks[(samples[0] - start) as usize..(samples[1] - start) as usize] {
                    assert_eq!(words(look)[6] as usize, look.level - level);
                }
            }
            assert_eq!((next - start) as usize, looks.len());
        }
    }
}
