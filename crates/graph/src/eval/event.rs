//! Events of an evaluation.

use std::{
    sync::{Arc, Mutex, PoisonError},
    time::{Duration, Instant},
};

use petgraph::stable_graph::NodeIndex;

use crate::value::Value;

/// Where a result came from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Origin {
    /// The kernel ran.
    Computed,
    /// Read from the memory cache.
    Memory,
    /// Read from the disk cache.
    Disk,
}

/// An event of an evaluation. Events come from the worker threads: those of different nodes interleave, those of one
/// node are in order.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// The plan is complete.
    Planned {
        /// Nodes whose kernels will run.
        compute: usize,
        /// Nodes whose results come from a cache.
        cached: usize,
    },
    /// A kernel starts, or the evaluation begins to wait for another one that runs this kernel for it.
    NodeStarted {
        /// The node.
        node: NodeIndex,
        /// Its name.
        name: Arc<str>,
    },
    /// A kernel has made progress. There are at most about twenty of these events per second and node.
    NodeProgress {
        /// The node.
        node: NodeIndex,
        /// Its name.
        name: Arc<str>,
        /// The finished part, from 0 to 1, never decreasing after a start.
        fraction: f32,
    },
    /// Intermediate results of a node while its kernel runs ([`Job::glimpse`](crate::Job::glimpse)), if the evaluator
    /// has [progressive preview](crate::EvaluatorOptions::glimpses) on. They cover the window that the kernel computes,
    /// which may be larger than the requested one.
    NodeGlimpse {
        /// The node.
        node: NodeIndex,
        /// Its name.
        name: Arc<str>,
        /// Positions of outputs in the node's declaration, with their values.
        values: Vec<(usize, Value)>,
    },
    /// The results of a node are available.
    NodeFinished {
        /// The node.
        node: NodeIndex,
        /// Its name.
        name: Arc<str>,
        /// Cells of the world along x and y.
        cells: [u32; 2],
        /// Time to compute them, or to read them back.
        time: Duration,
        /// Bytes of its results.
        bytes: usize,
        /// Their origin.
        origin: Origin,
        /// The name of the backend that runs, or would run, the node.
        backend: &'static str,
    },
    /// A result is available, but may not be what the user intended ([`Job::warn`](crate::Job::warn)); or something
    /// failed that does not affect results, such as writing to the cache.
    Warning {
        /// The node.
        node: NodeIndex,
        /// Its name.
        name: Arc<str>,
        /// The message.
        message: String,
    },
}

/// The current time, for reports only; no result depends on it.
#[expect(clippy::disallowed_methods, reason = "durations are reported, never computed with")]
pub(super) fn now() -> Instant {
    Instant::now()
}

/// Lets through an increasing fraction at intervals.
pub(super) struct Throttle(Mutex<(Option<Instant>, f32)>);

impl Throttle {
    const INTERVAL: Duration = Duration::from_millis(50);

    pub(super) const fn new() -> Self {
        Self(Mutex::new((None, 0.0)))
    }

    /// Returns true if this fraction should be reported. If another thread is inside, returns false at once: that
    /// thread's fraction is about as new.
    pub(super) fn admits(&self, fraction: f32) -> bool {
        let Ok(mut last) = self.0.try_lock() else { return false };
        let time = now();
        let due = last.0.is_none_or(|told| time.duration_since(told) >= Self::INTERVAL);
        if due && fraction > last.1 {
            *last = (Some(time), fraction);
            return true;
        }
        false
    }
}

/// Ticks at intervals.
pub(super) struct Ticker {
    interval: Duration,
    last: Mutex<Instant>,
}

impl Ticker {
    pub(super) fn new(interval: Duration) -> Self {
        Self { interval, last: Mutex::new(now()) }
    }

    /// Returns true if the interval is over; then a new one begins.
    pub(super) fn is_due(&self) -> bool {
        let Ok(mut last) = self.last.try_lock() else { return false };
        let time = now();
        let due = time.duration_since(*last) >= self.interval;
        if due {
            *last = time;
        }
        due
    }
}

/// Locks a mutex, even after a panic elsewhere: data behind the evaluator's locks is consistent between any two
/// statements.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
