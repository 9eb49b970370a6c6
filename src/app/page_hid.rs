//! HID devices in a lesson's worker.
//!
//! Takes the reports that the browser passes on (`page/hid.js` in the crate `web`). Gives them to the drivers, and to the browser
//! what the drivers send: one report at a time for each device, so that none waits in the browser.

use crate::platform;
use js_sys::{Array, Function, Object, Reflect, Uint8Array};
use std::cell::RefCell;
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
    /// The reason why the browser opened no device last.
    static REFUSAL: RefCell<Option<String>> = const { RefCell::new(None) };
    /// The browser's side.
    static SENDER: RefCell<Option<ReportSender>> = const { RefCell::new(None) };
}

/// Functions of the browser's side.
struct ReportSender {
    is_idle: Function,
    send: Function,
}

/// Opens the devices of a driver that the user has allowed, now and whenever one is plugged in or allowed. `run` is called after
/// reports have come. Nothing happens for a name that no driver has.
pub fn open_allowed(device_name: &str, run: fn()) {
    let Ok(NamedDevice { driver, .. }) = NamedDevice::parse(device_name) else { return };
    let connected = Closure::<dyn FnMut(u32, u16, u16, u16, u16, String)>::new(
        |number: u32, vendor, product, usage_page, usage, title: String| {
            let path = CString::new(number.to_string()).unwrap_or_default();
            let (title, serial) = (title.trim().to_string(), String::new());
            let info = HidDeviceInfo { vendor, product, usage: (usage_page, usage), title, serial, path };
            REFUSAL.set(None);
            DEVICES.with_borrow_mut(|devices| devices.insert(number, ForwardedDevice::connect(info)));
        },
    );
    let received = Closure::<dyn FnMut(u32, u8, Uint8Array)>::new(|number: u32, id: u8, report: Uint8Array| {
        DEVICES.with_borrow(|devices| {
            if let Some(device) = devices.get(&number) {
                device.deliver(id, &report.to_vec());
            }
        });
    });
    let run = Closure::<dyn FnMut()>::new(run);
    let gone = Closure::<dyn FnMut(u32)>::new(|number: u32| {
        DEVICES.with_borrow_mut(|devices| devices.remove(&number));
    });
    let refused = Closure::<dyn FnMut(String)>::new(|why: String| REFUSAL.set(Some(why)));
    let idle = Closure::<dyn FnMut()>::new(send_outgoing);
    let callbacks = Object::new();
    let named: [(&str, &JsValue); 6] = [
        ("connected", connected.as_ref()),
        ("received", received.as_ref()),
        ("run", run.as_ref()),
        ("gone", gone.as_ref()),
        ("refused", refused.as_ref()),
        ("idle", idle.as_ref()),
    ];
    for (name, callback) in named {
        // An empty object takes any property.
        let _ = Reflect::set(&callbacks, &name.into(), callback);
    }
    let given = Array::of2(&platform::hid_kinds_js(driver.hid_kinds()), &callbacks);
    SENDER.set(platform::call_hid("openAllowed", &given).and_then(|side| {
        let function = |name: &str| Reflect::get(&side, &name.into()).ok()?.dyn_into::<Function>().ok();
        Some(ReportSender { is_idle: function("isIdle")?, send: function("send")? })
    }));
    // They live as long as the worker.
    connected.forget();
    received.forget();
    run.forget();
    gone.forget();
    refused.forget();
    idle.forget();
}

/// The reason why the browser opened no device last, in its own words.
pub fn refusal() -> Option<String> {
    REFUSAL.with_borrow(Clone::clone)
}

/// Sends what the drivers have written to devices that have taken the report before it.
pub fn send_outgoing() {
    SENDER.with_borrow(|sender| {
        let Some(ReportSender { is_idle, send }) = sender else { return };
        DEVICES.with_borrow(|devices| {
            for (number, device) in devices {
                let number = JsValue::from(*number);
                if is_idle.call1(&JsValue::NULL, &number).is_ok_and(|is_idle| is_idle.is_truthy()) {
                    device.send_next(|id, bytes| {
                        // A report that cannot be sent is noticed by the device's silence.
                        let _ = send.call3(&JsValue::NULL, &number, &id.into(), &Uint8Array::from(bytes));
                    });
                }
            }
        });
    });
}
