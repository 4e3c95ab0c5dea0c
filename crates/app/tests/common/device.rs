//! Detects whether there is a graphics device for the tests that draw. Without one they are skipped with a message, or
//! fail if `OROGRAPH_ALL_TESTS` is set, as in `.ci/run`.

use std::{io::Write as _, sync::OnceLock};

use orograph::view::Offscreen;

/// The variable that makes a skipped test a failure.
const VARIABLE: &str = "OROGRAPH_ALL_TESTS";

/// Returns true if a test that draws must be skipped, after a message that libtest does not capture.
pub(crate) fn skips(test: &str) -> bool {
    let Some(why) = missing() else { return false };
    assert!(std::env::var_os(VARIABLE).is_none(), "{test}: {why}");
    // A message that cannot be written does not fail the test.
    let _ = writeln!(std::io::stderr(), "SKIPPED {test}: {why}");
    true
}

/// Why the 3D view cannot be drawn. Returns None when it can.
pub(crate) fn missing() -> Option<&'static str> {
    static MISSING: OnceLock<Option<String>> = OnceLock::new();
    let probe = || match Offscreen::new().and_then(|device| device.renderer()) {
        Ok(_) => None,
        Err(error) => Some(format!("{error}; {}", error.remedy())),
    };
    MISSING.get_or_init(probe).as_deref()
}
