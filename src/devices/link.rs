//! Link between two hands: within one process, or over the local network between two machines.
//!
//! Takes the position of this hand. Gives the last position of the other hand and its age. Never waits: each end
//! accesses two slots in which the newest value wins; over the network a thread exchanges them as UDP datagrams, a
//! thousand per second.
//!
//! Over the network, incoming data moves a hand. Both ends therefore share a key ([`crate::link_key`]), and every
//! datagram carries a message authentication code (HMAC-SHA-256) under a key of its direction: a datagram that is sent
//! back to its sender proves nothing. A hand moves only by datagrams that name the receiver's random number of this
//! connection and are newer than the newest: those recorded earlier, altered, late or out of order are dropped and
//! counted. An end draws a new number whenever the other one falls silent, so that no recording is ever valid again.

use crate::coupling::DelayedPosition;
use crate::link_key::DirectionKeys;
use crate::realtime;
use hmac::{Hmac, KeyInit, Mac};
use sha2::Sha256;
use std::io;
use std::net::{SocketAddr, ToSocketAddrs, UdpSocket};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::{self, JoinHandle};
use typodont_core::frame::{Quat, Vec3};
use typodont_core::mailbox::SeqLock;
use web_time::{Duration, Instant};

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
        Ok((HandLink::over_udp(socket, None, key, LinkEnd::Listening)?, address))
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
        HandLink::over_udp(UdpSocket::bind(from)?, Some(to), key, LinkEnd::Connecting)
    }

    fn over_udp(socket: UdpSocket, peer: Option<SocketAddr>, key: &str, end: LinkEnd) -> io::Result<HandLink> {
        socket.set_read_timeout(Some(SEND_INTERVAL))?;
        let (ours, theirs, epoch) = (Arc::new(SeqLock::new()), Arc::new(SeqLock::new()), Instant::now());
        let (stop, rejected) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicU64::new(0)));
        let mut worker = UdpWorker {
            socket,
            peer,
            given_peer: peer,
            end,
            keys: DirectionKeys::derive(key),
            ours: ours.clone(),
            theirs: theirs.clone(),
            epoch,
            rejected: rejected.clone(),
            own_nonce: random_nonce()?,
            peer_nonce: NO_NONCE,
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

/// Silence after which the connection is over: the next one has new random numbers, and may be with another peer that
/// has the key.
const PEER_TIMEOUT: Duration = Duration::from_secs(2);

/// Length of a datagram; for the layout see `content/devices/link.md`.
const DATAGRAM_LENGTH: usize = 116;
const MAGIC: [u8; 4] = *b"TYPH";
const PROTOCOL: u8 = 2;
/// Offset of the authentication code, which covers everything before it.
const MAC_AT: usize = 100;

/// Random number of an end for one connection.
type Nonce = [u8; 16];

/// Stands for the number of an end from which nothing was received yet.
const NO_NONCE: Nonce = [0; 16];

/// Hand of an end that has published none yet.
const NO_HAND: LinkedHand =
    LinkedHand { position: Vec3::NAN, orientation: Quat::IDENTITY, buttons: 0, is_leading: false };

fn random_nonce() -> io::Result<Nonce> {
    let mut nonce = NO_NONCE;
    getrandom::fill(&mut nonce)
        .map_err(|e| io::Error::other(format!("the system's random number generator failed: {e}")))?;
    Ok(nonce)
}

/// Role of an end in a connection over the network. Its number is part of every datagram it sends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum LinkEnd {
    Connecting = 0,
    Listening = 1,
}

impl LinkEnd {
    fn other(self) -> LinkEnd {
        match self {
            LinkEnd::Connecting => LinkEnd::Listening,
            LinkEnd::Listening => LinkEnd::Connecting,
        }
    }
}

struct UdpWorker {
    socket: UdpSocket,
    end: LinkEnd,
    /// Address of the present peer.
    peer: Option<SocketAddr>,
    /// Address that the connecting end was given, to which it returns after silence.
    given_peer: Option<SocketAddr>,
    keys: DirectionKeys,
    ours: Arc<SeqLock<SLOT_WORDS>>,
    theirs: Arc<SeqLock<SLOT_WORDS>>,
    epoch: Instant,
    rejected: Arc<AtomicU64>,
    /// Names this connection: a peer that sends it back is answering this end, and answering now.
    own_nonce: Nonce,
    peer_nonce: Nonce,
    sequence: u64,
    last_datagram: Option<ReceivedDatagram>,
    /// Time in transit of a datagram, s: half of a round trip; grows at once and shrinks slowly.
    one_way_delay: f32,
}

/// The newest datagram of the other end.
#[derive(Clone, Copy)]
struct ReceivedDatagram {
    sequence: u64,
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
            self.end_silent_connection();
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

    /// Forgets a peer that has been silent for too long. Its datagrams, and recordings of them, name a number that is
    /// no longer valid.
    fn end_silent_connection(&mut self) {
        if self.last_datagram.is_none_or(|last| last.at.elapsed() < PEER_TIMEOUT) {
            return;
        }
        // If the generator fails, the next iteration tries again.
        let Ok(nonce) = random_nonce() else { return };
        (self.own_nonce, self.peer_nonce, self.last_datagram) = (nonce, NO_NONCE, None);
        (self.peer, self.one_way_delay) = (self.given_peer, FIRST_DELAY);
    }

    fn send_to(&mut self, peer: SocketAddr, peer_nonce: Nonce) {
        // A hand that is not published any more, because its servo is paused or its device is lost, grows old at the other
        // end, too, and leads no longer. Before the first one, the datagram holds none: an assistant's tool is published only
        // when the assistant's hand is known, and that hand arrives only after an answer.
        let (hand, at) = match self.ours.read() {
            Some((_, words)) => decode_words(words),
            None => (NO_HAND, self.epoch.elapsed()),
        };
        let age_ms = self.epoch.elapsed().saturating_sub(at).as_millis().min(u128::from(u8::MAX)) as u8;
        // At a thousand per second it does not overflow.
        self.sequence += 1;
        let (echo_us, echo_age_us) = match self.last_datagram {
            Some(last) => (last.sent_us, last.at.elapsed().as_micros() as u32),
            None => (0, 0),
        };
        let mut bytes = [0; DATAGRAM_LENGTH];
        bytes[..4].copy_from_slice(&MAGIC);
        bytes[4..8].copy_from_slice(&[PROTOCOL, u8::from(hand.is_leading), self.end as u8, age_ms]);
        bytes[8..16].copy_from_slice(&self.sequence.to_le_bytes());
        bytes[16..24].copy_from_slice(&(self.epoch.elapsed().as_micros() as u64).to_le_bytes());
        bytes[24..32].copy_from_slice(&echo_us.to_le_bytes());
        bytes[32..36].copy_from_slice(&echo_age_us.to_le_bytes());
        bytes[36..40].copy_from_slice(&hand.buttons.to_le_bytes());
        let numbers = hand.position.to_array().into_iter().chain(hand.orientation.to_array());
        for (to, number) in bytes[40..68].chunks_exact_mut(4).zip(numbers) {
            to.copy_from_slice(&number.to_le_bytes());
        }
        bytes[68..84].copy_from_slice(&self.own_nonce);
        bytes[84..100].copy_from_slice(&peer_nonce);
        let mac = self.mac(self.end, &bytes[..MAC_AT]).finalize().into_bytes();
        bytes[MAC_AT..].copy_from_slice(&mac[..DATAGRAM_LENGTH - MAC_AT]);
        // A datagram that cannot be sent is treated as lost.
        let _ = self.socket.send_to(&bytes, peer);
    }

    /// Processes a datagram; `None` if it is rejected.
    fn receive(&mut self, bytes: &[u8], from: SocketAddr) -> Option<()> {
        let bytes: &[u8; DATAGRAM_LENGTH] = bytes.try_into().ok()?;
        let sender = self.end.other();
        if bytes[..4] != MAGIC || bytes[4] != PROTOCOL || bytes[6] != sender as u8 {
            return None;
        }
        self.mac(sender, &bytes[..MAC_AT]).verify_truncated_left(&bytes[MAC_AT..]).ok()?;
        let nonce = |at: usize| -> Nonce { std::array::from_fn(|i| bytes[at + i]) };
        let word = |at: usize| u32::from_le_bytes(std::array::from_fn(|i| bytes[at + i]));
        let long = |at: usize| u64::from(word(at)) | u64::from(word(at + 4)) << 32;
        let number = |i: usize| f32::from_bits(word(40 + 4 * i));
        let (sequence, peer_nonce, now) = (long(8), nonce(68), Instant::now());
        match self.last_datagram {
            // Only one peer at a time, and only datagrams newer than the newest.
            Some(last) => {
                let is_peer = self.peer == Some(from) && self.peer_nonce == peer_nonce;
                if !is_peer || nonce(84) != self.own_nonce || sequence <= last.sequence {
                    return None;
                }
            }
            // The peer does not know this end's number yet, or the datagram is a recording of an earlier connection.
            // Either way the answer contains the number, and no hand moves.
            None if nonce(84) != self.own_nonce => {
                self.send_to(from, peer_nonce);
                return Some(());
            }
            None => {}
        }
        (self.peer, self.peer_nonce) = (Some(from), peer_nonce);
        self.last_datagram = Some(ReceivedDatagram { sequence, sent_us: long(16), at: now });
        self.measure_round_trip(long(24), word(32));
        let hand = LinkedHand {
            position: Vec3::new(number(0), number(1), number(2)),
            orientation: Quat::from_xyzw(number(3), number(4), number(5), number(6)),
            buttons: word(36),
            is_leading: bytes[5] & 1 == 1,
        };
        if hand.position.is_nan() {
            return Some(());
        }
        if !hand.position.is_finite() || !hand.orientation.is_finite() {
            return None;
        }
        let age = Duration::from_secs_f32(self.one_way_delay) + Duration::from_millis(u64::from(bytes[7]));
        let was_there = self.epoch.elapsed().saturating_sub(age);
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

    /// Returns the authentication code of what `sender` sends.
    fn mac(&self, sender: LinkEnd, bytes: &[u8]) -> Hmac<Sha256> {
        let key = match sender {
            LinkEnd::Connecting => &self.keys.of_connecting_end,
            LinkEnd::Listening => &self.keys.of_listening_end,
        };
        let mut hmac = Hmac::<Sha256>::new_from_slice(key).expect("HMAC takes keys of any length");
        hmac.update(bytes);
        hmac
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
        let publish = || {
            here.publish(&hand(1.0, false));
            there.publish(&hand(2.0, true));
        };
        publish();
        assert!(eventually(|| here.latest().is_some_and(|(m, _)| m == hand(2.0, true))));
        assert!(eventually(|| there.latest().is_some_and(|(m, _)| m == hand(1.0, false))));
        // The initial delay is 50 ms; on one machine the measured one is shorter.
        assert!(eventually(|| {
            publish();
            here.latest().is_some_and(|(_, delay)| delay < 0.02)
        }));
    }

    #[test]
    fn an_end_that_has_published_nothing_yet_receives() {
        // Aim: an assistant can join over the network; the first hand's end publishes nothing before it knows the assistant's
        // hand. Method: only the joining end publishes; what it receives meanwhile is no hand.
        let (here, at) = HandLink::listen("127.0.0.1:0", "a key of ours").unwrap();
        let there = HandLink::connect(at, "a key of ours").unwrap();
        let arrived = eventually(|| {
            there.publish(&hand(3.0, false));
            here.latest().is_some_and(|(hand, delay)| hand.position.x == 3.0 && delay < 0.1)
        });
        assert!(arrived);
        assert_eq!(there.latest(), None);
        assert_eq!((here.rejected_count(), there.rejected_count()), (0, 0));
    }

    #[test]
    fn a_hand_that_is_not_published_any_more_leads_no_longer() {
        // Aim: a device that is not ready, or a pause, does not hold the other hand at the last place. Method: one end stops
        // to publish, while its datagrams go on.
        let (here, address) = HandLink::listen("127.0.0.1:0", "secret").unwrap();
        let there = HandLink::connect(address, "secret").unwrap();
        here.publish(&hand(1.0, false));
        assert!(eventually(|| {
            there.publish(&hand(2.0, true));
            here.remote_position(|hand| hand.is_leading).is_some_and(|seen| seen.delay < 0.05)
        }));
        assert!(eventually(|| here.latest().is_some_and(|(_, delay)| delay > 0.2)));
        assert_eq!(here.rejected_count(), 0);
        there.publish(&hand(3.0, true));
        assert!(eventually(|| here.latest().is_some_and(|(seen, _)| seen == hand(3.0, true))), "the link has lasted");
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
    /// Socket of an attacker, who has no key, or of a wire tapper.
    fn socket() -> UdpSocket {
        let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
        socket.set_read_timeout(Some(Duration::from_millis(20))).unwrap();
        socket
    }

    fn receive(socket: &UdpSocket) -> Option<(Vec<u8>, SocketAddr)> {
        let mut bytes = [0; 2048];
        socket.recv_from(&mut bytes).ok().map(|(length, from)| (bytes[..length].to_vec(), from))
    }

    #[test]
    fn a_datagram_sent_back_makes_nobody_the_peer() {
        // Aim: an attacker with one old datagram and no key does not become the peer. Method: an instructor's datagram
        // of yesterday, sent to a trainee; every answer is sent back as it is, and with its two numbers exchanged.
        // Regression: the code once had no direction, and the second reflection was accepted.
        let attacker = socket();
        let yesterday = {
            let instructor = HandLink::connect(attacker.local_addr().unwrap(), "secret").unwrap();
            instructor.publish(&hand(9.0, true));
            let mut recorded = None;
            assert!(eventually(|| {
                recorded = receive(&attacker);
                recorded.is_some()
            }));
            recorded.unwrap().0
        };
        let (trainee, address) = HandLink::listen("127.0.0.1:0", "secret").unwrap();
        trainee.publish(&hand(1.0, false));
        attacker.send_to(&yesterday, address).unwrap();
        let mut answers = 0;
        for _ in 0..200 {
            let Some((answer, _)) = receive(&attacker) else {
                attacker.send_to(&yesterday, address).unwrap();
                continue;
            };
            answers += 1;
            attacker.send_to(&answer, address).unwrap();
            let mut exchanged = answer.clone();
            exchanged[68..84].copy_from_slice(&answer[84..100]);
            exchanged[84..100].copy_from_slice(&answer[68..84]);
            exchanged[6] ^= 1;
            attacker.send_to(&exchanged, address).unwrap();
        }
        assert!(answers > 0, "the attack found nobody");
        assert_eq!(trainee.latest(), None);
        // The instructor of today joins all the same.
        let instructor = HandLink::connect(address, "secret").unwrap();
        instructor.publish(&hand(3.0, false));
        assert!(eventually(|| trainee.latest().is_some_and(|(hand, _)| hand.position.x == 3.0)));
    }

    #[test]
    fn a_hundred_thousand_recorded_datagrams_move_no_hand() {
        // Aim: recordings are worth nothing, even on the wire itself. Method: a tapper between the ends passes their
        // datagrams on and records them; then it sends recorded ones, reflected ones and altered ones in between, from
        // the peer's own address. The instructor's positions only grow: a smaller one would be a recorded one. Another
        // stranger sends recordings from an address of their own.
        const TRIES: u64 = 100_000;
        let (tap, side) = (socket(), socket());
        tap.set_nonblocking(true).unwrap();
        let (trainee, trainee_address) = HandLink::listen("127.0.0.1:0", "secret").unwrap();
        let instructor = HandLink::connect(tap.local_addr().unwrap(), "secret").unwrap();
        let (mut recorded, mut instructor_address) = (Vec::new(), None);
        let (mut x, mut seen, mut tries, mut after) = (0.0_f32, 0.0_f32, 0_u64, 0);
        let start = Instant::now();
        while trainee.rejected_count() < TRIES || after < 100 {
            assert!(start.elapsed() < Duration::from_secs(600), "{} of {tries} were refused", trainee.rejected_count());
            x += 0.01;
            instructor.publish(&hand(x, true));
            trainee.publish(&hand(-x, false));
            // Both ends send all the time: the tap is never empty for long.
            for (datagram, from) in std::iter::from_fn(|| receive(&tap)).take(64) {
                let is_of_trainee = from == trainee_address;
                if !is_of_trainee {
                    instructor_address = Some(from);
                }
                let to = if is_of_trainee { instructor_address } else { Some(trainee_address) };
                to.map(|to| tap.send_to(&datagram, to));
                recorded.push(datagram);
            }
            if let Some((hand, _)) = trainee.latest() {
                assert!(
                    hand.position.x >= seen,
                    "a recorded position moved the hand: {} after {seen}",
                    hand.position.x
                );
                after += usize::from(trainee.rejected_count() >= TRIES && hand.position.x > seen);
                seen = hand.position.x;
            }
            thread::sleep(Duration::from_micros(200));
            // Few at a time, so that the system drops none, and the tap passes the pair's own on in between.
            let first = recorded.len().saturating_sub(500);
            for datagram in recorded[..first].iter().step_by(1 + first / 60).take(60) {
                let mut altered = datagram.clone();
                altered[40 + (tries % 76) as usize] ^= 1;
                tap.send_to(datagram, trainee_address).unwrap();
                tap.send_to(&altered, trainee_address).unwrap();
                side.send_to(datagram, trainee_address).unwrap();
                tries += 3;
            }
        }
        assert!(seen > 1.0, "the pair stayed connected: {seen}");
        assert!(receive(&side).is_none(), "nobody else is answered while the pair is connected");
        // The trainee is followed as well.
        assert!(instructor.latest().is_some_and(|(hand, age)| hand.position.x < -1.0 && age < 2.0));
    }

    #[test]
    fn a_recording_is_worth_nothing_after_the_peer_has_gone() {
        // Aim: a recording of this very evening does not move the hand either. Method: the instructor leads and leaves;
        // after the silence, every datagram is sent again, first from another address.
        let tap = socket();
        let (trainee, trainee_address) = HandLink::listen("127.0.0.1:0", "secret").unwrap();
        trainee.publish(&hand(-1.0, false));
        let mut recorded = Vec::new();
        {
            let instructor = HandLink::connect(tap.local_addr().unwrap(), "secret").unwrap();
            instructor.publish(&hand(7.0, true));
            let mut instructor_address = None;
            assert!(eventually(|| {
                if let Some((datagram, from)) = receive(&tap) {
                    if from != trainee_address {
                        instructor_address = Some(from);
                        recorded.push(datagram.clone());
                    }
                    let to = if from == trainee_address { instructor_address } else { Some(trainee_address) };
                    to.map(|to| tap.send_to(&datagram, to));
                }
                recorded.len() > 200
            }));
        }
        assert!(trainee.latest().is_some());
        assert!(eventually(|| trainee.latest().is_some_and(|(_, age)| age > PEER_TIMEOUT.as_secs_f32() + 0.2)));
        for attacker in [socket(), tap] {
            for datagram in &recorded {
                attacker.send_to(datagram, trainee_address).unwrap();
                thread::sleep(Duration::from_micros(200));
            }
        }
        let (_, age) = trainee.latest().unwrap();
        assert!(age > PEER_TIMEOUT.as_secs_f32(), "a recorded datagram was accepted {age} s ago");
        // Whoever has the key is the next peer.
        let instructor = HandLink::connect(trainee_address, "secret").unwrap();
        instructor.publish(&hand(8.0, false));
        assert!(eventually(|| trainee.latest().is_some_and(|(hand, _)| hand.position.x == 8.0)));
    }
}
