//! Link between two hands: within one process, or over the local network between two machines.
//!
//! Takes the position of this hand. Gives the last position of the other hand and its age. Never waits: each end
//! accesses two slots in which the newest value wins; over the network a thread exchanges them as UDP datagrams, a
//! thousand per second.
//!
//! Over the network, incoming data moves a hand. Both ends therefore share a key, and every datagram carries a
//! message authentication code (HMAC-SHA-256): datagrams from elsewhere, altered, late or out of order are dropped
//! and counted.

use crate::coupling::DelayedPosition;
use crate::realtime;
use hmac::{Hmac, KeyInit, Mac};
use sha2::Sha256;
use std::hash::{BuildHasher, Hasher, RandomState};
use std::io;
use std::net::{SocketAddr, ToSocketAddrs, UdpSocket};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};
use typodont_core::frame::{Quat, Vec3};
use typodont_core::mailbox::SeqLock;

/// State of one hand as sent to the other end. World space, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinkedHand {
    pub position: Vec3,
    pub orientation: Quat,
    pub buttons: u32,
    /// The hand asks the other one to follow it.
    pub is_leading: bool,
}

/// Words of a hand in a slot: 3 + 4 floats, the buttons, the leading flag, and the time of the position, µs, in two
/// words.
const SLOT_WORDS: usize = 11;

/// One end of a link.
pub struct HandLink {
    ours: Arc<SeqLock<SLOT_WORDS>>,
    theirs: Arc<SeqLock<SLOT_WORDS>>,
    epoch: Instant,
    udp: Option<UdpHandle>,
}

/// Handle of the thread that exchanges the slots over the network.
struct UdpHandle {
    stop: Arc<AtomicBool>,
    rejected: Arc<AtomicU64>,
    thread: Option<JoinHandle<()>>,
}

impl HandLink {
    /// Creates both ends of a link within this process.
    pub fn pair() -> (HandLink, HandLink) {
        let (a, b, epoch) = (Arc::new(SeqLock::new()), Arc::new(SeqLock::new()), Instant::now());
        let end = |ours: &Arc<_>, theirs: &Arc<_>| HandLink {
            ours: Arc::clone(ours),
            theirs: Arc::clone(theirs),
            epoch,
            udp: None,
        };
        (end(&a, &b), end(&b, &a))
    }

    /// Creates the trainee's end over the network: listens at an address for a peer with the same key.
    ///
    /// # Errors
    ///
    /// Returns an error if the address cannot be bound or no thread can be started.
    pub fn listen(at: impl ToSocketAddrs, key: &str) -> io::Result<(HandLink, SocketAddr)> {
        let socket = UdpSocket::bind(at)?;
        let address = socket.local_addr()?;
        Ok((HandLink::over_udp(socket, None, key)?, address))
    }

    /// Creates the instructor's end over the network: sends to the trainee's address.
    ///
    /// # Errors
    ///
    /// Returns an error if the address cannot be resolved, no socket can be opened, or no thread can be started.
    pub fn connect(to: impl ToSocketAddrs, key: &str) -> io::Result<HandLink> {
        let none = || io::Error::new(io::ErrorKind::NotFound, "no address");
        let to = to.to_socket_addrs()?.next().ok_or_else(none)?;
        let from: SocketAddr = if to.is_ipv4() { ([0, 0, 0, 0], 0).into() } else { ([0u16; 8], 0).into() };
        HandLink::over_udp(UdpSocket::bind(from)?, Some(to), key)
    }

    fn over_udp(socket: UdpSocket, peer: Option<SocketAddr>, key: &str) -> io::Result<HandLink> {
        socket.set_read_timeout(Some(SEND_INTERVAL))?;
        let (ours, theirs, epoch) = (Arc::new(SeqLock::new()), Arc::new(SeqLock::new()), Instant::now());
        let (stop, rejected) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicU64::new(0)));
        let mut worker = UdpWorker {
            socket,
            peer,
            key: key.as_bytes().to_vec(),
            ours: ours.clone(),
            theirs: theirs.clone(),
            epoch,
            rejected: rejected.clone(),
            // Random for every session, seeded by the system.
            session_nonce: RandomState::new().build_hasher().finish() as u32 | 1,
            peer_nonce: 0,
            sequence: 0,
            last_datagram: None,
            one_way_delay: FIRST_DELAY,
        };
        let should_stop = stop.clone();
        let thread = thread::Builder::new().name("link".into()).spawn(move || worker.run(&should_stop))?;
        Ok(HandLink { ours, theirs, epoch, udp: Some(UdpHandle { stop, rejected, thread: Some(thread) }) })
    }

    /// Publishes the state of this hand.
    pub fn publish(&self, hand: &LinkedHand) {
        self.ours.write(encode_words(hand, self.epoch.elapsed()));
    }

    /// Returns the last state of the other hand and its age, s; `None` before the first one.
    pub fn latest(&self) -> Option<(LinkedHand, f32)> {
        let (hand, at) = decode_words(self.theirs.read()?.1);
        Some((hand, self.epoch.elapsed().saturating_sub(at).as_secs_f32()))
    }

    /// Returns the position of the other hand for a [`crate::Coupling`] if `takes_part` accepts its state.
    pub fn remote_position(&self, takes_part: impl Fn(&LinkedHand) -> bool) -> Option<DelayedPosition> {
        let (hand, delay) = self.latest()?;
        takes_part(&hand).then_some(DelayedPosition { position: hand.position, delay })
    }

    /// Returns the number of datagrams dropped: not authenticated, altered, or out of order.
    pub fn rejected_count(&self) -> u64 {
        self.udp.as_ref().map_or(0, |c| c.rejected.load(Ordering::Relaxed))
    }
}

impl Drop for UdpHandle {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Release);
        if let Some(thread) = self.thread.take() {
            // The thread checks the flag every millisecond. A panic in it needs no handling.
            let _ = thread.join();
        }
    }
}

const SEND_INTERVAL: Duration = Duration::from_millis(1);

/// Delay assumed before the first round trip has been measured, s: that of a bad network.
const FIRST_DELAY: f32 = 0.05;

/// Silence after which a peer may be replaced by another one that has the key.
const PEER_TIMEOUT: Duration = Duration::from_secs(2);

/// Length of a datagram; for the layout see `content/devices/link.md`.
const DATAGRAM_LENGTH: usize = 80;
const MAGIC: [u8; 4] = *b"TYPH";
const PROTOCOL: u8 = 1;
/// Bytes of the authentication code at the end: 64 bits cannot be guessed at a thousand attempts per second.
const MAC_LENGTH: usize = 8;

struct UdpWorker {
    socket: UdpSocket,
    peer: Option<SocketAddr>,
    key: Vec<u8>,
    ours: Arc<SeqLock<SLOT_WORDS>>,
    theirs: Arc<SeqLock<SLOT_WORDS>>,
    epoch: Instant,
    rejected: Arc<AtomicU64>,
    /// Random number that names this session: a peer that sends it back is answering us, and answering now.
    session_nonce: u32,
    peer_nonce: u32,
    sequence: u32,
    last_datagram: Option<ReceivedDatagram>,
    /// Time in transit of a datagram, s: half of a round trip; grows at once and shrinks slowly.
    one_way_delay: f32,
}

/// The newest datagram of the other end.
#[derive(Clone, Copy)]
struct ReceivedDatagram {
    sequence: u32,
    /// Clock of the sender, µs.
    sent_us: u64,
    at: Instant,
}

impl UdpWorker {
    fn run(&mut self, should_stop: &AtomicBool) {
        // A refusal shows in the delay.
        let _ = realtime::raise_thread_priority();
        let mut send_at = Instant::now();
        let mut bytes = [0; DATAGRAM_LENGTH + 1];
        while !should_stop.load(Ordering::Acquire) {
            if Instant::now() >= send_at {
                send_at = (send_at + SEND_INTERVAL).max(Instant::now());
                self.send();
            }
            match self.socket.recv_from(&mut bytes) {
                Ok((length, from)) => {
                    if self.receive(&bytes[..length], from).is_none() {
                        self.rejected.fetch_add(1, Ordering::Relaxed);
                    }
                }
                Err(error) if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut) => {}
                // The peer is not listening yet, or the network is down: the other end sees silence and releases the
                // hand.
                Err(_) => thread::sleep(SEND_INTERVAL),
            }
        }
    }

    fn send(&mut self) {
        if let Some(peer) = self.peer {
            self.send_to(peer, self.peer_nonce);
        }
    }

    fn send_to(&mut self, peer: SocketAddr, peer_nonce: u32) {
        let Some((_, words)) = self.ours.read() else { return };
        let (hand, _) = decode_words(words);
        self.sequence = self.sequence.wrapping_add(1);
        let (echo_us, echo_age_us) = match self.last_datagram {
            Some(last) => (last.sent_us, last.at.elapsed().as_micros() as u32),
            None => (0, 0),
        };
        let mut bytes = [0; DATAGRAM_LENGTH];
        bytes[..4].copy_from_slice(&MAGIC);
        bytes[4..8].copy_from_slice(&[PROTOCOL, u8::from(hand.is_leading), 0, 0]);
        bytes[8..12].copy_from_slice(&self.sequence.to_le_bytes());
        bytes[12..20].copy_from_slice(&(self.epoch.elapsed().as_micros() as u64).to_le_bytes());
        bytes[20..28].copy_from_slice(&echo_us.to_le_bytes());
        bytes[28..32].copy_from_slice(&echo_age_us.to_le_bytes());
        bytes[64..68].copy_from_slice(&self.session_nonce.to_le_bytes());
        bytes[68..72].copy_from_slice(&peer_nonce.to_le_bytes());
        bytes[32..36].copy_from_slice(&hand.buttons.to_le_bytes());
        let numbers = hand.position.to_array().into_iter().chain(hand.orientation.to_array());
        for (to, number) in bytes[36..64].chunks_exact_mut(4).zip(numbers) {
            to.copy_from_slice(&number.to_le_bytes());
        }
        let mac = self.mac(&bytes[..DATAGRAM_LENGTH - MAC_LENGTH]);
        bytes[DATAGRAM_LENGTH - MAC_LENGTH..].copy_from_slice(&mac);
        // A datagram that cannot be sent is treated as lost.
        let _ = self.socket.send_to(&bytes, peer);
    }

    /// Processes a datagram; `None` if it is rejected.
    fn receive(&mut self, bytes: &[u8], from: SocketAddr) -> Option<()> {
        let bytes: &[u8; DATAGRAM_LENGTH] = bytes.try_into().ok()?;
        if bytes[..4] != MAGIC || bytes[4] != PROTOCOL {
            return None;
        }
        self.hmac(&bytes[..DATAGRAM_LENGTH - MAC_LENGTH])
            .verify_truncated_left(&bytes[DATAGRAM_LENGTH - MAC_LENGTH..])
            .ok()?;
        let word = |at: usize| u32::from_le_bytes(std::array::from_fn(|i| bytes[at + i]));
        let long = |at: usize| u64::from(word(at)) | u64::from(word(at + 4)) << 32;
        let number = |i: usize| f32::from_bits(word(36 + 4 * i));
        let (sequence, now) = (word(8), Instant::now());
        if word(68) != self.session_nonce {
            // The nonce is not that of this session: the peer does not know it yet, or the datagram is a replay of an
            // old session. Either way the answer contains the nonce, and no hand moves.
            self.send_to(from, word(64));
            return Some(());
        }
        if let Some(last) = self.last_datagram.filter(|last| last.at.elapsed() < PEER_TIMEOUT) {
            // Only one peer at a time, and only datagrams newer than the newest.
            let is_newer = sequence.wrapping_sub(last.sequence).cast_signed() > 0;
            if self.peer != Some(from) || !is_newer {
                return None;
            }
        }
        (self.peer, self.peer_nonce) = (Some(from), word(64));
        self.last_datagram = Some(ReceivedDatagram { sequence, sent_us: long(12), at: now });
        self.measure_round_trip(long(20), word(28));
        let hand = LinkedHand {
            position: Vec3::new(number(0), number(1), number(2)),
            orientation: Quat::from_xyzw(number(3), number(4), number(5), number(6)),
            buttons: word(32),
            is_leading: bytes[5] & 1 == 1,
        };
        if !hand.position.is_finite() || !hand.orientation.is_finite() {
            return None;
        }
        let was_there = self.epoch.elapsed().saturating_sub(Duration::from_secs_f32(self.one_way_delay));
        self.theirs.write(encode_words(&hand, was_there));
        Some(())
    }

    /// Updates the one-way delay from a round trip: our own time stamp, echoed with the time it spent at the other end.
    fn measure_round_trip(&mut self, echo_us: u64, echo_age_us: u32) {
        if echo_us == 0 {
            return;
        }
        let now_us = self.epoch.elapsed().as_micros() as u64;
        let round_us = now_us.saturating_sub(echo_us).saturating_sub(u64::from(echo_age_us));
        let one_way = (0.5e-6 * round_us as f64) as f32;
        // A longer delay counts at once, a shorter one gradually: the coupling must never underestimate the delay.
        self.one_way_delay = one_way.max(self.one_way_delay + (one_way - self.one_way_delay) * 0.01).clamp(0.0, 1.0);
    }

    fn hmac(&self, bytes: &[u8]) -> Hmac<Sha256> {
        let mut hmac = Hmac::<Sha256>::new_from_slice(&self.key).expect("HMAC takes keys of any length");
        hmac.update(bytes);
        hmac
    }

    fn mac(&self, bytes: &[u8]) -> [u8; MAC_LENGTH] {
        let whole = self.hmac(bytes).finalize().into_bytes();
        std::array::from_fn(|i| whole[i])
    }
}

fn encode_words(hand: &LinkedHand, at: Duration) -> [u32; SLOT_WORDS] {
    let (p, q) = (hand.position, hand.orientation);
    let [a, b, c, d, e, f, g] = [p.x, p.y, p.z, q.x, q.y, q.z, q.w].map(f32::to_bits);
    let us = at.as_micros() as u64;
    [a, b, c, d, e, f, g, hand.buttons, u32::from(hand.is_leading), us as u32, (us >> 32) as u32]
}

fn decode_words(words: [u32; SLOT_WORDS]) -> (LinkedHand, Duration) {
    let [a, b, c, d, e, f, g, ..] = words.map(f32::from_bits);
    let hand = LinkedHand {
        position: Vec3::new(a, b, c),
        orientation: Quat::from_xyzw(d, e, f, g),
        buttons: words[7],
        is_leading: words[8] == 1,
    };
    (hand, Duration::from_micros(u64::from(words[9]) | u64::from(words[10]) << 32))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hand(x: f32, is_leading: bool) -> LinkedHand {
        LinkedHand { position: Vec3::new(x, 2.0, -3.0), orientation: Quat::IDENTITY, buttons: 5, is_leading }
    }

    fn eventually(mut holds: impl FnMut() -> bool) -> bool {
        let start = Instant::now();
        while start.elapsed() < Duration::from_secs(10) {
            if holds() {
                return true;
            }
            thread::sleep(Duration::from_millis(1));
        }
        false
    }

    #[test]
    fn two_ends_see_each_other() {
        let (a, b) = HandLink::pair();
        assert_eq!(a.latest(), None);
        a.publish(&hand(1.0, true));
        let (seen, delay) = b.latest().unwrap();
        assert_eq!(seen, hand(1.0, true));
        assert!(delay < 1.0);
        assert_eq!(b.remote_position(|m| !m.is_leading), None);
    }

    #[test]
    fn two_ends_see_each_other_over_the_network() {
        let (here, address) = HandLink::listen("127.0.0.1:0", "secret").unwrap();
        let there = HandLink::connect(address, "secret").unwrap();
        here.publish(&hand(1.0, false));
        there.publish(&hand(2.0, true));
        assert!(eventually(|| here.latest().is_some_and(|(m, _)| m == hand(2.0, true))));
        assert!(eventually(|| there.latest().is_some_and(|(m, _)| m == hand(1.0, false))));
        // The initial delay is 50 ms; on one machine the measured one is shorter.
        assert!(eventually(|| here.latest().is_some_and(|(_, delay)| delay < 0.02)));
    }

    #[test]
    fn a_peer_without_the_key_moves_no_hand() {
        let (here, address) = HandLink::listen("127.0.0.1:0", "secret").unwrap();
        let stranger = HandLink::connect(address, "guess").unwrap();
        here.publish(&hand(1.0, false));
        stranger.publish(&hand(9.0, true));
        UdpSocket::bind("127.0.0.1:0").unwrap().send_to(b"nonsense", address).unwrap();
        assert!(eventually(|| here.rejected_count() > 20));
        assert_eq!(here.latest(), None);
    }
}
