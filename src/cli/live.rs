//! An exercise with a device in somebody's hand, at a terminal: what is asked is printed, what is typed is an answer.
//!
//! Takes an open device and lines of text. Gives a recorded session. The window of the desktop program says the same things
//! in pictures.

use super::say;
use crate::lesson::{Failed, Held, Lesson, Prepared, Recorded, SecondHand};
use crate::scenario::{QuestionKind, Scenario};
use crate::session::{Answer, Effect, Heard, Input, Live, Noted, Session, Sign};
use crate::sim::{AssistNews, Command};
use std::fmt::Write;
use std::io::BufRead;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Receiver, TryRecvError};
use std::time::{Duration, Instant};

/// The device a person holds, and another hand if one joins.
pub struct Hands {
    pub first: Held,
    pub second: Option<SecondHand>,
}

/// How often letters are fetched: a person at a terminal sees nothing faster.
const LISTEN_EVERY: Duration = Duration::from_millis(4);

/// How often a device that is gone is looked for.
const LOOK_EVERY: Duration = Duration::from_millis(500);

/// Plays a prepared lesson to its end.
pub fn play(prepared: Prepared, hands: Hands) -> Result<Recorded, Failed> {
    let Hands { first: Held { device, driver, argument, .. }, second } = hands;
    if let Some(address) = second.as_ref().and_then(SecondHand::address) {
        speak(format!("a second hand may join at {address}: typodont assist --device NAME --to {address} --key …"));
    }
    let lines = typed_lines();
    let is_interrupted = interruptions();
    let (mut lesson, heard) = prepared.begin(device, second)?;
    tell(&heard, lesson.session());
    let mut looked = Instant::now();
    let mut is_listening = true;
    while !lesson.session().is_complete() {
        std::thread::sleep(LISTEN_EVERY);
        let heard = lesson.listen()?;
        tell(&heard, lesson.session());
        while let Some(news) = lesson.next_of_second() {
            tell_of_second(news);
        }
        if lesson.live().is_waiting() && looked.elapsed() > LOOK_EVERY {
            looked = Instant::now();
            if let Ok(device) = driver.open(argument.as_deref()) {
                speak(match lesson.go_on(device)? {
                    true => "the device is back; take the instrument out of the tooth, then go on",
                    false => "this is another device than the session began with; plug that one in again",
                });
            }
        }
        if is_interrupted.swap(false, Ordering::Relaxed) {
            say_to(&mut lesson, &Input::Abort)?;
            break;
        }
        match lines.try_recv() {
            Ok(line) => match understood(&line, lesson.session(), lesson.live()) {
                Said::Input(input) => say_to(&mut lesson, &input)?,
                Said::Pause(is_paused) => lesson.pause(is_paused),
                Said::End if lesson.session().are_stages_over() => break,
                Said::End => speak("the exercise is not over; abort ends it before its time"),
                Said::Show(text) => speak(text),
                Said::Nothing => {}
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

fn say_to(lesson: &mut Lesson, input: &Input) -> Result<(), Failed> {
    let heard = lesson.say(input)?;
    tell(&heard, lesson.session());
    Ok(())
}

/// Whether somebody asked the program to stop (Ctrl-C, or the system's word for it): the session is aborted then, its hand
/// let go and its bundle made.
pub fn interruptions() -> Arc<AtomicBool> {
    let is_asked = Arc::new(AtomicBool::new(false));
    let asked = is_asked.clone();
    // Where it cannot be caught, the program ends as it would have; the device lets go when no force comes any more.
    let _ = ctrlc::set_handler(move || asked.store(true, Ordering::Relaxed));
    is_asked
}

/// Lines as they are typed; the channel closes when there will be no more.
pub fn typed_lines() -> Receiver<String> {
    let (post, lines) = mpsc::channel();
    std::thread::spawn(move || {
        for line in std::io::stdin().lock().lines().map_while(Result::ok) {
            if post.send(line).is_err() {
                break;
            }
        }
    });
    lines
}

/// Prints; a terminal that is gone does not end a session.
pub fn speak(text: impl std::fmt::Display) {
    let _ = say(text);
}

fn tell(heard: &[Heard], session: &Session) {
    for one in heard {
        match one {
            Heard::Effect(Effect::StageStarted { stage }) => speak(stage_text(session.scenario(), *stage)),
            Heard::Effect(Effect::StageEnded { .. }) => speak("this stage is over\n"),
            Heard::Effect(Effect::StagesOver) => speak(questionnaire_text(session.scenario())),
            Heard::Effect(Effect::Refused { why }) => speak(format!("not taken: {why}")),
            Heard::Effect(Effect::Answered { .. }) => speak("noted"),
            Heard::Effect(Effect::Charted { note, is_there, .. }) => speak(match note.what {
                Noted::Depth { read, .. } => format!("{}: {read} mm", note.site.code()),
                Noted::Calculus if *is_there => format!("{}: calculus", note.site.code()),
                Noted::Calculus => format!("{}: no calculus", note.site.code()),
            }),
            Heard::Effect(Effect::Tell(Command::Take { instrument })) => {
                speak(format!("in the hand: {}", session.scenario().instruments[*instrument].title));
            }
            Heard::Effect(Effect::Tell(_) | Effect::StepStarted { .. }) => {}
            Heard::Begun(priority) => speak(format!("the servo turns with {priority}")),
            Heard::Device(state) if state.is_ready() => speak("the device is ready"),
            Heard::Device(state) => speak(format!("time stands still: {state}")),
            Heard::Gone(gone) => speak(format!("time stands still: {gone}; plug it in again and the session goes on")),
        }
    }
}

/// Says what happened to the second hand.
pub fn tell_of_second(news: AssistNews) {
    let text = match news {
        AssistNews::Device(state) => format!("the device is {state}"),
        AssistNews::Gone(gone) => format!("{gone}; it stays away until the session is begun anew"),
        AssistNews::First { is_there: true } => "the first hand is there; hold the button to lead it".to_string(),
        AssistNews::First { is_there: false } => "the first hand has fallen silent".to_string(),
        AssistNews::Leading(true) => "leads".to_string(),
        AssistNews::Leading(false) => "follows".to_string(),
    };
    speak(format!("second hand: {text}"));
}

/// What a stage asks for, and the words that answer.
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
        let _ = writeln!(text, "  read              notes the depth where the probe is");
    }
    if stage.chart.calculus {
        let _ = writeln!(text, "  calculus          notes calculus where the instrument is, or takes that back");
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

enum Said {
    Input(Input),
    Pause(bool),
    /// Leaves the rest of the questionnaire.
    End,
    Show(String),
    Nothing,
}

/// What a typed line means.
fn understood(line: &str, session: &Session, live: &Live) -> Said {
    let mut words = line.split_whitespace();
    let scenario = session.scenario();
    let unknown = || Said::Show(format!("not understood: \"{line}\""));
    match (words.next(), words.next()) {
        (None, _) => Said::Nothing,
        (Some("read"), None) => Said::Input(Input::Chart(Sign::Depth)),
        (Some("calculus"), None) => Said::Input(Input::Chart(Sign::Calculus)),
        (Some("done"), None) => Said::Input(Input::Confirm),
        (Some("abort"), None) => Said::Input(Input::Abort),
        (Some("end"), None) => Said::End,
        (Some("pause"), None) => Said::Pause(true),
        (Some("resume"), None) => Said::Pause(false),
        (Some("status"), None) => Said::Show(status(session, live)),
        (Some("take"), Some(name)) => match scenario.instruments.iter().position(|i| i.id == name) {
            Some(instrument) => Said::Input(Input::Take { instrument }),
            None => Said::Show(format!("no instrument is named \"{name}\"")),
        },
        (Some("rate"), Some(item)) => match words.next().and_then(|value| value.parse().ok()) {
            Some(value) => Said::Input(Input::Rate { item: item.to_string(), value }),
            None => unknown(),
        },
        (Some("answer"), Some(question)) => {
            let value = words.collect::<Vec<_>>().join(" ");
            let asked = session.stage().and_then(|(_, stage)| stage.ask.iter().find(|q| q.id == question));
            let answer = match asked.map(|q| &q.kind) {
                Some(QuestionKind::QuadrantOf { .. }) => value.parse().ok().map(Answer::Quadrant),
                Some(QuestionKind::YesNo { .. }) => match value.as_str() {
                    "yes" => Some(Answer::YesNo(true)),
                    "no" => Some(Answer::YesNo(false)),
                    _ => None,
                },
                Some(QuestionKind::Number { .. }) => value.parse().ok().map(Answer::Number),
                Some(_) => Some(Answer::Word(value)),
                None => None,
            };
            match answer {
                Some(value) => Said::Input(Input::Answer { question: question.to_string(), value }),
                None => unknown(),
            }
        }
        _ => unknown(),
    }
}

/// Where the session stands, and how its beat is kept.
fn status(session: &Session, live: &Live) -> String {
    let mut text = match session.stage() {
        Some((_, stage)) => format!("{}: {:.0} s", stage.title, session.stage_seconds()),
        None => "the stages are over".to_string(),
    };
    if let Some(beats) = live.beats() {
        let us = |d: Duration| d.as_micros();
        let _ = write!(
            text,
            "; {} ticks, late {} / {} / {} µs (p50 / p99 / max), {} missed, {} dropped",
            beats.ticks,
            us(beats.late_p50),
            us(beats.late_p99),
            us(beats.late_max),
            beats.missed,
            beats.dropped
        );
    }
    if let Some(touch) = live.screen().and_then(|step| step.touch) {
        let _ = write!(text, "; {:.2} N on tissue {}", touch.spring, touch.label.0);
    }
    text
}
