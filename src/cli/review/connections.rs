//! Open connections of the review server: how many there may be, and which one makes room for another.
//!
//! Takes the client address of each connection and the beginnings and ends of its requests. Gives the connection to
//! close when there are too many. Never opens or closes one.

use std::collections::BTreeMap;
use std::net::IpAddr;
use std::time::Instant;

/// Maximum number of simultaneous connections; a browser opens six.
pub const CONNECTIONS_MAX: usize = 256;

/// Maximum number of simultaneous connections from one address: four browsers, and some to spare.
pub const PER_ADDRESS_MAX: usize = 32;

/// Open connections, by a number that counts up. `H` is what closes one.
pub struct ConnectionTable<H> {
    open: BTreeMap<u64, OpenConnection<H>>,
    proxy: Option<IpAddr>,
    next: u64,
}

struct OpenConnection<H> {
    peer: IpAddr,
    handle: Option<H>,
    /// A request is being answered.
    is_busy: bool,
    /// Time of the last answer; `None` before the first request.
    answered: Option<Instant>,
}

/// Decision about a new connection.
pub enum Admission<H> {
    /// The connection is entered under this number; the given one, if any, must be closed.
    Admitted(u64, Option<H>),
    /// All connections are at work.
    Full,
}

impl<H> ConnectionTable<H> {
    /// Creates an empty table. The connections of `proxy` are those of many people, and have no limit of their own.
    pub fn new(proxy: Option<IpAddr>) -> ConnectionTable<H> {
        ConnectionTable { open: BTreeMap::new(), proxy: proxy.map(|proxy| proxy.to_canonical()), next: 0 }
    }

    /// Enters a new connection. If there are too many, an idle one makes room: first one that has never sent a
    /// request, and the oldest of these, because a browser sends its request at once.
    pub fn admit(&mut self, peer: IpAddr) -> Admission<H> {
        let of_address = self.open.values().filter(|c| c.peer == peer).count();
        let idle = match of_address >= PER_ADDRESS_MAX && self.proxy != Some(peer) {
            true => Some(self.longest_idle(|c| c.peer == peer)),
            false if self.open.len() >= CONNECTIONS_MAX => Some(self.longest_idle(|_| true)),
            false => None,
        };
        let evicted = match idle {
            None => None,
            Some(None) => return Admission::Full,
            Some(Some(number)) => self.open.remove(&number).and_then(|c| c.handle),
        };
        self.next += 1;
        self.open.insert(self.next, OpenConnection { peer, handle: None, is_busy: false, answered: None });
        Admission::Admitted(self.next, evicted)
    }

    fn longest_idle(&self, is_eligible: impl Fn(&OpenConnection<H>) -> bool) -> Option<u64> {
        let idle = self.open.iter().filter(|(_, c)| !c.is_busy && is_eligible(c));
        idle.min_by_key(|(number, c)| (c.answered, **number)).map(|(number, _)| *number)
    }

    /// Keeps what closes a connection.
    pub fn set_handle(&mut self, number: u64, handle: H) {
        if let Some(connection) = self.open.get_mut(&number) {
            connection.handle = Some(handle);
        }
    }

    pub fn begin_request(&mut self, number: u64) {
        if let Some(connection) = self.open.get_mut(&number) {
            connection.is_busy = true;
        }
    }

    pub fn end_request(&mut self, number: u64, now: Instant) {
        if let Some(connection) = self.open.get_mut(&number) {
            (connection.is_busy, connection.answered) = (false, Some(now));
        }
    }

    pub fn remove(&mut self, number: u64) {
        self.open.remove(&number);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn address(n: u8) -> IpAddr {
        [192, 0, 2, n].into()
    }

    /// Admits a connection whose handle is its own number; returns the number and that of the closed one.
    fn admit(table: &mut ConnectionTable<u64>, peer: IpAddr) -> Option<(u64, Option<u64>)> {
        let Admission::Admitted(number, closed) = table.admit(peer) else { return None };
        table.set_handle(number, number);
        Some((number, closed))
    }

    #[test]
    fn idle_connections_make_room_for_new_ones() {
        // Aim: nobody closes the page for others by holding connections open. Method: one address opens many more than
        // it may while a second one works, and then many addresses open all there are.
        let mut table = ConnectionTable::new(None);
        let (own, _) = admit(&mut table, address(1)).unwrap();
        table.begin_request(own);
        let closed: Vec<u64> = (0..200).filter_map(|_| admit(&mut table, address(2)).unwrap().1).collect();
        assert_eq!(
            closed,
            (2..2 + 200 - PER_ADDRESS_MAX as u64).collect::<Vec<_>>(),
            "the oldest of its own, in order"
        );
        table.end_request(own, Instant::now());
        // The one that was answered goes last.
        let closed: Vec<u64> = (0..250u16)
            .filter_map(|n| admit(&mut table, IpAddr::from([10, 0, (n >> 8) as u8, n as u8])).unwrap().1)
            .collect();
        assert!(!closed.is_empty() && !closed.contains(&own));
        assert_eq!(table.open.len(), CONNECTIONS_MAX);
    }

    #[test]
    fn a_connection_at_work_is_not_closed() {
        let mut table = ConnectionTable::new(None);
        for _ in 0..PER_ADDRESS_MAX {
            let (number, _) = admit(&mut table, address(1)).unwrap();
            table.begin_request(number);
        }
        assert_eq!(admit(&mut table, address(1)), None);
        assert!(admit(&mut table, address(2)).is_some());
        // A proxy's connections are those of many people.
        table.proxy = Some(address(1));
        assert!(admit(&mut table, address(1)).is_some());
        // One that has ended makes room.
        table.proxy = None;
        table.remove(1);
        table.remove(2);
        assert!(matches!(admit(&mut table, address(1)), Some((_, None))));
    }
}
