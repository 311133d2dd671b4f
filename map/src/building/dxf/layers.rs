//! What is drawn on which layer of a DXF file.
//!
//! # Source
//! The graph document, table 6.2: polylines on the layer of the storey are the building, points and lines on `Graph` nodes and
//! edges, polygons on `Stiegen` stairs, points on `upstairs`, `downstairs` and `Lift` the ends of stairs and elevators.

use crate::building::error::Error;
use crate::building::open::floor_number;

/// What a layer holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    Walls,
    Doors,
    Rooms,
    Stairs,
    Ramps,
    Elevators,
    Entrances,
    Graph,
    Upstairs,
    Downstairs,
}

/// Names of layers, and what a drawing may leave open.
///
/// Capitals do not matter, and a `*` at the end stands for anything. What is not given is as in the default, which has the
/// names of the graph document and usual German ones.
#[derive(Clone, Debug, PartialEq, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Layers {
    /// Lines, arcs and polylines are walls. So are polylines on a layer that is called like a floor, such as `EG` or `1OG`.
    pub walls: Vec<String>,
    /// A line or the middle of a rectangle is a door, an arc is the swing of one, a point lies on the wall.
    pub doors: Vec<String>,
    /// Closed polylines are rooms, texts in them their names.
    pub rooms: Vec<String>,
    /// Closed polylines around stairs.
    pub stairs: Vec<String>,
    /// Closed polylines around ramps.
    pub ramps: Vec<String>,
    /// Closed polylines around elevators, or a point in each.
    pub elevators: Vec<String>,
    /// Points and lines where one comes in, texts beside them their names.
    pub entrances: Vec<String>,
    /// Lines are edges of the walk graph, points its nodes.
    pub graph: Vec<String>,
    /// Points: nodes where stairs end that lead up.
    pub upstairs: Vec<String>,
    /// Points: nodes where stairs end that lead down.
    pub downstairs: Vec<String>,
    /// How long a unit of the drawing is, whatever it says itself. **Units:** m.
    pub unit_m: Option<f64>,
    /// Of doors that are a point. **Units:** m.
    pub door_width_m: f64,
    /// The UTM zone (EPSG 326zz or 327zz) whose eastings and northings the coordinates are; without it they are anywhere.
    pub epsg: Option<u32>,
}

impl Default for Layers {
    fn default() -> Self {
        let names = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect();
        Self {
            walls: names(&["Stockwerk*", "Wand*", "W\u{e4}nde*", "Waende*", "Mauer*", "Wall*"]),
            doors: names(&["T\u{fc}r*", "Tuer*", "Door*"]),
            rooms: names(&["Raum*", "R\u{e4}ume*", "Raeume*", "Room*"]),
            stairs: names(&["Stiege*", "Treppe*", "Stairs"]),
            ramps: names(&["Rampe*", "Ramp", "Ramps"]),
            elevators: names(&["Lift*", "Aufzug*", "Aufz\u{fc}ge*", "Elevator*"]),
            entrances: names(&["Eingang*", "Eing\u{e4}nge*", "Entrance*"]),
            graph: names(&["Graph"]),
            upstairs: names(&["upstairs"]),
            downstairs: names(&["downstairs"]),
            unit_m: None,
            door_width_m: 0.9,
            epsg: None,
        }
    }
}

impl Layers {
    /// The names in a TOML text; `file` names it in errors.
    ///
    /// # Errors
    /// For a key that is not known, and for lengths that are none.
    pub fn parse(text: &str, file: &str) -> Result<Self, Error> {
        let wrong = |what: String| Error::Format { file: file.to_owned(), format: "table of layers", what };
        let layers: Self = toml::from_str(text).map_err(|error| wrong(error.message().to_owned()))?;
        if layers.unit_m.is_some_and(|unit| !(1e-8..=1e4).contains(&unit)) {
            return Err(wrong("unit_m: expected the length of a unit in metres, such as 0.001".to_owned()));
        }
        if !(0.3..=20.0).contains(&layers.door_width_m) {
            return Err(wrong("door_width_m: expected 0.3 to 20 metres".to_owned()));
        }
        Ok(layers)
    }

    fn all(&self) -> [(Role, &[String]); 10] {
        [
            (Role::Upstairs, &self.upstairs),
            (Role::Downstairs, &self.downstairs),
            (Role::Walls, &self.walls),
            (Role::Doors, &self.doors),
            (Role::Rooms, &self.rooms),
            (Role::Stairs, &self.stairs),
            (Role::Ramps, &self.ramps),
            (Role::Elevators, &self.elevators),
            (Role::Entrances, &self.entrances),
            (Role::Graph, &self.graph),
        ]
    }

    fn named(&self, layer: &str) -> Option<Role> {
        let layer = layer.to_lowercase();
        let is = |pattern: &String| {
            let pattern = pattern.to_lowercase();
            pattern.strip_suffix('*').map_or(pattern == layer, |start| layer.starts_with(start))
        };
        self.all().into_iter().find(|(_, patterns)| patterns.iter().any(is)).map(|(role, _)| role)
    }

    /// What a layer holds, and the name of the floor in front of its own (`EG_Graph`, `1OG-Stiegen`), if there is one.
    pub fn role<'a>(&self, layer: &'a str) -> Option<(Option<&'a str>, Role)> {
        if let Some(role) = self.named(layer) {
            return Some((None, role));
        }
        let is_floor = |name: &str| name.chars().any(char::is_alphabetic) && floor_number(name).is_some();
        for (at, separator) in layer.char_indices().filter(|(_, character)| "_-. |$".contains(*character)) {
            let (floor, rest) = (&layer[..at], &layer[at + separator.len_utf8()..]);
            if let Some(role) = self.named(rest)
                && floor_number(floor).is_some()
            {
                return Some((Some(floor), role));
            }
        }
        (layer.chars().count() > 1 && is_floor(layer)).then_some((Some(layer), Role::Walls))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layers_are_found_by_name_and_floor() {
        let layers = Layers::default();
        let known = [
            ("Stockwerk", Some((None, Role::Walls))),
            ("GRAPH", Some((None, Role::Graph))),
            ("W\u{c4}NDE innen", Some((None, Role::Walls))),
            ("upstairs", Some((None, Role::Upstairs))),
            ("EG_Graph", Some((Some("EG"), Role::Graph))),
            ("1. OG-Stiegen", Some((Some("1. OG"), Role::Stairs))),
            ("-1 Lift", Some((Some("-1"), Role::Elevators))),
            ("2OG", Some((Some("2OG"), Role::Walls))),
            ("0", None),
            ("G", None),
            ("M\u{f6}bel", None),
            ("M\u{f6}bel-Graph", None),
            ("Graph-alt", None),
        ];
        for (layer, expected) in known {
            assert_eq!(layers.role(layer), expected, "{layer}");
        }
    }

    #[test]
    fn the_example_for_people_is_a_table() {
        let page = include_str!("../../../../docs/building.md");
        let example = page.split("```toml").nth(1).and_then(|rest| rest.split("```").next()).unwrap();
        let layers = Layers::parse(example, "docs/building.md").unwrap();
        assert_eq!((layers.unit_m, layers.epsg), (Some(0.001), Some(32_633)));
        for pattern in Layers::default().all().into_iter().flat_map(|(_, patterns)| patterns.to_vec()) {
            assert!(page.contains(&format!("`{pattern}`")), "{pattern}");
        }
    }

    #[test]
    fn a_table_overrules_the_default() {
        let layers = Layers::parse("walls = ['A-WALL*']\nunit_m = 0.001", "l.toml").unwrap();
        assert_eq!(layers.role("a-wall-full"), Some((None, Role::Walls)));
        assert_eq!(layers.role("Wand"), None);
        assert_eq!(layers.role("Graph"), Some((None, Role::Graph)));
        let message = |text: &str| Layers::parse(text, "l.toml").unwrap_err().to_string();
        assert!(message("wals = []").contains("l.toml is no table of layers: unknown field `wals`"));
        assert!(message("unit_m = 0").contains("unit_m"));
        assert!(message("unit_m = nan").contains("unit_m"));
        assert!(message("door_width_m = -1.0").contains("door_width_m"));
    }
}
