//! Stored results, with and without correct hashes, all of a graph at once. Damage must never change a result; a forged
//! result is one that a node may return, or is ignored.

use std::{fs, num::NonZero, path::PathBuf, sync::Arc, time::Duration};

use orograph_graph::{Document, Evaluator, EvaluatorOptions, Port, Store, StoreFolder, Trust, Value, Window};
use tempfile::TempDir;

use super::{Attack, Taken};
use crate::dice::Dice;

/// A graph with results of each form: rasters, strata, which are stored as the states of levels are, lines and reports.
const GRAPH: &str = r#"(
    format: 1,
    world: (size: "2 km", cells: 8),
    nodes: {
        "hills": Perlin(wavelength: "1 km"),
        "layers": Stratify(height: "hills"),
        "rock": Outcrop(height: "hills", strata: "layers.strata"),
        "flow": Flow(height: "hills"),
        "rivers": Rivers(flow: "flow.flow"),
        "report": Metrics(height: "hills"),
    },
    outputs: {},
)"#;

struct Cache {
    folder: TempDir,
    document: Document,
    ports: Vec<Port>,
    expected: Vec<Value>,
    /// The sound files.
    entries: Vec<(PathBuf, Vec<u8>)>,
}

/// Bytes before the hash of the header, and before the table of hashes.
const FIELDS: usize = 64;
const TABLE: usize = FIELDS + 32;

const PIECES: [&[u8]; 7] = [b"FLDS", b"STRA", b"LINE", b"RPRT", b"STAT", b"[[[[", b"\xff\xff\xff\xff\xff\xff\xff\x7f"];

pub(super) fn prepare() -> Box<dyn Attack> {
    let document = Document::parse(GRAPH, &orograph_nodes::registry());
    assert!(!document.has_errors(), "{:?}", document.problems());
    let graph = document.graph();
    let ports = graph
        .indices()
        .flat_map(|node| (0..graph.instance(node).node.outputs.len()).map(move |output| Port { node, output }));
    let ports: Vec<Port> = ports.collect();
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut cache = Cache { folder, document, ports, expected: Vec::new(), entries: Vec::new() };
    cache.expected = cache.values().expect("the graph is sound");
    let shards = fs::read_dir(cache.folder.path()).expect("a folder").flatten();
    let files = shards.flat_map(|shard| fs::read_dir(shard.path()).into_iter().flatten().flatten());
    let files = files.filter(|file| file.path().extension().is_some_and(|ending| ending == "orovalue"));
    cache.entries = files.map(|file| (file.path(), fs::read(file.path()).expect("a readable file"))).collect();
    cache.entries.sort();
    let has = |kind: &[u8; 4]| cache.entries.iter().any(|(_, bytes)| bytes[28..32] == *kind);
    assert!([b"FLDS", b"STRA", b"LINE", b"RPRT"].into_iter().all(has), "each form of result is stored");
    Box::new(cache)
}

impl Cache {
    fn values(&self) -> Result<Vec<Value>, String> {
        let folder = self.folder.path().to_owned();
        let place = StoreFolder { folder, budget: 1 << 30, worth: Duration::ZERO, trust: Trust::Own };
        let options = EvaluatorOptions {
            store: Arc::new(Store::new(0, Some(place))),
            threads: NonZero::new(1),
            memory_limit: Some(1 << 30),
            ..EvaluatorOptions::default()
        };
        let evaluator = Evaluator::new(options).map_err(|error| error.to_string())?;
        let window = Window::whole(self.document.world());
        evaluator
            .values(self.document.graph(), self.document.folder(), &self.ports, window)
            .map_err(|error| error.to_string())
    }
}

impl Attack for Cache {
    fn case(&mut self, dice: &mut Dice) -> Result<Taken, String> {
        let forges = dice.one_in(2);
        for (path, sound) in &self.entries {
            let mut bytes = sound.clone();
            if forges {
                forge(&mut bytes, dice);
            } else {
                dice.damage(&mut bytes, &PIECES);
            }
            fs::write(path, &bytes).map_err(|error| error.to_string())?;
        }
        let values = self.values();
        // Forged terrain may be too steep or too high for a node, which then says so.
        // Forged terrain may be too steep or too high for a node, which then says so.
        let taken = Taken { accepted: values.as_ref().is_ok_and(|values| *values != self.expected), cells: 64 };
        match values {
            Err(error) if !forges => Err(error),
            Ok(_) if taken.accepted && !forges => Err("damage changed a result".to_owned()),
            _ => Ok(taken),
        }
    }
}

/// Damages the payload of an entry with one band, and gives it the hashes of what it is then.
fn forge(bytes: &mut Vec<u8>, dice: &mut Dice) {
    let mut payload = bytes.split_off(TABLE + 32);
    dice.damage(&mut payload, &PIECES);
    let band = blake3::hash(&payload);
    bytes[FIELDS - 12..FIELDS - 4].copy_from_slice(&(payload.len() as u64).to_le_bytes());
    bytes[TABLE..].copy_from_slice(band.as_bytes());
    let head = blake3::Hasher::new().update(&bytes[..FIELDS]).update(band.as_bytes()).finalize();
    bytes[FIELDS..TABLE].copy_from_slice(head.as_bytes());
    bytes.extend(payload);
}
