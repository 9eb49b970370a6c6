//! The servo: a thread that turns [`Simulation::step`] a thousand times a second with a device in somebody's hand.
//!
//! Takes a simulation, an open device and orders. Gives letters: every turned tick with its edits, every command with the
//! tick before which it was carried out. While it turns it never allocates, locks, logs or waits on anyone but the beat.
//! It looks at a monotonic clock to keep that beat; what a tick comes to depends on readings and commands alone.
//!
//! Failing means letting go: a late beat, a device that is not ready or gone, and a reading that is none all turn the world
//! with [`Reading::ABSENT`], which gives zero force and lets forces come back over half a second.

use super::assist::Second;
use super::beats::{BeatSummary, Beats};
use super::pace::Pace;
use super::{Command, Simulation, Step};
use crate::device::realtime::{self, Priority};
use crate::device::{Device, Gone, Output, Reading, State};
use crate::mailbox::{self, Newest, Receiver, Sender};
use crate::tick::Tick;
use crate::touch::Gate;
use crate::volume::Edit;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

/// What the servo is told. Carried out before the next tick, in order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Order {
    Command(Command),
    /// Time stands still and the hand is free.
    Pause,
    Resume,
}

/// What the servo tells, in the order in which it happened.
#[derive(Clone, Copy, Debug)]
pub enum Letter {
    /// The thread has begun, with this priority.
    Begun(Priority),
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
    stop: Arc<AtomicBool>,
    /// `None` once it was waited for.
    thread: Option<JoinHandle<Ended>>,
}

/// What a servo leaves when it ends.
pub struct Ended {
    pub simulation: Simulation,
    pub device: Box<dyn Device + Send>,
    pub second: Option<Second>,
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

impl Servo {
    /// Starts turning a simulation with a device.
    ///
    /// `second` is another hand in this one's world. `beats` are those of the same session so far: a session goes on with
    /// another servo after its device was plugged in again.
    pub fn start(
        simulation: Simulation,
        device: Box<dyn Device + Send>,
        mut second: Option<Second>,
        beats: Beats,
    ) -> Result<Servo, String> {
        if let Some(second) = &mut second {
            second.enter(&simulation);
        }
        let (orders, inbox) = mailbox::ordered(ORDERS_MAX);
        let (post, letters) = mailbox::ordered(LETTERS_MAX);
        let (edit_post, edits) = mailbox::ordered(EDITS_MAX);
        let summary = Arc::new(Newest::new());
        let post = Post { letters: post, edits: edit_post, beats, summary: summary.clone() };
        let stop = Arc::new(AtomicBool::new(false));
        let is_over = stop.clone();
        let turning = move || turn(simulation, device, second, inbox, post, &is_over);
        let thread = thread::Builder::new().name("servo".into()).spawn(turning);
        let thread = thread.map_err(|e| format!("the system gives no thread for the servo: {e}"))?;
        Ok(Servo { orders, letters, edits, beats: summary, stop, thread: Some(thread) })
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
        self.thread.as_ref().is_none_or(JoinHandle::is_finished)
    }

    /// Stops the servo and waits for it. Letters that were not fetched are lost with it: fetch them first.
    ///
    /// An error when the thread failed; the device was let go then.
    pub fn stop(mut self) -> Result<Ended, String> {
        self.stop.store(true, Ordering::Release);
        let ended = self.thread.take().and_then(|thread| thread.join().ok());
        ended.ok_or_else(|| "the servo failed and has let the hand go; please report this".to_string())
    }
}

/// Whoever drops a servo, for whatever reason, lets the hand go.
impl Drop for Servo {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Release);
        if let Some(thread) = self.thread.take() {
            // It looks up every beat; the device is closed with what the thread leaves.
            let _ = thread.join();
        }
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
    mut second: Option<Second>,
    mut orders: Receiver<Order>,
    mut post: Post,
    is_over: &AtomicBool,
) -> Ended {
    let priority = realtime::raise();
    post.letter(Letter::Begun(priority));
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
        if is_over.load(Ordering::Acquire) {
            break 'beats None;
        }
        let late = match (pace.beat(&mut post.beats), &exchanged) {
            (Some(late), _) => late,
            (None, Ok(_)) => continue,
            (None, Err(_)) => Duration::ZERO,
        };
        // A command that was carried out and not told of would spoil the recording: it waits until its letter fits.
        while post.letters.room() > 1
            && let Some(order) = orders.try_recv()
        {
            match order {
                Order::Command(command) => {
                    simulation.apply(&command);
                    post.letter(Letter::Commanded(simulation.tick(), command));
                }
                Order::Pause => is_paused = true,
                Order::Resume => is_paused = false,
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
                    let_go(&mut simulation, second.as_mut(), &mut post);
                }
                (is_held, output) = (false, Output::NONE);
                continue;
            }
            Err(gone) => {
                if is_held {
                    let_go(&mut simulation, second.as_mut(), &mut post);
                }
                break 'beats Some(gone);
            }
        };
        let is_late = is_held && late > LATE_MAX;
        post.beats.let_go += u64::from(is_late);
        let reading = if is_late { Reading::ABSENT } else { reading };
        is_held = true;
        if let Some(second) = &mut second {
            let lead = second.turn(&reading, &simulation);
            simulation.lead(lead);
        }
        let begun = Instant::now();
        let step = simulation.step(&reading);
        post.beats.work.add(begun.elapsed());
        output = step.output();
        if let Some(second) = second.as_mut().filter(|_| simulation.has_let_go()) {
            second.forget();
        }
        post.turned(reading, step, &simulation);
    };
    if gone.is_none() {
        // Whether or not this last beat is answered, the relay sends no force that is older than ten beats.
        let _ = device.exchange(&Output::NONE);
    }
    post.summary.write(post.beats.summary().words());
    Ended { simulation, device, second, beats: post.beats, priority, gone }
}

/// The one tick in which a hand that was held is let go; time stands still after it.
fn let_go(simulation: &mut Simulation, second: Option<&mut Second>, post: &mut Post) {
    let step = simulation.step(&Reading::ABSENT);
    post.turned(Reading::ABSENT, step, simulation);
    if let Some(second) = second {
        second.forget();
    }
}
