//! A second hand: that of an instructor, which follows the first one, feels the same, and leads it on demand; or that
//! of an assistant, which holds the suction or irrigates.
//!
//! Takes the devices or links of both hands. Gives the force on each. [`SecondHandLink`] is the first hand's end,
//! stepped by that hand's servo. [`SecondHandServo`] is the second hand's own servo, here or on another machine: it
//! never has a simulation, only the coupling of the two hands.

use crate::servo::assistant_tip::{AssistantTip, NOZZLE_RADIUS, SUCTION_RADIUS};
use crate::servo::tick_timer::TickTimer;
use crate::servo::timing::{TimingStats, TimingSummary};
use crate::{Coupling, CouplingParams, HandLink, LinkedHand, realtime};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use typodont_core::device::{Device, DeviceError, DeviceState, Reading, Wrench};
use typodont_core::frame::Vec3;
use typodont_core::mailbox;
use typodont_core::mailbox::{Receiver, Sender, SeqLock};
use typodont_core::sim::Simulation;

/// Bit mask of the button that leads while it is held.
const LEAD_BUTTON: u32 = 1;

/// Role of a second hand.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SecondHandRole {
    /// Follows the first hand, and leads it while button 0 is held.
    #[default]
    Instructor,
    /// Moves freely with a suction tip, and feels the tooth with it.
    Suction,
    /// The same with a syringe, which sprays water while button 0 is held.
    Irrigation,
}

impl SecondHandRole {
    /// Radius of the tool's rounded end, mm; `None` for an instructor, who has none.
    fn tool_radius(self) -> Option<f32> {
        match self {
            SecondHandRole::Instructor => None,
            SecondHandRole::Suction => Some(SUCTION_RADIUS),
            SecondHandRole::Irrigation => Some(NOZZLE_RADIUS),
        }
    }
}

/// Tool of an assistant, as the first hand's picture shows it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AssistantTool {
    pub role: SecondHandRole,
    /// Middle of its rounded end, world space, mm.
    pub tip: Vec3,
    /// True while button 0 is held.
    pub is_pressed: bool,
}

/// Place at which the servo leaves an assistant's tool for the picture.
#[derive(Clone, Debug)]
pub(super) struct AssistantDisplay {
    role: SecondHandRole,
    /// Position of the tip, and whether the button is held; not a number while there is no hand.
    words: Arc<SeqLock<4>>,
}

impl AssistantDisplay {
    /// Returns the tool; `None` while its hand is absent.
    pub fn tool(&self) -> Option<AssistantTool> {
        let (_, [x, y, z, is_pressed]) = self.words.read()?;
        let tip = Vec3::from_array([x, y, z].map(f32::from_bits));
        tip.is_finite().then_some(AssistantTool { role: self.role, tip, is_pressed: is_pressed != 0 })
    }

    fn show(&self, tip: Vec3, is_pressed: bool) {
        let [x, y, z] = tip.to_array().map(f32::to_bits);
        self.words.write([x, y, z, u32::from(is_pressed)]);
    }
}

/// The first hand's end of the link to a second one.
pub struct SecondHandLink {
    link: HandLink,
    coupling: Coupling,
    role: SecondHandRole,
    /// The tool in the first hand's simulation, once the second hand has entered it.
    tool: Option<AssistantTip>,
    /// `None` for an instructor.
    display: Option<AssistantDisplay>,
}

impl SecondHandLink {
    /// Creates a link. `max_damping` is the limit of the first hand's device, N·s/mm.
    pub fn new(link: HandLink, max_damping: f32, role: SecondHandRole) -> SecondHandLink {
        SecondHandLink {
            link,
            coupling: Coupling::new(CouplingParams::for_damping(max_damping)),
            role,
            tool: None,
            display: role.tool_radius().map(|_| AssistantDisplay { role, words: Arc::new(SeqLock::new()) }),
        }
    }

    /// Enters a simulation, before its first tick.
    pub(super) fn enter_world(&mut self, world: &Simulation) {
        self.tool = self.role.tool_radius().map(|radius| AssistantTip::new(world.scene(), radius));
    }

    /// The place at which this hand's tool is left for the picture; `None` for an instructor.
    pub(super) fn display(&self) -> Option<AssistantDisplay> {
        self.display.clone()
    }

    /// Steps the second hand, before the first one; returns its force on the first hand, N, world space.
    pub(super) fn step(&mut self, reading: &Reading, world: &Simulation) -> Vec3 {
        let (Some(tool), Some(display)) = (&mut self.tool, &self.display) else {
            return self.leading_force(reading);
        };
        match self.link.latest().filter(|(_, delay)| *delay < SILENCE_TIMEOUT_S) {
            Some((hand, _)) if hand.position.is_finite() => {
                let (matter, materials) = (world.scene(), world.materials());
                let tip = tool.follow(matter, materials, world.world_from_tooth(), hand.position);
                // The coupling that pulls an instructor's hand to the trainee's pulls an assistant's hand to its own
                // tip.
                self.link.publish(&LinkedHand { position: tip, is_leading: false, ..hand });
                display.show(tip, hand.buttons & LEAD_BUTTON != 0);
            }
            _ => {
                tool.reset();
                display.show(Vec3::NAN, false);
            }
        }
        Vec3::ZERO
    }

    /// Publishes the first hand's position; returns the leading force of the second one, N, world space.
    fn leading_force(&mut self, reading: &Reading) -> Vec3 {
        if !reading.pose.is_valid() {
            self.coupling.reset();
            return Vec3::ZERO;
        }
        let (position, orientation) = (reading.pose.position, reading.pose.orientation);
        self.link.publish(&LinkedHand { position, orientation, buttons: reading.buttons, is_leading: false });
        self.coupling.force(position, self.link.remote_position(|hand| hand.is_leading))
    }

    /// Publishes the position of a first hand that waits for its first movement. Returns true if an instructor's hand asks to
    /// lead it.
    pub(super) fn await_lead(&mut self, reading: &Reading) -> bool {
        if self.tool.is_some() || !reading.pose.is_valid() {
            return false;
        }
        let (position, orientation) = (reading.pose.position, reading.pose.orientation);
        self.link.publish(&LinkedHand { position, orientation, buttons: reading.buttons, is_leading: false });
        self.link.remote_position(|hand| hand.is_leading).is_some_and(|remote| remote.delay < SILENCE_TIMEOUT_S)
    }

    /// Fades the coupling in again after the first hand was released.
    pub(super) fn reset_coupling(&mut self) {
        // The tip of the second hand keeps its position: that hand was not lost.
        self.coupling.reset();
    }

    /// Returns the number of rejected datagrams.
    pub fn rejected_count(&self) -> u64 {
        self.link.rejected_count()
    }
}

/// Servo of the second hand.
pub struct SecondHandServo {
    stop: Arc<AtomicBool>,
    timing: Arc<SeqLock<9>>,
    events: Receiver<SecondHandEvent>,
    thread: Option<JoinHandle<()>>,
}

/// Events of the second hand's servo.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SecondHandEvent {
    Device(DeviceState),
    Gone(DeviceError),
    /// The first hand has become present, or has fallen silent.
    FirstHand {
        is_present: bool,
    },
    /// The second hand has started or stopped leading.
    Leading(bool),
}

/// Capacity for events.
const EVENT_CAPACITY: usize = 64;

/// Ticks between two updates of the timing summary.
const SUMMARY_TICKS: u64 = 500;

impl SecondHandServo {
    /// Starts the second hand's servo: it follows the first hand, and leads it while button 0 is held.
    ///
    /// # Errors
    ///
    /// Returns an error if the thread cannot be started.
    pub fn start(device: Box<dyn Device + Send>, link: HandLink) -> Result<SecondHandServo, String> {
        let (event_sender, events) = mailbox::channel(EVENT_CAPACITY);
        let (stop, timing) = (Arc::new(AtomicBool::new(false)), Arc::new(SeqLock::new()));
        let (should_stop, summary) = (stop.clone(), timing.clone());
        let servo = SecondHandLoop {
            coupling: Coupling::new(CouplingParams::for_damping(device.spec().max_damping)),
            max_force: device.spec().max_force,
            device,
            link,
            events: event_sender,
            output: Wrench::ZERO,
            state: None,
            was_present: false,
            was_leading: false,
        };
        let work = move || servo.run(&summary, &should_stop);
        let thread = thread::Builder::new().name("second hand".into()).spawn(work);
        let thread = thread.map_err(|e| format!("cannot start a thread for the second device: {e}"))?;
        Ok(SecondHandServo { stop, timing, events, thread: Some(thread) })
    }

    /// Returns the next event, if there is one.
    pub fn next_event(&mut self) -> Option<SecondHandEvent> {
        self.events.try_recv()
    }

    /// Returns the timing summary, at most half a second old.
    pub fn timing(&self) -> Option<TimingSummary> {
        self.timing.read().map(|(_, words)| TimingSummary::decode(words))
    }

    /// Returns whether the thread has ended because the device is lost.
    pub fn has_ended(&self) -> bool {
        self.thread.as_ref().is_none_or(JoinHandle::is_finished)
    }
}

impl Drop for SecondHandServo {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Release);
        if let Some(thread) = self.thread.take() {
            // The thread checks the flag every tick. If it panicked, the device has released the hand.
            let _ = thread.join();
        }
    }
}

/// State of the second hand's servo on its thread.
struct SecondHandLoop {
    device: Box<dyn Device + Send>,
    link: HandLink,
    coupling: Coupling,
    /// Greatest force of the device, N.
    max_force: f32,
    events: Sender<SecondHandEvent>,
    /// Force for the next exchange.
    output: Wrench,
    /// State of the device, once it has been reported.
    state: Option<DeviceState>,
    /// True if the first hand was present in the last tick.
    was_present: bool,
    /// True if the second hand led in the last tick.
    was_leading: bool,
}

impl SecondHandLoop {
    /// Runs the servo until it is stopped or its device fails.
    fn run(mut self, summary: &SeqLock<9>, should_stop: &AtomicBool) {
        let mut timer = TickTimer::new(&*self.device, realtime::raise_thread_priority());
        let mut stats = TimingStats::default();
        let mut coupled_ticks = 0u64;
        while !should_stop.load(Ordering::Acquire) {
            timer.wait();
            let reading = match self.device.exchange(&self.output) {
                Ok(reading) => reading,
                Err(gone) => return self.send(SecondHandEvent::Gone(gone)),
            };
            if timer.tick_due(&mut stats).is_none() {
                continue;
            }
            if !self.report_state().is_ready() || !reading.pose.is_valid() {
                self.coupling.reset();
                self.output = Wrench::ZERO;
                continue;
            }
            self.output = Wrench { force: self.couple(&reading), ..Wrench::ZERO };
            coupled_ticks += 1;
            if coupled_ticks.is_multiple_of(SUMMARY_TICKS) {
                summary.write(stats.summary().encode());
            }
        }
        // Even if this last exchange fails, the relay sends no force older than ten ticks.
        let _ = self.device.exchange(&Wrench::ZERO);
    }

    /// Sends an event. If the channel is full, the event is dropped; the next change is reported.
    fn send(&mut self, event: SecondHandEvent) {
        let _ = self.events.try_send(event);
    }

    /// Returns the state of the device, and reports it if it has changed.
    fn report_state(&mut self) -> DeviceState {
        let now = self.device.state();
        if self.state != Some(now) {
            self.state = Some(now);
            self.send(SecondHandEvent::Device(now));
        }
        now
    }

    /// Publishes the second hand's position; returns the force of the first hand on it, N, world space.
    fn couple(&mut self, reading: &Reading) -> Vec3 {
        let (position, orientation) = (reading.pose.position, reading.pose.orientation);
        let is_leading = reading.buttons & LEAD_BUTTON != 0;
        self.link.publish(&LinkedHand { position, orientation, buttons: reading.buttons, is_leading });
        let remote = self.link.remote_position(|_| true).filter(|remote| remote.delay < SILENCE_TIMEOUT_S);
        if remote.is_some() != self.was_present {
            self.was_present = remote.is_some();
            self.send(SecondHandEvent::FirstHand { is_present: self.was_present });
        }
        if is_leading != self.was_leading {
            self.was_leading = is_leading;
            self.send(SecondHandEvent::Leading(is_leading));
        }
        self.coupling.force(position, remote).clamp_length_max(self.max_force)
    }
}

/// Time without data after which the other hand counts as absent, s.
const SILENCE_TIMEOUT_S: f32 = 0.1;
