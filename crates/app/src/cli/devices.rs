//! `orograph devices`: the graphics adapters of the machine.

use crate::report::failure::Failure;

/// Lists graphics adapters with their limits and a short measured speed
///
/// `orograph run --backend auto` takes the first one that is not software; `--backend gpu` takes the first one. The
/// environment variable `WGPU_ADAPTER_NAME` leaves only adapters whose name contains a text.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Print a JSON array
    #[arg(long)]
    json: bool,
}

impl Args {
    #[cfg(not(feature = "gpu"))]
    pub(super) fn run(self) -> Result<(), Failure> {
        if self.json {
            return crate::report::terminal::print("[]\n");
        }
        crate::report::terminal::print("this build of the program has no GPU backend\n")
    }

    #[cfg(feature = "gpu")]
    pub(super) fn run(self) -> Result<(), Failure> {
        let found = orograph_nodes::gpu::Adapters::find().0.into_iter().map(listed::Listed::new).collect::<Vec<_>>();
        crate::report::terminal::print(&if self.json { listed::json(&found) } else { listed::text(&found) })
    }
}

#[cfg(feature = "gpu")]
mod listed {
    use orograph_graph::bytes;
    use orograph_nodes::gpu::{Adapter, Speed, Trouble};
    use serde_json::json;

    use crate::report::terminal::{Align, Page, Table};

    /// An adapter with its speed.
    pub(super) struct Listed {
        adapter: Adapter,
        speed: Result<Speed, Trouble>,
    }

    impl Listed {
        pub(super) fn new(adapter: Adapter) -> Self {
            Self { speed: adapter.speed(), adapter }
        }
    }

    pub(super) fn text(found: &[Listed]) -> String {
        if found.is_empty() {
            return "no graphics driver was found; nodes are computed on the CPU\n\
                    install a Vulkan driver; a software driver works, such as the package `mesa-vulkan-drivers`\n"
                .to_owned();
        }
        let page = Page::stdout();
        let mut table = Table::new(&[
            ("adapter", Align::Left),
            ("kind", Align::Left),
            ("driver", Align::Left),
            ("largest raster", Align::Right),
            ("buffers", Align::Right),
            ("sum of two", Align::Right),
            ("octave of noise", Align::Right),
        ]);
        for Listed { adapter, speed } in found {
            let rate = |cells: f64| format!("{:.0} Mcell/s", cells / 1e6);
            let [point, noise] = match speed {
                Ok(speed) => [rate(speed.point), rate(speed.noise)],
                Err(trouble) => [trouble.to_string(), String::new()],
            };
            table.row([
                page.name(adapter.name()),
                adapter.kind().to_owned(),
                page.dim(&format!("{} {}", adapter.interface(), adapter.driver())),
                bytes(adapter.largest_binding()),
                adapter.buffers().to_string(),
                point,
                noise,
            ]);
        }
        table.render(page, 0)
    }

    pub(super) fn json(found: &[Listed]) -> String {
        let of = |listed: &Listed| {
            let adapter = &listed.adapter;
            json!({
                "name": adapter.name(), "kind": adapter.kind(), "interface": adapter.interface(),
                "driver": adapter.driver(), "software": adapter.is_software(),
                "largest_binding": adapter.largest_binding(), "largest_buffer": adapter.largest_buffer(),
                "buffers": adapter.buffers(),
                "cells_per_second": listed.speed.as_ref().ok().map(|speed| json!({
                    "combine": speed.point, "octave": speed.noise,
                })),
                "error": listed.speed.as_ref().err().map(ToString::to_string),
            })
        };
        format!("{:#}\n", serde_json::Value::Array(found.iter().map(of).collect()))
    }
}
