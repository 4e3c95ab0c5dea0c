//! One run of a kernel: its inputs, its results, progress and cancellation.

use std::{
    path::PathBuf,
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
};

use crate::{
    device::DeviceError,
    memory::OutOfMemory,
    node::{Node, OutputType},
    param::{FileName, ParamValues, Seed},
    state::State,
    value::Value,
    world::{GeoPlace, Window, World},
};

/// A switch that stops a running evaluation. Copies share it.
#[derive(Clone, Debug, Default)]
pub struct Cancel {
    own: Arc<AtomicBool>,
    parent: Option<Arc<Self>>,
}

impl Cancel {
    /// Requests that everything with a copy stops.
    pub fn cancel(&self) {
        self.own.store(true, Ordering::Relaxed);
    }

    /// A switch that is on when this one is, and that can also be switched on separately.
    #[must_use]
    pub fn child(&self) -> Self {
        Self { own: Arc::default(), parent: Some(Arc::new(self.clone())) }
    }

    /// Returns true if cancellation was requested.
    #[must_use]
    pub fn is_cancelled(&self) -> bool {
        self.own.load(Ordering::Relaxed) || self.parent.as_ref().is_some_and(|parent| parent.is_cancelled())
    }
}

/// Why a kernel gave no result.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NodeError {
    /// The evaluation was cancelled.
    #[error("cancelled")]
    Cancelled,
    /// The system had no memory for a raster.
    #[error(transparent)]
    OutOfMemory(OutOfMemory),
    /// The kernel failed.
    #[error("{message}")]
    Failed {
        /// What is wrong, in lower case, without a full stop.
        message: String,
        /// A possible remedy.
        hint: Option<String>,
    },
}

impl NodeError {
    /// A failure without a hint.
    pub fn failed(message: impl Into<String>) -> Self {
        Self::Failed { message: message.into(), hint: None }
    }

    /// A failure with a hint.
    pub fn failed_with_hint(message: impl Into<String>, hint: impl Into<String>) -> Self {
        Self::Failed { message: message.into(), hint: Some(hint.into()) }
    }
}

impl From<DeviceError> for NodeError {
    fn from(DeviceError(message): DeviceError) -> Self {
        Self::failed(message)
    }
}

/// Warnings of a kernel about results that may not be what the user intended: each text once, in order.
#[derive(Debug, Default)]
pub struct Warnings(Mutex<Vec<String>>);

impl Warnings {
    fn add(&self, message: String) {
        let mut told = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if !told.contains(&message) {
            told.push(message);
        }
    }

    /// Removes and returns the warnings.
    #[must_use]
    pub fn take(&self) -> Vec<String> {
        std::mem::take(&mut *self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

/// The value of an input during a run.
#[derive(Clone, Debug, PartialEq)]
pub enum InputValue {
    /// The value of a wire.
    Value(Value),
    /// A constant.
    Constant(f64),
    /// Nothing.
    Absent,
}

impl InputValue {
    /// Returns true if a wire gives a value for each cell, lines or the like, rather than one number or nothing.
    #[must_use]
    pub const fn is_wired(&self) -> bool {
        matches!(self, Self::Value(_))
    }

    /// Brings a value that is on a device to the host.
    ///
    /// # Errors
    /// When the device does not give it back.
    pub fn fetch(&self) -> Result<(), DeviceError> {
        match self {
            Self::Value(value) => value.fetch(),
            Self::Constant(_) | Self::Absent => Ok(()),
        }
    }
}

/// The named results of a kernel, and its state for the next finer level if that is wanted.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Outputs {
    values: Vec<(&'static str, Value)>,
    state: Option<State>,
}

impl Outputs {
    /// A single result.
    pub fn one(name: &'static str, value: impl Into<Value>) -> Self {
        Self::default().with(name, value)
    }

    /// Adds a result.
    #[must_use]
    pub fn with(mut self, name: &'static str, value: impl Into<Value>) -> Self {
        self.values.push((name, value.into()));
        self
    }

    /// The results, each with its name.
    pub fn into_iter_named(self) -> impl Iterator<Item = (&'static str, Value)> {
        self.values.into_iter()
    }

    /// Removes and returns the result of that name.
    pub fn take(&mut self, name: &str) -> Option<Value> {
        let at = self.values.iter().position(|(n, _)| *n == name)?;
        Some(self.values.swap_remove(at).1)
    }

    /// Brings all results to the host.
    ///
    /// # Errors
    /// When a device does not give one back.
    pub fn fetch(&self) -> Result<(), DeviceError> {
        self.values.iter().try_for_each(|(_, value)| value.fetch())
    }

    /// Adds the state for the next finer level.
    #[must_use]
    pub fn with_state(self, state: Option<State>) -> Self {
        Self { state, ..self }
    }

    /// Removes and returns the state for the next finer level.
    pub fn take_state(&mut self) -> Option<State> {
        self.state.take()
    }
}

/// A set of outputs of a node, by position in its declaration.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Wanted(u64);

impl Wanted {
    /// No output.
    pub const NONE: Self = Self(0);
    /// Every output.
    pub const ALL: Self = Self(u64::MAX);
    /// The largest number of outputs that a node may declare; one more stands for its state.
    pub const MAX_OUTPUTS: usize = u64::BITS as usize - 1;

    /// The same set with one more output.
    #[must_use]
    pub const fn with(self, output: usize) -> Self {
        Self(self.0 | 1 << output)
    }

    /// The same set without one output.
    pub(crate) const fn without(self, output: usize) -> Self {
        Self(self.0 & !(1 << output))
    }

    /// Returns true if all outputs of the other set are in this one.
    #[must_use]
    pub const fn includes(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// Returns true if the output is wanted.
    #[must_use]
    pub const fn contains(self, output: usize) -> bool {
        self.0 >> output & 1 == 1
    }
}

/// One run of a kernel over a window.
///
/// All fields of inputs and outputs cover exactly [`Job::window`]; the evaluator has grown it by the node's reach and
/// crops the result. Kernels may use rayon; they run inside the evaluator's thread pool.
pub struct Job<'a> {
    /// The node's declaration.
    pub node: &'a Node,
    /// Checked parameters.
    pub params: &'a ParamValues,
    /// The value of each declared input, in declaration order; [`inputs!`](crate::inputs) makes `Inputs` from it.
    pub inputs: Vec<InputValue>,
    /// What it goes on from and what it leaves to a finer level, for a node with [levels](Node::levels).
    pub level: LevelJob,
    /// The window to compute.
    pub window: Window,
    /// The requested outputs: a kernel returns these and computes no others. [`outputs!`](crate::outputs) makes `Wants`
    /// from them.
    pub wanted: Wanted,
    /// Folder that file parameters are relative to.
    pub folder: PathBuf,
    /// The switch that stops the kernel.
    pub cancel: Cancel,
    /// Receives the finished fraction, 0 to 1.
    pub progress: &'a (dyn Fn(f32) + Sync),
    /// Collects the warnings of [`Job::warn`].
    pub warnings: Warnings,
    /// Receives intermediate results from [`Job::glimpse`]; `None` without a progressive preview.
    pub glimpses: Option<Glimpses<'a>>,
}

/// A job's place among the [levels](Node::levels) of its node.
#[derive(Clone, Debug, Default)]
pub struct LevelJob {
    /// What the run goes on from.
    pub below: Coarser,
    /// True if the state for the next finer level is wanted, besides or instead of outputs.
    pub gives_state: bool,
}

/// What a run goes on from, as its node [declares](crate::Below).
#[derive(Clone, Debug, Default)]
pub enum Coarser {
    /// Nothing, or nothing that the caller has: then a kernel passes the levels below by itself.
    #[default]
    Nothing,
    /// The state of the level below.
    State(Arc<State>),
    /// The wanted outputs on more cells.
    Results(Outputs),
}

/// The receiver of a progressive preview.
#[derive(Clone, Copy)]
pub struct Glimpses<'a> {
    /// Returns true if another intermediate result is due.
    pub due: &'a (dyn Fn() -> bool + Sync),
    /// Receives the intermediate results.
    pub take: &'a (dyn Fn(Outputs) + Sync),
}

impl Job<'_> {
    /// The window, by value.
    #[must_use]
    pub const fn window(&self) -> Window {
        self.window
    }

    /// The world.
    #[must_use]
    pub const fn world(&self) -> &World {
        &self.window.world
    }

    /// Elevation of the sea in metres. Returns None in a world without a sea.
    ///
    /// # Panics
    /// When the node does not declare that it [reads](Node::reads_sea) the sea level: its results would be reused after
    /// a change of the level.
    #[must_use]
    pub fn sea_level(&self) -> Option<f64> {
        assert!(self.node.reads_sea, "`{}` does not declare that it reads the sea level", self.node.id);
        self.world().sea_level
    }

    /// Where on Earth the world lies. Returns None for a world that is nowhere.
    ///
    /// # Panics
    /// When the node does not declare that it [reads](Node::reads_place) the place: its results would be reused after a
    /// change of it.
    #[must_use]
    pub fn place(&self) -> Option<GeoPlace> {
        assert!(self.node.reads_place, "`{}` does not declare that it reads the place", self.node.id);
        self.world().place
    }

    /// Number of planes of an output on this run; 0 for one that is no raster.
    #[must_use]
    pub fn planes(&self, output: usize) -> usize {
        match self.node.outputs[output].ty {
            OutputType::Fixed(ty) => ty.planes().unwrap_or(0),
            OutputType::Chosen(of) => of(self.params).planes().unwrap_or(0),
            OutputType::SameAs(name) => {
                if let Some(InputValue::Value(Value::Field(field))) = self.input(name) {
                    field.planes()
                } else {
                    1
                }
            }
        }
    }

    /// The value of the input of that name. Returns None if the node declares no such input.
    #[must_use]
    pub fn input(&self, name: &str) -> Option<&InputValue> {
        let mut inputs = self.node.inputs.iter().zip(&self.inputs);
        inputs.find(|(input, _)| input.name == name).map(|(_, value)| value)
    }

    /// Side of a cell in metres.
    #[must_use]
    pub fn cell_m(&self) -> f64 {
        self.window.cell_m()
    }

    /// The seed of this run: the world's seed combined with the node's parameter `seed`, if it has one.
    ///
    /// Two nodes of one kind with equal seeds draw the same numbers; give them different `seed`s for different results.
    #[must_use]
    pub fn seed(&self) -> u32 {
        let own = if self.params.get("seed").is_some() { self.params.read::<Seed>("seed").0 } else { 0 };
        mix(self.world().seed ^ mix(own))
    }

    /// The full path of a file parameter. A kernel reads no other files, except `NAME.png.json` next to a `NAME.png`:
    /// the key of its results includes the content of these files, but of no others.
    ///
    /// # Errors
    /// When the parameter is empty.
    pub fn file(&self, name: &str) -> Result<PathBuf, NodeError> {
        let FileName(file) = self.params.read(name);
        require_file(&file, name)?;
        Ok(self.folder.join(file))
    }

    /// Warns the user that a result may not be what they intended. The message names the problem and a remedy, in lower
    /// case, without a full stop, like the message of an error: `cells of 90 m do not resolve hillslopes; ...`.
    ///
    /// The warning is stored with the result and repeated when the result comes from a cache. It must depend only on
    /// what the result depends on.
    pub fn warn(&self, message: impl Into<String>) {
        self.warnings.add(message.into());
    }

    /// Offers intermediate results of some outputs for a progressive preview. They are computed only while a viewer is
    /// attached, a few times a second, and are never stored; the final result does not depend on them.
    pub fn glimpse(&self, results: impl FnOnce() -> Outputs) {
        if let Some(glimpses) = self.glimpses
            && (glimpses.due)()
        {
            (glimpses.take)(results());
        }
    }

    /// Reports progress and checks for cancellation. Cheap; call it once per pass, at least ten times a second.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`] when the run should stop.
    pub fn advance(&self, fraction: f32) -> Result<(), NodeError> {
        (self.progress)(fraction.clamp(0.0, 1.0));
        self.check()
    }

    /// Checks for cancellation, from any thread.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`] when the run should stop.
    pub fn check(&self) -> Result<(), NodeError> {
        if self.cancel.is_cancelled() { Err(NodeError::Cancelled) } else { Ok(()) }
    }
}

/// An input per cell: a raster, or one number for all cells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lane<'a> {
    /// The same value for all cells.
    Constant(f32),
    /// One per cell, row-major.
    Samples(&'a [f32]),
}

impl<'a> Lane<'a> {
    /// The number at a cell index.
    #[must_use]
    #[inline]
    pub fn at(&self, index: usize) -> f32 {
        match self {
            Self::Constant(v) => *v,
            Self::Samples(samples) => samples[index],
        }
    }

    /// The part for a range of cell indices.
    #[must_use]
    pub fn slice(&self, range: std::ops::Range<usize>) -> Lane<'a> {
        match self {
            Self::Constant(v) => Lane::Constant(*v),
            Self::Samples(samples) => Lane::Samples(&samples[range]),
        }
    }

    /// The number, if it is the same for all cells.
    #[must_use]
    pub const fn constant(&self) -> Option<f32> {
        match self {
            Self::Constant(v) => Some(*v),
            Self::Samples(_) => None,
        }
    }
}

/// A bijective 32-bit mixing function (C. Wellons, 2018, "lowbias32").
#[must_use]
#[inline(always)]
pub const fn mix(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x7feb_352d);
    x ^= x >> 15;
    x = x.wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

/// Checks that a parameter names a file.
///
/// # Errors
/// When it is empty.
pub fn require_file(file: &str, name: &str) -> Result<(), NodeError> {
    if !file.is_empty() {
        return Ok(());
    }
    Err(NodeError::failed_with_hint(
        "no file is named",
        format!("write `{name}: \"my.tif\"`, relative to the graph file"),
    ))
}
