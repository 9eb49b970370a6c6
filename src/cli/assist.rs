//! `typodont assist`: connects the instructor's device, on another computer than the trainee's.

use super::link_key::{self, TypedKey};
use super::{CliError, live, print_line};
use clap::Args;
use std::path::PathBuf;
use std::sync::atomic::Ordering;
use std::sync::mpsc::TryRecvError;
use std::time::Duration;
use typodont_devices::HandLink;
use typodont_devices::servo::SecondHandServo;
use typodont_lesson as lesson;

#[derive(Args)]
pub struct Arguments {
    /// Device of the instructor; see `typodont devices`
    #[arg(long, value_name = "NAME[:WHICH]", required_unless_present = "new_key")]
    device: Option<String>,
    /// Address at which the trainee's program listens, as it printed at the start
    #[arg(long, value_name = "HOST:PORT", required_unless_present = "new_key")]
    to: Option<String>,
    /// File with the key that was given to the trainee's program; by default the key is taken from TYPODONT_LINK_KEY
    #[arg(long, value_name = "FILE")]
    key_file: Option<PathBuf>,
    /// The key itself; other users of this computer can read it there, so prefer --key-file
    #[arg(long, value_name = "KEY", conflicts_with = "key_file")]
    key: Option<String>,
    /// Write a new random key to a file that only you can read, and end; both computers need the same file
    #[arg(long, value_name = "FILE", conflicts_with_all = ["device", "to", "key", "key_file"])]
    new_key: Option<PathBuf>,
}

/// Poll interval for events.
const LISTEN_EVERY: Duration = Duration::from_millis(10);

pub fn run(arguments: &Arguments) -> Result<(), CliError> {
    let Arguments { device, to, key, key_file, new_key } = arguments;
    if let Some(path) = new_key {
        link_key::write_new(path)?;
        return print_line(format!(
            "{}: a new key; give it to both computers by --key-file and --second-key-file",
            path.display()
        ));
    }
    let (Some(device), Some(to)) = (device, to) else {
        return Err(CliError::misuse("--device and --to are required"));
    };
    let typed = key.as_ref().map(|key| TypedKey { option: "--key", key });
    let key = &link_key::read(key_file.as_deref(), typed, "--key-file")?;
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
