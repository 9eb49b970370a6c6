//! The committed example is what the program would make today; `scripts/make-example` makes it anew.

mod bundle;

use bundle::*;

#[test]
fn the_example_holds() {
    let output = typodont(&["verify", "reports/example"]);
    assert!(output.status.success(), "{}", complained(&output));
}
