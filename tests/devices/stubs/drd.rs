//! A stub of libdrd that behaves like the vendor's library, with a model of the hand instead of a device. The tests
//! build it as a shared library, and the driver opens it like the real one.
//!
//! The device is updated once per millisecond, independently of calls: first the watchdog, then one step of the hand.
//! Built with `--cfg small` it lacks the functions that old versions lack. The `stub_*` functions are for the tests:
//! they connect the hand and switch on faults.

use std::ffi::{c_char, c_int, c_void};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// State of the physical model after a force and torque, N and N·m: position, m, and rows of the orientation, in the
/// device's axes, and buttons.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Sample {
    place: [f64; 3],
    rows: [[f64; 3]; 3],
    buttons: u32,
}

type Hand = extern "C" fn(*mut c_void, *const f64, *mut Sample);

struct Device {
    is_open: bool,
    sample: Sample,
    /// Turns of the device, and the one that was read last: a second read of it is guarded.
    turn: u64,
    read: u64,
    told: [f64; 7],
    told_at: Option<Instant>,
    force: bool,
    cause: c_int,
    /// 125 µs each; 0 is off.
    watchdog: u8,
    expert: bool,
    error: c_int,
    is_unplugged: bool,
    is_late: bool,
    is_garbage: bool,
    is_over_speed: bool,
    needs_homing: bool,
    homing: bool,
    stop_homing: bool,
    homed: u32,
    has_wrist: bool,
    has_active_wrist: bool,
    is_left_handed: bool,
    /// Opening of the gripper, rad; `None` for a device without.
    gripper: Option<f64>,
    system_type: c_int,
}

const NO_SAMPLE: Sample = Sample { place: [0.0; 3], rows: [[0.0; 3]; 3], buttons: 0 };

static DEVICE: Mutex<Device> = Mutex::new(Device {
    is_open: false,
    sample: NO_SAMPLE,
    turn: 1,
    read: 0,
    told: [0.0; 7],
    told_at: None,
    force: false,
    cause: 0,
    watchdog: 0,
    expert: false,
    error: 0,
    is_unplugged: false,
    is_late: false,
    is_garbage: false,
    is_over_speed: false,
    needs_homing: false,
    homing: false,
    stop_homing: false,
    homed: 0,
    has_wrist: true,
    has_active_wrist: false,
    is_left_handed: false,
    gripper: None,
    system_type: 34,
});

static MOTOR: Mutex<Option<JoinHandle<()>>> = Mutex::new(None);
static LIVES: AtomicBool = AtomicBool::new(false);

const ID: c_char = 3;
const ERROR: c_int = 1;
const COM: c_int = 2;
const NO_DEVICE_FOUND: c_int = 5;
const TIMEOUT: c_int = 7;
const EXPERT_MODE_DISABLED: c_int = 9;
const DEVICE_IN_USE: c_int = 20;
const NOT_ENABLED: c_int = 19;
const TIMEGUARD: c_int = 1;
const MOTOR_SATURATED: c_int = 2;
const MAX_FORCE: f64 = 12.0;

fn device() -> std::sync::MutexGuard<'static, Device> {
    DEVICE.lock().unwrap_or_else(|e| e.into_inner())
}

impl Device {
    fn fail(&mut self, error: c_int) -> c_int {
        self.error = error;
        -1
    }

    /// Every call for one device passes here.
    fn answers(&mut self, id: c_char) -> Result<(), c_int> {
        match () {
            () if self.is_unplugged => Err(self.fail(COM)),
            () if !self.is_open || id != ID => Err(self.fail(NO_DEVICE_FOUND)),
            () => Ok(()),
        }
    }

    fn drop_force(&mut self, cause: c_int) {
        if self.force {
            self.force = false;
            self.cause = cause;
        }
    }

    fn tell(&mut self, told: [f64; 7]) -> c_int {
        self.told_at = Some(Instant::now());
        let length = told[..3].iter().map(|f| f * f).sum::<f64>().sqrt();
        self.told = told;
        if length > MAX_FORCE {
            for f in &mut self.told[..3] {
                *f *= MAX_FORCE / length;
            }
            return MOTOR_SATURATED;
        }
        // The last per cent of the motors is where they saturate.
        if length > 0.9 * MAX_FORCE { MOTOR_SATURATED } else { 0 }
    }
}

#[unsafe(no_mangle)]
pub extern "C" fn stub_connect(hand: Hand, context: *mut c_void) {
    LIVES.store(true, Ordering::Release);
    let context = context as usize;
    let motor = std::thread::spawn(move || {
        while LIVES.load(Ordering::Acquire) {
            std::thread::sleep(Duration::from_millis(1));
            let told = {
                let mut d = device();
                let patience = Duration::from_micros(125 * u64::from(d.watchdog));
                if d.watchdog > 0 && d.told_at.is_some_and(|at| at.elapsed() > patience) {
                    d.drop_force(3);
                }
                if d.is_over_speed {
                    d.drop_force(2);
                }
                if d.is_unplugged {
                    d.drop_force(5);
                }
                if d.force && d.is_open { d.told } else { [0.0; 7] }
            };
            let mut sample = NO_SAMPLE;
            hand(context as *mut c_void, told.as_ptr(), &mut sample);
            let mut d = device();
            if d.is_garbage {
                sample.place = [f64::NAN; 3];
            }
            if !d.has_wrist {
                sample.rows = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
            }
            d.sample = sample;
            d.turn += 1;
        }
    });
    *MOTOR.lock().unwrap() = Some(motor);
}

#[unsafe(no_mangle)]
pub extern "C" fn stub_disconnect() {
    LIVES.store(false, Ordering::Release);
    if let Some(motor) = MOTOR.lock().unwrap().take() {
        let _ = motor.join();
    }
}

#[unsafe(no_mangle)]
pub extern "C" fn stub_unplug(is_unplugged: bool) {
    let mut d = device();
    d.is_unplugged = is_unplugged;
}

#[unsafe(no_mangle)]
pub extern "C" fn stub_late(is_late: bool) {
    device().is_late = is_late;
}

#[unsafe(no_mangle)]
pub extern "C" fn stub_garbage(is_garbage: bool) {
    device().is_garbage = is_garbage;
}

/// While it lasts, the device keeps braking.
#[unsafe(no_mangle)]
pub extern "C" fn stub_over_speed(is_over_speed: bool) {
    device().is_over_speed = is_over_speed;
}

/// The person presses the force button on the base.
#[unsafe(no_mangle)]
pub extern "C" fn stub_force_button(switches_on: bool) {
    let mut d = device();
    if switches_on {
        d.force = true;
        d.cause = 0;
    } else {
        d.drop_force(1);
    }
}

#[unsafe(no_mangle)]
pub extern "C" fn stub_needs_homing() {
    device().needs_homing = true;
}

/// 1 while it moves, and how often it has found its zero, times two.
#[unsafe(no_mangle)]
pub extern "C" fn stub_homing() -> u32 {
    let d = device();
    u32::from(d.homing) + 2 * d.homed
}

/// A sigma.7: torque and a gripper, and the hand it is for.
#[unsafe(no_mangle)]
pub extern "C" fn stub_sigma(is_left_handed: bool) {
    let mut d = device();
    d.system_type = if is_left_handed { 105 } else { 104 };
    d.has_active_wrist = true;
    d.is_left_handed = is_left_handed;
    d.gripper = Some(0.4);
}

/// An omega.3: no wrist.
#[unsafe(no_mangle)]
pub extern "C" fn stub_no_wrist() {
    let mut d = device();
    d.system_type = 33;
    d.has_wrist = false;
}

/// Sets the opening angle of the gripper, rad.
#[unsafe(no_mangle)]
pub extern "C" fn stub_gripper(opening: f64) {
    device().gripper = Some(opening);
}

#[unsafe(no_mangle)]
pub extern "C" fn stub_watchdog() -> u8 {
    device().watchdog
}

fn open() -> c_int {
    let mut d = device();
    if d.is_unplugged {
        return d.fail(NO_DEVICE_FOUND);
    }
    if d.is_open {
        return d.fail(DEVICE_IN_USE);
    }
    d.is_open = true;
    d.force = false;
    d.cause = 0;
    d.told = [0.0; 7];
    d.told_at = None;
    c_int::from(ID)
}

fn close(id: c_char) -> c_int {
    let mut d = device();
    // Closing works for a device that was pulled out, too.
    if !d.is_open || id != ID {
        return d.fail(NO_DEVICE_FOUND);
    }
    d.is_open = false;
    d.force = false;
    0
}

#[unsafe(no_mangle)]
pub extern "system" fn dhdOpen() -> c_int {
    open()
}

#[unsafe(no_mangle)]
pub extern "system" fn dhdClose(id: c_char) -> c_int {
    close(id)
}

#[unsafe(no_mangle)]
pub extern "system" fn dhdErrorGetLastStr() -> *const c_char {
    let text: &[u8] = match device().error {
        0 => b"no error\0",
        COM => b"communication error\0",
        NO_DEVICE_FOUND => b"no device found\0",
        TIMEOUT => b"timeout\0",
        DEVICE_IN_USE => b"device already in use\0",
        _ => b"error\0",
    };
    text.as_ptr().cast()
}

fn waits() {
    if device().is_late {
        std::thread::sleep(Duration::from_millis(50));
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "system" fn dhdGetPosition(x: *mut f64, y: *mut f64, z: *mut f64, id: c_char) -> c_int {
    waits();
    let mut d = device();
    if let Err(code) = d.answers(id) {
        return code;
    }
    let [px, py, pz] = d.sample.place;
    unsafe { (*x, *y, *z) = (px, py, pz) };
    let is_guarded = d.read == d.turn;
    d.read = d.turn;
    if is_guarded { TIMEGUARD } else { 0 }
}

#[unsafe(no_mangle)]
pub unsafe extern "system" fn dhdGetStatus(status: *mut c_int, id: c_char) -> c_int {
    let mut d = device();
    if let Err(code) = d.answers(id) {
        return code;
    }
    let mut said = [0; 17];
    said[0] = 1;
    said[1] = 1;
    said[2] = 1;
    said[3] = c_int::from(d.needs_homing);
    said[5] = c_int::from(d.force);
    said[6] = c_int::from(!d.force);
    said[8] = c_int::from(d.has_wrist);
    said[14] = d.cause;
    unsafe { std::ptr::copy_nonoverlapping(said.as_ptr(), status, said.len()) };
    0
}

#[unsafe(no_mangle)]
pub extern "system" fn dhdSetForce(x: f64, y: f64, z: f64, id: c_char) -> c_int {
    let mut d = device();
    if let Err(code) = d.answers(id) {
        return code;
    }
    d.tell([x, y, z, 0.0, 0.0, 0.0, 0.0])
}

#[unsafe(no_mangle)]
pub extern "system" fn dhdEnableForce(on: u8, id: c_char) -> c_int {
    let mut d = device();
    if let Err(code) = d.answers(id) {
        return code;
    }
    if on != 0 && d.is_over_speed {
        return d.fail(NOT_ENABLED);
    }
    d.force = on != 0;
    d.cause = if d.force { 0 } else { 4 };
    0
}

#[unsafe(no_mangle)]
pub extern "system" fn dhdGetButton(index: c_int, id: c_char) -> c_int {
    let mut d = device();
    if let Err(code) = d.answers(id) {
        return code;
    }
    (d.sample.buttons >> index & 1) as c_int
}

/// The window of the velocity estimate is never full in this stub: every call times out, as an early one does.
#[unsafe(no_mangle)]
pub extern "system" fn dhdGetLinearVelocity(_x: *mut f64, _y: *mut f64, _z: *mut f64, _id: c_char) -> c_int {
    device().fail(TIMEOUT)
}

#[cfg(not(small))]
mod whole {
    use super::*;

    #[unsafe(no_mangle)]
    pub extern "system" fn dhdGetDeviceCount() -> c_int {
        c_int::from(!device().is_unplugged)
    }

    #[unsafe(no_mangle)]
    pub extern "system" fn dhdErrorGetLast() -> c_int {
        device().error
    }

    #[unsafe(no_mangle)]
    pub extern "system" fn dhdGetSystemName(_id: c_char) -> *const c_char {
        let name: &[u8] = match device().system_type {
            33 => b"omega.3\0",
            104 | 105 => b"sigma.7\0",
            _ => b"omega.6\0",
        };
        name.as_ptr().cast()
    }

    #[unsafe(no_mangle)]
    pub extern "system" fn dhdGetSystemType(_id: c_char) -> c_int {
        device().system_type
    }

    #[unsafe(no_mangle)]
    pub unsafe extern "system" fn dhdGetPositionAndOrientationFrame(
        x: *mut f64,
        y: *mut f64,
        z: *mut f64,
        rows: *mut [[f64; 3]; 3],
        id: c_char,
    ) -> c_int {
        waits();
        let mut d = device();
        if let Err(code) = d.answers(id) {
            return code;
        }
        let [px, py, pz] = d.sample.place;
        unsafe {
            (*x, *y, *z) = (px, py, pz);
            *rows = d.sample.rows;
        }
        let is_guarded = d.read == d.turn;
        d.read = d.turn;
        if is_guarded { TIMEGUARD } else { 0 }
    }

    #[unsafe(no_mangle)]
    pub extern "system" fn dhdGetButtonMask(_id: c_char) -> u32 {
        // The bits above the buttons belong to no button.
        device().sample.buttons | 0x8000_0000
    }

    #[unsafe(no_mangle)]
    pub extern "system" fn dhdHasWrist(_id: c_char) -> bool {
        device().has_wrist
    }

    #[unsafe(no_mangle)]
    pub extern "system" fn dhdHasActiveWrist(_id: c_char) -> bool {
        device().has_active_wrist
    }

    #[unsafe(no_mangle)]
    pub extern "system" fn dhdHasGripper(_id: c_char) -> bool {
        device().gripper.is_some()
    }

    #[unsafe(no_mangle)]
    pub extern "system" fn dhdIsLeftHanded(_id: c_char) -> bool {
        device().is_left_handed
    }

    #[unsafe(no_mangle)]
    pub unsafe extern "system" fn dhdGetGripperAngleRad(angle: *mut f64, id: c_char) -> c_int {
        let mut d = device();
        if let Err(code) = d.answers(id) {
            return code;
        }
        let Some(opening) = d.gripper else { return d.fail(ERROR) };
        unsafe { *angle = if d.is_left_handed { -opening } else { opening } };
        TIMEGUARD
    }

    #[unsafe(no_mangle)]
    #[allow(clippy::too_many_arguments)]
    pub extern "system" fn dhdSetForceAndTorqueAndGripperForce(
        fx: f64,
        fy: f64,
        fz: f64,
        tx: f64,
        ty: f64,
        tz: f64,
        fg: f64,
        id: c_char,
    ) -> c_int {
        let mut d = device();
        if let Err(code) = d.answers(id) {
            return code;
        }
        d.tell([fx, fy, fz, tx, ty, tz, fg])
    }

    #[unsafe(no_mangle)]
    pub extern "system" fn dhdGetMaxForce(_id: c_char) -> f64 {
        // No limit was set.
        -1.0
    }

    #[unsafe(no_mangle)]
    pub extern "system" fn dhdEnableExpertMode() -> c_int {
        device().expert = true;
        0
    }

    #[unsafe(no_mangle)]
    pub extern "system" fn dhdDisableExpertMode() -> c_int {
        device().expert = false;
        0
    }

    #[unsafe(no_mangle)]
    pub extern "system" fn dhdSetWatchdog(duration: u8, id: c_char) -> c_int {
        let mut d = device();
        if let Err(code) = d.answers(id) {
            return code;
        }
        if !d.expert {
            return d.fail(EXPERT_MODE_DISABLED);
        }
        d.watchdog = duration;
        0
    }

    #[unsafe(no_mangle)]
    pub extern "system" fn drdOpen() -> c_int {
        open()
    }

    #[unsafe(no_mangle)]
    pub extern "system" fn drdClose(id: c_char) -> c_int {
        close(id)
    }

    #[unsafe(no_mangle)]
    pub extern "system" fn drdIsSupported(_id: c_char) -> bool {
        true
    }

    #[unsafe(no_mangle)]
    pub extern "system" fn drdIsInitialized(_id: c_char) -> bool {
        !device().needs_homing
    }

    /// Moves for half a second, and returns when it is done or stopped.
    #[unsafe(no_mangle)]
    pub extern "system" fn drdAutoInit(id: c_char) -> c_int {
        {
            let mut d = device();
            if let Err(code) = d.answers(id) {
                return code;
            }
            d.homing = true;
            d.stop_homing = false;
        }
        let until = Instant::now() + Duration::from_millis(700);
        while Instant::now() < until {
            std::thread::sleep(Duration::from_millis(2));
            if device().stop_homing {
                break;
            }
        }
        let mut d = device();
        d.homing = false;
        if d.stop_homing {
            return d.fail(ERROR);
        }
        d.homed += 1;
        d.needs_homing = false;
        0
    }

    #[unsafe(no_mangle)]
    pub extern "system" fn drdStop(_keeps_force: bool, id: c_char) -> c_int {
        let mut d = device();
        if let Err(code) = d.answers(id) {
            return code;
        }
        d.stop_homing = true;
        0
    }
}
