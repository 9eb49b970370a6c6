//! A driver of the window: operates it as a person does, and reads its state log.
//!
//! Two drivers exist: one for the program on a virtual display, one for the window in the test's own process.
#![allow(dead_code)]

use std::time::{Duration, Instant};

/// Size of the screen, pixels.
pub const SCREEN_SIZE: [i32; 2] = [1280, 800];

/// Maximum time to wait for a state on a busy computer; a test that exceeds it fails.
pub const PATIENCE: Duration = Duration::from_secs(180);

/// Number of exercises that the list shows before those of a school.
pub const SHIPPED_EXERCISES: usize = 17;

/// Poll interval of the state log.
pub const LOOK_EVERY: Duration = Duration::from_millis(20);

/// Operates a window and reads its state log.
pub trait WindowDriver {
    /// The newest line of a topic of the state log.
    fn latest(&self, topic: &str) -> Option<String>;

    /// Lets the window run for a moment; fails if it has ended.
    fn proceed(&mut self);

    /// Presses a key or a combination, such as `ctrl+Return`.
    fn send_key(&mut self, key: &str);

    fn type_text(&mut self, text: &str);

    /// Moves the pointer to a place on the screen, pixels.
    fn move_to(&mut self, place: [i32; 2]);

    /// Moves the pointer by some pixels, right and down.
    fn move_by(&mut self, by: [i32; 2]);

    /// Presses or releases the pointer's main button.
    fn set_button(&mut self, is_down: bool);

    /// Waits until earlier input has taken effect.
    fn turn(&mut self);

    /// Error messages of the program.
    fn complaints(&self) -> String;

    /// Saves a picture of the screen if `TYPODONT_TEST_PICTURES` names a folder.
    fn picture(&mut self, name: &str);

    /// Waits until a topic's newest line is as wanted.
    fn until(&mut self, topic: &str, is_wanted: impl Fn(&str) -> bool) -> String {
        let begun = Instant::now();
        loop {
            let latest = self.latest(topic);
            if let Some(value) = latest.as_deref().filter(|value| is_wanted(value)) {
                return value.to_string();
            }
            self.proceed();
            assert!(begun.elapsed() < PATIENCE, "{topic} stays {latest:?}; {}", self.complaints());
        }
    }

    /// Lets the window run for some time.
    fn wait(&mut self, time: Duration) {
        let begun = Instant::now();
        while begun.elapsed() < time {
            self.proceed();
        }
    }

    /// Width and height of the screen, pixels.
    fn screen_size(&self) -> [i32; 2] {
        SCREEN_SIZE
    }

    /// Presses a key, and waits until a topic is as wanted.
    fn press(&mut self, key: &str, topic: &str, wanted: &str) {
        self.send_key(key);
        self.until(topic, |value| value == wanted);
        println!("{key}: {topic} {wanted}");
    }

    fn key(&mut self, key: &str) {
        self.send_key(key);
        self.turn();
    }

    /// Screen position of an anchor, pixels; waits until the anchor appears. Positions off the screen do not count: the
    /// first frame may be laid out before the window has its size.
    fn place_of(&mut self, name: &str) -> [i32; 2] {
        let start = format!("{name}=");
        let size = self.screen_size();
        let position = |marks: &str| -> Option<[i32; 2]> {
            let mark = marks.split(' ').find_map(|mark| mark.strip_prefix(&start))?;
            let (x, y) = mark.split_once(',')?;
            let at = [x.parse().ok()?, y.parse().ok()?];
            (0..2).all(|axis| (0..size[axis]).contains(&at[axis])).then_some(at)
        };
        let marks = self.until("marks", |marks| position(marks).is_some());
        position(&marks).unwrap()
    }

    /// Clicks on something by its name.
    fn click(&mut self, name: &str) {
        let at = self.place_of(name);
        self.click_at(at);
        println!("click: {name}");
    }

    fn click_at(&mut self, place: [i32; 2]) {
        self.move_to(place);
        // The window hears of the way before the press.
        self.turn();
        self.set_button(true);
        self.set_button(false);
        self.turn();
    }

    /// Drags an anchor by some pixels.
    fn drag(&mut self, name: &str, [right, down]: [i32; 2]) {
        const STEPS: i32 = 4;
        let [x, y] = self.place_of(name);
        self.move_to([x, y]);
        self.turn();
        self.set_button(true);
        self.turn();
        for step in 1..=STEPS {
            self.move_to([x + right * step / STEPS, y + down * step / STEPS]);
            self.turn();
        }
        self.set_button(false);
        self.turn();
        println!("drag: {name}");
    }

    /// Writes over what stands in a field, and leaves it by a key.
    fn write(&mut self, name: &str, text: &str) {
        self.click(name);
        self.key("ctrl+a");
        self.type_text(text);
        self.turn();
        self.key("Tab");
        println!("write: {name} {text}");
    }
}
