//! 3D Systems Touch and SensAble PHANTOM devices, through the HDAPI of OpenHaptics.
//!
//! Takes and gives what every wire does. HDAPI owns the servo thread: it calls [`beat`] every millisecond, which meets the
//! wire's thread at two slots where the newest wins. Never unloads the library, never locks or allocates in the callback,
//! never lets a panic cross into C. One device at a time: HDAPI has one scheduler for all.
//!
//! Sources: the headers and manuals of OpenHaptics 3.0 to 3.5; how CHAI3D, HAPI and iMSTK use them where the manuals
//! contradict themselves (torque, stiffness, inkwell).

// C is called here: what each block relies on stands beside it.
#![allow(unsafe_code)]

use super::told::Told;
use super::trust::{self, Nonsense};
use super::{
    Beat, Device, Driver, Found, Gone, Output, Reading, Relay, Report, Spec, State, Trouble, UPRIGHT, Wire,
    shared_library,
};
use crate::frame::{Pose, Vec3, rotation_near};
use crate::mailbox::Newest;
use libloading::Library;
use std::ffi::{CStr, OsStr, c_char, c_ulong, c_void};
use std::mem::ManuallyDrop;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering};
use std::thread::{self, Thread};
use std::time::{Duration, Instant};

pub struct OpenHaptics;

impl Driver for OpenHaptics {
    fn name(&self) -> &'static str {
        "openhaptics"
    }

    fn about(&self) -> &'static str {
        "3D Systems Touch, SensAble PHANTOM Omni, Desktop, Premium; after the colon: the path of libHD"
    }

    fn find(&self) -> Result<Vec<Found>, Trouble> {
        let hd = Hd::find(None)?;
        let handle = hd.init()?;
        let (model, serial) = (hd.text(DEVICE_MODEL_TYPE), hd.text(DEVICE_SERIAL_NUMBER));
        (hd.disable_device)(handle);
        hd.drain();
        Ok(vec![Found { title: format!("{model} {serial}").trim().to_string(), argument: String::new() }])
    }

    fn open(&self, argument: Option<&str>) -> Result<Box<dyn Device + Send>, Trouble> {
        let hd = Hd::find(argument)?;
        let handle = hd.init()?;
        Ok(Box::new(Relay::start(Arm::new(hd, handle))))
    }
}

/// Names under which the loader may know it; the first is the one to name in a complaint.
const NAMES: &[&str] = if cfg!(windows) {
    &["HD.dll"]
} else if cfg!(target_os = "macos") {
    &["libHD.dylib", "/Library/Frameworks/OpenHaptics.framework/OpenHaptics"]
} else {
    &["libHD.so", "libHD.so.3.4", "libHD.so.3.0"]
};

const INSTALL: &str = "install the vendor's device driver and OpenHaptics (3D Systems support pages), or name the library: \
                       --device openhaptics:/path/to/libHD.so";

type Callback = extern "system" fn(*mut c_void) -> u32;

/// The functions of HDAPI that are called here.
///
/// Those that take and give only numbers are declared safe: HDAPI answers a wrong number with an error, never with
/// broken memory. The others are called in one place each.
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

/// `HDErrorInfo`, which comes back by value.
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
/// Least x, y, z, greatest x, y, z, mm.
const USABLE_WORKSPACE_DIMENSIONS: u32 = 0x2551;
const INPUT_DOF: u32 = 0x2553;
const OUTPUT_DOF: u32 = 0x2554;
const CALIBRATION_STYLE: u32 = 0x2555;
/// Taken as N/mm, as HAPI and the vendor's examples do; the manual speaks of 0 to 1.
const NOMINAL_MAX_STIFFNESS: u32 = 0x2602;
const NOMINAL_MAX_FORCE: u32 = 0x2603;
const NOMINAL_MAX_CONTINUOUS_FORCE: u32 = 0x2604;
const CURRENT_FORCE: u32 = 0x2700;
/// mN·m, which is N·mm: CHAI3D and HAPI agree on it where the manual does not.
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

/// Handles above this are garbage: after one failed `hdInitDevice` the next may give one without an error (HAPI).
const HANDLE_MAX: u32 = 1024;

/// Errors that are fetched at most at a time: a library that never says that there are no more must not hang the servo.
const ERRORS_MAX: usize = 64;

/// What happened since errors were last fetched. Of each kind the oldest: the others follow from it.
#[derive(Clone, Copy, Default)]
struct Errors {
    /// 0x02xx: the force was cut for this moment.
    force: u32,
    /// 0x03xx and 0x06xx: the device or its licence is gone.
    device: u32,
    /// Calls that were refused.
    refused: u32,
}

impl Hd {
    fn find(argument: Option<&str>) -> Result<Hd, Trouble> {
        shared_library::load(argument, NAMES.iter().map(PathBuf::from).collect(), INSTALL, Hd::load)
    }

    /// Loads the library and keeps it for good: after unloading and loading again its driver fails (CHAI3D).
    fn load(path: &OsStr) -> Result<Hd, libloading::Error> {
        // SAFETY: whoever names or installs the vendor's library wants its start-up code to run.
        let library = ManuallyDrop::new(unsafe { open_for_all(path)? });
        // SAFETY: names and signatures are those of the vendor's header (HD/hdDevice.h, HD/hdScheduler.h), and the library
        // is never unloaded, so the pointers stay good.
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

    /// Opens the default device. Named ones fail with the Linux drivers of 2022.
    fn init(&self) -> Result<u32, Trouble> {
        self.drain();
        // SAFETY: a null name means the default device.
        let handle = unsafe { (self.init_device)(std::ptr::null()) };
        let code = (self.get_error)().code;
        self.drain();
        if code == DEVICE_ALREADY_INITIATED {
            return Err(Trouble::new("the device is open already", "end the other program or session that uses it"));
        }
        if code != SUCCESS || handle > HANDLE_MAX {
            let said = match code {
                SUCCESS => format!("no error, but the handle {handle:#x}"),
                _ => format!("{} (0x{code:04x})", owned(self.get_error_string)(code)),
            };
            return Err(Trouble::new(
                format!("OpenHaptics cannot open the default device: {said}"),
                "plug the device in, switch it on, and name it Default Device in the vendor's setup program",
            ));
        }
        Ok(handle)
    }

    /// Fetches all errors, which come newest first.
    fn drain(&self) -> Errors {
        let mut errors = Errors::default();
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
        // SAFETY: HDboolean is one byte, and every boolean that is asked for here is a single one.
        unsafe { (self.get_booleanv)(what, &mut value) };
        value != 0
    }

    /// 0 if the library refuses.
    fn integer(&self, what: u32) -> u32 {
        let mut values = [0i32; 16];
        // SAFETY: no parameter of HDAPI has more than 16 values.
        unsafe { (self.get_integerv)(what, values.as_mut_ptr()) };
        values[0].cast_unsigned()
    }

    /// Zeros if the library refuses.
    fn doubles(&self, what: u32) -> [f64; 16] {
        let mut values = [0.0; 16];
        // SAFETY: no parameter of HDAPI has more than 16 values.
        unsafe { (self.get_doublev)(what, values.as_mut_ptr()) };
        values
    }

    fn set(&self, what: u32, value: Vec3) {
        let values = value.to_array().map(f64::from);
        // SAFETY: force and torque, which are all that is set here, have three values.
        unsafe { (self.set_doublev)(what, values.as_ptr()) };
    }

    fn text(&self, what: u32) -> String {
        owned(self.get_string)(what)
    }
}

/// A function of the library that gives a text, as one that gives a text of our own.
fn owned(text: extern "system" fn(u32) -> *const c_char) -> impl Fn(u32) -> String {
    move |what| {
        let text = text(what);
        if text.is_null() {
            return String::new();
        }
        // SAFETY: HDAPI gives null or a text that ends with zero and lives as long as the library.
        unsafe { CStr::from_ptr(text) }.to_string_lossy().into_owned()
    }
}

/// With symbols visible to the libraries that it loads in turn, as its own device driver expects (CHAI3D).
///
/// # Safety
/// Runs the library's start-up code.
#[cfg(unix)]
unsafe fn open_for_all(path: &OsStr) -> Result<Library, libloading::Error> {
    use libloading::os::unix::{Library as UnixLibrary, RTLD_GLOBAL, RTLD_LAZY};
    // SAFETY: passed on to the caller.
    unsafe { UnixLibrary::open(Some(path), RTLD_LAZY | RTLD_GLOBAL) }.map(Library::from)
}

/// # Safety
/// Runs the library's start-up code.
#[cfg(not(unix))]
unsafe fn open_for_all(path: &OsStr) -> Result<Library, libloading::Error> {
    // SAFETY: passed on to the caller.
    unsafe { Library::new(path) }
}

/// What the wire's thread and HDAPI's servo thread share. Leaked, some hundred bytes per opening: a callback that comes
/// late must not meet freed memory.
struct Meeting {
    hd: Hd,
    handle: u32,
    has_inkwell: bool,
    renders_torque: bool,
    /// What to give to `hdUpdateCalibration`; 0 for a device that knows no way.
    style: u32,
    told: Told,
    report: Newest<REPORT_WORDS>,
    epoch: Instant,
    wire: OnceLock<Thread>,
    stop: AtomicBool,
    /// Frames with no force since `stop`.
    stopped: AtomicU32,
    /// The callback panicked.
    failed: AtomicBool,
    // From here on: written by the callback only.
    beats: AtomicU64,
    calibration: AtomicU32,
    /// The last 0x02xx error while the force is cut; 0 otherwise.
    cut: AtomicU32,
    /// When the last such error came, µs since `epoch`.
    cut_at: AtomicU64,
    /// The first 0x03xx or 0x06xx error.
    lost: AtomicU32,
    /// Frames in a row in which a call was refused, and the last refusal.
    refusals: AtomicU32,
    refusal: AtomicU32,
}

/// 12 floats of the transform by columns, buttons, docked, calibration, cut, lost, refusals.
const REPORT_WORDS: usize = 18;

/// Beats between two looks at the calibration: the manual's example asks once a second or so.
const CALIBRATION_BEATS: u64 = 1000;

/// How long forces stay cut after the last error that cut them: long enough to settle, short enough not to be puzzling.
const CUT_LIFE: Duration = Duration::from_millis(500);

/// HDAPI calls this every millisecond on its servo thread.
extern "system" fn beat(context: *mut c_void) -> u32 {
    // SAFETY: the context that `Arm::start` gives is a leaked `Meeting`, all of whose fields may be shared.
    let meeting = unsafe { &*context.cast::<Meeting>() };
    match catch_unwind(AssertUnwindSafe(|| meeting.frame())) {
        Ok(()) => CALLBACK_CONTINUE,
        Err(_) => {
            meeting.hd.set(CURRENT_FORCE, Vec3::ZERO);
            (meeting.hd.end_frame)(meeting.handle);
            meeting.failed.store(true, Ordering::Release);
            CALLBACK_DONE
        }
    }
}

impl Meeting {
    /// One pair of begin and end: a second one in a beat would be refused.
    fn frame(&self) {
        let hd = &self.hd;
        (hd.begin_frame)(self.handle);
        let transform = hd.doubles(CURRENT_TRANSFORM);
        let buttons = hd.integer(CURRENT_BUTTONS);
        // The switch is closed while the stylus is out (HAPI), and can be asked for as a boolean only.
        let is_docked = self.has_inkwell && !hd.boolean(CURRENT_INKWELL_SWITCH);
        let calibration = self.calibrate(is_docked);
        let may_push = transform.iter().all(|x| x.is_finite()) && calibration == CALIBRATION_OK && !self.is_cut();
        let output = if may_push { self.output() } else { Output::NONE };
        hd.set(CURRENT_FORCE, output.force);
        if self.renders_torque {
            hd.set(CURRENT_TORQUE, output.torque);
        }
        (hd.end_frame)(self.handle);
        self.note(hd.drain());
        self.report.write(self.words(&transform, buttons, is_docked));
        if self.stop.load(Ordering::Acquire) {
            self.stopped.fetch_add(1, Ordering::Release);
        }
        self.beats.fetch_add(1, Ordering::Relaxed);
        if let Some(wire) = self.wire.get() {
            wire.unpark();
        }
    }

    /// Asks now and then until the device is calibrated, and calibrates it where no person is needed.
    fn calibrate(&self, is_docked: bool) -> u32 {
        let known = self.calibration.load(Ordering::Relaxed);
        if known == CALIBRATION_OK || !self.beats.load(Ordering::Relaxed).is_multiple_of(CALIBRATION_BEATS) {
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

    /// Whether an error of the force still keeps the motors still. Once it is over they are switched on again.
    fn is_cut(&self) -> bool {
        if self.cut.load(Ordering::Relaxed) == 0 {
            return false;
        }
        let since = self.now_us().saturating_sub(self.cut_at.load(Ordering::Relaxed));
        if since < CUT_LIFE.as_micros() as u64 {
            return true;
        }
        (self.hd.enable)(FORCE_OUTPUT);
        self.cut.store(0, Ordering::Relaxed);
        false
    }

    /// The newest force, if it is young enough to be rendered.
    fn output(&self) -> Output {
        if self.stop.load(Ordering::Acquire) {
            return Output::NONE;
        }
        self.told.output()
    }

    fn note(&self, errors: Errors) {
        let Errors { force, device, refused } = errors;
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

    fn words(&self, transform: &[f64; 16], buttons: u32, is_docked: bool) -> [u32; REPORT_WORDS] {
        // The fourth of each column is 0, 0, 0, 1.
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

/// The wire.
struct Arm {
    spec: Spec,
    meeting: &'static Meeting,
    /// Middle of the usable workspace in HDAPI's space, mm: its own origin is only near it.
    middle: Vec3,
    senses_orientation: bool,
    stage: Stage,
    /// Count of the last report that was fetched.
    seen: u64,
    /// As last reported.
    state: State,
    /// Reports in a row that made no sense.
    nonsense: Nonsense,
}

enum Stage {
    Opened,
    /// Encoders that know no place count from where the arm is when they are set to zero: a person holds it there.
    EncoderReset {
        was_pressed: bool,
    },
    Running {
        schedule: c_ulong,
    },
}

/// How long a turn waits for the next beat: several, so that a late one is not taken for silence.
const BEAT_WAIT: Duration = Duration::from_millis(5);

/// Frames in a row that the library refuses before it counts as broken.
const REFUSALS_MAX: u32 = 100;

/// Of every force, what is asked for: the last bit of a rounded sum must not count as more than the device allows.
const FORCE_SHARE: f32 = 0.999;

impl Arm {
    fn new(hd: Hd, handle: u32) -> Arm {
        let styles = hd.integer(CALIBRATION_STYLE);
        let style = [STYLE_AUTO, STYLE_INKWELL, STYLE_ENCODER_RESET].into_iter().find(|s| styles & s != 0);
        let Workspace { middle, half } = Workspace::of(&hd);
        let spec = spec(&hd, half);
        let senses_orientation = hd.integer(INPUT_DOF) >= 6;
        hd.drain();
        let meeting = Box::leak(Box::new(Meeting {
            hd,
            handle,
            has_inkwell: styles & STYLE_INKWELL != 0,
            renders_torque: spec.max_torque > 0.0,
            style: style.unwrap_or(0),
            told: Told::new(),
            report: Newest::new(),
            epoch: Instant::now(),
            wire: OnceLock::new(),
            stop: AtomicBool::new(false),
            stopped: AtomicU32::new(0),
            failed: AtomicBool::new(false),
            beats: AtomicU64::new(0),
            calibration: AtomicU32::new(CALIBRATION_NEEDS_UPDATE),
            cut: AtomicU32::new(0),
            cut_at: AtomicU64::new(0),
            lost: AtomicU32::new(0),
            refusals: AtomicU32::new(0),
            refusal: AtomicU32::new(0),
        }));
        let state = State::Homing { what: "starting its servo" };
        Arm {
            spec,
            meeting,
            middle,
            senses_orientation,
            stage: Stage::Opened,
            seen: 0,
            state,
            nonsense: Nonsense::default(),
        }
    }

    fn start(&mut self) -> Result<(), Gone> {
        let hd = &self.meeting.hd;
        self.meeting.wire.get_or_init(thread::current);
        // Ports differ in the rates they know; where they refuse, theirs is 1000 Hz anyway.
        (hd.set_scheduler_rate)(1000);
        hd.drain();
        (hd.enable)(FORCE_OUTPUT);
        let context = std::ptr::from_ref(self.meeting).cast_mut().cast();
        // SAFETY: the callback has the signature that HDAPI asks for, and its context is never freed.
        let schedule = unsafe { (hd.schedule_asynchronous)(beat, context, MAX_PRIORITY) };
        (hd.start_scheduler)();
        self.stage = Stage::Running { schedule };
        let Errors { force, device, refused } = hd.drain();
        match device.max(refused) {
            SUCCESS => {
                self.meeting.note(Errors { force, ..Errors::default() });
                Ok(())
            }
            code => Err(lost("its library does not start the servo; restart the program", code)),
        }
    }

    /// Before the scheduler runs, frames may be read on any thread.
    fn await_encoder_reset(&mut self, was_pressed: bool) -> Result<Option<Report>, Gone> {
        let Meeting { hd, handle, .. } = self.meeting;
        (hd.begin_frame)(*handle);
        let is_pressed = hd.integer(CURRENT_BUTTONS) & 1 != 0;
        (hd.end_frame)(*handle);
        let errors = hd.drain();
        if errors.device != 0 {
            return Err(lost(what_to_do(errors.device), errors.device));
        }
        self.stage = Stage::EncoderReset { was_pressed: is_pressed };
        if is_pressed && !was_pressed {
            (hd.update_calibration)(STYLE_ENCODER_RESET);
            if (hd.check_calibration)() == CALIBRATION_OK {
                self.start()?;
            }
        }
        thread::sleep(BEAT_WAIT);
        Ok(Some(Report { reading: Reading::ABSENT, state: State::Calibrate { how: HOLD_NEUTRAL } }))
    }

    fn tell(&self, told: &Output) {
        let Output { force, torque } = if self.state.is_ready() { told.within(&self.spec) } else { Output::NONE };
        self.meeting.told.tell(&Output { force: force * FORCE_SHARE, torque: torque * FORCE_SHARE });
    }

    fn await_report(&mut self) -> Option<[u32; REPORT_WORDS]> {
        let until = Instant::now() + BEAT_WAIT;
        loop {
            if let Some((count, words)) = self.meeting.report.read().filter(|(count, _)| *count > self.seen) {
                self.seen = count;
                return Some(words);
            }
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return None;
            }
            thread::park_timeout(left);
        }
    }

    fn interpret(&mut self, words: [u32; REPORT_WORDS]) -> Result<Option<Report>, Gone> {
        let [buttons, docked, calibration, cut, gone, refusals] = words[12..] else { return Ok(None) };
        if gone != 0 {
            return Err(lost(what_to_do(gone), gone));
        }
        if refusals > REFUSALS_MAX {
            let code = self.meeting.refusal.load(Ordering::Relaxed);
            return Err(lost("its library refuses every frame; does another program use the device?", code));
        }
        if refusals > 0 {
            return Ok(None);
        }
        if calibration != CALIBRATION_OK {
            let how = match self.meeting.style {
                STYLE_INKWELL => "put the stylus into its inkwell and wait a second",
                STYLE_ENCODER_RESET => HOLD_NEUTRAL,
                _ => "move the stylus through its whole reach, then hold it still",
            };
            return Ok(Some(Report { reading: Reading::ABSENT, state: State::Calibrate { how } }));
        }
        let Some(pose) = self.pose(words) else {
            return self.nonsense.refuse().map(Some);
        };
        self.nonsense.forgive();
        let state = match (cut, docked != 0) {
            (0, false) => State::Ready,
            (0, true) => State::ForceOff { why: "the stylus is in its inkwell; take it out" },
            (code, _) => State::ForceOff { why: why_cut(code) },
        };
        Ok(Some(Report { reading: Reading { pose, buttons }, state }))
    }

    /// The stylus in world space: HDAPI's axes are those of the world, and so are its stylus's those of a handle.
    fn pose(&self, words: [u32; REPORT_WORDS]) -> Option<Pose> {
        let [x, y, z, origin] =
            std::array::from_fn(|i| Vec3::from_array(std::array::from_fn(|j| f32::from_bits(words[3 * i + j]))));
        let position = origin - self.middle;
        let orientation = if self.senses_orientation { rotation_near(x, y, z)? } else { UPRIGHT };
        trust::sensible(Pose { position, orientation }, &self.spec)
    }
}

const HOLD_NEUTRAL: &str =
    "hold the arm in its neutral pose, all joints at right angles, and press the stylus's button";

impl Wire for Arm {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn beat(&self) -> Beat {
        Beat::Device
    }

    fn turn(&mut self, told: &Output) -> Result<Option<Report>, Gone> {
        match self.stage {
            Stage::Opened => {
                let is_calibrated = (self.meeting.hd.check_calibration)() == CALIBRATION_OK;
                if self.meeting.style == STYLE_ENCODER_RESET && !is_calibrated {
                    // A button that is held down while the program starts is no answer.
                    self.stage = Stage::EncoderReset { was_pressed: true };
                } else {
                    self.start()?;
                }
                Ok(None)
            }
            Stage::EncoderReset { was_pressed } => self.await_encoder_reset(was_pressed),
            Stage::Running { .. } => {
                self.tell(told);
                let report = match self.await_report() {
                    Some(words) => self.interpret(words)?,
                    None if self.meeting.failed.load(Ordering::Acquire) => {
                        return Err(lost("its driver failed; please report this", 0));
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

    /// A beat without force, then the servo stops, then the device is closed. The library stays.
    fn close(&mut self) {
        let Meeting { hd, handle, stop, stopped, .. } = self.meeting;
        stop.store(true, Ordering::Release);
        if let Stage::Running { schedule } = self.stage {
            let until = Instant::now() + CLOSE_WAIT;
            while stopped.load(Ordering::Acquire) == 0 && Instant::now() < until {
                thread::park_timeout(Duration::from_millis(1));
            }
            (hd.disable)(FORCE_OUTPUT);
            (hd.stop_scheduler)();
            (hd.unschedule)(schedule);
        }
        (hd.disable_device)(*handle);
        hd.drain();
    }
}

/// How long closing waits for the last beat: a servo that does not turn by then renders nothing either.
const CLOSE_WAIT: Duration = Duration::from_millis(100);

fn lost(why: &'static str, code: u32) -> Gone {
    Gone::Lost { why, code: code.cast_signed() }
}

fn why_cut(code: u32) -> &'static str {
    match code {
        0x0200 => "the motors are too warm; let them cool",
        0x0201 => "the force was more than the device can render",
        0x0202 => "the force changed faster than the device allows",
        0x0203 => "the stylus moved too fast; hold it still for a moment",
        _ => "the device cut its force; hold it still for a moment",
    }
}

fn what_to_do(code: u32) -> &'static str {
    match code {
        0x0302 => "the connection to it broke; check its cable and power",
        0x0303 => "it is set up for another port; run the vendor's setup program",
        0x0304 => "the system's timers fail it; close other programs and start again",
        0x0600..=0x06ff => "the vendor's licence does not allow this use",
        _ => "it reports a fault; switch it off and on again",
    }
}

struct Workspace {
    middle: Vec3,
    half: Option<Vec3>,
}

impl Workspace {
    fn of(hd: &Hd) -> Workspace {
        let [a, b, c, d, e, f, ..] = hd.doubles(USABLE_WORKSPACE_DIMENSIONS).map(|x| x as f32);
        let (least, greatest) = (Vec3::new(a, b, c), Vec3::new(d, e, f));
        let is_box = least.is_finite() && greatest.is_finite() && least.cmplt(greatest).all();
        match is_box {
            true => Workspace { middle: (least + greatest) / 2.0, half: Some((greatest - least) / 2.0) },
            false => Workspace { middle: Vec3::ZERO, half: None },
        }
    }
}

/// What is known of a model beyond what it says of itself.
struct Model {
    /// What its name contains.
    mark: &'static str,
    max_force: f32,
    continuous_force: f32,
    /// N·mm, of the kind with six axes.
    max_torque: f32,
    /// N/mm
    stiffness: f32,
    /// N·s/mm
    damping: f32,
    resolution: f32,
    /// Half the workspace where the library does not tell, mm.
    radius: f32,
    apparent_mass: f32,
}

/// Force, torque, stiffness, damping and radius as CHAI3D uses them for stable rendering; continuous force, resolution and
/// mass from the vendors' data sheets. The first whose mark fits.
const MODELS: &[Model] = &[
    Model {
        mark: "Premium 3.0",
        max_force: 22.0,
        continuous_force: 3.0,
        max_torque: 188.0,
        stiffness: 1.0,
        damping: 0.005,
        resolution: 0.02,
        radius: 250.0,
        apparent_mass: 0.159,
    },
    Model {
        mark: "Premium",
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
    Model { mark: "Touch X", ..DESKTOP },
    Model {
        mark: "Omni",
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

/// Also for whatever is new: it is the softest of all.
const TOUCH: Model = Model {
    mark: "Touch",
    max_force: 3.3,
    continuous_force: 0.88,
    max_torque: 0.0,
    stiffness: 0.4,
    damping: 0.004,
    resolution: 0.055,
    radius: 75.0,
    apparent_mass: 0.045,
};

const DESKTOP: Model = Model {
    mark: "Desktop",
    max_force: 7.9,
    continuous_force: 1.75,
    max_torque: 0.0,
    stiffness: 1.0,
    damping: 0.005,
    resolution: 0.023,
    radius: 100.0,
    apparent_mass: 0.045,
};

/// The device's own limits, and never more than its model is known to stand.
fn spec(hd: &Hd, workspace_half: Option<Vec3>) -> Spec {
    let name = hd.text(DEVICE_MODEL_TYPE);
    let renders_torque = hd.integer(OUTPUT_DOF) >= 6;
    let model = MODELS.iter().find(|m| name.contains(m.mark)).unwrap_or(&TOUCH);
    let least = |what, known: f32| {
        let said = hd.doubles(what)[0] as f32;
        if said.is_finite() && said > 0.0 { said.min(known) } else { known }
    };
    Spec {
        max_force: least(NOMINAL_MAX_FORCE, model.max_force),
        continuous_force: least(NOMINAL_MAX_CONTINUOUS_FORCE, model.continuous_force),
        max_torque: if renders_torque { model.max_torque } else { 0.0 },
        max_stiffness: least(NOMINAL_MAX_STIFFNESS, model.stiffness),
        max_damping: model.damping,
        resolution: model.resolution,
        workspace_half: workspace_half.unwrap_or(Vec3::splat(model.radius)),
        apparent_mass: model.apparent_mass,
        name,
    }
}
