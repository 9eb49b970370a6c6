//! The chair: the thread on which a lesson runs, and its letters to and from the window.
//!
//! The thread listens to the servo every few milliseconds, whatever the window does; what does not fit into a box yet waits
//! on this side. The window finds the newest tick, what happened in order, and every changed voxel in order.

use super::seen::{Seen, WORDS};
use super::sound::Treatment;
use crate::audio::Sounds;
use crate::device::Device;
use crate::device::mouse::Mouse;
use crate::lesson::{Failed, Held, Lesson, Opening, Prepared, SecondHand, second};
use crate::mailbox::{self, Newest, Receiver, Sender};
use crate::report::Templates;
use crate::scenario::{Scenario, Workpiece};
use crate::session::{Heard, Input};
use crate::sim::{AssistNews, Role};
use crate::volume::Edit;
use std::collections::{BTreeMap, VecDeque};
use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// How often the thread listens: a screen shows nothing faster.
const LISTEN_EVERY: Duration = Duration::from_millis(4);

/// How often a device that is gone is looked for.
const LOOK_EVERY: Duration = Duration::from_millis(500);

/// Letters of each kind that fit between two pictures.
const LETTERS: usize = 256;

/// Changed voxels that fit: some seconds of the hardest cutting. More wait on the thread's side.
const EDITS: usize = 1 << 16;

/// What the window says.
pub enum Said {
    Input(Input),
    /// What belongs to the stage that the window showed: a second click does not end the next one.
    InStage(usize, Input),
    Pause(bool),
    /// The questionnaire is finished, whatever is left open.
    Leave,
}

/// What happened, in order.
pub enum News {
    /// The matter is made; the servo is about to turn.
    Made(Arc<Workpiece>),
    Heard(Heard),
    /// A machine with the key may join at this address.
    MayJoin(SocketAddr),
    Second(AssistNews),
    /// The device that came back is another one.
    OtherDevice,
    /// The session is over; its bundle is being made.
    Scoring,
    Done(PathBuf),
    Failed(String),
}

/// What a lesson at the chair is made of.
pub struct Order {
    pub scenario: Arc<Scenario>,
    pub seed: u64,
    pub participant: String,
    pub out: PathBuf,
    pub templates: Templates,
    pub started: jiff::Timestamp,
    pub hand: Hand,
    /// Another hand that may join, and as what.
    pub second: Option<(second::From, Role)>,
    /// SHA-256 of files that the exercise does not name, by name.
    pub digests: BTreeMap<String, String>,
    /// Called when there is something to look at that was waited for.
    pub wake: Box<dyn Fn() + Send>,
}

/// What is in the trainee's hand.
pub enum Hand {
    /// This window's own pointer.
    Mouse,
    Device(Held),
}

/// The window's side of a lesson. When it is dropped the lesson is aborted, its hand let go and its bundle made.
pub struct Chair {
    said: Option<Sender<Said>>,
    news: Receiver<News>,
    edits: Receiver<Edit>,
    seen: Arc<Newest<WORDS>>,
    /// For the pointer, where it is the hand.
    pub mouse: Option<Mouse>,
    thread: Option<JoinHandle<()>>,
}

impl Chair {
    /// Begins a lesson. What cannot begin says so in its news.
    pub fn take(order: Order, sounds: Sounds) -> std::io::Result<Chair> {
        let (said, inbox) = mailbox::ordered(LETTERS);
        let (news_post, news) = mailbox::ordered(LETTERS);
        let (edit_post, edits) = mailbox::ordered(EDITS);
        let seen = Arc::new(Newest::new());
        let seat = Seat {
            inbox,
            news: Post::of(news_post),
            edits: Post::of(edit_post),
            seen: seen.clone(),
            treatment: Treatment::of(&order.scenario, sounds),
            is_paused: false,
        };
        let Order { hand, .. } = &order;
        let (mouse, device): (_, Option<Box<dyn Device + Send>>) = match hand {
            Hand::Mouse => {
                let (mouse, handle) = Mouse::new();
                (Some(mouse), Some(Box::new(handle)))
            }
            Hand::Device(_) => (None, None),
        };
        let thread = std::thread::Builder::new().name("lesson".into()).spawn(move || sit(seat, order, device))?;
        Ok(Chair { said: Some(said), news, edits, seen, mouse, thread: Some(thread) })
    }

    /// Says something; false when the lesson hears no more.
    pub fn say(&mut self, said: Said) -> bool {
        self.said.as_mut().is_some_and(|post| post.try_send(said).is_ok())
    }

    pub fn next_news(&mut self) -> Option<News> {
        self.news.try_recv()
    }

    pub fn next_edit(&mut self) -> Option<Edit> {
        self.edits.try_recv()
    }

    /// True when the lesson has ended and nothing it said is left to be heard.
    pub fn is_empty(&self) -> bool {
        self.news.is_abandoned() && self.news.waiting() == 0
    }

    /// The newest tick; `None` before the first, and while one is being written.
    pub fn seen(&self) -> Option<Seen> {
        self.seen.read().map(|(_, words)| Seen::from_words(words))
    }
}

impl Drop for Chair {
    fn drop(&mut self) {
        // Nobody says anything any more: the thread ends its lesson as aborted.
        self.said = None;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// A box with a shelf before it: what does not fit waits in order.
struct Post<T> {
    post: Sender<T>,
    waiting: VecDeque<T>,
}

impl<T> Post<T> {
    fn of(post: Sender<T>) -> Post<T> {
        Post { post, waiting: VecDeque::new() }
    }

    fn send(&mut self, letter: T) {
        self.waiting.push_back(letter);
        self.push();
    }

    /// Brings as much into the box as fits.
    fn push(&mut self) {
        for _ in 0..self.post.room().min(self.waiting.len()) {
            if let Some(letter) = self.waiting.pop_front() {
                // There is room: only this side fills it.
                let _ = self.post.try_send(letter);
            }
        }
    }
}

/// The thread's side.
struct Seat {
    inbox: Receiver<Said>,
    news: Post<News>,
    edits: Post<Edit>,
    seen: Arc<Newest<WORDS>>,
    treatment: Treatment,
    is_paused: bool,
}

fn sit(mut seat: Seat, order: Order, mouse: Option<Box<dyn Device + Send>>) {
    let last = match take_lesson(&mut seat, order, mouse) {
        Ok(path) => News::Done(path),
        Err(failed) => News::Failed(failed.to_string()),
    };
    seat.news.send(last);
    while !seat.news.waiting.is_empty() && !seat.inbox.is_abandoned() {
        std::thread::sleep(LISTEN_EVERY);
        seat.news.push();
    }
}

fn take_lesson(seat: &mut Seat, order: Order, mouse: Option<Box<dyn Device + Send>>) -> Result<PathBuf, Failed> {
    let Order { scenario, seed, participant, out, templates, started, hand, second, digests, wake } = order;
    let held = match hand {
        Hand::Mouse => None,
        Hand::Device(held) => Some(held),
    };
    let (name, device, again) = match (held, mouse) {
        (Some(held), _) => (held.name, held.device, Some((held.driver, held.argument))),
        (None, Some(mouse)) => ("mouse".to_string(), mouse, None),
        (None, None) => return Err(Failed::NoDevice { name: "mouse".into(), why: "nothing is in the hand".into() }),
    };
    let second = second.map(|(from, role)| SecondHand::join(&from, role, (&name, device.spec()))).transpose()?;
    if let Some(address) = second.as_ref().and_then(SecondHand::address) {
        seat.news.send(News::MayJoin(address));
    }
    let opening = Opening { scenario, seed, participant: &participant, out: &out, digests, templates, started };
    let workpiece = opening.make()?;
    // It is drawn while its recording is opened.
    seat.news.send(News::Made(workpiece.clone()));
    wake();
    let prepared: Prepared = opening.prepare(workpiece, device.spec().clone(), None)?;
    let (mut lesson, heard) = prepared.begin(device, second)?;
    seat.tell(heard);
    let mut looked = Instant::now();
    while !lesson.session().is_complete() {
        std::thread::sleep(LISTEN_EVERY);
        seat.follow(&mut lesson)?;
        if lesson.live().is_waiting()
            && looked.elapsed() > LOOK_EVERY
            && let Some((driver, argument)) = &again
        {
            looked = Instant::now();
            if let Ok(device) = driver.open(argument.as_deref())
                && !lesson.go_on(device)?
            {
                seat.news.send(News::OtherDevice);
            }
        }
        if seat.hear(&mut lesson)? {
            break;
        }
    }
    seat.follow(&mut lesson)?;
    seat.treatment.rest();
    let recorded = lesson.end()?;
    seat.news.send(News::Scoring);
    recorded.complete()
}

impl Seat {
    /// Brings what the servo did to the window.
    fn follow(&mut self, lesson: &mut Lesson) -> Result<(), Failed> {
        let heard = lesson.listen()?;
        self.tell(heard);
        while let Some(news) = lesson.next_of_second() {
            self.news.send(News::Second(news));
        }
        for edit in lesson.edits() {
            self.edits.waiting.push_back(*edit);
        }
        self.edits.push();
        self.news.push();
        let (session, live) = (lesson.session(), lesson.live());
        if let Some(step) = live.screen() {
            let seen = Seen::of(step, lesson.held(), session.stage_seconds(), session.cleared_pct(), live.beats());
            self.seen.write(seen.words());
            match session.stage() {
                Some((_, stage)) if !self.is_paused && !live.is_waiting() => self.treatment.follow(step, stage.cutting),
                _ => self.treatment.rest(),
            }
        }
        Ok(())
    }

    /// Hears what the window says; true when the lesson is to end.
    fn hear(&mut self, lesson: &mut Lesson) -> Result<bool, Failed> {
        // Asked first: what was said before the window went is still heard.
        let is_abandoned = self.inbox.is_abandoned();
        while let Some(said) = self.inbox.try_recv() {
            match said {
                Said::InStage(stage, _) if lesson.session().stage().map(|(running, _)| running) != Some(stage) => {}
                Said::Input(input) | Said::InStage(_, input) => {
                    let heard = lesson.say(&input)?;
                    self.tell(heard);
                }
                Said::Pause(is_paused) => {
                    self.is_paused = is_paused;
                    lesson.pause(is_paused);
                }
                Said::Leave if lesson.session().are_stages_over() => return Ok(true),
                Said::Leave => {}
            }
        }
        if is_abandoned {
            // The window was closed.
            lesson.say(&Input::Abort)?;
            return Ok(true);
        }
        Ok(false)
    }

    fn tell(&mut self, heard: Vec<Heard>) {
        for one in heard {
            self.news.send(News::Heard(one));
        }
    }
}
