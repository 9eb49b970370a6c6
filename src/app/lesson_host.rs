//! The lesson's side of a lesson that runs in a worker.
//!
//! Takes the messages of the window. Runs the lesson as a thread would, and gives messages about what it did. Whoever owns it
//! asks it every few milliseconds to go on.

use crate::lesson_backend::{InputDevice, LessonClient, LessonConfig};
use crate::lesson_message::{EventMessage, LessonMessage, LessonNews, StartMessage, WindowMessage, edit_bytes};
use crate::lesson_run::LessonRun;
use crate::snapshot::SNAPSHOT_WORDS;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use typodont_audio::{DrillLoad, SoundReceiver};
use typodont_lesson::OpenDevice;
use typodont_report::Templates;
use web_time::{Duration, Instant};

/// Sends a message to the window.
pub type NewsSender = Box<dyn FnMut(LessonMessage) + Send>;

pub struct LessonHost {
    /// `None` when the lesson is over.
    run: Option<LessonRun>,
    outlet: Arc<Mutex<Option<Outlet>>>,
}

/// The way to the window, which the lesson itself takes during a step that takes long.
struct Outlet {
    client: LessonClient,
    sounds: SoundReceiver,
    load: Option<DrillLoad>,
    snapshot: Option<[u32; SNAPSHOT_WORDS]>,
    sent: Instant,
    send: NewsSender,
}

/// Interval at which the window learns of ticks in which nothing happened: its clock goes on.
const QUIET_INTERVAL: Duration = Duration::from_millis(100);

impl Outlet {
    /// Tells the window what has happened since the last time, if anything has.
    fn send_news(&mut self, is_worth_a_frame: bool, is_over: bool) {
        let Outlet { client, sounds, load, snapshot, sent, send } = self;
        let mut news = LessonNews { is_worth_a_frame, is_over, ..LessonNews::default() };
        let edits = edit_bytes(std::iter::from_fn(|| client.next_edit()));
        let mut bytes = vec![edits];
        while let Some(event) = client.next_event() {
            if let Some((message, file_bytes)) = EventMessage::of(event) {
                news.events.push(message);
                bytes.extend(file_bytes);
            }
        }
        news.cries = std::iter::from_fn(|| sounds.next_cry()).collect();
        let heard = sounds.load();
        if heard.is_some() && heard != *load {
            *load = heard;
            news.load = heard.map(DrillLoad::encode);
        }
        let newest = client.snapshot_words();
        let is_quiet = news == LessonNews::default() && bytes[0].is_empty();
        if is_quiet && (newest == *snapshot || sent.elapsed() < QUIET_INTERVAL) {
            return;
        }
        (*snapshot, *sent) = (newest, Instant::now());
        news.snapshot = newest;
        if let Ok(message) = LessonMessage::new(&news, bytes) {
            send(message);
        }
    }
}

impl LessonHost {
    /// Begins the lesson that the window's first message describes, with an open device if the message names one.
    ///
    /// # Errors
    /// A message if it does not describe a lesson.
    pub fn start(
        first: LessonMessage,
        device: Option<OpenDevice>,
        templates: Templates,
        send: NewsSender,
    ) -> Result<LessonHost, String> {
        let start: StartMessage = first.content()?;
        let mut bytes = first.bytes;
        let resumed = start.reopen(&mut bytes)?;
        let scenario = match &resumed {
            Some(reopened) => reopened.scenario().clone(),
            None => Arc::new(start.scenario(bytes)?),
        };
        let outlet = Arc::new(Mutex::new(None::<Outlet>));
        let waker = outlet.clone();
        let config = LessonConfig {
            scenario,
            seed: start.seed(),
            participant: start.participant,
            out: None,
            templates,
            started: start.started.parse().map_err(|error| format!("unreadable-message: {error}"))?,
            input_device: device.map_or(InputDevice::Mouse, InputDevice::Device),
            second: None,
            digests: start.digests,
            resumed,
            is_kept: start.is_kept,
            wake: Arc::new(move || {
                if let Some(outlet) = lock(&waker).as_mut() {
                    outlet.send_news(true, false);
                }
            }),
        };
        let (sender, sounds) = typodont_audio::sound_channel();
        let (client, run) = LessonRun::new(config, sender);
        *lock(&outlet) = Some(Outlet { client, sounds, load: None, snapshot: None, sent: Instant::now(), send });
        Ok(LessonHost { run: Some(run), outlet })
    }

    /// Takes the commands and the pointer of a frame of the window.
    ///
    /// # Errors
    /// A message if it cannot be read.
    pub fn receive(&mut self, message: &LessonMessage) -> Result<(), String> {
        let WindowMessage { commands, mouse } = message.content()?;
        let mut outlet = lock(&self.outlet);
        let Some(Outlet { client, .. }) = outlet.as_mut() else { return Ok(()) };
        for command in commands {
            // A lesson that has ended needs no commands.
            client.send(command.into());
        }
        if let Some((own, target)) = client.mouse.as_ref().zip(mouse) {
            own.follow(target.into());
        }
        Ok(())
    }

    /// Does what is due without telling the window, unless the lesson is over.
    pub fn run_ticks(&mut self) {
        if self.run.as_mut().is_some_and(|run| !run.advance()) {
            self.run = None;
            self.send_news(true);
        }
    }

    /// Does what is due, and tells the window what has happened. Returns false when the lesson is over.
    pub fn advance(&mut self) -> bool {
        self.run_ticks();
        if self.run.is_some() {
            self.send_news(false);
        }
        self.run.is_some()
    }

    fn send_news(&self, is_over: bool) {
        if let Some(outlet) = lock(&self.outlet).as_mut() {
            outlet.send_news(false, is_over);
        }
    }
}

/// The outlet; a lesson that panicked has no further news.
fn lock(outlet: &Mutex<Option<Outlet>>) -> MutexGuard<'_, Option<Outlet>> {
    outlet.lock().unwrap_or_else(PoisonError::into_inner)
}
