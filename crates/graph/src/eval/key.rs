//! Keys: 128-bit hashes of a value's provenance.
//!
//! Provenance, not content: hashing the rasters after each edit would cost more than many nodes. A key includes
//! everything that can change the result, and nothing else: the kind and version of the node, its parameters, the
//! world, its inputs, the content of the files that it reads or of the raster that a program gives it, and the backend
//! unless it is the CPU and the node exact: no other backend gives the bytes of the CPU, and through the keys of the
//! inputs none of their results is mixed with those of the CPU further down. Names of nodes, the rest of the graph,
//! thread counts and the order of evaluation are not included.
//!
//! A result does not depend on the window in which it was computed, as a node's reach guarantees. Keys of downstream
//! nodes therefore do not include the window, and a node keeps its key when another reader needs a wider window of its
//! input.

use std::{
    fmt,
    path::Path,
    sync::{Arc, LazyLock},
};

use super::{
    files::{Files, Stamped},
    plan::{Plan, Source, Step},
};
use crate::{
    backend::Backends,
    job::Cancel,
    node::Exactness,
    param::{ParamValue, ParamValues},
    world::{Window, World},
};

/// Identifies the scheme of the keys; change it when the hashed data or its encoding changes, or when results of many
/// kinds do, so that stored ones are not found any more.
pub const KEY_SCHEME: &str = "orograph evaluation key 3";

/// A 128-bit hash of a value's provenance (the first half of a BLAKE3 hash).
#[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Key([u8; 16]);

impl Key {
    /// Its bytes.
    #[must_use]
    pub const fn bytes(&self) -> &[u8; 16] {
        &self.0
    }

    /// The key of one output on a window.
    pub(super) fn output(&self, output: usize, window: &Window) -> Self {
        let mut hash = Hash::new(b'o');
        hash.bytes(&self.0);
        hash.u32(output as u32);
        [window.origin, window.cells].as_flattened().iter().for_each(|v| hash.u32(*v));
        hash.finish()
    }
}

impl fmt::Display for Key {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

impl fmt::Debug for Key {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Key({self})")
    }
}

/// The provenance of a step's results.
pub(super) struct Origins {
    pub(super) key: Key,
    /// The files that its kernel reads, as they were when the key was computed.
    pub(super) files: Vec<Stamped>,
}

/// The keys of all steps, without their windows; `None` for a step with a fault. An unreadable file is a fault.
pub(super) fn origins(
    plan: &mut Plan<'_>,
    backends: &Backends,
    files: &Files,
    folder: &Path,
    cancel: &Cancel,
) -> Vec<Option<Origins>> {
    let mut all: Vec<Option<Origins>> = Vec::with_capacity(plan.steps.len());
    let place: Arc<Path> = folder.into();
    for at in 0..plan.steps.len() {
        let inherited = plan.steps[at].sources().find_map(|source| plan.steps[source].fault.clone());
        let step = &mut plan.steps[at];
        step.fault = inherited.or(step.fault.take());
        step.folder = Arc::clone(&place);
        let read = match &step.fault {
            Some(_) => None,
            None => files.of_step(step, folder, cancel).map_err(|error| step.fault = Some(error)).ok(),
        };
        let origins = read.map(|files| Origins { key: key(step, backends, &files, &all), files });
        all.push(origins);
    }
    all
}

fn key(step: &Step<'_>, backends: &Backends, files: &[Stamped], earlier: &[Option<Origins>]) -> Key {
    let mut hash = Hash::new(b'n');
    hash.origin(step, files, earlier);
    hash.params(&step.instance.params);
    let backend = backends.of(step.instance);
    if !backend.is_cpu() || step.instance.node.exactness != Exactness::Exact {
        hash.text(backend.identity());
    }
    hash.finish()
}

/// The key of a step without its parameters.
pub(super) fn ground(step: &Step<'_>, origins: &Origins, earlier: &[Option<Origins>]) -> Key {
    let mut hash = Hash::new(b'g');
    hash.origin(step, &origins.files, earlier);
    hash.finish()
}

/// Encodes values so that no two different sequences of them give the same bytes.
struct Hash(blake3::Hasher);

impl Hash {
    fn new(tag: u8) -> Self {
        static BLANK: LazyLock<blake3::Hasher> = LazyLock::new(|| blake3::Hasher::new_derive_key(KEY_SCHEME));
        let mut hash = BLANK.clone();
        hash.update(&[tag]);
        Self(hash)
    }

    /// Hashes the kind of a step, its world, its files and its inputs.
    fn origin(&mut self, step: &Step<'_>, files: &[Stamped], earlier: &[Option<Origins>]) {
        let hash = self;
        let node = step.instance.node;
        hash.text(node.id);
        hash.u32(node.version);
        hash.world(&step.wanted.world);
        if let Some(level) = step.wanted.world.sea_level.filter(|_| node.reads_sea) {
            hash.bytes(b"~");
            hash.f64(level);
        }
        if let Some(place) = step.wanted.world.place.filter(|_| node.reads_place) {
            hash.bytes(b"@");
            hash.u32(place.epsg);
            place.corner_m.iter().for_each(|v| hash.f64(*v));
        }
        if let Some(given) = &step.instance.given {
            hash.bytes(b"=");
            hash.bytes(given.content());
        }
        for content in files.iter().flat_map(Stamped::contents) {
            match content {
                Some(content) => {
                    hash.bytes(b"+");
                    hash.bytes(content);
                }
                None => hash.bytes(b"-"),
            }
        }
        for source in &step.inputs {
            match source {
                Source::Wire { step, output } => {
                    hash.bytes(b"w");
                    let source = earlier[*step].as_ref().expect("a step with a key reads only such");
                    hash.bytes(&source.key.0);
                    hash.u32(*output as u32);
                }
                Source::Constant(value) => {
                    hash.bytes(b"c");
                    hash.f64(*value);
                }
                Source::Absent => hash.bytes(b"-"),
            }
        }
    }

    fn bytes(&mut self, bytes: &[u8]) {
        self.0.update(bytes);
    }

    fn u32(&mut self, v: u32) {
        self.bytes(&v.to_le_bytes());
    }

    fn u64(&mut self, v: u64) {
        self.bytes(&v.to_le_bytes());
    }

    /// The bits of a number; positive and negative zero are the same.
    fn f64(&mut self, v: f64) {
        self.u64((v + 0.0).to_bits());
    }

    fn text(&mut self, text: &str) {
        self.u64(text.len() as u64);
        self.bytes(text.as_bytes());
    }

    fn world(&mut self, world: &World) {
        world.size.iter().for_each(|v| self.f64(*v));
        world.cells.iter().for_each(|v| self.u32(*v));
        self.u32(world.seed);
        let sides = world.boundary;
        for side in [sides.west, sides.east, sides.north, sides.south] {
            self.text(side.name());
        }
    }

    /// Hashes parameters in the order of their names. For a file, its name is included as well as its content, since
    /// the extension may select the format; its folder is not, so that a project can be moved.
    fn params(&mut self, params: &ParamValues) {
        for (name, value) in params.iter() {
            self.text(name);
            match value {
                ParamValue::Float(v) => {
                    self.bytes(b"f");
                    self.f64(*v);
                }
                ParamValue::Int(v) => {
                    self.bytes(b"i");
                    self.bytes(&v.to_le_bytes());
                }
                ParamValue::Bool(v) => self.bytes(&[b'b', u8::from(*v)]),
                ParamValue::Choice(name) => {
                    self.bytes(b"c");
                    self.text(name);
                }
                ParamValue::Seed(v) => {
                    self.bytes(b"s");
                    self.u32(*v);
                }
                ParamValue::Point(p) => {
                    self.bytes(b"p");
                    p.iter().for_each(|v| self.f64(*v));
                }
                ParamValue::Curve(points) => {
                    self.bytes(b"l");
                    self.u64(points.len() as u64);
                    points.as_flattened().iter().for_each(|v| self.f64(*v));
                }
                ParamValue::Path(points) => {
                    self.bytes(b"w");
                    self.u64(points.len() as u64);
                    points.as_flattened().iter().for_each(|v| self.f64(*v));
                }
                ParamValue::Waypoints(points) => {
                    self.bytes(b"v");
                    self.u64(points.len() as u64);
                    for point in points {
                        point.at.iter().for_each(|v| self.f64(*v));
                        for value in [point.height, point.width] {
                            self.bytes(&[u8::from(value.is_some())]);
                            self.f64(value.unwrap_or_default());
                        }
                    }
                }
                ParamValue::Stops(stops) => {
                    self.bytes(b"s");
                    self.u64(stops.len() as u64);
                    for stop in stops {
                        self.f64(stop.at);
                        self.bytes(&stop.colour.0);
                    }
                }
                ParamValue::Layers(layers) => {
                    self.bytes(b"y");
                    self.u64(layers.len() as u64);
                    for layer in layers {
                        [layer.thickness, layer.hardness, layer.repose].iter().for_each(|v| self.f64(*v));
                        self.bytes(&layer.colour.0);
                    }
                }
                ParamValue::Strokes(strokes) => {
                    self.bytes(b"b");
                    self.u64(strokes.len() as u64);
                    for stroke in strokes {
                        self.text(stroke.tool.name());
                        [stroke.radius, stroke.strength, stroke.hardness, stroke.time]
                            .iter()
                            .for_each(|v| self.f64(*v));
                        self.u64(stroke.points.len() as u64);
                        stroke.points.as_flattened().iter().for_each(|v| self.f64(*v));
                    }
                }
                ParamValue::File(file) => {
                    self.bytes(b"F");
                    self.text(&Path::new(file).file_name().unwrap_or_default().to_string_lossy());
                }
            }
        }
    }

    fn finish(&self) -> Key {
        let mut key = [0; 16];
        self.0.finalize_xof().fill(&mut key);
        Key(key)
    }
}

#[cfg(test)]
impl Key {
    /// A key for tests.
    pub(super) const fn from_bytes(bytes: [u8; 16]) -> Self {
        Self(bytes)
    }
}
