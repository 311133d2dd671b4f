//! What can be wrong with a map, a start or a setting.

/// Why there is no particle filter.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A building without floors.
    #[error("the building has no floors")]
    NoFloors,
    /// More than can be numbered.
    #[error("{count} {what} are more than the {most} that can be told apart")]
    TooMany {
        /// Of what.
        what: &'static str,
        /// How many there are.
        count: usize,
        /// And how many may be.
        most: usize,
    },
    /// A coordinate is no number or too large.
    #[error("floor {floor} has a point that is more than {most_m} m from the origin of the building, or no number")]
    Beyond {
        /// Number of the floor.
        floor: i32,
        /// The limit.
        most_m: f32,
    },
    /// Floors that do not lie one above the other.
    #[error("floor {floor} does not lie above floor {below}")]
    Order {
        /// Number of the floor.
        floor: i32,
        /// Number of the one before.
        below: i32,
    },
    /// A connector on a floor that is not there.
    #[error("a connector names the floor of index {index}, which is not there")]
    NoSuchFloor {
        /// The index.
        index: usize,
    },
    /// The start names no floor of the building.
    #[error("the building has no floor {floor} to start on; it has {floors}")]
    StartFloor {
        /// Number that was asked for.
        floor: i32,
        /// Those there are.
        floors: String,
    },
    /// The start lies outside.
    #[error(
        "the start ({x:.2}, {y:.2}) m on floor {floor} is outside of the building, which reaches from {low:.2?} to {high:.2?} m"
    )]
    StartOutside {
        /// Number of the floor.
        floor: i32,
        /// East.
        x: f32,
        /// North.
        y: f32,
        /// Lower left corner.
        low: [f32; 2],
        /// Upper right corner.
        high: [f32; 2],
    },
    /// No start at all.
    #[error("there is no place to start from")]
    NoStart,
    /// A setting beyond its bounds.
    #[error("setting {name} is {value}; it has to be from {low} to {high}")]
    Setting {
        /// Which.
        name: &'static str,
        /// Its value.
        value: f32,
        /// Least.
        low: f32,
        /// Most.
        high: f32,
    },
}
