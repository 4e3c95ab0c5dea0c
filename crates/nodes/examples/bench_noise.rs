//! Times the noise generators on one thread, for comparison with other programs: see `tests/peers/README.md`.
//!
//! `bench_noise [SIDE] [REPEATS]`, 4096 and 9 by default. Prints one line per kernel: its name, octaves, and the median
//! time in nanoseconds of processor per cell, where the system tells it, else elapsed.

use std::{
    alloc::{GlobalAlloc, Layout, System},
    error::Error,
    sync::Mutex,
    time::Instant,
};

use orograph_graph::{Cancel, Job, ParamValue, ParamValues, Warnings, Window, World};
use orograph_nodes::registry;

fn main() -> Result<(), Box<dyn Error>> {
    let args = std::env::args().skip(1).map(|arg| arg.parse()).collect::<Result<Vec<u32>, _>>()?;
    let (side, repeats) = (args.first().copied().unwrap_or(4096), args.get(1).copied().unwrap_or(9) as usize);
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    for (kernel, node, octaves, wavelength, kind) in [
        ("perlin", "Perlin", 1, 64.0, None),
        ("perlin", "Perlin", 8, 1024.0, None),
        ("ridged", "Ridged", 8, 1024.0, None),
        ("ridged", "Ridged", 12, 1024.0, None),
        ("cellular", "Noise", 1, 64.0, Some("nearest")),
    ] {
        let registry = registry();
        let node = registry.get(node).ok_or("no such node")?;
        let mut params = ParamValues::defaults(&node.specs());
        params.set("octaves", ParamValue::Int(octaves));
        params.set("wavelength", ParamValue::Float(wavelength));
        params.set("lacunarity", ParamValue::Float(2.0));
        if let Some(kind) = kind {
            params.set("kind", ParamValue::Choice(kind));
        }
        let world = World { cells: [side; 2], size: [f64::from(side); 2], ..World::default() };
        let job = Job {
            node,
            params: &params,
            inputs: Vec::new(),
            window: Window::whole(world),
            wanted: orograph_graph::Wanted::ALL,
            folder: std::path::PathBuf::new(),
            cancel: Cancel::default(),
            progress: &|_| {},
            level: orograph_graph::LevelJob::default(),
            warnings: Warnings::default(),
            glimpses: None,
        };
        let once = || {
            #[expect(clippy::disallowed_methods, reason = "the time is what is asked for")]
            let begun = Instant::now();
            let start = thread_ns(begun);
            let outputs = (node.cpu)(&job).map_err(|error| error.to_string())?;
            let time = thread_ns(begun) - start;
            drop(outputs);
            Ok::<f64, String>(time / (f64::from(side) * f64::from(side)))
        };
        let mut times = one.install(|| (0..=repeats).map(|_| once()).collect::<Result<Vec<f64>, _>>())?;
        // the first is to warm up
        times.remove(0);
        times.sort_by(f64::total_cmp);
        println!("{kernel} {octaves} {:.3}", times[repeats / 2]);
    }
    Ok(())
}

/// Nanoseconds of this thread: of the processor where the system tells them, else by the clock since `begun`.
fn thread_ns(begun: Instant) -> f64 {
    // a thread that gives way has its account brought up to date
    std::thread::yield_now();
    let told = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    let processor = told.split(' ').next().and_then(|ns| ns.parse().ok());
    processor.unwrap_or_else(|| begun.elapsed().as_secs_f64() * 1e9)
}

/// The system's allocator, but for a large block that is given back: it is zeroed, outside of what is timed, and kept
/// for the next. Other libraries write into memory that they are given, so the system's work on fresh memory is not to
/// be timed.
struct Keeping;

#[global_allocator]
static KEEPING: Keeping = Keeping;

/// The block that is kept: its address and its size.
static KEPT: Mutex<Option<(usize, usize)>> = Mutex::new(None);

/// Where vectors and lines of the cache begin.
const ALIGNED: usize = 64;

/// What is asked of the system for a block: of large ones, more than they need.
fn asked(layout: Layout) -> Layout {
    if is_large(layout) { layout.align_to(ALIGNED).unwrap_or(layout) } else { layout }
}

fn is_large(layout: Layout) -> bool {
    layout.size() >= 1 << 22
}

#[expect(unsafe_code, reason = "an allocator is a promise to the compiler")]
// SAFETY: blocks come from the system with the layout that they are given back with; one that is kept is zero, has been
// given back by its owner, and goes to one other of the same size.
unsafe impl GlobalAlloc for Keeping {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: see above.
        unsafe { System.alloc(asked(layout)) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        if is_large(layout)
            && let Ok(mut kept) = KEPT.lock()
            && let Some((block, _)) = kept.take_if(|(_, size)| *size == layout.size())
        {
            return std::ptr::with_exposed_provenance_mut(block);
        }
        // SAFETY: see above.
        unsafe { System.alloc_zeroed(asked(layout)) }
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        if is_large(layout)
            && let Ok(mut kept) = KEPT.lock()
            && kept.is_none()
        {
            // SAFETY: the block is as long as its layout says.
            unsafe { block.write_bytes(0, layout.size()) };
            *kept = Some((block.expose_provenance(), layout.size()));
            return;
        }
        // SAFETY: see above.
        unsafe { System.dealloc(block, asked(layout)) }
    }

    unsafe fn realloc(&self, block: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // SAFETY: as for the default: a new block, and the old one given back.
        unsafe {
            let new = Layout::from_size_align_unchecked(size, layout.align());
            let moved = self.alloc(new);
            if !moved.is_null() {
                moved.copy_from_nonoverlapping(block, layout.size().min(size));
                self.dealloc(block, layout);
            }
            moved
        }
    }
}
