//! Who may come in, and stays.
//!
//! Whoever opens the address that was printed, once; or, where the door has a password, whoever knows it. A browser that is in
//! shows a cookie, which no script can read and no other site can make it send; a form shows a second value, which stands in our
//! own pages only.

use super::chance;
use crate::scenario::hex;
use std::collections::BTreeMap;
use std::net::IpAddr;

/// Least length of a password, letters: it may be tried from anywhere in the house.
pub const PASSWORD_MIN: usize = 12;

/// For how long a browser stays in without asking for anything, s: an examination day.
const STAYS: i64 = 12 * 3600;

/// Browsers that are in at once. Whoever was quiet longest goes first.
const GUESTS_MAX: usize = 200;

/// Pause after the first wrong password from an address, s; it doubles with each, up to the longest.
const PAUSE: i64 = 2;
const PAUSE_MAX: i64 = 60;

/// Wrong passwords from everywhere in a minute, after which nobody is asked for one until the next: 12 letters outlast it.
const WRONG_IN_A_MINUTE: u32 = 60;

/// Addresses whose tries are remembered.
const TRIERS_MAX: usize = 1000;

/// How the door is opened.
#[derive(Clone)]
pub enum Lock {
    /// By the address that was printed.
    Address,
    Password(String),
}

pub struct Door {
    key: [u8; 32],
    /// Mark of the password, where there is one.
    password: Option<[u8; 32]>,
    /// Mark of the address that still opens, and of those that did.
    fresh: [u8; 32],
    spent: Vec<[u8; 32]>,
    guests: BTreeMap<[u8; 32], Guest>,
    tries: BTreeMap<IpAddr, Tries>,
    wrong_this_minute: (i64, u32),
}

/// A browser that is in.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Guest {
    /// What its forms show.
    pub form: String,
    /// The name last given, so that nobody writes it at every item.
    pub name: String,
    seen: i64,
}

#[derive(Clone, Copy, Default)]
struct Tries {
    wrong: u32,
    /// Not tried again before, s.
    until: i64,
}

/// What comes of the address that was printed.
#[derive(Debug, PartialEq, Eq)]
pub enum Opened {
    /// The cookie.
    In(String),
    /// It was used before; what opens next, for whoever sits at the terminal.
    Spent(String),
    No,
}

/// What comes of a password.
#[derive(Debug, PartialEq, Eq)]
pub enum Tried {
    In(String),
    Wrong,
    /// Too many wrong ones: in so many seconds again.
    Wait(i64),
}

impl Door {
    /// A door, and what opens it the first time.
    pub fn new(lock: &Lock) -> Result<(Door, String), String> {
        let key = chance::bytes()?;
        let password = match lock {
            Lock::Address => None,
            Lock::Password(password) => Some(chance::mark(&key, password.as_bytes())),
        };
        let mut door = Door {
            key,
            password,
            fresh: [0; 32],
            spent: Vec::new(),
            guests: BTreeMap::new(),
            tries: BTreeMap::new(),
            wrong_this_minute: (0, 0),
        };
        let first = door.renew()?;
        Ok((door, first))
    }

    pub fn has_password(&self) -> bool {
        self.password.is_some()
    }

    fn renew(&mut self) -> Result<String, String> {
        let token = hex(&chance::bytes()?);
        self.fresh = chance::mark(&self.key, token.as_bytes());
        Ok(token)
    }

    /// `now` in seconds since 1970, here and below.
    pub fn open(&mut self, token: &str, now: i64) -> Result<Opened, String> {
        if self.password.is_some() {
            return Ok(Opened::No);
        }
        if chance::is_marked(&self.key, token.as_bytes(), &self.fresh) {
            self.spent.push(self.fresh);
            // Nothing opens until somebody comes with what is spent: then the terminal says what does.
            self.renew()?;
            return Ok(Opened::In(self.let_in(now)?));
        }
        match self.spent.iter().any(|spent| chance::is_marked(&self.key, token.as_bytes(), spent)) {
            true => Ok(Opened::Spent(self.renew()?)),
            false => Ok(Opened::No),
        }
    }

    pub fn try_password(&mut self, given: &str, from: IpAddr, now: i64) -> Result<Tried, String> {
        let Some(password) = self.password else { return Ok(Tried::Wrong) };
        let minute = now.div_euclid(60);
        if self.wrong_this_minute.0 != minute {
            self.wrong_this_minute = (minute, 0);
        }
        let until = self.tries.get(&from).map_or(0, |t| t.until);
        let until = if self.wrong_this_minute.1 >= WRONG_IN_A_MINUTE { until.max(60 * (minute + 1)) } else { until };
        if now < until {
            return Ok(Tried::Wait(until - now));
        }
        if chance::is_marked(&self.key, given.as_bytes(), &password) {
            self.tries.remove(&from);
            return Ok(Tried::In(self.let_in(now)?));
        }
        self.wrong_this_minute.1 += 1;
        if self.tries.len() >= TRIERS_MAX {
            self.tries.retain(|_, tries| now < tries.until);
        }
        let tries = self.tries.entry(from).or_default();
        let pause = (PAUSE << tries.wrong.min(10)).min(PAUSE_MAX);
        *tries = Tries { wrong: tries.wrong + 1, until: now + pause };
        Ok(Tried::Wrong)
    }

    fn let_in(&mut self, now: i64) -> Result<String, String> {
        let cookie = hex(&chance::bytes()?);
        let form = hex(&chance::bytes()?);
        self.guests.retain(|_, guest| now - guest.seen < STAYS);
        if self.guests.len() >= GUESTS_MAX
            && let Some(quietest) = self.guests.iter().min_by_key(|(_, g)| g.seen).map(|(mark, _)| *mark)
        {
            self.guests.remove(&quietest);
        }
        let guest = Guest { form, name: String::new(), seen: now };
        self.guests.insert(chance::mark(&self.key, cookie.as_bytes()), guest);
        Ok(cookie)
    }

    /// The browser that shows this cookie, if it is in.
    pub fn guest(&mut self, cookie: &str, now: i64) -> Option<Guest> {
        // Guests are kept by the mark of their cookie: how near a guess came cannot be timed.
        let guest = self.guests.get_mut(&chance::mark(&self.key, cookie.as_bytes()))?;
        if now - guest.seen >= STAYS {
            return None;
        }
        guest.seen = now;
        Some(guest.clone())
    }

    /// Whether a form is one of a guest's own.
    pub fn is_own_form(&self, guest: &Guest, shown: &str) -> bool {
        chance::is_marked(&self.key, shown.as_bytes(), &chance::mark(&self.key, guest.form.as_bytes()))
    }

    pub fn call(&mut self, cookie: &str, name: &str) {
        if let Some(guest) = self.guests.get_mut(&chance::mark(&self.key, cookie.as_bytes())) {
            guest.name = name.to_string();
        }
    }

    pub fn leave(&mut self, cookie: &str) {
        self.guests.remove(&chance::mark(&self.key, cookie.as_bytes()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HERE: IpAddr = IpAddr::V4(std::net::Ipv4Addr::LOCALHOST);

    #[test]
    fn an_address_opens_once() {
        let (mut door, first) = Door::new(&Lock::Address).unwrap();
        let Opened::In(cookie) = door.open(&first, 0).unwrap() else { panic!("it does not open") };
        let guest = door.guest(&cookie, 10).unwrap();
        assert!(door.is_own_form(&guest, &guest.form) && !door.is_own_form(&guest, &cookie));
        let Opened::Spent(next) = door.open(&first, 20).unwrap() else { panic!("it opens twice") };
        assert_eq!(door.open("", 20), Ok(Opened::No));
        assert!(matches!(door.open(&next, 30), Ok(Opened::In(_))));
        assert_eq!(door.guest("", 30), None);
        assert_eq!(door.guest(&cookie, 10 + STAYS), None, "who is quiet for a day has left");
        door.leave(&cookie);
        assert_eq!(door.guest(&cookie, 30), None);
    }

    #[test]
    fn wrong_passwords_become_slow() {
        let (mut door, address) = Door::new(&Lock::Password("correct horse battery".into())).unwrap();
        assert_eq!(door.open(&address, 0), Ok(Opened::No), "where there is a password nothing else opens");
        assert_eq!(door.try_password("wrong", HERE, 100), Ok(Tried::Wrong));
        assert_eq!(door.try_password("correct horse battery", HERE, 100), Ok(Tried::Wait(2)));
        assert_eq!(door.try_password("wrong", HERE, 102), Ok(Tried::Wrong));
        assert_eq!(door.try_password("wrong", HERE, 103), Ok(Tried::Wait(3)));
        assert!(matches!(door.try_password("correct horse battery", HERE, 106), Ok(Tried::In(_))));
        // From many addresses at once nobody gets more than so many tries a minute.
        let tried = (0..200u8).map(|n| door.try_password("wrong", [10, 0, 0, n].into(), 240).unwrap());
        assert_eq!(tried.filter(|t| *t == Tried::Wrong).count(), WRONG_IN_A_MINUTE as usize);
    }
}
