//! The desktop program on a virtual display, operated by simulated mouse and keyboard input.
//!
//! Only what needs a real display is tested with it: most tests of the window use `tests/desktop/harness.rs`. The program
//! writes the state of its screen to a log, so that tests wait for states and never for times.
#![allow(dead_code)]

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

pub use super::window_driver::{LOOK_EVERY, PATIENCE, SHIPPED_EXERCISES, WindowDriver};

/// A virtual display for one test.
pub struct Display {
    pub server: Child,
    pub name: String,
}

impl Display {
    /// Starts a display; prints the reason and returns `None` if that is not possible.
    pub fn open() -> Option<Display> {
        let has = |program: &str| {
            Command::new("which").arg(program).stdout(Stdio::null()).status().is_ok_and(|s| s.success())
        };
        if !has("Xvfb") || !has("xdotool") {
            super::tools::skip("there is no Xvfb or no xdotool: the window is not driven");
            return None;
        }
        let mut server = Command::new("Xvfb")
            .args(["-displayfd", "1", "-screen", "0", "1280x800x24", "-nolisten", "tcp"])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let mut number = String::new();
        BufReader::new(server.stdout.take().unwrap()).read_line(&mut number).unwrap();
        Some(Display { server, name: format!(":{}", number.trim()) })
    }

    pub fn xdotool(&self, arguments: &[&str]) -> bool {
        self.tried(arguments).is_ok()
    }

    /// Runs xdotool; returns its error text if it fails.
    fn tried(&self, arguments: &[&str]) -> Result<(), String> {
        let output = Command::new("xdotool").args(arguments).env("DISPLAY", &self.name).output().unwrap();
        let said = || format!("xdotool {}: {}", output.status, String::from_utf8_lossy(&output.stderr));
        if output.status.success() { Ok(()) } else { Err(said()) }
    }
}

impl Drop for Display {
    fn drop(&mut self) {
        // Asked to end, it takes its lock and its socket along: of what a killed one leaves, two new ones may take the same.
        let asked = Command::new("kill").args(["-TERM", &self.server.id().to_string()]).status();
        if !asked.is_ok_and(|status| status.success()) {
            let _ = self.server.kill();
        }
        let _ = self.server.wait();
    }
}

/// The running desktop program, with methods that operate it and read its state log.
pub struct Desk {
    pub program: Child,
    pub state_log: PathBuf,
    pub complaints: PathBuf,
    // Last: the program goes before its display.
    pub display: Display,
}

impl Desk {
    pub fn sit_down(display: Display, place: &Path, more: &[&str]) -> Desk {
        Desk::sit_down_with(display, place, more, &[])
    }

    /// The same, with more in the environment.
    pub fn sit_down_with(display: Display, place: &Path, more: &[&str], environment: &[(&str, String)]) -> Desk {
        let (state_log, home) = (place.join("state-log"), place.join("home"));
        let complaints = place.join("complaints");
        fs::create_dir_all(&home).unwrap();
        // The log of an earlier run must not be read.
        let _ = fs::remove_file(&state_log);
        let program = Command::new(env!("CARGO_BIN_EXE_typodont"))
            .args(more)
            .current_dir(place)
            .env("DISPLAY", &display.name)
            .env("HOME", &home)
            .env("XDG_CONFIG_HOME", home.join("config"))
            .env("LANG", "en_GB.UTF-8")
            .env("TYPODONT_STATE_LOG", &state_log)
            .env_remove("WAYLAND_DISPLAY")
            .env_remove("LC_ALL")
            .envs(environment.iter().map(|(name, value)| (name, value)))
            .stdout(Stdio::null())
            .stderr(fs::File::create(&complaints).unwrap())
            .spawn()
            .unwrap();
        let mut desk = Desk { program, state_log, complaints, display };
        desk.until("frames", |_| true);
        let begun = Instant::now();
        let focus = ["search", "--onlyvisible", "--name", "Typodont", "windowfocus", "--sync"];
        while let Err(said) = desk.display.tried(&focus) {
            desk.must_run();
            assert!(begun.elapsed() < PATIENCE, "the window does not take the keys: {said}; {}", desk.complaints());
            std::thread::sleep(LOOK_EVERY);
        }
        desk.display.xdotool(&["mousemove", "640", "400"]);
        desk
    }

    fn must_run(&mut self) {
        let ended = self.program.try_wait().unwrap();
        assert!(ended.is_none(), "the program ended: {}", self.complaints());
    }

    fn operate(&self, arguments: &[&str]) {
        assert!(self.display.xdotool(arguments), "xdotool {arguments:?}");
    }
}

impl WindowDriver for Desk {
    fn latest(&self, topic: &str) -> Option<String> {
        let text = fs::read_to_string(&self.state_log).unwrap_or_default();
        // A line that is being written is not one yet.
        let whole = &text[..text.rfind('\n').map_or(0, |end| end + 1)];
        whole.lines().rev().find_map(|line| Some(line.strip_prefix(topic)?.strip_prefix(' ')?.to_string()))
    }

    fn proceed(&mut self) {
        self.must_run();
        std::thread::sleep(LOOK_EVERY);
    }

    fn send_key(&mut self, key: &str) {
        self.operate(&["key", "--clearmodifiers", key]);
    }

    fn type_text(&mut self, text: &str) {
        self.operate(&["type", "--delay", "15", text]);
    }

    fn move_to(&mut self, place: [i32; 2]) {
        let [x, y] = place.map(|pixels| pixels.to_string());
        self.operate(&["mousemove", &x, &y]);
    }

    fn move_by(&mut self, by: [i32; 2]) {
        let [right, down] = by.map(|pixels| pixels.to_string());
        self.operate(&["mousemove_relative", "--", &right, &down]);
    }

    fn set_button(&mut self, is_down: bool) {
        self.operate(&[if is_down { "mousedown" } else { "mouseup" }, "1"]);
    }

    /// Waits until the author's screen has been drawn several times more. On other screens, waits for a fixed time.
    fn turn(&mut self) {
        let count = |desk: &Desk| desk.latest("turn").and_then(|turn| turn.parse::<u64>().ok()).unwrap_or_default();
        let is_at_author = |desk: &Desk| desk.latest("screen").as_deref() == Some("author");
        if !is_at_author(self) {
            return std::thread::sleep(Duration::from_millis(400));
        }
        let (begun, now) = (Instant::now(), count(self));
        while is_at_author(self) && count(self) < now + 3 {
            assert!(begun.elapsed() < PATIENCE, "the window is not drawn any more");
            std::thread::sleep(LOOK_EVERY);
        }
    }

    fn complaints(&self) -> String {
        fs::read_to_string(&self.complaints).unwrap_or_default()
    }

    fn picture(&mut self, name: &str) {
        if let Some(folder) = std::env::var_os("TYPODONT_TEST_PICTURES") {
            // The state log is a picture or two ahead of the screen.
            std::thread::sleep(Duration::from_secs(2));
            let file = Path::new(&folder).join(format!("{name}.png"));
            let _ =
                Command::new("import").args(["-window", "root"]).arg(file).env("DISPLAY", &self.display.name).status();
        }
    }
}

impl Drop for Desk {
    fn drop(&mut self) {
        let _ = self.program.kill();
        let _ = self.program.wait();
    }
}
