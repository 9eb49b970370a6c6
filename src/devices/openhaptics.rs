//! 3D Systems Touch and SensAble PHANTOM devices, through the HDAPI of OpenHaptics.
//!
//! Takes forces and gives reports like every [`Protocol`]. HDAPI owns the servo thread: it calls [`servo_callback`]
//! every millisecond, which exchanges data with the protocol's thread through two slots in which the newest value
//! wins. Never unloads the library, never locks or allocates in the callback, never lets a panic cross into C. One
//! device at a time: HDAPI has a single scheduler.
//!
//! Sources: the headers and manuals of OpenHaptics 3.0 to 3.5, and the use of HDAPI in CHAI3D, HAPI and iMSTK where
//! the manuals contradict themselves (torque, stiffness, inkwell).

// This file calls C; the comment at each block states what it relies on.
#![allow(unsafe_code)]

use crate::force_slot::ForceSlot;
use crate::pose_rejects::{PoseRejects, plausible};
use crate::{DeviceReport, Driver, FoundDevice, OpenError, Protocol, Relay, shared_library};
use libloading::Library;
use std::ffi::{CStr, OsStr, c_char, c_ulong, c_void};
use std::mem::ManuallyDrop;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering};
use std::thread::{self, Thread};
use std::time::{Duration, Instant};
use typodont_core::device::{Device, DeviceError, DeviceSpec, DeviceState, Pacing, Reading, UPRIGHT, Wrench};
use typodont_core::frame::{Pose, Vec3, nearest_rotation};
use typodont_core::mailbox::SeqLock;

/// Driver of devices with HDAPI.
pub struct OpenHapticsDriver;

impl Driver for OpenHapticsDriver {
    fn name(&self) -> &'static str {
        "openhaptics"
    }

    fn description(&self) -> &'static str {
        "3D Systems Touch, SensAble PHANTOM Omni, Desktop, Premium; the argument is the path of libHD"
    }

    fn discover(&self) -> Result<Vec<FoundDevice>, OpenError> {
        let hd = Hd::find(None)?;
        let handle = hd.init()?;
        let (model, serial) = (hd.text(DEVICE_MODEL_TYPE), hd.text(DEVICE_SERIAL_NUMBER));
        (hd.disable_device)(handle);
        hd.drain_errors();
        Ok(vec![FoundDevice { title: format!("{model} {serial}").trim().to_string(), argument: String::new() }])
    }

    fn open(&self, argument: Option<&str>) -> Result<Box<dyn Device + Send>, OpenError> {
        let hd = Hd::find(argument)?;
        let handle = hd.init()?;
        Ok(Box::new(Relay::start(OpenHapticsProtocol::new(hd, handle))))
    }
}

/// File names of the library; error messages name the first one.
const LIBRARY_NAMES: &[&str] = if cfg!(windows) {
    &["HD.dll"]
} else if cfg!(target_os = "macos") {
    &["libHD.dylib", "/Library/Frameworks/OpenHaptics.framework/OpenHaptics"]
} else {
    &["libHD.so", "libHD.so.3.4", "libHD.so.3.0"]
};

const INSTALL: &str = if cfg!(windows) {
    "install the vendor's device driver and OpenHaptics (3D Systems support pages), or name the library: --device \
     openhaptics:C:\\path\\to\\HD.dll"
} else {
    "install the vendor's device driver and OpenHaptics (3D Systems support pages), or name the library: --device \
     openhaptics:/path/to/libHD.so"
};

type Callback = extern "system" fn(*mut c_void) -> u32;

/// The functions of HDAPI used here.
///
/// Functions that only take and return numbers are declared safe: HDAPI answers an invalid number with an error,
/// never with invalid memory accesses. Each of the others is called in one place.
#[derive(Clone, Copy)]
struct Hd {
    init_device: unsafe extern "system" fn(*const c_char) -> u32,
    disable_device: extern "system" fn(u32),
    begin_frame: extern "system" fn(u32),
    end_frame: extern "system" fn(u32),
    get_error: extern "system" fn() -> ErrorInfo,
    get_error_string: extern "system" fn(u32) -> *const c_char,
    enable: extern "system" fn(u32),
    disable: extern "system" fn(u32),
    get_booleanv: unsafe extern "system" fn(u32, *mut u8),
    get_integerv: unsafe extern "system" fn(u32, *mut i32),
    get_doublev: unsafe extern "system" fn(u32, *mut f64),
    set_doublev: unsafe extern "system" fn(u32, *const f64),
    get_string: extern "system" fn(u32) -> *const c_char,
    check_calibration: extern "system" fn() -> u32,
    update_calibration: extern "system" fn(u32),
    start_scheduler: extern "system" fn(),
    stop_scheduler: extern "system" fn(),
    set_scheduler_rate: extern "system" fn(c_ulong),
    schedule_asynchronous: unsafe extern "system" fn(Callback, *mut c_void, u16) -> c_ulong,
    unschedule: extern "system" fn(c_ulong),
}

/// `HDErrorInfo`, returned by value.
#[repr(C)]
#[derive(Clone, Copy)]
struct ErrorInfo {
    code: u32,
    _internal: i32,
    _handle: u32,
}

const CURRENT_BUTTONS: u32 = 0x2000;
const CURRENT_INKWELL_SWITCH: u32 = 0x2002;
/// 16 doubles by columns, mm.
const CURRENT_TRANSFORM: u32 = 0x2052;
const DEVICE_MODEL_TYPE: u32 = 0x2501;
const DEVICE_SERIAL_NUMBER: u32 = 0x2504;
/// Minimum x, y, z, then maximum x, y, z, mm.
const USABLE_WORKSPACE_DIMENSIONS: u32 = 0x2551;
const INPUT_DOF: u32 = 0x2553;
const OUTPUT_DOF: u32 = 0x2554;
const CALIBRATION_STYLE: u32 = 0x2555;
/// Interpreted as N/mm, as HAPI and the vendor's examples do; the manual speaks of 0 to 1.
const NOMINAL_MAX_STIFFNESS: u32 = 0x2602;
const NOMINAL_MAX_FORCE: u32 = 0x2603;
const NOMINAL_MAX_CONTINUOUS_FORCE: u32 = 0x2604;
const CURRENT_FORCE: u32 = 0x2700;
/// mN·m, which equals N·mm: CHAI3D and HAPI agree on it where the manual does not.
const CURRENT_TORQUE: u32 = 0x2701;
const FORCE_OUTPUT: u32 = 0x4000;

const CALIBRATION_OK: u32 = 0x5000;
const CALIBRATION_NEEDS_UPDATE: u32 = 0x5001;
const STYLE_ENCODER_RESET: u32 = 1;
const STYLE_AUTO: u32 = 2;
const STYLE_INKWELL: u32 = 4;

const SUCCESS: u32 = 0;
const DEVICE_ALREADY_INITIATED: u32 = 0x0301;

const CALLBACK_DONE: u32 = 0;
const CALLBACK_CONTINUE: u32 = 1;
const MAX_PRIORITY: u16 = 65535;

/// Maximum valid handle: after a failed `hdInitDevice` the next call may return a garbage handle without an error
/// (HAPI).
const HANDLE_MAX: u32 = 1024;

/// Errors fetched at a time: a library that never reports the end of its errors must not block the servo.
const ERRORS_MAX: usize = 64;

/// Errors since the last fetch. Of each kind the oldest, since the others follow from it.
#[derive(Clone, Copy, Default)]
struct PendingErrors {
    /// 0x02xx: the force was cut for a moment.
    force: u32,
    /// 0x03xx and 0x06xx: the device or its licence was lost.
    device: u32,
    /// Other errors: calls that were refused.
    refused: u32,
}

impl Hd {
    fn find(argument: Option<&str>) -> Result<Hd, OpenError> {
        shared_library::load(argument, LIBRARY_NAMES.iter().map(PathBuf::from).collect(), INSTALL, Hd::load)
    }

    /// Loads the library and never unloads it: after unloading and loading it again, its driver fails (CHAI3D).
    fn load(path: &OsStr) -> Result<Hd, libloading::Error> {
        // SAFETY: whoever names or installs the vendor's library wants its start-up code to run.
        let library = ManuallyDrop::new(unsafe { open_with_global_symbols(path)? });
        // SAFETY: names and signatures are those of the vendor's header (HD/hdDevice.h, HD/hdScheduler.h), and the
        // library is never unloaded, so the pointers stay valid.
        unsafe {
            Ok(Hd {
                init_device: *library.get("hdInitDevice")?,
                disable_device: *library.get("hdDisableDevice")?,
                begin_frame: *library.get("hdBeginFrame")?,
                end_frame: *library.get("hdEndFrame")?,
                get_error: *library.get("hdGetError")?,
                get_error_string: *library.get("hdGetErrorString")?,
                enable: *library.get("hdEnable")?,
                disable: *library.get("hdDisable")?,
                get_booleanv: *library.get("hdGetBooleanv")?,
                get_integerv: *library.get("hdGetIntegerv")?,
                get_doublev: *library.get("hdGetDoublev")?,
                set_doublev: *library.get("hdSetDoublev")?,
                get_string: *library.get("hdGetString")?,
                check_calibration: *library.get("hdCheckCalibration")?,
                update_calibration: *library.get("hdUpdateCalibration")?,
                start_scheduler: *library.get("hdStartScheduler")?,
                stop_scheduler: *library.get("hdStopScheduler")?,
                set_scheduler_rate: *library.get("hdSetSchedulerRate")?,
                schedule_asynchronous: *library.get("hdScheduleAsynchronous")?,
                unschedule: *library.get("hdUnschedule")?,
            })
        }
    }

    /// Opens the default device. Opening a named one fails with the Linux drivers of 2022.
    fn init(&self) -> Result<u32, OpenError> {
        self.drain_errors();
        // SAFETY: a null name means the default device.
        let handle = unsafe { (self.init_device)(std::ptr::null()) };
        let code = (self.get_error)().code;
        self.drain_errors();
        if code == DEVICE_ALREADY_INITIATED {
            return Err(OpenError::new(
                "the device is already open",
                "close the other program or session that uses it",
            ));
        }
        if code != SUCCESS || handle > HANDLE_MAX {
            let reason = match code {
                SUCCESS => format!("no error, but the handle {handle:#x}"),
                _ => format!("{} (0x{code:04x})", owned_text(self.get_error_string)(code)),
            };
            return Err(OpenError::new(
                format!("OpenHaptics cannot open the default device: {reason}"),
                "plug the device in, switch it on, and name it Default Device in the vendor's setup program",
            ));
        }
        Ok(handle)
    }

    /// Fetches all errors; HDAPI returns the newest first.
    fn drain_errors(&self) -> PendingErrors {
        let mut errors = PendingErrors::default();
        for _ in 0..ERRORS_MAX {
            let code = (self.get_error)().code;
            match code {
                SUCCESS => break,
                0x0200..=0x02ff => errors.force = code,
                0x0300..=0x03ff | 0x0600..=0x06ff => errors.device = code,
                _ => errors.refused = code,
            }
        }
        errors
    }

    fn boolean(&self, what: u32) -> bool {
        let mut value = 0u8;
        // SAFETY: HDboolean is one byte, and every boolean requested here is a single one.
        unsafe { (self.get_booleanv)(what, &mut value) };
        value != 0
    }

    /// Returns 0 if the library refuses.
    fn integer(&self, what: u32) -> u32 {
        let mut values = [0i32; 16];
        // SAFETY: no parameter of HDAPI has more than 16 values.
        unsafe { (self.get_integerv)(what, values.as_mut_ptr()) };
        values[0].cast_unsigned()
    }

    /// Returns zeros if the library refuses.
    fn doubles(&self, what: u32) -> [f64; 16] {
        let mut values = [0.0; 16];
        // SAFETY: no parameter of HDAPI has more than 16 values.
        unsafe { (self.get_doublev)(what, values.as_mut_ptr()) };
        values
    }

    fn set(&self, what: u32, value: Vec3) {
        let values = value.to_array().map(f64::from);
        // SAFETY: the only parameters set here, force and torque, have three values.
        unsafe { (self.set_doublev)(what, values.as_ptr()) };
    }

    fn text(&self, what: u32) -> String {
        owned_text(self.get_string)(what)
    }
}

/// Wraps a function of the library that returns a C string into one that returns an owned [`String`].
fn owned_text(text: extern "system" fn(u32) -> *const c_char) -> impl Fn(u32) -> String {
    move |what| {
        let text = text(what);
        if text.is_null() {
            return String::new();
        }
        // SAFETY: HDAPI returns null or a string that ends with zero and lives as long as the library.
        unsafe { CStr::from_ptr(text) }.to_string_lossy().into_owned()
    }
}

/// Opens the library with its symbols visible to the libraries that it loads in turn, as its device driver expects
/// (CHAI3D).
///
/// # Safety
///
/// Runs the library's start-up code.
#[cfg(unix)]
unsafe fn open_with_global_symbols(path: &OsStr) -> Result<Library, libloading::Error> {
    use libloading::os::unix::{Library as UnixLibrary, RTLD_GLOBAL, RTLD_LAZY};
    // SAFETY: passed on to the caller.
    unsafe { UnixLibrary::open(Some(path), RTLD_LAZY | RTLD_GLOBAL) }.map(Library::from)
}

/// Opens the library.
///
/// # Safety
///
/// Runs the library's start-up code.
#[cfg(not(unix))]
unsafe fn open_with_global_symbols(path: &OsStr) -> Result<Library, libloading::Error> {
    // SAFETY: passed on to the caller.
    unsafe { Library::new(path) }
}

/// Data shared by the protocol's thread and HDAPI's servo thread. Leaked, some hundred bytes per opening: a late
/// callback must not access freed memory.
struct CallbackContext {
    hd: Hd,
    handle: u32,
    has_inkwell: bool,
    renders_torque: bool,
    /// Argument for `hdUpdateCalibration`; 0 for a device that supports no style of calibration.
    style: u32,
    force_slot: ForceSlot,
    report: SeqLock<REPORT_WORDS>,
    epoch: Instant,
    protocol_thread: OnceLock<Thread>,
    stop: AtomicBool,
    /// Frames without force since `stop`.
    stopped: AtomicU32,
    /// The callback panicked.
    failed: AtomicBool,
    // The following fields are written only by the callback.
    frames: AtomicU64,
    calibration: AtomicU32,
    /// The last 0x02xx error while the force is cut; 0 otherwise.
    cut: AtomicU32,
    /// Time of that error, µs since `epoch`.
    cut_at: AtomicU64,
    /// The first 0x03xx or 0x06xx error.
    lost: AtomicU32,
    /// Consecutive frames in which a call was refused; `refusal`: the last such error.
    refusals: AtomicU32,
    refusal: AtomicU32,
}

/// Words of a report: 12 floats of the transform by columns, buttons, docked, calibration, cut, lost, refusals.
const REPORT_WORDS: usize = 18;

/// Frames between two checks of the calibration: the manual's example checks about once a second.
const CALIBRATION_FRAMES: u64 = 1000;

/// Time for which forces stay off after the last error that cut them: long enough to settle, short enough not to
/// irritate.
const CUT_TIME: Duration = Duration::from_millis(500);

/// Callback of HDAPI, called every millisecond on its servo thread.
extern "system" fn servo_callback(context: *mut c_void) -> u32 {
    // SAFETY: the context that `start` passes is a leaked `CallbackContext`, all of whose fields may be shared.
    let shared = unsafe { &*context.cast::<CallbackContext>() };
    match catch_unwind(AssertUnwindSafe(|| shared.frame())) {
        Ok(()) => CALLBACK_CONTINUE,
        Err(_) => {
            shared.hd.set(CURRENT_FORCE, Vec3::ZERO);
            (shared.hd.end_frame)(shared.handle);
            shared.failed.store(true, Ordering::Release);
            CALLBACK_DONE
        }
    }
}

impl CallbackContext {
    /// Runs one frame, with a single pair of begin and end: a second pair in the same period would be refused.
    fn frame(&self) {
        let hd = &self.hd;
        (hd.begin_frame)(self.handle);
        let transform = hd.doubles(CURRENT_TRANSFORM);
        let buttons = hd.integer(CURRENT_BUTTONS);
        // The switch is closed while the stylus is out (HAPI), and its state can only be read as a boolean.
        let is_docked = self.has_inkwell && !hd.boolean(CURRENT_INKWELL_SWITCH);
        let calibration = self.calibrate(is_docked);
        let may_push = transform.iter().all(|x| x.is_finite()) && calibration == CALIBRATION_OK && !self.is_cut();
        let output = if may_push { self.latest_output() } else { Wrench::ZERO };
        hd.set(CURRENT_FORCE, output.force);
        if self.renders_torque {
            hd.set(CURRENT_TORQUE, output.torque);
        }
        (hd.end_frame)(self.handle);
        self.record_errors(hd.drain_errors());
        self.report.write(self.encode_report(&transform, buttons, is_docked));
        if self.stop.load(Ordering::Acquire) {
            self.stopped.fetch_add(1, Ordering::Release);
        }
        self.frames.fetch_add(1, Ordering::Relaxed);
        if let Some(wire) = self.protocol_thread.get() {
            wire.unpark();
        }
    }

    /// Checks the calibration periodically until it is complete; calibrates the device itself if no person is needed.
    fn calibrate(&self, is_docked: bool) -> u32 {
        let known = self.calibration.load(Ordering::Relaxed);
        if known == CALIBRATION_OK || !self.frames.load(Ordering::Relaxed).is_multiple_of(CALIBRATION_FRAMES) {
            return known;
        }
        let now = (self.hd.check_calibration)();
        let can_update = self.style == STYLE_AUTO || (self.style == STYLE_INKWELL && is_docked);
        if now == CALIBRATION_NEEDS_UPDATE && can_update {
            (self.hd.update_calibration)(self.style);
        }
        self.calibration.store(now, Ordering::Relaxed);
        now
    }

    /// Returns whether an error still keeps the force off. Afterwards switches force output on again.
    fn is_cut(&self) -> bool {
        if self.cut.load(Ordering::Relaxed) == 0 {
            return false;
        }
        let since = self.now_us().saturating_sub(self.cut_at.load(Ordering::Relaxed));
        if since < CUT_TIME.as_micros() as u64 {
            return true;
        }
        (self.hd.enable)(FORCE_OUTPUT);
        self.cut.store(0, Ordering::Relaxed);
        false
    }

    /// Returns the newest force, if it is recent enough to be rendered.
    fn latest_output(&self) -> Wrench {
        if self.stop.load(Ordering::Acquire) {
            return Wrench::ZERO;
        }
        self.force_slot.latest()
    }

    fn record_errors(&self, errors: PendingErrors) {
        let PendingErrors { force, device, refused } = errors;
        if force != 0 {
            self.cut.store(force, Ordering::Relaxed);
            self.cut_at.store(self.now_us(), Ordering::Relaxed);
        }
        if device != 0 && self.lost.load(Ordering::Relaxed) == 0 {
            self.lost.store(device, Ordering::Relaxed);
        }
        let refusals = if refused == 0 { 0 } else { self.refusals.load(Ordering::Relaxed).saturating_add(1) };
        self.refusals.store(refusals, Ordering::Relaxed);
        self.refusal.store(refused, Ordering::Relaxed);
    }

    fn encode_report(&self, transform: &[f64; 16], buttons: u32, is_docked: bool) -> [u32; REPORT_WORDS] {
        // The fourth row is 0, 0, 0, 1 and is dropped.
        let mut words = [0; REPORT_WORDS];
        for (column, to) in transform.chunks_exact(4).zip(words.chunks_exact_mut(3)) {
            to.iter_mut().zip(column).for_each(|(to, x)| *to = (*x as f32).to_bits());
        }
        words[12] = buttons;
        words[13] = u32::from(is_docked);
        words[14] = self.calibration.load(Ordering::Relaxed);
        words[15] = self.cut.load(Ordering::Relaxed);
        words[16] = self.lost.load(Ordering::Relaxed);
        words[17] = self.refusals.load(Ordering::Relaxed);
        words
    }

    fn now_us(&self) -> u64 {
        self.epoch.elapsed().as_micros() as u64
    }
}

/// The protocol of an HDAPI device.
struct OpenHapticsProtocol {
    spec: DeviceSpec,
    context: &'static CallbackContext,
    /// Middle of the usable workspace in HDAPI's space, mm: the origin of that space is only near it.
    middle: Vec3,
    senses_orientation: bool,
    stage: OpenHapticsStage,
    /// Count of the last report that was read.
    last_count: u64,
    /// The last reported state.
    state: DeviceState,
    /// Consecutive implausible reports.
    pose_rejects: PoseRejects,
}

enum OpenHapticsStage {
    Opened,
    /// Incremental encoders: they count from the position in which they are reset, so a person holds the arm in a
    /// known pose.
    EncoderReset {
        was_pressed: bool,
    },
    Running {
        schedule: c_ulong,
    },
}

/// Time for which one exchange waits for the next frame: several frames, so that a late one is not taken for silence.
const FRAME_TIMEOUT: Duration = Duration::from_millis(5);

/// Consecutive refused frames after which the library counts as broken.
const REFUSALS_MAX: u32 = 100;

/// Fraction of each force that is sent: rounding must not make it exceed the limit of the device.
const FORCE_SCALE: f32 = 0.999;

impl OpenHapticsProtocol {
    fn new(hd: Hd, handle: u32) -> OpenHapticsProtocol {
        let styles = hd.integer(CALIBRATION_STYLE);
        let style = [STYLE_AUTO, STYLE_INKWELL, STYLE_ENCODER_RESET].into_iter().find(|s| styles & s != 0);
        let Workspace { middle, half } = Workspace::query(&hd);
        let spec = spec(&hd, half);
        let senses_orientation = hd.integer(INPUT_DOF) >= 6;
        hd.drain_errors();
        let context = Box::leak(Box::new(CallbackContext {
            hd,
            handle,
            has_inkwell: styles & STYLE_INKWELL != 0,
            renders_torque: spec.max_torque > 0.0,
            style: style.unwrap_or(0),
            force_slot: ForceSlot::new(),
            report: SeqLock::new(),
            epoch: Instant::now(),
            protocol_thread: OnceLock::new(),
            stop: AtomicBool::new(false),
            stopped: AtomicU32::new(0),
            failed: AtomicBool::new(false),
            frames: AtomicU64::new(0),
            calibration: AtomicU32::new(CALIBRATION_NEEDS_UPDATE),
            cut: AtomicU32::new(0),
            cut_at: AtomicU64::new(0),
            lost: AtomicU32::new(0),
            refusals: AtomicU32::new(0),
            refusal: AtomicU32::new(0),
        }));
        let state = DeviceState::Homing { what: "starting its servo" };
        OpenHapticsProtocol {
            spec,
            context,
            middle,
            senses_orientation,
            stage: OpenHapticsStage::Opened,
            last_count: 0,
            state,
            pose_rejects: PoseRejects::default(),
        }
    }

    fn start(&mut self) -> Result<(), DeviceError> {
        let hd = &self.context.hd;
        self.context.protocol_thread.get_or_init(thread::current);
        // Some versions do not support every rate; where this call is refused, the rate is 1000 Hz anyway.
        (hd.set_scheduler_rate)(1000);
        hd.drain_errors();
        (hd.enable)(FORCE_OUTPUT);
        let context = std::ptr::from_ref(self.context).cast_mut().cast();
        // SAFETY: the callback has the signature that HDAPI requires, and its context is never freed.
        let schedule = unsafe { (hd.schedule_asynchronous)(servo_callback, context, MAX_PRIORITY) };
        (hd.start_scheduler)();
        self.stage = OpenHapticsStage::Running { schedule };
        let PendingErrors { force, device, refused } = hd.drain_errors();
        match device.max(refused) {
            SUCCESS => {
                self.context.record_errors(PendingErrors { force, ..PendingErrors::default() });
                Ok(())
            }
            code => Err(device_lost("its library did not start the servo; restart the program", code)),
        }
    }

    /// Waits for the user to confirm the neutral pose. Before the scheduler runs, frames may be read on any thread.
    fn await_encoder_reset(&mut self, was_pressed: bool) -> Result<Option<DeviceReport>, DeviceError> {
        let CallbackContext { hd, handle, .. } = self.context;
        (hd.begin_frame)(*handle);
        let is_pressed = hd.integer(CURRENT_BUTTONS) & 1 != 0;
        (hd.end_frame)(*handle);
        let errors = hd.drain_errors();
        if errors.device != 0 {
            return Err(device_lost(remedy(errors.device), errors.device));
        }
        self.stage = OpenHapticsStage::EncoderReset { was_pressed: is_pressed };
        if is_pressed && !was_pressed {
            (hd.update_calibration)(STYLE_ENCODER_RESET);
            if (hd.check_calibration)() == CALIBRATION_OK {
                self.start()?;
            }
        }
        thread::sleep(FRAME_TIMEOUT);
        Ok(Some(DeviceReport { reading: Reading::ABSENT, state: DeviceState::Calibrate { how: HOLD_NEUTRAL } }))
    }

    fn send_force(&self, output: &Wrench) {
        let Wrench { force, torque } = if self.state.is_ready() { output.clamped_to(&self.spec) } else { Wrench::ZERO };
        self.context.force_slot.write(&Wrench { force: force * FORCE_SCALE, torque: torque * FORCE_SCALE });
    }

    fn await_report(&mut self) -> Option<[u32; REPORT_WORDS]> {
        let until = Instant::now() + FRAME_TIMEOUT;
        loop {
            if let Some((count, words)) = self.context.report.read().filter(|(count, _)| *count > self.last_count) {
                self.last_count = count;
                return Some(words);
            }
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return None;
            }
            thread::park_timeout(left);
        }
    }

    fn interpret(&mut self, words: [u32; REPORT_WORDS]) -> Result<Option<DeviceReport>, DeviceError> {
        let [buttons, docked, calibration, cut, gone, refusals] = words[12..] else { return Ok(None) };
        if gone != 0 {
            return Err(device_lost(remedy(gone), gone));
        }
        if refusals > REFUSALS_MAX {
            let code = self.context.refusal.load(Ordering::Relaxed);
            return Err(device_lost("its library refuses every frame; does another program use the device?", code));
        }
        if refusals > 0 {
            return Ok(None);
        }
        if calibration != CALIBRATION_OK {
            let how = match self.context.style {
                STYLE_INKWELL => "put the stylus into its inkwell and wait a second",
                STYLE_ENCODER_RESET => HOLD_NEUTRAL,
                _ => "move the stylus through its whole range, then hold it still",
            };
            return Ok(Some(DeviceReport { reading: Reading::ABSENT, state: DeviceState::Calibrate { how } }));
        }
        let Some(pose) = self.pose(words) else {
            return self.pose_rejects.reject().map(Some);
        };
        self.pose_rejects.reset();
        let state = match (cut, docked != 0) {
            (0, false) => DeviceState::Ready,
            (0, true) => DeviceState::ForceOff { why: "the stylus is in its inkwell; take it out" },
            (code, _) => DeviceState::ForceOff { why: cut_reason(code) },
        };
        Ok(Some(DeviceReport { reading: Reading { pose, buttons }, state }))
    }

    /// Returns the stylus in world space: HDAPI's axes are those of the world, and those of its stylus are those of a
    /// handle.
    fn pose(&self, words: [u32; REPORT_WORDS]) -> Option<Pose> {
        let [x, y, z, origin] =
            std::array::from_fn(|i| Vec3::from_array(std::array::from_fn(|j| f32::from_bits(words[3 * i + j]))));
        let position = origin - self.middle;
        let orientation = if self.senses_orientation { nearest_rotation(x, y, z)? } else { UPRIGHT };
        plausible(Pose { position, orientation }, &self.spec)
    }
}

const HOLD_NEUTRAL: &str =
    "hold the arm in its neutral pose, all joints at right angles, and press the stylus's button";

impl Protocol for OpenHapticsProtocol {
    fn spec(&self) -> &DeviceSpec {
        &self.spec
    }

    fn pacing(&self) -> Pacing {
        Pacing::Device
    }

    fn exchange(&mut self, output: &Wrench) -> Result<Option<DeviceReport>, DeviceError> {
        match self.stage {
            OpenHapticsStage::Opened => {
                let is_calibrated = (self.context.hd.check_calibration)() == CALIBRATION_OK;
                if self.context.style == STYLE_ENCODER_RESET && !is_calibrated {
                    // A button that is already held down when the program starts does not count.
                    self.stage = OpenHapticsStage::EncoderReset { was_pressed: true };
                } else {
                    self.start()?;
                }
                Ok(None)
            }
            OpenHapticsStage::EncoderReset { was_pressed } => self.await_encoder_reset(was_pressed),
            OpenHapticsStage::Running { .. } => {
                self.send_force(output);
                let report = match self.await_report() {
                    Some(words) => self.interpret(words)?,
                    None if self.context.failed.load(Ordering::Acquire) => {
                        return Err(device_lost("its driver crashed; please report this", 0));
                    }
                    None => None,
                };
                if let Some(report) = report {
                    self.state = report.state;
                }
                Ok(report)
            }
        }
    }

    /// Renders a frame without force, stops the servo, then closes the device. The library stays loaded.
    fn close(&mut self) {
        let CallbackContext { hd, handle, stop, stopped, .. } = self.context;
        stop.store(true, Ordering::Release);
        if let OpenHapticsStage::Running { schedule } = self.stage {
            let until = Instant::now() + CLOSE_WAIT;
            while stopped.load(Ordering::Acquire) == 0 && Instant::now() < until {
                thread::park_timeout(Duration::from_millis(1));
            }
            (hd.disable)(FORCE_OUTPUT);
            (hd.stop_scheduler)();
            (hd.unschedule)(schedule);
        }
        (hd.disable_device)(*handle);
        hd.drain_errors();
    }
}

/// Time for which closing waits for the last frame: a servo that does not run by then renders nothing either.
const CLOSE_WAIT: Duration = Duration::from_millis(100);

fn device_lost(why: &'static str, code: u32) -> DeviceError {
    DeviceError::Lost { why, code: code.cast_signed() }
}

fn cut_reason(code: u32) -> &'static str {
    match code {
        0x0200 => "the motors are too warm; let them cool",
        0x0201 => "the force exceeded the limit of the device",
        0x0202 => "the force changed faster than the device allows",
        0x0203 => "the stylus moved too fast; hold it still for a moment",
        _ => "the device switched its force off; hold it still for a moment",
    }
}

fn remedy(code: u32) -> &'static str {
    match code {
        0x0302 => "the connection was lost; check its cable and power",
        0x0303 => "it is configured for another port; run the vendor's setup program",
        0x0304 => "the system's timers do not work for it; close other programs and restart",
        0x0600..=0x06ff => "the vendor's licence does not allow this use",
        _ => "it reports a fault; switch it off and on again",
    }
}

struct Workspace {
    middle: Vec3,
    half: Option<Vec3>,
}

impl Workspace {
    fn query(hd: &Hd) -> Workspace {
        let [a, b, c, d, e, f, ..] = hd.doubles(USABLE_WORKSPACE_DIMENSIONS).map(|x| x as f32);
        let (least, greatest) = (Vec3::new(a, b, c), Vec3::new(d, e, f));
        let is_box = least.is_finite() && greatest.is_finite() && least.cmplt(greatest).all();
        match is_box {
            true => Workspace { middle: (least + greatest) / 2.0, half: Some((greatest - least) / 2.0) },
            false => Workspace { middle: Vec3::ZERO, half: None },
        }
    }
}

/// Properties of a model that the device does not report.
struct OpenHapticsModel {
    /// Part of the model's name.
    name_part: &'static str,
    max_force: f32,
    continuous_force: f32,
    /// N·mm, of the version with six axes.
    max_torque: f32,
    /// N/mm
    stiffness: f32,
    /// N·s/mm
    damping: f32,
    resolution: f32,
    /// Half the workspace if the library does not report it, mm.
    radius: f32,
    apparent_mass: f32,
}

/// Known models. Force, torque, stiffness, damping and radius as CHAI3D uses them for stable rendering; continuous
/// force, resolution and mass from the vendors' data sheets. The first entry whose `name_part` matches is used.
const MODELS: &[OpenHapticsModel] = &[
    OpenHapticsModel {
        name_part: "Premium 3.0",
        max_force: 22.0,
        continuous_force: 3.0,
        max_torque: 188.0,
        stiffness: 1.0,
        damping: 0.005,
        resolution: 0.02,
        radius: 250.0,
        apparent_mass: 0.159,
    },
    OpenHapticsModel {
        name_part: "Premium",
        max_force: 8.5,
        continuous_force: 1.4,
        max_torque: 188.0,
        stiffness: 0.8,
        damping: 0.005,
        resolution: 0.03,
        radius: 120.0,
        apparent_mass: 0.075,
    },
    DESKTOP,
    OpenHapticsModel { name_part: "Touch X", ..DESKTOP },
    OpenHapticsModel {
        name_part: "Omni",
        max_force: 3.3,
        continuous_force: 0.88,
        max_torque: 0.0,
        stiffness: 0.7,
        damping: 0.005,
        resolution: 0.055,
        radius: 100.0,
        apparent_mass: 0.045,
    },
];

/// Also used for unknown models, since it is the softest of all.
const TOUCH: OpenHapticsModel = OpenHapticsModel {
    name_part: "Touch",
    max_force: 3.3,
    continuous_force: 0.88,
    max_torque: 0.0,
    stiffness: 0.4,
    damping: 0.004,
    resolution: 0.055,
    radius: 75.0,
    apparent_mass: 0.045,
};

const DESKTOP: OpenHapticsModel = OpenHapticsModel {
    name_part: "Desktop",
    max_force: 7.9,
    continuous_force: 1.75,
    max_torque: 0.0,
    stiffness: 1.0,
    damping: 0.005,
    resolution: 0.023,
    radius: 100.0,
    apparent_mass: 0.045,
};

/// Returns the device's own limits, but never more than its model is known to support.
fn spec(hd: &Hd, workspace_half: Option<Vec3>) -> DeviceSpec {
    let name = hd.text(DEVICE_MODEL_TYPE);
    let renders_torque = hd.integer(OUTPUT_DOF) >= 6;
    let model = MODELS.iter().find(|m| name.contains(m.name_part)).unwrap_or(&TOUCH);
    let least = |what, known: f32| {
        let reported = hd.doubles(what)[0] as f32;
        if reported.is_finite() && reported > 0.0 { reported.min(known) } else { known }
    };
    DeviceSpec {
        max_force: least(NOMINAL_MAX_FORCE, model.max_force),
        continuous_force: least(NOMINAL_MAX_CONTINUOUS_FORCE, model.continuous_force),
        max_torque: if renders_torque { model.max_torque } else { 0.0 },
        max_stiffness: least(NOMINAL_MAX_STIFFNESS, model.stiffness),
        max_damping: model.damping,
        resolution: model.resolution,
        workspace_half: workspace_half.unwrap_or(Vec3::splat(model.radius)),
        apparent_mass: model.apparent_mass,
        name,
        page_force: None,
    }
}
