//! Makes random edits of a graph of nodes with kernels for the GPU, and compares each result with that of the CPU:
//!
//!     cargo run --release -p orograph-tests --example soak [-- EDITS [SEED]]
//!
//! The device is the first of `orograph devices`, limited to 1 MiB of values, so that values go to the host and back.

#![expect(clippy::disallowed_methods, reason = "it measures time")]

use std::{sync::Arc, time::Instant};

use orograph_nodes::gpu::{Adapters, Gpu, GpuOptions};
use orograph_tests::soak::{FEW, soak};

const BUDGET: u64 = 1 << 20;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let edits: usize = arguments.next().map_or(Ok(200), |text| text.parse())?;
    let seed: u32 = arguments.next().map_or(Ok(1), |text| text.parse())?;
    let adapters = Adapters::find();
    let adapter = adapters.best(false).ok_or("there is no graphics driver")?;
    let gpu = Arc::new(Gpu::new(adapter, &GpuOptions { budget: Some(BUDGET), ..GpuOptions::default() })?);
    let start = Instant::now();
    let found = soak(&gpu, BUDGET, edits, seed);
    println!(
        "{} ({}): {} edits in {:.0} s",
        adapter.name(),
        adapter.driver(),
        found.edits,
        start.elapsed().as_secs_f64()
    );
    println!("{} refused, {} kernels run, {} left to the CPU", found.refused, found.on_device, found.left);
    println!("{} outputs of {} kinds of nodes compared", found.compared, found.kinds.len());
    println!("{} of them beyond their tolerance, as they hang on the last bit of an input", found.nudged);
    println!("at most {} KiB on the device, {} KiB while kernels run", found.held >> 10, found.busy >> 10);
    for fault in &found.faults {
        println!("{fault}");
    }
    if !found.is_few_nudged() {
        return Err(format!("more than one output in {FEW} hangs on the last bit of an input").into());
    }
    if found.faults.is_empty() { Ok(()) } else { Err(format!("{} faults", found.faults.len()).into()) }
}
