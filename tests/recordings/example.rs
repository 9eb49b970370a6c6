//! The committed example equals the output of the current program; `scripts/make-example` regenerates it.

use crate::support::bundle;

use bundle::*;

#[test]
fn the_example_is_verified() {
    let output = typodont(&["verify", "reports/example"]);
    assert!(output.status.success(), "{}", complained(&output));
}
