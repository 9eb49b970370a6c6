//! An open handle as a browser's page has it: no thread of its own, and reports that come and go with the browser's timer.

use crate::open_handle::{Rigged, firmware};
use crate::pipe::cable;
use crate::rig::{Abilities, Misbehaviour, Rig, SharedHand};
use crate::suite;
use std::ffi::CString;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Weak};
use std::time::{Duration, Instant};
use typodont_core::device::{Device, DeviceError, DeviceSpec, DeviceState, PageForce, Reading, Wrench};
use typodont_devices::DirectDevice;
use typodont_devices::hid::forwarded::{self, ForwardedDevice, ForwardedTransport};
use typodont_devices::hid::{HidDeviceInfo, Transport};
use typodont_devices::open_handle::{HID_MATCH, OpenHandleProtocol};

/// Interval at which the browser passes reports on, and its worker answers them.
const TIMER: Duration = Duration::from_millis(4);

/// Number of the next device.
static NUMBER: AtomicU32 = AtomicU32::new(0);

/// A handle whose reports pass through a page.
struct PageRig(Rigged);

/// The device, and what tells the browser's side that it is still used.
struct PageDevice(
    DirectDevice<OpenHandleProtocol<ForwardedTransport>>,
    #[expect(dead_code, reason = "counted")] Arc<()>,
);

impl Device for PageDevice {
    fn spec(&self) -> &DeviceSpec {
        self.0.spec()
    }

    fn exchange(&mut self, output: &Wrench) -> Result<Reading, DeviceError> {
        self.0.exchange(output)
    }

    fn renders_force(&self) -> bool {
        self.0.renders_force()
    }

    fn state(&self) -> DeviceState {
        self.0.state()
    }
}

/// Passes reports on until one of both sides has ended.
fn pass_on(mut handle: impl Transport, page: &ForwardedDevice, use_: &Weak<()>) {
    let mut report = [0; 64];
    while use_.strong_count() > 0 {
        loop {
            match handle.read(&mut report, Duration::ZERO) {
                Ok(0) => break,
                Ok(length) => page.deliver(0, &report[..length]),
                Err(_) => return,
            }
        }
        page.send_next(|id, bytes| _ = handle.write(&[&[id], bytes].concat()));
        std::thread::sleep(TIMER);
    }
}

impl Rig for PageRig {
    fn name(&self) -> &'static str {
        "open-handle in a page"
    }

    fn open(&mut self) -> Result<Box<dyn Device + Send>, String> {
        let (browser, device) = cable();
        let (hand, faults) = (self.0.hand(), self.0.faults.clone());
        crate::rig::spawn_device(move || firmware(device, &hand, &faults));
        let info = HidDeviceInfo {
            vendor: HID_MATCH.vendor,
            product: HID_MATCH.products[0],
            usage: HID_MATCH.usage.unwrap(),
            title: "School handle".into(),
            serial: String::new(),
            path: CString::new(NUMBER.fetch_add(1, Ordering::Relaxed).to_string()).unwrap(),
        };
        let page = ForwardedDevice::connect(info.clone());
        let used = Arc::new(());
        let uses = Arc::downgrade(&used);
        std::thread::spawn(move || pass_on(browser, &page, &uses));
        let begun = Instant::now();
        loop {
            let transport = forwarded::open(&info).map_err(|error| error.to_string())?;
            match OpenHandleProtocol::handshake(transport) {
                Ok(protocol) => return Ok(Box::new(PageDevice(DirectDevice::new(protocol), used))),
                Err(error) if begun.elapsed() > Duration::from_secs(20) => return Err(error.to_string()),
                Err(_) => std::thread::sleep(Duration::from_millis(100)),
            }
        }
    }

    fn hand(&self) -> SharedHand {
        self.0.hand()
    }

    fn abilities(&self) -> Abilities {
        self.0.abilities()
    }

    fn force_share(&self) -> f32 {
        1.0 / 8.0
    }

    fn misbehave(&mut self, how: Misbehaviour) {
        self.0.misbehave(how);
    }

    fn recover(&mut self) {
        self.0.recover();
    }
}

#[test]
fn an_open_handle_passes_the_suite_in_a_page() {
    crate::support::peace::in_real_time(|| {
        // Aim: with reports that are some milliseconds old, an eighth of the force neither buzzes nor cuts less, and every failure
        // releases the hand.
        let mut rig = PageRig(Rigged::new());
        let device = rig.open().unwrap();
        assert_eq!((device.spec().page_force, device.spec().max_stiffness), (Some(PageForce::Reduced), 1.5));
        drop(device);
        suite::check(&mut rig);
    })
}
