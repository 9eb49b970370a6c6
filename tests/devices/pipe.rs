//! HID reports in memory: two bounded queues, as deep as the kernel's, with a transport at one end and a firmware at the other.

use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TryRecvError, sync_channel};
use std::time::Duration;
use typodont_core::device::DeviceError;
use typodont_devices::hid::Transport;

/// Reports that hidraw queues; what comes when it is full is lost.
const QUEUE: usize = 64;

/// A cable between a program and a device; it is pulled by dropping either end.
pub fn cable() -> (ProgramEnd, DeviceEnd) {
    let (to_device, from_program) = sync_channel(QUEUE);
    let (to_program, from_device) = sync_channel(QUEUE);
    (ProgramEnd { to_device, from_device }, DeviceEnd { to_program, from_program })
}

pub struct ProgramEnd {
    to_device: SyncSender<Vec<u8>>,
    from_device: Receiver<Vec<u8>>,
}

pub struct DeviceEnd {
    to_program: SyncSender<Vec<u8>>,
    from_program: Receiver<Vec<u8>>,
}

const PULLED: DeviceError = DeviceError::Lost { why: "reading from it failed; is it plugged in?", code: 5 };

impl Transport for ProgramEnd {
    fn read(&mut self, report: &mut [u8], wait: Duration) -> Result<usize, DeviceError> {
        let bytes = match wait.is_zero() {
            true => match self.from_device.try_recv() {
                Ok(bytes) => bytes,
                Err(TryRecvError::Empty) => return Ok(0),
                Err(TryRecvError::Disconnected) => return Err(PULLED),
            },
            false => match self.from_device.recv_timeout(wait) {
                Ok(bytes) => bytes,
                Err(RecvTimeoutError::Timeout) => return Ok(0),
                Err(RecvTimeoutError::Disconnected) => return Err(PULLED),
            },
        };
        let length = bytes.len().min(report.len());
        report[..length].copy_from_slice(&bytes[..length]);
        Ok(length)
    }

    fn write(&mut self, report: &[u8]) -> Result<(), DeviceError> {
        match self.to_device.try_send(report.to_vec()) {
            Err(std::sync::mpsc::TrySendError::Disconnected(_)) => Err(PULLED),
            // A device that does not take its reports loses them.
            _ => Ok(()),
        }
    }
}

impl DeviceEnd {
    pub fn send(&self, report: &[u8]) {
        let _ = self.to_program.try_send(report.to_vec());
    }

    /// The next report of the program, with its id byte; `Err` when the program has closed.
    pub fn try_receive(&self) -> Result<Option<Vec<u8>>, ()> {
        match self.from_program.try_recv() {
            Ok(report) => Ok(Some(report)),
            Err(TryRecvError::Empty) => Ok(None),
            Err(TryRecvError::Disconnected) => Err(()),
        }
    }

    pub fn receive(&self, wait: Duration) -> Option<Vec<u8>> {
        self.from_program.recv_timeout(wait).ok()
    }
}

#[test]
fn the_newest_report_wins_and_none_is_no_end() {
    // Aim: a reader that fell behind catches up at once; a time-out is no end, a pulled cable is. Method: a full queue.
    let (mut program, device) = cable();
    let mut report = [0; 65];
    assert_eq!(program.read_newest(&mut report, Duration::from_millis(1)), Ok(0));
    (0..40u8).for_each(|n| device.send(&[n; 64]));
    assert_eq!(program.read_newest(&mut report, Duration::from_millis(1)), Ok(64));
    assert_eq!(report[0], 39);
    assert_eq!(program.read_newest(&mut report, Duration::ZERO), Ok(0));
    drop(device);
    assert_eq!(program.read_newest(&mut report, Duration::ZERO), Err(PULLED));
}
