//! Writes `docs/validation.md`: real elevation models against their reference, and the presets against the windows of
//! the real places. With `ranges` as argument, it prints what becomes of the expectations at the ends of the ranges that
//! presets state for their parameters. `tests/validation/run.sh` builds the program and runs this.

use std::{error::Error, fmt::Write as _, path::Path, process::Command};

use orograph::files::heightfile;
use orograph_graph::{Document, Kind};
use orograph_nodes::measure::compare::{Part, Real, Score};
use orograph_tests::{MODELS, PRESETS, root, validation_hash};
use serde_json::Value;

fn main() -> Result<(), Box<dyn Error>> {
    let program = std::env::current_exe()?;
    let program = program.ancestors().nth(2).ok_or("no folder of programs")?.join("orograph");
    if std::env::args().nth(1).as_deref() == Some("ranges") {
        return ranges(&program);
    }
    let mut page = String::from(
        "# Validation\n\nWritten by `tests/validation/run.sh`. A test fails when elevation models, measures, presets or kernels change and \
         this page does not.\n\n## Real elevation models\n\nThe largest difference of any measure from `tests/data/dems/expected.json`, and the \
         realism score of each whole\nmodel when it is left out of the table that the score rests on.\n\n\
         | model | cells | largest difference | of | texture | drainage | marks | score |\n|---|---|---|---|---|---|---|---|\n",
    );
    let expected = std::fs::read_to_string(root().join("tests/data/dems/expected.json"))?;
    let expected: Value = serde_json::from_str(&expected)?;
    for model in MODELS {
        let path = root().join(format!("tests/data/dems/{model}.tif"));
        let height = heightfile::read(&path, &heightfile::Scale::default(), heightfile::FILLED);
        let height = height.map_err(|error| error.message)?.field;
        let measured = json(&program, &["metrics", text(&path)?, "--json"])?;
        let (name, difference) = largest(&measured, &expected[model]["measures"]);
        let tile = Real::table().tiles.iter().find(|tile| tile.model == model && tile.part == "whole");
        let score = Score::left_out(tile.ok_or("the table lacks a model")?);
        let window = height.window();
        let [nx, ny] = window.cells;
        let [texture, drainage, marks] = score.parts;
        let least = score.least();
        writeln!(
            page,
            "| {model} | {nx} x {ny} of {:.1} m | {:.2} % | {name} | {texture:.2} | {drainage:.2} | {marks:.2} | {least:.2} |",
            window.cell_m(),
            1e2 * difference,
        )?;
    }
    page += "\nMedians of valley sections depend on which of several sections of equal area are taken; everything else differs by less than 1 %.\n";
    presets(&program, &mut page)?;
    writeln!(page, "\nInputs: `{}`.", validation_hash())?;
    std::fs::write(root().join("docs/validation.md"), page)?;
    Ok(())
}

fn presets(program: &Path, page: &mut String) -> Result<(), Box<dyn Error>> {
    *page += "\n## Presets\n\nThe central 30 km at cells of 90 m, each measure with the window of the real places (tiles of 20 to 40 km \
              at cells of 80\nto 100 m), and the realism score with its parts.\n";
    for (preset, kind) in PRESETS {
        let folder = tempfile::tempdir()?;
        let graph = root().join(format!("graphs/{preset}.ron"));
        let arguments = ["run", text(&graph)?, "-o", text(folder.path())?, "--no-cache", "--json"];
        let output = Command::new(program).args(arguments).output()?;
        let lines = String::from_utf8(output.stdout)?;
        let mut rows = String::new();
        let mut seconds = f64::NAN;
        for line in lines.lines() {
            let event: Value = serde_json::from_str(line)?;
            if event["event"] == "done" {
                seconds = event["seconds"].as_f64().unwrap_or(f64::NAN);
            }
            if event["event"] == "expectation" {
                let bound =
                    |at: usize| event["bounds"][at].as_f64().map_or_else(|| "∞".to_owned(), |bound| bound.to_string());
                let met = if event["met"] == true { "yes" } else { "**no**" };
                let value = event["value"].as_f64().unwrap_or(f64::NAN);
                let measure = event["measure"].as_str().unwrap_or_default();
                writeln!(rows, "| {measure} | {value:.3} | {} to {} | {met} |", bound(0), bound(1))?;
            }
        }
        if rows.is_empty() {
            return Err(
                format!("graphs/{preset}.ron was not measured: {}", String::from_utf8_lossy(&output.stderr)).into()
            );
        }
        writeln!(
            page,
            "\n### {preset}.ron, beside `{}`\n\n| measure | value | window | inside |\n|---|---|---|---|\n{rows}",
            kind.name()
        )?;
        writeln!(page, "Built in {seconds:.0} s on the machine of `docs/performance.md`, without its cache.")?;
    }
    let measures = Part::ALL.iter().map(|part| part.measures().len()).sum::<usize>();
    writeln!(page, "\nThe score rests on {measures} measures; see [Compare](nodes/Compare.md).")?;
    Ok(())
}

/// Prints which expectations presets miss at the ends of their parameters' ranges.
fn ranges(program: &Path) -> Result<(), Box<dyn Error>> {
    println!("| preset | parameter | at its least | missed | at its largest | missed |\n|---|---|---|---|---|---|");
    for (preset, _) in PRESETS {
        let path = root().join(format!("graphs/{preset}.ron"));
        let document = Document::parse(std::fs::read_to_string(&path)?, &orograph_nodes::registry());
        let is_stated = |span: &std::ops::Range<usize>| document.source()[span.clone()].contains("range:");
        for parameter in document.parameters().iter().filter(|parameter| is_stated(&parameter.span)) {
            let Kind::Float { hard, .. } = parameter.kind else { continue };
            let mut row = format!("| {preset} | {}", parameter.name);
            for end in hard {
                let missed = missed(program, &path, &format!("{}={end}", parameter.name))?;
                let missed = if missed.is_empty() { "none".to_owned() } else { missed.join(", ") };
                write!(row, " | {} | {missed}", parameter.unit.display(end))?;
            }
            println!("{row} |");
        }
    }
    Ok(())
}

/// The expectations that a graph misses with a parameter set, each with its figure.
fn missed(program: &Path, graph: &Path, set: &str) -> Result<Vec<String>, Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let arguments = ["run", text(graph)?, "-o", text(folder.path())?, "--json", "--set", set];
    let output = Command::new(program).args(arguments).output()?;
    let (mut missed, mut count) = (Vec::new(), 0);
    for line in String::from_utf8(output.stdout)?.lines() {
        let event: Value = serde_json::from_str(line)?;
        count += u32::from(event["event"] == "expectation");
        if event["event"] == "expectation" && event["met"] != true {
            missed.push(format!("{} {:.3}", event["measure"], event["value"].as_f64().unwrap_or(f64::NAN)));
        }
    }
    if count == 0 {
        return Err(format!("{set}: {}", String::from_utf8_lossy(&output.stderr)).into());
    }
    Ok(missed)
}

/// The measure that differs most from its reference, and the difference over the value; of values near 0 the plain
/// difference.
fn largest(measured: &Value, expected: &Value) -> (String, f64) {
    let values = measured["measures"].as_array().into_iter().flatten();
    let difference = |measure: &Value| {
        let name = measure["name"].as_str()?;
        let (value, expected) = (measure["value"].as_f64()?, expected.get(name)?.as_f64()?);
        Some((name.to_owned(), (value - expected).abs() / expected.abs().max(0.5)))
    };
    values.filter_map(difference).max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or_default()
}

fn json(program: &Path, arguments: &[&str]) -> Result<Value, Box<dyn Error>> {
    let output = Command::new(program).args(arguments).output()?;
    Ok(serde_json::from_slice(&output.stdout)?)
}

fn text(path: &Path) -> Result<&str, Box<dyn Error>> {
    path.to_str().ok_or_else(|| "a path that is no text".into())
}
