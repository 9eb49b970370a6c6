//! Force Dimension omega, delta, sigma and lambda, and the Falcon, through the vendor's SDK (libdrd or libdhd).
//!
//! Takes and gives what every wire does. Homing moves the device by itself: it is announced, then runs on a thread of its
//! own while the wire keeps reporting. Never raises a guard of the device: over-speed and watchdog stay on, and the
//! device's own velocity, which fails until its window is full, is not used.
//!
//! Sources: `dhdc.h` and `drdc.h` of SDK 3.17, how CHAI3D and the SDK's Python wrapper use them. Axes as CHAI3D takes them:
//! x toward the user, y to the right, z up.

// C is called here: what each block relies on stands beside it.
#![allow(unsafe_code)]

use super::trust::{self, Nonsense};
use super::{
    Beat, Device, Driver, Found, Gone, Output, Reading, Relay, Report, Spec, State, Trouble, UPRIGHT, Wire,
    shared_library,
};
use crate::frame::{Pose, Vec3, rotation_near};
use libloading::Library;
use std::ffi::{CStr, OsStr, c_char, c_int, c_uint};
use std::mem::ManuallyDrop;
use std::path::PathBuf;
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

pub struct ForceDimension;

impl Driver for ForceDimension {
    fn name(&self) -> &'static str {
        "forcedimension"
    }

    fn about(&self) -> &'static str {
        "Force Dimension omega, delta, sigma, lambda, and the Falcon; after the colon: the path of libdrd or libdhd"
    }

    fn find(&self) -> Result<Vec<Found>, Trouble> {
        let sdk = Sdk::find(None)?;
        if sdk.count.is_some_and(|count| count() <= 0) {
            return Ok(Vec::new());
        }
        let id = sdk.open()?;
        let title = sdk.name(id);
        sdk.close(id);
        Ok(vec![Found { title, argument: String::new() }])
    }

    fn open(&self, argument: Option<&str>) -> Result<Box<dyn Device + Send>, Trouble> {
        let sdk = Sdk::find(argument)?;
        let id = sdk.open()?;
        Ok(Box::new(Relay::start(Robot::new(sdk, id))))
    }
}

/// libdrd holds all of libdhd, and homing besides: so it comes first.
const NAMES: &[&str] = if cfg!(windows) {
    if cfg!(target_pointer_width = "64") { &["drd64.dll", "dhd64.dll"] } else { &["drd.dll", "dhd.dll"] }
} else if cfg!(target_os = "macos") {
    &["libdrd.dylib", "libdhd.dylib"]
} else {
    &["libdrd.so", "libdrd.so.3", "libdhd.so", "libdhd.so.3"]
};

const INSTALL: &str = "install the Force Dimension SDK (forcedimension.com) and set FDSDK to its folder, or name the \
                       library: --device forcedimension:/path/to/libdrd.so";

/// Where the loader looks, then where the vendor's instructions and its installer put the SDK.
fn usual_places() -> Vec<PathBuf> {
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
    NAMES.iter().flat_map(|name| folders.iter().map(move |folder| folder.join(name))).collect()
}

/// Which of the open devices a call is for. Opening gives the number; the SDK's "current device", -1, is never used.
type Id = c_char;

/// The functions of the SDK that are called here. What old or small versions lack is optional.
///
/// Those that take and give only numbers are declared safe: the SDK answers a wrong number with an error, never with
/// broken memory. Truth values are bytes: C++ writes 0 or 1, and nothing depends on it.
#[derive(Clone, Copy)]
struct Sdk {
    open: extern "system" fn() -> c_int,
    close: extern "system" fn(Id) -> c_int,
    last_error_text: extern "system" fn() -> *const c_char,
    position: unsafe extern "system" fn(*mut f64, *mut f64, *mut f64, Id) -> c_int,
    status: unsafe extern "system" fn(*mut c_int, Id) -> c_int,
    set_force: extern "system" fn(f64, f64, f64, Id) -> c_int,
    enable_force: extern "system" fn(u8, Id) -> c_int,
    button: extern "system" fn(c_int, Id) -> c_int,
    count: Option<extern "system" fn() -> c_int>,
    last_error: Option<extern "system" fn() -> c_int>,
    system_name: Option<extern "system" fn(Id) -> *const c_char>,
    system_type: Option<extern "system" fn(Id) -> c_int>,
    pose: Option<unsafe extern "system" fn(*mut f64, *mut f64, *mut f64, *mut [[f64; 3]; 3], Id) -> c_int>,
    orientation: Option<unsafe extern "system" fn(*mut [[f64; 3]; 3], Id) -> c_int>,
    button_mask: Option<extern "system" fn(Id) -> c_uint>,
    has_wrist: Option<extern "system" fn(Id) -> u8>,
    has_active_wrist: Option<extern "system" fn(Id) -> u8>,
    has_gripper: Option<extern "system" fn(Id) -> u8>,
    is_left_handed: Option<extern "system" fn(Id) -> u8>,
    gripper_angle: Option<unsafe extern "system" fn(*mut f64, Id) -> c_int>,
    /// Force, torque, force of the gripper.
    set_all: Option<extern "system" fn(f64, f64, f64, f64, f64, f64, f64, Id) -> c_int>,
    max_force: Option<extern "system" fn(Id) -> f64>,
    enable_expert_mode: Option<extern "system" fn() -> c_int>,
    disable_expert_mode: Option<extern "system" fn() -> c_int>,
    set_watchdog: Option<extern "system" fn(u8, Id) -> c_int>,
    drd: Option<Drd>,
}

/// What only libdrd has: motion of its own.
#[derive(Clone, Copy)]
struct Drd {
    open: extern "system" fn() -> c_int,
    close: extern "system" fn(Id) -> c_int,
    is_supported: extern "system" fn(Id) -> u8,
    is_initialized: extern "system" fn(Id) -> u8,
    auto_init: extern "system" fn(Id) -> c_int,
    /// The first argument is whether forces stay usable.
    stop: extern "system" fn(u8, Id) -> c_int,
}

/// The vendor's numbers of errors that are told apart here.
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

/// SDK 3.17 writes 17 numbers; the rest is room for later versions.
const STATUS_ROOM: usize = 64;

const CAUSE_NONE: c_int = 0;
const CAUSE_BUTTON: c_int = 1;
const CAUSE_VELOCITY: c_int = 2;
const CAUSE_WATCHDOG: c_int = 3;
const CAUSE_SOFTWARE: c_int = 4;
const CAUSE_USB_DISCONNECTED: c_int = 5;
const CAUSE_DEADMAN: c_int = 6;

impl Sdk {
    fn find(argument: Option<&str>) -> Result<Sdk, Trouble> {
        shared_library::load(argument, usual_places(), INSTALL, Sdk::load)
    }

    /// Loads the library and keeps it: threads of its own may still run in it.
    fn load(path: &OsStr) -> Result<Sdk, libloading::Error> {
        // SAFETY: whoever names or installs the vendor's library wants its start-up code to run.
        let library = ManuallyDrop::new(unsafe { Library::new(path)? });
        // SAFETY: names and signatures are those of the vendor's header (dhdc.h), and the library is never unloaded, so the
        // pointers stay good.
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
                count: optional(&library, "dhdGetDeviceCount"),
                last_error: optional(&library, "dhdErrorGetLast"),
                system_name: optional(&library, "dhdGetSystemName"),
                system_type: optional(&library, "dhdGetSystemType"),
                pose: optional(&library, "dhdGetPositionAndOrientationFrame"),
                orientation: optional(&library, "dhdGetOrientationFrame"),
                button_mask: optional(&library, "dhdGetButtonMask"),
                has_wrist: optional(&library, "dhdHasWrist"),
                has_active_wrist: optional(&library, "dhdHasActiveWrist"),
                has_gripper: optional(&library, "dhdHasGripper"),
                is_left_handed: optional(&library, "dhdIsLeftHanded"),
                gripper_angle: optional(&library, "dhdGetGripperAngleRad"),
                set_all: optional(&library, "dhdSetForceAndTorqueAndGripperForce"),
                max_force: optional(&library, "dhdGetMaxForce"),
                enable_expert_mode: optional(&library, "dhdEnableExpertMode"),
                disable_expert_mode: optional(&library, "dhdDisableExpertMode"),
                set_watchdog: optional(&library, "dhdSetWatchdog"),
                drd: Drd::load(&library),
            })
        }
    }

    /// Opens the first device, through libdrd where it is there: only what it opened can it home.
    fn open(&self) -> Result<Id, Trouble> {
        let id = self.drd.map_or(self.open, |drd| drd.open)();
        if id >= 0 {
            return Ok(id as Id);
        }
        let help = match self.error() {
            ERROR_DEVICE_IN_USE => "end the other program that uses the device",
            _ => "plug the device in, switch it on, and allow users to reach it (udev rule for vendor 1451)",
        };
        Err(Trouble::new(format!("the Force Dimension SDK opens no device: {}", self.error_text()), help))
    }

    fn close(&self, id: Id) {
        self.drd.map_or(self.close, |drd| drd.close)(id);
    }

    fn name(&self, id: Id) -> String {
        let name = self.system_name.map(|name| owned(name(id))).unwrap_or_default();
        if name.is_empty() { "Force Dimension device".into() } else { name }
    }

    /// The number of this thread's last error; 0 where the library does not tell.
    fn error(&self) -> i32 {
        self.last_error.map_or(0, |last| last())
    }

    fn error_text(&self) -> String {
        owned((self.last_error_text)())
    }

    fn status(&self, id: Id) -> Option<[c_int; STATUS_ROOM]> {
        let mut status = [0; STATUS_ROOM];
        // SAFETY: there is room for more numbers than any version writes.
        let code = unsafe { (self.status)(status.as_mut_ptr(), id) };
        (code >= 0).then_some(status)
    }

    /// Place, m, and orientation by rows, in the device's axes. A code of 1 means that the last answer is still fresh.
    fn pose(&self, id: Id) -> Option<([f64; 3], [[f64; 3]; 3])> {
        let [mut x, mut y, mut z] = [0.0; 3];
        let mut rows = IDENTITY;
        // SAFETY: each pointer is to a local of the type that the header asks for.
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

    /// rad; negative on left-handed devices.
    fn gripper_angle(&self, id: Id) -> Option<f64> {
        let mut angle = 0.0;
        // SAFETY: the pointer is to a local of the type that the header asks for.
        let code = unsafe { self.gripper_angle?(&mut angle, id) };
        (code >= 0).then_some(angle)
    }

    fn buttons(&self, id: Id) -> u32 {
        match self.button_mask {
            Some(mask) => mask(id) & BUTTONS,
            None => (0..BUTTONS.count_ones()).filter(|i| (self.button)(i.cast_signed(), id) == 1).map(|i| 1 << i).sum(),
        }
    }
}

impl Drd {
    /// All or nothing: homing that cannot be stopped is none.
    fn load(library: &Library) -> Option<Drd> {
        // SAFETY: names and signatures are those of the vendor's header (drdc.h), and the library is never unloaded.
        unsafe {
            Some(Drd {
                open: optional(library, "drdOpen")?,
                close: optional(library, "drdClose")?,
                is_supported: optional(library, "drdIsSupported")?,
                is_initialized: optional(library, "drdIsInitialized")?,
                auto_init: optional(library, "drdAutoInit")?,
                stop: optional(library, "drdStop")?,
            })
        }
    }
}

/// # Safety
/// `T` is the function's type, and the library is never unloaded.
unsafe fn optional<T: Copy>(library: &Library, name: &str) -> Option<T> {
    // SAFETY: passed on to the caller.
    unsafe { library.get::<T>(name) }.ok().map(|symbol| *symbol)
}

fn owned(text: *const c_char) -> String {
    if text.is_null() {
        return String::new();
    }
    // SAFETY: only texts of the SDK come here: null, or ending with zero and alive until the next call on this thread.
    unsafe { CStr::from_ptr(text) }.to_string_lossy().into_owned()
}

const IDENTITY: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// The bits that stand for buttons (CHAI3D keeps five).
const BUTTONS: u32 = 0b11111;

/// The wire.
struct Robot {
    sdk: Sdk,
    id: Id,
    spec: Spec,
    has_wrist: bool,
    gripper: Option<Gripper>,
    stage: Stage,
    state: State,
    /// Turns since the status was last asked for.
    turns: u32,
    /// When the motors were last switched on, or seen on.
    enabled: Instant,
    /// Reports in a row that made no sense.
    nonsense: Nonsense,
}

enum Stage {
    Opened,
    /// Homing is announced and not begun.
    Announced(Instant),
    /// Gives the result of homing, and the SDK's number for what went wrong.
    Homing(JoinHandle<(c_int, i32)>),
    Running,
}

/// How long homing is announced before the device moves: time to take the hands away.
const ANNOUNCED: Duration = Duration::from_secs(3);

const WILL_MOVE: State = State::Homing { what: "it will move by itself in a moment; take the hands off" };
const MOVES: State = State::Homing { what: "it moves by itself to find its zero; keep the hands off" };

/// While homing the wire only reports that it does.
const HOMING_TURN: Duration = Duration::from_millis(5);

/// The SDK's own reads take a few hundred µs; where it has a fresh answer and returns at once, a turn is stretched to so
/// much, so that the wire does not eat a core.
const TURN: Duration = Duration::from_micros(250);

/// Turns between two looks at the status.
const STATUS_TURNS: u32 = 10;

/// The device drops its force if none is told for so long, in units of 125 µs: 20 ms, as the relay does for silence.
const WATCHDOG: u8 = 160;

/// A read that takes longer may have let the watchdog bite: the status is asked for at once.
const SLOW: Duration = Duration::from_millis(10);

/// How long forces stay off after the device dropped them: long enough to settle.
const OFF_LIFE: Duration = Duration::from_millis(500);

impl Robot {
    fn new(sdk: Sdk, id: Id) -> Robot {
        let kind = sdk.system_type.map_or(0, |kind| kind(id));
        let says = |question: Option<extern "system" fn(Id) -> u8>| question.map(|asked| asked(id) != 0);
        let can_tell = sdk.pose.is_some() || sdk.orientation.is_some();
        let has_wrist = can_tell && says(sdk.has_wrist).unwrap_or(HAVE_WRIST.contains(&kind));
        let renders_torque = says(sdk.has_active_wrist).unwrap_or(false) && sdk.set_all.is_some();
        let has_gripper = says(sdk.has_gripper).unwrap_or(false) && sdk.gripper_angle.is_some();
        let sign = if says(sdk.is_left_handed).unwrap_or(false) { -1.0 } else { 1.0 };
        Robot {
            sdk,
            id,
            spec: spec(&sdk, id, kind, renders_torque),
            has_wrist,
            gripper: has_gripper.then_some(Gripper { sign, is_closed: false }),
            stage: Stage::Opened,
            state: WILL_MOVE,
            turns: STATUS_TURNS,
            enabled: Instant::now(),
            nonsense: Nonsense::default(),
        }
    }

    /// Whether the device moves by itself before it can be used.
    fn must_home(&self) -> Option<Drd> {
        let drd = self.sdk.drd?;
        ((drd.is_supported)(self.id) != 0 && (drd.is_initialized)(self.id) == 0).then_some(drd)
    }

    fn begin_homing(&mut self) -> Result<(), Gone> {
        let (sdk, id) = (self.sdk, self.id);
        let Some(drd) = sdk.drd else { return Ok(()) };
        // The SDK keeps its errors per thread.
        let home = move || ((drd.auto_init)(id), sdk.error());
        let thread = thread::Builder::new().name("homing".into()).spawn(home);
        let thread = thread.map_err(|_| Gone::Lost { why: "the system gives no thread for homing", code: 0 })?;
        self.stage = Stage::Homing(thread);
        Ok(())
    }

    fn end_homing(&mut self) -> Result<(), Gone> {
        let Stage::Homing(thread) = std::mem::replace(&mut self.stage, Stage::Opened) else { return Ok(()) };
        let (code, error) = thread.join().unwrap_or((-1, 0));
        if code < 0 {
            let why = "it did not find its zero; switch it off and on, and keep the hands off while it moves";
            return Err(Gone::Lost { why, code: error });
        }
        if let Some(drd) = self.sdk.drd {
            // Regulation ends, forces stay.
            (drd.stop)(1, self.id);
        }
        self.begin();
        Ok(())
    }

    fn begin(&mut self) {
        let Sdk { enable_expert_mode, disable_expert_mode, set_watchdog, .. } = self.sdk;
        if let (Some(enable), Some(disable), Some(set)) = (enable_expert_mode, disable_expert_mode, set_watchdog) {
            enable();
            set(WATCHDOG, self.id);
            disable();
        }
        self.enable();
        self.stage = Stage::Running;
    }

    fn enable(&mut self) {
        (self.sdk.set_force)(0.0, 0.0, 0.0, self.id);
        (self.sdk.enable_force)(1, self.id);
        self.enabled = Instant::now();
    }

    /// The force first: reading may block, and what was told before it is old after it.
    fn run(&mut self, told: &Output) -> Result<Option<Report>, Gone> {
        self.tell(told)?;
        let asked = Instant::now();
        let Some((place, rows)) = self.sdk.pose(self.id) else { return self.refused() };
        if asked.elapsed() > SLOW {
            self.turns = STATUS_TURNS;
        }
        self.look_after_force()?;
        let Some(pose) = self.world_pose(place, rows) else {
            return self.nonsense.refuse().map(Some);
        };
        self.nonsense.forgive();
        let is_trusted = !matches!(self.state, State::Calibrate { .. });
        let reading = Reading { pose, buttons: self.buttons() };
        Ok(Some(Report { reading: if is_trusted { reading } else { Reading::ABSENT }, state: self.state }))
    }

    /// Forces are told even while they are off: gravity compensation and watchdog hang on it.
    fn tell(&mut self, told: &Output) -> Result<(), Gone> {
        let Output { force, torque } = if self.state.is_ready() { told.within(&self.spec) } else { Output::NONE };
        let force = device_from_world(force).map(f64::from);
        // The SDK takes N·m.
        let torque = device_from_world(torque / 1000.0).map(f64::from);
        let ([fx, fy, fz], [tx, ty, tz]) = (force, torque);
        let code = match self.sdk.set_all {
            Some(set_all) if self.spec.max_torque > 0.0 => set_all(fx, fy, fz, tx, ty, tz, 0.0, self.id),
            _ => (self.sdk.set_force)(fx, fy, fz, self.id),
        };
        // 2 means that it was clipped, and is success.
        if code < 0 {
            self.turns = STATUS_TURNS;
            self.refused()?;
        }
        Ok(())
    }

    /// A call failed: silence if the device may yet answer, else it is gone.
    fn refused(&self) -> Result<Option<Report>, Gone> {
        match self.sdk.error() {
            code @ (ERROR_COM | ERROR_NO_DEVICE_FOUND) => {
                Err(Gone::Lost { why: "the connection to it broke; check its cable and power", code })
            }
            ERROR_TIMEOUT | ERROR_DHC_BUSY => Ok(None),
            // Refusals for other reasons show in the status, or as silence.
            _ => {
                thread::sleep(TURN);
                Ok(None)
            }
        }
    }

    /// Asks now and then whether forces are on, and why not; switches them on again where the device may.
    fn look_after_force(&mut self) -> Result<(), Gone> {
        self.turns += 1;
        if self.turns < STATUS_TURNS {
            return Ok(());
        }
        self.turns = 0;
        let Some(status) = self.sdk.status(self.id) else { return self.refused().map(|_| ()) };
        let cause = status[STATUS_FORCE_OFF_CAUSE];
        if status[STATUS_CONNECTED] == 0 || cause == CAUSE_USB_DISCONNECTED {
            return Err(Gone::Lost { why: "the connection to it broke; check its cable and power", code: cause });
        }
        let is_on = status[STATUS_FORCE] != 0;
        self.state = match cause {
            _ if status[STATUS_RESET] != 0 => State::Calibrate {
                how: "it does not know its zero: run the vendor's initialisation program, or install libdrd",
            },
            _ if is_on => State::Ready,
            _ if status[STATUS_POWER] == 0 => State::ForceOff { why: "it has no power; switch it on" },
            CAUSE_BUTTON => State::ForceOff { why: "forces were switched off at the device; press its force button" },
            CAUSE_VELOCITY => State::ForceOff { why: "it moved too fast; hold it still for a moment" },
            CAUSE_WATCHDOG => State::ForceOff { why: "it or the program was late; hold on for a moment" },
            CAUSE_DEADMAN => State::ForceOff { why: "nobody holds the handle; take it in the hand" },
            _ => State::ForceOff { why: "the device switched its forces off; hold on for a moment" },
        };
        let may_enable = matches!(cause, CAUSE_NONE | CAUSE_VELOCITY | CAUSE_WATCHDOG | CAUSE_SOFTWARE);
        if is_on {
            self.enabled = Instant::now();
        } else if may_enable && self.enabled.elapsed() > OFF_LIFE {
            self.enable();
        }
        Ok(())
    }

    /// mm and world axes, from metres and the device's; the handle's shaft, our z, lies along the device's x at rest.
    fn world_pose(&self, [x, y, z]: [f64; 3], rows: [[f64; 3]; 3]) -> Option<Pose> {
        let position = Vec3::new(y as f32, z as f32, x as f32) * 1000.0;
        let orientation = match self.has_wrist {
            true => {
                let [[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]] = rows.map(|row| row.map(|x| x as f32));
                rotation_near(Vec3::new(yy, zy, xy), Vec3::new(yz, zz, xz), Vec3::new(yx, zx, xx))?
            }
            false => UPRIGHT,
        };
        trust::sensible(Pose { position, orientation }, &self.spec)
    }

    /// A closed gripper is the main button.
    fn buttons(&mut self) -> u32 {
        let buttons = self.sdk.buttons(self.id);
        let Some(gripper) = &mut self.gripper else { return buttons };
        if let Some(angle) = self.sdk.gripper_angle(self.id) {
            gripper.follow(angle);
        }
        buttons | u32::from(gripper.is_closed)
    }
}

impl Wire for Robot {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    /// The SDK's reads take as long as USB does, which is no beat to rely on.
    fn beat(&self) -> Beat {
        Beat::Ours
    }

    fn turn(&mut self, told: &Output) -> Result<Option<Report>, Gone> {
        let begun = Instant::now();
        let state = match &self.stage {
            Stage::Opened if self.must_home().is_some() => {
                self.stage = Stage::Announced(begun);
                WILL_MOVE
            }
            Stage::Opened => {
                self.begin();
                return Ok(None);
            }
            Stage::Announced(at) if at.elapsed() < ANNOUNCED => WILL_MOVE,
            Stage::Announced(_) => {
                self.begin_homing()?;
                MOVES
            }
            Stage::Homing(thread) if !thread.is_finished() => MOVES,
            Stage::Homing(_) => {
                self.end_homing()?;
                return Ok(None);
            }
            Stage::Running => {
                let report = self.run(told)?;
                thread::sleep(TURN.saturating_sub(begun.elapsed()));
                return Ok(report);
            }
        };
        thread::sleep(HOMING_TURN);
        Ok(Some(Report { reading: Reading::ABSENT, state }))
    }

    /// Stops homing, if it runs; a force of nothing, motors off, closed.
    fn close(&mut self) {
        if let (Stage::Homing(thread), Some(drd)) = (&self.stage, self.sdk.drd) {
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

/// How long closing waits for homing to end.
const CLOSE_WAIT: Duration = Duration::from_millis(300);

/// The gripper as a button, with some play so that it does not chatter.
struct Gripper {
    /// -1 on left-handed devices, whose angles are negative.
    sign: f64,
    is_closed: bool,
}

/// rad: 5° and 8° of the 15° to 30° that grippers open.
const CLOSED: f64 = 0.087;
const OPEN: f64 = 0.14;

impl Gripper {
    fn follow(&mut self, angle: f64) {
        let most = if self.is_closed { OPEN } else { CLOSED };
        self.is_closed = self.sign * angle < most;
    }
}

/// x, y, z of the device, which point toward the user, to the right and up.
fn device_from_world(v: Vec3) -> [f32; 3] {
    [v.z, v.x, v.y]
}

/// System types of omega.6 and .7, sigma.7, lambda.6 and .7, right and left: for SDKs that cannot be asked for a wrist.
const HAVE_WRIST: [c_int; 10] = [34, 36, 35, 37, 104, 105, 108, 109, 131, 132];

/// N/mm. Beyond the damping of a relaxed pen grip (0.008 N·s/mm) over the time from a place to the force that answers it
/// (up to 3 ms through a poll at each end) a wall buzzes: that is 2.7. Measured: 5 buzzes by millimetres.
const STIFFEST: f32 = 2.0;

/// Force, torque, damping and radius as CHAI3D uses them for stable rendering, and half its stiffness, as for teeth. The vendor's data sheets give one
/// force, which it renders for hours, and steps below 0.01 mm; the mass at the handle is an estimate.
fn spec(sdk: &Sdk, id: Id, kind: c_int, renders_torque: bool) -> Spec {
    // N, N·mm, N/mm, N·s/mm, mm, mm
    let (force, torque, stiffness, damping, radius, resolution) = match kind {
        60 => (8.0, 0.0, 3.0, 0.02, 40.0, 0.06),
        63 => (20.0, 0.0, 5.0, 0.03, 150.0, 0.01),
        104 | 105 | 206 => (12.0, 200.0, 4.0, 0.03, 75.0, 0.01),
        108 | 109 | 131 | 132 | 203 => (12.0, 200.0, 8.0, 0.03, 112.5, 0.01),
        _ => (12.0, 0.0, 5.0, 0.03, 75.0, 0.01),
    };
    // Negative or nothing: no limit was set.
    let limit = sdk.max_force.map(|most| most(id) as f32).filter(|most| *most > 0.0);
    let max_force = limit.map_or(force, |limit| limit.min(force));
    Spec {
        name: sdk.name(id),
        max_force,
        continuous_force: max_force,
        max_torque: if renders_torque { torque } else { 0.0 },
        max_stiffness: STIFFEST.min(stiffness / 2.0),
        max_damping: damping,
        resolution,
        workspace_half: Vec3::splat(radius),
        apparent_mass: 0.2,
    }
}
