//! Force Dimension omega, delta, sigma and lambda, and the Falcon, through the vendor's SDK (libdrd or libdhd).
//!
//! Takes forces and gives reports like every [`Protocol`]. During homing the device moves by itself: this is
//! announced, then runs on a thread of its own while reports continue. Never weakens a safeguard of the device:
//! over-speed limit and watchdog stay on. The device's own velocity, which fails until its window is full, is not
//! used.
//!
//! Sources: `dhdc.h` and `drdc.h` of SDK 3.17, and their use in CHAI3D and the SDK's Python wrapper. Axes as CHAI3D
//! interprets them: x toward the user, y to the right, z up.

// This file calls C; the comment at each block states what it relies on.
#![allow(unsafe_code)]

use crate::pose_rejects::{PoseRejects, plausible};
use crate::{DeviceReport, Driver, FoundDevice, OpenError, Protocol, Relay, shared_library};
use libloading::Library;
use std::ffi::{CStr, OsStr, c_char, c_int, c_uint};
use std::mem::ManuallyDrop;
use std::path::PathBuf;
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};
use typodont_core::device::{Device, DeviceError, DeviceSpec, DeviceState, Pacing, Reading, UPRIGHT, Wrench};
use typodont_core::frame::{Pose, Vec3, nearest_rotation};

/// Driver of Force Dimension devices.
pub struct ForceDimensionDriver;

impl Driver for ForceDimensionDriver {
    fn name(&self) -> &'static str {
        "forcedimension"
    }

    fn description(&self) -> &'static str {
        "Force Dimension omega, delta, sigma, lambda, and the Falcon; the argument is the path of libdrd or libdhd"
    }

    fn discover(&self) -> Result<Vec<FoundDevice>, OpenError> {
        let sdk = Sdk::find(None)?;
        if sdk.count.is_some_and(|count| count() <= 0) {
            return Ok(Vec::new());
        }
        let id = sdk.open()?;
        let title = sdk.name(id);
        sdk.close(id);
        Ok(vec![FoundDevice { title, argument: String::new() }])
    }

    fn open(&self, argument: Option<&str>) -> Result<Box<dyn Device + Send>, OpenError> {
        let sdk = Sdk::find(argument)?;
        let id = sdk.open()?;
        Ok(Box::new(Relay::start(ForceDimensionProtocol::new(sdk, id))))
    }
}

/// File names of the library. libdrd contains all of libdhd, and homing: so it is tried first.
const LIBRARY_NAMES: &[&str] = if cfg!(windows) {
    if cfg!(target_pointer_width = "64") { &["drd64.dll", "dhd64.dll"] } else { &["drd.dll", "dhd.dll"] }
} else if cfg!(target_os = "macos") {
    &["libdrd.dylib", "libdhd.dylib"]
} else {
    &["libdrd.so", "libdrd.so.3", "libdhd.so", "libdhd.so.3"]
};

const INSTALL: &str = if cfg!(windows) {
    "install the Force Dimension SDK (forcedimension.com) and set FDSDK to its folder, or name the library: --device \
     forcedimension:C:\\path\\to\\drd64.dll"
} else {
    "install the Force Dimension SDK (forcedimension.com) and set FDSDK to its folder, or name the library: --device \
     forcedimension:/path/to/libdrd.so"
};

/// Remedy for a device that the SDK does not find, in the words of the system.
const CONNECT: &str = if cfg!(windows) {
    "plug the device in and switch it on; if Windows' Device Manager shows it with a warning sign, install the USB driver of \
     the Force Dimension SDK"
} else if cfg!(target_os = "macos") {
    "plug the device in and switch it on; System Information, USB, must list it"
} else {
    "plug the device in, switch it on, and give users access to it (udev rule for vendor 1451)"
};

/// Returns the paths to try: those of the system's loader, then those of the vendor's instructions and installer.
fn default_paths() -> Vec<PathBuf> {
    let mut folders = vec![PathBuf::new()];
    let sdk = std::env::var_os("FDSDK").map(PathBuf::from);
    if cfg!(windows) {
        folders.extend(sdk.map(|sdk| sdk.join("bin")));
        let vendors = PathBuf::from(r"C:\Program Files\Force Dimension");
        let entries = std::fs::read_dir(vendors).into_iter().flatten().flatten();
        let versions = entries.filter(|e| e.file_name().to_string_lossy().starts_with("sdk-"));
        folders.extend(versions.map(|e| e.path().join("bin")));
    } else {
        folders.push(PathBuf::from("/usr/local/lib"));
        folders.extend(std::env::var_os("HOME").map(|home| PathBuf::from(home).join(".local/lib")));
        let kind = if cfg!(target_os = "macos") { "mac-arm64-clang" } else { "lin-x86_64-gcc" };
        folders.extend(sdk.map(|sdk| sdk.join("lib/release").join(kind)));
    }
    LIBRARY_NAMES.iter().flat_map(|name| folders.iter().map(move |folder| folder.join(name))).collect()
}

/// Number of an open device, returned on opening. The SDK's "current device", -1, is never used.
type DeviceId = c_char;

/// The functions of the SDK used here. Functions that old or small versions lack are optional.
///
/// Functions that only take and return numbers are declared safe: the SDK answers an invalid number with an error,
/// never with invalid memory accesses. Booleans are bytes: C++ writes 0 or 1, and nothing depends on it.
#[derive(Clone, Copy)]
struct Sdk {
    open: extern "system" fn() -> c_int,
    close: extern "system" fn(DeviceId) -> c_int,
    last_error_text: extern "system" fn() -> *const c_char,
    position: unsafe extern "system" fn(*mut f64, *mut f64, *mut f64, DeviceId) -> c_int,
    status: unsafe extern "system" fn(*mut c_int, DeviceId) -> c_int,
    set_force: extern "system" fn(f64, f64, f64, DeviceId) -> c_int,
    enable_force: extern "system" fn(u8, DeviceId) -> c_int,
    button: extern "system" fn(c_int, DeviceId) -> c_int,
    count: Option<extern "system" fn() -> c_int>,
    last_error: Option<extern "system" fn() -> c_int>,
    system_name: Option<extern "system" fn(DeviceId) -> *const c_char>,
    system_type: Option<extern "system" fn(DeviceId) -> c_int>,
    pose: Option<unsafe extern "system" fn(*mut f64, *mut f64, *mut f64, *mut [[f64; 3]; 3], DeviceId) -> c_int>,
    orientation: Option<unsafe extern "system" fn(*mut [[f64; 3]; 3], DeviceId) -> c_int>,
    button_mask: Option<extern "system" fn(DeviceId) -> c_uint>,
    has_wrist: Option<extern "system" fn(DeviceId) -> u8>,
    has_active_wrist: Option<extern "system" fn(DeviceId) -> u8>,
    has_gripper: Option<extern "system" fn(DeviceId) -> u8>,
    is_left_handed: Option<extern "system" fn(DeviceId) -> u8>,
    gripper_angle: Option<unsafe extern "system" fn(*mut f64, DeviceId) -> c_int>,
    /// Force, torque, force of the gripper.
    set_all: Option<extern "system" fn(f64, f64, f64, f64, f64, f64, f64, DeviceId) -> c_int>,
    max_force: Option<extern "system" fn(DeviceId) -> f64>,
    enable_expert_mode: Option<extern "system" fn() -> c_int>,
    disable_expert_mode: Option<extern "system" fn() -> c_int>,
    set_watchdog: Option<extern "system" fn(u8, DeviceId) -> c_int>,
    drd: Option<Drd>,
}

/// Functions that only libdrd has: regulation and homing.
#[derive(Clone, Copy)]
struct Drd {
    open: extern "system" fn() -> c_int,
    close: extern "system" fn(DeviceId) -> c_int,
    is_supported: extern "system" fn(DeviceId) -> u8,
    is_initialized: extern "system" fn(DeviceId) -> u8,
    auto_init: extern "system" fn(DeviceId) -> c_int,
    /// The first argument selects whether forces stay usable.
    stop: extern "system" fn(u8, DeviceId) -> c_int,
}

/// The vendor's error numbers that are distinguished here.
const ERROR_COM: i32 = 2;
const ERROR_DHC_BUSY: i32 = 3;
const ERROR_NO_DEVICE_FOUND: i32 = 5;
const ERROR_TIMEOUT: i32 = 7;
const ERROR_DEVICE_IN_USE: i32 = 20;

const STATUS_POWER: usize = 0;
const STATUS_CONNECTED: usize = 1;
const STATUS_RESET: usize = 3;
const STATUS_FORCE: usize = 5;
const STATUS_FORCE_OFF_CAUSE: usize = 14;

/// SDK 3.17 writes 17 numbers; the rest is reserve for later versions.
const STATUS_CAPACITY: usize = 64;

const CAUSE_NONE: c_int = 0;
const CAUSE_BUTTON: c_int = 1;
const CAUSE_VELOCITY: c_int = 2;
const CAUSE_WATCHDOG: c_int = 3;
const CAUSE_SOFTWARE: c_int = 4;
const CAUSE_USB_DISCONNECTED: c_int = 5;
const CAUSE_DEADMAN: c_int = 6;

impl Sdk {
    fn find(argument: Option<&str>) -> Result<Sdk, OpenError> {
        shared_library::load(argument, default_paths(), INSTALL, Sdk::load)
    }

    /// Loads the library and never unloads it: its own threads may still be running.
    fn load(path: &OsStr) -> Result<Sdk, libloading::Error> {
        // SAFETY: whoever names or installs the vendor's library wants its start-up code to run.
        let library = ManuallyDrop::new(unsafe { Library::new(path)? });
        // SAFETY: names and signatures are those of the vendor's header (dhdc.h), and the library is never unloaded,
        // so the pointers stay valid.
        unsafe {
            Ok(Sdk {
                open: *library.get("dhdOpen")?,
                close: *library.get("dhdClose")?,
                last_error_text: *library.get("dhdErrorGetLastStr")?,
                position: *library.get("dhdGetPosition")?,
                status: *library.get("dhdGetStatus")?,
                set_force: *library.get("dhdSetForce")?,
                enable_force: *library.get("dhdEnableForce")?,
                button: *library.get("dhdGetButton")?,
                count: optional_symbol(&library, "dhdGetDeviceCount"),
                last_error: optional_symbol(&library, "dhdErrorGetLast"),
                system_name: optional_symbol(&library, "dhdGetSystemName"),
                system_type: optional_symbol(&library, "dhdGetSystemType"),
                pose: optional_symbol(&library, "dhdGetPositionAndOrientationFrame"),
                orientation: optional_symbol(&library, "dhdGetOrientationFrame"),
                button_mask: optional_symbol(&library, "dhdGetButtonMask"),
                has_wrist: optional_symbol(&library, "dhdHasWrist"),
                has_active_wrist: optional_symbol(&library, "dhdHasActiveWrist"),
                has_gripper: optional_symbol(&library, "dhdHasGripper"),
                is_left_handed: optional_symbol(&library, "dhdIsLeftHanded"),
                gripper_angle: optional_symbol(&library, "dhdGetGripperAngleRad"),
                set_all: optional_symbol(&library, "dhdSetForceAndTorqueAndGripperForce"),
                max_force: optional_symbol(&library, "dhdGetMaxForce"),
                enable_expert_mode: optional_symbol(&library, "dhdEnableExpertMode"),
                disable_expert_mode: optional_symbol(&library, "dhdDisableExpertMode"),
                set_watchdog: optional_symbol(&library, "dhdSetWatchdog"),
                drd: Drd::load(&library),
            })
        }
    }

    /// Opens the first device, through libdrd if available: libdrd can only home devices that it opened.
    fn open(&self) -> Result<DeviceId, OpenError> {
        let id = self.drd.map_or(self.open, |drd| drd.open)();
        if id >= 0 {
            return Ok(id as DeviceId);
        }
        let help = match self.error() {
            ERROR_DEVICE_IN_USE => "close the other program that uses the device",
            _ => CONNECT,
        };
        Err(OpenError::new(format!("the Force Dimension SDK cannot open a device: {}", self.error_text()), help))
    }

    fn close(&self, id: DeviceId) {
        self.drd.map_or(self.close, |drd| drd.close)(id);
    }

    fn name(&self, id: DeviceId) -> String {
        let name = self.system_name.map(|name| owned_string(name(id))).unwrap_or_default();
        if name.is_empty() { "Force Dimension device".into() } else { name }
    }

    /// Returns the number of this thread's last error; 0 if the library does not report it.
    fn error(&self) -> i32 {
        self.last_error.map_or(0, |last| last())
    }

    fn error_text(&self) -> String {
        owned_string((self.last_error_text)())
    }

    fn status(&self, id: DeviceId) -> Option<[c_int; STATUS_CAPACITY]> {
        let mut status = [0; STATUS_CAPACITY];
        // SAFETY: the array is larger than the status of any version.
        let code = unsafe { (self.status)(status.as_mut_ptr(), id) };
        (code >= 0).then_some(status)
    }

    /// Returns position, m, and orientation by rows, in the device's axes. A return code of 1 means that the values
    /// are unchanged.
    fn pose(&self, id: DeviceId) -> Option<([f64; 3], [[f64; 3]; 3])> {
        let [mut x, mut y, mut z] = [0.0; 3];
        let mut rows = IDENTITY;
        // SAFETY: each pointer is to a local of the type that the header requires.
        let code = unsafe {
            match (self.pose, self.orientation) {
                (Some(pose), _) => pose(&mut x, &mut y, &mut z, &mut rows, id),
                (None, Some(orientation)) => match (self.position)(&mut x, &mut y, &mut z, id) {
                    code if code < 0 => code,
                    _ => orientation(&mut rows, id),
                },
                (None, None) => (self.position)(&mut x, &mut y, &mut z, id),
            }
        };
        (code >= 0).then_some(([x, y, z], rows))
    }

    /// Returns the gripper's angle, rad; negative on left-handed devices.
    fn gripper_angle(&self, id: DeviceId) -> Option<f64> {
        let mut angle = 0.0;
        // SAFETY: the pointer is to a local of the type that the header requires.
        let code = unsafe { self.gripper_angle?(&mut angle, id) };
        (code >= 0).then_some(angle)
    }

    fn buttons(&self, id: DeviceId) -> u32 {
        match self.button_mask {
            Some(mask) => mask(id) & BUTTONS,
            None => (0..BUTTONS.count_ones()).filter(|i| (self.button)(i.cast_signed(), id) == 1).map(|i| 1 << i).sum(),
        }
    }
}

impl Drd {
    /// Loads all functions or none: homing must not start if it cannot be stopped.
    fn load(library: &Library) -> Option<Drd> {
        // SAFETY: names and signatures are those of the vendor's header (drdc.h), and the library is never unloaded.
        unsafe {
            Some(Drd {
                open: optional_symbol(library, "drdOpen")?,
                close: optional_symbol(library, "drdClose")?,
                is_supported: optional_symbol(library, "drdIsSupported")?,
                is_initialized: optional_symbol(library, "drdIsInitialized")?,
                auto_init: optional_symbol(library, "drdAutoInit")?,
                stop: optional_symbol(library, "drdStop")?,
            })
        }
    }
}

/// Returns a function of the library, if it exists.
///
/// # Safety
///
/// `T` must be the function's type, and the library must never be unloaded.
unsafe fn optional_symbol<T: Copy>(library: &Library, name: &str) -> Option<T> {
    // SAFETY: passed on to the caller.
    unsafe { library.get::<T>(name) }.ok().map(|symbol| *symbol)
}

fn owned_string(text: *const c_char) -> String {
    if text.is_null() {
        return String::new();
    }
    // SAFETY: only strings of the SDK are passed: null, or ending with zero and valid until the next call on this
    // thread.
    unsafe { CStr::from_ptr(text) }.to_string_lossy().into_owned()
}

const IDENTITY: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// Bits of the button mask (CHAI3D uses five).
const BUTTONS: u32 = 0b11111;

/// The protocol of a Force Dimension device.
struct ForceDimensionProtocol {
    sdk: Sdk,
    id: DeviceId,
    spec: DeviceSpec,
    has_wrist: bool,
    gripper: Option<Gripper>,
    stage: ForceDimensionStage,
    state: DeviceState,
    /// Exchanges since the status was last read.
    polls_since_status: u32,
    /// Time at which the motors were last switched on, or seen on.
    enabled_at: Instant,
    /// Consecutive implausible reports.
    pose_rejects: PoseRejects,
}

enum ForceDimensionStage {
    Opened,
    /// Homing has been announced but not started.
    Announced(Instant),
    /// Homing is running; the thread returns its result and the SDK's error number.
    Homing(JoinHandle<(c_int, i32)>),
    Running,
}

/// Time for which homing is announced before the device moves, so that hands can be removed.
const ANNOUNCEMENT_TIME: Duration = Duration::from_secs(3);

const WILL_MOVE: DeviceState = DeviceState::Homing { what: "it will move by itself in a moment; take your hands off" };
const MOVES: DeviceState =
    DeviceState::Homing { what: "it moves by itself to find its zero position; keep the hands off" };

/// Interval of reports during homing.
const HOMING_POLL_INTERVAL: Duration = Duration::from_millis(5);

/// Minimum duration of an exchange. The SDK's reads take a few hundred µs; if a value is already available and a read
/// returns at once, the exchange is extended, so that the thread does not occupy a core.
const MIN_POLL_INTERVAL: Duration = Duration::from_micros(250);

/// Exchanges between two reads of the status.
const POLLS_PER_STATUS: u32 = 10;

/// Time without a new force after which the device switches its force off, in units of 125 µs: 20 ms, as in the relay.
const WATCHDOG: u8 = 160;

/// Duration of a read above which the watchdog may have triggered: the status is then read at once.
const SLOW_READ: Duration = Duration::from_millis(10);

/// Time for which forces stay off after the device switched them off: long enough to settle.
const FORCE_OFF_TIME: Duration = Duration::from_millis(500);

impl ForceDimensionProtocol {
    fn new(sdk: Sdk, id: DeviceId) -> ForceDimensionProtocol {
        let kind = sdk.system_type.map_or(0, |kind| kind(id));
        let says = |question: Option<extern "system" fn(DeviceId) -> u8>| question.map(|asked| asked(id) != 0);
        let can_tell = sdk.pose.is_some() || sdk.orientation.is_some();
        let has_wrist = can_tell && says(sdk.has_wrist).unwrap_or(WRIST_SYSTEM_TYPES.contains(&kind));
        let renders_torque = says(sdk.has_active_wrist).unwrap_or(false) && sdk.set_all.is_some();
        let has_gripper = says(sdk.has_gripper).unwrap_or(false) && sdk.gripper_angle.is_some();
        let sign = if says(sdk.is_left_handed).unwrap_or(false) { -1.0 } else { 1.0 };
        ForceDimensionProtocol {
            sdk,
            id,
            spec: spec(&sdk, id, kind, renders_torque),
            has_wrist,
            gripper: has_gripper.then_some(Gripper { sign, is_closed: false }),
            stage: ForceDimensionStage::Opened,
            state: WILL_MOVE,
            polls_since_status: POLLS_PER_STATUS,
            enabled_at: Instant::now(),
            pose_rejects: PoseRejects::default(),
        }
    }

    /// Returns libdrd's functions if the device must be homed before use.
    fn must_home(&self) -> Option<Drd> {
        let drd = self.sdk.drd?;
        ((drd.is_supported)(self.id) != 0 && (drd.is_initialized)(self.id) == 0).then_some(drd)
    }

    fn begin_homing(&mut self) -> Result<(), DeviceError> {
        let (sdk, id) = (self.sdk, self.id);
        let Some(drd) = sdk.drd else { return Ok(()) };
        // The SDK keeps its errors per thread.
        let home = move || ((drd.auto_init)(id), sdk.error());
        let thread = thread::Builder::new().name("homing".into()).spawn(home);
        let thread = thread.map_err(|_| DeviceError::Lost { why: "cannot start a thread for homing", code: 0 })?;
        self.stage = ForceDimensionStage::Homing(thread);
        Ok(())
    }

    fn end_homing(&mut self) -> Result<(), DeviceError> {
        let ForceDimensionStage::Homing(thread) = std::mem::replace(&mut self.stage, ForceDimensionStage::Opened)
        else {
            return Ok(());
        };
        let (code, error) = thread.join().unwrap_or((-1, 0));
        if code < 0 {
            let why = "it did not find its zero position; switch it off and on, and keep the hands off while it moves";
            return Err(DeviceError::Lost { why, code: error });
        }
        if let Some(drd) = self.sdk.drd {
            // End regulation, but keep forces on.
            (drd.stop)(1, self.id);
        }
        self.start_forces();
        Ok(())
    }

    fn start_forces(&mut self) {
        let Sdk { enable_expert_mode, disable_expert_mode, set_watchdog, .. } = self.sdk;
        if let (Some(enable), Some(disable), Some(set)) = (enable_expert_mode, disable_expert_mode, set_watchdog) {
            enable();
            set(WATCHDOG, self.id);
            disable();
        }
        self.enable();
        self.stage = ForceDimensionStage::Running;
    }

    fn enable(&mut self) {
        (self.sdk.set_force)(0.0, 0.0, 0.0, self.id);
        (self.sdk.enable_force)(1, self.id);
        self.enabled_at = Instant::now();
    }

    /// Exchanges force and pose. The force is sent first: reading may block, and the force would be outdated
    /// afterwards.
    fn exchange_running(&mut self, output: &Wrench) -> Result<Option<DeviceReport>, DeviceError> {
        self.send_force(output)?;
        let read_started = Instant::now();
        let Some((place, rows)) = self.sdk.pose(self.id) else { return self.handle_failure() };
        if read_started.elapsed() > SLOW_READ {
            self.polls_since_status = POLLS_PER_STATUS;
        }
        self.maintain_force()?;
        let Some(pose) = self.world_pose(place, rows) else {
            return self.pose_rejects.reject().map(Some);
        };
        self.pose_rejects.reset();
        let is_trusted = !matches!(self.state, DeviceState::Calibrate { .. });
        let reading = Reading { pose, buttons: self.buttons() };
        Ok(Some(DeviceReport { reading: if is_trusted { reading } else { Reading::ABSENT }, state: self.state }))
    }

    /// Sends a force, zero while forces are off: gravity compensation and the watchdog depend on it.
    fn send_force(&mut self, output: &Wrench) -> Result<(), DeviceError> {
        let Wrench { force, torque } = if self.state.is_ready() { output.clamped_to(&self.spec) } else { Wrench::ZERO };
        let force = device_from_world(force).map(f64::from);
        // The SDK takes N·m.
        let torque = device_from_world(torque / 1000.0).map(f64::from);
        let ([fx, fy, fz], [tx, ty, tz]) = (force, torque);
        let code = match self.sdk.set_all {
            Some(set_all) if self.spec.max_torque > 0.0 => set_all(fx, fy, fz, tx, ty, tz, 0.0, self.id),
            _ => (self.sdk.set_force)(fx, fy, fz, self.id),
        };
        // A code of 2 means that the force was clamped, which is not an error.
        if code < 0 {
            self.polls_since_status = POLLS_PER_STATUS;
            self.handle_failure()?;
        }
        Ok(())
    }

    /// Handles a failed call: silence if the device may still answer, otherwise the device is lost.
    fn handle_failure(&self) -> Result<Option<DeviceReport>, DeviceError> {
        match self.sdk.error() {
            code @ (ERROR_COM | ERROR_NO_DEVICE_FOUND) => {
                Err(DeviceError::Lost { why: "the connection was lost; check its cable and power", code })
            }
            ERROR_TIMEOUT | ERROR_DHC_BUSY => Ok(None),
            // Refusals for other reasons show in the status, or as silence.
            _ => {
                thread::sleep(MIN_POLL_INTERVAL);
                Ok(None)
            }
        }
    }

    /// Reads the status periodically and updates the state; switches forces on again where that is allowed.
    fn maintain_force(&mut self) -> Result<(), DeviceError> {
        self.polls_since_status += 1;
        if self.polls_since_status < POLLS_PER_STATUS {
            return Ok(());
        }
        self.polls_since_status = 0;
        let Some(status) = self.sdk.status(self.id) else { return self.handle_failure().map(|_| ()) };
        let cause = status[STATUS_FORCE_OFF_CAUSE];
        if status[STATUS_CONNECTED] == 0 || cause == CAUSE_USB_DISCONNECTED {
            return Err(DeviceError::Lost { why: "the connection was lost; check its cable and power", code: cause });
        }
        let is_on = status[STATUS_FORCE] != 0;
        self.state = match cause {
            _ if status[STATUS_RESET] != 0 => DeviceState::Calibrate {
                how: "its zero position is unknown: run the vendor's initialisation program, or install libdrd",
            },
            _ if is_on => DeviceState::Ready,
            _ if status[STATUS_POWER] == 0 => DeviceState::ForceOff { why: "it has no power; switch it on" },
            CAUSE_BUTTON => {
                DeviceState::ForceOff { why: "forces were switched off at the device; press its force button" }
            }
            CAUSE_VELOCITY => DeviceState::ForceOff { why: "it moved too fast; hold it still for a moment" },
            CAUSE_WATCHDOG => DeviceState::ForceOff { why: "it or the program was late; wait a moment" },
            CAUSE_DEADMAN => DeviceState::ForceOff { why: "nobody holds the handle; take it in the hand" },
            _ => DeviceState::ForceOff { why: "the device switched its forces off; wait a moment" },
        };
        let may_enable = matches!(cause, CAUSE_NONE | CAUSE_VELOCITY | CAUSE_WATCHDOG | CAUSE_SOFTWARE);
        if is_on {
            self.enabled_at = Instant::now();
        } else if may_enable && self.enabled_at.elapsed() > FORCE_OFF_TIME {
            self.enable();
        }
        Ok(())
    }

    /// Converts metres and the device's axes to millimetres and world axes. At rest the shaft, +z of a handle, is
    /// along the device's x.
    fn world_pose(&self, [x, y, z]: [f64; 3], rows: [[f64; 3]; 3]) -> Option<Pose> {
        let position = Vec3::new(y as f32, z as f32, x as f32) * 1000.0;
        let orientation = match self.has_wrist {
            true => {
                let [[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]] = rows.map(|row| row.map(|x| x as f32));
                nearest_rotation(Vec3::new(yy, zy, xy), Vec3::new(yz, zz, xz), Vec3::new(yx, zx, xx))?
            }
            false => UPRIGHT,
        };
        plausible(Pose { position, orientation }, &self.spec)
    }

    /// Returns the buttons; a closed gripper counts as the main button.
    fn buttons(&mut self) -> u32 {
        let buttons = self.sdk.buttons(self.id);
        let Some(gripper) = &mut self.gripper else { return buttons };
        if let Some(angle) = self.sdk.gripper_angle(self.id) {
            gripper.update(angle);
        }
        buttons | u32::from(gripper.is_closed)
    }
}

impl Protocol for ForceDimensionProtocol {
    fn spec(&self) -> &DeviceSpec {
        &self.spec
    }

    /// Always [`Pacing::Host`]: the duration of the SDK's reads depends on USB and is not regular.
    fn pacing(&self) -> Pacing {
        Pacing::Host
    }

    fn exchange(&mut self, output: &Wrench) -> Result<Option<DeviceReport>, DeviceError> {
        let begun = Instant::now();
        let state = match &self.stage {
            ForceDimensionStage::Opened if self.must_home().is_some() => {
                self.stage = ForceDimensionStage::Announced(begun);
                WILL_MOVE
            }
            ForceDimensionStage::Opened => {
                self.start_forces();
                return Ok(None);
            }
            ForceDimensionStage::Announced(at) if at.elapsed() < ANNOUNCEMENT_TIME => WILL_MOVE,
            ForceDimensionStage::Announced(_) => {
                self.begin_homing()?;
                MOVES
            }
            ForceDimensionStage::Homing(thread) if !thread.is_finished() => MOVES,
            ForceDimensionStage::Homing(_) => {
                self.end_homing()?;
                return Ok(None);
            }
            ForceDimensionStage::Running => {
                let report = self.exchange_running(output)?;
                thread::sleep(MIN_POLL_INTERVAL.saturating_sub(begun.elapsed()));
                return Ok(report);
            }
        };
        thread::sleep(HOMING_POLL_INTERVAL);
        Ok(Some(DeviceReport { reading: Reading::ABSENT, state }))
    }

    /// Stops homing if it is running, sends a zero force, switches the motors off and closes the device.
    fn close(&mut self) {
        if let (ForceDimensionStage::Homing(thread), Some(drd)) = (&self.stage, self.sdk.drd) {
            (drd.stop)(0, self.id);
            let until = Instant::now() + CLOSE_WAIT;
            while !thread.is_finished() && Instant::now() < until {
                thread::sleep(Duration::from_millis(1));
            }
        }
        (self.sdk.set_force)(0.0, 0.0, 0.0, self.id);
        (self.sdk.enable_force)(0, self.id);
        self.sdk.close(self.id);
    }
}

/// Time for which closing waits for homing to end.
const CLOSE_WAIT: Duration = Duration::from_millis(300);

/// The gripper as a button, with hysteresis so that it does not chatter.
struct Gripper {
    /// -1 on left-handed devices, whose angles are negative.
    sign: f64,
    is_closed: bool,
}

/// rad: 5° and 8° of the 15° to 30° through which grippers open.
const GRIPPER_CLOSED_ANGLE: f64 = 0.087;
const GRIPPER_OPEN_ANGLE: f64 = 0.14;

impl Gripper {
    fn update(&mut self, angle: f64) {
        let most = if self.is_closed { GRIPPER_OPEN_ANGLE } else { GRIPPER_CLOSED_ANGLE };
        self.is_closed = self.sign * angle < most;
    }
}

/// Converts a world vector to the device's x, y, z, which point toward the user, to the right and up.
fn device_from_world(v: Vec3) -> [f32; 3] {
    [v.z, v.x, v.y]
}

/// System types of omega.6 and .7, sigma.7, lambda.6 and .7, right and left: for SDKs that cannot report a wrist.
const WRIST_SYSTEM_TYPES: [c_int; 10] = [34, 36, 35, 37, 104, 105, 108, 109, 131, 132];

/// N/mm. A wall buzzes above the damping of a relaxed pen grip (0.008 N·s/mm) divided by the delay from a position to
/// the force that answers it (up to 3 ms, with a poll at each end), which is 2.7. Measured: at 5 it buzzes by
/// millimetres.
const MAX_STIFFNESS: f32 = 2.0;

/// Returns the device's specification. Force, torque, damping and radius as CHAI3D uses them for stable rendering,
/// and half its stiffness, as for teeth. The vendor's data sheets state a single force, which the device renders for
/// hours, and steps below 0.01 mm; the mass at the handle is an estimate.
fn spec(sdk: &Sdk, id: DeviceId, kind: c_int, renders_torque: bool) -> DeviceSpec {
    // N, N·mm, N/mm, N·s/mm, mm, mm
    let (force, torque, stiffness, damping, radius, resolution) = match kind {
        60 => (8.0, 0.0, 3.0, 0.02, 40.0, 0.06),
        63 => (20.0, 0.0, 5.0, 0.03, 150.0, 0.01),
        104 | 105 | 206 => (12.0, 200.0, 4.0, 0.03, 75.0, 0.01),
        108 | 109 | 131 | 132 | 203 => (12.0, 200.0, 8.0, 0.03, 112.5, 0.01),
        _ => (12.0, 0.0, 5.0, 0.03, 75.0, 0.01),
    };
    // Zero or negative: no limit was set.
    let limit = sdk.max_force.map(|most| most(id) as f32).filter(|most| *most > 0.0);
    let max_force = limit.map_or(force, |limit| limit.min(force));
    DeviceSpec {
        name: sdk.name(id),
        max_force,
        continuous_force: max_force,
        max_torque: if renders_torque { torque } else { 0.0 },
        max_stiffness: MAX_STIFFNESS.min(stiffness / 2.0),
        max_damping: damping,
        resolution,
        workspace_half: Vec3::splat(radius),
        apparent_mass: 0.2,
        page_force: None,
    }
}
