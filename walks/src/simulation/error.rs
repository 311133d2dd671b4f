//! Why a simulation is refused.

/// Why a simulation is refused.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A number makes no sense.
    #[error("{place}: {what} = {value} is not possible")]
    Value {
        /// Which part of the scenario.
        place: String,
        /// Which quantity.
        what: &'static str,
        /// What it was.
        value: f64,
    },
    /// The scenario's text is not a scenario.
    #[error("line {line}: {message}")]
    Text {
        /// Where; the first line is 1.
        line: usize,
        /// What is wrong and what was expected.
        message: String,
    },
    /// An endless route without any end.
    #[error("the route is endless: a duration or a number of strides is needed")]
    Endless,
}
