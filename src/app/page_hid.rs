//! HID devices in a lesson's worker.
//!
//! Takes the reports that the browser passes on (`page/hid.js` in the crate `web`). Gives them to the drivers, and to the browser
//! what the drivers send.

use crate::platform;
use js_sys::{Array, Function, Uint8Array};
use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;
use std::ffi::CString;
use typodont_devices::NamedDevice;
use typodont_devices::hid::HidDeviceInfo;
use typodont_devices::hid::forwarded::ForwardedDevice;
use wasm_bindgen::prelude::Closure;
use wasm_bindgen::{JsCast, JsValue};

thread_local! {
    /// Connected devices by the numbers that the browser's side gives them.
    static DEVICES: RefCell<BTreeMap<u32, ForwardedDevice>> = const { RefCell::new(BTreeMap::new()) };
    /// Sends a report: number of the device, id, bytes.
    static SEND: Cell<Option<Function>> = const { Cell::new(None) };
}

/// Opens the devices of a driver that the user has allowed, now and whenever one is plugged in. `on_report` is called after each
/// report.
pub fn serve(device_name: &str, on_report: fn()) {
    let Ok(NamedDevice { driver, .. }) = NamedDevice::parse(device_name) else { return };
    let connected = Closure::<dyn FnMut(u32, u16, u16, u16, u16, String)>::new(
        |number: u32, vendor, product, usage_page, usage, title| {
            let path = CString::new(number.to_string()).unwrap_or_default();
            let info =
                HidDeviceInfo { vendor, product, usage: (usage_page, usage), title, serial: String::new(), path };
            DEVICES.with_borrow_mut(|devices| devices.insert(number, ForwardedDevice::connect(info)));
        },
    );
    let received = Closure::<dyn FnMut(u32, u8, Uint8Array)>::new(move |number: u32, id: u8, report: Uint8Array| {
        DEVICES.with_borrow(|devices| {
            if let Some(device) = devices.get(&number) {
                device.deliver(id, &report.to_vec());
            }
        });
        on_report();
    });
    let gone = Closure::<dyn FnMut(u32)>::new(|number: u32| {
        DEVICES.with_borrow_mut(|devices| devices.remove(&number));
    });
    let kinds = platform::hid_kinds_js(driver.hid_kinds());
    let callbacks = [connected.as_ref(), received.as_ref(), gone.as_ref()].map(JsValue::clone);
    let given: Array = std::iter::once(kinds).chain(callbacks).collect();
    SEND.set(platform::call_hid("serve", &given).and_then(|send| send.dyn_into().ok()));
    // They live as long as the worker.
    connected.forget();
    received.forget();
    gone.forget();
}

/// Sends what the drivers have written.
pub fn send_outgoing() {
    let Some(send) = SEND.take() else { return };
    DEVICES.with_borrow(|devices| {
        for (number, device) in devices {
            device.send_outgoing(|id, bytes| {
                // A report that cannot be sent is noticed by the device's silence.
                let _ = send.call3(&JsValue::NULL, &(*number).into(), &id.into(), &Uint8Array::from(bytes));
            });
        }
    });
    SEND.set(Some(send));
}
