//! Results that are being computed, so that evaluations at the same time do not compute them twice.
//!
//! A kernel claims what it computes. An evaluation that needs the same leaves this step out, and plans it again when
//! the claim has ended: then the result is in the store, or the evaluation computes it itself. Nobody waits while
//! holding a claim for anything but the kernel, so evaluations cannot wait for each other in a circle.

use std::{
    sync::{
        Arc, Condvar, Mutex, PoisonError,
        atomic::{AtomicU32, Ordering},
    },
    time::Duration,
};

use crate::{
    eval::{event::lock, key::Key},
    job::{Cancel, Wanted},
    world::Window,
};

/// How often a waiting evaluation looks at the progress, and whether it has been cancelled.
const LOOK: Duration = Duration::from_millis(20);

/// The claims of a store.
#[derive(Default)]
pub(in crate::eval) struct InFlight {
    state: Mutex<State>,
    ended: Condvar,
}

#[derive(Default)]
struct State {
    claims: Vec<Claimed>,
    /// Number of claims so far.
    made: u64,
}

struct Claimed {
    number: u64,
    /// The run that computes it.
    run: usize,
    key: Key,
    window: Window,
    wanted: Wanted,
    progress: Progress,
}

/// The finished part of a kernel, the bits of a fraction from 0 to 1.
#[derive(Clone, Debug, Default)]
struct Progress(Arc<AtomicU32>);

/// A result that somebody else is computing.
#[derive(Clone, Debug)]
pub(in crate::eval) struct Elsewhere {
    number: u64,
    progress: Progress,
}

/// A claim, which ends when it is dropped.
pub(in crate::eval) struct Claim<'a> {
    of: &'a InFlight,
    number: u64,
    progress: Progress,
}

impl InFlight {
    /// Claims the outputs of a node on a window for a run.
    ///
    /// # Errors
    /// When a kernel that another run has claimed computes all of them. A run that waited for itself would find nothing
    /// if the store has no room, and begin again and again.
    pub(in crate::eval) fn claim(
        &self,
        run: usize,
        key: Key,
        window: Window,
        wanted: Wanted,
    ) -> Result<Claim<'_>, Elsewhere> {
        let mut state = lock(&self.state);
        let covers = |claim: &&Claimed| {
            claim.run != run && claim.key == key && claim.window.contains(&window) && claim.wanted.includes(wanted)
        };
        if let Some(claim) = state.claims.iter().find(covers) {
            return Err(Elsewhere { number: claim.number, progress: claim.progress.clone() });
        }
        let (number, progress) = (state.made, Progress::default());
        state.made += 1;
        state.claims.push(Claimed { number, run, key, window, wanted, progress: progress.clone() });
        Ok(Claim { of: self, number, progress })
    }

    /// Waits until a claim has ended, or the evaluation is cancelled; reports the claim's progress meanwhile.
    pub(in crate::eval) fn wait(&self, elsewhere: &Elsewhere, cancel: &Cancel, report: impl Fn(f32)) {
        let mut state = lock(&self.state);
        while state.claims.iter().any(|claim| claim.number == elsewhere.number) && !cancel.is_cancelled() {
            drop(state);
            report(f32::from_bits(elsewhere.progress.0.load(Ordering::Relaxed)));
            state = lock(&self.state);
            if state.claims.iter().any(|claim| claim.number == elsewhere.number) {
                state = self.ended.wait_timeout(state, LOOK).unwrap_or_else(PoisonError::into_inner).0;
            }
        }
    }
}

impl Claim<'_> {
    /// Tells those who wait for the kernel what part of it is finished.
    pub(in crate::eval) fn progress(&self, fraction: f32) {
        self.progress.0.store(fraction.to_bits(), Ordering::Relaxed);
    }
}

impl Drop for Claim<'_> {
    fn drop(&mut self) {
        let mut state = lock(&self.of.state);
        state.claims.retain(|claim| claim.number != self.number);
        self.of.ended.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::World;

    fn window(side: u32) -> Window {
        Window { cells: [side; 2], ..Window::whole(World { size: [9.0; 2], cells: [9; 2], ..World::default() }) }
    }

    #[test]
    fn a_claim_covers_parts_until_it_ends() {
        let all = InFlight::default();
        let key = Key::from_bytes([1; 16]);
        let two = Wanted::NONE.with(0).with(1);
        let claim = all.claim(0, key, window(8), two).expect("nobody else");
        assert!(all.claim(0, key, window(8), two).is_ok(), "a run does not wait for itself");
        assert!(
            all.claim(1, key, window(8), two).is_err() && all.claim(1, key, window(4), Wanted::NONE.with(1)).is_err()
        );
        // others
        assert!(all.claim(1, key, window(9), two).is_ok() && all.claim(1, key, window(8), two.with(2)).is_ok());
        assert!(all.claim(1, Key::from_bytes([2; 16]), window(8), two).is_ok());
        let elsewhere = all.claim(1, key, window(8), two).err().expect("claimed");
        claim.progress(0.5);
        all.wait(&elsewhere, &Cancel::default(), |fraction| {
            assert_eq!(fraction.to_bits(), 0.5_f32.to_bits());
            lock(&all.state).claims.clear();
        });
        drop(claim);
        assert!(all.claim(1, key, window(8), two).is_ok());
    }

    #[test]
    fn a_cancelled_evaluation_does_not_wait() {
        let all = InFlight::default();
        let claim = all.claim(0, Key::from_bytes([1; 16]), window(8), Wanted::ALL).expect("nobody else");
        let elsewhere = all.claim(1, Key::from_bytes([1; 16]), window(8), Wanted::ALL).err().expect("claimed");
        let cancel = Cancel::default();
        cancel.cancel();
        all.wait(&elsewhere, &cancel, |_| {});
        drop(claim);
    }
}
