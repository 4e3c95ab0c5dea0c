//! One run of a kernel: what it reads, what it gives back, how it reports and stops.

use std::{
    path::PathBuf,
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
};

use crate::{
    node::Node,
    param::{FileName, ParamValues, Seed},
    value::Value,
    world::{Window, World},
};

/// A switch that stops a running evaluation. Copies share it.
#[derive(Clone, Debug, Default)]
pub struct Cancel {
    own: Arc<AtomicBool>,
    parent: Option<Arc<Self>>,
}

impl Cancel {
    /// Asks everything that holds a copy to stop.
    pub fn cancel(&self) {
        self.own.store(true, Ordering::Relaxed);
    }

    /// A switch that is on when this one is, and that can be switched on without it.
    #[must_use]
    pub fn child(&self) -> Self {
        Self { own: Arc::default(), parent: Some(Arc::new(self.clone())) }
    }

    /// Whether somebody asked.
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
    /// It could not be done.
    #[error("{message}")]
    Failed {
        /// What is wrong, lower case, without a full stop.
        message: String,
        /// What would help.
        hint: Option<String>,
    },
}

impl NodeError {
    /// A failure without a hint.
    pub fn failed(message: impl Into<String>) -> Self {
        Self::Failed { message: message.into(), hint: None }
    }

    /// A failure with what would help.
    pub fn failed_with_hint(message: impl Into<String>, hint: impl Into<String>) -> Self {
        Self::Failed { message: message.into(), hint: Some(hint.into()) }
    }
}

/// What a kernel has to say of a result that is there, but may not be what was meant: each text once, in the order told.
#[derive(Debug, Default)]
pub struct Warnings(Mutex<Vec<String>>);

impl Warnings {
    fn add(&self, message: String) {
        let mut told = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if !told.contains(&message) {
            told.push(message);
        }
    }

    /// Takes them out.
    #[must_use]
    pub fn take(&self) -> Vec<String> {
        std::mem::take(&mut *self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

/// What stands at an input during a run.
#[derive(Clone, Debug, PartialEq)]
pub enum InputValue {
    /// A wire's value.
    Value(Value),
    /// A number that stands for the wire.
    Constant(f64),
    /// Nothing.
    Absent,
}

/// The named results of a kernel.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Outputs(Vec<(&'static str, Value)>);

impl Outputs {
    /// A single result.
    pub fn one(name: &'static str, value: impl Into<Value>) -> Self {
        Self::default().with(name, value)
    }

    /// The same with one more result.
    #[must_use]
    pub fn with(mut self, name: &'static str, value: impl Into<Value>) -> Self {
        self.0.push((name, value.into()));
        self
    }

    /// The results, each with its name.
    pub fn into_iter_named(self) -> impl Iterator<Item = (&'static str, Value)> {
        self.0.into_iter()
    }

    /// Takes the result of that name out.
    pub fn take(&mut self, name: &str) -> Option<Value> {
        let at = self.0.iter().position(|(n, _)| *n == name)?;
        Some(self.0.swap_remove(at).1)
    }
}

/// Which outputs of a node are wanted, by their position in its declaration.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Wanted(u64);

impl Wanted {
    /// No output.
    pub const NONE: Self = Self(0);
    /// Every output.
    pub const ALL: Self = Self(u64::MAX);
    /// The most outputs that a node may declare.
    pub const MAX_OUTPUTS: usize = u64::BITS as usize;

    /// The same with one more output.
    #[must_use]
    pub const fn with(self, output: usize) -> Self {
        Self(self.0 | 1 << output)
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
/// crops the result. Kernels may use rayon; they run inside the evaluator's pool.
pub struct Job<'a> {
    /// The node's declaration.
    pub node: &'a Node,
    /// Checked parameters.
    pub params: &'a ParamValues,
    /// The value of each declared input, in declaration order; [`inputs!`](crate::inputs) makes `Inputs` from it.
    pub inputs: Vec<InputValue>,
    /// What is computed.
    pub window: Window,
    /// The outputs that somebody reads: a kernel gives these and computes no others. [`outputs!`](crate::outputs) makes `Wants`
    /// from it.
    pub wanted: Wanted,
    /// Folder that file parameters are relative to.
    pub folder: PathBuf,
    /// The switch that stops it.
    pub cancel: Cancel,
    /// Receives the finished fraction, 0 to 1.
    pub progress: &'a (dyn Fn(f32) + Sync),
    /// Receives what [`Job::warn`] tells.
    pub warnings: Warnings,
    /// Receives what [`Job::glimpse`] shows, where somebody watches.
    pub glimpses: Option<Glimpses<'a>>,
}

/// Who watches a kernel at work.
#[derive(Clone, Copy)]
pub struct Glimpses<'a> {
    /// Whether it is time for another look.
    pub due: &'a (dyn Fn() -> bool + Sync),
    /// Receives the results as they are.
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

    /// Side of a cell in metres.
    #[must_use]
    pub fn cell_m(&self) -> f64 {
        self.window.cell_m()
    }

    /// The seed of this run: the world's seed mixed with the node's parameter `seed`, where it has one.
    ///
    /// Two nodes of one kind with equal seeds draw the same numbers; give them different `seed`s to tell them apart.
    #[must_use]
    pub fn seed(&self) -> u32 {
        let own = if self.params.get("seed").is_some() { self.params.read::<Seed>("seed").0 } else { 0 };
        mix(self.world().seed ^ mix(own))
    }

    /// The full path of a file parameter. A kernel reads no files but these and, beside `NAME.png`, its companion
    /// `NAME.png.json`: their content is a part of what its results are remembered by, that of others is not.
    ///
    /// # Errors
    /// When no file is named.
    pub fn file(&self, name: &str) -> Result<PathBuf, NodeError> {
        let FileName(file) = self.params.read(name);
        if file.is_empty() {
            return Err(NodeError::failed_with_hint(
                "no file is named",
                format!("write `{name}: \"my.tif\"`, relative to the graph file"),
            ));
        }
        Ok(self.folder.join(file))
    }

    /// Tells the user, beside the result, that it may not be what was meant: what, and what would help. Lower case, without a
    /// full stop, as the message of an error: `cells of 90 m do not resolve hillslopes; ...`.
    ///
    /// It is told when the kernel runs, not when its result is taken from a cache. It must depend on nothing but what the
    /// result depends on.
    pub fn warn(&self, message: impl Into<String>) {
        self.warnings.add(message.into());
    }

    /// Shows results as they are on the way, to who watches; some of the outputs do. They are made only if somebody does, a
    /// few times a second, and are never kept: what the kernel gives in the end does not depend on them.
    pub fn glimpse(&self, results: impl FnOnce() -> Outputs) {
        if let Some(glimpses) = self.glimpses
            && (glimpses.due)()
        {
            (glimpses.take)(results());
        }
    }

    /// Reports progress and asks whether to go on. Cheap; call it once per pass, at least ten times a second.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`] when the run is to stop.
    pub fn advance(&self, fraction: f32) -> Result<(), NodeError> {
        (self.progress)(fraction.clamp(0.0, 1.0));
        self.check()
    }

    /// Asks whether to go on, from any thread.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`] when the run is to stop.
    pub fn check(&self) -> Result<(), NodeError> {
        if self.cancel.is_cancelled() { Err(NodeError::Cancelled) } else { Ok(()) }
    }
}

/// An input per cell: a raster, or one number for all cells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lane<'a> {
    /// The same everywhere.
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

    /// The number, if it is one for all cells.
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
pub const fn mix(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x7feb_352d);
    x ^= x >> 15;
    x = x.wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}
