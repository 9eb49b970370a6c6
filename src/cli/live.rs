//! An exercise with a device at a terminal: questions are printed, and answers are typed.
//!
//! Takes an open device and lines of text. Gives a recorded session. The window of the desktop application is the
//! graphical alternative.

use super::print_line;
use std::fmt::Write;
use std::io::BufRead;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Receiver, TryRecvError};
use std::time::{Duration, Instant};
use typodont_core::sim::Command;
use typodont_devices::servo::SecondHandEvent;
use typodont_exercise::scenario::{QuestionKind, Scenario};
use typodont_exercise::session::{AnswerValue, ChartEntry, ChartInput, Effect, Input, Session};
use typodont_lesson::live::{LiveEvent, LiveSession};
use typodont_lesson::{Lesson, LessonError, OpenDevice, PendingSecondHand, PreparedSession, RecordedSession};

/// The trainee's device, and a second hand if one joins.
pub struct Hands {
    pub first: OpenDevice,
    pub second: Option<PendingSecondHand>,
}

/// Poll interval for events; nobody at a terminal sees faster changes.
const LISTEN_EVERY: Duration = Duration::from_millis(4);

/// Interval between attempts to find a disconnected device.
const RECONNECT_EVERY: Duration = Duration::from_millis(500);

/// Runs a prepared lesson to its end.
///
/// # Errors
/// The lesson's error if it cannot begin, be recorded or be continued.
pub fn play(prepared: PreparedSession, hands: Hands) -> Result<RecordedSession, LessonError> {
    let Hands { first: OpenDevice { device, driver, argument, .. }, second } = hands;
    if let Some(address) = second.as_ref().and_then(PendingSecondHand::address) {
        print_best_effort(format!(
            "a second device can join at {address}: typodont assist --device NAME --to {address} --key …"
        ));
    }
    let lines = typed_lines();
    let is_interrupted = interrupt_flag();
    let (mut lesson, events) = prepared.begin(device, second)?;
    lesson.use_clutch_button();
    print_events(&events, lesson.session());
    let mut last_attempt = Instant::now();
    let mut is_listening = true;
    while !lesson.session().is_complete() {
        std::thread::sleep(LISTEN_EVERY);
        let events = lesson.poll()?;
        print_events(&events, lesson.session());
        while let Some(event) = lesson.next_assist_event() {
            print_assist_event(event);
        }
        if lesson.live().is_suspended() && last_attempt.elapsed() > RECONNECT_EVERY {
            last_attempt = Instant::now();
            if let Ok(device) = driver.open(argument.as_deref()) {
                print_best_effort(match lesson.resume_with(device)? {
                    true => "the device is connected again; move the instrument out of the tooth, then continue",
                    false => "this is not the device with which the session began; plug that device in again",
                });
            }
        }
        if is_interrupted.swap(false, Ordering::Relaxed) {
            submit(&mut lesson, &Input::Abort)?;
            break;
        }
        match lines.try_recv() {
            Ok(line) => match parse_line(&line, lesson.session(), lesson.live()) {
                TypedCommand::Input(input) => submit(&mut lesson, &input)?,
                TypedCommand::Pause(is_paused) => lesson.set_paused(is_paused),
                TypedCommand::End if lesson.session().are_stages_over() => break,
                TypedCommand::End => print_best_effort("the exercise is not over; type abort to end it early"),
                TypedCommand::Show(text) => print_best_effort(text),
                TypedCommand::Nothing => {}
            },
            Err(TryRecvError::Disconnected) if is_listening => is_listening = false,
            Err(_) => {}
        }
        if lesson.session().are_stages_over() && !is_listening {
            // Nobody is there to answer the questionnaire.
            break;
        }
    }
    lesson.end()
}

fn submit(lesson: &mut Lesson, input: &Input) -> Result<(), LessonError> {
    let events = lesson.submit(input)?;
    print_events(&events, lesson.session());
    Ok(())
}

/// Flag that becomes true when the program is asked to stop (Ctrl-C or a termination signal): the session is then
/// aborted, the device's force is switched off and the bundle is written.
pub fn interrupt_flag() -> Arc<AtomicBool> {
    let is_asked = Arc::new(AtomicBool::new(false));
    let asked = is_asked.clone();
    // If the signal cannot be caught, it ends the program; the device switches its force off when commands stop.
    let _ = ctrlc::set_handler(move || asked.store(true, Ordering::Relaxed));
    is_asked
}

/// Lines as they are typed; the channel closes at the end of input.
pub fn typed_lines() -> Receiver<String> {
    let (sender, lines) = mpsc::channel();
    std::thread::spawn(move || {
        for line in std::io::stdin().lock().lines().map_while(Result::ok) {
            if sender.send(line).is_err() {
                break;
            }
        }
    });
    lines
}

/// Prints a line and ignores errors, so that a closed terminal does not end a session.
pub fn print_best_effort(text: impl std::fmt::Display) {
    let _ = print_line(text);
}

fn print_events(events: &[LiveEvent], session: &Session) {
    for event in events {
        match event {
            LiveEvent::Effect(Effect::StageStarted { stage }) => {
                print_best_effort(stage_text(session.scenario(), *stage))
            }
            LiveEvent::Effect(Effect::StageEnded { .. }) => print_best_effort("this stage has ended\n"),
            LiveEvent::Effect(Effect::StagesOver) => print_best_effort(questionnaire_text(session.scenario())),
            LiveEvent::Effect(Effect::Refused { why }) => print_best_effort(format!("not accepted: {why}")),
            LiveEvent::Effect(Effect::Answered { .. }) => print_best_effort("recorded"),
            LiveEvent::Effect(Effect::Charted { record: note, is_present: is_there, .. }) => {
                print_best_effort(match note.entry {
                    ChartEntry::Depth { reading: read, .. } => format!("{}: {read} mm", note.site.code()),
                    ChartEntry::Calculus if *is_there => format!("{}: calculus", note.site.code()),
                    ChartEntry::Calculus => format!("{}: no calculus", note.site.code()),
                })
            }
            LiveEvent::Effect(Effect::Command(Command::SelectInstrument { instrument })) => {
                print_best_effort(format!("instrument: {}", session.scenario().instruments[*instrument].title));
            }
            LiveEvent::Effect(Effect::Command(_) | Effect::StepStarted { .. }) => {}
            LiveEvent::AwaitingMovement(_) => {}
            LiveEvent::ServoStarted(priority) => print_best_effort(format!("the servo thread runs at {priority}")),
            LiveEvent::DeviceState(state) if state.is_ready() => print_best_effort("the device is ready"),
            LiveEvent::DeviceState(state) => print_best_effort(format!("the session is suspended: {state}")),
            LiveEvent::DeviceLost(gone) => {
                print_best_effort(format!("the session is suspended: {gone}; plug the device in again to continue"))
            }
        }
    }
}

/// Prints an event of the second hand.
pub fn print_assist_event(event: SecondHandEvent) {
    let text = match event {
        SecondHandEvent::Device(state) => format!("device: {state}"),
        SecondHandEvent::Gone(gone) => format!("{gone}; it cannot rejoin this session"),
        SecondHandEvent::FirstHand { is_present: true } => {
            "the trainee's device is connected; hold the button to lead it".to_string()
        }
        SecondHandEvent::FirstHand { is_present: false } => "the trainee's device no longer sends data".to_string(),
        SecondHandEvent::Leading(true) => "leads".to_string(),
        SecondHandEvent::Leading(false) => "follows".to_string(),
    };
    print_best_effort(format!("second device: {text}"));
}

/// Title, instruction and questions of a stage, with the commands that answer them.
fn stage_text(scenario: &Scenario, stage: usize) -> String {
    let stage = &scenario.stages[stage];
    let mut text = format!("\n{}\n{}\n", stage.title, stage.instruction);
    let tray = stage.instruments.iter().map(|i| scenario.instruments[*i].id.as_str()).collect::<Vec<_>>().join(", ");
    // Writing to a string cannot fail.
    let _ = writeln!(text, "  take NAME         instruments: {tray}");
    for question in &stage.ask {
        let answer = match &question.kind {
            QuestionKind::ToothWith { .. } => {
                scenario.scene.teeth.iter().map(|t| t.id.as_str()).collect::<Vec<_>>().join(", ")
            }
            QuestionKind::QuadrantOf { .. } => "1 to 4".to_string(),
            QuestionKind::Choice { options, .. } => {
                options.iter().map(|(id, _)| id.as_str()).collect::<Vec<_>>().join(", ")
            }
            QuestionKind::YesNo { .. } => "yes or no".to_string(),
            QuestionKind::Number { .. } => "a number".to_string(),
            QuestionKind::Text => "a text".to_string(),
        };
        let _ = writeln!(text, "  answer {} …     {} ({answer})", question.id, question.text);
    }
    if stage.chart.depths {
        let _ = writeln!(text, "  read              records the probing depth at the probe's position");
    }
    if stage.chart.calculus {
        let _ = writeln!(text, "  calculus          marks calculus at the instrument's position, or removes the mark");
    }
    if stage.ends.confirmed {
        let _ = writeln!(text, "  done              ends this stage");
    }
    text.push_str("  pause, resume, abort, status");
    text
}

fn questionnaire_text(scenario: &Scenario) -> String {
    let Some(questionnaire) = &scenario.questionnaire else { return "the exercise is over".to_string() };
    let mut text = format!(
        "the exercise is over\n{}\n{}\n  1 = {}, {} = {}\n",
        questionnaire.title,
        questionnaire.instruction,
        questionnaire.lowest,
        questionnaire.steps,
        questionnaire.highest
    );
    for item in questionnaire.items() {
        let _ = writeln!(text, "  rate {} 1…{}     {}", item.id, questionnaire.steps, item.text);
    }
    text.push_str("  end               leaves the rest unanswered");
    text
}

enum TypedCommand {
    Input(Input),
    Pause(bool),
    /// Ends the questionnaire; the remaining statements stay without a rating.
    End,
    Show(String),
    Nothing,
}

/// Parses a typed line.
fn parse_line(line: &str, session: &Session, live: &LiveSession) -> TypedCommand {
    let mut words = line.split_whitespace();
    let scenario = session.scenario();
    let unknown = || TypedCommand::Show(format!("unknown command: \"{line}\""));
    match (words.next(), words.next()) {
        (None, _) => TypedCommand::Nothing,
        (Some("read"), None) => TypedCommand::Input(Input::Chart(ChartInput::Depth)),
        (Some("calculus"), None) => TypedCommand::Input(Input::Chart(ChartInput::Calculus)),
        (Some("done"), None) => TypedCommand::Input(Input::Confirm),
        (Some("abort"), None) => TypedCommand::Input(Input::Abort),
        (Some("end"), None) => TypedCommand::End,
        (Some("pause"), None) => TypedCommand::Pause(true),
        (Some("resume"), None) => TypedCommand::Pause(false),
        (Some("status"), None) => TypedCommand::Show(status(session, live)),
        (Some("take"), Some(name)) => match scenario.instruments.iter().position(|i| i.id == name) {
            Some(instrument) => TypedCommand::Input(Input::Take { instrument }),
            None => TypedCommand::Show(format!("there is no instrument \"{name}\" in this exercise")),
        },
        (Some("rate"), Some(item)) => match words.next().and_then(|value| value.parse().ok()) {
            Some(value) => TypedCommand::Input(Input::Rate { item: item.to_string(), value }),
            None => unknown(),
        },
        (Some("answer"), Some(question)) => {
            let value = words.collect::<Vec<_>>().join(" ");
            let asked = session.stage().and_then(|(_, stage)| stage.ask.iter().find(|q| q.id == question));
            let answer = match asked.map(|q| &q.kind) {
                Some(QuestionKind::QuadrantOf { .. }) => value.parse().ok().map(AnswerValue::Quadrant),
                Some(QuestionKind::YesNo { .. }) => match value.as_str() {
                    "yes" => Some(AnswerValue::YesNo(true)),
                    "no" => Some(AnswerValue::YesNo(false)),
                    _ => None,
                },
                Some(QuestionKind::Number { .. }) => value.parse().ok().map(AnswerValue::Number),
                Some(_) => Some(AnswerValue::Word(value)),
                None => None,
            };
            match answer {
                Some(value) => TypedCommand::Input(Input::Answer { question: question.to_string(), value }),
                None => unknown(),
            }
        }
        _ => unknown(),
    }
}

/// Progress of the session, and timing of the servo, as text.
fn status(session: &Session, live: &LiveSession) -> String {
    let mut text = match session.stage() {
        Some((_, stage)) => format!("{}: {:.0} s", stage.title, session.stage_seconds()),
        None => "all stages have ended".to_string(),
    };
    if let Some(beats) = live.timing() {
        let us = |d: Duration| d.as_micros();
        let _ = write!(
            text,
            "; {} ticks, late {} / {} / {} µs (p50 / p99 / max), {} missed, {} dropped",
            beats.ticks,
            us(beats.late_p50),
            us(beats.late_p99),
            us(beats.late_max),
            beats.missed,
            beats.dropped_events
        );
    }
    if let Some(touch) = live.latest_step().and_then(|step| step.touch) {
        let _ = write!(text, "; {:.2} N on tissue {}", touch.spring, touch.label.0);
    }
    text
}
