//! What an evaluation tells while it runs.

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
    /// The cache in memory.
    Memory,
    /// The cache on disk.
    Disk,
}

/// What happens during an evaluation. Events come from the threads that work, so those of different nodes interleave;
/// those of one node come in order.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// It is known what has to be done.
    Planned {
        /// Nodes whose kernels will run.
        compute: usize,
        /// Nodes whose results are taken from a cache.
        cached: usize,
    },
    /// A kernel starts.
    NodeStarted {
        /// The node.
        node: NodeIndex,
        /// Its name.
        name: Arc<str>,
    },
    /// A kernel goes on. At most some twenty of them a second and node.
    NodeProgress {
        /// The node.
        node: NodeIndex,
        /// Its name.
        name: Arc<str>,
        /// The finished part, 0 to 1, never falling.
        fraction: f32,
    },
    /// Results of a node as they are while its kernel goes on ([`Job::glimpse`](crate::Job::glimpse)), for an evaluator
    /// that [watches](crate::EvaluatorOptions::glimpses); on the window that the kernel computes, which may be larger than
    /// what was asked for.
    NodeGlimpse {
        /// The node.
        node: NodeIndex,
        /// Its name.
        name: Arc<str>,
        /// Positions of outputs in its declaration, with their values.
        values: Vec<(usize, Value)>,
    },
    /// A node's results are there.
    NodeFinished {
        /// The node.
        node: NodeIndex,
        /// Its name.
        name: Arc<str>,
        /// Cells of the world along x and y.
        cells: [u32; 2],
        /// How long it took to compute or to read back.
        time: Duration,
        /// Bytes of its results.
        bytes: usize,
        /// Where they came from.
        origin: Origin,
    },
    /// A result is there, but may not be what was meant ([`Job::warn`](crate::Job::warn)); or something did not work that the
    /// results do not depend on, such as writing to the cache.
    Warning {
        /// The node.
        node: NodeIndex,
        /// Its name.
        name: Arc<str>,
        /// What, in words.
        message: String,
    },
}

/// The time, for what is told of a run; no result depends on it.
#[expect(clippy::disallowed_methods, reason = "durations are reported, never computed with")]
pub(super) fn now() -> Instant {
    Instant::now()
}

/// Lets through a rising fraction every now and then.
pub(super) struct Throttle(Mutex<(Option<Instant>, f32)>);

impl Throttle {
    const INTERVAL: Duration = Duration::from_millis(50);

    pub(super) const fn new() -> Self {
        Self(Mutex::new((None, 0.0)))
    }

    /// Whether this fraction is to be told. A thread that finds another one asking need not wait: its news is no newer.
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

/// Says every now and then that it is time again.
pub(super) struct Ticker {
    interval: Duration,
    last: Mutex<Instant>,
}

impl Ticker {
    pub(super) fn new(interval: Duration) -> Self {
        Self { interval, last: Mutex::new(now()) }
    }

    /// Whether it is time; then it is not again for the interval.
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

/// Locks, also after a panic elsewhere: what is behind the evaluator's locks is whole between any two statements.
pub(super) fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
