//! The relay between a device's thread and the servo: the driver of every real device stands behind one.
//!
//! Takes a [`Protocol`], which runs on a thread of its own where it may block, allocate and call foreign libraries.
//! Gives a [`Device`] that exchanges forces and reports with that thread through two slots in which the newest value
//! wins. Never lets the servo wait for longer than one and a half ticks, and never lets the thread send a force older
//! than [`FORCE_LIFE`](crate::FORCE_LIFE), so a servo that is late releases the hand.

use crate::force_slot::ForceSlot;
use crate::protocol::{DeviceReport, LastReport, Protocol, SILENCE_TIMEOUT};
use crate::realtime;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle, Thread, ThreadId};
use std::time::{Duration, Instant};
use typodont_core::device::{Device, DeviceError, DeviceSpec, DeviceState, Pacing, Reading, Wrench};
use typodont_core::frame::{Pose, Quat, Vec3};
use typodont_core::mailbox;
use typodont_core::mailbox::{Receiver, Sender, SeqLock};

/// Time for which the servo waits for the next report of a device that sets the pace: one and a half ticks, so that a
/// late report costs one missed tick and not two.
const REPORT_TIMEOUT: Duration = Duration::from_micros(1500);

/// The servo's end of a relay.
pub struct Relay {
    spec: DeviceSpec,
    pacing: Pacing,
    shared: Arc<RelaySlots>,
    thread: Option<JoinHandle<()>>,
    /// Count of the last report that was read.
    last_count: u64,
    last: LastReport,
    events: Receiver<RelayEvent>,
    caller_sender: Sender<Thread>,
    caller: Option<ThreadId>,
    /// State that the device thread announced last.
    protocol_state: DeviceState,
    failure: Option<DeviceError>,
}

/// Rare messages from the device thread to the servo.
#[derive(Clone, Copy, Debug)]
enum RelayEvent {
    State(DeviceState),
    Gone(DeviceError),
}

/// Events that may wait for the servo. States change rarely; a servo that misses some receives later ones.
const EVENT_CAPACITY: usize = 64;

/// Calling threads that may be announced before the device thread learns of them.
const CALLER_CAPACITY: usize = 8;

/// Data that both threads access.
struct RelaySlots {
    force: ForceSlot,
    /// Position, orientation, buttons.
    report: SeqLock<8>,
    stop: AtomicBool,
}

impl Relay {
    /// Starts a thread that runs `protocol`.
    pub fn start(protocol: impl Protocol) -> Relay {
        let shared =
            Arc::new(RelaySlots { force: ForceSlot::new(), report: SeqLock::new(), stop: AtomicBool::new(false) });
        let (spec, pacing) = (protocol.spec().clone(), protocol.pacing());
        let there = shared.clone();
        let (event_sender, events) = mailbox::channel(EVENT_CAPACITY);
        let (caller_sender, callers) = mailbox::channel(CALLER_CAPACITY);
        let work = move || run_protocol(protocol, &there, event_sender, callers);
        let thread = thread::Builder::new().name(format!("device {}", spec.name)).spawn(work).ok();
        let no_thread = DeviceError::Lost { why: "cannot start a thread for the device", code: 0 };
        Relay {
            spec,
            pacing,
            shared,
            last_count: 0,
            last: LastReport::awaited(),
            events,
            caller_sender,
            caller: None,
            protocol_state: DeviceState::Ready,
            failure: thread.is_none().then_some(no_thread),
            thread,
        }
    }

    /// Returns the next report; waits for it if the device sets the pace.
    fn await_report(&self) -> Option<(u64, [u32; 8])> {
        let newer = || self.shared.report.read().filter(|(count, _)| *count > self.last_count);
        if self.pacing == Pacing::Host {
            return newer();
        }
        let until = Instant::now() + REPORT_TIMEOUT;
        loop {
            if let Some(report) = newer() {
                return Some(report);
            }
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() || self.events.pending() > 0 {
                return None;
            }
            thread::park_timeout(left);
        }
    }
}

impl Relay {
    /// Tells the device thread which thread to wake; the caller changes when a session continues with another servo.
    fn register_caller(&mut self) {
        let me = thread::current();
        if self.caller != Some(me.id()) {
            self.caller = Some(me.id());
            // If the channel is full, the caller is not woken and finds each report half a tick late.
            let _ = self.caller_sender.try_send(me);
        }
    }

    fn read_events(&mut self) {
        while let Some(event) = self.events.try_recv() {
            match event {
                RelayEvent::State(state) => self.protocol_state = state,
                RelayEvent::Gone(gone) => self.failure = Some(gone),
            }
        }
    }
}

impl Device for Relay {
    fn spec(&self) -> &DeviceSpec {
        &self.spec
    }

    fn pacing(&self) -> Pacing {
        self.pacing
    }

    fn state(&self) -> DeviceState {
        self.last.state()
    }

    fn exchange(&mut self, output: &Wrench) -> Result<Reading, DeviceError> {
        self.register_caller();
        self.shared.force.write(output);
        if let Some(thread) = &self.thread {
            thread.thread().unpark();
        }
        let report = self.await_report();
        self.read_events();
        if let Some(gone) = self.failure {
            return Err(gone);
        }
        if let Some((count, words)) = report {
            self.last_count = count;
            self.last.receive(DeviceReport { reading: decode_reading(words), state: self.protocol_state });
        }
        self.last.reading()
    }
}

impl Drop for Relay {
    fn drop(&mut self) {
        self.shared.stop.store(true, Ordering::Release);
        if let Some(thread) = self.thread.take() {
            // Exchanges are short; a foreign library that hangs must not block the program's exit.
            let until = Instant::now() + SILENCE_TIMEOUT;
            while !thread.is_finished() && Instant::now() < until {
                thread::sleep(Duration::from_millis(1));
            }
            if thread.is_finished() {
                // A panic of the protocol was caught on its thread; the result holds nothing else.
                let _ = thread.join();
            }
        }
    }
}

/// Time for which the thread of a device that sets the pace waits for the servo's answer to its report, so that the
/// force it sends is not a tick older than necessary. The work of a tick takes a tenth of that; a late servo costs the
/// device no tick.
const ANSWER_TIMEOUT: Duration = Duration::from_micros(400);

impl RelaySlots {
    /// Waits until the servo has written a newer force than that of `last_count`.
    fn await_answer(&self, last_count: u64) {
        let until = Instant::now() + ANSWER_TIMEOUT;
        while self.force.write_count() == last_count {
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return;
            }
            thread::park_timeout(left);
        }
    }
}

/// Runs a protocol on the device thread. A panic in a driver releases the hand like any other failure.
fn run_protocol(
    mut protocol: impl Protocol,
    shared: &RelaySlots,
    mut events: Sender<RelayEvent>,
    mut callers: Receiver<Thread>,
) {
    // A refusal shows in the timing statistics; the servo requests priority for its own thread.
    let _ = realtime::raise_thread_priority();
    let mut caller: Option<Thread> = None;
    let mut wake = move || {
        caller = std::iter::from_fn(|| callers.try_recv()).last().or(caller.take());
        if let Some(caller) = &caller {
            caller.unpark();
        }
        caller.is_some()
    };
    let pacing = protocol.pacing();
    let exchanging = AssertUnwindSafe(|| {
        let mut state = DeviceState::Ready;
        while !shared.stop.load(Ordering::Acquire) {
            match protocol.exchange(&shared.force.latest()) {
                Ok(Some(report)) => {
                    // If the channel is full, the state is sent again with the next report.
                    if report.state != state && events.try_send(RelayEvent::State(report.state)).is_ok() {
                        state = report.state;
                    }
                    let write_count = shared.force.write_count();
                    shared.report.write(encode_reading(&report.reading));
                    if wake() && pacing == Pacing::Device {
                        shared.await_answer(write_count);
                    }
                }
                Ok(None) => {}
                Err(gone) => return Some(gone),
            }
        }
        None
    });
    let gone = catch_unwind(exchanging)
        .unwrap_or(Some(DeviceError::Lost { why: "its driver crashed; please report this", code: 0 }));
    // A driver that panicked once may panic again while it closes.
    let _ = catch_unwind(AssertUnwindSafe(|| protocol.close()));
    if let Some(gone) = gone {
        let _ = events.try_send(RelayEvent::Gone(gone));
        wake();
    }
}

fn encode_reading(reading: &Reading) -> [u32; 8] {
    let Pose { position: p, orientation: q } = reading.pose;
    let [a, b, c, d, e, f, g] = [p.x, p.y, p.z, q.x, q.y, q.z, q.w].map(f32::to_bits);
    [a, b, c, d, e, f, g, reading.buttons]
}

fn decode_reading(words: [u32; 8]) -> Reading {
    let [a, b, c, d, e, f, g, _] = words.map(f32::from_bits);
    let pose = Pose { position: Vec3::new(a, b, c), orientation: Quat::from_xyzw(d, e, f, g) };
    Reading { pose, buttons: words[7] }
}
