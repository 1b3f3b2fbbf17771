//! Who is let in. Names by which the server may be asked for; tokens, which of them may be chosen, and what comes of guessing
//! them.

use std::collections::BTreeMap;
use std::net::{IpAddr, SocketAddr};
use std::sync::{Mutex, MutexGuard, PoisonError};

use axum::http::uri::Authority;
use umbracast::Error;

/// A shorter token is guessed too soon.
const SHORTEST: usize = 16;
/// So many wrong tokens within a minute close the door to an address for a minute.
const WRONG_MAX: usize = 10;
const MINUTE_NS: i64 = 60_000_000_000;
/// Addresses that are remembered; the oldest goes first.
const REMEMBERED: usize = 1024;

/// Refuses a token that does not stand in an address as it is, or is short.
///
/// # Errors
/// What was expected.
pub(super) fn check_token(token: &str) -> Result<(), Error> {
    if !token.bytes().all(|b| b.is_ascii_alphanumeric() || b"-._~".contains(&b)) {
        return Err(Error::new("UMBRACAST_TOKEN: expected letters, digits, - . _ ~, found something else"));
    }
    match token.len() {
        length if length < SHORTEST => Err(Error::new(format!(
            "UMBRACAST_TOKEN: expected {SHORTEST} characters or more, as `openssl rand -hex 16` gives, found {length}"
        ))),
        _ => Ok(()),
    }
}

/// Names under which the server may be asked for. A page of elsewhere whose name was made to lead here asks under that name.
#[derive(Debug)]
pub(super) struct Names {
    listens: IpAddr,
    given: Vec<String>,
}

impl Names {
    /// Loopback, the address that is listened on, and the names that somebody gave.
    ///
    /// # Errors
    /// A name that no `Host` can be: with a port, a path, or nothing.
    pub(super) fn new(listens: SocketAddr, given: &[String]) -> Result<Self, Error> {
        let is_name =
            |name: &&String| authority(name).is_some_and(|found| found == name.to_ascii_lowercase());
        if let Some(wrong) = given.iter().find(|name| !is_name(name)) {
            let story = format!("--host: expected a name or an address without a port, found {wrong:?}");
            return Err(Error::new(story));
        }
        let given = given.iter().map(|name| name.to_ascii_lowercase()).collect();
        Ok(Self { listens: listens.ip(), given })
    }

    /// Whether a `Host`, with or without a port, is one of them. Where all addresses are listened on, each of them is: a name
    /// can be made to lead here by whoever owns it, an address cannot.
    pub(super) fn hold(&self, host: &str) -> bool {
        let Some(name) = authority(host) else { return false };
        let address: Option<IpAddr> = name.parse().ok();
        let is_own = |address: IpAddr| {
            address.is_loopback() || self.listens.is_unspecified() || address == self.listens
        };
        name == "localhost" || address.is_some_and(is_own) || self.given.contains(&name)
    }
}

/// The name of a `Host`, in small letters, without its port and the brackets of an address.
fn authority(host: &str) -> Option<String> {
    let authority: Authority = host.parse().ok()?;
    let name = authority.host().trim_start_matches('[').trim_end_matches(']');
    (!name.is_empty()).then(|| name.to_ascii_lowercase())
}

/// Who guessed, and when, by the host's clock.
#[derive(Debug, Default)]
pub(super) struct Doors {
    wrong_ns: BTreeMap<IpAddr, Vec<i64>>,
}

impl Doors {
    /// Whether an address gave so many wrong tokens that it is not heard.
    pub(super) fn is_closed(&self, from: IpAddr, now_ns: i64) -> bool {
        self.wrong_ns.get(&from).is_some_and(|wrong_ns| {
            wrong_ns.len() >= WRONG_MAX && wrong_ns.last().is_some_and(|last| now_ns - last < MINUTE_NS)
        })
    }

    /// One more wrong token.
    pub(super) fn note_wrong(&mut self, from: IpAddr, now_ns: i64) {
        if self.wrong_ns.len() >= REMEMBERED && !self.wrong_ns.contains_key(&from) {
            let oldest = self.wrong_ns.iter().min_by_key(|(_, wrong_ns)| wrong_ns.last().copied());
            if let Some(oldest) = oldest.map(|(address, _)| *address) {
                self.wrong_ns.remove(&oldest);
            }
        }
        let wrong_ns = self.wrong_ns.entry(from).or_default();
        wrong_ns.retain(|at_ns| now_ns - at_ns < MINUTE_NS);
        wrong_ns.push(now_ns);
    }
}

/// A thread that panicked with it leaves nothing half done.
pub(super) fn lock(doors: &Mutex<Doors>) -> MutexGuard<'_, Doors> {
    doors.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ten_wrong_tokens_in_a_minute_close_the_door_to_that_address_for_a_minute() {
        let [guesser, other] = [1, 2].map(|last| IpAddr::from([10, 0, 0, last]));
        let mut doors = Doors::default();
        for k in 0..WRONG_MAX as i64 {
            assert!(!doors.is_closed(guesser, k * 1_000_000_000), "after {k}");
            doors.note_wrong(guesser, k * 1_000_000_000);
        }
        assert!(doors.is_closed(guesser, 10_000_000_000) && !doors.is_closed(other, 10_000_000_000));
        assert!(doors.is_closed(guesser, 68_000_000_000) && !doors.is_closed(guesser, 70_000_000_000));
        for k in 0..40 {
            doors.note_wrong(other, k * 7_000_000_000);
            assert!(!doors.is_closed(other, k * 7_000_000_000), "one in seven seconds is nobody who guesses");
        }
    }

    #[test]
    fn a_host_is_loopback_the_address_that_is_listened_on_or_a_name_that_was_given() {
        let names = |listens: &str, given: &[&str]| {
            Names::new(
                listens.parse().unwrap(),
                &given.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>(),
            )
        };
        let [own, all] =
            ["10.0.0.5:8600", "0.0.0.0:8600"].map(|at| names(at, &["Hall.example.org"]).unwrap());
        for host in ["localhost:8600", "127.0.0.1", "[::1]:8600", "10.0.0.5:8600", "hall.example.ORG:443"] {
            assert!(own.hold(host) && all.hold(host), "{host}");
        }
        assert!(all.hold("10.0.0.9:8600") && !own.hold("10.0.0.9:8600"));
        for host in
            ["", "evil.example", "hall.example.org.evil.example", "localhost.evil.example", "a b", "user@"]
        {
            assert!(!own.hold(host) && !all.hold(host), "{host}");
        }
        for wrong in ["hall:8600", "http://hall", "", "a/b", "user@hall"] {
            let told = names("10.0.0.5:8600", &[wrong]).unwrap_err().to_string();
            assert!(told.starts_with("--host: expected a name or an address without a port"), "{told}");
        }
    }

    #[test]
    fn a_short_token_is_refused_and_a_flood_of_addresses_is_forgotten() {
        assert!(check_token("0123456789abcdef").is_ok());
        let message = check_token("secret").unwrap_err().to_string();
        assert!(message.contains("16 characters") && message.contains("found 6"), "{message}");
        let mut doors = Doors::default();
        (0..5000_u32).for_each(|k| doors.note_wrong(IpAddr::from(k.to_be_bytes()), i64::from(k)));
        assert_eq!(doors.wrong_ns.len(), REMEMBERED);
    }
}
