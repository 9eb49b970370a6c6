//! The desktop program on a virtual display, operated by simulated mouse and keyboard input.
//!
//! The program writes the state of its screen to a log, so that tests wait for states and never for times.
#![allow(dead_code)]

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Size of the virtual display, pixels.
const SCREEN_SIZE: [i32; 2] = [1280, 800];

/// Maximum time to wait for a state on a busy computer; a test that exceeds it fails.
pub const PATIENCE: Duration = Duration::from_secs(180);

/// Number of exercises that the list shows before those of a school.
pub const SHIPPED_EXERCISES: usize = 15;

/// Poll interval of the state log.
pub const LOOK_EVERY: Duration = Duration::from_millis(20);

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
            assert!(begun.elapsed() < PATIENCE, "the window does not take the keys: {said}; {}", desk.complained());
            std::thread::sleep(LOOK_EVERY);
        }
        desk.display.xdotool(&["mousemove", "640", "400"]);
        desk
    }

    /// The newest line of a topic.
    pub fn latest(&self, topic: &str) -> Option<String> {
        let text = fs::read_to_string(&self.state_log).unwrap_or_default();
        // A line that is being written is not one yet.
        let whole = &text[..text.rfind('\n').map_or(0, |end| end + 1)];
        whole.lines().rev().find_map(|line| Some(line.strip_prefix(topic)?.strip_prefix(' ')?.to_string()))
    }

    /// Waits until a topic's newest line is as wanted.
    pub fn until(&mut self, topic: &str, is_wanted: impl Fn(&str) -> bool) -> String {
        let begun = Instant::now();
        loop {
            let latest = self.latest(topic);
            if let Some(value) = latest.as_deref().filter(|value| is_wanted(value)) {
                return value.to_string();
            }
            self.must_run();
            assert!(begun.elapsed() < PATIENCE, "{topic} stays {latest:?}; {}", self.complained());
            std::thread::sleep(LOOK_EVERY);
        }
    }

    fn must_run(&mut self) {
        let ended = self.program.try_wait().unwrap();
        assert!(ended.is_none(), "the program ended: {}", self.complained());
    }

    fn complained(&self) -> String {
        fs::read_to_string(&self.complaints).unwrap_or_default()
    }

    /// Presses a key until a topic is as wanted: a key that comes before the window listens is lost.
    pub fn press(&mut self, key: &str, topic: &str, wanted: &str) {
        assert!(self.display.xdotool(&["key", "--clearmodifiers", key]));
        self.until(topic, |value| value == wanted);
        println!("{key}: {topic} {wanted}");
    }

    /// Screen position of an anchor, pixels; waits until the anchor appears. Positions off the screen do not count: the
    /// first frame may be laid out before the window has its size.
    pub fn place_of(&mut self, name: &str) -> [i32; 2] {
        let start = format!("{name}=");
        let position = |marks: &str| -> Option<[i32; 2]> {
            let mark = marks.split(' ').find_map(|mark| mark.strip_prefix(&start))?;
            let (x, y) = mark.split_once(',')?;
            let at = [x.parse().ok()?, y.parse().ok()?];
            (0..2).all(|axis| (0..SCREEN_SIZE[axis]).contains(&at[axis])).then_some(at)
        };
        let marks = self.until("marks", |marks| position(marks).is_some());
        position(&marks).unwrap()
    }

    /// Waits until the author's screen has been drawn several times more, so that earlier input has taken effect. On
    /// other screens, waits for a fixed time.
    pub fn turn(&mut self) {
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

    /// Clicks on something by its name.
    pub fn click(&mut self, name: &str) {
        let at = self.place_of(name);
        self.click_at(at);
        println!("click: {name}");
    }

    pub fn click_at(&mut self, [x, y]: [i32; 2]) {
        self.display.xdotool(&["mousemove", &x.to_string(), &y.to_string()]);
        // The window hears of the way before the press.
        self.turn();
        self.display.xdotool(&["click", "1"]);
        self.turn();
    }

    /// Drags an anchor by some pixels.
    pub fn drag(&mut self, name: &str, [right, down]: [i32; 2]) {
        const STEPS: i32 = 4;
        let [x, y] = self.place_of(name);
        self.display.xdotool(&["mousemove", &x.to_string(), &y.to_string()]);
        self.turn();
        self.display.xdotool(&["mousedown", "1"]);
        self.turn();
        for step in 1..=STEPS {
            let to = [x + right * step / STEPS, y + down * step / STEPS].map(|px| px.to_string());
            self.display.xdotool(&["mousemove", &to[0], &to[1]]);
            self.turn();
        }
        self.display.xdotool(&["mouseup", "1"]);
        self.turn();
        println!("drag: {name}");
    }

    /// Writes over what stands in a field, and leaves it by a key.
    pub fn write(&mut self, name: &str, text: &str) {
        self.click(name);
        self.key("ctrl+a");
        self.display.xdotool(&["type", "--delay", "15", text]);
        self.turn();
        self.key("Tab");
        println!("write: {name} {text}");
    }

    pub fn key(&mut self, key: &str) {
        self.display.xdotool(&["key", "--clearmodifiers", key]);
        self.turn();
    }

    /// Saves a screenshot if screenshots were requested.
    pub fn picture(&self, name: &str) {
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
