//! HID devices that something else opens, reads and writes: a browser passes their reports to a page, one by one.
//!
//! Takes the reports of a [`ForwardedDevice`] as they come. Gives them to a driver as the system's devices give theirs, and
//! back what the driver sends. Never waits, and keeps the newest reports if nobody reads them.

use super::{HidDeviceInfo, HidMatch, REPORT_MAX, Transport};
use crate::OpenError;
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use typodont_core::device::DeviceError;

/// Reports kept in each direction: those of a second at 1 kHz, for a driver that tries again twice a second.
pub(crate) const QUEUE_MAX: usize = 1024;

/// Devices that are connected now.
static CONNECTED: Mutex<Vec<(HidDeviceInfo, Arc<Mutex<ReportQueues>>)>> = Mutex::new(Vec::new());

/// A report with its id byte, or without one from a device whose reports have no ids.
#[derive(Clone, Copy)]
struct QueuedReport {
    bytes: [u8; REPORT_MAX],
    length: usize,
    /// True if a later report takes the place of this one.
    is_replaceable: bool,
}

impl QueuedReport {
    /// The report, or as much of it as any supported device sends.
    fn new(parts: [&[u8]; 2]) -> QueuedReport {
        let mut report = QueuedReport { bytes: [0; REPORT_MAX], length: 0, is_replaceable: false };
        for byte in parts.into_iter().flatten().take(REPORT_MAX) {
            report.bytes[report.length] = *byte;
            report.length += 1;
        }
        report
    }
}

/// Queues of reports of one device.
struct ReportQueues {
    incoming: VecDeque<QueuedReport>,
    outgoing: VecDeque<QueuedReport>,
    is_connected: bool,
}

fn push(queue: &mut VecDeque<QueuedReport>, report: QueuedReport) {
    if queue.len() == QUEUE_MAX {
        queue.pop_front();
    }
    queue.push_back(report);
}

/// The queues; a thread that panicked leaves them whole.
fn lock<T>(queues: &Mutex<T>) -> MutexGuard<'_, T> {
    queues.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A connected device, as seen by whoever reads and writes it. When it is dropped, the device counts as unplugged.
pub struct ForwardedDevice {
    queues: Arc<Mutex<ReportQueues>>,
}

impl ForwardedDevice {
    /// Announces a device to the drivers.
    pub fn connect(device: HidDeviceInfo) -> ForwardedDevice {
        let (incoming, outgoing) = (VecDeque::with_capacity(QUEUE_MAX), VecDeque::with_capacity(QUEUE_MAX));
        let queues = Arc::new(Mutex::new(ReportQueues { incoming, outgoing, is_connected: true }));
        lock(&CONNECTED).push((device, queues.clone()));
        ForwardedDevice { queues }
    }

    /// Passes on a report of the device. `id` is 0 for a device whose reports have no ids.
    pub fn deliver(&self, id: u8, report: &[u8]) {
        let id_byte: &[u8] = if id == 0 { &[] } else { &[id] };
        push(&mut lock(&self.queues).incoming, QueuedReport::new([id_byte, report]));
    }

    /// Calls `send` with the id and the bytes of the next report to the device, if there is one.
    pub fn send_next(&self, send: impl FnOnce(u8, &[u8])) {
        // Not locked while `send` runs.
        let next = lock(&self.queues).outgoing.pop_front();
        if let Some((id, bytes)) = next.as_ref().and_then(|report| report.bytes[..report.length].split_first()) {
            send(*id, bytes);
        }
    }
}

impl Drop for ForwardedDevice {
    fn drop(&mut self) {
        lock(&self.queues).is_connected = false;
        lock(&CONNECTED).retain(|(_, queues)| !Arc::ptr_eq(queues, &self.queues));
    }
}

/// Lists the connected devices that match one of `kinds`.
///
/// # Errors
///
/// Never; the system's devices may fail to be listed.
pub fn find(kinds: &[HidMatch]) -> Result<Vec<HidDeviceInfo>, OpenError> {
    let connected = lock(&CONNECTED);
    let devices = connected.iter().map(|(device, _)| device);
    Ok(devices.filter(|device| kinds.iter().any(|kind| kind.matches(device))).cloned().collect())
}

/// Opens a device returned by [`find`].
///
/// # Errors
///
/// Returns an error if it was unplugged.
pub fn open(device: &HidDeviceInfo) -> Result<ForwardedTransport, OpenError> {
    let connected = lock(&CONNECTED);
    let queues = connected.iter().find(|(connected, _)| connected == device).map(|(_, queues)| queues.clone());
    let gone = || OpenError::new(format!("{} was unplugged", device.title), "plug it in again");
    queues.map(|queues| ForwardedTransport { queues }).ok_or_else(gone)
}

/// The driver's end of a device.
pub struct ForwardedTransport {
    queues: Arc<Mutex<ReportQueues>>,
}

impl Transport for ForwardedTransport {
    fn read(&mut self, report: &mut [u8], _wait: Duration) -> Result<usize, DeviceError> {
        let mut queues = lock(&self.queues);
        match queues.incoming.pop_front() {
            Some(next) => {
                let length = next.length.min(report.len());
                report[..length].copy_from_slice(&next.bytes[..length]);
                Ok(length)
            }
            None if queues.is_connected => Ok(0),
            None => Err(DeviceError::Lost { why: "it was unplugged", code: 0 }),
        }
    }

    fn write(&mut self, report: &[u8]) -> Result<(), DeviceError> {
        push(&mut lock(&self.queues).outgoing, QueuedReport::new([report, &[]]));
        Ok(())
    }

    fn write_newest(&mut self, report: &[u8]) -> Result<(), DeviceError> {
        let report = QueuedReport { is_replaceable: true, ..QueuedReport::new([report, &[]]) };
        let mut queues = lock(&self.queues);
        match queues.outgoing.back_mut().filter(|last| last.is_replaceable) {
            Some(last) => *last = report,
            None => push(&mut queues.outgoing, report),
        }
        Ok(())
    }

    fn can_wait(&self) -> bool {
        false
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::plugged;
    use super::*;

    fn device(serial: &str) -> HidDeviceInfo {
        HidDeviceInfo { serial: serial.into(), ..plugged(0x16c0, 0xfeed, (1, 8)) }
    }

    const KIND: HidMatch = HidMatch { vendor: 0x16c0, products: &[0xfeed], usage: None };

    #[test]
    fn reports_pass_in_both_directions_until_the_device_is_unplugged() {
        let forwarded = ForwardedDevice::connect(device("passes"));
        let mut transport = open(&device("passes")).unwrap();
        let mut report = [0; REPORT_MAX];
        assert_eq!(transport.read(&mut report, Duration::from_secs(9)), Ok(0));
        forwarded.deliver(0, &[7, 8]);
        forwarded.deliver(3, &[9]);
        assert_eq!((transport.read(&mut report, Duration::ZERO), &report[..2]), (Ok(2), &[7, 8][..]));
        assert_eq!((transport.read(&mut report, Duration::ZERO), &report[..2]), (Ok(2), &[3, 9][..]));
        transport.write(&[4, 1, 2]).unwrap();
        transport.write_newest(&[0, 1]).unwrap();
        transport.write_newest(&[0, 2]).unwrap();
        let mut sent = Vec::new();
        for _ in 0..3 {
            forwarded.send_next(|id, bytes| sent.push((id, bytes.to_vec())));
        }
        assert_eq!(sent, [(4, vec![1, 2]), (0, vec![2])], "of two commands that wait, the older is obsolete");
        drop(forwarded);
        assert!(transport.read(&mut report, Duration::ZERO).is_err());
        assert!(open(&device("passes")).is_err());
        assert!(!find(&[KIND]).unwrap().contains(&device("passes")));
    }

    #[test]
    fn the_newest_reports_are_kept() {
        let forwarded = ForwardedDevice::connect(device("newest"));
        assert!(find(&[KIND]).unwrap().contains(&device("newest")));
        let mut transport = open(&device("newest")).unwrap();
        for number in 0..=QUEUE_MAX as u16 {
            forwarded.deliver(0, &number.to_le_bytes());
        }
        forwarded.deliver(0, &[1; 2 * REPORT_MAX]);
        let mut report = [0; REPORT_MAX];
        assert_eq!((transport.read(&mut report, Duration::ZERO), &report[..2]), (Ok(2), &[2, 0][..]));
    }
}
