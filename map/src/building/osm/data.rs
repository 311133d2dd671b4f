//! The elements of an OSM XML file: nodes, ways and relations with their tags.

use crate::building::error::Error;
use crate::building::geometry::Point;
use roxmltree::{Document, Node, ParsingOptions};
use std::collections::BTreeMap;

/// Keys and values of an element.
#[derive(Clone, Debug, Default)]
pub struct Tags(BTreeMap<String, String>);

impl Tags {
    /// The value of a key, if there is one that says something.
    pub fn get(&self, key: &str) -> Option<&str> {
        self.0.get(key).map(|value| value.trim()).filter(|value| !value.is_empty())
    }

    /// Whether a key has this value.
    pub fn is(&self, key: &str, value: &str) -> bool {
        self.get(key) == Some(value)
    }

    /// Whether a key is there and not `no`.
    pub fn has(&self, key: &str) -> bool {
        self.get(key).is_some_and(|value| value != "no")
    }

    /// The first of some keys that has a value.
    pub fn first(&self, keys: &[&str]) -> Option<String> {
        keys.iter().find_map(|key| self.get(key)).map(str::to_owned)
    }
}

/// A node.
#[derive(Clone, Debug)]
pub struct Place {
    /// Longitude and latitude. **Units:** degrees.
    pub place: Point,
    pub tags: Tags,
}

/// A way.
#[derive(Clone, Debug)]
pub struct Way {
    /// Numbers of the nodes, in order; the first again at the end of a closed way.
    pub nodes: Vec<i64>,
    pub tags: Tags,
}

/// A relation of ways.
#[derive(Clone, Debug)]
pub struct Relation {
    /// Numbers of the ways, and whether they are the border of holes.
    pub ways: Vec<(i64, bool)>,
    pub tags: Tags,
}

/// All elements by their number.
#[derive(Clone, Debug, Default)]
pub struct Data {
    pub nodes: BTreeMap<i64, Place>,
    pub ways: BTreeMap<i64, Way>,
    pub relations: BTreeMap<i64, Relation>,
}

/// Elements and tags of a file; the map of a city district has some hundred thousand.
const MOST_NODES: u32 = 4_000_000;

/// The elements of a text; what was deleted in an editor is left out.
///
/// # Errors
/// When it is no OSM XML.
pub fn read(text: &str, file: &str) -> Result<Data, Error> {
    let wrong = |what: String| Error::Format { file: file.to_owned(), format: "OSM XML", what };
    let options = ParsingOptions { nodes_limit: MOST_NODES, ..ParsingOptions::default() };
    let document = Document::parse_with_options(text, options).map_err(|error| wrong(error.to_string()))?;
    let root = document.root_element();
    if root.tag_name().name() != "osm" {
        return Err(wrong(format!("its outermost element is '{}', not 'osm'", root.tag_name().name())));
    }
    let mut data = Data::default();
    for element in root.children().filter(Node::is_element) {
        let kind = element.tag_name().name();
        if !matches!(kind, "node" | "way" | "relation") || is_deleted(&element) {
            continue;
        }
        let id: i64 = number(&element, "id").ok_or_else(|| wrong(format!("a {kind} has no number ('id')")))?;
        let tags = tags(&element);
        match kind {
            "node" => {
                let degrees = |key| number::<f64>(&element, key).filter(|value| value.is_finite());
                let (Some(longitude), Some(latitude)) = (degrees("lon"), degrees("lat")) else {
                    return Err(wrong(format!("node {id} has no 'lon' and 'lat' that are numbers")));
                };
                data.nodes.insert(id, Place { place: [longitude, latitude], tags });
            }
            "way" => {
                let nodes = element.children().filter(|child| child.has_tag_name("nd"));
                let nodes = nodes.filter_map(|child| number(&child, "ref")).collect();
                data.ways.insert(id, Way { nodes, tags });
            }
            _ => {
                let members = element.children().filter(|child| child.has_tag_name("member"));
                let ways = members.filter(|member| member.attribute("type") == Some("way"));
                let ways = ways.filter_map(|way| Some((number(&way, "ref")?, way.attribute("role") == Some("inner"))));
                data.relations.insert(id, Relation { ways: ways.collect(), tags });
            }
        }
    }
    Ok(data)
}

fn is_deleted(element: &Node<'_, '_>) -> bool {
    element.attribute("action") == Some("delete") || element.attribute("visible") == Some("false")
}

fn number<T: std::str::FromStr>(element: &Node<'_, '_>, key: &str) -> Option<T> {
    element.attribute(key)?.trim().parse().ok()
}

fn tags(element: &Node<'_, '_>) -> Tags {
    let tags = element.children().filter(|child| child.has_tag_name("tag"));
    Tags(tags.filter_map(|tag| Some((tag.attribute("k")?.to_owned(), tag.attribute("v")?.to_owned()))).collect())
}
