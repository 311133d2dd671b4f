//! Why somebody cannot be followed.

use crate::{building, particle};

/// Why there is no follower.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The filter refused the building, the start or a setting.
    #[error(transparent)]
    Particle(#[from] particle::Error),
    /// The building is of no use.
    #[error(transparent)]
    Building(#[from] building::Error),
    /// A start in words that mean nothing.
    #[error(
        "--start '{0}': expected anywhere, entrances, the name of a room or of an entrance, or FLOOR,X,Y[,HEADING_DEG] in numbers"
    )]
    Start(String),
    /// A start at entrances that are not there.
    #[error("the building has no entrances to start from")]
    NoEntrances,
    /// Nothing could ever be learned.
    #[error(
        "the building '{0}' has no walls, so a start that is not known can never be found: add its walls, or tell where the \
         walk begins (--start FLOOR,X,Y,HEADING_DEG)"
    )]
    NoWalls(String),
}
