//! Sky view factor and ambient occlusion.

use orograph_graph::{World, memory::zeroed};

use crate::{
    numerics::{
        horizon::{Horizon, Rays, device},
        par,
        simd::simd,
        smooth,
        sunlight::{around, growth},
    },
    prelude::*,
};

/// Rows and columns of a tile: each direction is computed for a whole tile, whose surroundings stay in the cache.
const ROWS: usize = 16;
const COLUMNS: usize = 128;

params! {
    /// Distance within which terrain can occlude the sky.
    distance: f64 = 2000.0, Metres, 0.0..=1e6, soft 50..=20_000;
    /// Number of directions in which the horizon is computed.
    azimuths: i64 = 32, Count, 4..=128, soft 8..=64;
    /// Factor on heights; use 2 to 10 for gentle terrain.
    exaggeration: f64 = 1.0, One, 0.0..=1000.0, soft 0.2..=10;
}

inputs! {
    /// Terrain height.
    height: Height;
}

outputs! {
    /// Fraction of the light of a uniform sky that is occluded.
    occlusion: Mask;
    /// Fraction of the light of a uniform sky that arrives; 1 on open ground.
    sky: Mask;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Occlusion",
    category: "select",
    summary: "How much of the sky is visible from a place: the sky view factor, and ambient occlusion.",
    doc: include_str!("occlusion.md"),
    sources: &[
        "I. D. Watson and G. T. Johnson (1987), Graphical estimation of sky view-factors in urban environments, Journal of \
         Climatology 7, 193-197",
        "K. Zakšek, K. Oštir and Ž. Kokalj (2011), Sky-view factor as a relief visualization technique, Remote Sensing 3, 398-415",
    ],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    reach: Reach::Metres(|params, cell_m| {
        let params = Params::read(params);
        Rays::reach_m(params.distance, cell_m, growth(params.azimuths))
    }),
    scratch: Scratch::Bytes(scratch),
    cpu: run,
    gpu: Some(&GPU),
    resolution: Resolution::Within(0.12),
    example: "height: \"base\", distance: 3000, exaggeration: 2",
    ..Node::DEFAULT
};

static SHADER: Shader = Shader {
    name: "select/occlusion",
    source: wgsl!("select/occlusion"),
    library: &[],
    values: &[("k_share", Number::F32)],
    slots: &[Slot::cells("sums", "f32"), Slot::output("occlusion"), Slot::output("sky")],
};

static GPU: GpuKernel = GpuKernel {
    shaders: &[&smooth::SHADER, &device::SHADER, &device::SKY, &SHADER],
    passes: Passes::Recorded(record),
    // the same samples; heights are smoothed in single precision
    tolerance: &[Tolerance::absolute(1e-5), Tolerance::absolute(1e-5)],
    ..GpuKernel::DEFAULT
};

fn record(job: &Job<'_>, recorder: &mut dyn Recorder) -> Result<(), NodeError> {
    let rays = Params::read(job.params).rays(job.world());
    let horizons = device::Horizons::new(job, recorder, [0.0, 0.2], &rays)?;
    let sums = horizons.hidden(job, recorder, [0.2, 1.0], 0..rays.count())?;
    recorder.pass(&Pass {
        shader: &SHADER,
        entry: "main",
        bind: &[("sums", Bind::Scratch(sums))],
        values: &[("k_share", Scalar::F32(1.0 / rays.count() as f32))],
        over: Over::Cells(Rows::Around(0)),
    })
}

impl Params {
    fn rays(&self, world: &World) -> Rays {
        Rays::new(around(self.azimuths), self.distance, world, growth(self.azimuths))
    }
}

/// Memory that the kernel needs in addition to its inputs and outputs.
fn scratch(sizing: &Sizing<'_>) -> u64 {
    Params::read(sizing.params).rays(&sizing.window.world).bytes(&sizing.window)
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let params = Params::read(job.params);
    let rays = params.rays(job.world());
    let horizon = Horizon::new(job, [0.0, 0.2], Inputs::read(job)?.height, rays)?;
    let nx = job.window().nx();
    let mut occlusion = zeroed(job.window().len())?;
    par::bands_within(job, [0.2, 0.9], ROWS, &mut occlusion, |first, rows| {
        let mut tangents = [0.0; COLUMNS];
        for start in (0..nx).step_by(COLUMNS) {
            let columns = start..nx.min(start + COLUMNS);
            for ray in 0..horizon.rays() {
                for (k, row) in rows.chunks_mut(nx).enumerate() {
                    horizon.tangents(ray, first + k, columns.clone(), &mut tangents);
                    hide(&mut row[columns.clone()], &tangents, params.exaggeration as f32);
                }
            }
        }
        let share = 1.0 / horizon.rays() as f32;
        rows.iter_mut().for_each(|sum| *sum = (*sum * share).min(1.0));
        Ok(())
    })?;
    let wants = Wants::of(job);
    let open = |_, row: &mut [f32]| row.iter_mut().for_each(|hidden| *hidden = 1.0 - *hidden);
    let field = |samples| Field::new(job.window(), samples);
    Ok(Given {
        sky: wants
            .sky
            .then(|| par::rows_from(job, [0.9, 1.0], &mut occlusion, wants.occlusion, open))
            .transpose()?
            .map(field),
        occlusion: wants.occlusion.then(|| field(occlusion)),
    }
    .into())
}

simd! {
    /// Adds the squared sines of horizon angles.
    fn hide(sums: &mut [f32], tangents: &[f32], exaggeration: f32) {
        for (sum, &tangent) in sums.iter_mut().zip(tangents) {
            let tangent = tangent * exaggeration;
            let square = tangent * tangent;
            *sum += square / (1.0 + square);
        }
    }
}

#[cfg(test)]
mod tests {
    use orograph_graph::{Boundary, Edge, World};

    use super::*;
    use crate::testing::{at_every_level, field, reach_m, run as result, run_in, with_params, world};

    fn sky(land: &Field, changes: &str) -> Field {
        result(&NODE, &with_params(&NODE, changes), &[("height", land)], "sky")
    }

    #[test]
    fn level_ground_sees_all_the_sky() {
        for height in [0.0, 8123.4] {
            let land = field(world(90, 40, 10.0), |_, _| height);
            // smoothing rounds heights to 24 bits: 0.0005 m at 8 km
            assert!(sky(&land, "").samples().iter().all(|sky| (0.999_999..=1.0).contains(sky)));
        }
    }

    /// The sky view factor of a slope is (1 + cos β) / 2: exactly for the mean over the sampled azimuths, and to the
    /// accuracy of 32 azimuths for the closed form.
    #[test]
    fn a_long_slope_sees_what_is_above_it() {
        for slope in [0.3, 1.0] {
            let land = field(world(200, 200, 10.0), |x, y| slope * (0.8 * x - 0.6 * y));
            let sky = sky(&land, "distance=500");
            let mean: f64 = around(32)
                .map(|azimuth| {
                    let radians = azimuth.to_radians();
                    let rise = slope * (0.8 * libm::sin(radians) + 0.6 * libm::cos(radians)).max(0.0);
                    rise * rise / (1.0 + rise * rise)
                })
                .sum::<f64>()
                / 32.0;
            let closed = 0.5 + 0.5 / libm::sqrt(1.0 + slope * slope);
            let found = f64::from(sky.samples()[100 * 200 + 100]);
            assert!((found - (1.0 - mean)).abs() < 2e-5, "{found} {mean}"); // heights of 1 km in single precision
            assert!((found - closed).abs() < 1e-3, "{found} {closed}");
        }
    }

    /// A long wall occludes as much as a slope of the same angle; from its top the whole sky is visible.
    #[test]
    fn a_wall_hides_half_of_its_angle() {
        let land = field(world(400, 500, 5.0), |x, _| if x < 1000.0 { 0.0 } else { 300.0 });
        let sky = sky(&land, "distance=1400");
        for (cell, distance_m) in [(198, 7.5), (180, 97.5), (120, 397.5), (60, 697.5)] {
            let closed = 0.5 + 0.5 * libm::cos(libm::atan(300.0 / distance_m));
            let found = f64::from(sky.samples()[250 * 400 + cell]);
            // distant edges are up to 8 % low, and some walls end beyond the distance
            assert!((found - closed).abs() < 0.03, "{distance_m}: {found} {closed}");
        }
        assert!(sky.samples()[250 * 400 + 203..250 * 400 + 400].iter().all(|sky| *sky > 0.999));
    }

    /// The sky view factor at the bottom of a V-shaped valley is cos β, for any orientation of the valley.
    #[test]
    fn the_bottom_of_a_valley_sees_the_cosine() {
        // with 64 azimuths; where the bottom runs between cells, it is higher by up to half a cell
        for (turn, tolerance) in [(0.0, 0.005), (0.4, 0.02)] {
            let (sin, cos) = (libm::sin(turn), libm::cos(turn));
            let land = field(world(161, 161, 10.0), |x, y| 0.75 * (cos * (x - 805.0) + sin * (y - 805.0)).abs());
            let found = sky(&land, "distance=600,azimuths=64").samples()[80 * 161 + 80];
            assert!((found - 0.8).abs() < tolerance, "{turn}: {found}");
        }
    }

    /// Inside a circular wall the sky view factor at the centre is cos² of its angle, and it is equal at equal
    /// distances from the centre.
    #[test]
    fn a_round_wall_is_round() {
        let land =
            field(world(301, 301, 10.0), |x, y| if libm::hypot(x - 1505.0, y - 1505.0) < 900.0 { 0.0 } else { 500.0 });
        let sky = sky(&land, "distance=1300");
        let closed = 1.0 / (1.0 + 500.0 * 500.0 / (900.0 * 900.0));
        let middle = f64::from(sky.samples()[150 * 301 + 150]);
        // an edge at a distance of 90 cells is up to 8 % low
        assert!((middle - closed).abs() < 0.04, "{middle} {closed}");
        let ring: Vec<f32> = (0..72)
            .map(|k| {
                let angle = f64::from(k).to_radians() * 5.0;
                let (i, j) = (150.0 + 60.0 * libm::cos(angle), 150.0 + 60.0 * libm::sin(angle));
                sky.samples()[j.round() as usize * 301 + i.round() as usize]
            })
            .collect();
        let (low, high) = ring.iter().fold((1.0_f32, 0.0_f32), |(low, high), sky| (low.min(*sky), high.max(*sky)));
        assert!(high - low < 0.03, "{low} {high}"); // positions are rounded by up to 0.7 cells
    }

    #[test]
    fn a_periodic_world_has_no_sides() {
        let whole = World { boundary: Boundary::all(Edge::Periodic), ..world(64, 64, 10.0) };
        let land = |shift: f64| {
            field(whole, move |x, y| {
                let wave = |v: f64| libm::sin(std::f64::consts::TAU * v / 640.0);
                80.0 * wave(x + shift) * wave(2.0 * y + shift)
            })
        };
        let (here, there) = (sky(&land(0.0), "distance=400"), sky(&land(200.0), "distance=400"));
        for j in 0..64 {
            for i in 0..64 {
                let (a, b) = (here.samples()[(j + 10) % 64 * 64 + (i + 20) % 64], there.samples()[j * 64 + i]);
                assert!((a - b).abs() < 1e-5, "{i} {j}: {a} {b}"); // sines of other arguments
            }
        }
    }

    #[test]
    fn windows_threads_and_simd_levels_give_the_same_bits() {
        let land = field(world(300, 120, 25.0), |x, y| 300.0 * libm::sin(x / 170.0) * libm::cos(y / 130.0) + 0.1 * y);
        let params = with_params(&NODE, "distance=700");
        let inputs = [("height", &land)];
        assert_eq!(run_in(1, &NODE, &params, &inputs), run_in(3, &NODE, &params, &inputs));
        at_every_level(|| run_in(2, &NODE, &params, &inputs));
        let part = Window { origin: [60, 50], cells: [90, 20], ..*land.window() };
        let grown = land.crop(&part.grown(reach_m(&NODE, &params, 25.0)));
        let whole = result(&NODE, &params, &inputs, "occlusion");
        assert_eq!(result(&NODE, &params, &[("height", &grown)], "occlusion").crop(&part), whole.crop(&part));
    }

    #[test]
    fn tiny_worlds_and_huge_cliffs_are_masks() {
        for (nx, ny, cell_m) in [(1, 1, 10.0), (3, 50, 1e-3), (50, 1, 1e4)] {
            let land = field(world(nx, ny, cell_m), |x, y| if (x + y) / cell_m > 20.0 { 1e9 } else { -1e9 });
            for changes in ["exaggeration=1000,distance=1000000", "distance=0,azimuths=4"] {
                assert!(sky(&land, changes).samples().iter().all(|sky| (0.0..=1.0).contains(sky)), "{nx} {ny}");
            }
        }
    }
}
