//! The servo: a thread that calls [`Simulation::step`] at 1 kHz with a haptic device.
//!
//! Takes a simulation, an open device and commands. Gives events: every tick with its edits, and every command with
//! the tick before which it was carried out. While running it never allocates, locks, logs or waits for anything but
//! the next tick. It reads a monotonic clock to keep the rate; the result of a tick depends only on readings and
//! commands. Where nobody feels the force of a device, a mouse for example, the thread wakes every few milliseconds and
//! runs the ticks that are due one after the other.
//!
//! Every failure releases the hand: after a late tick of a device that renders force, with a device that is not ready or
//! lost, and with an invalid reading, the simulation is stepped with [`Reading::ABSENT`], which gives zero force; forces
//! fade in again over half a second.

mod batched;
mod second_hand;
mod assistant_tip;
mod timing;
mod tick_timer;

use second_hand::AssistantDisplay;
pub use second_hand::{AssistantTool, SecondHandEvent, SecondHandLink, SecondHandRole, SecondHandServo};
pub use timing::{DurationHistogram, TimingStats, TimingSummary};

use crate::realtime;
use crate::realtime::Priority;
use batched::{BatchedServo, may_batch};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use tick_timer::TickTimer;
use typodont_core::device::{Device, DeviceError, DeviceState, Pacing, Reading, Wrench};
use typodont_core::frame::Vec3;
use typodont_core::mailbox;
use typodont_core::mailbox::{Receiver, Sender, SeqLock};
use typodont_core::sim::{Command, Simulation, Step};
use typodont_core::tick::Tick;
use typodont_core::touch::Gate;
use typodont_core::volume::Edit;
use web_time::{Duration, Instant};

/// Commands to the servo, carried out in order before the next tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ServoCommand {
    Command(Command),
    /// Pauses the simulation and releases the hand.
    Pause,
    Resume,
    /// Pauses the simulation, after its first tick at the earliest, until the device moves or one of its buttons
    /// changes, or until [`ServoCommand::StopAwaiting`].
    AwaitMovement,
    StopAwaiting,
}

/// Events of the servo, in the order in which they happened.
#[derive(Clone, Copy, Debug)]
pub enum ServoEvent {
    /// The thread has started, with this priority.
    Started(Priority),
    /// A command was carried out before this tick.
    Commanded(Tick, Command),
    /// A tick was simulated; its edits are in the other channel.
    Ticked(TickReport),
    /// The state of the device has changed. The simulation is paused unless the device is ready.
    DeviceState(DeviceState),
    /// The simulation waits for the first movement of the device, or (false) waits no longer.
    AwaitingMovement(bool),
}

/// Result of one tick.
#[derive(Clone, Copy, Debug)]
pub struct TickReport {
    pub reading: Reading,
    pub step: Step,
    /// Number of edits to take for this tick.
    pub edits: usize,
    /// Faults counted by the gates so far.
    pub gate: Gate,
}

/// A running servo, as seen from the session's thread.
pub struct Servo {
    commands: Sender<ServoCommand>,
    events: Receiver<ServoEvent>,
    edits: Receiver<Edit>,
    timing: Arc<SeqLock<9>>,
    assistant: Option<AssistantDisplay>,
    runner: ServoRunner,
}

/// Runner of a servo's ticks.
enum ServoRunner {
    Thread {
        stop: Arc<AtomicBool>,
        thread: JoinHandle<ServoExit>,
    },
    /// On the session's own thread, when it polls.
    Inline(Box<BatchedServo>),
    Stopped,
}

/// Everything that a servo returns when it ends.
pub struct ServoExit {
    pub simulation: Simulation,
    pub device: Box<dyn Device + Send>,
    pub second: Option<SecondHandLink>,
    pub timing: TimingStats,
    pub priority: Priority,
    /// Error with which the device ended, if it did.
    pub device_error: Option<DeviceError>,
}

/// Capacity for events: the session's thread may stall for 16 s, for example while a disk wakes up.
const EVENT_CAPACITY: usize = 1 << 14;

/// Capacity for edits. A bur in soft decay changes about 60 voxels per tick at 0.1 mm, and 3 000 at 0.02 mm.
const EDIT_CAPACITY: usize = 1 << 20;

/// Capacity for commands.
const COMMAND_CAPACITY: usize = 256;

/// Lateness of a tick above which the hand is released: about the time in which a person's grip notices a frozen
/// force, and equal to the time for which [`crate::FORCE_LIFE`] lets a force be rendered.
const RELEASE_AFTER: Duration = Duration::from_millis(10);

/// Movement of the device with which a waiting simulation goes on, mm: more than a hand trembles, less than a deliberate
/// movement.
const FIRST_MOVEMENT: f32 = 3.0;

/// The same for a pointer, which only a deliberate movement moves, mm.
const FIRST_POINTED: f32 = 0.1;

/// Ticks between two updates of the timing summary.
const SUMMARY_TICKS: u64 = 500;

impl Servo {
    /// Starts stepping a simulation with a device.
    ///
    /// `second` is another hand in the world of this one. `timing` contains the statistics of the same session so
    /// far: after its device was reconnected, a session continues with another servo.
    ///
    /// # Errors
    ///
    /// Returns an error if the thread cannot be started.
    pub fn start(
        simulation: Simulation,
        device: Box<dyn Device + Send>,
        second: Option<SecondHandLink>,
        timing: TimingStats,
    ) -> Result<Servo, String> {
        if cfg!(target_family = "wasm") {
            // A page has no threads.
            return Ok(Servo::start_inline(simulation, device, second, timing));
        }
        let (servo_loop, mut servo) = ServoLoop::new(simulation, device, second, timing);
        let stop = Arc::new(AtomicBool::new(false));
        let should_stop = stop.clone();
        let thread = thread::Builder::new().name("servo".into()).spawn(move || servo_loop.run(&should_stop));
        let thread = thread.map_err(|e| format!("cannot start a thread for the servo: {e}"))?;
        servo.runner = ServoRunner::Thread { stop, thread };
        Ok(servo)
    }

    /// Starts a servo without a thread: [`Servo::advance`] runs the ticks that have become due. It must be called every few
    /// milliseconds for a device whose force is felt.
    pub fn start_inline(
        simulation: Simulation,
        device: Box<dyn Device + Send>,
        second: Option<SecondHandLink>,
        timing: TimingStats,
    ) -> Servo {
        let (servo_loop, mut servo) = ServoLoop::new(simulation, device, second, timing);
        servo.runner = ServoRunner::Inline(Box::new(BatchedServo::new(servo_loop, Priority::Ordinary)));
        servo
    }

    /// Runs the ticks that have become due, if this servo has no thread.
    pub fn advance(&mut self) {
        if let ServoRunner::Inline(servo) = &mut self.runner {
            servo.advance();
        }
    }

    /// Sends a command; returns false if the channel is full or the servo has ended.
    pub fn send(&mut self, command: ServoCommand) -> bool {
        !self.commands.is_abandoned() && self.commands.try_send(command).is_ok()
    }

    /// Returns the next event, if there is one.
    pub fn next_event(&mut self) -> Option<ServoEvent> {
        self.events.try_recv()
    }

    /// Appends the edits of a tick, in order. Call this exactly once for each [`ServoEvent::Ticked`].
    pub fn take_edits(&mut self, report: &TickReport, into: &mut Vec<Edit>) {
        into.extend((0..report.edits).filter_map(|_| self.edits.try_recv()));
    }

    /// Returns the timing summary, at most half a second old.
    pub fn timing(&self) -> Option<TimingSummary> {
        self.timing.read().map(|(_, words)| TimingSummary::decode(words))
    }

    /// Returns the tool of an assistant's hand; `None` without one.
    pub fn assistant(&self) -> Option<AssistantTool> {
        self.assistant.as_ref().and_then(AssistantDisplay::tool)
    }

    /// Returns whether the thread has ended by itself because the device is lost.
    pub fn has_ended(&self) -> bool {
        match &self.runner {
            ServoRunner::Thread { thread, .. } => thread.is_finished(),
            ServoRunner::Inline(servo) => servo.has_ended(),
            ServoRunner::Stopped => true,
        }
    }

    /// Stops the servo and waits for its thread. Events that have not been received are lost: receive them first.
    ///
    /// # Errors
    ///
    /// Returns an error if the thread panicked; the hand was released then.
    pub fn stop(mut self) -> Result<ServoExit, String> {
        let exit = match std::mem::replace(&mut self.runner, ServoRunner::Stopped) {
            ServoRunner::Thread { stop, thread } => {
                stop.store(true, Ordering::Release);
                thread.join().ok()
            }
            ServoRunner::Inline(servo) => Some(servo.stop()),
            ServoRunner::Stopped => None,
        };
        exit.ok_or_else(|| "the servo crashed and switched the forces off; please report this".to_string())
    }
}

/// Dropping a servo stops it and releases the hand.
impl Drop for Servo {
    fn drop(&mut self) {
        if let ServoRunner::Thread { stop, thread } = std::mem::replace(&mut self.runner, ServoRunner::Stopped) {
            stop.store(true, Ordering::Release);
            // The thread checks the flag every few milliseconds; the device is closed together with the thread's result.
            let _ = thread.join();
        }
    }
}

/// Sending side of the servo's events.
struct EventSink {
    events: Sender<ServoEvent>,
    edits: Sender<Edit>,
    timing: TimingStats,
    summary: Arc<SeqLock<9>>,
}

impl EventSink {
    fn send(&mut self, event: ServoEvent) {
        if self.events.try_send(event).is_err() {
            self.timing.dropped_events += 1;
        }
    }

    /// Sends a tick with all its edits, or drops it as a whole.
    fn send_tick(&mut self, reading: Reading, step: Step, simulation: &Simulation) {
        let edits = simulation.edits();
        if self.edits.free_slots() < edits.len() || self.events.free_slots() == 0 {
            self.timing.dropped_events += 1;
            return;
        }
        for edit in edits {
            // There is room: no other thread sends to this channel.
            let _ = self.edits.try_send(*edit);
        }
        self.send(ServoEvent::Ticked(TickReport { reading, step, edits: edits.len(), gate: *simulation.gate() }));
        if step.tick.0.is_multiple_of(SUMMARY_TICKS) {
            self.summary.write(self.timing.summary().encode());
        }
    }
}

/// Position and buttons of a device that has not moved yet; `None` before its first valid reading.
#[derive(Clone, Copy, Debug, Default)]
struct FirstReading(Option<(Vec3, u32)>);

impl FirstReading {
    /// Returns true if a reading differs from the first one by a button, or by a movement of at least `least` mm.
    fn is_left_by(&mut self, reading: &Reading, least: f32) -> bool {
        if !reading.pose.is_valid() {
            return false;
        }
        let (position, buttons) = *self.0.get_or_insert((reading.pose.position, reading.buttons));
        buttons != reading.buttons || position.distance(reading.pose.position) > least
    }
}

/// State of a servo on its thread.
struct ServoLoop {
    simulation: Simulation,
    device: Box<dyn Device + Send>,
    second: Option<SecondHandLink>,
    commands: Receiver<ServoCommand>,
    sink: EventSink,
    /// Force and torque for the next exchange.
    output: Wrench,
    /// State of the device, once it has been reported.
    state: Option<DeviceState>,
    is_paused: bool,
    /// First reading since the simulation waits for a movement; `None` if it does not wait.
    awaited: Option<FirstReading>,
    /// True if the last tick was stepped with a reading of the device.
    is_hand_trusted: bool,
}

impl ServoLoop {
    /// Creates a servo that does not run yet, and the session's ends of its channels.
    fn new(
        simulation: Simulation,
        device: Box<dyn Device + Send>,
        mut second: Option<SecondHandLink>,
        timing: TimingStats,
    ) -> (ServoLoop, Servo) {
        if let Some(second) = &mut second {
            second.enter_world(&simulation);
        }
        let assistant = second.as_ref().and_then(SecondHandLink::display);
        let (commands, inbox) = mailbox::channel(COMMAND_CAPACITY);
        let (event_sender, events) = mailbox::channel(EVENT_CAPACITY);
        let (edit_sender, edits) = mailbox::channel(EDIT_CAPACITY);
        let summary = Arc::new(SeqLock::new());
        let sink = EventSink { events: event_sender, edits: edit_sender, timing, summary: summary.clone() };
        let servo = ServoLoop {
            simulation,
            device,
            second,
            commands: inbox,
            sink,
            output: Wrench::ZERO,
            state: None,
            is_paused: false,
            awaited: None,
            is_hand_trusted: false,
        };
        (servo, Servo { commands, events, edits, timing: summary, assistant, runner: ServoRunner::Stopped })
    }

    /// Runs the servo until it is stopped or its device fails.
    fn run(mut self, should_stop: &AtomicBool) -> ServoExit {
        let priority = realtime::raise_thread_priority();
        // Who holds a second hand feels how this one leads it.
        if self.second.is_none() && may_batch(&*self.device) {
            return BatchedServo::new(self, priority).run(should_stop);
        }
        self.sink.send(ServoEvent::Started(priority));
        let device_error = self.run_ticks(TickTimer::new(&*self.device, priority), should_stop);
        self.exit(priority, device_error)
    }

    /// Releases the hand and returns everything that the next servo takes over.
    fn exit(mut self, priority: Priority, device_error: Option<DeviceError>) -> ServoExit {
        if device_error.is_none() {
            // Even if this last exchange fails, the relay sends no force older than ten ticks.
            let _ = self.device.exchange(&Wrench::ZERO);
        }
        self.sink.summary.write(self.sink.timing.summary().encode());
        let ServoLoop { simulation, device, second, sink, .. } = self;
        ServoExit { simulation, device, second, timing: sink.timing, priority, device_error }
    }

    /// Runs ticks until the servo is stopped or its device fails; returns the error of the device.
    fn run_ticks(&mut self, mut timer: TickTimer, should_stop: &AtomicBool) -> Option<DeviceError> {
        loop {
            timer.wait();
            let exchanged = self.device.exchange(&self.output);
            if should_stop.load(Ordering::Acquire) {
                return None;
            }
            let late = timer.tick_due(&mut self.sink.timing);
            if late.is_none() && exchanged.is_ok() {
                continue;
            }
            if let Err(gone) = self.process(exchanged, late.unwrap_or_default()) {
                return Some(gone);
            }
        }
    }

    /// Carries out commands, then runs a tick with what the device gave, if the simulation is to go on. Returns the error
    /// of a device that has ended.
    fn process(&mut self, exchanged: Result<Reading, DeviceError>, late: Duration) -> Result<(), DeviceError> {
        self.drain_commands();
        let is_ready = self.report_state().is_ready();
        match exchanged {
            Ok(reading) if is_ready && !self.is_paused && !self.is_awaiting(&reading) => self.run_tick(reading, late),
            Ok(_) => self.release_if_held(),
            Err(gone) => {
                self.release_if_held();
                return Err(gone);
            }
        }
        Ok(())
    }

    /// Carries out the commands received since the last tick.
    fn drain_commands(&mut self) {
        // A command without its event would invalidate the recording: it waits until there is room for the event.
        while self.sink.events.free_slots() > 1
            && let Some(command) = self.commands.try_recv()
        {
            match command {
                ServoCommand::Command(command) => {
                    self.simulation.apply(&command);
                    self.sink.send(ServoEvent::Commanded(self.simulation.tick(), command));
                }
                ServoCommand::Pause => self.is_paused = true,
                ServoCommand::Resume => self.is_paused = false,
                ServoCommand::AwaitMovement => {
                    self.awaited = Some(FirstReading::default());
                    self.sink.send(ServoEvent::AwaitingMovement(true));
                }
                ServoCommand::StopAwaiting => self.stop_awaiting(),
            }
        }
    }

    /// Returns true while the simulation waits for the first movement of the device. The first tick is always run, so
    /// that the instrument is seen where it is.
    fn is_awaiting(&mut self, reading: &Reading) -> bool {
        let Some(first) = &mut self.awaited else { return false };
        if self.simulation.tick() == Tick::ZERO {
            return false;
        }
        // Trackers tremble, and so does an arm whose force a page leaves out.
        let is_arm = self.device.renders_force() || self.device.spec().page_force.is_some();
        let is_pointer = self.device.pacing() == Pacing::Host && !is_arm;
        let least = if is_pointer { FIRST_POINTED } else { FIRST_MOVEMENT };
        let is_led = self.second.as_mut().is_some_and(|second| second.await_lead(reading));
        if !is_led && !first.is_left_by(reading, least) {
            return true;
        }
        self.stop_awaiting();
        false
    }

    fn stop_awaiting(&mut self) {
        if self.awaited.take().is_some() {
            self.sink.send(ServoEvent::AwaitingMovement(false));
        }
    }

    /// Returns the state of the device, and reports it if it has changed.
    fn report_state(&mut self) -> DeviceState {
        let now = self.device.state();
        if self.state != Some(now) {
            self.state = Some(now);
            self.sink.send(ServoEvent::DeviceState(now));
        }
        now
    }

    /// Steps the simulation with a reading that came this late; a reading that is too late releases the hand.
    fn run_tick(&mut self, reading: Reading, late: Duration) {
        let is_late = self.is_hand_trusted && late > RELEASE_AFTER;
        self.sink.timing.late_releases += u64::from(is_late);
        let reading = if is_late { Reading::ABSENT } else { reading };
        self.is_hand_trusted = true;
        if let Some(second) = &mut self.second {
            let lead = second.step(&reading, &self.simulation);
            self.simulation.set_coupling_force(lead);
        }
        let begun = Instant::now();
        let step = self.simulation.step(&reading);
        self.sink.timing.work.add(begun.elapsed());
        self.output = step.wrench();
        if let Some(second) = self.second.as_mut().filter(|_| self.simulation.is_released()) {
            second.reset_coupling();
        }
        self.sink.send_tick(reading, step, &self.simulation);
    }

    /// Runs the single tick in which a held hand is released; the simulation is paused after it.
    fn release_if_held(&mut self) {
        self.output = Wrench::ZERO;
        if !std::mem::take(&mut self.is_hand_trusted) {
            return;
        }
        let step = self.simulation.step(&Reading::ABSENT);
        self.sink.send_tick(Reading::ABSENT, step, &self.simulation);
        if let Some(second) = &mut self.second {
            second.reset_coupling();
        }
    }
}
