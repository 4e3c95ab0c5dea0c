//! Carves beds along lines: rivers, ditches, roads and dams.
//!
//! `course` bends a path, `way` computes the bed's width and elevation along each line, `rough` the roughness that its
//! banks keep, and `draw` applies them to the cells around it.

mod course;
mod draw;
mod rough;
mod way;

use self::{
    draw::{Ground, draw},
    way::Way,
};
use super::mix;
use crate::prelude::*;

choice! {
    /// How the terrain is changed.
    pub enum Mode {
        /// Terrain above the bed is removed: rivers, ditches, canyons.
        Carve = "carve",
        /// Terrain below the bed is filled up: dams, causeways.
        Fill = "fill",
        /// Both: roads.
        Grade = "grade",
    }
}

choice! {
    /// How the elevation of the bed follows a line.
    pub enum Course {
        /// It follows the terrain.
        Land = "land",
        /// It follows the terrain down and never rises from the start to the end.
        Downhill = "downhill",
        /// It follows the terrain, but is nowhere steeper than `grade`: the terrain is cut and filled alike.
        Graded = "graded",
        /// It is straight from the terrain at the start to that at the end.
        Straight = "straight",
    }
}

choice! {
    /// The cross-section of the bed.
    pub enum Profile {
        /// Level across.
        Flat = "flat",
        /// A parabola.
        Round = "round",
        /// Two straight sides.
        Sharp = "sharp",
    }
}

params! {
    /// How the terrain is changed.
    mode: Mode = Mode::Carve, One, ..;
    /// Points along the line, from the start to the end.
    path: PathPoints = PathPoints(vec![[1500.0, 2500.0], [4500.0, 4000.0], [6000.0, 7500.0], [9500.0, 8500.0], [11500.0, 12500.0], [15000.0, 14000.0]]), Metres, -1e7..=1e7, unless lines;
    /// Width of the bed; the minimum width of `lines`.
    width: f64 = 150.0, Metres, 0.0..=1e6, soft 0..=1000;
    /// How far the bed lies below the terrain along the line; negative lies above it. The minimum depth of `lines`.
    depth: f64 = 60.0, Metres, -1e4..=1e4, soft -100..=500;
    /// The cross-section of the bed: from its middle it rises by `depth` to its edges.
    profile: Profile = Profile::Round, One, ..;
    /// Distance beyond the bed over which it blends into the terrain; at least one cell.
    bank: f64 = 250.0, Metres, 0.0..=1e6, soft 0..=2000;
    /// How the elevation of the bed follows a line.
    course: Course = Course::Downhill, One, ..;
    /// Length along the path over which the elevation of the terrain is averaged.
    easing: f64 = 500.0, Metres, 0.0..=1e6, soft 0..=5000, when course = "land" | "downhill" | "graded";
    /// The largest rise over run of the bed.
    grade: f64 = 0.08, One, 0.0..=10.0, soft 0.02..=0.3, when course = "graded";
    /// How round the path is at its points: 0 for straight stretches with corners.
    curve: f64 = 1.0, One, 0.0..=1.0, unless lines;
    /// How far the path winds.
    ///
    /// At 1 the largest bends reach two widths of bed and bank to either side.
    wander: f64 = 0.5, One, 0.0..=1.0, unless lines;
    /// How much narrower and shallower the start of the path is than its end.
    widening: f64 = 0.6, One, 0.0..=1.0, unless lines;
    /// How uneven banks are: 0 for banks parallel to the line.
    raggedness: f64 = 0.6, One, 0.0..=1.0;
    /// How much of the roughness of the terrain stays on the banks: 0 for smooth banks and a bed of even width.
    detail: f64 = 0.8, One, 0.0..=1.0;
    /// Random seed of bends and banks.
    seed: Seed = Seed(0), Count, ..;
}

inputs! {
    /// Terrain height.
    height: Height;
    /// Lines with their own widths, depths and elevations, such as those of `Rivers` and `Path`.
    ///
    /// Lines without elevations follow the terrain.
    lines: Option<Lines>;
    /// Where the result replaces the terrain: fully at 1, not at all at 0.
    mask: Mask = 1.0, 0.0..=1.0;
}

outputs! {
    /// Terrain with the bed.
    height: Height;
    /// 1 on the bed, 0 beyond its banks.
    bed: Mask;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Carve",
    version: 4,
    migrations: &[
        Migration {
            from: 1,
            steps: &[
                Step::Keep { name: "curve", value: "0" },
                Step::Keep { name: "wander", value: "0" },
                Step::Keep { name: "widening", value: "0" },
                Step::Keep { name: "raggedness", value: "0" },
            ],
        },
        Migration { from: 2, steps: &[] },
        Migration { from: 3, steps: &[Step::Keep { name: "detail", value: "0" }] },
    ],
    category: "filter",
    summary: "Carves or fills a bed along a path or along rivers: valleys, ditches, roads, dams.",
    doc: include_str!("page.md"),
    sources: &[
        "E. Galin, A. Peytavie, N. Maréchal and É. Guérin (2010), Procedural generation of roads, Computer Graphics Forum 29 \
         (2), 429-438",
        "J.-D. Génevaux, É. Galin, É. Guérin, A. Peytavie and B. Benes (2013), Terrain generation using procedural models based \
         on hydrology, ACM Transactions on Graphics 32 (4)",
        "L. B. Leopold and T. Maddock (1953), The hydraulic geometry of stream channels and some physiographic \
         implications, US Geological Survey Professional Paper 252",
        "L. B. Leopold and M. G. Wolman (1960), River meanders, GSA Bulletin 71, 769-794",
    ],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    reach: Reach::World,
    scratch: Scratch::Bytes(|sizing| {
        let params = Params::read(sizing.params);
        if sizing.is_wired(Inputs::PORTS, "lines") || params.width > 0.0 {
            draw::bytes(&sizing.window).max(rough::bytes(sizing, &params)) + rough::kept_bytes(sizing, &params)
        } else {
            0
        }
    }),
    cpu: run,
    example: "height: \"base\", width: 900, depth: 200, bank: 1200",
    ..Node::DEFAULT
};

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let (Inputs { height, lines, mask }, wants) = (Inputs::read(job)?, Wants::of(job));
    let params = Params::read(job.params);
    let seed = orograph_graph::mix(job.seed());
    let ways: Vec<Way> = match lines {
        Some(lines) if lines.draped => lines.lines.iter().map(|line| Way::of_draped(line, &params, height)).collect(),
        Some(lines) => lines.lines.iter().map(|line| Way::of_line(line, &params)).collect(),
        None if params.width == 0.0 => Vec::new(),
        None => vec![Way::of_path(&params, height, seed)],
    };
    if ways.is_empty() {
        return Ok(Given {
            height: wants.height.then(|| height.clone()),
            bed: wants.bed.then(|| Field::constant(job.window(), 0.0)),
        }
        .into());
    }
    let rough = if wants.height { rough::of(job, height.samples(), &params)? } else { Vec::new() };
    let land = Ground { heights: height.samples(), rough: &rough };
    let [mut out, bed] = draw(job, land, &ways, &params, seed, [wants.height, wants.bed])?;
    drop(rough);
    if let Some(out) = &mut out {
        mix(job, height.samples(), out, mask)?;
    }
    let field = |samples| Field::new(job.window(), samples);
    Ok(Given { height: out.map(field), bed: bed.map(field) }.into())
}

#[cfg(test)]
mod tests;
