//! Hashes and positions on lattices, bit for bit.

use orograph_graph::{Backend as _, Output, PortType, World, gpu};

use super::{Adapters, Gpu, GpuOptions};
use crate::{
    numerics::noise::{
        Basis, Fractal, Octave,
        lattice::{Axis, hash, hash_row},
        table,
    },
    prelude::*,
    testing::world,
    wgsl,
};

/// Three numbers of a cell in the first octave: the low 24 bits of the hash of its lattice point, the lattice column and
/// the fraction in it. All are exact in single precision.
static SHADER: Shader = Shader {
    name: "test/lattice",
    source: "
        @compute @workgroup_size(64)
        fn main(@builtin(global_invocation_id) id: vec3<u32>) {
            let cell = cell_of(id);
            if (is_outside(cell)) { return; }
            let octave = octaves_of[0];
            let x = spot(octave.x, p.left + cell.x);
            let y = spot(octave.y, p.top + cell.y);
            let hash = hash_point(wrap_line(octave.x, x.cell), hash_row(wrap_line(octave.y, y.cell), octave.seed));
            let i = at(cell.x, cell.y);
            out_hash[i] = checked(f32(hash & 0xffffffu));
            out_column[i] = checked(f32(x.cell));
            out_fraction[i] = checked(x.fraction);
        }",
    library: &[wgsl::HASH, wgsl::LATTICE],
    values: &[],
    slots: &[
        Slot::words("octaves_of", "Octave"),
        Slot::output("hash"),
        Slot::output("column"),
        Slot::output("fraction"),
    ],
};

static NODE: Node = Node {
    id: "Lattice",
    outputs: &[
        Output::gives("hash", PortType::Height, "Hash."),
        Output::gives("column", PortType::Height, "Column."),
        Output::gives("fraction", PortType::Height, "Fraction."),
    ],
    gpu: Some(&GpuKernel {
        shaders: &[&SHADER],
        passes: Passes::Recorded(|job, recorder| {
            let octaves_of = recorder.table(&table::table(&[octave(job.world())], Basis::Bell, |_| 1.0))?;
            recorder.pass(&Pass {
                shader: &SHADER,
                entry: "main",
                bind: &[("octaves_of", Bind::Scratch(octaves_of))],
                values: &[],
                over: Over::Cells(Rows::Around(0)),
            })
        }),
        ..GpuKernel::DEFAULT
    }),
    ..Node::DEFAULT
};

fn octave(world: &World) -> Octave {
    let tileable = world.seed == 1;
    let fractal = Fractal { wavelength_m: 77.3, octaves: 1, lacunarity: 2.0, gain: 0.5, tileable, seed: world.seed };
    fractal.octaves(world)[0]
}

/// On any device: lattice cells, fractions and hashes are whole numbers. Far from the origin and on a tileable world too.
#[test]
fn hashes_and_positions_are_those_of_the_cpu_bit_for_bit() {
    let adapters = Adapters::find();
    let Some(adapter) = adapters.best(false) else {
        assert!(std::env::var_os("OROGRAPH_ALL_TESTS").is_none(), "no graphics driver was found");
        return;
    };
    let gpu = Gpu::new(adapter, &GpuOptions::default()).expect("the driver works");
    let params = ParamValues::defaults(&[]);
    for (seed, side, origin) in [(7, 200, [0, 0]), (1, 200, [3, 50]), (9, 65_536, [65_400, 60_001])] {
        let world = World { seed, ..world(side, side, 10.0) };
        let window = Window { world, origin, cells: [131, 67] };
        let job = crate::testing::job_on(&NODE, &params, window);
        let mut outputs = gpu.run(&NODE, &job).expect("it runs").expect("on the device");
        let octave = octave(&world);
        let [hashes, columns, fractions] = ["hash", "column", "fraction"].map(|name| outputs.take(name).expect("it"));
        let [hashes, columns, fractions] = [&hashes, &columns, &fractions].map(|v| v.as_field().expect("it").samples());
        for at in 0..window.len() {
            let cell = [origin[0] + (at % 131) as u32, origin[1] + (at / 131) as u32];
            let [x, y] = [0, 1].map(|axis| octave.axes[axis].at(cell[axis]));
            let row = hash_row(octave.axes[1].wrap(Axis::cell(y)), octave.seed);
            let expected = hash(octave.axes[0].wrap(Axis::cell(x)), row) & 0xff_ffff;
            assert_eq!(hashes[at], expected as f32, "{cell:?}");
            assert_eq!((columns[at], fractions[at]), (Axis::cell(x) as f32, Axis::fraction(x)), "{cell:?}");
        }
    }
    assert!(
        gpu::Count::new(&crate::testing::job_on(&NODE, &params, Window::whole(world(8, 8, 10.0))), 0).work().least
            == 12
    );
}
