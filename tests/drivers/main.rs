//! Every driver against a fake that speaks its device's protocol, through one suite (`suite.rs`).
//!
//! A fake has a physical hand behind it (mass, damping, encoder steps, one tick of delay) and speaks the real protocol
//! over the real transport where there is one here: shared libraries, sockets, a pair of pseudo-terminals.

#[path = "../counting/mod.rs"]
mod counting;
mod haply;
mod live;
mod mouse;
mod native;
mod open_handle;
#[path = "../phantom/mod.rs"]
mod phantom;
mod pipe;
mod polhem;
mod rig;
mod simulated;
mod soak;
mod spacemouse;
mod staged;
mod stream;
mod suite;

#[test]
fn a_simulated_device_passes_the_suite() {
    suite::check(&mut simulated::Simulated::new());
}

#[test]
fn a_simulated_device_is_soaked() {
    soak::soak(&mut simulated::Simulated::new());
}
