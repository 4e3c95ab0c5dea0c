//! Writes the table of real terrain that Compare rests on: `cargo run --release -p orograph-nodes --example
//! real_tiles`.
//!
//! Each model of `tests/data/dems`, whole and in quarters, at cells of 80 to 100 m.

use std::{error::Error, path::Path};

use orograph_graph::{Cancel, Field, InputValue, Job, LevelJob, ParamValues, Report, Value, Wanted, Warnings};
use orograph_nodes::{
    measure::{
        compare::{averaged, quarters},
        metrics::{self, MEASURES},
    },
    raster,
};

const MODELS: [&str; 7] = ["bigtujunga", "dales", "frontrange", "glencoe", "jacksboro", "mandakini", "norfolk"];

fn main() -> Result<(), Box<dyn Error>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut text = String::from("model,part");
    MEASURES.iter().for_each(|measure| text += &format!(",{}", measure.name));
    for model in MODELS {
        let height = read(&root.join(format!("../../tests/data/dems/{model}.tif")))?;
        let (height, _) = averaged(&height, &|| Ok(()))?;
        let [nw, ne, sw, se] = quarters(&height);
        for (part, field) in [("whole", height), ("nw", nw), ("ne", ne), ("sw", sw), ("se", se)] {
            let report = report(&field)?;
            text += &format!("\n{model},{part}");
            for measure in MEASURES {
                let value = report.get(measure.name).filter(|value| value.is_finite());
                text += &value.map_or_else(|| ",".to_owned(), |value| format!(",{value:.5e}"));
            }
        }
    }
    text += "\n";
    std::fs::write(root.join("src/measure/compare/real.csv"), text)?;
    Ok(())
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
