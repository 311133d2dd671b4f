//! The walk graph: the building as a net of places and ways, for routes and for trackers that walk on it.
//!
//! [`Graph`] is the storage: nodes, and two directed edges for each way that is drawn, in an indexed adjacency list. [`paths`]
//! finds shortest ways, [`route`] tells them in words, [`tracker`] follows somebody on them as the document
//! does, [`matcher`] with several hypotheses. [`adjacency`] is the table in
//! which graphs are exchanged, [`draw`](mod@draw) makes a graph from walls, doors and stairs, [`lint`](mod@lint) finds what a
//! tracker would stumble over.
//!
//! # Source
//! Graph, chapters 5 and 6.2.

pub mod adjacency;
pub mod draw;
mod error;
pub mod lint;
pub mod matcher;
mod model;
pub mod paths;
pub mod route;
pub mod speed;
pub mod tracker;

pub use error::Error;
pub use model::{Edge, EdgeId, EdgeKind, Graph, NodeId};
