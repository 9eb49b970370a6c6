//! Every driver against a fake that speaks its device's protocol, through one suite (`suite.rs`).
//!
//! A fake has a physical hand behind it (mass, damping, encoder steps, one tick of delay) and speaks the real protocol
//! over the real transport where there is one here: shared libraries, sockets, a pair of pseudo-terminals.

use crate::support::peace;
use crate::{haply, native, open_handle, polhem, rig, simulated, soak, spacemouse, stream, suite};

#[test]
fn a_simulated_device_passes_the_suite() {
    peace::in_real_time(|| {
        suite::check(&mut simulated::Simulated::new());
    })
}

#[test]
#[ignore = "scripts/test --long"]
fn every_fake_is_soaked() {
    peace::in_real_time(|| {
        // One after the other: what a servo's thread allocates is counted for the whole process.
        let mut fakes: Vec<Box<dyn rig::Rig>> = vec![
            Box::new(simulated::Simulated::new()),
            Box::new(native::Native::omni()),
            Box::new(native::Native::omega()),
            Box::new(haply::Haply::plug_in("values")),
            Box::new(haply::Haply::plug_in("vector")),
            Box::new(polhem::HidRig::new()),
            Box::new(open_handle::Rigged::new()),
            Box::new(spacemouse::Rigged::new(false)),
            Box::new(stream::Stream::plug_in()),
        ];
        #[cfg(unix)]
        fakes.push(Box::new(crate::polhem_serial::SerialRig::new()));
        fakes.iter_mut().for_each(|fake| soak::soak(fake.as_mut()));
    })
}
