//! What can be wrong with a walk graph.

/// Why there is no graph, or no way in it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Nobody has drawn one.
    #[error("the building has no walk graph; 'sohle building graph' draws one")]
    None,
    /// An edge that joins a node with itself.
    #[error("edge {edge} of the graph joins the node at ({x:.2}, {y:.2}) on floor {floor} with itself; remove it")]
    Loop {
        /// Its number, counted from 0.
        edge: usize,
        /// Of the node. **Units:** m.
        x: f64,
        /// Of the node. **Units:** m.
        y: f64,
        /// Of the node.
        floor: i32,
    },
    /// More nodes or edges than can be numbered.
    #[error("the graph has more than {} edges", u32::MAX)]
    TooLarge,
    /// A row of an adjacency list makes no sense.
    #[error("{file}, line {line}: {what}")]
    Row {
        /// Name of the file.
        file: String,
        /// Counted from 1; the headings are line 1.
        line: u64,
        /// What is wrong, and what was expected.
        what: String,
    },
    /// The rows of an adjacency list contradict each other.
    #[error("{file}: {what}")]
    List {
        /// Name of the file.
        file: String,
        /// What is wrong, and its cure.
        what: String,
    },
    /// A setting of the matcher makes no sense.
    #[error("settings of the matcher: {0}")]
    Setting(String),
    /// Nobody can begin there.
    #[error("the walk graph has no edge on floor {0}")]
    NoFloor(i32),
    /// No way leads there.
    #[error("{0}")]
    NoWay(String),
}
