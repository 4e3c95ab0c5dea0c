//! Results that are being computed, so that evaluations at the same time do not compute them twice.
//!
//! A kernel claims what it computes. An evaluation that needs the same leaves this step out, and plans it again when the
//! claim has ended: then the result is in the store, or the evaluation computes it itself. Nobody waits while holding a
//! claim for anything but the kernel, so evaluations cannot wait for each other in a circle.

use std::{
    sync::{Condvar, Mutex, PoisonError},
    time::Duration,
};

use crate::{
    eval::{event::lock, key::Key},
    job::{Cancel, Wanted},
    world::Window,
};

/// How often a waiting evaluation looks whether it has been cancelled.
const LOOK: Duration = Duration::from_millis(20);

/// The claims of a store.
#[derive(Default)]
pub(in crate::eval) struct InFlight {
    state: Mutex<State>,
    ended: Condvar,
}

#[derive(Default)]
struct State {
    claims: Vec<(u64, Key, Window, Wanted)>,
    /// Number of claims so far.
    made: u64,
    /// Number of claims that have ended.
    ended: u64,
}

/// A result that somebody else is computing: how many claims had ended when that was found out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::eval) struct Elsewhere(u64);

/// A claim, which ends when it is dropped.
pub(in crate::eval) struct Claim<'a> {
    of: &'a InFlight,
    number: u64,
}

impl InFlight {
    /// Claims the outputs of a node on a window.
    ///
    /// # Errors
    /// When a kernel that has been claimed computes all of them.
    pub(in crate::eval) fn claim(&self, key: Key, window: Window, wanted: Wanted) -> Result<Claim<'_>, Elsewhere> {
        let mut state = lock(&self.state);
        let covers = |claim: &&(u64, Key, Window, Wanted)| {
            claim.1 == key && claim.2.contains(&window) && claim.3.includes(wanted)
        };
        if state.claims.iter().find(covers).is_some() {
            return Err(Elsewhere(state.ended));
        }
        let number = state.made;
        state.made += 1;
        state.claims.push((number, key, window, wanted));
        Ok(Claim { of: self, number })
    }

    /// Waits until a claim has ended since then, or the evaluation is cancelled.
    pub(in crate::eval) fn wait(&self, since: Elsewhere, cancel: &Cancel) {
        let mut state = lock(&self.state);
        while state.ended == since.0 && !cancel.is_cancelled() {
            state = self.ended.wait_timeout(state, LOOK).unwrap_or_else(PoisonError::into_inner).0;
        }
    }
}

impl Drop for Claim<'_> {
    fn drop(&mut self) {
        let mut state = lock(&self.of.state);
        state.claims.retain(|claim| claim.0 != self.number);
        state.ended += 1;
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
        let claim = all.claim(key, window(8), two).expect("nobody else");
        assert!(all.claim(key, window(8), two).is_err() && all.claim(key, window(4), Wanted::NONE.with(1)).is_err());
        // others
        assert!(all.claim(key, window(9), two).is_ok() && all.claim(key, window(8), two.with(2)).is_ok());
        assert!(all.claim(Key::from_bytes([2; 16]), window(8), two).is_ok());
        let elsewhere = all.claim(key, window(8), two).err().expect("claimed");
        drop(claim);
        all.wait(elsewhere, &Cancel::default());
        assert!(all.claim(key, window(8), two).is_ok());
    }

    #[test]
    fn a_cancelled_evaluation_does_not_wait() {
        let all = InFlight::default();
        let claim = all.claim(Key::from_bytes([1; 16]), window(8), Wanted::ALL).expect("nobody else");
        let elsewhere = all.claim(Key::from_bytes([1; 16]), window(8), Wanted::ALL).err().expect("claimed");
        let cancel = Cancel::default();
        cancel.cancel();
        all.wait(elsewhere, &cancel);
        drop(claim);
    }
}
