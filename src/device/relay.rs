//! The thread between a wire and the servo: every driver of a real device stands behind one.
//!
//! A [`Wire`] speaks a device's protocol on a thread of its own, where it may block, allocate and call foreign libraries.
//! The servo meets it at two slots where the newest wins: forces out, reports in. So the servo never waits on anyone, and a
//! servo that is late is noticed on the other side: a force that is older than [`FORCE_LIFE`](super::FORCE_LIFE) is not sent any more.

use super::told::Told;
use super::{Beat, Device, Gone, Output, Reading, Spec, State, realtime};
use crate::frame::{Pose, Quat, Vec3};
use crate::mailbox::{self, Newest, Receiver, Sender};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle, Thread, ThreadId};
use std::time::{Duration, Instant};

/// How long the last report stands in for a missing one: USB and radio hiccup for some milliseconds.
const REPORT_LIFE: Duration = Duration::from_millis(20);

/// Silence after which a device counts as gone.
const GONE_AFTER: Duration = Duration::from_millis(500);

/// How long the servo waits for the next report of a device that keeps the beat: one and a half beats, so that a late report
/// costs one missed beat and not two.
const BEAT_WAIT: Duration = Duration::from_micros(1500);

/// One device's protocol, spoken on a thread of its own.
pub trait Wire: Send + 'static {
    fn spec(&self) -> &Spec;

    /// Whether [`Wire::turn`] waits for the device's own beat, or for nothing.
    fn beat(&self) -> Beat;

    /// One exchange with the device: tells it the force, waits for its report. World space, mm, N.
    ///
    /// Returns within about [`REPORT_LIFE`] even if the device says nothing; `Ok(None)` means that it said nothing new.
    fn turn(&mut self, told: &Output) -> Result<Option<Report>, Gone>;

    /// Lets the hand go and closes the device.
    fn close(&mut self);
}

/// What a device reports.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Report {
    pub reading: Reading,
    pub state: State,
}

/// The servo's end of a wire.
pub struct Relay {
    spec: Spec,
    beat: Beat,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
    /// Count of the last report that was fetched.
    seen: u64,
    /// The last trusted report, and when it came.
    last: Reading,
    last_at: Option<Instant>,
    opened: Instant,
    news: Receiver<News>,
    to_wake: Sender<Thread>,
    caller: Option<ThreadId>,
    /// As of the last report that was fetched.
    state: State,
    /// As the wire told it last.
    told_state: State,
    gone: Option<Gone>,
}

/// What is rare enough for a box of letters.
#[derive(Clone, Copy, Debug)]
enum News {
    State(State),
    Gone(Gone),
}

/// News that may wait for the servo. States change seldom; a servo that misses some hears of later ones.
const NEWS_MAX: usize = 64;

/// Threads that introduced themselves and are not known to the wire yet.
const CALLERS_MAX: usize = 8;

/// What both threads see.
struct Shared {
    told: Told,
    /// Position, orientation, buttons.
    report: Newest<8>,
    stop: AtomicBool,
}

impl Relay {
    /// Starts the thread of a wire.
    pub fn start(wire: impl Wire) -> Relay {
        let shared = Arc::new(Shared { told: Told::new(), report: Newest::new(), stop: AtomicBool::new(false) });
        let (spec, beat) = (wire.spec().clone(), wire.beat());
        let there = shared.clone();
        let (post, news) = mailbox::ordered(NEWS_MAX);
        let (to_wake, callers) = mailbox::ordered(CALLERS_MAX);
        let work = move || run(wire, &there, post, callers);
        let thread = thread::Builder::new().name(format!("wire {}", spec.name)).spawn(work).ok();
        let no_thread = Gone::Lost { why: "the system gives no thread for the device", code: 0 };
        Relay {
            spec,
            beat,
            shared,
            seen: 0,
            last: Reading::ABSENT,
            last_at: None,
            opened: Instant::now(),
            news,
            to_wake,
            caller: None,
            state: State::Homing { what: "waiting for the device's first report" },
            told_state: State::Ready,
            gone: thread.is_none().then_some(no_thread),
            thread,
        }
    }

    /// Waits for the next report of a device that keeps the beat.
    fn await_report(&self) -> Option<(u64, [u32; 8])> {
        let newer = || self.shared.report.read().filter(|(count, _)| *count > self.seen);
        if self.beat == Beat::Ours {
            return newer();
        }
        let until = Instant::now() + BEAT_WAIT;
        loop {
            if let Some(report) = newer() {
                return Some(report);
            }
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() || self.news.waiting() > 0 {
                return None;
            }
            thread::park_timeout(left);
        }
    }
}

impl Relay {
    /// Tells the wire which thread to wake; a device changes hands when a session goes on with another servo.
    fn introduce(&mut self) {
        let me = thread::current();
        if self.caller != Some(me.id()) {
            self.caller = Some(me.id());
            // Without room nobody is woken, and each beat is found half a beat late.
            let _ = self.to_wake.try_send(me);
        }
    }

    fn read_news(&mut self) {
        while let Some(news) = self.news.try_recv() {
            match news {
                News::State(state) => self.told_state = state,
                News::Gone(gone) => self.gone = Some(gone),
            }
        }
    }
}

impl Device for Relay {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn beat(&self) -> Beat {
        self.beat
    }

    fn state(&self) -> State {
        self.state
    }

    fn exchange(&mut self, output: &Output) -> Result<Reading, Gone> {
        self.introduce();
        self.shared.told.tell(output);
        if let Some(thread) = &self.thread {
            thread.thread().unpark();
        }
        let report = self.await_report();
        self.read_news();
        if let Some(gone) = self.gone {
            return Err(gone);
        }
        if let Some((count, words)) = report {
            self.seen = count;
            self.last = reading_of(words);
            self.last_at = Some(Instant::now());
            self.state = self.told_state;
        }
        let silent = self.last_at.map_or(self.opened.elapsed(), |at| at.elapsed());
        match self.last_at {
            Some(_) if silent < REPORT_LIFE => Ok(self.last),
            _ if silent < GONE_AFTER => {
                if self.last_at.is_some() {
                    self.state = State::ForceOff { why: "the device does not answer; is it plugged in?" };
                }
                Ok(Reading::ABSENT)
            }
            _ if !self.state.is_ready() && self.last_at.is_none() && silent < FIRST_REPORT => Ok(Reading::ABSENT),
            _ => Err(Gone::Lost { why: "it has fallen silent; is it plugged in?", code: 0 }),
        }
    }
}

/// How long a device may take from opening to its first report: controllers boot, services wake up.
const FIRST_REPORT: Duration = Duration::from_secs(5);

impl Drop for Relay {
    fn drop(&mut self) {
        self.shared.stop.store(true, Ordering::Release);
        if let Some(thread) = self.thread.take() {
            // The wire's turns are short; a foreign library that hangs must not take the program with it.
            let until = Instant::now() + GONE_AFTER;
            while !thread.is_finished() && Instant::now() < until {
                thread::sleep(Duration::from_millis(1));
            }
            if thread.is_finished() {
                // A panic of the wire was caught on its thread; there is nothing else to learn.
                let _ = thread.join();
            }
        }
    }
}

/// How long a wire that keeps the beat waits for the servo's answer to its report, so that the force it takes along is not a
/// beat older than it need be. A tick's work takes a tenth of that; a servo that is late costs the wire no beat.
const ANSWER_WAIT: Duration = Duration::from_micros(400);

impl Shared {
    /// Waits until the servo has told another force than the one of this count.
    fn await_answer(&self, told: u64) {
        let until = Instant::now() + ANSWER_WAIT;
        while self.told.count() == told {
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return;
            }
            thread::park_timeout(left);
        }
    }
}

/// The wire's thread. A panic in a driver lets the hand go like any other failure.
fn run(mut wire: impl Wire, shared: &Shared, mut post: Sender<News>, mut callers: Receiver<Thread>) {
    // What was granted shows in how late the beats come; the servo asks for itself.
    let _ = realtime::raise();
    let mut caller: Option<Thread> = None;
    let mut wake = move || {
        caller = std::iter::from_fn(|| callers.try_recv()).last().or(caller.take());
        if let Some(caller) = &caller {
            caller.unpark();
        }
        caller.is_some()
    };
    let beat = wire.beat();
    let turning = AssertUnwindSafe(|| {
        let mut state = State::Ready;
        while !shared.stop.load(Ordering::Acquire) {
            match wire.turn(&shared.told.output()) {
                Ok(Some(report)) => {
                    // A state that finds no room is told again with the next report.
                    if report.state != state && post.try_send(News::State(report.state)).is_ok() {
                        state = report.state;
                    }
                    let told = shared.told.count();
                    shared.report.write(words_of_reading(&report.reading));
                    if wake() && beat == Beat::Device {
                        shared.await_answer(told);
                    }
                }
                Ok(None) => {}
                Err(gone) => return Some(gone),
            }
        }
        None
    });
    let gone =
        catch_unwind(turning).unwrap_or(Some(Gone::Lost { why: "its driver failed; please report this", code: 0 }));
    // A driver that failed once may fail again while it closes.
    let _ = catch_unwind(AssertUnwindSafe(|| wire.close()));
    if let Some(gone) = gone {
        let _ = post.try_send(News::Gone(gone));
        wake();
    }
}

fn words_of_reading(reading: &Reading) -> [u32; 8] {
    let Pose { position: p, orientation: q } = reading.pose;
    let [a, b, c, d, e, f, g] = [p.x, p.y, p.z, q.x, q.y, q.z, q.w].map(f32::to_bits);
    [a, b, c, d, e, f, g, reading.buttons]
}

fn reading_of(words: [u32; 8]) -> Reading {
    let [a, b, c, d, e, f, g, _] = words.map(f32::from_bits);
    let pose = Pose { position: Vec3::new(a, b, c), orientation: Quat::from_xyzw(d, e, f, g) };
    Reading { pose, buttons: words[7] }
}
