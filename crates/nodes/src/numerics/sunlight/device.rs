//! Sunlight on a graphics device. The intervals between moments are sorted by azimuth, so that the horizon of each
//! direction is computed once or a few times, although few are kept.

use orograph_graph::gpu::{ScratchId, Size};

use super::{Moment, Way, path::Arc};
use crate::{
    numerics::{horizon::device::Horizons, joins},
    prelude::*,
    wgsl,
};

/// Directions whose horizons are kept: those of an interval.
const KEPT: usize = 4;
/// The names of their slots.
const NAMES: [&str; KEPT] = ["tangents_0", "tangents_1", "tangents_2", "tangents_3"];

/// The shader of a node whose input `height` is the terrain.
pub static SHADER: Shader = Shader {
    name: "lib/sunlight",
    source: wgsl::SUNLIGHT,
    library: &[wgsl::LINES, wgsl::GRADIENT],
    values: &[("k_first", Number::U32), ("k_end", Number::U32), joins::NUMBERS[0], joins::NUMBERS[1]],
    slots: &[
        Slot::input("height"),
        Slot::words("intervals", "Interval"),
        Slot::cells(NAMES[0], "f32"),
        Slot::cells(NAMES[1], "f32"),
        Slot::cells(NAMES[2], "f32"),
        Slot::cells(NAMES[3], "f32"),
        Slot::cells("lit", "f32").updated(),
        Slot::cells("energy", "f32").updated(),
    ],
};

/// The time between two moments.
#[derive(Clone, Copy)]
struct Interval {
    moments: [Moment; 2],
    step_s: f32,
}

impl Interval {
    /// The directions that it uses, in ascending order.
    fn rays(&self) -> Vec<usize> {
        let mut rays = self.moments.map(|moment| moment.rays).concat();
        rays.sort_unstable();
        rays.dedup();
        rays
    }
}

/// Intervals that together use few directions.
struct Group {
    intervals: Vec<Interval>,
    rays: Vec<usize>,
}

/// Records the sunshine on each cell over all arcs, with as many directions as the horizons have: seconds in which it is
/// lit, and joules per square metre. `share` is the part of the job's progress.
///
/// # Errors
/// Those of the recorder.
pub fn record(
    job: &Job<'_>,
    recorder: &mut dyn Recorder,
    share: [f32; 2],
    horizons: &Horizons,
    arcs: &[Arc],
) -> Result<[ScratchId; 2], NodeError> {
    let sums = [recorder.scratch(Size::Cells)?, recorder.scratch(Size::Cells)?];
    sums.into_iter().try_for_each(|sum| recorder.clear(sum))?;
    let groups = groups(arcs, horizons.rays());
    let mut rasters: Vec<(ScratchId, Option<usize>)> = Vec::new();
    for _ in 0..KEPT {
        rasters.push((recorder.scratch(Size::Cells)?, None));
    }
    let plan = plan(&groups);
    let words: Vec<u32> = groups
        .iter()
        .zip(&plan)
        .flat_map(|(group, kept)| group.intervals.iter().flat_map(move |interval| words(interval, kept)))
        .collect();
    let intervals = recorder.table(&words)?;
    let [across, down] = joins::numbers(&job.window());
    let mut first = 0;
    for (number, (group, kept)) in groups.iter().zip(&plan).enumerate() {
        for ((raster, has), ray) in rasters.iter_mut().zip(kept) {
            if let Some(ray) = ray.filter(|ray| *has != Some(*ray)) {
                horizons.tangents(recorder, ray, *raster)?;
                *has = Some(ray);
            }
        }
        let tangents = NAMES.into_iter().zip(&rasters).map(|(name, (raster, _))| (name, Bind::Scratch(*raster)));
        let others = [("intervals", intervals), ("lit", sums[0]), ("energy", sums[1])];
        let bind: Vec<(&'static str, Bind)> =
            tangents.chain(others.map(|(name, id)| (name, Bind::Scratch(id)))).collect();
        let end = first + group.intervals.len() as u32;
        recorder.pass(&Pass {
            shader: &SHADER,
            entry: "shine",
            bind: &bind,
            values: &[("k_first", Scalar::U32(first)), ("k_end", Scalar::U32(end)), across, down],
            over: Over::Cells(joins::rows(&job.window(), 1)),
        })?;
        first = end;
        job.advance(share[0] + (share[1] - share[0]) * (number + 1) as f32 / groups.len() as f32)?;
    }
    Ok(sums)
}

/// Sorts the intervals of all arcs by azimuth, and gathers neighbours as long as they use no more directions than are
/// kept.
fn groups(arcs: &[Arc], rays: usize) -> Vec<Group> {
    let mut intervals: Vec<Interval> = Vec::new();
    for way in arcs.iter().map(|arc| Way::new(arc, rays)) {
        let of_way = way.moments.windows(2).map(|pair| Interval { moments: [pair[0], pair[1]], step_s: way.step_s });
        intervals.extend(of_way);
    }
    intervals.sort_by_cached_key(Interval::rays);
    let mut groups: Vec<Group> = Vec::new();
    for interval in intervals {
        let mut rays = interval.rays();
        if let Some(last) = groups.last_mut() {
            rays.extend(&last.rays);
            rays.sort_unstable();
            rays.dedup();
            if rays.len() <= KEPT {
                last.rays = rays;
                last.intervals.push(interval);
                continue;
            }
            rays = interval.rays();
        }
        groups.push(Group { intervals: vec![interval], rays });
    }
    groups
}

/// Returns the direction that each kept raster has for each group; those that the group before has stay where they are.
fn plan(groups: &[Group]) -> Vec<[Option<usize>; KEPT]> {
    let mut kept = [None; KEPT];
    let of_group = |group: &Group| {
        let is_free = |ray: &Option<usize>| ray.is_none_or(|ray| !group.rays.contains(&ray));
        for ray in &group.rays {
            if !kept.contains(&Some(*ray)) {
                // a group uses at most as many directions as there are rasters
                if let Some(free) = kept.iter_mut().find(|ray| is_free(ray)) {
                    *free = Some(*ray);
                }
            }
        }
        kept
    };
    groups.iter().map(of_group).collect()
}

/// The words of an interval.
fn words(interval: &Interval, kept: &[Option<usize>; KEPT]) -> Vec<u32> {
    let place = |ray: usize| kept.iter().position(|kept| *kept == Some(ray)).unwrap_or(0) as u32;
    let of_moment = |moment: &Moment| {
        let numbers = [moment.share, moment.tangent].into_iter().chain(moment.beam).map(f32::to_bits);
        moment.rays.map(place).into_iter().chain(numbers).collect::<Vec<_>>()
    };
    interval.moments.iter().flat_map(of_moment).chain([interval.step_s.to_bits()]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::sunlight::path;

    /// Every interval is in one group, which has the horizons that it uses; over a year they are computed few times.
    #[test]
    fn groups_have_the_horizons_of_their_intervals() {
        for (latitude, rays) in [(45.0, 48), (10.0, 128), (-80.0, 8)] {
            let arcs: Vec<Arc> = path::MONTHS.iter().filter_map(|month| path::day(*month, latitude, 24, 0.7)).collect();
            let groups = groups(&arcs, rays);
            let count: usize = groups.iter().map(|group| group.intervals.len()).sum();
            assert_eq!(count, arcs.iter().map(|arc| arc.positions.len() - 1).sum::<usize>());
            let (mut before, mut computed) = ([None; KEPT], 0);
            for (group, kept) in groups.iter().zip(plan(&groups)) {
                for interval in &group.intervals {
                    assert!(interval.rays().iter().all(|ray| kept.contains(&Some(*ray))));
                }
                computed += kept.iter().zip(before).filter(|(now, before)| **now != *before).count();
                before = kept;
            }
            assert!(computed <= 2 * rays, "{latitude}: {computed}");
        }
    }
}
