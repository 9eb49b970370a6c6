//! A trainee who sees the window's picture and nothing else: points at what is brown, and presses until it is gone.

use crate::harness::{self, Window};
use crate::support::bundle::session;
use crate::support::folder::folder;
use crate::support::window_driver::{SCREEN_SIZE, WindowDriver};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::{Duration, Instant};
use typodont_app::AppOptions;

/// An exercise, and the points that the pointer must reach.
struct Task {
    exercise: &'static str,
    points: f64,
    /// True if a warning is passed over while the section shows caries at the bur, as a fissure is opened through sound enamel,
    /// and the bur is lifted where it shows the pulp near the bur.
    looks_at_section: bool,
    views: &'static [View],
}

const GRINDING: Task = Task { exercise: "5-grinding", points: 80.0, looks_at_section: false, views: &VIEWS };
const FISSURE: Task = Task { exercise: "8-fissure", points: 70.0, looks_at_section: true, views: &VIEWS_INTO_FISSURE };

/// Spacing of the pixels that are looked at, in each direction.
const STRIDE: usize = 4;

/// Distance around a place within which brown pixels count for it, looked-at pixels.
const REACH: usize = 3;

/// Number of brown pixels around a place below which it is not worth a touch.
const SPECK: usize = 4;

/// Time after which a place that stays as brown as it was is left.
const PATIENCE_AT_SPOT: Duration = Duration::from_millis(1200);

/// Time between two looks at a place that is pressed on.
const LOOK_INTERVAL: Duration = Duration::from_millis(200);

/// Number of red pixels below the view from which they are a warning.
const WARNING_PIXELS: usize = 30;

/// Width and height of the lower right corner of the view with the section, which shows caries, too; pixels.
const SECTION: [usize; 2] = [215, 260];

/// The part of the section in which a millimetre of tissue is seen beside and under the bur: its left, top, right and bottom, by
/// the distance from the lower right corner of the view, pixels.
const AROUND_BUR: [usize; 4] = [127, 143, 87, 118];

/// A part that reaches as far again below it.
const BELOW_BUR: [usize; 4] = [127, 143, 87, 98];

/// Time after which the trainee finishes, which leaves a minute of the ten.
const TIME: Duration = Duration::from_secs(540);

/// A view as chosen from the list, and presses of the keys that turn it from there: to the right and up; negative to the left and
/// down.
type View = (&'static str, [i32; 2]);

/// Views in turn.
const VIEWS: [View; 5] = [
    ("Working area", [0, 0]),
    ("Occlusal", [0, 0]),
    ("Working area", [12, 0]),
    ("Working area", [-12, 0]),
    ("Working area", [26, 0]),
];

/// The same, and four that look steeply under the enamel around the opening.
const VIEWS_INTO_FISSURE: [View; 9] = [
    VIEWS[0],
    VIEWS[1],
    VIEWS[2],
    VIEWS[3],
    VIEWS[4],
    ("Occlusal", [0, -5]),
    ("Occlusal", [16, -5]),
    ("Occlusal", [31, -5]),
    ("Occlusal", [-16, -5]),
];

/// One trial at a time: a trainee must see in time when to let go.
static TRIAL: Mutex<()> = Mutex::new(());

/// Pointing device of the trainee.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Pointer {
    Mouse,
    /// Points without touching, and presses as hard as it touches.
    Pen,
    /// One finger points, a second one presses.
    Fingers,
}

/// Place among the looked-at pixels, column and row.
type Spot = [usize; 2];

/// The brown pixels of the view, by column and row of those that are looked at.
struct Seen {
    columns: usize,
    rows: usize,
    is_brown: Vec<bool>,
    /// True while a warning stands below the view.
    is_warned: bool,
    /// True if the section shows caries beside or under the bur.
    is_brown_near_bur: bool,
    /// True if it shows the pulp beside or under the bur.
    is_pulp_near_bur: bool,
}

impl Seen {
    fn brown_around(&self, [x, y]: Spot) -> usize {
        let rows = y.saturating_sub(REACH)..(y + REACH + 1).min(self.rows);
        let columns = x.saturating_sub(REACH)..(x + REACH + 1).min(self.columns);
        rows.map(|row| columns.clone().filter(|column| self.is_brown[row * self.columns + column]).count()).sum()
    }

    /// The spot with the most brown around it, away from those that stayed brown.
    fn brownest(&self, stuck: &[Spot]) -> Option<Spot> {
        let brown = (0..self.is_brown.len()).filter(|&i| self.is_brown[i]);
        let spots = brown.map(|i| [i % self.columns, i / self.columns]);
        let is_new = |[x, y]: Spot| stuck.iter().all(|[a, b]| x.abs_diff(*a).max(y.abs_diff(*b)) > REACH);
        let open = spots.filter(|spot| is_new(*spot)).map(|spot| (self.brown_around(spot), spot));
        open.max().filter(|(brown, _)| *brown >= SPECK).map(|(_, spot)| spot)
    }
}

/// True for the colours of caries in any light: brown, neither grey nor as red as gingiva, nor as yellow as dentine.
fn is_brown(red: u8, green: u8, blue: u8) -> bool {
    let [red, green, blue] = [red, green, blue].map(f32::from);
    red > 55.0 && red < 200.0 && red > 1.28 * green && green > 1.22 * blue
}

/// True for the colour of warnings, and of the pulp in the section; not for one between two browns.
fn is_red(red: u8, green: u8, blue: u8) -> bool {
    let [red, green, blue] = [red, green, blue].map(u32::from);
    red > 120 && red > 2 * green.max(blue)
}

struct Trial {
    desk: Window,
    pointer: Pointer,
    /// Part of the screen that is looked at: left, top, right and bottom, pixels.
    view: [usize; 4],
    is_touching: bool,
    looks_at_section: bool,
    views: &'static [View],
    begun: Instant,
}

impl Trial {
    fn look(&mut self) -> Seen {
        let pixels = self.desk.pixels();
        let pixel = |x: usize, y: usize| &pixels[4 * (y * SCREEN_SIZE[0] as usize + x)..];
        let [left, top, right, bottom] = self.view;
        let (columns, rows) = ((right - left) / STRIDE, (bottom - top) / STRIDE);
        let is_section = |x: usize, y: usize| x + SECTION[0] > right && y + SECTION[1] > bottom;
        let is_brown_at = |i: usize| {
            let (x, y) = (left + i % columns * STRIDE, top + i / columns * STRIDE);
            let seen = pixel(x, y);
            !is_section(x, y) && is_brown(seen[0], seen[1], seen[2])
        };
        let below = (bottom..SCREEN_SIZE[1] as usize).flat_map(|y| (left..right).map(move |x| pixel(x, y)));
        let is_warned = below.filter(|seen| is_red(seen[0], seen[1], seen[2])).count() > WARNING_PIXELS;
        let shows = |[left_by, top_by, right_by, bottom_by]: [usize; 4], is_sought: fn(u8, u8, u8) -> bool| {
            (bottom - top_by..bottom - bottom_by)
                .flat_map(|y| (right - left_by..right - right_by).map(move |x| pixel(x, y)))
                .any(|seen| is_sought(seen[0], seen[1], seen[2]))
        };
        let (is_brown_near_bur, is_pulp_near_bur) = (shows(AROUND_BUR, is_brown), shows(BELOW_BUR, is_red));
        let is_brown = (0..columns * rows).map(is_brown_at).collect();
        Seen { columns, rows, is_brown, is_warned, is_brown_near_bur, is_pulp_near_bur }
    }

    fn place(&self, [x, y]: Spot) -> [i32; 2] {
        [(self.view[0] + x * STRIDE) as i32, (self.view[1] + y * STRIDE) as i32]
    }

    fn point(&mut self, spot: Spot) {
        let place = self.place(spot);
        match (self.pointer, self.is_touching) {
            (Pointer::Mouse | Pointer::Pen, _) => self.desk.move_to(place),
            (Pointer::Fingers, false) => self.desk.touch(0, place, None),
            (Pointer::Fingers, true) => self.desk.slide(0, place, None),
        }
        self.is_touching = self.pointer == Pointer::Fingers;
    }

    fn press(&mut self, spot: Spot, is_down: bool) {
        let place = self.place(spot);
        match (self.pointer, is_down) {
            (Pointer::Mouse, _) => self.desk.set_button(is_down),
            (Pointer::Pen, true) => {
                self.desk.touch(0, place, Some(0.6));
                self.desk.slide(0, place, Some(1.0));
            }
            (Pointer::Pen, false) => self.desk.lift(0, place),
            (Pointer::Fingers, true) => self.desk.touch(1, place.map(|at| at + 90), None),
            (Pointer::Fingers, false) => self.desk.lift(1, place.map(|at| at + 90)),
        }
    }

    fn lift(&mut self) {
        if std::mem::take(&mut self.is_touching) {
            self.desk.lift(0, [self.view[0] as i32 + 9, self.view[1] as i32 + 9]);
        }
    }

    fn is_over(&self) -> bool {
        self.begun.elapsed() > TIME || self.desk.latest("screen").as_deref() != Some("practice")
    }

    /// Presses on what is brown in this view until nothing is, or all that is stays brown. Returns the number of spots that
    /// became clearly less brown.
    fn clear_view(&mut self) -> usize {
        let (mut stuck, mut cleared) = (Vec::new(), 0);
        while !self.is_over() {
            let seen = self.look();
            let Some(spot) = seen.brownest(&stuck) else { break };
            let before = seen.brown_around(spot);
            self.point(spot);
            self.press(spot, true);
            let (mut least, mut since) = (before, Instant::now());
            while since.elapsed() < PATIENCE_AT_SPOT && !self.is_over() {
                self.desk.wait(LOOK_INTERVAL);
                let seen = self.look();
                let brown = seen.brown_around(spot);
                if brown < least {
                    (least, since) = (brown, Instant::now());
                }
                let is_enough = match self.looks_at_section {
                    true => seen.is_pulp_near_bur || seen.is_warned && !seen.is_brown_near_bur,
                    false => seen.is_warned,
                };
                if brown == 0 || is_enough {
                    break;
                }
            }
            self.press(spot, false);
            cleared += usize::from(least + SPECK <= before);
            if least > 0 {
                stuck.push(spot);
            }
        }
        self.lift();
        cleared
    }

    fn show(&mut self, (view, turns): View) {
        self.desk.choose_from("View", view);
        for (turns, keys) in
            turns.into_iter().zip([["ctrl+ArrowLeft", "ctrl+ArrowRight"], ["ctrl+ArrowDown", "ctrl+ArrowUp"]])
        {
            for _ in 0..turns.abs() {
                self.desk.send_key(keys[usize::from(turns > 0)]);
            }
        }
        // The picture is drawn sharply once it stands still.
        self.desk.wait(Duration::from_millis(700));
    }

    /// Works in all views until nothing becomes less brown for two rounds, or the time is over.
    fn work(&mut self) {
        let mut idle_rounds = 0;
        while idle_rounds < 2 && !self.is_over() {
            let mut cleared = 0;
            for view in self.views {
                if !self.is_over() {
                    self.show(*view);
                    cleared += self.clear_view();
                }
            }
            idle_rounds = if cleared == 0 { idle_rounds + 1 } else { 0 };
        }
    }
}

/// Points of a trial, and true if it was passed.
#[derive(Clone, Copy, Debug)]
struct Outcome {
    points: f64,
    is_passed: bool,
}

/// Performs the exercise by looking at the window; `None` where nothing can draw it.
fn perform(task: &Task, seed: u64, pointer: Pointer) -> Option<Outcome> {
    let Task { exercise, looks_at_section, views, .. } = *task;
    let place = folder(&format!("pointer_window_{exercise}_{pointer:?}_{seed}"));
    harness::keep_settings(&place, r#"{ "language": "en", "introduction_first": false }"#);
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("scenarios/{exercise}.json"));
    let options = harness::options(&place);
    let options = AppOptions { exercise: Some(path), seed: Some(seed), begins_at_once: true, ..options };
    let mut desk = Window::open(&place, options)?;
    desk.until("screen", |screen| screen == "practice");
    desk.until("hand", |_| true);
    desk.press("o", "pointer", "held");
    let view = desk.view_of("The tooth");
    let mut trial = Trial { desk, pointer, view, is_touching: false, looks_at_section, views, begun: Instant::now() };
    trial.work();
    let Trial { mut desk, begun, .. } = trial;
    let seconds = begun.elapsed().as_secs();
    desk.picture(&format!("pointer-{exercise}-{pointer:?}-{seed}"));
    if desk.latest("screen").as_deref() == Some("practice") {
        desk.press("ctrl+Return", "asked", "finish");
        desk.send_key("Return");
    }
    let bundle = PathBuf::from(desk.until("bundle", |_| true));
    let grade = session(&place.join(bundle))["grade"].clone();
    println!("seed {seed}, {pointer:?}: {seconds} s, {grade:#}");
    Some(Outcome { points: grade["points"].as_f64().unwrap(), is_passed: grade["passed"].as_bool().unwrap() })
}

/// Asserts that a pointer passes with every seed, and with nine of ten (with all of fewer than ten) reaches the points.
///
/// Four seeds place the caries in the four quarters of the tooth; TYPODONT_SEEDS for more.
fn assert_removes_caries(task: Task, pointer: Pointer) {
    let Task { exercise, points, .. } = task;
    let _alone = TRIAL.lock();
    let seeds: u64 = std::env::var("TYPODONT_SEEDS").map_or(4, |seeds| seeds.parse().unwrap());
    let mut all = Vec::new();
    for seed in 1..=seeds {
        let Some(outcome) = perform(&task, seed, pointer) else { return };
        all.push(outcome);
    }
    let enough = all.iter().filter(|outcome| outcome.points >= points).count();
    println!("{exercise}, {pointer:?}: {enough} of {seeds} with {points} points or more: {all:.1?}");
    assert!(10 * enough as u64 >= 9 * seeds, "{all:?}");
    assert!(all.iter().all(|outcome| outcome.is_passed), "{all:?}");
}

#[test]
#[ignore = "scripts/test --long"]
fn who_sees_only_the_picture_removes_the_caries_with_a_mouse() {
    // Aim: a newcomer with a mouse who removes what is brown, and lets go when a warning appears, passes within the time
    // limit. Method: the pixels of the window are all that is known; the pointer goes to the brownest place and presses until
    // it is no longer brown, from five sides.
    assert_removes_caries(GRINDING, Pointer::Mouse);
}

#[test]
#[ignore = "scripts/test --long"]
fn who_sees_only_the_picture_opens_a_fissure_with_a_mouse() {
    // Aim and method: as above, in a fissure, beneath which the caries is seen only once it is open.
    assert_removes_caries(FISSURE, Pointer::Mouse);
}

#[test]
#[ignore = "scripts/test --long"]
fn who_sees_only_the_picture_removes_the_caries_with_a_pen() {
    // Aim and method: as above, by the events of a pen that is pressed down to its full pressure.
    assert_removes_caries(GRINDING, Pointer::Pen);
}

#[test]
#[ignore = "scripts/test --long"]
fn who_sees_only_the_picture_removes_the_caries_with_two_fingers() {
    // Aim and method: as above, by touches of one finger that points and another that presses.
    assert_removes_caries(GRINDING, Pointer::Fingers);
}
