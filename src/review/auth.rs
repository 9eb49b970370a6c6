//! Authentication: a one-time login link or a shared password.
//!
//! A logged-in browser sends a cookie that scripts cannot read (`HttpOnly`) and that other sites cannot make it send
//! (`SameSite=Strict`). Every form contains a CSRF token, which only the application's own pages show.

use super::crypto;
use std::collections::BTreeMap;
use std::net::IpAddr;
use typodont_exercise::scenario::hex;

/// Minimum length of a password, characters. It can be tried from every machine of the local network.
pub const PASSWORD_MIN: usize = 12;

/// Time after which an idle login expires, s: the length of an examination day.
const LOGIN_IDLE_MAX: i64 = 12 * 3600;

/// Maximum number of concurrent logins. The one that has been idle longest is removed first.
const LOGINS_MAX: usize = 200;

/// Delay after the first wrong password from an address, s. It doubles with each further one, up to `BACKOFF_MAX`.
const BACKOFF: i64 = 2;
const BACKOFF_MAX: i64 = 60;

/// Maximum number of wrong passwords per minute from all addresses together, after which logins are refused until the
/// next minute. A password of 12 characters withstands this rate.
const FAILURES_PER_MINUTE_MAX: u32 = 60;

/// Number of addresses whose failed attempts are tracked.
const TRACKED_ADDRESSES_MAX: usize = 1000;

/// Wrong passwords in a row from a browser that has logged in before, after which it counts as any other.
const DEVICE_FAILURES_MAX: u32 = 10;

/// Method of logging in.
#[derive(Clone)]
pub enum AuthMode {
    /// One-time link printed at the terminal.
    OneTimeLink,
    /// Password shared by the examiners.
    Password(String),
}

/// Logins and failed attempts. Tokens, cookies and the password are kept only as HMAC tags under a random key.
pub struct Auth {
    key: [u8; 32],
    /// Tag of the password, if one is set.
    password_tag: Option<[u8; 32]>,
    /// Tag of the login token that is valid, and of those already used.
    active_token_tag: [u8; 32],
    spent_token_tags: Vec<[u8; 32]>,
    logins: BTreeMap<[u8; 32], Login>,
    failed_attempts: BTreeMap<AttemptSource, FailedAttempts>,
    failures_this_minute: (i64, u32),
}

/// Logged-in browser.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Login {
    /// CSRF token of the browser's forms.
    pub csrf_token: String,
    /// Examiner's name as last entered, offered as the default in forms.
    pub display_name: String,
    last_seen: i64,
}

/// Source whose wrong passwords are counted together.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum AttemptSource {
    Address(IpAddr),
    /// Browser that has logged in before, by the tag of its device cookie. Examiners who share an address, behind a
    /// proxy, then do not share each other's mistakes.
    Device([u8; 32]),
}

#[derive(Clone, Copy, Default)]
struct FailedAttempts {
    count: u32,
    /// Time before which no further attempt is accepted, s since 1970.
    locked_until: i64,
}

/// Result of opening a login link.
#[derive(Debug, PartialEq, Eq)]
pub enum TokenLogin {
    /// The link was valid; contains the session cookie.
    LoggedIn(String),
    /// The link was used before; contains a new login token, to be printed at the terminal.
    Spent(String),
    Rejected,
}

/// Result of a login with a password.
#[derive(Debug, PartialEq, Eq)]
pub enum PasswordLogin {
    /// The password was right.
    LoggedIn {
        /// Session cookie.
        cookie: String,
        /// Cookie that marks this browser as one that knew the password.
        device_cookie: String,
    },
    WrongPassword,
    /// Too many wrong passwords; contains the seconds until the next attempt is accepted.
    RateLimited(i64),
}

impl Auth {
    /// Creates the state and returns it with the first login token.
    ///
    /// # Errors
    ///
    /// Returns a message when the system's random number generator fails.
    pub fn new(mode: &AuthMode) -> Result<(Auth, String), String> {
        let key = crypto::random_bytes()?;
        let password = match mode {
            AuthMode::OneTimeLink => None,
            AuthMode::Password(password) => Some(crypto::hmac_tag(&key, password.as_bytes())),
        };
        let mut auth = Auth {
            key,
            password_tag: password,
            active_token_tag: [0; 32],
            spent_token_tags: Vec::new(),
            logins: BTreeMap::new(),
            failed_attempts: BTreeMap::new(),
            failures_this_minute: (0, 0),
        };
        let first = auth.issue_token()?;
        Ok((auth, first))
    }

    pub fn has_password(&self) -> bool {
        self.password_tag.is_some()
    }

    fn issue_token(&mut self) -> Result<String, String> {
        let token = hex(&crypto::random_bytes()?);
        self.active_token_tag = crypto::hmac_tag(&self.key, token.as_bytes());
        Ok(token)
    }

    /// Logs in with the token of a login link. `now` is in seconds since 1970, here and below.
    ///
    /// # Errors
    ///
    /// Returns a message when the system's random number generator fails.
    pub fn log_in_with_token(&mut self, token: &str, now: i64) -> Result<TokenLogin, String> {
        if self.password_tag.is_some() {
            return Ok(TokenLogin::Rejected);
        }
        if crypto::verify_tag(&self.key, token.as_bytes(), &self.active_token_tag) {
            self.spent_token_tags.push(self.active_token_tag);
            // The new token stays secret until somebody opens the used link; only then is a token printed at the
            // terminal.
            self.issue_token()?;
            return Ok(TokenLogin::LoggedIn(self.create_session(now)?));
        }
        match self.spent_token_tags.iter().any(|spent| crypto::verify_tag(&self.key, token.as_bytes(), spent)) {
            true => Ok(TokenLogin::Spent(self.issue_token()?)),
            false => Ok(TokenLogin::Rejected),
        }
    }

    /// Logs in with the password, unless attempts from `peer`, or from everywhere, are rate-limited. A browser with a
    /// valid device cookie is limited by its own attempts only.
    ///
    /// # Errors
    ///
    /// Returns a message when the system's random number generator fails.
    pub fn log_in_with_password(
        &mut self,
        given: &str,
        peer: IpAddr,
        device_cookie: Option<&str>,
        now: i64,
    ) -> Result<PasswordLogin, String> {
        let Some(password) = self.password_tag else { return Ok(PasswordLogin::WrongPassword) };
        let minute = now.div_euclid(60);
        if self.failures_this_minute.0 != minute {
            self.failures_this_minute = (minute, 0);
        }
        let source = self.attempt_source(peer, device_cookie);
        let is_device = matches!(source, AttemptSource::Device(_));
        let until = self.failed_attempts.get(&source).map_or(0, |t| t.locked_until);
        let until = match !is_device && self.failures_this_minute.1 >= FAILURES_PER_MINUTE_MAX {
            true => until.max(60 * (minute + 1)),
            false => until,
        };
        if now < until {
            return Ok(PasswordLogin::RateLimited(until - now));
        }
        if crypto::verify_tag(&self.key, given.as_bytes(), &password) {
            self.failed_attempts.remove(&source);
            let device_cookie = self.issue_device_cookie()?;
            return Ok(PasswordLogin::LoggedIn { cookie: self.create_session(now)?, device_cookie });
        }
        if !is_device {
            self.failures_this_minute.1 += 1;
        }
        if self.failed_attempts.len() >= TRACKED_ADDRESSES_MAX {
            self.failed_attempts.retain(|_, attempts| now < attempts.locked_until);
        }
        let attempts = self.failed_attempts.entry(source).or_default();
        let pause = (BACKOFF << attempts.count.min(10)).min(BACKOFF_MAX);
        *attempts = FailedAttempts { count: attempts.count + 1, locked_until: now + pause };
        Ok(PasswordLogin::WrongPassword)
    }

    /// Returns the source of an attempt: the browser if it has logged in before and has not guessed since, otherwise its
    /// address.
    fn attempt_source(&self, peer: IpAddr, device_cookie: Option<&str>) -> AttemptSource {
        let is_own = |cookie: &&str| {
            let (word, tag) = cookie.split_at_checked(64).unwrap_or_default();
            crypto::verify_tag(&self.key, tag.as_bytes(), &self.device_tag(word))
        };
        let Some(cookie) = device_cookie.filter(is_own) else { return AttemptSource::Address(peer) };
        let source = AttemptSource::Device(crypto::hmac_tag(&self.key, cookie.as_bytes()));
        match self.failed_attempts.get(&source).is_some_and(|attempts| attempts.count >= DEVICE_FAILURES_MAX) {
            true => AttemptSource::Address(peer),
            false => source,
        }
    }

    fn issue_device_cookie(&self) -> Result<String, String> {
        let word = hex(&crypto::random_bytes()?);
        let tag = hex(&crypto::hmac_tag(&self.key, format!("device {word}").as_bytes()));
        Ok(word + &tag)
    }

    /// Computes the tag expected in a device cookie with this word, hashed once more under the key so that `verify_tag`
    /// can compare it in constant time.
    fn device_tag(&self, word: &str) -> [u8; 32] {
        let tag = hex(&crypto::hmac_tag(&self.key, format!("device {word}").as_bytes()));
        crypto::hmac_tag(&self.key, tag.as_bytes())
    }

    fn create_session(&mut self, now: i64) -> Result<String, String> {
        let cookie = hex(&crypto::random_bytes()?);
        let csrf_token = hex(&crypto::random_bytes()?);
        self.logins.retain(|_, login| now - login.last_seen < LOGIN_IDLE_MAX);
        if self.logins.len() >= LOGINS_MAX
            && let Some(oldest) = self.logins.iter().min_by_key(|(_, login)| login.last_seen).map(|(tag, _)| *tag)
        {
            self.logins.remove(&oldest);
        }
        let login = Login { csrf_token, display_name: String::new(), last_seen: now };
        self.logins.insert(crypto::hmac_tag(&self.key, cookie.as_bytes()), login);
        Ok(cookie)
    }

    /// Returns the login that belongs to a cookie and resets its idle time, or `None` if there is none or it has
    /// expired.
    pub fn authenticate(&mut self, cookie: &str, now: i64) -> Option<Login> {
        // Logins are keyed by the tag of their cookie, so the lookup time reveals nothing about the cookie itself.
        let login = self.logins.get_mut(&crypto::hmac_tag(&self.key, cookie.as_bytes()))?;
        if now - login.last_seen >= LOGIN_IDLE_MAX {
            return None;
        }
        login.last_seen = now;
        Some(login.clone())
    }

    /// Returns true if a form contains the CSRF token of this login.
    pub fn verify_csrf(&self, login: &Login, token_given: &str) -> bool {
        crypto::verify_tag(&self.key, token_given.as_bytes(), &crypto::hmac_tag(&self.key, login.csrf_token.as_bytes()))
    }

    pub fn set_display_name(&mut self, cookie: &str, name: &str) {
        if let Some(login) = self.logins.get_mut(&crypto::hmac_tag(&self.key, cookie.as_bytes())) {
            login.display_name = name.to_string();
        }
    }

    pub fn log_out(&mut self, cookie: &str) {
        self.logins.remove(&crypto::hmac_tag(&self.key, cookie.as_bytes()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HERE: IpAddr = IpAddr::V4(std::net::Ipv4Addr::LOCALHOST);

    #[test]
    fn a_login_link_works_once() {
        let (mut auth, first) = Auth::new(&AuthMode::OneTimeLink).unwrap();
        let TokenLogin::LoggedIn(cookie) = auth.log_in_with_token(&first, 0).unwrap() else {
            panic!("the link does not log in")
        };
        let login = auth.authenticate(&cookie, 10).unwrap();
        assert!(auth.verify_csrf(&login, &login.csrf_token) && !auth.verify_csrf(&login, &cookie));
        let TokenLogin::Spent(next) = auth.log_in_with_token(&first, 20).unwrap() else {
            panic!("the link logs in twice")
        };
        assert_eq!(auth.log_in_with_token("", 20), Ok(TokenLogin::Rejected));
        assert!(matches!(auth.log_in_with_token(&next, 30), Ok(TokenLogin::LoggedIn(_))));
        assert_eq!(auth.authenticate("", 30), None);
        assert_eq!(auth.authenticate(&cookie, 10 + LOGIN_IDLE_MAX), None, "an idle login expires");
        auth.log_out(&cookie);
        assert_eq!(auth.authenticate(&cookie, 30), None);
    }

    #[test]
    fn wrong_passwords_are_rate_limited() {
        let (mut auth, token) = Auth::new(&AuthMode::Password("correct horse battery".into())).unwrap();
        assert_eq!(auth.log_in_with_token(&token, 0), Ok(TokenLogin::Rejected), "a password disables login links");
        assert_eq!(auth.log_in_with_password("wrong", HERE, None, 100), Ok(PasswordLogin::WrongPassword));
        assert_eq!(
            auth.log_in_with_password("correct horse battery", HERE, None, 100),
            Ok(PasswordLogin::RateLimited(2))
        );
        assert_eq!(auth.log_in_with_password("wrong", HERE, None, 102), Ok(PasswordLogin::WrongPassword));
        assert_eq!(auth.log_in_with_password("wrong", HERE, None, 103), Ok(PasswordLogin::RateLimited(3)));
        assert!(matches!(
            auth.log_in_with_password("correct horse battery", HERE, None, 106),
            Ok(PasswordLogin::LoggedIn { .. })
        ));
        // The number of attempts per minute is also limited for all addresses together.
        let attempts = (0..200u8).map(|n| auth.log_in_with_password("wrong", [10, 0, 0, n].into(), None, 240).unwrap());
        assert_eq!(attempts.filter(|t| *t == PasswordLogin::WrongPassword).count(), FAILURES_PER_MINUTE_MAX as usize);
    }
    #[test]
    fn a_browser_that_logged_in_before_is_not_locked_out_by_others() {
        // Aim: behind a proxy, where all share an address, nobody locks out the examiners. Method: others use up every
        // attempt of the address and of the minute; then a browser with its device cookie, with a forged one, and with
        // its own after too many guesses.
        let (mut auth, _) = Auth::new(&AuthMode::Password("correct horse battery".into())).unwrap();
        let right = "correct horse battery";
        let Ok(PasswordLogin::LoggedIn { device_cookie, .. }) = auth.log_in_with_password(right, HERE, None, 0) else {
            panic!("the password does not log in")
        };
        for n in 0..200u8 {
            auth.log_in_with_password("wrong", [10, 0, 0, n].into(), None, 60).unwrap();
            auth.log_in_with_password("wrong", HERE, None, 60).unwrap();
        }
        let forged =
            ["", "ö", &device_cookie[1..], &device_cookie.replace(&device_cookie[70..71], "x"), &"0".repeat(128)];
        for cookie in forged.into_iter().map(Some).chain([None]) {
            let outcome = auth.log_in_with_password(right, HERE, cookie, 60).unwrap();
            assert!(matches!(outcome, PasswordLogin::RateLimited(_)), "{cookie:?}: {outcome:?}");
        }
        let own = Some(device_cookie.as_str());
        assert!(matches!(auth.log_in_with_password(right, HERE, own, 60), Ok(PasswordLogin::LoggedIn { .. })));
        // A stolen cookie gives few guesses: its own are slowed down, and then it counts for nothing.
        let guesses = (0..10_000).filter(|second| {
            auth.log_in_with_password("wrong", HERE, own, 120 + second / 100) == Ok(PasswordLogin::WrongPassword)
        });
        assert!(guesses.count() < 30);
    }
}
