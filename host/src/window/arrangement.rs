//! Where views are, as it is written down.

use super::layout::View;
use egui_dock::{DockState, Node, NodeIndex, Split, Surface, SurfaceIndex, Tree};
use serde::{Deserialize, Serialize};

/// A part of the window, with views or divided.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Part {
    /// Views one behind the other.
    Views {
        /// From left to right.
        views: Vec<View>,
        /// Which is in front.
        front: usize,
    },
    /// One part above another.
    Rows(Box<Division>),
    /// One part beside another.
    Columns(Box<Division>),
}

/// Two parts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Division {
    /// Above, or left.
    pub first: Part,
    /// Below, or right.
    pub second: Part,
    /// How much of it the first part takes.
    pub share: f32,
}

/// All of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Arrangement {
    /// In the window; nothing if all views are closed.
    pub docked: Option<Part>,
    /// Those that float, together as they are.
    pub floating: Vec<Part>,
}

/// Parts divided more often than this are no arrangement: each division doubles the room that it takes in memory.
const DEEPEST: usize = 12;

impl Arrangement {
    /// Of views as they are.
    pub fn of(dock: &DockState<View>) -> Self {
        let floating = dock.iter_surfaces().filter_map(|surface| match surface {
            Surface::Window(tree, _) => part(tree, NodeIndex::root()),
            Surface::Main(_) | Surface::Empty => None,
        });
        Self { docked: part(dock.main_surface(), NodeIndex::root()), floating: floating.collect() }
    }

    /// Puts views where they were.
    ///
    /// # Errors
    /// What is wrong: a part without views, or a share that is none.
    pub fn dock(&self) -> Result<DockState<View>, String> {
        self.docked.iter().chain(&self.floating).try_for_each(|part| part.check(0))?;
        let mut dock = DockState::new(self.docked.as_ref().map(|part| part.corner().to_vec()).unwrap_or_default());
        if let Some(part) = &self.docked {
            part.place(dock.main_surface_mut(), NodeIndex::root());
        }
        for part in &self.floating {
            let surface: SurfaceIndex = dock.add_window(part.corner().to_vec());
            part.place(&mut dock[surface], NodeIndex::root());
        }
        Ok(dock)
    }
}

impl Part {
    /// The views of its upper left corner.
    fn corner(&self) -> &[View] {
        match self {
            Self::Views { views, .. } => views,
            Self::Rows(division) | Self::Columns(division) => division.first.corner(),
        }
    }

    fn check(&self, depth: usize) -> Result<(), String> {
        match self {
            Self::Views { views, front } if *front >= views.len() => Err("a part without the view in front".into()),
            Self::Views { .. } => Ok(()),
            Self::Rows(division) | Self::Columns(division) => {
                if depth >= DEEPEST || !(0.0..=1.0).contains(&division.share) {
                    return Err(format!("a part is divided at {}", division.share));
                }
                division.first.check(depth + 1)?;
                division.second.check(depth + 1)
            }
        }
    }

    /// Divides a node that has the views of the corner.
    fn place(&self, tree: &mut Tree<View>, node: NodeIndex) {
        let (split, division) = match self {
            Self::Views { front, .. } => {
                // It was checked.
                let _ = tree.set_active_tab(node, *front);
                return;
            }
            Self::Rows(division) => (Split::Below, division),
            Self::Columns(division) => (Split::Right, division),
        };
        let [first, second] = tree.split_tabs(node, split, division.share, division.second.corner().to_vec());
        division.first.place(tree, first);
        division.second.place(tree, second);
    }
}

fn part(tree: &Tree<View>, node: NodeIndex) -> Option<Part> {
    let division = |share: f32| match (part(tree, node.left()), part(tree, node.right())) {
        (Some(first), Some(second)) => Ok(Box::new(Division { first, second, share })),
        (first, second) => Err(first.or(second)),
    };
    match tree.iter().nth(node.0)? {
        Node::Empty => None,
        Node::Leaf(leaf) => {
            let front = leaf.active.0.min(leaf.tabs.len().checked_sub(1)?);
            Some(Part::Views { views: leaf.tabs.clone(), front })
        }
        Node::Vertical(split) => division(split.fraction).map_or_else(|alone| alone, |two| Some(Part::Rows(two))),
        Node::Horizontal(split) => division(split.fraction).map_or_else(|alone| alone, |two| Some(Part::Columns(two))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn views(views: &[View]) -> Part {
        Part::Views { views: views.to_vec(), front: views.len() - 1 }
    }

    fn two(first: Part, second: Part, share: f32) -> Box<Division> {
        Box::new(Division { first, second, share })
    }

    #[test]
    fn views_come_back_to_where_they_were() {
        let bottom = Part::Columns(two(views(&[View::Plot(0), View::Plot(1)]), views(&[View::Plot(2)]), 0.5));
        let docked = Part::Rows(two(views(&[View::Map]), bottom, 0.7));
        let docked = Part::Columns(two(docked, views(&[View::Status]), 0.75));
        let floating = Part::Rows(two(views(&[View::Attitude]), views(&[View::Parameters]), 0.25));
        let arrangement = Arrangement { docked: Some(docked), floating: vec![floating] };
        assert_eq!(Arrangement::of(&arrangement.dock().unwrap()), arrangement);
        let nothing = Arrangement { docked: None, floating: Vec::new() };
        assert_eq!(Arrangement::of(&nothing.dock().unwrap()), nothing);
    }

    #[test]
    fn what_cannot_be_is_refused() {
        let refused = |part: Part| Arrangement { docked: Some(part), floating: Vec::new() }.dock().unwrap_err();
        assert!(refused(Part::Views { views: Vec::new(), front: 0 }).contains("in front"));
        assert!(refused(Part::Rows(two(views(&[View::Map]), views(&[View::Status]), f32::NAN))).contains("divided"));
        let mut deep = views(&[View::Map]);
        for number in 0..=DEEPEST {
            deep = Part::Rows(two(views(&[View::Plot(number)]), deep, 0.5));
        }
        assert!(refused(deep).contains("divided"));
    }
}
