//! What is drawn in a DXF file: the entities that plans are made of, and the blocks that they are grouped in.
//!
//! # Source
//! Autodesk, DXF Reference (2012): ENTITIES and BLOCKS sections; `$INSUNITS` of the HEADER section.

use super::pairs::{Pairs, Value};
use crate::building::geometry::Point;
use std::collections::BTreeMap;

/// A drawing. **Units:** of the drawing.
#[derive(Clone, Debug, Default)]
pub struct Drawing {
    /// How long a unit is, if the drawing tells. **Units:** m.
    pub unit_m: Option<f64>,
    /// By name, in lower case.
    pub blocks: BTreeMap<String, Block>,
    pub entities: Vec<Entity>,
}

/// Entities that are drawn wherever they are inserted.
#[derive(Clone, Debug, Default)]
pub struct Block {
    /// What lies at the place of insertion.
    pub base: Point,
    pub entities: Vec<Entity>,
}

/// Something drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct Entity {
    pub layer: String,
    pub shape: Shape,
}

/// What is drawn. Angles are in degrees, counter-clockwise.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    Line([Point; 2]),
    /// Corners, each with the bulge of the side after it: the tangent of a quarter of its angle.
    Polyline {
        corners: Vec<(Point, f64)>,
        is_closed: bool,
        is_mirrored: bool,
    },
    Arc {
        centre: Point,
        radius: f64,
        angles: [f64; 2],
        is_mirrored: bool,
    },
    Circle {
        centre: Point,
        radius: f64,
        is_mirrored: bool,
    },
    Point(Point),
    Text(Point, String),
    Insert(Insert),
}

/// A block in its place, or in a field of places.
#[derive(Clone, Debug, PartialEq)]
pub struct Insert {
    pub block: String,
    pub place: Point,
    pub scale: [f64; 2],
    pub angle: f64,
    /// Columns and rows, and how far they are apart.
    pub counts: [f64; 2],
    pub spacing: [f64; 2],
    pub is_mirrored: bool,
}

/// More entities than this no plan has.
const MOST_ENTITIES: usize = 2_000_000;

/// A record: what begins with code 0.
struct Record<'a> {
    kind: String,
    pairs: Vec<(i32, Value<'a>)>,
    at: usize,
}

impl Record<'_> {
    fn texts(&self, code: i32) -> impl Iterator<Item = &str> {
        self.pairs.iter().filter(move |pair| pair.0 == code).filter_map(|pair| match &pair.1 {
            Value::Text(text) => Some(&**text),
            Value::Number(_) => None,
        })
    }

    fn text(&self, code: i32) -> &str {
        self.texts(code).next().unwrap_or_default()
    }

    fn number(&self, code: i32, default: f64) -> Result<f64, String> {
        match self.pairs.iter().find(|pair| pair.0 == code) {
            Some((_, value)) => self.finite(code, value),
            None => Ok(default),
        }
    }

    fn finite(&self, code: i32, value: &Value<'_>) -> Result<f64, String> {
        let number = match value {
            Value::Number(number) => *number,
            Value::Text(text) => text.trim().parse().unwrap_or(f64::NAN),
        };
        let kind = &self.kind;
        if number.is_finite() {
            Ok(number)
        } else {
            Err(format!("the {kind} at {}: code {code} is no number", self.at))
        }
    }

    fn point(&self) -> Result<Point, String> {
        Ok([self.number(10, 0.0)?, self.number(20, 0.0)?])
    }

    /// Seen from below: the third coordinate of the direction that is up for the entity is negative, and x points back.
    fn is_mirrored(&self) -> Result<bool, String> {
        Ok(self.number(230, 1.0)? < 0.0)
    }

    /// The corners of an LWPOLYLINE.
    fn corners(&self) -> Result<Vec<(Point, f64)>, String> {
        let mut corners: Vec<(Point, f64)> = Vec::new();
        for (code, value) in &self.pairs {
            match (code, corners.last_mut()) {
                (10, _) => corners.push(([self.finite(10, value)?, 0.0], 0.0)),
                (20, Some(last)) => last.0[1] = self.finite(20, value)?,
                (42, Some(last)) => last.1 = self.finite(42, value)?,
                _ => {}
            }
        }
        Ok(corners)
    }

    fn shape(&self) -> Result<Option<Shape>, String> {
        let is_mirrored = self.is_mirrored()?;
        Ok(Some(match &self.kind[..] {
            "LINE" => Shape::Line([self.point()?, [self.number(11, 0.0)?, self.number(21, 0.0)?]]),
            "LWPOLYLINE" => {
                let is_closed = self.number(70, 0.0)? as i64 & 1 == 1;
                Shape::Polyline { corners: self.corners()?, is_closed, is_mirrored }
            }
            "ARC" => Shape::Arc {
                centre: self.point()?,
                radius: self.number(40, 0.0)?,
                angles: [self.number(50, 0.0)?, self.number(51, 0.0)?],
                is_mirrored,
            },
            "CIRCLE" => Shape::Circle { centre: self.point()?, radius: self.number(40, 0.0)?, is_mirrored },
            "POINT" => Shape::Point(self.point()?),
            "TEXT" | "ATTRIB" => Shape::Text(self.point()?, plain(self.text(1))),
            "MTEXT" => Shape::Text(self.point()?, plain(&self.texts(3).chain(self.texts(1)).collect::<String>())),
            "INSERT" => Shape::Insert(Insert {
                block: self.text(2).to_lowercase(),
                place: self.point()?,
                scale: [self.number(41, 1.0)?, self.number(42, 1.0)?],
                angle: self.number(50, 0.0)?,
                counts: [self.number(70, 1.0)?, self.number(71, 1.0)?],
                spacing: [self.number(44, 0.0)?, self.number(45, 0.0)?],
                is_mirrored,
            }),
            _ => return Ok(None),
        }))
    }
}

/// The drawing in a file.
///
/// # Errors
/// When it is no DXF file, is cut short, or has more entities than a plan.
pub fn read(bytes: &[u8]) -> Result<Drawing, String> {
    let mut drawing = Drawing::default();
    let mut place = Reading::default();
    let mut current: Option<Record<'_>> = None;
    let mut is_whole = false;
    for pair in Pairs::of(bytes) {
        let pair = pair?;
        if pair.code == 0 {
            if let Some(record) = current.take() {
                place.add(&mut drawing, &record)?;
            }
            let Value::Text(kind) = &pair.value else { return Err("a record has no kind".to_owned()) };
            let kind = kind.trim().to_uppercase();
            if kind == "EOF" {
                is_whole = true;
                break;
            }
            current = Some(Record { kind, pairs: Vec::new(), at: pair.at });
        } else if let Some(record) = &mut current {
            if pair.code < 80 || (210..=230).contains(&pair.code) {
                record.pairs.push((pair.code, pair.value));
            }
        } else if pair.code != 999 {
            return Err(format!("it begins with code {}, not with a section", pair.code));
        }
    }
    if !is_whole {
        return Err("it is cut short: it has no 'EOF' at its end".to_owned());
    }
    if !place.had_entities {
        return Err("it has no section ENTITIES".to_owned());
    }
    Ok(drawing)
}

/// Where in a file one is.
#[derive(Default)]
struct Reading {
    section: String,
    block: Option<String>,
    had_entities: bool,
    count: usize,
    /// Whether vertices belong to the polyline before them.
    in_polyline: bool,
}

impl Reading {
    fn add(&mut self, drawing: &mut Drawing, record: &Record<'_>) -> Result<(), String> {
        match &record.kind[..] {
            "SECTION" => {
                self.section = record.text(2).trim().to_uppercase();
                self.had_entities |= self.section == "ENTITIES";
                if self.section == "HEADER" {
                    drawing.unit_m = unit(record)?;
                }
            }
            "ENDSEC" => self.section.clear(),
            "BLOCK" if self.section == "BLOCKS" => {
                let name = record.text(2).to_lowercase();
                drawing.blocks.insert(name.clone(), Block { base: record.point()?, entities: Vec::new() });
                self.block = Some(name);
            }
            "ENDBLK" => self.block = None,
            _ => self.entity(drawing, record)?,
        }
        Ok(())
    }

    fn entity(&mut self, drawing: &mut Drawing, record: &Record<'_>) -> Result<(), String> {
        let entities = match (&self.section[..], &self.block) {
            ("ENTITIES", _) => &mut drawing.entities,
            ("BLOCKS", Some(block)) => &mut drawing.blocks.entry(block.clone()).or_default().entities,
            _ => return Ok(()),
        };
        // Code 67 is 1 for what is on a sheet of paper around the plan.
        if record.number(67, 0.0)? == 1.0 {
            return Ok(());
        }
        self.count += 1;
        if self.count > MOST_ENTITIES {
            return Err(format!("it has more than {MOST_ENTITIES} entities"));
        }
        match &record.kind[..] {
            "POLYLINE" => {
                // Meshes (16 and 64) are no lines.
                let flags = record.number(70, 0.0)? as i64;
                self.in_polyline = flags & (16 | 64) == 0;
                if self.in_polyline {
                    let is_mirrored = record.is_mirrored()?;
                    let shape = Shape::Polyline { corners: Vec::new(), is_closed: flags & 1 == 1, is_mirrored };
                    entities.push(Entity { layer: record.text(8).trim().to_owned(), shape });
                }
            }
            "VERTEX" => {
                // Control points of a smoothed line (16) are not on it.
                let is_on_line = record.number(70, 0.0)? as i64 & 16 == 0;
                if let Some(Entity { shape: Shape::Polyline { corners, .. }, .. }) = entities.last_mut()
                    && self.in_polyline
                    && is_on_line
                {
                    corners.push((record.point()?, record.number(42, 0.0)?));
                }
            }
            "SEQEND" => self.in_polyline = false,
            _ => {
                self.in_polyline = false;
                let layer = record.text(8).trim().to_owned();
                entities.extend(record.shape()?.map(|shape| Entity { layer, shape }));
            }
        }
        Ok(())
    }
}

/// How long a unit is, by the variable `$INSUNITS`; nothing if it is not there or the drawing has none.
fn unit(header: &Record<'_>) -> Result<Option<f64>, String> {
    let named = |(code, value): &(i32, Value<'_>)| {
        *code == 9 && matches!(value, Value::Text(name) if name.trim().eq_ignore_ascii_case("$INSUNITS"))
    };
    let Some(at) = header.pairs.iter().position(named) else { return Ok(None) };
    let Some((70, value)) = header.pairs.get(at + 1) else { return Ok(None) };
    let metres = match header.finite(70, value)? as i64 {
        0 => return Ok(None),
        1 => 0.025_4,
        2 => 0.304_8,
        3 => 1_609.344,
        4 => 1e-3,
        5 => 1e-2,
        6 => 1.0,
        7 => 1e3,
        8 => 2.54e-8,
        9 => 2.54e-5,
        10 => 0.914_4,
        13 => 1e-6,
        14 => 0.1,
        15 => 10.0,
        16 => 100.0,
        21 => 1_200.0 / 3_937.0,
        other => return Err(format!("its unit ($INSUNITS) is {other}, in which nobody draws buildings")),
    };
    Ok(Some(metres))
}

/// A text without the codes that say how it looks.
fn plain(text: &str) -> String {
    let mut plain = String::new();
    let mut characters = text.chars();
    while let Some(character) = characters.next() {
        match character {
            '{' | '}' => {}
            '\\' => match characters.next() {
                Some(escaped @ ('\\' | '{' | '}')) => plain.push(escaped),
                Some('P' | 'N' | '~') => plain.push(' '),
                Some('A' | 'C' | 'c' | 'F' | 'f' | 'H' | 'p' | 'Q' | 'T' | 'W') => {
                    characters.by_ref().find(|end| *end == ';');
                }
                _ => {}
            },
            other => plain.push(other),
        }
    }
    plain.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_lose_their_looks() {
        let known = [
            ("Raum 101", "Raum 101"),
            (r"{\fArial|b0|i0;Raum\P101}", "Raum 101"),
            (r"\A1;\H2.5x;Raum \{a\}", "Raum {a}"),
            (r"\", ""),
            (r"\H2.5", ""),
        ];
        for (text, expected) in known {
            assert_eq!(plain(text), expected, "{text}");
        }
    }

    #[test]
    fn entities_are_read_with_their_layers_and_units() {
        let text = "0\nSECTION\n2\nHEADER\n9\n$INSUNITS\n70\n4\n0\nENDSEC\n\
            0\nSECTION\n2\nBLOCKS\n0\nBLOCK\n2\nTuer\n10\n1\n20\n2\n0\nLINE\n8\n0\n11\n5\n0\nENDBLK\n0\nENDSEC\n\
            0\nSECTION\n2\nENTITIES\n0\nPOLYLINE\n8\nEG\n70\n1\n0\nVERTEX\n10\n1\n20\n2\n42\n1\n0\nVERTEX\n10\n3\n20\n2\n\
            0\nSEQEND\n0\nLWPOLYLINE\n8\nEG\n10\n1\n20\n2\n10\n3\n20\n4\n0\nLINE\n67\n1\n8\nx\n0\nSPLINE\n8\ny\n\
            0\nINSERT\n2\nTUER\n8\nT\n10\n7\n0\nENDSEC\n0\nEOF\n";
        let drawing = read(text.as_bytes()).unwrap();
        assert_eq!(drawing.unit_m, Some(1e-3));
        assert_eq!(drawing.blocks["tuer"].base, [1.0, 2.0]);
        assert_eq!(drawing.blocks["tuer"].entities[0].shape, Shape::Line([[0.0, 0.0], [5.0, 0.0]]));
        assert_eq!(drawing.entities.len(), 3);
        let Shape::Polyline { corners, is_closed, .. } = &drawing.entities[0].shape else { panic!("no polyline") };
        assert_eq!((&corners[..], *is_closed), (&[([1.0, 2.0], 1.0), ([3.0, 2.0], 0.0)][..], true));
        let message = |from: &str, to: &str| read(text.replacen(from, to, 1).as_bytes()).unwrap_err();
        assert!(message("0\nEOF\n", "").contains("cut short"));
        assert!(message("10\n7", "10\n1e999").contains("the INSERT at 81: code 10 is no number"));
        assert!(message("70\n4", "70\n18").contains("$INSUNITS"));
        assert!(message("ENTITIES", "THINGS").contains("no section ENTITIES"));
        assert!(read(b"1\nx\n").unwrap_err().contains("begins with code 1"));
    }
}
