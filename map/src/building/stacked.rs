//! Stairs and elevators drawn floor by floor are joined where they lie above each other.

use super::error::Error;
use super::geometry::{self, Outline, Point};
use super::model::{Connector, ConnectorKind};
use std::collections::BTreeSet;

/// Stairs, a ramp or an elevator as one floor has it.
#[derive(Clone, Debug)]
pub(super) struct Part {
    /// Number of the floor.
    pub floor: i32,
    pub kind: ConnectorKind,
    /// What it is called, if it is.
    pub name: Option<String>,
    pub outline: Outline,
}

/// Centres of a staircase on two floors are no farther apart. **Units:** m.
const ABOVE_M: f64 = 4.0;

/// More parts than this no building has.
const MOST_PARTS: usize = 5_000;

/// The connectors of all parts. What is on one floor only joins nothing and is left out. Each has a name of its own: that of
/// a part, or its kind and a number.
///
/// # Errors
/// When there are too many parts.
pub(super) fn join(mut parts: Vec<Part>) -> Result<Vec<Connector>, Error> {
    if parts.len() > MOST_PARTS {
        return Err(Error::Model(format!("{} stairs and elevators are more than {MOST_PARTS}", parts.len())));
    }
    parts.sort_by_key(|part| part.floor);
    let mut connectors: Vec<Connector> = Vec::new();
    let (mut names, mut highest): (Vec<Option<String>>, Vec<(i32, Point)>) = (Vec::new(), Vec::new());
    for part in parts {
        let middle = geometry::centre(&part.outline);
        let far = |number: &usize| {
            let (floor, below) = highest[*number];
            let may_join = connectors[*number].kind == part.kind && floor < part.floor;
            if may_join { geometry::distance(below, middle) } else { f64::INFINITY }
        };
        let below = (0..connectors.len()).min_by(|a, b| far(a).total_cmp(&far(b)));
        match below.filter(|number| far(number) < ABOVE_M) {
            Some(number) => {
                highest[number] = (part.floor, middle);
                connectors[number].outlines.push((part.floor, part.outline));
                names[number] = names[number].take().or(part.name);
            }
            None => {
                highest.push((part.floor, middle));
                names.push(part.name);
                let outlines = vec![(part.floor, part.outline)];
                connectors.push(Connector { name: String::new(), kind: part.kind, outlines, way: Vec::new() });
            }
        }
    }
    let joining = connectors.into_iter().zip(names).filter(|(connector, _)| connector.outlines.len() > 1);
    Ok(named(joining.collect()))
}

fn named(connectors: Vec<(Connector, Option<String>)>) -> Vec<Connector> {
    let mut taken: BTreeSet<String> = BTreeSet::new();
    let mut done = Vec::new();
    for (mut connector, name) in connectors {
        let stem = name.unwrap_or_else(|| format!("{}-{}", connector.kind.word(), done.len() + 1));
        let mut free = stem.clone();
        let mut number = 1;
        while !taken.insert(free.clone()) {
            number += 1;
            free = format!("{stem}-{number}");
        }
        connector.name = free;
        done.push(connector);
    }
    done
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_lies_above_each_other_is_one_and_neighbours_stay_apart() {
        let part = |floor: i32, kind, x: f64, name: Option<&str>| Part {
            floor,
            kind,
            name: name.map(str::to_owned),
            outline: vec![[x, 0.0], [x + 2.0, 0.0], [x + 2.0, 2.0], [x, 2.0]],
        };
        let (stairs, elevator) = (ConnectorKind::Stairs, ConnectorKind::Elevator);
        let connectors = join(vec![
            part(1, stairs, 2.5, Some("B")),
            part(1, stairs, 0.1, None),
            part(0, stairs, 0.0, Some("A")),
            part(0, stairs, 2.4, None),
            part(0, elevator, 0.0, Some("A")),
            part(4, elevator, 0.2, None),
            part(2, stairs, 30.0, Some("alone")),
        ])
        .unwrap();
        let told: Vec<_> = connectors
            .iter()
            .map(|connector| {
                let floors: Vec<i32> = connector.outlines.iter().map(|(floor, _)| *floor).collect();
                (connector.name.as_str(), connector.kind, floors)
            })
            .collect();
        assert_eq!(told, [("A", stairs, vec![0, 1]), ("B", stairs, vec![0, 1]), ("A-2", elevator, vec![0, 4])]);
    }
}
