//! The description of a map: the YAML file beside its image, of which a handful of flat keys are used.
//!
//! # Source
//! ROS map_server, map format: `image`, `resolution`, `origin`, `occupied_thresh`, `free_thresh`, `negate`, `mode`.

use crate::building::error::Error;
use std::collections::BTreeMap;

/// How values of pixels are meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// The darker, the more likely occupied.
    Shades,
    /// The value is the likelihood of being occupied in percent.
    Raw,
}

/// What the description says.
#[derive(Clone, Debug, PartialEq)]
pub struct Info {
    /// The file of the image, from the folder of the description.
    pub image: String,
    /// Side of a pixel. **Units:** m.
    pub resolution_m: f64,
    /// Where the lower left corner of the image is, and how far its lower edge is turned from x. **Units:** m, m, rad.
    pub origin: [f64; 3],
    /// Likelihood above which a pixel is occupied.
    pub occupied: f64,
    /// Whether light is occupied.
    pub is_negated: bool,
    /// What the values of the pixels are.
    pub mode: Mode,
}

/// Whether a text looks like such a description.
pub fn is_info(text: &str) -> bool {
    let has = |key: &str| text.lines().any(|line| line.starts_with(key));
    has("image:") && has("resolution:")
}

impl Info {
    /// The description in a text; `file` names it in errors.
    ///
    /// # Errors
    /// When a key is missing or its value is none.
    pub fn parse(text: &str, file: &str) -> Result<Self, Error> {
        let wrong = |what: String| Error::Format { file: file.to_owned(), format: "map of map_server", what };
        let values = values(text);
        let get = |key: &str| values.get(key).map(|values| &values[..]);
        let number = |key: &str, default: Option<f64>| match (get(key), default) {
            (Some([text]), _) => {
                let value = text.parse().ok().filter(|value: &f64| value.is_finite());
                value.ok_or_else(|| wrong(format!("'{key}' is '{text}', which is no number")))
            }
            (None, Some(default)) => Ok(default),
            _ => Err(wrong(format!("'{key}' is missing or no single value"))),
        };
        let image = match get("image") {
            Some([image]) if !image.is_empty() => image.clone(),
            _ => return Err(wrong("'image' is missing".to_owned())),
        };
        let resolution_m = number("resolution", None)?;
        if !(1e-3..=10.0).contains(&resolution_m) {
            return Err(wrong(format!("'resolution' is {resolution_m}; expected metres from 0.001 to 10")));
        }
        let coordinate = |text: &String| text.parse().ok().filter(|value: &f64| value.abs() <= 1e6);
        let origin: Option<Vec<f64>> = get("origin").unwrap_or_default().iter().map(coordinate).collect();
        let Some([x, y, turn]) = origin.as_deref().and_then(|origin| <[f64; 3]>::try_from(origin).ok()) else {
            return Err(wrong("'origin' is missing or not three numbers, x, y and the angle".to_owned()));
        };
        let occupied = number("occupied_thresh", Some(0.65))?;
        if !(0.0..1.0).contains(&occupied) {
            return Err(wrong(format!("'occupied_thresh' is {occupied}; expected 0 to 1")));
        }
        let is_negated = match get("negate") {
            None => false,
            Some([text]) if ["0", "false"].contains(&&text.to_lowercase()[..]) => false,
            Some([text]) if ["1", "true"].contains(&&text.to_lowercase()[..]) => true,
            _ => return Err(wrong("'negate' is neither 0 nor 1".to_owned())),
        };
        let mode = match get("mode") {
            None => Mode::Shades,
            Some([text]) if text == "trinary" || text == "scale" => Mode::Shades,
            Some([text]) if text == "raw" => Mode::Raw,
            _ => return Err(wrong("'mode' is none of trinary, scale and raw".to_owned())),
        };
        Ok(Self { image, resolution_m, origin: [x, y, turn], occupied, is_negated, mode })
    }
}

/// The values of all keys that begin a line: one, or those of a list in brackets or of lines with dashes.
fn values(text: &str) -> BTreeMap<String, Vec<String>> {
    let mut found: BTreeMap<String, Vec<String>> = BTreeMap::new();
    let mut last = String::new();
    for line in text.lines() {
        // A sign of a comment follows a space or begins the line.
        let comment = line.find(" #").or_else(|| line.starts_with('#').then_some(0));
        let line = line[..comment.unwrap_or(line.len())].trim_end();
        let plain = |value: &str| value.trim().trim_matches(['"', '\'']).to_owned();
        if let Some(item) = line.trim_start().strip_prefix("- ") {
            found.entry(last.clone()).or_default().push(plain(item));
        } else if let Some((key, value)) = line.split_once(':').filter(|_| !line.starts_with(' ')) {
            key.trim().clone_into(&mut last);
            let value = value.trim();
            let list = value.strip_prefix('[').and_then(|rest| rest.strip_suffix(']'));
            let values = match list {
                Some(list) => list.split(',').map(plain).collect(),
                None if value.is_empty() => Vec::new(),
                None => vec![plain(value)],
            };
            found.insert(last.clone(), values);
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "# a map\nimage: \"my map.pgm\" # beside this\nresolution: 0.05\norigin: [-10.5, 2, 0.0]\n\
        negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n";

    #[test]
    fn descriptions_are_read_as_programs_write_them() {
        let info = Info::parse(TEXT, "map.yaml").unwrap();
        assert_eq!((info.image.as_str(), info.resolution_m, info.origin), ("my map.pgm", 0.05, [-10.5, 2.0, 0.0]));
        assert!(is_info(TEXT) && !is_info("name: x\n"));
        let listed = "image: m.png\nmode: raw\nresolution: 0.1\norigin:\n- 1\n- 2\n  - 3e-1\nnegate: true\n";
        let info = Info::parse(listed, "map.yaml").unwrap();
        assert_eq!((info.origin, info.is_negated, info.mode, info.occupied), ([1.0, 2.0, 0.3], true, Mode::Raw, 0.65));
    }

    #[test]
    fn what_is_wrong_is_told() {
        let message = |from: &str, to: &str| {
            assert!(TEXT.contains(from));
            Info::parse(&TEXT.replace(from, to), "map.yaml").unwrap_err().to_string()
        };
        assert_eq!(message("image", "picture"), "map.yaml is no map of map_server: 'image' is missing");
        assert!(message("0.05", "5 cm").contains("'resolution' is '5 cm', which is no number"));
        assert!(message("0.05", "nan").contains("no number"));
        assert!(message("0.05", "0").contains("expected metres"));
        assert!(message(", 0.0]", "]").contains("'origin' is missing or not three numbers"));
        assert!(message("-10.5", "1e300").contains("'origin'"));
        assert!(message("0.65", "65").contains("'occupied_thresh' is 65"));
        assert!(message("negate: 0", "negate: 2").contains("'negate'"));
    }
}
