//! What a command ends with when it could not do what was asked.

use std::error::Error as StdError;
use std::fmt;

/// One line for the user. Made from the error of any layer by `?`; the causes below it are appended.
///
/// It is not itself a [`std::error::Error`], so that every error can be turned into it.
#[derive(Debug, PartialEq, Eq)]
pub struct Error(String);

impl Error {
    /// An error that has no cause below it.
    pub fn new(message: impl Into<String>) -> Self {
        Self(message.into().split_whitespace().collect::<Vec<_>>().join(" "))
    }
}

impl fmt::Display for Error {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(&self.0)
    }
}

impl<E: StdError> From<E> for Error {
    fn from(error: E) -> Self {
        let mut message = error.to_string();
        let mut cause = error.source();
        while let Some(below) = cause {
            let told = below.to_string();
            // Some errors already quote what is below them.
            if !message.contains(&told) {
                message = format!("{message}: {told}");
            }
            cause = below.source();
        }
        Self::new(message)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, thiserror::Error)]
    #[error("walk.csv cannot be read")]
    struct Outer(#[source] std::io::Error);

    #[test]
    fn causes_are_appended_in_one_line() {
        let below = std::io::Error::other("disk\nburnt");
        assert_eq!(Error::from(Outer(below)).to_string(), "walk.csv cannot be read: disk burnt");
    }
}
