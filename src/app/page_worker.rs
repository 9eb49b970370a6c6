//! The worker of a page in which a lesson runs, so that its ticks do not wait for pictures.
//!
//! On the page's side: starts the worker with the program that is already loaded, and passes messages on. On the worker's side:
//! runs the lesson every few milliseconds. The worker's script is `page/worker.js` in the crate `web`.

use crate::lesson_backend::{LessonBackend, LessonClient, LessonConfig};
use crate::lesson_host::LessonHost;
use crate::lesson_message::{EventMessage, LessonMessage, LessonNews, StartMessage};
use crate::page_hid;
use crate::platform;
use crate::remote_lesson::{Arrival, RemoteLesson};
use js_sys::{Array, Uint8Array};
use std::cell::RefCell;
use std::rc::Rc;
use std::sync::Arc;
use std::sync::mpsc::{self, Sender};
use typodont_audio::SoundSender;
use typodont_formats::Library;
use typodont_lesson::OpenDevice;
use typodont_report::Templates;
use wasm_bindgen::prelude::Closure;
use wasm_bindgen::{JsCast, JsValue};
use web_sys::{DedicatedWorkerGlobalScope, ErrorEvent, MessageEvent, Worker, WorkerOptions, WorkerType};
use web_time::{Duration, Instant};

/// The worker's script, beside the page.
const SCRIPT: &str = "./worker.js";

/// Interval between two steps of the lesson, ms: the shortest that browsers grant.
const INTERVAL_MS: i32 = 4;

/// Time in which a lesson that is left releases its device before its worker ends, ms.
const RELEASE_MS: i32 = 150;

/// The lesson of a worker, on the page's side; the worker ends when it is dropped.
struct WorkerLesson {
    remote: RemoteLesson,
    worker: Rc<Mailbox>,
    _on_message: Closure<dyn FnMut(MessageEvent)>,
    _on_error: Closure<dyn FnMut(ErrorEvent)>,
}

/// The way to the worker.
struct Mailbox {
    worker: Worker,
    /// Messages that wait until the worker has loaded the program; `None` from then on.
    waiting: RefCell<Option<Vec<LessonMessage>>>,
}

impl Mailbox {
    fn send(&self, message: LessonMessage) {
        match &mut *self.waiting.borrow_mut() {
            Some(waiting) => waiting.push(message),
            None => self.post(&message),
        }
    }

    fn post(&self, message: &LessonMessage) {
        let (content, buffers) = to_js(message);
        // Only the content of a message could be refused, and texts and buffers never are.
        let _ = self.worker.post_message_with_transfer(&content, &buffers);
    }

    /// Sends what has waited for the worker.
    fn begin(&self) {
        for message in self.waiting.take().unwrap_or_default() {
            self.post(&message);
        }
    }
}

impl Drop for WorkerLesson {
    fn drop(&mut self) {
        self.worker.worker.set_onmessage(None);
        self.worker.worker.set_onerror(None);
        // The lesson releases its device first.
        let _ = self.worker.worker.post_message(&JsValue::NULL);
        let worker = self.worker.worker.clone();
        let end = Closure::once_into_js(move || worker.terminate());
        let timer = web_sys::window().and_then(|window| {
            window.set_timeout_with_callback_and_timeout_and_arguments_0(end.unchecked_ref(), RELEASE_MS).ok()
        });
        if timer.is_none() {
            self.worker.worker.terminate();
        }
    }
}

impl LessonBackend for WorkerLesson {
    fn advance(&mut self) {
        self.remote.advance();
    }

    fn pass_on(&mut self) {
        self.remote.pass_on();
    }

    fn needs_frames(&self) -> bool {
        self.remote.needs_frames()
    }
}

/// Begins a lesson in a worker of its own.
///
/// # Errors
/// A message if the browser starts no worker.
pub fn start_lesson(
    config: LessonConfig,
    library: &Library,
    sounds: SoundSender,
) -> Result<(LessonClient, Box<dyn LessonBackend>), String> {
    let why = |error: JsValue| format!("no-worker: {}", platform::reason(&error));
    let options = WorkerOptions::new();
    options.set_type(WorkerType::Module);
    let worker = Worker::new_with_options(SCRIPT, &options).map_err(why)?;
    worker.post_message(&wasm_bindgen::module()).map_err(why)?;
    let mailbox = Rc::new(Mailbox { worker, waiting: RefCell::new(Some(Vec::new())) });
    let (sender, arrivals) = mpsc::channel();
    let (on_message, on_error) = (receiver(&mailbox, &sender, &config.wake), crash_receiver(sender, &config.wake));
    mailbox.worker.set_onmessage(Some(on_message.as_ref().unchecked_ref()));
    mailbox.worker.set_onerror(Some(on_error.as_ref().unchecked_ref()));
    let post = mailbox.clone();
    let send = Box::new(move |message| post.send(message));
    let (client, remote) = RemoteLesson::start(config, library, sounds, send, arrivals)?;
    let lesson = WorkerLesson { remote, worker: mailbox, _on_message: on_message, _on_error: on_error };
    Ok((client, Box::new(lesson)))
}

/// Takes the worker's messages: nothing when it has loaded the program, calls to keep its recording, and news of the lesson.
fn receiver(
    mailbox: &Rc<Mailbox>,
    arrivals: &Sender<Arrival>,
    wake: &Arc<dyn Fn() + Send + Sync>,
) -> Closure<dyn FnMut(MessageEvent)> {
    let (mailbox, arrivals, wake) = (mailbox.clone(), arrivals.clone(), wake.clone());
    Closure::new(move |event: MessageEvent| {
        let data = event.data();
        if data.is_null() {
            return mailbox.begin();
        }
        let Some(message) = of_js(&data) else {
            return platform::keep_for_worker(&data);
        };
        let arrival = match message.content::<LessonNews>() {
            Ok(news) => Arrival::News(news, message.bytes),
            Err(why) => Arrival::Failed(why),
        };
        let is_worth_a_frame = match &arrival {
            Arrival::News(news, _) => news.is_worth_a_frame || news.is_over || !news.events.is_empty(),
            Arrival::Failed(_) => true,
        };
        // A lesson that was left receives nothing.
        let _ = arrivals.send(arrival);
        if is_worth_a_frame {
            wake();
        }
    })
}

/// Reports a worker that could not be loaded, or has crashed.
fn crash_receiver(arrivals: Sender<Arrival>, wake: &Arc<dyn Fn() + Send + Sync>) -> Closure<dyn FnMut(ErrorEvent)> {
    let wake = wake.clone();
    Closure::new(move |error: ErrorEvent| {
        // The event of a script that cannot be loaded has no message.
        let message = js_sys::Reflect::get(&error, &"message".into()).ok().and_then(|message| message.as_string());
        let why = message.filter(|message| !message.is_empty()).unwrap_or_else(|| format!("{SCRIPT} cannot be loaded"));
        let _ = arrivals.send(Arrival::Failed(format!(
            "broken-off: the exercise stopped ({why}); reload the page: the list of exercises offers to finish the session"
        )));
        wake();
    })
}

/// A message as it crosses, and the buffers that are handed over rather than copied.
fn to_js(message: &LessonMessage) -> (Array, Array) {
    let content = Array::of1(&JsValue::from_str(&message.text));
    let buffers = Array::new();
    for bytes in &message.bytes {
        let array = Uint8Array::from(&bytes[..]);
        buffers.push(&array.buffer());
        content.push(&array);
    }
    (content, buffers)
}

/// The message of [`to_js`]; `None` for anything else.
fn of_js(data: &JsValue) -> Option<LessonMessage> {
    let mut content = data.dyn_ref::<Array>()?.iter();
    let text = content.next()?.as_string()?;
    let bytes = content.map(|array| array.dyn_into::<Uint8Array>().map(|array| array.to_vec()));
    Some(LessonMessage { text, bytes: bytes.collect::<Result<_, _>>().ok()? })
}

/// State of this worker.
enum WorkerState {
    Empty,
    AwaitingDevice(AwaitedDevice),
    Running(LessonHost),
    /// The lesson was left, has failed, or its device cannot be opened.
    Failed,
}

thread_local! {
    static WORKER: RefCell<WorkerState> = const { RefCell::new(WorkerState::Empty) };
}

/// A lesson that begins when its device is open.
struct AwaitedDevice {
    /// Name of the device.
    name: String,
    start: LessonMessage,
    /// Later messages of the page.
    messages: Vec<LessonMessage>,
    begun: Instant,
    last_attempt: Instant,
}

/// Interval between two attempts to open the device; it answers in a few milliseconds.
const ATTEMPT_INTERVAL: Duration = Duration::from_millis(100);

/// Time within which the device must be open.
const DEVICE_TIMEOUT: Duration = Duration::from_secs(4);

impl AwaitedDevice {
    fn new(name: String, start: LessonMessage) -> AwaitedDevice {
        let now = Instant::now();
        AwaitedDevice { name, start, messages: Vec::new(), begun: now, last_attempt: now }
    }

    /// Begins the lesson if the device can be opened now.
    fn advance(mut self) -> Result<WorkerState, String> {
        if self.last_attempt.elapsed() < ATTEMPT_INTERVAL {
            return Ok(WorkerState::AwaitingDevice(self));
        }
        self.last_attempt = Instant::now();
        match typodont_lesson::open_device(&self.name) {
            Ok(device) => {
                let mut lesson = begin_lesson(self.start, Some(device))?;
                self.messages.iter().try_for_each(|message| lesson.receive(message))?;
                Ok(WorkerState::Running(lesson))
            }
            Err(_) if self.begun.elapsed() < DEVICE_TIMEOUT => Ok(WorkerState::AwaitingDevice(self)),
            Err(why) => {
                let why = page_hid::refusal().unwrap_or(why.to_string());
                let failed = vec![EventMessage::Failed(format!("no-device: {}: {why}", self.name))];
                let news = LessonNews { events: failed, is_over: true, ..LessonNews::default() };
                send_to_page(LessonMessage::new(&news, vec![Vec::new()])?);
                Ok(WorkerState::Failed)
            }
        }
    }
}

fn begin_lesson(start: LessonMessage, device: Option<OpenDevice>) -> Result<LessonHost, String> {
    LessonHost::start(start, device, Templates::shipped(), Box::new(send_to_page))
}

/// Changes the worker's state; a failure reaches the page as one of the worker.
fn update_worker(change: impl FnOnce(WorkerState) -> Result<WorkerState, String>) {
    // After an error or a panic it has failed.
    let changed = change(WORKER.replace(WorkerState::Failed));
    let failure = changed.map(|state| WORKER.set(state)).err();
    page_hid::send_outgoing();
    if let Some(why) = failure {
        wasm_bindgen::throw_str(&why);
    }
}

/// Runs a lesson in this worker, once the page describes it. Returns false anywhere else than in a worker.
pub fn serve_lesson() -> bool {
    let Ok(scope) = js_sys::global().dyn_into::<DedicatedWorkerGlobalScope>() else { return false };
    let on_message = Closure::<dyn FnMut(MessageEvent)>::new(|event: MessageEvent| {
        match of_js(&event.data()) {
            Some(message) => update_worker(|state| receive(state, message)),
            // The lesson is left: dropped with its device, it releases the hand.
            None => update_worker(|_| Ok(WorkerState::Failed)),
        }
    });
    scope.set_onmessage(Some(on_message.as_ref().unchecked_ref()));
    let on_time = Closure::<dyn FnMut()>::new(|| {
        update_worker(|state| {
            Ok(match state {
                WorkerState::Empty | WorkerState::Failed => state,
                WorkerState::AwaitingDevice(awaited) => awaited.advance()?,
                WorkerState::Running(mut lesson) => {
                    // One that is over stays, for the page's messages that were on their way.
                    lesson.advance();
                    WorkerState::Running(lesson)
                }
            })
        })
    });
    let timer = on_time.as_ref().unchecked_ref();
    let _ = scope.set_interval_with_callback_and_timeout_and_arguments_0(timer, INTERVAL_MS);
    // Both live as long as the worker, which begins when it has said that it is ready.
    on_message.forget();
    on_time.forget();
    let _ = scope.post_message(&JsValue::NULL);
    true
}

/// Takes a message of the page.
fn receive(state: WorkerState, message: LessonMessage) -> Result<WorkerState, String> {
    match state {
        WorkerState::Running(mut lesson) => {
            lesson.receive(&message)?;
            Ok(WorkerState::Running(lesson))
        }
        WorkerState::AwaitingDevice(mut awaited) => {
            awaited.messages.push(message);
            Ok(WorkerState::AwaitingDevice(awaited))
        }
        WorkerState::Failed => Ok(WorkerState::Failed),
        WorkerState::Empty => match message.content::<StartMessage>()?.device {
            None => begin_lesson(message, None).map(WorkerState::Running),
            Some(name) => {
                page_hid::open_allowed(&name, run_ticks);
                Ok(WorkerState::AwaitingDevice(AwaitedDevice::new(name, message)))
            }
        },
    }
}

/// Runs the ticks that are due when a report of the device has come.
fn run_ticks() {
    update_worker(|mut state| {
        if let WorkerState::Running(lesson) = &mut state {
            lesson.run_ticks();
        }
        Ok(state)
    });
}

fn send_to_page(message: LessonMessage) {
    let Ok(scope) = js_sys::global().dyn_into::<DedicatedWorkerGlobalScope>() else { return };
    let (content, buffers) = to_js(&message);
    let _ = scope.post_message_with_transfer(&content, &buffers);
}
