//! `typodont assist`: connects the instructor's device, on another computer than the trainee's.

use super::{CliError, live};
use clap::Args;
use std::sync::atomic::Ordering;
use std::sync::mpsc::TryRecvError;
use std::time::Duration;
use typodont_devices::HandLink;
use typodont_devices::servo::SecondHandServo;
use typodont_lesson as lesson;

#[derive(Args)]
pub struct Arguments {
    /// Device of the instructor; see `typodont devices`
    #[arg(long, value_name = "NAME[:WHICH]")]
    device: String,
    /// Address at which the trainee's program listens, as it printed at the start
    #[arg(long, value_name = "HOST:PORT")]
    to: String,
    /// Key that was given to the trainee's program
    #[arg(long, value_name = "KEY")]
    key: String,
}

/// Poll interval for events.
const LISTEN_EVERY: Duration = Duration::from_millis(10);

pub fn run(arguments: &Arguments) -> Result<(), CliError> {
    let Arguments { device, to, key } = arguments;
    let opened = lesson::open_device(device)?;
    let link = HandLink::connect(to, key).map_err(|e| {
        CliError::Wrong(format!("{to}: no-trainee: {e}; give the address that the trainee's program prints"))
    })?;
    let mut assist = SecondHandServo::start(opened.device, link).map_err(CliError::Wrong)?;
    live::print_best_effort(
        "second device: follows the trainee's device; hold the button to lead it, type end to leave",
    );
    let lines = live::typed_lines();
    let is_interrupted = live::interrupt_flag();
    while !assist.has_ended() {
        if is_interrupted.load(Ordering::Relaxed) {
            return Ok(());
        }
        print_events(&mut assist);
        match lines.try_recv() {
            Ok(line) if line.trim() == "end" => return Ok(()),
            // Without a terminal the command runs until the device is disconnected or the program is stopped.
            Ok(_) | Err(TryRecvError::Disconnected | TryRecvError::Empty) => std::thread::sleep(LISTEN_EVERY),
        }
    }
    print_events(&mut assist);
    Err(CliError::AlreadyReported)
}

/// Prints all events since the last call.
fn print_events(assist: &mut SecondHandServo) {
    while let Some(event) = assist.next_event() {
        live::print_assist_event(event);
    }
}
