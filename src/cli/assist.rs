//! `typodont assist`: the instructor's hand, on another machine than the trainee's.

use super::{Failure, live};
use crate::device::Link;
use crate::lesson;
use crate::sim::Assist;
use clap::Args;
use std::sync::atomic::Ordering;
use std::sync::mpsc::TryRecvError;
use std::time::Duration;

#[derive(Args)]
pub struct Arguments {
    /// The device of the second hand; see `typodont devices`
    #[arg(long, value_name = "NAME[:WHICH]")]
    device: String,
    /// Where the trainee's program waits, as it said when it began
    #[arg(long, value_name = "HOST:PORT")]
    to: String,
    /// The key that the trainee's program was given
    #[arg(long, value_name = "KEY")]
    key: String,
}

/// How often news are fetched.
const LISTEN_EVERY: Duration = Duration::from_millis(10);

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let Arguments { device, to, key } = arguments;
    let held = lesson::open(device)?;
    let link = Link::connect(to, key).map_err(|e| {
        Failure::Wrong(format!("{to}: no-trainee: {e}; give the address that the trainee's program prints"))
    })?;
    let mut assist = Assist::start(held.device, link).map_err(Failure::Wrong)?;
    live::speak("second hand: follows the first one; hold the button to lead it, type end to leave");
    let lines = live::typed_lines();
    let is_interrupted = live::interruptions();
    while !assist.has_ended() {
        if is_interrupted.load(Ordering::Relaxed) {
            return Ok(());
        }
        tell(&mut assist);
        match lines.try_recv() {
            Ok(line) if line.trim() == "end" => return Ok(()),
            // Without a terminal it stays until the device is gone or the program is stopped.
            Ok(_) | Err(TryRecvError::Disconnected | TryRecvError::Empty) => std::thread::sleep(LISTEN_EVERY),
        }
    }
    tell(&mut assist);
    Err(Failure::Told)
}

/// Says what happened since last asked.
fn tell(assist: &mut Assist) {
    while let Some(news) = assist.next_news() {
        live::tell_of_second(news);
    }
}
