//! A libHD that behaves as the vendor's does, with a physical hand instead of a device: built as a shared library by the
//! tests and opened by the driver like the real one.
//!
//! Its servo turns once a millisecond: callbacks, then the hand for one step under the force that the last frame left.
//! `stub_*` are for the test: they connect the hand and make the device misbehave.

use std::ffi::{c_char, c_ulong, c_void};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

/// State of the physical model after a force and torque, N and mN·m: transform by columns in HDAPI's space, mm, and
/// buttons.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Sample {
    transform: [f64; 16],
    buttons: u32,
}

type Hand = extern "C" fn(*mut c_void, *const f64, *mut Sample);
type Callback = extern "system" fn(*mut c_void) -> u32;

#[repr(C)]
pub struct ErrorInfo {
    code: u32,
    internal: i32,
    handle: u32,
}

struct Device {
    handle: u32,
    next_handle: u32,
    in_frame: bool,
    framed_this_tick: bool,
    /// Set in the frame that is open; kept until its end, and rendered until the next is.
    pending: [f64; 6],
    rendered: [f64; 6],
    force_output: bool,
    errors: Vec<u32>,
    sample: Sample,
    scheduled: Vec<(c_ulong, Callback, usize)>,
    next_schedule: c_ulong,
    is_running: bool,
    /// 0: none; else the code of an error that every frame raises.
    fault: u32,
    is_unplugged: bool,
    is_late: bool,
    is_garbage: bool,
    garbage_handle: bool,
    docked: bool,
    calibration: u32,
    style: i32,
    updates: u32,
    output_dof: i32,
    model: &'static [u8],
}

static DEVICE: Mutex<Device> = Mutex::new(Device {
    handle: INVALID,
    next_handle: 0,
    in_frame: false,
    framed_this_tick: false,
    pending: [0.0; 6],
    rendered: [0.0; 6],
    force_output: false,
    errors: Vec::new(),
    sample: Sample { transform: [0.0; 16], buttons: 0 },
    scheduled: Vec::new(),
    next_schedule: 1,
    is_running: false,
    fault: 0,
    is_unplugged: false,
    is_late: false,
    is_garbage: false,
    garbage_handle: false,
    docked: false,
    calibration: CALIBRATION_OK,
    style: 2,
    updates: 0,
    output_dof: 3,
    model: b"PHANTOM Omni\0",
});

static SERVO: Mutex<Option<JoinHandle<()>>> = Mutex::new(None);
static LIVES: AtomicBool = AtomicBool::new(false);

/// Held while callbacks run.
static TURNING: Mutex<()> = Mutex::new(());

const INVALID: u32 = 0xFFFF_FFFF;
const CALIBRATION_OK: u32 = 0x5000;
const NEEDS_UPDATE: u32 = 0x5001;
const NEEDS_MANUAL_INPUT: u32 = 0x5002;
const FORCE_OUTPUT: u32 = 0x4000;
const MAX_FORCE: f64 = 3.3;

/// The middle of this box is not the origin, as it is not on real arms.
const WORKSPACE: [f64; 6] = [-80.0, -40.0, -30.0, 80.0, 80.0, 40.0];

fn device() -> std::sync::MutexGuard<'static, Device> {
    DEVICE.lock().unwrap_or_else(|e| e.into_inner())
}

impl Device {
    fn raise(&mut self, code: u32) {
        self.errors.push(code);
    }

    fn answers(&mut self) -> bool {
        if self.is_unplugged {
            self.raise(0x0302);
        }
        !self.is_unplugged
    }
}

/// The servo: lives as long as a hand is connected, as the device does.
#[unsafe(no_mangle)]
pub extern "C" fn stub_connect(hand: Hand, context: *mut c_void) {
    LIVES.store(true, Ordering::Release);
    let context = context as usize;
    let servo = std::thread::spawn(move || {
        while LIVES.load(Ordering::Acquire) {
            let late = device().is_late;
            std::thread::sleep(Duration::from_millis(if late { 50 } else { 1 }));
            turn_callbacks();
            let told = {
                let d = device();
                let renders = d.is_running && d.force_output && !d.docked && !d.is_unplugged && d.fault == 0;
                if renders { d.rendered } else { [0.0; 6] }
            };
            let mut sample = Sample { transform: [0.0; 16], buttons: 0 };
            hand(context as *mut c_void, told.as_ptr(), &mut sample);
            let mut d = device();
            if d.is_garbage {
                sample.transform = [f64::NAN; 16];
            }
            d.sample = sample;
        }
    });
    *SERVO.lock().unwrap() = Some(servo);
}

fn turn_callbacks() {
    let _turning = TURNING.lock().unwrap_or_else(|e| e.into_inner());
    let scheduled = {
        let mut d = device();
        d.framed_this_tick = false;
        if d.is_running { d.scheduled.clone() } else { Vec::new() }
    };
    for (id, callback, context) in scheduled {
        if callback(context as *mut c_void) == 0 {
            device().scheduled.retain(|(other, _, _)| *other != id);
        }
        let mut d = device();
        if d.in_frame {
            d.in_frame = false;
            d.raise(0x0402);
        }
    }
}

#[unsafe(no_mangle)]
pub extern "C" fn stub_disconnect() {
    LIVES.store(false, Ordering::Release);
    if let Some(servo) = SERVO.lock().unwrap().take() {
        let _ = servo.join();
    }
}

/// Every frame raises this error: 0x02xx cut the force, others fail the frame. 0: none.
#[unsafe(no_mangle)]
pub extern "C" fn stub_fault(code: u32) {
    device().fault = code;
}

#[unsafe(no_mangle)]
pub extern "C" fn stub_unplug(is_unplugged: bool) {
    device().is_unplugged = is_unplugged;
}

#[unsafe(no_mangle)]
pub extern "C" fn stub_late(is_late: bool) {
    device().is_late = is_late;
}

#[unsafe(no_mangle)]
pub extern "C" fn stub_garbage(is_garbage: bool) {
    device().is_garbage = is_garbage;
}

#[unsafe(no_mangle)]
pub extern "C" fn stub_garbage_handle(gives: bool) {
    device().garbage_handle = gives;
}

#[unsafe(no_mangle)]
pub extern "C" fn stub_dock(docked: bool) {
    device().docked = docked;
}

/// The style mask, and whether the arm has lost its place.
#[unsafe(no_mangle)]
pub extern "C" fn stub_calibration(style: i32, is_lost: bool) {
    let mut d = device();
    d.style = style;
    d.calibration = if is_lost { NEEDS_UPDATE } else { CALIBRATION_OK };
}

#[unsafe(no_mangle)]
pub extern "C" fn stub_six_axes() {
    let mut d = device();
    d.output_dof = 6;
    d.model = b"PHANTOM Premium 1.5 6DOF\0";
    d.style = 1;
}

#[unsafe(no_mangle)]
pub extern "C" fn stub_is_force_output_on() -> bool {
    device().force_output
}

#[unsafe(no_mangle)]
pub extern "C" fn stub_updates() -> u32 {
    device().updates
}

#[unsafe(no_mangle)]
pub extern "system" fn hdInitDevice(name: *const c_char) -> u32 {
    let mut d = device();
    if d.garbage_handle {
        return 0x7f3a_1c40;
    }
    if !d.answers() {
        return INVALID;
    }
    if !name.is_null() {
        d.raise(0x0303);
        return INVALID;
    }
    if d.handle != INVALID {
        d.raise(0x0301);
        return INVALID;
    }
    d.handle = d.next_handle;
    d.next_handle += 1;
    d.force_output = false;
    d.rendered = [0.0; 6];
    d.pending = [0.0; 6];
    d.handle
}

#[unsafe(no_mangle)]
pub extern "system" fn hdDisableDevice(handle: u32) {
    let mut d = device();
    if d.handle != handle {
        return d.raise(0x0104);
    }
    d.handle = INVALID;
    d.rendered = [0.0; 6];
    d.force_output = false;
}

#[unsafe(no_mangle)]
pub extern "system" fn hdBeginFrame(handle: u32) {
    let mut d = device();
    if d.handle != handle {
        return d.raise(0x0104);
    }
    if d.in_frame || (d.framed_this_tick && d.is_running) {
        return d.raise(0x0400);
    }
    if !d.answers() {
        return;
    }
    d.in_frame = true;
    d.framed_this_tick = true;
}

#[unsafe(no_mangle)]
pub extern "system" fn hdEndFrame(handle: u32) {
    let mut d = device();
    if d.handle != handle || !d.in_frame {
        return d.raise(0x0401);
    }
    d.in_frame = false;
    let length = d.pending[..3].iter().map(|f| f * f).sum::<f64>().sqrt();
    if length > MAX_FORCE && d.output_dof == 3 {
        d.raise(0x0201);
        d.pending = [0.0; 6];
    }
    d.rendered = d.pending;
    let fault = d.fault;
    if fault != 0 {
        // The root first, then what follows from it: whoever pops gets the newest first.
        d.raise(fault);
        if fault & 0xff00 == 0x0200 {
            d.raise(0x0204);
            d.force_output = false;
        }
    }
}

#[unsafe(no_mangle)]
pub extern "system" fn hdGetError() -> ErrorInfo {
    let mut d = device();
    let code = d.errors.pop().unwrap_or(0);
    let internal = if code == 0 { 0 } else { -17 };
    ErrorInfo { code, internal, handle: d.handle }
}

#[unsafe(no_mangle)]
pub extern "system" fn hdGetErrorString(code: u32) -> *const c_char {
    let text: &[u8] = match code {
        0x0302 => b"Communication error\0",
        0x0301 => b"Device already initiated\0",
        _ => b"Error\0",
    };
    text.as_ptr().cast()
}

#[unsafe(no_mangle)]
pub extern "system" fn hdEnable(what: u32) {
    let mut d = device();
    match what {
        FORCE_OUTPUT => d.force_output = true,
        _ => d.raise(0x0100),
    }
}

#[unsafe(no_mangle)]
pub extern "system" fn hdDisable(what: u32) {
    let mut d = device();
    match what {
        FORCE_OUTPUT => d.force_output = false,
        _ => d.raise(0x0100),
    }
}

/// Type of the getter of each parameter; any other getter is wrong.
#[derive(PartialEq)]
enum Kind {
    Boolean,
    Integer,
    Double,
}

impl Device {
    /// True if a parameter may be read with this getter now.
    fn gives(&mut self, what: u32, kind: Kind) -> bool {
        let (right, needs_frame) = match what {
            0x2000 => (Kind::Integer, true),
            0x2002 => (Kind::Boolean, true),
            0x2050..=0x2052 => (Kind::Double, true),
            0x2551 | 0x2602..=0x2604 => (Kind::Double, false),
            0x2553..=0x2555 => (Kind::Integer, false),
            _ => {
                self.raise(0x0100);
                return false;
            }
        };
        if right != kind {
            self.raise(0x0103);
            return false;
        }
        if needs_frame && !self.in_frame {
            self.raise(0x0402);
            return false;
        }
        true
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "system" fn hdGetBooleanv(what: u32, out: *mut u8) {
    let mut d = device();
    if d.gives(what, Kind::Boolean) {
        // One byte; 0 means that the stylus is in.
        unsafe { *out = u8::from(!d.docked) };
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "system" fn hdGetIntegerv(what: u32, out: *mut i32) {
    let mut d = device();
    if d.gives(what, Kind::Integer) {
        let value = match what {
            0x2000 => d.sample.buttons as i32,
            0x2553 => 6,
            0x2554 => d.output_dof,
            _ => d.style,
        };
        unsafe { *out = value };
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "system" fn hdGetDoublev(what: u32, out: *mut f64) {
    let mut d = device();
    if !d.gives(what, Kind::Double) {
        return;
    }
    let values: &[f64] = match what {
        0x2050 => &d.sample.transform[12..15],
        0x2051 => &[0.0; 3],
        0x2052 => &d.sample.transform,
        0x2551 => &WORKSPACE,
        0x2602 => &[1.0],
        0x2603 => &[if d.output_dof == 6 { 8.5 } else { MAX_FORCE }],
        _ => &[0.88],
    };
    unsafe { std::ptr::copy_nonoverlapping(values.as_ptr(), out, values.len()) };
}

#[unsafe(no_mangle)]
pub unsafe extern "system" fn hdSetDoublev(what: u32, values: *const f64) {
    let mut d = device();
    let at = match what {
        0x2700 => 0,
        0x2701 if d.output_dof == 6 => 3,
        _ => return d.raise(0x0100),
    };
    if !d.in_frame {
        return d.raise(0x0402);
    }
    // Replaces what was set before in this frame.
    let values = unsafe { *values.cast::<[f64; 3]>() };
    d.pending[at..at + 3].copy_from_slice(&values);
}

#[unsafe(no_mangle)]
pub extern "system" fn hdGetString(what: u32) -> *const c_char {
    let mut d = device();
    let text: &[u8] = match what {
        0x2501 => d.model,
        0x2504 => b"STUB-0001\0",
        _ => {
            d.raise(0x0100);
            return std::ptr::null();
        }
    };
    text.as_ptr().cast()
}

#[unsafe(no_mangle)]
pub extern "system" fn hdCheckCalibration() -> u32 {
    let d = device();
    match d.calibration {
        NEEDS_UPDATE if d.style == 4 && !d.docked => NEEDS_MANUAL_INPUT,
        known => known,
    }
}

#[unsafe(no_mangle)]
pub extern "system" fn hdUpdateCalibration(style: u32) {
    let mut d = device();
    if d.style as u32 & style == 0 {
        return d.raise(0x0101);
    }
    // Encoders are reset before the servo turns; an inkwell only counts with the stylus in it.
    if (style == 1 && d.is_running) || (style == 4 && !d.docked) {
        return d.raise(0x0102);
    }
    d.updates += 1;
    d.calibration = CALIBRATION_OK;
}

#[unsafe(no_mangle)]
pub extern "system" fn hdStartScheduler() {
    device().is_running = true;
}

/// Returns when no callback runs any more.
#[unsafe(no_mangle)]
pub extern "system" fn hdStopScheduler() {
    let mut d = device();
    d.is_running = false;
    d.rendered = [0.0; 6];
    drop(d);
    let _waited = TURNING.lock().unwrap_or_else(|e| e.into_inner());
}

#[unsafe(no_mangle)]
pub extern "system" fn hdSetSchedulerRate(rate: c_ulong) {
    if !matches!(rate, 500 | 1000) {
        device().raise(0x0101);
    }
}

#[unsafe(no_mangle)]
pub extern "system" fn hdScheduleAsynchronous(callback: Callback, context: *mut c_void, _priority: u16) -> c_ulong {
    let mut d = device();
    let id = d.next_schedule;
    d.next_schedule += 1;
    d.scheduled.push((id, callback, context as usize));
    id
}

#[unsafe(no_mangle)]
pub extern "system" fn hdUnschedule(id: c_ulong) {
    let mut d = device();
    let before = d.scheduled.len();
    d.scheduled.retain(|(other, _, _)| *other != id);
    if d.scheduled.len() == before {
        d.raise(0x0101);
    }
}
