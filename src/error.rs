//! The one error type of set-up. It is opaque, and its message has all details. The running pipeline never fails; it
//! counts what it cannot use in [`crate::Health`].

use std::fmt;

/// What went wrong while something was set up or opened. The message names file, place, expected and found.
///
/// ```
/// let error = umbracast::Config::with_overlay(umbracast::Mode::Default, "sight = 3", "hall.toml").unwrap_err();
/// assert!(error.to_string().starts_with("hall.toml:1:1: unknown key `sight`"));
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Error {
    message: String,
}

impl Error {
    /// An error with its story.
    ///
    /// ```
    /// assert_eq!(umbracast::Error::new("expected a name, found none").to_string(), "expected a name, found none");
    /// ```
    pub fn new(message: impl Into<String>) -> Self {
        Self { message: message.into() }
    }

    /// The same error, with the file or place it happened in put before it.
    ///
    /// ```
    /// let error = umbracast::Error::new("expected a name, found none").within("site.sensors[1]");
    /// assert_eq!(error.to_string(), "site.sensors[1]: expected a name, found none");
    /// ```
    #[must_use]
    pub fn within(self, place: impl fmt::Display) -> Self {
        Self { message: format!("{place}: {}", self.message) }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for Error {}
