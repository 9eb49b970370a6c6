//! A second hand: an instructor's, which follows the first one, feels what that one feels and leads it while its holder wants
//! that; or an assistant's, which holds the suction.
//!
//! [`Second`] is the first hand's end, turned by its servo. [`Assist`] is the second hand's own servo, here or on another
//! machine: it has no world, only the tie between the two hands.

use super::Simulation;
use super::attend::Attendant;
use super::beats::{BeatSummary, Beats};
use super::pace::Pace;
use crate::device::{Coupling, Device, Gone, Link, Mate, Output, Reading, State, Tie, realtime};
use crate::frame::Vec3;
use crate::mailbox::{self, Newest, Receiver, Sender};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};

/// The button that leads while it is held.
const LEADS: u32 = 1;

/// What a second hand is there for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Role {
    /// It follows the first hand, and leads it while button 0 is held.
    #[default]
    Instructor,
    /// It moves freely with a suction tip, and feels the tooth with it.
    Suction,
}

/// The first hand's end of the way to a second one.
pub struct Second {
    link: Link,
    coupling: Coupling,
    role: Role,
    /// What it holds in the first hand's world, once it has come into it.
    attendant: Option<Attendant>,
}

impl Second {
    /// `max_damping`: what the first hand's device renders, N·s/mm.
    pub fn new(link: Link, max_damping: f32, role: Role) -> Second {
        Second { link, coupling: Coupling::new(Tie::for_damping(max_damping)), role, attendant: None }
    }

    /// Comes into a world, before its first tick.
    pub(super) fn enter(&mut self, world: &Simulation) {
        self.attendant = (self.role == Role::Suction).then(|| Attendant::new(world.matter()));
    }

    /// One tick of the second hand, before the first hand's; returns how it leads that one, N.
    pub(super) fn turn(&mut self, reading: &Reading, world: &Simulation) -> Vec3 {
        let Some(attendant) = &mut self.attendant else { return self.lead(reading) };
        match self.link.hear().filter(|(_, delay)| *delay < SILENT_AFTER) {
            Some((mate, _)) if mate.position.is_finite() => {
                let (matter, materials) = (world.matter(), world.materials());
                let tip = attendant.follow(matter, materials, world.world_from_tooth(), mate.position);
                // The tie that holds an instructor's hand at the trainee's holds an assistant's at its own tip.
                self.link.tell(&Mate { position: tip, is_leading: false, ..mate });
            }
            _ => attendant.forget(),
        }
        Vec3::ZERO
    }

    /// Shows the first hand to the second; returns how that one leads it, N.
    fn lead(&mut self, reading: &Reading) -> Vec3 {
        if !reading.pose.is_sound() {
            self.coupling.forget();
            return Vec3::ZERO;
        }
        let (position, orientation) = (reading.pose.position, reading.pose.orientation);
        self.link.tell(&Mate { position, orientation, buttons: reading.buttons, is_leading: false });
        self.coupling.force(position, self.link.far(|mate| mate.is_leading))
    }

    /// The first hand was let go: the lead comes in softly when it is back.
    pub(super) fn forget(&mut self) {
        // What the second hand itself holds rests where it is: that hand was not lost.
        self.coupling.forget();
    }

    /// Datagrams that were refused on the way.
    pub fn refused(&self) -> u64 {
        self.link.refused()
    }
}

/// The second hand's servo.
pub struct Assist {
    stop: Arc<AtomicBool>,
    beats: Arc<Newest<9>>,
    news: Receiver<AssistNews>,
    thread: Option<JoinHandle<()>>,
}

/// What the second hand's servo tells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AssistNews {
    Device(State),
    Gone(Gone),
    /// The first hand is there, or has fallen silent.
    First {
        is_there: bool,
    },
    /// The second hand has begun to lead, or has ceased to.
    Leading(bool),
}

/// News that may wait.
const NEWS_MAX: usize = 64;

/// Beats between two summaries.
const SUMMARY_BEATS: u64 = 500;

impl Assist {
    /// Starts the second hand's servo: it follows the first hand, and leads it while button 0 is held.
    pub fn start(device: Box<dyn Device + Send>, link: Link) -> Result<Assist, String> {
        let (post, news) = mailbox::ordered(NEWS_MAX);
        let (stop, beats) = (Arc::new(AtomicBool::new(false)), Arc::new(Newest::new()));
        let (is_over, summary) = (stop.clone(), beats.clone());
        let turning = move || assist(device, &link, post, &summary, &is_over);
        let thread = thread::Builder::new().name("second hand".into()).spawn(turning);
        let thread = thread.map_err(|e| format!("the system gives no thread for the second hand: {e}"))?;
        Ok(Assist { stop, beats, news, thread: Some(thread) })
    }

    pub fn next_news(&mut self) -> Option<AssistNews> {
        self.news.try_recv()
    }

    pub fn beats(&self) -> Option<BeatSummary> {
        self.beats.read().map(|(_, words)| BeatSummary::of_words(words))
    }

    /// True when the device is gone.
    pub fn has_ended(&self) -> bool {
        self.thread.as_ref().is_none_or(JoinHandle::is_finished)
    }
}

impl Drop for Assist {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Release);
        if let Some(thread) = self.thread.take() {
            // It looks up every beat. A panic of it let the hand go with the device.
            let _ = thread.join();
        }
    }
}

fn assist(
    mut device: Box<dyn Device + Send>,
    link: &Link,
    mut post: Sender<AssistNews>,
    summary: &Newest<9>,
    is_over: &AtomicBool,
) {
    let mut pace = Pace::new(device.beat(), realtime::raise());
    let mut beats = Beats::default();
    let mut coupling = Coupling::new(Tie::for_damping(device.spec().max_damping));
    let max_force = device.spec().max_force;
    let (mut output, mut state, mut was_there, mut was_leading) = (Output::NONE, None, false, false);
    let mut count = 0u64;
    // News that find no room are told of by the next change.
    let mut tell = |news| {
        let _ = post.try_send(news);
    };
    while !is_over.load(Ordering::Acquire) {
        pace.wait();
        let reading = match device.exchange(&output) {
            Ok(reading) => reading,
            Err(gone) => {
                tell(AssistNews::Gone(gone));
                return;
            }
        };
        if pace.beat(&mut beats).is_none() {
            continue;
        }
        let now = device.state();
        if state != Some(now) {
            state = Some(now);
            tell(AssistNews::Device(now));
        }
        if !now.is_ready() || !reading.pose.is_sound() {
            coupling.forget();
            output = Output::NONE;
            continue;
        }
        let (position, orientation) = (reading.pose.position, reading.pose.orientation);
        let is_leading = reading.buttons & LEADS != 0;
        link.tell(&Mate { position, orientation, buttons: reading.buttons, is_leading });
        let far = link.far(|_| true).filter(|far| far.delay < SILENT_AFTER);
        if far.is_some() != was_there {
            was_there = far.is_some();
            tell(AssistNews::First { is_there: was_there });
        }
        if is_leading != was_leading {
            was_leading = is_leading;
            tell(AssistNews::Leading(is_leading));
        }
        let force = coupling.force(position, far).clamp_length_max(max_force);
        output = Output { force, ..Output::NONE };
        count += 1;
        if count.is_multiple_of(SUMMARY_BEATS) {
            summary.write(beats.summary().words());
        }
    }
    // Whether or not this last beat is answered, the relay sends no force that is older than ten beats.
    let _ = device.exchange(&Output::NONE);
}

/// A first hand that has not been heard of for so long is away, s.
const SILENT_AFTER: f32 = 0.1;
