//! Drivers of vendors' shared libraries, against libraries that behave like the vendors' (`stubs/`).
//!
//! Each rig opens its own copy of a stub: a library's global state belongs to a file. World space is converted to the
//! device's here, from what the vendors' headers say, and by nothing of the driver's.

use crate::rig::{Abilities, Misbehaviour, Rig, SharedHand};
use crate::suite;
use libloading::Library;
use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
use std::ffi::c_void;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};
use typodont_core::device::{Device, DeviceState, Reading, UPRIGHT, Wrench};
use typodont_core::frame::{Quat, Vec3};
use typodont_devices::driver_by_name;

#[test]
fn openhaptics_passes_the_suite() {
    crate::support::peace::in_real_time(|| {
        suite::check(&mut Native::omni());
    })
}

#[test]
fn force_dimension_passes_the_suite() {
    crate::support::peace::in_real_time(|| {
        suite::check(&mut Native::omega());
    })
}

#[test]
fn a_premium_feels_torque_in_its_own_unit() {
    crate::support::peace::in_real_time(|| {
        // Aim: HDAPI takes mN·m, so N·mm pass unchanged. Method: an arm of six axes is told a torque.
        let rig = Native::omni();
        rig.order("stub_six_axes");
        let mut device = ready(&rig);
        assert_eq!(device.spec().max_torque, 188.0);
        let told = Wrench { torque: Vec3::new(0.0, 90.0, -20.0), ..Wrench::ZERO };
        wait(&mut device, told, "the torque", |_, _| (rig.hand.felt().torque - told.torque).length() < 0.1);
        let wild = Wrench { torque: Vec3::X * 9000.0, ..Wrench::ZERO };
        wait(&mut device, wild, "a clamped torque", |_, _| (rig.hand.felt().torque.length() - 188.0).abs() < 1.0);
    })
}

#[test]
fn openhaptics_says_what_the_device_is() {
    crate::support::peace::in_real_time(|| {
        // Aim: limits come from the device, and never exceed what its model stands. Method: the stub says 1 N/mm, 3.3 N.
        let rig = Native::omni();
        let device = ready(&rig);
        let spec = device.spec();
        assert_eq!(spec.name, "PHANTOM Omni");
        assert_eq!((spec.max_force, spec.continuous_force), (3.3, 0.88));
        assert_eq!(spec.max_stiffness, 0.7, "an Omni stands 0.7 N/mm, whatever its library says");
        assert_eq!(spec.workspace_half, Vec3::new(80.0, 60.0, 35.0));
    })
}

#[test]
fn an_omni_that_lost_its_place_asks_for_its_inkwell() {
    crate::support::peace::in_real_time(|| {
        // Aim: calibrating is a visible state, needs the docked stylus, and no force is felt before. Method: an arm with the
        // inkwell style that lost its place; a person docks it, then takes it out.
        let rig = Native::omni();
        rig.calibration(4, true);
        let mut device = rig.opened().unwrap();
        let push = Wrench { force: Vec3::Y, ..Wrench::ZERO };
        rig.hand.most_felt();
        wait(
            &mut device,
            push,
            "a call for the inkwell",
            |state, _| matches!(state, DeviceState::Calibrate { how } if how.contains("inkwell")),
        );
        assert_eq!(rig.ask::<u32>("stub_updates"), 0, "never without the stylus in");
        rig.set("stub_dock", true);
        wait(&mut device, push, "docked, without force", |state, reading| {
            matches!(state, DeviceState::ForceOff { why } if why.contains("inkwell")) && reading.pose.is_valid()
        });
        assert_eq!(rig.ask::<u32>("stub_updates"), 1);
        assert_eq!(rig.hand.most_felt(), 0.0);
        rig.set("stub_dock", false);
        wait(&mut device, push, "ready and felt", |state, _| state.is_ready() && rig.hand.felt().force.y > 0.9);
    })
}

#[test]
fn an_arm_without_zero_waits_for_a_person() {
    crate::support::peace::in_real_time(|| {
        // Aim: encoders are reset before the servo starts, when a person says that the arm is in place. Method: the stub
        // refuses a reset while its scheduler runs; the button is held at first, which must not count.
        let rig = Native::omni();
        rig.order("stub_six_axes");
        rig.calibration(1, true);
        rig.hand.press_buttons(1);
        let turns = rig.hand.turns();
        eventually("the button is down", || rig.hand.turns() > turns + 2);
        let mut device = rig.opened().unwrap();
        let asks = |state: DeviceState| matches!(state, DeviceState::Calibrate { how } if how.contains("neutral"));
        wait(&mut device, Wrench::ZERO, "a call for the neutral pose", |state, _| asks(state));
        hold(&mut device, Duration::from_millis(200));
        assert_eq!(rig.ask::<u32>("stub_updates"), 0);
        rig.hand.press_buttons(0);
        hold(&mut device, Duration::from_millis(200));
        assert!(asks(device.state()));
        rig.hand.press_buttons(1);
        wait(&mut device, Wrench::ZERO, "ready", |state, reading| state.is_ready() && reading.pose.is_valid());
        assert_eq!(rig.ask::<u32>("stub_updates"), 1);
    })
}

#[test]
fn warm_motors_are_switched_on_again() {
    crate::support::peace::in_real_time(|| {
        // Aim: the library switches force output off with the error and does not switch it on again. Method: warm, then cool.
        let rig = Native::omni();
        let mut device = ready(&rig);
        let push = Wrench { force: Vec3::X, ..Wrench::ZERO };
        wait(&mut device, push, "a push", |_, _| rig.hand.felt().force.x > 0.9);
        rig.fault(0x0200);
        // The newest error says only that the force failed; the first says why.
        wait(&mut device, push, "the reason", |state, _| {
            matches!(state, DeviceState::ForceOff { why } if why.contains("warm"))
                && rig.hand.felt().force == Vec3::ZERO
        });
        assert!(!rig.ask::<bool>("stub_is_force_output_on"));
        rig.fault(0);
        wait(&mut device, push, "a push again", |state, _| state.is_ready() && rig.hand.felt().force.x > 0.9);
    })
}

#[test]
fn a_library_that_refuses_every_frame_ends_the_device() {
    crate::support::peace::in_real_time(|| {
        let rig = Native::omni();
        let mut device = ready(&rig);
        rig.fault(0x0402);
        let said = gone(&mut device);
        assert!(said.contains("refuses") && said.contains(&0x0402.to_string()), "{said}");
    })
}

#[test]
fn openhaptics_says_why_it_does_not_open() {
    crate::support::peace::in_real_time(|| {
        // Aim: the trap of garbage handles, a device in use, one that is not there. Method: the stub does each.
        let rig = Native::omni();
        rig.set("stub_garbage_handle", true);
        let said = rig.opened().err().unwrap();
        assert!(said.contains("handle 0x7f3a1c40") && said.contains("help: "), "{said}");
        rig.set("stub_garbage_handle", false);
        rig.set("stub_unplug", true);
        let said = rig.opened().err().unwrap();
        assert!(said.contains("Communication error (0x0302)") && said.contains("plug"), "{said}");
        rig.set("stub_unplug", false);
        let held = rig.opened().unwrap();
        let said = rig.opened().err().unwrap();
        assert!(said.contains("already open"), "{said}");
        drop(held);
        ready(&rig);
    })
}

#[test]
fn closing_a_device_lets_go() {
    crate::support::peace::in_real_time(|| {
        for rig in [Native::omni(), Native::omega()] {
            let mut device = ready(&rig);
            let push = Wrench { force: Vec3::Z, ..Wrench::ZERO };
            wait(&mut device, push, "a push", |_, _| rig.hand.felt().force.z > 0.9);
            drop(device);
            let turns = rig.hand.turns();
            eventually("turns", || rig.hand.turns() > turns + 2);
            assert_eq!(rig.hand.felt(), Wrench::ZERO, "{}", rig.driver);
        }
    })
}

#[test]
fn a_missing_library_is_told_in_the_loaders_words() {
    crate::support::peace::in_real_time(|| {
        // Aim: people can act on the complaint. Method: a file that is not there, one that is no library, one of another kind.
        for name in ["openhaptics", "forcedimension"] {
            let open = |path: &Path| driver_by_name(name).unwrap().open(path.to_str()).err().unwrap();
            let said = open(Path::new("/nowhere/libX.so"));
            assert!(said.message.contains("/nowhere/libX.so") && said.help.contains("install"), "{said}");
            let text = open(&Path::new(env!("CARGO_MANIFEST_DIR")).join("Cargo.toml"));
            assert!(text.message.len() > "cannot load ".len() + 20, "{text}");
        }
        let said = driver_by_name("openhaptics").unwrap().open(built("drd", &[]).to_str()).err().unwrap();
        // Windows' loader does not name the function.
        let is_named = cfg!(windows) || said.message.contains("hdInitDevice");
        assert!(is_named && said.help.contains("too old"), "{said}");
    })
}

/// Set in the child process in which the loader knows the stubs by the vendors' names.
const IN_CHILD: &str = "TYPODONT_TEST_FINDS";

#[test]
#[cfg(target_os = "linux")]
fn libraries_are_found_by_their_usual_names() {
    // Aim: what is installed is found without an argument. Method: this test again, in a process whose loader looks into a
    // folder with the stubs under the vendors' names.
    if std::env::var_os(IN_CHILD).is_some() {
        let titles = ["openhaptics", "forcedimension"]
            .map(|name| driver_by_name(name).unwrap().discover().unwrap()[0].title.clone());
        assert_eq!(titles, ["PHANTOM Omni STUB-0001", "omega.6"]);
        return;
    }
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("installed-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::copy(built("hd", &[]), folder.join("libHD.so.3.4")).unwrap();
    std::fs::copy(built("drd", &[]), folder.join("libdrd.so.3")).unwrap();
    let child = Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "native::libraries_are_found_by_their_usual_names"])
        .env("LD_LIBRARY_PATH", &folder)
        .env(IN_CHILD, "1")
        .output()
        .unwrap();
    std::fs::remove_dir_all(&folder).unwrap();
    let said = String::from_utf8_lossy(&child.stdout);
    assert!(child.status.success() && said.contains("1 passed"), "{said}");
}

#[test]
#[cfg(target_os = "linux")]
fn a_library_that_is_not_installed_is_a_clear_complaint() {
    // Meaningful only on a machine without the vendors' SDKs, as test machines are.
    for (name, library) in [("openhaptics", "libHD.so"), ("forcedimension", "libdrd.so")] {
        if let Err(said) = driver_by_name(name).unwrap().discover() {
            assert!(said.message.contains(library) && said.message.contains("cannot open shared object"), "{said}");
            assert!(said.help.contains("install"), "{said}");
        }
    }
}

#[test]
fn homing_is_announced_before_the_device_moves() {
    crate::support::peace::in_real_time(|| {
        // Aim: nobody's hand is there when the device moves by itself, and the wire reports all the while. Method: a device
        // that needs homing; the stub says when it moves.
        let rig = Native::omega();
        rig.order("stub_needs_homing");
        let mut device = rig.opened().unwrap();
        let says =
            |state: DeviceState, word: &str| matches!(state, DeviceState::Homing { what } if what.contains(word));
        wait(&mut device, Wrench::ZERO, "the announcement", |state, _| says(state, "will move"));
        assert_eq!(rig.ask::<u32>("stub_homing"), 0, "it moves before anyone could read that it will");
        rig.hand.most_felt();
        let push = Wrench { force: Vec3::X, ..Wrench::ZERO };
        wait(&mut device, push, "the homing", |state, _| says(state, "keep the hands off"));
        eventually("it moves", || rig.ask::<u32>("stub_homing") == 1);
        assert_eq!(rig.hand.most_felt(), 0.0);
        wait(&mut device, Wrench::ZERO, "ready", |state, reading| state.is_ready() && reading.pose.is_valid());
        assert_eq!(rig.ask::<u32>("stub_homing"), 2, "homed once, and still");
    })
}

#[test]
fn closing_stops_a_device_that_homes() {
    crate::support::peace::in_real_time(|| {
        let rig = Native::omega();
        rig.order("stub_needs_homing");
        let mut device = rig.opened().unwrap();
        wait(&mut device, Wrench::ZERO, "it moves", |_, _| rig.ask::<u32>("stub_homing") == 1);
        drop(device);
        eventually("it stands", || rig.ask::<u32>("stub_homing") == 0);
    })
}

#[test]
fn a_sigma_feels_torque_and_its_gripper_is_a_button() {
    crate::support::peace::in_real_time(|| {
        // Aim: N·mm become N·m on the right axes; left-handed grippers count negative. Method: one of each hand.
        for is_left_handed in [false, true] {
            let rig = Native::omega();
            rig.set("stub_sigma", is_left_handed);
            let mut device = ready(&rig);
            assert_eq!(device.spec().max_torque, 200.0);
            let told = Wrench { force: Vec3::X, torque: Vec3::new(10.0, 20.0, -150.0) };
            wait(&mut device, told, "the torque", |_, _| (rig.hand.felt().torque - told.torque).length() < 0.1);
            assert!((rig.hand.felt().force - told.force).length() < 1e-3);
            rig.gripper(0.4);
            wait(&mut device, Wrench::ZERO, "an open gripper", |_, reading| reading.buttons == 0);
            rig.gripper(0.02);
            wait(&mut device, Wrench::ZERO, "a closed gripper", |_, reading| reading.buttons == 1);
            rig.gripper(0.11);
            hold(&mut device, Duration::from_millis(100));
            wait(&mut device, Wrench::ZERO, "some play", |_, reading| reading.buttons == 1);
            rig.gripper(0.4);
            wait(&mut device, Wrench::ZERO, "an open gripper again", |_, reading| reading.buttons == 0);
        }
    })
}

#[test]
fn saturated_motors_and_guarded_reads_are_successes() {
    crate::support::peace::in_real_time(|| {
        // Aim: 1 and 2 are no errors. Method: a force at which the stub answers 2, reads so fast that it answers 1.
        let rig = Native::omega();
        let mut device = ready(&rig);
        let told = Wrench { force: Vec3::Y * 11.5, ..Wrench::ZERO };
        wait(&mut device, told, "11.5 N", |state, _| state.is_ready() && rig.hand.felt().force.y > 11.4);
    })
}

#[test]
fn forces_switched_off_by_hand_stay_off() {
    crate::support::peace::in_real_time(|| {
        // Aim: a person's decision at the device stands until they take it back. Method: the force button, longer than the
        // driver waits before it switches on by itself.
        let rig = Native::omega();
        let mut device = ready(&rig);
        rig.set("stub_force_button", false);
        let push = Wrench { force: Vec3::X, ..Wrench::ZERO };
        let off = |state: DeviceState| matches!(state, DeviceState::ForceOff { why } if why.contains("button"));
        wait(&mut device, push, "the reason", |state, _| off(state));
        rig.hand.most_felt();
        hold(&mut device, Duration::from_millis(1200));
        assert!(off(device.state()), "{}", device.state());
        assert_eq!(rig.hand.most_felt(), 0.0);
        rig.set("stub_force_button", true);
        wait(&mut device, push, "a push", |state, _| state.is_ready() && rig.hand.felt().force.x > 0.9);
    })
}

#[test]
fn the_devices_own_watchdog_is_set() {
    crate::support::peace::in_real_time(|| {
        // Aim: a program that dies cannot leave a force on. Method: 160 times 125 µs are 20 ms.
        let rig = Native::omega();
        let _device = ready(&rig);
        assert_eq!(rig.ask::<u8>("stub_watchdog"), 160);
    })
}

#[test]
fn a_device_without_wrist_is_held_upright() {
    crate::support::peace::in_real_time(|| {
        let rig = Native::omega();
        rig.order("stub_no_wrist");
        rig.hand.turn_to(Quat::from_rotation_x(1.0));
        let mut device = ready(&rig);
        wait(&mut device, Wrench::ZERO, "a pose", |_, reading| reading.pose.orientation == UPRIGHT);
        assert_eq!(device.spec().name, "omega.3");
    })
}

#[test]
fn an_old_library_without_optional_functions_serves() {
    crate::support::peace::in_real_time(|| {
        // Aim: only what is needed is required. Method: a library of eight functions; place, button and force must do.
        let rig = Native::new("forcedimension", &built("drd", &["small"]), feel_dhd, OMEGA);
        let mut device = ready(&rig);
        rig.hand.reach(Vec3::new(5.0, -3.0, 2.0));
        let is_there = |reading: Reading| (reading.pose.position - rig.hand.goal()).length() < 0.2;
        wait(&mut device, Wrench::ZERO, "the place", |_, reading| is_there(reading));
        rig.hand.press_buttons(0b10);
        wait(&mut device, Wrench::ZERO, "the second button", |_, reading| reading.buttons == 0b10);
        let push = Wrench { force: Vec3::new(0.0, 0.0, -1.0), ..Wrench::ZERO };
        wait(&mut device, push, "a push", |_, _| rig.hand.felt().force.z < -0.9);
        assert_eq!(device.spec().max_torque, 0.0);
    })
}

/// A fake device behind a shared library.
pub struct Native {
    driver: &'static str,
    abilities: Abilities,
    hand: SharedHand,
    /// Never unloaded, as the driver never unloads it.
    stub: &'static Library,
    file: PathBuf,
}

type Feel<S> = extern "C" fn(*mut c_void, *const f64, *mut S);

/// As in `stubs/hd.rs`.
#[repr(C)]
struct HdSample {
    transform: [f64; 16],
    buttons: u32,
}

/// As in `stubs/drd.rs`.
#[repr(C)]
struct DhdSample {
    place: [f64; 3],
    rows: [[f64; 3]; 3],
    buttons: u32,
}

const OMNI: Abilities = Abilities {
    force: true,
    torque: false,
    orientation: true,
    buttons: true,
    resolution: 0.055,
    is_rate: false,
    misbehaviours: &[
        Misbehaviour::Unplug,
        Misbehaviour::Garbage,
        Misbehaviour::Late,
        Misbehaviour::OverSpeed,
        Misbehaviour::WarmMotors,
    ],
};

const OMEGA: Abilities = Abilities {
    resolution: 0.01,
    misbehaviours: &[Misbehaviour::Unplug, Misbehaviour::Garbage, Misbehaviour::Late, Misbehaviour::OverSpeed],
    ..OMNI
};

impl Native {
    pub fn omni() -> Native {
        Native::new("openhaptics", &built("hd", &[]), feel_hd, OMNI)
    }

    pub fn omega() -> Native {
        Native::new("forcedimension", &built("drd", &[]), feel_dhd, OMEGA)
    }

    fn new<S>(driver: &'static str, library: &Path, feel: Feel<S>, abilities: Abilities) -> Native {
        static COPIES: AtomicU32 = AtomicU32::new(0);
        let copy = COPIES.fetch_add(1, Ordering::Relaxed);
        let file = library.with_file_name(format!("{driver}-{}-{copy}{DLL_SUFFIX}", std::process::id()));
        std::fs::copy(library, &file).unwrap();
        // SAFETY: the stub has no start-up code.
        let stub: &Library = Box::leak(Box::new(unsafe { Library::new(&file) }.unwrap()));
        let hand = SharedHand::at_rest(abilities.resolution);
        let context: *mut SharedHand = Box::leak(Box::new(hand.clone()));
        // SAFETY: the signature in `stubs/`; the context is never freed.
        unsafe {
            let connect = stub.get::<extern "C" fn(Feel<S>, *mut c_void)>("stub_connect").unwrap();
            connect(feel, context.cast());
        }
        Native { driver, abilities, hand, stub, file }
    }

    fn opened(&self) -> Result<Box<dyn Device + Send>, String> {
        driver_by_name(self.driver).unwrap().open(self.file.to_str()).map_err(|trouble| trouble.to_string())
    }

    fn order(&self, what: &str) {
        // SAFETY: orders without arguments, as in `stubs/`.
        unsafe { self.stub.get::<extern "C" fn()>(what).unwrap()() }
    }

    fn set(&self, what: &str, value: bool) {
        // SAFETY: settings that are a bool, as in `stubs/`.
        unsafe { self.stub.get::<extern "C" fn(bool)>(what).unwrap()(value) }
    }

    fn ask<T>(&self, what: &str) -> T {
        // SAFETY: each question is asked for the type that it has in `stubs/`.
        unsafe { self.stub.get::<extern "C" fn() -> T>(what).unwrap()() }
    }

    fn fault(&self, code: u32) {
        // SAFETY: the signature in `stubs/hd.rs`.
        unsafe { self.stub.get::<extern "C" fn(u32)>("stub_fault").unwrap()(code) }
    }

    fn calibration(&self, style: i32, is_lost: bool) {
        // SAFETY: the signature in `stubs/hd.rs`.
        unsafe { self.stub.get::<extern "C" fn(i32, bool)>("stub_calibration").unwrap()(style, is_lost) }
    }

    fn gripper(&self, opening: f64) {
        // SAFETY: the signature in `stubs/drd.rs`.
        unsafe { self.stub.get::<extern "C" fn(f64)>("stub_gripper").unwrap()(opening) }
    }
}

impl Rig for Native {
    fn name(&self) -> &'static str {
        self.driver
    }

    fn open(&mut self) -> Result<Box<dyn Device + Send>, String> {
        self.opened()
    }

    fn hand(&self) -> SharedHand {
        self.hand.clone()
    }

    fn abilities(&self) -> Abilities {
        self.abilities.clone()
    }

    fn misbehave(&mut self, how: Misbehaviour) {
        let is_hd = self.driver == "openhaptics";
        match how {
            Misbehaviour::Unplug => self.set("stub_unplug", true),
            Misbehaviour::Garbage => self.set("stub_garbage", true),
            Misbehaviour::Late => self.set("stub_late", true),
            Misbehaviour::OverSpeed if is_hd => self.fault(0x0203),
            Misbehaviour::OverSpeed => self.set("stub_over_speed", true),
            Misbehaviour::WarmMotors => self.fault(0x0200),
        }
    }

    fn recover(&mut self) {
        for what in ["stub_unplug", "stub_garbage", "stub_late"] {
            self.set(what, false);
        }
        match self.driver {
            "openhaptics" => self.fault(0),
            _ => self.set("stub_over_speed", false),
        }
    }
}

impl Drop for Native {
    fn drop(&mut self) {
        self.order("stub_disconnect");
        // A library that is in use cannot be removed everywhere; what is left lies in the build's folder.
        let _ = std::fs::remove_file(&self.file);
    }
}

/// The middle of the box that `stubs/hd.rs` tells as its usable workspace, mm.
const HD_MIDDLE: [f64; 3] = [0.0, 20.0, 5.0];

/// HDAPI: the world's axes, mm, columns; N and mN·m. The columns are a little too long, as real arms' are.
extern "C" fn feel_hd(hand: *mut c_void, told: *const f64, sample: *mut HdSample) {
    // SAFETY: what `Native::new` connected, and what the stub's servo gives.
    let (hand, told, sample) = unsafe { (&*hand.cast::<SharedHand>(), &*told.cast::<[f64; 6]>(), &mut *sample) };
    let [fx, fy, fz, tx, ty, tz] = told.map(|x| x as f32);
    // 1 mN·m is 1 N·mm.
    let reading = hand.turn(Wrench { force: Vec3::new(fx, fy, fz), torque: Vec3::new(tx, ty, tz) });
    sample.transform = [0.0; 16];
    for (column, axis) in [Vec3::X, Vec3::Y, Vec3::Z].into_iter().enumerate() {
        let along = reading.pose.orientation * axis * 1.002;
        for row in 0..3 {
            sample.transform[4 * column + row] = f64::from(along[row]);
        }
    }
    for (row, middle) in HD_MIDDLE.into_iter().enumerate() {
        sample.transform[12 + row] = f64::from(reading.pose.position[row]) + middle;
    }
    sample.transform[15] = 1.0;
    sample.buttons = reading.buttons;
}

/// DHD: x toward the user, y to the right, z up; m, rows, N and N·m. The stylus lies along its own x.
extern "C" fn feel_dhd(hand: *mut c_void, told: *const f64, sample: *mut DhdSample) {
    // SAFETY: what `Native::new` connected, and what the stub's device gives.
    let (hand, told, sample) = unsafe { (&*hand.cast::<SharedHand>(), &*told.cast::<[f64; 7]>(), &mut *sample) };
    let [toward, right, up, about_toward, about_right, about_up, _] = told.map(|x| x as f32);
    let reading = hand.turn(Wrench {
        force: Vec3::new(right, up, toward),
        torque: Vec3::new(about_right, about_up, about_toward) * 1000.0,
    });
    let p = reading.pose.position;
    sample.place = [p.z, p.x, p.y].map(|x| f64::from(x) / 1000.0);
    let shaft = reading.pose.orientation * Vec3::Z;
    let side = reading.pose.orientation * Vec3::X;
    let back = reading.pose.orientation * Vec3::Y;
    for (column, axis) in [shaft, side, back].into_iter().enumerate() {
        sample.rows[0][column] = f64::from(axis.z);
        sample.rows[1][column] = f64::from(axis.x);
        sample.rows[2][column] = f64::from(axis.y);
    }
    sample.buttons = reading.buttons;
}

/// The stub of a library, built if it is not there or its source is newer; once per process.
fn built(name: &str, cfgs: &[&str]) -> PathBuf {
    static HD: OnceLock<PathBuf> = OnceLock::new();
    static DRD: OnceLock<PathBuf> = OnceLock::new();
    static SMALL_DRD: OnceLock<PathBuf> = OnceLock::new();
    let once = match (name, cfgs) {
        ("hd", []) => &HD,
        ("drd", []) => &DRD,
        _ => &SMALL_DRD,
    };
    once.get_or_init(|| build(name, cfgs)).clone()
}

fn build(name: &str, cfgs: &[&str]) -> PathBuf {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/devices/stubs/{name}.rs"));
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let file = folder.join(format!("{DLL_PREFIX}{name}{}{DLL_SUFFIX}", cfgs.concat()));
    let written = |path: &Path| path.metadata().and_then(|m| m.modified()).ok();
    if written(&file).is_some() && written(&file) > written(&source) {
        return file;
    }
    let rustc = std::env::var_os("RUSTC").unwrap_or("rustc".into());
    let half = folder.join(format!("{name}{}-{}{DLL_SUFFIX}", cfgs.concat(), std::process::id()));
    let mut command = Command::new(rustc);
    command.args(["--edition", "2024", "--crate-type", "cdylib", "-A", "non_snake_case", "-C", "opt-level=1"]);
    command.args(cfgs.iter().flat_map(|cfg| ["--cfg", cfg])).arg("-o").arg(&half).arg(&source);
    let said = command.output().unwrap();
    assert!(said.status.success(), "{}", String::from_utf8_lossy(&said.stderr));
    // Whole or absent: another process of the tests may look at the same time.
    std::fs::rename(&half, &file).unwrap();
    file
}

/// Long enough for a loaded machine.
const PATIENCE: Duration = Duration::from_secs(30);

fn ready(rig: &Native) -> Box<dyn Device + Send> {
    let mut device = rig.opened().unwrap();
    wait(&mut device, Wrench::ZERO, "ready", |state, reading| state.is_ready() && reading.pose.is_valid());
    device
}

fn wait(device: &mut Box<dyn Device + Send>, told: Wrench, what: &str, holds: impl Fn(DeviceState, Reading) -> bool) {
    let start = Instant::now();
    loop {
        let reading = device.exchange(&told).unwrap_or_else(|gone| panic!("waiting for {what}: {gone}"));
        if holds(device.state(), reading) {
            return;
        }
        assert!(start.elapsed() < PATIENCE, "no {what}: {}, {reading:?}", device.state());
        std::thread::sleep(Duration::from_millis(1));
    }
}

fn hold(device: &mut Box<dyn Device + Send>, time: Duration) {
    let start = Instant::now();
    wait(device, Wrench::ZERO, "patience", |_, _| start.elapsed() > time);
}

/// Error text of the driver after the device is disconnected.
fn gone(device: &mut Box<dyn Device + Send>) -> String {
    let start = Instant::now();
    loop {
        match device.exchange(&Wrench::ZERO) {
            Err(gone) => return gone.to_string(),
            Ok(_) => assert!(start.elapsed() < PATIENCE, "still there: {}", device.state()),
        }
        std::thread::sleep(Duration::from_millis(1));
    }
}

fn eventually(what: &str, holds: impl Fn() -> bool) {
    let start = Instant::now();
    while !holds() {
        assert!(start.elapsed() < PATIENCE, "never: {what}");
        std::thread::sleep(Duration::from_millis(1));
    }
}
