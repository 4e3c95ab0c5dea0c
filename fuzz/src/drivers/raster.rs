//! Rasters of every format with their sidecars, GeoJSON and SVG, imported into a small world.

use std::{num::NonZero, path::PathBuf, sync::Arc};

use orograph_graph::{Document, Evaluator, EvaluatorOptions, Store, Window};
use tempfile::TempDir;

use super::{Attack, Taken, files};
use crate::{child::MOST, dice::Dice};

const CELLS: u32 = 16;

struct Rasters {
    folder: TempDir,
    evaluator: Evaluator,
    /// Extension, contents and sidecar of sound files.
    sources: Vec<(String, Vec<u8>, Option<Vec<u8>>)>,
    /// A graph for each extension, which imports `case.EXT`.
    documents: Vec<(String, Document)>,
}

/// Pieces of headers, numbers and tags.
const PIECES: [&[u8]; 18] = [
    b"IHDR",
    b"IDAT",
    b"IEND",
    b"PLTE",
    b"II*\0",
    b"MM\0*",
    b"II+\0",
    b"\x76\x2f\x31\x01",
    b"channels\0",
    b"ncols 99999\n",
    b"NODATA_value nan\n",
    b"{\"min\": 1e999}",
    b"\xff\xff\xff\xff",
    b"\0\0\0\0",
    b"1e308,",
    b"[[[[",
    b"<g transform='rotate(1e99)'>",
    b"M0 0A1 1 0 1 0 9 9z",
];

/// Drawings, which have no rasters: their ending and contents.
const DRAWINGS: [(&str, &[u8]); 2] = [
    (
        "geojson",
        br#"{"type": "FeatureCollection", "crs": {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::32611"}},
        "features": [{"type": "Feature", "properties": {"widths_m": [4, 6]}, "geometry": {"type": "LineString",
        "coordinates": [[378010, 3811490, 12], [378900.5, 3811480, 8]]}}, {"type": "Feature", "properties": {"width": 9},
        "geometry": {"type": "MultiPolygon", "coordinates": [[[[378000, 3811000], [379000, 3811000], [379000, 3810000]]]]}}]}"#,
    ),
    (
        "svg",
        br#"<svg xmlns="http://www.w3.org/2000/svg"><g transform="translate(100 50) scale(20)"><path d="M 10 10 h 20 v 5
        z m 100 0 C 120 10 120 30 140 30 A 5 6 0 1 1 99 98 Q 1 2 3 4"/><polyline points="1,2 3,4 5,6"/></g><line x1="1"
        y1="2" x2="3000" y2="4"/><rect x="5" y="6" width="10" height="20"/><circle cx="50" cy="60" r="10"/></svg>"#,
    ),
];

/// Formats whose files have a sidecar that describes them.
const SIDECAR: &[u8] = br#"{"min_m": 0, "max_m": 900, "cell_m": 30, "cells": [24, 24], "sea_level_m": 10}"#;

pub(super) fn prepare() -> Box<dyn Attack> {
    let ending =
        |path: &PathBuf| path.extension().map(|ending| ending.to_string_lossy().into_owned()).unwrap_or_default();
    let mut sources: Vec<_> = files("tests/data", &["png", "tif", "exr", "asc", "f32"])
        .into_iter()
        .filter(|(_, bytes)| bytes.len() < 20_000)
        .map(|(path, bytes)| {
            let ending = ending(&path);
            let beside = std::fs::read(format!("{}.json", path.display())).ok();
            let sidecar = beside.or_else(|| matches!(&ending[..], "f32" | "png").then(|| SIDECAR.to_vec()));
            (ending, bytes, sidecar)
        })
        .collect();
    sources.push(("r16".to_owned(), vec![7; 24 * 24 * 2], Some(SIDECAR.to_vec())));
    sources.push(("hgt".to_owned(), vec![1; 1201 * 1201 * 2], None));
    sources.extend(DRAWINGS.map(|(ending, bytes)| (ending.to_owned(), bytes.to_vec(), None)));
    let folder = tempfile::tempdir().expect("a temporary folder");
    let registry = orograph_nodes::registry();
    let mut documents: Vec<(String, Document)> = Vec::new();
    for (ending, ..) in &sources {
        if documents.iter().all(|(other, _)| other != ending) {
            let is_drawing = DRAWINGS.iter().any(|(drawing, _)| drawing == ending);
            let (kind, outputs) = match is_drawing {
                true => ("Path", "\"lines\": \"in\", \"mask\": \"in.mask\""),
                false => ("Import", "\"height\": \"in\""),
            };
            let text = format!(
                "(format: 1, world: (size: \"16 km\", cells: {CELLS}, place: (epsg: 32611, corner: (378000, 3812000))), nodes: {{ \"in\": \
                 {kind}(file: \"case.{ending}\") }}, outputs: {{ {outputs} }})"
            );
            documents.push((ending.clone(), Document::parse_in(text, folder.path(), &registry)));
        }
    }
    let options = EvaluatorOptions {
        store: Arc::new(Store::new(0, None)),
        threads: NonZero::new(1),
        // A file whose voids may have to be filled is unpacked whole; if that takes more, its estimate must say so.
        memory_limit: Some(MOST as u64),
        ..EvaluatorOptions::default()
    };
    let evaluator = Evaluator::new(options).expect("a thread");
    Box::new(Rasters { folder, evaluator, sources, documents })
}

impl Attack for Rasters {
    fn case(&mut self, dice: &mut Dice) -> Result<Taken, String> {
        let (ending, bytes, sidecar) = loop {
            let source = dice.pick(&self.sources);
            // Large files take long to write.
            if source.1.len() < 20_000 || dice.one_in(50) {
                break source;
            }
        };
        let (mut bytes, mut sidecar) = (bytes.clone(), sidecar.clone());
        let damages_sidecar = sidecar.is_some() && dice.one_in(3);
        match &mut sidecar {
            Some(sidecar) if damages_sidecar => dice.damage(sidecar, &PIECES),
            _ => {
                dice.damage(&mut bytes, &PIECES);
                if ending == "png" && dice.one_in(2) {
                    mend_checksums(&mut bytes);
                }
            }
        }
        let path = self.folder.path().join(format!("case.{ending}"));
        let beside = self.folder.path().join(format!("case.{ending}.json"));
        let written = std::fs::write(&path, bytes).and_then(|()| match sidecar {
            Some(sidecar) => std::fs::write(&beside, sidecar),
            None => Ok(()),
        });
        written.map_err(|error| error.to_string())?;
        let found = self.documents.iter().find(|(other, _)| other == ending);
        let Some((_, document)) = found else { return Err("there is no graph".to_owned()) };
        let ports: Vec<_> = document.outputs().iter().map(|output| output.port).collect();
        let window = Window::whole(document.world());
        // An error is a good answer; a result must be one that a node may return, which the evaluator verifies.
        let result = self.evaluator.values(document.graph(), document.folder(), &ports, window);
        match result {
            Err(orograph_graph::EvalError::Output { message, .. }) => Err(message),
            result => Ok(Taken { accepted: result.is_ok(), cells: (CELLS * CELLS) as usize }),
        }
    }
}

/// Gives every chunk of a PNG file the checksum of its contents, as far as there are whole chunks.
fn mend_checksums(png: &mut [u8]) {
    let mut at = 8;
    while let Some(head) = png.get(at..at + 8).and_then(|head| head.first_chunk::<4>()) {
        let end = at + 8 + u32::from_be_bytes(*head) as usize;
        let Some(sum) = png.get(at + 4..end).map(|chunk| {
            let mut crc = flate2::Crc::new();
            crc.update(chunk);
            crc.sum()
        }) else {
            return;
        };
        let Some(place) = png.get_mut(end..end + 4) else { return };
        place.copy_from_slice(&sum.to_be_bytes());
        at = end + 4;
    }
}
