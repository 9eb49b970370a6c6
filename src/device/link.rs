//! The way between two hands: in one process, or over the local network between two machines.
//!
//! Takes where one hand is. Gives where the other one was, and how long ago. Never waits: each end meets two slots where the
//! newest wins, and over the network a thread of its own carries them as datagrams of UDP, a thousand a second.
//!
//! Over the network a hand is pushed by what arrives. So both ends share a key, and every datagram carries its mark
//! (HMAC-SHA-256): what comes from elsewhere, or was altered, or comes late and out of order, is dropped and counted.

use super::coupling::Far;
use super::realtime;
use crate::frame::{Quat, Vec3};
use crate::mailbox::Newest;
use hmac::{Hmac, KeyInit, Mac};
use sha2::Sha256;
use std::hash::{BuildHasher, Hasher, RandomState};
use std::io;
use std::net::{SocketAddr, ToSocketAddrs, UdpSocket};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

/// One of two hands, as the other one sees it. World space, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mate {
    pub position: Vec3,
    pub orientation: Quat,
    pub buttons: u32,
    /// It wants the other hand to follow.
    pub is_leading: bool,
}

/// Words of a mate in a slot: 3 + 4 numbers, buttons, whether it leads, and when it was there, µs in two words.
const WORDS: usize = 11;

/// One end of the way.
pub struct Link {
    ours: Arc<Newest<WORDS>>,
    theirs: Arc<Newest<WORDS>>,
    epoch: Instant,
    carrier: Option<Carrier>,
}

/// The thread that carries slots over the network.
struct Carrier {
    stop: Arc<AtomicBool>,
    refused: Arc<AtomicU64>,
    thread: Option<JoinHandle<()>>,
}

impl Link {
    /// Both ends of a way within this process.
    pub fn pair() -> (Link, Link) {
        let (a, b, epoch) = (Arc::new(Newest::new()), Arc::new(Newest::new()), Instant::now());
        let end = |ours: &Arc<_>, theirs: &Arc<_>| Link {
            ours: Arc::clone(ours),
            theirs: Arc::clone(theirs),
            epoch,
            carrier: None,
        };
        (end(&a, &b), end(&b, &a))
    }

    /// The trainee's end over the network: waits at an address for whoever has the key.
    pub fn listen(at: impl ToSocketAddrs, key: &str) -> io::Result<(Link, SocketAddr)> {
        let socket = UdpSocket::bind(at)?;
        let address = socket.local_addr()?;
        Ok((Link::carried(socket, None, key)?, address))
    }

    /// The instructor's end over the network: goes to the trainee's address.
    pub fn connect(to: impl ToSocketAddrs, key: &str) -> io::Result<Link> {
        let none = || io::Error::new(io::ErrorKind::NotFound, "no address");
        let to = to.to_socket_addrs()?.next().ok_or_else(none)?;
        let from: SocketAddr = if to.is_ipv4() { ([0, 0, 0, 0], 0).into() } else { ([0u16; 8], 0).into() };
        Link::carried(UdpSocket::bind(from)?, Some(to), key)
    }

    fn carried(socket: UdpSocket, peer: Option<SocketAddr>, key: &str) -> io::Result<Link> {
        socket.set_read_timeout(Some(SEND_EVERY))?;
        let (ours, theirs, epoch) = (Arc::new(Newest::new()), Arc::new(Newest::new()), Instant::now());
        let (stop, refused) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicU64::new(0)));
        let mut carrying = Carrying {
            socket,
            peer,
            key: key.as_bytes().to_vec(),
            ours: ours.clone(),
            theirs: theirs.clone(),
            epoch,
            refused: refused.clone(),
            // Seeded by the system, for each meeting anew.
            meeting: RandomState::new().build_hasher().finish() as u32 | 1,
            their_meeting: 0,
            sequence: 0,
            heard: None,
            one_way: FIRST_DELAY,
        };
        let is_over = stop.clone();
        let thread = thread::Builder::new().name("link".into()).spawn(move || carrying.run(&is_over))?;
        Ok(Link { ours, theirs, epoch, carrier: Some(Carrier { stop, refused, thread: Some(thread) }) })
    }

    /// Says where this hand is.
    pub fn tell(&self, mate: &Mate) {
        self.ours.write(words_of(mate, self.epoch.elapsed()));
    }

    /// Where the other hand was last, and how long ago, s; `None` before it first said so.
    pub fn hear(&self) -> Option<(Mate, f32)> {
        let (mate, at) = mate_of(self.theirs.read()?.1);
        Some((mate, self.epoch.elapsed().saturating_sub(at).as_secs_f32()))
    }

    /// The other hand for a [`super::Coupling`], while `takes_part` says so.
    pub fn far(&self, takes_part: impl Fn(&Mate) -> bool) -> Option<Far> {
        let (mate, delay) = self.hear()?;
        takes_part(&mate).then_some(Far { position: mate.position, delay })
    }

    /// Datagrams that were dropped: without the key's mark, altered, or out of order.
    pub fn refused(&self) -> u64 {
        self.carrier.as_ref().map_or(0, |c| c.refused.load(Ordering::Relaxed))
    }
}

impl Drop for Carrier {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Release);
        if let Some(thread) = self.thread.take() {
            // It looks up every millisecond. A panic of it has nothing more to say.
            let _ = thread.join();
        }
    }
}

const SEND_EVERY: Duration = Duration::from_millis(1);

/// Delay assumed until the first round trip was measured: a bad network's, s.
const FIRST_DELAY: f32 = 0.05;

/// A peer that is silent for so long may be replaced by another one that has the key.
const PEER_AFTER: Duration = Duration::from_secs(2);

/// A datagram: see `content/devices/link.md`.
const LENGTH: usize = 80;
const MAGIC: [u8; 4] = *b"TYPH";
const PROTOCOL: u8 = 1;
/// Bytes of the mark at the end: 64 bits are beyond guessing at a thousand tries a second.
const MARK: usize = 8;

struct Carrying {
    socket: UdpSocket,
    peer: Option<SocketAddr>,
    key: Vec<u8>,
    ours: Arc<Newest<WORDS>>,
    theirs: Arc<Newest<WORDS>>,
    epoch: Instant,
    refused: Arc<AtomicU64>,
    /// A number of chance that names this meeting: who says it back speaks to us, and now.
    meeting: u32,
    their_meeting: u32,
    sequence: u32,
    heard: Option<Heard>,
    /// How long a datagram is under way, s: half of the shortest round trip of late.
    one_way: f32,
}

/// The newest datagram of the other end.
#[derive(Clone, Copy)]
struct Heard {
    sequence: u32,
    /// By the sender's clock, µs.
    sent_us: u64,
    at: Instant,
}

impl Carrying {
    fn run(&mut self, is_over: &AtomicBool) {
        // What was granted shows in the delay.
        let _ = realtime::raise();
        let mut send_at = Instant::now();
        let mut bytes = [0; LENGTH + 1];
        while !is_over.load(Ordering::Acquire) {
            if Instant::now() >= send_at {
                send_at = (send_at + SEND_EVERY).max(Instant::now());
                self.send();
            }
            match self.socket.recv_from(&mut bytes) {
                Ok((length, from)) => {
                    if self.take(&bytes[..length], from).is_none() {
                        self.refused.fetch_add(1, Ordering::Relaxed);
                    }
                }
                Err(error) if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut) => {}
                // Nobody listens there yet, or the network is down: the other end sees silence and lets go.
                Err(_) => thread::sleep(SEND_EVERY),
            }
        }
    }

    fn send(&mut self) {
        if let Some(peer) = self.peer {
            self.send_to(peer, self.their_meeting);
        }
    }

    fn send_to(&mut self, peer: SocketAddr, their_meeting: u32) {
        let Some((_, words)) = self.ours.read() else { return };
        let (mate, _) = mate_of(words);
        self.sequence = self.sequence.wrapping_add(1);
        let (echo_us, echo_age_us) = match self.heard {
            Some(heard) => (heard.sent_us, heard.at.elapsed().as_micros() as u32),
            None => (0, 0),
        };
        let mut bytes = [0; LENGTH];
        bytes[..4].copy_from_slice(&MAGIC);
        bytes[4..8].copy_from_slice(&[PROTOCOL, u8::from(mate.is_leading), 0, 0]);
        bytes[8..12].copy_from_slice(&self.sequence.to_le_bytes());
        bytes[12..20].copy_from_slice(&(self.epoch.elapsed().as_micros() as u64).to_le_bytes());
        bytes[20..28].copy_from_slice(&echo_us.to_le_bytes());
        bytes[28..32].copy_from_slice(&echo_age_us.to_le_bytes());
        bytes[64..68].copy_from_slice(&self.meeting.to_le_bytes());
        bytes[68..72].copy_from_slice(&their_meeting.to_le_bytes());
        bytes[32..36].copy_from_slice(&mate.buttons.to_le_bytes());
        let numbers = mate.position.to_array().into_iter().chain(mate.orientation.to_array());
        for (to, number) in bytes[36..64].chunks_exact_mut(4).zip(numbers) {
            to.copy_from_slice(&number.to_le_bytes());
        }
        let mark = self.mark(&bytes[..LENGTH - MARK]);
        bytes[LENGTH - MARK..].copy_from_slice(&mark);
        // A datagram that cannot be sent is one that is lost.
        let _ = self.socket.send_to(&bytes, peer);
    }

    /// Takes a datagram in; `None` for one that does not count.
    fn take(&mut self, bytes: &[u8], from: SocketAddr) -> Option<()> {
        let bytes: &[u8; LENGTH] = bytes.try_into().ok()?;
        if bytes[..4] != MAGIC || bytes[4] != PROTOCOL {
            return None;
        }
        self.hmac(&bytes[..LENGTH - MARK]).verify_truncated_left(&bytes[LENGTH - MARK..]).ok()?;
        let word = |at: usize| u32::from_le_bytes(std::array::from_fn(|i| bytes[at + i]));
        let long = |at: usize| u64::from(word(at)) | u64::from(word(at + 4)) << 32;
        let number = |i: usize| f32::from_bits(word(36 + 4 * i));
        let (sequence, now) = (word(8), Instant::now());
        if word(68) != self.meeting {
            // Not said to us in this meeting: a peer that does not know it yet, or words of an old meeting played back. Either is
            // told what to say, and moves nobody.
            self.send_to(from, word(64));
            return Some(());
        }
        if let Some(heard) = self.heard.filter(|heard| heard.at.elapsed() < PEER_AFTER) {
            // One peer at a time, and only what is newer than the newest.
            let is_newer = sequence.wrapping_sub(heard.sequence).cast_signed() > 0;
            if self.peer != Some(from) || !is_newer {
                return None;
            }
        }
        (self.peer, self.their_meeting) = (Some(from), word(64));
        self.heard = Some(Heard { sequence, sent_us: long(12), at: now });
        self.measure(long(20), word(28));
        let mate = Mate {
            position: Vec3::new(number(0), number(1), number(2)),
            orientation: Quat::from_xyzw(number(3), number(4), number(5), number(6)),
            buttons: word(32),
            is_leading: bytes[5] & 1 == 1,
        };
        if !mate.position.is_finite() || !mate.orientation.is_finite() {
            return None;
        }
        let was_there = self.epoch.elapsed().saturating_sub(Duration::from_secs_f32(self.one_way));
        self.theirs.write(words_of(&mate, was_there));
        Some(())
    }

    /// A round trip: our own time, echoed with how long it lay at the other end.
    fn measure(&mut self, echo_us: u64, echo_age_us: u32) {
        if echo_us == 0 {
            return;
        }
        let now_us = self.epoch.elapsed().as_micros() as u64;
        let round_us = now_us.saturating_sub(echo_us).saturating_sub(u64::from(echo_age_us));
        let one_way = (0.5e-6 * round_us as f64) as f32;
        // A longer way counts at once, a shorter one by and by: the coupling must never take the way for shorter than it is.
        self.one_way = one_way.max(self.one_way + (one_way - self.one_way) * 0.01).clamp(0.0, 1.0);
    }

    fn hmac(&self, bytes: &[u8]) -> Hmac<Sha256> {
        let mut hmac = Hmac::<Sha256>::new_from_slice(&self.key).expect("HMAC takes keys of any length");
        hmac.update(bytes);
        hmac
    }

    fn mark(&self, bytes: &[u8]) -> [u8; MARK] {
        let whole = self.hmac(bytes).finalize().into_bytes();
        std::array::from_fn(|i| whole[i])
    }
}

fn words_of(mate: &Mate, at: Duration) -> [u32; WORDS] {
    let (p, q) = (mate.position, mate.orientation);
    let [a, b, c, d, e, f, g] = [p.x, p.y, p.z, q.x, q.y, q.z, q.w].map(f32::to_bits);
    let us = at.as_micros() as u64;
    [a, b, c, d, e, f, g, mate.buttons, u32::from(mate.is_leading), us as u32, (us >> 32) as u32]
}

fn mate_of(words: [u32; WORDS]) -> (Mate, Duration) {
    let [a, b, c, d, e, f, g, ..] = words.map(f32::from_bits);
    let mate = Mate {
        position: Vec3::new(a, b, c),
        orientation: Quat::from_xyzw(d, e, f, g),
        buttons: words[7],
        is_leading: words[8] == 1,
    };
    (mate, Duration::from_micros(u64::from(words[9]) | u64::from(words[10]) << 32))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mate(x: f32, is_leading: bool) -> Mate {
        Mate { position: Vec3::new(x, 2.0, -3.0), orientation: Quat::IDENTITY, buttons: 5, is_leading }
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
        let (a, b) = Link::pair();
        assert_eq!(a.hear(), None);
        a.tell(&mate(1.0, true));
        let (seen, delay) = b.hear().unwrap();
        assert_eq!(seen, mate(1.0, true));
        assert!(delay < 1.0);
        assert_eq!(b.far(|m| !m.is_leading), None);
    }

    #[test]
    fn two_ends_see_each_other_over_the_network() {
        let (here, address) = Link::listen("127.0.0.1:0", "secret").unwrap();
        let there = Link::connect(address, "secret").unwrap();
        here.tell(&mate(1.0, false));
        there.tell(&mate(2.0, true));
        assert!(eventually(|| here.hear().is_some_and(|(m, _)| m == mate(2.0, true))));
        assert!(eventually(|| there.hear().is_some_and(|(m, _)| m == mate(1.0, false))));
        // Before the first round trip the way counts as 50 ms; on one machine it is shorter.
        assert!(eventually(|| here.hear().is_some_and(|(_, delay)| delay < 0.02)));
    }

    #[test]
    fn nobody_without_the_key_moves_a_hand() {
        let (here, address) = Link::listen("127.0.0.1:0", "secret").unwrap();
        let stranger = Link::connect(address, "guess").unwrap();
        here.tell(&mate(1.0, false));
        stranger.tell(&mate(9.0, true));
        UdpSocket::bind("127.0.0.1:0").unwrap().send_to(b"nonsense", address).unwrap();
        assert!(eventually(|| here.refused() > 20));
        assert_eq!(here.hear(), None);
    }
}
