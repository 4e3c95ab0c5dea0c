//! Progress of a build: bars on a terminal, lines elsewhere, JSON for programs, or nothing.

mod bars;
mod json;
mod lines;

use orograph_graph::Event;

pub use bars::Bars;
pub use json::{HELP as JSON_HELP, JsonLines};
pub use lines::Lines;

use super::{failure::Failure, terminal::Page};
use crate::build::{Built, request::Request};

/// Receives the progress of a build, from the working threads.
pub trait Progress: Sync {
    /// The build starts.
    fn started(&self, _request: &Request, _threads: usize) {}

    /// An event of a node of this type (empty if the event has no node).
    fn event(&self, kind: &'static str, event: &Event);

    /// Everything is computed; files are being written.
    fn writing(&self) {}

    /// The build has ended, successfully or not; bars are removed.
    fn ended(&self) {}

    /// The build succeeded; the files are in place.
    fn finished(&self, _built: &Built) {}

    /// The build failed.
    fn failed(&self, _failure: &Failure) {}
}

/// Prints only errors.
#[derive(Debug)]
pub struct Quiet;

impl Progress for Quiet {
    fn event(&self, _: &'static str, _: &Event) {}
}

/// Bars on an interactive terminal, lines elsewhere.
#[must_use]
pub fn for_people() -> Box<dyn Progress> {
    let page = Page::stderr();
    if page.terminal { Box::new(Bars::new(page)) } else { Box::new(Lines::new(page)) }
}

/// A duration as text: `42 ms`, `1.25 s`, `3 min 5 s`.
#[must_use]
pub fn seconds(time: std::time::Duration) -> String {
    let seconds = time.as_secs_f64();
    match seconds {
        s if s < 0.001 => "<1 ms".to_owned(),
        s if s < 0.9995 => format!("{:.0} ms", s * 1e3),
        s if s < 9.995 => format!("{s:.2} s"),
        s if s < 99.95 => format!("{s:.1} s"),
        s if s < 3600.0 => format!("{} min {} s", time.as_secs() / 60, time.as_secs() % 60),
        _ => format!("{} h {} min", time.as_secs() / 3600, time.as_secs() % 3600 / 60),
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn durations_read_well() {
        assert_eq!(seconds(Duration::from_millis(4)), "4 ms");
        assert_eq!(seconds(Duration::from_millis(1250)), "1.25 s");
        assert_eq!(seconds(Duration::from_millis(12_340)), "12.3 s");
        assert_eq!(seconds(Duration::from_secs(185)), "3 min 5 s");
        assert_eq!(seconds(Duration::from_secs(7300)), "2 h 1 min");
    }
}
