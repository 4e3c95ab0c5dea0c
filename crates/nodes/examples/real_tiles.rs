//! Writes the table of real terrain that Compare rests on, and the curves that it draws: `cargo run --release -p
//! orograph-nodes --example real_tiles`.
//!
//! Each model of `tests/data/dems`, whole and in quarters, at cells of 80 to 100 m.

use std::{collections::BTreeMap, error::Error, path::Path};

use orograph_graph::{
    Axis, Cancel, Field, InputValue, Job, LevelJob, ParamValues, Report, Series, Value, Wanted, Warnings,
};
use orograph_nodes::{
    measure::{
        compare::{POINTS, averaged, quarters},
        metrics::{self, MEASURES},
    },
    raster,
};

const MODELS: [&str; 7] = ["bigtujunga", "dales", "frontrange", "glencoe", "jacksboro", "mandakini", "norfolk"];

fn main() -> Result<(), Box<dyn Error>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut text = String::from("model,part");
    MEASURES.iter().for_each(|measure| text += &format!(",{}", measure.name));
    let mut curves = BTreeMap::new();
    for model in MODELS {
        let height = read(&root.join(format!("../../tests/data/dems/{model}.tif")))?;
        let (height, _) = averaged(&height, &|| Ok(()))?;
        let [nw, ne, sw, se] = quarters(&height);
        for (part, field) in [("whole", height), ("nw", nw), ("ne", ne), ("sw", sw), ("se", se)] {
            let report = report(&field)?;
            if part == "whole" {
                curves.insert(model, report.series.iter().map(thinned).collect::<Vec<_>>());
            }
            text += &format!("\n{model},{part}");
            for measure in MEASURES {
                let value = report.get(measure.name).filter(|value| value.is_finite());
                text += &value.map_or_else(|| ",".to_owned(), |value| format!(",{value:.5e}"));
            }
        }
    }
    text += "\n";
    std::fs::write(root.join("src/measure/compare/real.csv"), text)?;
    std::fs::write(root.join("src/measure/compare/curves.json"), serde_json::to_string(&curves)? + "\n")?;
    Ok(())
}

/// A curve with fewer points, each to five digits.
fn thinned(series: &Series) -> Series {
    let step = series.x.values.len().div_ceil(POINTS).max(1);
    let pairs = series.x.values.iter().zip(&series.y.values).filter(|(x, y)| x.is_finite() && y.is_finite());
    let pairs: Vec<_> = pairs.collect();
    let last = pairs.last().copied().filter(|_| (pairs.len() - 1) % step > 0);
    let short = |value: f64| format!("{value:.4e}").parse().unwrap_or(value);
    let kept: Vec<[f64; 2]> =
        pairs.iter().copied().step_by(step).chain(last).map(|(x, y)| [short(*x), short(*y)]).collect();
    let axis = |axis: &Axis, at: usize| Axis { values: kept.iter().map(|pair| pair[at]).collect(), ..axis.clone() };
    Series { x: axis(&series.x, 0), y: axis(&series.y, 1), ..series.clone() }
}

fn read(path: &Path) -> Result<Field, Box<dyn Error>> {
    Ok(raster::height_field(raster::read(path)?, [0.0, 1.0], None).map_err(|problem| problem.to_string())?.field)
}

fn report(height: &Field) -> Result<Report, Box<dyn Error>> {
    let node = &metrics::NODE;
    let params = ParamValues::defaults(&node.specs());
    let job = Job {
        node,
        params: &params,
        inputs: vec![InputValue::Value(Value::Field(height.clone())), InputValue::Absent],
        window: *height.window(),
        wanted: Wanted::ALL,
        folder: std::path::PathBuf::new(),
        cancel: Cancel::default(),
        progress: &|_| {},
        level: LevelJob::default(),
        warnings: Warnings::default(),
        glimpses: None,
    };
    let mut outputs = (node.cpu)(&job).map_err(|error| error.to_string())?;
    let report = outputs.take("report").ok_or("no report")?;
    Ok(report.as_report().ok_or("no report")?.clone())
}
