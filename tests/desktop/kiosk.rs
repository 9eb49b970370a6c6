//! A kiosk: a station's window without a way out, driven with real keys and a real mouse.

use crate::harness::{self, Window};
use crate::support::bundle::{complained, told};
use crate::support::folder::folder;
use crate::support::screen::{Desk, Display, LOOK_EVERY, PATIENCE, WindowDriver};
use crate::support::window_driver::SHIPPED_EXERCISES;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use typodont_app::{AppOptions, KioskOptions, StationOptions};

const CODE: &str = "lab two, 1984";

/// The line of a station's file for [`CODE`], as an administrator makes it.
fn code_line() -> String {
    let mut program = Command::new(env!("CARGO_BIN_EXE_typodont"))
        .args(["station", "code"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    program.stdin.take().unwrap().write_all(CODE.as_bytes()).unwrap();
    let output = program.wait_with_output().unwrap();
    assert!(output.status.success(), "{}", complained(&output));
    told(&output)
}

/// The file of a kiosk whose exercises and sessions are in `place`.
fn kiosk(place: &Path) -> PathBuf {
    let exercises = place.join("course");
    fs::create_dir_all(&exercises).unwrap();
    let shipped = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/5-grinding.json")).unwrap();
    fs::write(exercises.join("own.json"), shipped.replace("\"5-grinding\"", "\"own-grinding\"")).unwrap();
    let file = place.join("station.toml");
    let text = format!(
        "seat = 'lab-2'\nlanguage = 'tr'\ndevice = 'mouse'\nmode = 'kiosk'\nidle_minutes = 1\nexercises = '{}'\n\
         sessions = '{}'\n{}",
        exercises.display(),
        place.join("sessions").display(),
        code_line()
    );
    fs::write(&file, text).unwrap();
    file
}

/// Asks a window to close, as a window manager does: the protocol WM_DELETE_WINDOW.
const CLOSE_REQUEST: &str = r#"
import ctypes as c, sys
x = c.CDLL("libX11.so.6")
x.XOpenDisplay.restype = c.c_void_p
x.XInternAtom.restype = c.c_ulong
class ClientMessage(c.Structure):
    _fields_ = [("type", c.c_int), ("serial", c.c_ulong), ("sent", c.c_int), ("display", c.c_void_p),
                ("window", c.c_ulong), ("kind", c.c_ulong), ("format", c.c_int), ("data", c.c_long * 5), ("rest", c.c_long * 24)]
display, window = c.c_void_p(x.XOpenDisplay(None)), int(sys.argv[1])
atom = lambda name: x.XInternAtom(display, name, 0)
data = (c.c_long * 5)(atom(b"WM_DELETE_WINDOW"), 0, 0, 0, 0)
message = ClientMessage(33, 0, 1, display, window, atom(b"WM_PROTOCOLS"), 32, data)
assert x.XSendEvent(display, c.c_ulong(window), 0, c.c_long(0), c.byref(message))
x.XCloseDisplay(display)
"#;

fn request_close(desk: &Desk) {
    let find = ["search", "--onlyvisible", "--name", "Typodont"];
    let output = Command::new("xdotool").args(find).env("DISPLAY", &desk.display.name).output().unwrap();
    let window = told(&output).lines().next().unwrap().to_string();
    let mut python = Command::new("python3");
    let status = python.args(["-c", CLOSE_REQUEST, &window]).env("DISPLAY", &desk.display.name).status().unwrap();
    assert!(status.success());
}

/// Clicks on something in a page over the screen, which takes its place within a few frames.
fn click_in_page(desk: &mut Desk, name: &str) {
    let mut place = desk.place_of(name);
    loop {
        desk.turn();
        let now = desk.place_of(name);
        if now == place {
            return desk.click_at(place);
        }
        place = now;
    }
}

#[test]
fn a_kiosk_has_no_way_out_but_the_supervisors_code() {
    // Aim: trainees can neither leave an examination nor reach the author's screen. Method: the requests of a window manager
    // and of the keyboard; then a wrong code and the right one.
    let Some(display) = Display::open() else { return };
    let place = folder("kiosk");
    let file = kiosk(&place);
    let mut desk = Desk::sit_down(display, &place, &["--station", file.to_str().unwrap()]);
    desk.until("screen", |screen| screen == "shelf");
    desk.picture("30-kiosk");
    let marks = desk.until("marks", |marks| marks.contains("menu.settings"));
    assert!(
        !marks.contains("shelf.edit") && !marks.contains("shelf.new"),
        "the author's screen is not offered: {marks}"
    );
    // The school's exercise is in the list, from the station's copy.
    desk.press("End", "screen", "shelf");
    for _ in 0..SHIPPED_EXERCISES {
        desk.key("Down");
    }
    desk.until("chosen", |chosen| chosen == "own-grinding");
    desk.press("Return", "screen", "briefing");
    desk.key("Return");
    assert_eq!(desk.latest("screen").as_deref(), Some("briefing"), "a session in a kiosk needs a participant's code");
    desk.press("F2", "over", "settings");
    desk.picture("31-kiosk-settings");
    click_in_page(&mut desk, "kiosk.close_program");
    desk.until("kiosk", |state| state == "asked");
    desk.key("Escape");
    desk.until("kiosk", |state| state == "nothing");
    request_close(&desk);
    desk.until("kiosk", |state| state == "asked");
    desk.picture("32-kiosk-code");
    for (typed, state) in [("a wrong code", "refused"), ("", "refused")] {
        desk.display.xdotool(&["type", "--delay", "15", typed]);
        desk.key("Return");
        desk.until("kiosk", |now| now == state);
    }
    desk.display.xdotool(&["type", "--delay", "15", CODE]);
    desk.display.xdotool(&["key", "Return"]);
    let begun = Instant::now();
    let status = loop {
        if let Some(status) = desk.program.try_wait().unwrap() {
            break status;
        }
        assert!(begun.elapsed() < PATIENCE, "the right code does not close the kiosk: {:?}", desk.latest("kiosk"));
        std::thread::sleep(LOOK_EVERY);
    };
    assert!(status.success(), "{status}");
    assert!(!harness::user_folder(&place).join("settings.json").exists(), "the station's settings are not the user's");
}

#[test]
fn a_kiosk_that_nobody_uses_is_ready_for_the_next_participant() {
    // Aim: nobody continues under the code of somebody who has left. Method: a briefing of a participant, and no input for
    // longer than the kiosk allows.
    let place = folder("kiosk-idle");
    let kiosk = KioskOptions { supervisor_code: None, idle: Duration::from_secs(12) };
    let exercise = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/5-grinding.json");
    let options = AppOptions {
        exercise: Some(exercise),
        participant: "P-7".into(),
        station: Some(StationOptions { kiosk: Some(kiosk), ..StationOptions::default() }),
        ..harness::options(&place)
    };
    let Some(mut desk) = Window::open(&place, options) else { return };
    desk.until("screen", |screen| screen == "briefing");
    desk.until("screen", |screen| screen == "shelf");
    desk.until("chosen", |chosen| chosen == "1-introduction");
    desk.press("Return", "screen", "briefing");
    desk.key("Return");
    assert_eq!(desk.latest("screen").as_deref(), Some("briefing"), "the code of the last participant is gone");
}
