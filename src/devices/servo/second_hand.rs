//! A second hand: that of an instructor, which follows the first one, feels the same, and leads it on demand; or that
//! of an assistant, which holds the suction.
//!
//! Takes the devices or links of both hands. Gives the force on each. [`SecondHandLink`] is the first hand's end,
//! stepped by that hand's servo. [`SecondHandServo`] is the second hand's own servo, here or on another machine: it
//! never has a simulation, only the coupling of the two hands.

use crate::servo::suction_tip::SuctionTip;
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
}

/// The first hand's end of the link to a second one.
pub struct SecondHandLink {
    link: HandLink,
    coupling: Coupling,
    role: SecondHandRole,
    /// The suction tip in the first hand's simulation, once the second hand has entered it.
    suction_tip: Option<SuctionTip>,
}

impl SecondHandLink {
    /// Creates a link. `max_damping` is the limit of the first hand's device, N·s/mm.
    pub fn new(link: HandLink, max_damping: f32, role: SecondHandRole) -> SecondHandLink {
        SecondHandLink {
            link,
            coupling: Coupling::new(CouplingParams::for_damping(max_damping)),
            role,
            suction_tip: None,
        }
    }

    /// Enters a simulation, before its first tick.
    pub(super) fn enter_world(&mut self, world: &Simulation) {
        self.suction_tip = (self.role == SecondHandRole::Suction).then(|| SuctionTip::new(world.scene()));
    }

    /// Steps the second hand, before the first one; returns its force on the first hand, N, world space.
    pub(super) fn step(&mut self, reading: &Reading, world: &Simulation) -> Vec3 {
        let Some(suction_tip) = &mut self.suction_tip else { return self.leading_force(reading) };
        match self.link.latest().filter(|(_, delay)| *delay < SILENCE_TIMEOUT_S) {
            Some((hand, _)) if hand.position.is_finite() => {
                let (matter, materials) = (world.scene(), world.materials());
                let tip = suction_tip.follow(matter, materials, world.world_from_tooth(), hand.position);
                // The coupling that pulls an instructor's hand to the trainee's pulls an assistant's hand to its own
                // tip.
                self.link.publish(&LinkedHand { position: tip, is_leading: false, ..hand });
            }
            _ => suction_tip.reset(),
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
        if self.suction_tip.is_some() || !reading.pose.is_valid() {
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
