//! `typodont doctor` finds prepared faults, and names the remedy.
//!
//! Each fault is prepared for real: an environment, a limit, a file system, a folder, a library, a port. Some can be
//! prepared only by root on Linux, in a mount namespace of its own; elsewhere those tests print SKIPPED.

use crate::support::bundle::program;
use crate::support::folder::folder;
use crate::support::screen::Display;
use crate::support::tools::skip;
use serde_json::Value;
use std::fs;
use std::fs::File;
use std::net::UdpSocket;
use std::os::unix::net::UnixListener;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::{Duration, SystemTime};

/// The program with a home of its own and nothing of the tester's environment.
fn doctor(home: &Path) -> Command {
    let mut command = Command::new(program());
    prepare(&mut command, home);
    command.args(["doctor", "--json"]);
    command
}

fn prepare(command: &mut Command, home: &Path) {
    command.current_dir(home).env_clear().env("HOME", home).env("PATH", std::env::var_os("PATH").unwrap());
    command.env("LANG", "en_GB.UTF-8");
}

/// `doctor --json ARGUMENTS` after `preparation`, a piece of shell that root carries out in a mount namespace of its own.
/// `None` if that is not possible here.
fn prepared_by_root(home: &Path, preparation: &str, arguments: &str) -> Option<Output> {
    let can = Command::new("unshare").args(["--mount", "true"]).status().is_ok_and(|status| status.success());
    if !can {
        skip("only root on Linux can prepare this fault (unshare --mount)");
        return None;
    }
    let mut command = Command::new("unshare");
    prepare(&mut command, home);
    let script = format!("set -e\n{preparation}\nexec $AS \"$PROGRAM\" doctor --json {arguments}");
    command.args(["--mount", "sh", "-c", &script]).env("PROGRAM", program());
    Some(command.output().unwrap())
}

/// An ordinary user's rights, for `prepared_by_root`.
const AS_USER: &str = "AS='setpriv --reuid=65534 --regid=65534 --clear-groups'";

/// Passes if a finding of `check` has this status, and its message and remedy contain these words.
#[track_caller]
fn finds(output: &Output, check: &str, status: &str, message: &str, remedy: &str) {
    let text = String::from_utf8_lossy(&output.stdout);
    let complaint = String::from_utf8_lossy(&output.stderr);
    let report: Value = serde_json::from_str(&text).unwrap_or_else(|error| panic!("{error}: {text}{complaint}"));
    let findings = report["checks"].as_array().unwrap().iter().filter(|finding| finding["check"] == check);
    let contains = |value: &Value, word: &str| value.as_str().is_some_and(|text| text.contains(word));
    let found = findings.clone().any(|finding| {
        finding["status"] == status && contains(&finding["message"], message) && contains(&finding["remedy"], remedy)
    });
    let findings: Vec<_> = findings.collect();
    assert!(found, "{check} {status} \"{message}\" \"{remedy}\" is not among {findings:#?}");
    let is_missing = report["status"] == "missing";
    assert_eq!(output.status.code(), Some(i32::from(is_missing)), "{complaint}");
    assert!(status != "missing" || is_missing, "{text}");
}

#[test]
fn a_station_without_a_display_is_told_where_to_start_the_program() {
    let home = folder("doctor-display");
    finds(&doctor(&home).output().unwrap(), "display", "missing", "", "DISPLAY");
    // A display that nobody serves.
    let output = doctor(&home).env("DISPLAY", ":7919").output().unwrap();
    finds(&output, "display", "missing", "", "--headless");
}

#[test]
fn a_display_that_can_be_used_is_found() {
    let Some(display) = Display::open() else { return };
    let home = folder("doctor-display-found");
    let output = doctor(&home).env("DISPLAY", &display.name).output().unwrap();
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(report["version"], 1);
    let display = report["checks"].as_array().unwrap().iter().find(|finding| finding["check"] == "display").unwrap();
    assert_eq!((&display["status"], &display["remedy"]), (&Value::from("ok"), &Value::Null), "{display}");
}

#[test]
fn a_station_without_a_graphics_driver_is_told_which_to_install() {
    let home = folder("doctor-graphics");
    let nowhere = home.join("none.json");
    let mut command = doctor(&home);
    for variable in ["VK_ICD_FILENAMES", "VK_DRIVER_FILES", "__EGL_VENDOR_LIBRARY_FILENAMES"] {
        command.env(variable, &nowhere);
    }
    finds(&command.output().unwrap(), "graphics", "missing", "no-adapter", "mesa-vulkan-drivers");
}

#[test]
fn a_software_driver_is_a_warning() {
    let driver = Path::new("/usr/share/vulkan/icd.d/lvp_icd.x86_64.json");
    if !driver.is_file() {
        return skip("there is no software driver for Vulkan (Debian: mesa-vulkan-drivers)");
    }
    let home = folder("doctor-software");
    let output = doctor(&home).env("VK_DRIVER_FILES", driver).output().unwrap();
    finds(&output, "graphics", "warning", "llvmpipe", "graphics card");
}

#[test]
fn a_station_without_sound_is_told_what_to_start() {
    let home = folder("doctor-sound");
    finds(&doctor(&home).output().unwrap(), "sound", "warning", "no sound server", "pipewire-pulse");
    // A server that ended leaves its socket.
    let socket = home.join("native");
    drop(UnixListener::bind(&socket).unwrap());
    let output = doctor(&home).env("PULSE_SERVER", format!("unix:{}", socket.display())).output().unwrap();
    finds(&output, "sound", "warning", "no sound server responds", "pipewire-pulse");
}

#[test]
fn a_clock_before_the_release_is_wrong() {
    let library = ["/usr/lib/x86_64-linux-gnu/faketime/libfaketimeMT.so.1", "/usr/lib/faketime/libfaketimeMT.so.1"];
    let Some(library) = library.into_iter().find(|path| Path::new(path).is_file()) else {
        return skip("there is no libfaketime (Debian: faketime)");
    };
    let home = folder("doctor-clock");
    let mut command = doctor(&home);
    command.env("LD_PRELOAD", library).env("FAKETIME", "2009-01-01 00:00:00").env("FAKETIME_DONT_FAKE_MONOTONIC", "1");
    finds(&command.output().unwrap(), "clock", "missing", "2009-01-01", "timedatectl");
}

#[test]
fn a_clock_that_was_set_back_is_found_by_the_sessions() {
    let home = folder("doctor-clock-back");
    let session = home.join("sessions/20300101-0800-molar");
    fs::create_dir_all(&session).unwrap();
    let file = File::create(session.join("session.json")).unwrap();
    file.set_modified(SystemTime::now() + Duration::from_secs(90 * 86_400)).unwrap();
    let output = doctor(&home).args(["--out", "sessions"]).output().unwrap();
    finds(&output, "clock", "missing", "20300101-0800-molar is later", "timedatectl");
}

#[test]
fn a_full_disk_is_found_by_writing() {
    let home = folder("doctor-full");
    let preparation = "mkdir full; mount -t tmpfs -o size=8m none full";
    let Some(output) = prepared_by_root(&home, preparation, "--out full/sessions") else { return };
    finds(&output, "sessions", "missing", "No space left", "df -h");
}

#[test]
fn a_file_system_mounted_read_only_is_found() {
    let home = folder("doctor-read-only");
    let preparation = "mkdir sessions; mount -t tmpfs -o ro none sessions";
    let Some(output) = prepared_by_root(&home, preparation, "--out sessions") else { return };
    finds(&output, "sessions", "missing", "Read-only file system", "remount,rw");
}

#[test]
fn a_folder_of_somebody_else_is_found() {
    let home = folder("doctor-rights");
    let preparation = format!("mkdir -m 755 sessions; {AS_USER}");
    let Some(output) = prepared_by_root(&home, &preparation, "--out sessions") else { return };
    finds(&output, "sessions", "missing", "Permission denied", "chown");
}

#[test]
fn a_file_in_the_place_of_the_folder_is_found() {
    let home = folder("doctor-file");
    fs::write(home.join("sessions"), "").unwrap();
    let output = doctor(&home).args(["--out", "sessions/2026"]).output().unwrap();
    finds(&output, "sessions", "missing", "sessions is a file", "--out");
}

#[test]
fn a_limit_on_the_size_of_files_is_found() {
    let home = folder("doctor-limit");
    let mut command = Command::new("sh");
    prepare(&mut command, &home);
    command.args(["-c", "ulimit -f 2048; exec \"$PROGRAM\" doctor --json --out ."]).env("PROGRAM", program());
    finds(&command.output().unwrap(), "sessions", "missing", "File too large", "ulimit -f");
}

#[test]
fn an_interrupted_session_is_named() {
    let home = folder("doctor-interrupted");
    fs::create_dir_all(home.join("sessions/20261123-molar.partial")).unwrap();
    let output = doctor(&home).args(["--out", "sessions"]).output().unwrap();
    finds(&output, "sessions", "warning", "20261123-molar.partial", "typodont finish");
    // A program that records it holds the lock of its folder.
    let lock = fs::File::create(home.join("sessions/20261123-molar.partial/session.lock")).unwrap();
    lock.lock().unwrap();
    let output = doctor(&home).args(["--out", "sessions"]).output().unwrap();
    assert!(!String::from_utf8_lossy(&output.stdout).contains("20261123-molar.partial"));
    drop(lock);
    let output = doctor(&home).args(["--out", "sessions"]).output().unwrap();
    finds(&output, "sessions", "warning", "20261123-molar.partial", "typodont finish");
}

#[test]
fn nothing_is_left_where_the_doctor_looked() {
    // Aim: IT may run it every hour. Method: the home is as empty after it as before.
    let home = folder("doctor-traceless");
    doctor(&home).args(["--out", "."]).output().unwrap();
    let left: Vec<PathBuf> = fs::read_dir(&home).unwrap().map(|entry| entry.unwrap().path()).collect();
    // Graphics drivers keep compiled shaders in the user's cache.
    assert!(left.iter().all(|path| path.ends_with(".cache")), "{left:?}");
}

#[test]
fn a_user_without_real_time_priority_is_told_the_limit() {
    let home = folder("doctor-realtime");
    let preparation = format!("{AS_USER}; AS=\"prlimit --rtprio=0:0 $AS\"");
    let Some(output) = prepared_by_root(&home, &preparation, "--out /nowhere") else { return };
    finds(&output, "real-time", "warning", "ordinary priority", "rtprio");
}

#[test]
fn a_single_processor_is_a_warning() {
    let home = folder("doctor-processor");
    let mut command = Command::new("taskset");
    prepare(&mut command, &home);
    let Ok(output) = command.args(["-c", "0", program(), "doctor", "--json"]).output() else {
        return skip("there is no taskset (Debian: util-linux)");
    };
    finds(&output, "processors", "warning", "only 1 processor", "taskset");
}

/// Writes the settings, and a language file, of the home's user.
fn settings(home: &Path, text: &str, german: Option<&str>) {
    let folder = home.join(".config/typodont");
    fs::create_dir_all(folder.join("languages")).unwrap();
    fs::write(folder.join("settings.json"), text).unwrap();
    if let Some(text) = german {
        fs::write(folder.join("languages/de.json"), text).unwrap();
    }
}

#[test]
fn damaged_settings_and_languages_are_named() {
    let home = folder("doctor-settings");
    settings(&home, "{\"volume\": loud}", None);
    finds(&doctor(&home).output().unwrap(), "settings", "warning", "settings.json: wrong-settings", "F2");
    settings(&home, "{\"language\": \"de\"}", None);
    finds(&doctor(&home).output().unwrap(), "settings", "warning", "\"de\", which is not installed", "F2");
    settings(&home, "{}", Some("no text"));
    finds(&doctor(&home).output().unwrap(), "settings", "warning", "de.json: wrong-language", "file that is named");
    settings(&home, "{\"exercises\": \"/mnt/school/exercises\"}", None);
    finds(&doctor(&home).output().unwrap(), "settings", "warning", "/mnt/school/exercises", "network folder");
}

#[test]
fn the_device_of_the_settings_must_be_connected() {
    let home = folder("doctor-device");
    settings(&home, "{\"device\": \"spacemouse:nowhere\"}", None);
    finds(&doctor(&home).output().unwrap(), "device", "missing", "nowhere", "");
    let unknown = doctor(&home).args(["--device", "spoon"]).output().unwrap();
    assert_eq!(unknown.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&unknown.stderr).starts_with("unknown-device: "));
}

#[test]
fn a_port_that_another_program_uses_is_found() {
    let home = folder("doctor-port");
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    let device = format!("stream:{}", socket.local_addr().unwrap());
    let output = doctor(&home).args(["--device", &device]).output().unwrap();
    finds(&output, "device", "missing", "in use", "a free port");
}

#[test]
fn a_serial_port_without_rights_names_the_group() {
    let home = folder("doctor-serial");
    let preparation = format!("touch port; chmod 600 port; {AS_USER}");
    let Some(output) = prepared_by_root(&home, &preparation, "--device polhem:serial:port") else { return };
    finds(&output, "device", "missing", "cannot open the serial port", "dialout");
}

/// Shell that puts a SpaceMouse into /sys and /dev as the kernel describes it there, for this mount namespace alone.
const SPACEMOUSE: &str = r"
    mount -t tmpfs none /sys/class; mkdir -p /sys/class/hidraw kernel/hid kernel/hidraw device/hidraw/hidraw0
    printf 'HID_ID=0003:0000046D:0000C626\nHID_NAME=SpaceNavigator\nHID_UNIQ=\n' > device/uevent
    printf 'MAJOR=240\nMINOR=0\nDEVNAME=hidraw0\n' > device/hidraw/hidraw0/uevent
    ln -s ../kernel/hid device/subsystem; ln -s ../../../kernel/hidraw device/hidraw/hidraw0/subsystem
    mkdir device/hidraw/hidraw0/device; printf '\005\001\011\010\241\001\300' > device/hidraw/hidraw0/device/report_descriptor
    ln -s $PWD/device/hidraw/hidraw0 /sys/class/hidraw/hidraw0
    mkdir node; cp -a /dev/null /dev/zero /dev/urandom /dev/random node; touch node/hidraw0
    mount --bind node /dev";

#[test]
fn a_hid_device_without_rights_names_the_rule() {
    let home = folder("doctor-hid");
    let preparation = format!("{SPACEMOUSE}; chmod 600 /dev/hidraw0; chmod 777 .; {AS_USER}");
    let Some(output) = prepared_by_root(&home, &preparation, "--device spacemouse") else { return };
    finds(&output, "device", "missing", "Permission denied", "70-typodont.rules");
    finds(&output, "device-access", "warning", "SpaceNavigator (046d:c626)", "udevadm");
}

#[test]
fn a_device_that_another_program_has_open_is_found() {
    let home = folder("doctor-in-use");
    // The other program ends by itself.
    let preparation = format!("{SPACEMOUSE}\nsleep 20 < /dev/hidraw0 > /dev/null 2>&1 &\nAS=");
    let Some(output) = prepared_by_root(&home, &preparation, "") else { return };
    finds(&output, "device-access", "warning", "SpaceNavigator is also open in sleep (process ", "close that program");
}

#[test]
fn a_library_of_a_vendor_that_lacks_functions_is_too_old() {
    let home = folder("doctor-library");
    let library = home.join("libHD.so");
    fs::write(home.join("old.c"), "int hdInitDevice(void) { return 0; }\n").unwrap();
    let compiled = Command::new("cc").args(["-shared", "-fPIC", "-o"]).arg(&library).arg(home.join("old.c")).status();
    assert!(compiled.is_ok_and(|status| status.success()), "cc, which linking this test needed, too");
    let named = format!("openhaptics:{}", library.display());
    let output = doctor(&home).args(["--device", &named]).output().unwrap();
    finds(&output, "device", "missing", "hdDisableDevice", "too old");
    // Installed where the system looks for it, while the station uses the mouse: said, and no obstacle.
    let output = doctor(&home).env("LD_LIBRARY_PATH", &home).output().unwrap();
    finds(&output, "other-device", "warning", "openhaptics: cannot load", "too old");
}

#[test]
fn a_wrong_station_and_old_exercises_are_found() {
    let home = folder("doctor-station");
    fs::create_dir(home.join("course")).unwrap();
    fs::write(home.join("course/1.json"), "{}").unwrap();
    let station = home.join("station.toml");
    let doctor = || doctor(&home).args(["--station", "station.toml"]).output().unwrap();
    fs::write(&station, "devise = 'mouse'\n").unwrap();
    finds(&doctor(), "station", "missing", "station.toml:1:1: unknown-key", "typodont check");
    let course = home.join("course");
    fs::write(&station, format!("mode = 'kiosk'\nexercises = '{}'\n", course.display())).unwrap();
    finds(&doctor(), "station", "warning", "no-code", "typodont station code");
    finds(&doctor(), "exercises", "warning", "1 files of the school's exercises differ", "typodont station sync");
    fs::remove_dir_all(course).unwrap();
    finds(&doctor(), "exercises", "warning", "cannot be compared", "connect the network");
}
