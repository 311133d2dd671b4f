//! What can be wrong with a building.

/// Why there is no building.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The file cannot be read or written.
    #[error("{file} cannot be read")]
    File {
        /// Its name.
        file: String,
        /// Why.
        #[source]
        source: std::io::Error,
    },
    /// The text is not of the format.
    #[error("{file} is no {format}: {what}")]
    Format {
        /// Its name.
        file: String,
        /// Of which format it should be.
        format: &'static str,
        /// What is wrong.
        what: String,
    },
    /// A feature of the file makes no sense.
    #[error("{file}, feature {index}: {what}")]
    Feature {
        /// Its name.
        file: String,
        /// Counted from 1.
        index: usize,
        /// What is wrong.
        what: String,
    },
    /// The parts do not make a building.
    #[error("{0}")]
    Model(String),
}
