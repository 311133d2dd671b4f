//! Which elements of an OSM file are part of a building, and the lines they are made of.

use super::data::{Data, Tags};
use super::levels::{self, Level};
use crate::building::geometry::{self, Point};
use crate::building::model::ConnectorKind;
use std::collections::{BTreeMap, BTreeSet};

/// A node, way or multipolygon that is part of a building.
#[derive(Clone, Debug)]
pub struct Element<'a> {
    /// As messages name it.
    pub name: String,
    pub tags: &'a Tags,
    /// Where it is; none if it does not tell.
    pub levels: BTreeSet<Level>,
    pub lines: Vec<Line>,
}

/// Nodes in order.
#[derive(Clone, Debug)]
pub struct Line {
    pub nodes: Vec<i64>,
    /// Whether it is the border of a hole.
    pub is_hole: bool,
}

impl Line {
    /// Whether it ends where it begins.
    pub fn is_closed(&self) -> bool {
        self.nodes.len() > 3 && self.nodes.first() == self.nodes.last()
    }
}

/// An element with places for nodes. **Units:** m; **Frame:** building.
#[derive(Clone, Debug, Default)]
pub struct Drawn {
    /// Closed lines; the repeated last corner is left out.
    pub outlines: Vec<Vec<Point>>,
    /// The same for holes.
    pub holes: Vec<Vec<Point>>,
    /// Lines that are not closed.
    pub lines: Vec<Vec<Point>>,
    /// The place of a node.
    pub point: Option<Point>,
}

impl Drawn {
    /// How many points it has.
    pub fn count(&self) -> usize {
        let lines = self.outlines.iter().chain(&self.holes).chain(&self.lines);
        lines.map(Vec::len).sum::<usize>() + usize::from(self.point.is_some())
    }
}

/// So many corners of outlines of buildings are looked at to find what is in them.
const MOST_LOOKS: usize = 500_000_000;
/// More elements than this are no building: a large station has ten thousand.
const MOST_ELEMENTS: usize = 200_000;

impl Element<'_> {
    /// The numbers of all its nodes.
    pub fn nodes(&self) -> impl Iterator<Item = i64> + '_ {
        self.lines.iter().flat_map(|line| line.nodes.iter().copied())
    }

    /// Whether it is an area, a wall or stairs indoors: where such are, there is a floor.
    pub fn is_indoors(&self) -> bool {
        let is_place =
            matches!(self.tags.get("indoor"), Some("room" | "corridor" | "area" | "wall" | "column" | "level"));
        is_place || (self.connector().is_some() && !self.levels.is_empty())
    }

    /// Whether it is the outline of a building.
    pub fn is_shell(&self) -> bool {
        self.tags.has("building") && !self.is_indoors() && self.lines.iter().any(Line::is_closed)
    }

    /// Whether one goes through walls there.
    pub fn is_door(&self) -> bool {
        let says_no = self.tags.is("door", "no") && !self.tags.has("entrance");
        !says_no && (self.tags.has("door") || self.tags.is("indoor", "door") || self.tags.has("entrance"))
    }

    /// What it is if it joins floors.
    pub fn connector(&self) -> Option<ConnectorKind> {
        let is = |word: &str| self.tags.is("room", word) || self.tags.is("highway", word) || self.tags.has(word);
        if is("elevator") {
            Some(ConnectorKind::Elevator)
        } else if is("stairs") || self.tags.is("highway", "steps") {
            Some(ConnectorKind::Stairs)
        } else if is("ramp") && self.tags.get("indoor").is_some() {
            Some(ConnectorKind::Ramp)
        } else {
            None
        }
    }

    /// Its lines, as far as their nodes have places.
    pub fn drawn(&self, places: &BTreeMap<i64, Point>) -> Drawn {
        let mut drawn = Drawn::default();
        for line in &self.lines {
            let mut points: Vec<Point> = line.nodes.iter().filter_map(|node| places.get(node).copied()).collect();
            if line.is_closed() {
                points.pop();
            }
            match (line.is_closed() && points.len() > 2, line.is_hole) {
                (true, false) => drawn.outlines.push(points),
                (true, true) => drawn.holes.push(points),
                (false, _) if points.len() > 1 => drawn.lines.push(points),
                (false, _) => drawn.point = drawn.point.or(points.first().copied()),
            }
        }
        drawn
    }
}

/// The elements that are part of the building: what is indoors, doors, and the outlines of buildings with something indoors.
///
/// # Errors
/// When one names a level that is none, or there are too many.
pub fn used(data: &Data) -> Result<Vec<Element<'_>>, String> {
    let mut found = Vec::new();
    for (id, node) in &data.nodes {
        let line = Line { nodes: vec![*id], is_hole: false };
        add(&mut found, format!("node {id}"), &node.tags, || vec![line])?;
    }
    for (id, way) in &data.ways {
        add(&mut found, format!("way {id}"), &way.tags, || vec![Line { nodes: way.nodes.clone(), is_hole: false }])?;
    }
    for (id, relation) in &data.relations {
        add(&mut found, format!("relation {id}"), &relation.tags, || {
            let mut lines = rings(data, &relation.ways, false);
            lines.extend(rings(data, &relation.ways, true));
            lines
        })?;
    }
    let indoors: Vec<Point> = found
        .iter()
        .filter(|element| element.is_indoors())
        .filter_map(|element| element.nodes().find_map(|node| data.nodes.get(&node)))
        .map(|node| node.place)
        .collect();
    let bounds = geometry::bounds(indoors.iter().copied());
    let mut looks = 0;
    let mut kept = Vec::new();
    for element in found {
        if element.is_shell() && !element.is_door() {
            let corners = element.nodes().filter_map(|node| data.nodes.get(&node)).map(|node| node.place);
            let (Some(all), Some(own)) = (bounds, geometry::bounds(corners)) else { continue };
            if (0..2).any(|axis| own[0][axis] > all[1][axis] || own[1][axis] < all[0][axis]) {
                continue;
            }
            let is_around = holds(&element, data, own, &indoors, &mut looks);
            if looks > MOST_LOOKS {
                return Err("too many buildings overlap what is indoors".to_owned());
            }
            if !is_around {
                continue;
            }
        }
        kept.push(element);
    }
    Ok(kept)
}

/// Whether the outline of a building is around anything indoors.
fn holds(shell: &Element<'_>, data: &Data, [low, high]: [Point; 2], indoors: &[Point], looks: &mut usize) -> bool {
    let places: BTreeMap<i64, Point> =
        shell.nodes().filter_map(|node| Some((node, data.nodes.get(&node)?.place))).collect();
    let outlines = shell.drawn(&places).outlines;
    let within = |point: &&Point| (0..2).all(|axis| (low[axis]..=high[axis]).contains(&point[axis]));
    // A room in a corner begins on the outline itself.
    let corners: BTreeSet<[u64; 2]> = places.values().map(|place| place.map(f64::to_bits)).collect();
    *looks += indoors.len();
    indoors.iter().filter(within).any(|point| {
        *looks += corners.len();
        *looks > MOST_LOOKS
            || corners.contains(&point.map(f64::to_bits))
            || outlines.iter().any(|outline| geometry::contains(outline, *point))
    })
}

fn add<'a>(
    found: &mut Vec<Element<'a>>,
    name: String,
    tags: &'a Tags,
    lines: impl FnOnce() -> Vec<Line>,
) -> Result<(), String> {
    let mut element = Element { name, tags, levels: BTreeSet::new(), lines: Vec::new() };
    if !["indoor", "building", "door", "entrance", "stairs", "elevator", "room", "highway"]
        .iter()
        .any(|key| tags.has(key))
    {
        return Ok(());
    }
    element.lines = lines();
    // Roads and the buildings around have levels of other kinds, which need not be understood.
    let could_be = element.is_door() || element.connector().is_some() || tags.has("indoor");
    if could_be {
        element.levels = levels::of(tags).map_err(|what| format!("{}: {what}", element.name))?;
    }
    if element.is_indoors() || element.is_shell() || element.is_door() {
        found.push(element);
    }
    if found.len() > MOST_ELEMENTS {
        return Err(format!("more than {MOST_ELEMENTS} of its elements are parts of buildings"));
    }
    Ok(())
}

/// The ways of a relation put together end to end.
fn rings(data: &Data, ways: &[(i64, bool)], holes: bool) -> Vec<Line> {
    let ways = ways.iter().filter(|(_, is_hole)| *is_hole == holes).filter_map(|(id, _)| data.ways.get(id));
    let pieces: Vec<&[i64]> = ways.map(|way| &way.nodes[..]).filter(|nodes| nodes.len() > 1).collect();
    let mut at_end: BTreeMap<i64, Vec<usize>> = BTreeMap::new();
    for (number, piece) in pieces.iter().enumerate() {
        for end in piece.first().into_iter().chain(piece.last()) {
            at_end.entry(*end).or_default().push(number);
        }
    }
    let mut taken = vec![false; pieces.len()];
    let mut lines = Vec::new();
    for start in 0..pieces.len() {
        if std::mem::replace(&mut taken[start], true) {
            continue;
        }
        let mut nodes = pieces[start].to_vec();
        while nodes.first() != nodes.last() {
            let Some(end) = nodes.last().copied() else { break };
            let Some(next) = at_end.get_mut(&end).and_then(|at| {
                at.retain(|number| !taken[*number]);
                at.first().copied()
            }) else {
                break;
            };
            taken[next] = true;
            let piece = pieces[next].iter();
            if pieces[next].first() == Some(&end) {
                nodes.extend(piece.skip(1));
            } else {
                nodes.extend(piece.rev().skip(1));
            }
        }
        lines.push(Line { nodes, is_hole: holes });
    }
    lines
}
