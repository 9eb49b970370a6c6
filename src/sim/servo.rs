//! The servo: a thread that turns [`Simulation::step`] a thousand times a second with a device in somebody's hand.
//!
//! Takes a simulation, an open device and orders. Gives letters: every turned tick with its edits, every command with the
//! tick before which it was carried out. While it turns it never allocates, locks, logs or waits on anyone but the beat.
//! It looks at a monotonic clock to keep that beat; what a tick comes to depends on readings and commands alone.
//!
//! Failing means letting go: a late beat, a device that is not ready or gone, and a reading that is none all turn the world
//! with [`Reading::ABSENT`], which gives zero force and lets forces come back over half a second.

use super::beats::{BeatSummary, Beats};
use super::realtime::{self, Priority};
use super::{Command, Simulation, Step};
use crate::device::{Beat, Device, Gone, Output, Reading, State};
use crate::mailbox::{self, Newest, Receiver, Sender};
use crate::tick::{TICK_S, Tick};
use crate::touch::Gate;
use crate::volume::Edit;
use std::sync::Arc;
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

/// What the servo is told. Carried out before the next tick, in order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Order {
    Command(Command),
    /// Time stands still and the hand is free.
    Pause,
    Resume,
    /// The thread ends, and gives back what it was given.
    Stop,
}

/// What the servo tells, in the order in which it happened.
#[derive(Clone, Copy, Debug)]
pub enum Letter {
    /// A command was carried out, before this tick.
    Commanded(Tick, Command),
    /// A tick was turned; so many edits lie in the other box.
    Turned(Turn),
    /// The device is in another state. Unless it is ready, time stands still.
    Device(State),
}

/// One turned tick.
#[derive(Clone, Copy, Debug)]
pub struct Turn {
    pub reading: Reading,
    pub step: Step,
    pub edits: usize,
    /// What the gates had changed by then.
    pub gate: Gate,
}

/// A running servo, seen from the session's thread.
pub struct Servo {
    orders: Sender<Order>,
    letters: Receiver<Letter>,
    edits: Receiver<Edit>,
    beats: Arc<Newest<9>>,
    thread: JoinHandle<Ended>,
}

/// What a servo leaves when it ends.
pub struct Ended {
    pub simulation: Simulation,
    pub device: Box<dyn Device + Send>,
    pub beats: Beats,
    pub priority: Priority,
    /// Why the device gives no more readings, if that is why.
    pub gone: Option<Gone>,
}

/// Letters that may wait: the session's thread may be away for 16 s, as when a disk wakes up.
const LETTERS_MAX: usize = 1 << 14;

/// Edits that may wait. A bur in soft decay changes about 60 voxels a tick at 0.1 mm and 3 000 at 0.02 mm.
const EDITS_MAX: usize = 1 << 20;

/// Orders that may wait.
const ORDERS_MAX: usize = 256;

/// A beat that comes later than this lets the hand go: about as long as a person's grip needs to notice a frozen force, and
/// as long as [`crate::device::FORCE_LIFE`] has a force rendered.
const LATE_MAX: Duration = Duration::from_millis(10);

/// Ticks between two summaries of the beats.
const SUMMARY_TICKS: u64 = 500;

const BEAT: Duration = Duration::from_micros((TICK_S * 1e6) as u64);

impl Servo {
    /// Starts turning a simulation with a device.
    ///
    /// `beats` are those of the same session so far: a session goes on with another servo after its device was plugged in
    /// again.
    pub fn start(simulation: Simulation, device: Box<dyn Device + Send>, beats: Beats) -> Result<Servo, String> {
        let (orders, inbox) = mailbox::ordered(ORDERS_MAX);
        let (post, letters) = mailbox::ordered(LETTERS_MAX);
        let (edit_post, edits) = mailbox::ordered(EDITS_MAX);
        let summary = Arc::new(Newest::new());
        let post = Post { letters: post, edits: edit_post, beats, summary: summary.clone() };
        let turning = move || turn(simulation, device, inbox, post);
        let thread = thread::Builder::new().name("servo".into()).spawn(turning);
        let thread = thread.map_err(|e| format!("the system gives no thread for the servo: {e}"))?;
        Ok(Servo { orders, letters, edits, beats: summary, thread })
    }

    /// Gives an order; false when there is no room or the servo has ended.
    pub fn order(&mut self, order: Order) -> bool {
        !self.orders.is_abandoned() && self.orders.try_send(order).is_ok()
    }

    /// The next letter, if one lies there.
    pub fn next_letter(&mut self) -> Option<Letter> {
        self.letters.try_recv()
    }

    /// The edits that belong to a turned tick, appended in their order. To be taken once per [`Letter::Turned`].
    pub fn take_edits(&mut self, turn: &Turn, into: &mut Vec<Edit>) {
        into.extend((0..turn.edits).filter_map(|_| self.edits.try_recv()));
    }

    /// How the beats go, as of the last half second.
    pub fn beats(&self) -> Option<BeatSummary> {
        self.beats.read().map(|(_, words)| BeatSummary::of_words(words))
    }

    /// True when the thread has ended by itself: the device is gone.
    pub fn has_ended(&self) -> bool {
        self.thread.is_finished()
    }

    /// Stops the servo and waits for it. Letters that were not fetched are lost with it: fetch them first.
    ///
    /// An error when the thread failed; the device was let go then.
    pub fn stop(mut self) -> Result<Ended, String> {
        self.order(Order::Stop);
        self.thread.join().map_err(|_| "the servo failed and has let the hand go; please report this".to_string())
    }
}

/// Where the servo posts what it did.
struct Post {
    letters: Sender<Letter>,
    edits: Sender<Edit>,
    beats: Beats,
    summary: Arc<Newest<9>>,
}

impl Post {
    fn letter(&mut self, letter: Letter) {
        if self.letters.try_send(letter).is_err() {
            self.beats.dropped += 1;
        }
    }

    /// Posts a tick as a whole or not at all.
    fn turned(&mut self, reading: Reading, step: Step, simulation: &Simulation) {
        let edits = simulation.edits();
        if self.edits.room() < edits.len() || self.letters.room() == 0 {
            self.beats.dropped += 1;
            return;
        }
        for edit in edits {
            // There is room: this thread is the only one that fills it.
            let _ = self.edits.try_send(*edit);
        }
        self.letter(Letter::Turned(Turn { reading, step, edits: edits.len(), gate: *simulation.gate() }));
        if step.tick.0.is_multiple_of(SUMMARY_TICKS) {
            self.summary.write(self.beats.summary().words());
        }
    }
}

/// The thread.
fn turn(
    mut simulation: Simulation,
    mut device: Box<dyn Device + Send>,
    mut orders: Receiver<Order>,
    mut post: Post,
) -> Ended {
    let priority = realtime::raise();
    let mut pace = Pace::new(device.beat(), priority);
    let mut output = Output::NONE;
    let mut state = None;
    let mut is_paused = false;
    // The hand is trusted: the last tick was turned with a reading of the device.
    let mut is_held = false;
    let gone = 'beats: loop {
        let exchanged = {
            pace.wait();
            device.exchange(&output)
        };
        let late = pace.beat(&mut post.beats);
        while let Some(order) = orders.try_recv() {
            match order {
                Order::Command(command) => {
                    simulation.apply(&command);
                    post.letter(Letter::Commanded(simulation.tick(), command));
                }
                Order::Pause => is_paused = true,
                Order::Resume => is_paused = false,
                Order::Stop => break 'beats None,
            }
        }
        let now = device.state();
        if state != Some(now) {
            state = Some(now);
            post.letter(Letter::Device(now));
        }
        let reading = match exchanged {
            Ok(reading) if now.is_ready() && !is_paused => reading,
            Ok(_) => {
                if is_held {
                    let step = simulation.step(&Reading::ABSENT);
                    post.turned(Reading::ABSENT, step, &simulation);
                }
                (is_held, output) = (false, Output::NONE);
                continue;
            }
            Err(gone) => {
                if is_held {
                    let step = simulation.step(&Reading::ABSENT);
                    post.turned(Reading::ABSENT, step, &simulation);
                }
                break 'beats Some(gone);
            }
        };
        let is_late = is_held && late > LATE_MAX;
        post.beats.let_go += u64::from(is_late);
        let reading = if is_late { Reading::ABSENT } else { reading };
        is_held = true;
        let begun = Instant::now();
        let step = simulation.step(&reading);
        post.beats.work.add(begun.elapsed());
        output = step.output();
        post.turned(reading, step, &simulation);
    };
    if gone.is_none() {
        // Whether or not this last beat is answered, the relay sends no force that is older than ten beats.
        let _ = device.exchange(&Output::NONE);
    }
    post.summary.write(post.beats.summary().words());
    Ended { simulation, device, beats: post.beats, priority, gone }
}

/// Keeps the beat, or measures it where the device keeps it.
struct Pace {
    beat: Beat,
    /// End of a wait that is spun instead of slept.
    spin: Duration,
    /// When the next beat is due.
    due: Instant,
}

/// With priority the last stretch of a wait is spun: waking takes 30–100 µs and varies. Without it spinning is punished by
/// the scheduler (measured: p99 of 2.5 ms against 0.1 ms), so nothing is.
const SPIN: Duration = Duration::from_micros(80);

impl Pace {
    fn new(beat: Beat, priority: Priority) -> Pace {
        let spin = if priority == Priority::Realtime { SPIN } else { Duration::ZERO };
        Pace { beat, spin, due: Instant::now() + BEAT }
    }

    /// Waits until the next beat is due, where the device does not do that.
    fn wait(&self) {
        if self.beat == Beat::Device {
            return;
        }
        let left = self.due.saturating_duration_since(Instant::now());
        if left > self.spin {
            thread::sleep(left - self.spin);
        }
        while Instant::now() < self.due {
            std::hint::spin_loop();
        }
    }

    /// A beat has come: counts how late, and says so.
    fn beat(&mut self, beats: &mut Beats) -> Duration {
        let now = Instant::now();
        let late = now.saturating_duration_since(self.due);
        beats.late.add(late);
        let whole = (late.as_secs_f64() / TICK_S) as u32;
        beats.missed += u64::from(whole);
        self.due = match self.beat {
            // Beats that never came are not made up for: the hand has moved on.
            Beat::Ours => self.due + BEAT * (whole + 1),
            Beat::Device => now + BEAT,
        };
        late
    }
}
