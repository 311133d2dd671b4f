//! The pairs of code and value that a DXF file is made of, in its text form and its binary one.
//!
//! # Source
//! Autodesk, DXF Reference (2012): group codes in numerical order; ASCII and binary DXF files.

use std::borrow::Cow;

/// How a binary file begins.
pub const BINARY: &[u8; 22] = b"AutoCAD Binary DXF\r\n\x1a\0";

/// A value; numbers of the text form are still text.
#[derive(Clone, Debug, PartialEq)]
pub enum Value<'a> {
    Text(Cow<'a, str>),
    Number(f64),
}

/// A value and what it is.
#[derive(Clone, Debug, PartialEq)]
pub struct Pair<'a> {
    pub code: i32,
    pub value: Value<'a>,
    /// Line of the code, or byte of a binary file.
    pub at: usize,
}

/// Reads one pair after the other.
#[derive(Debug)]
pub struct Pairs<'a> {
    bytes: &'a [u8],
    /// The next byte.
    next: usize,
    /// The next line; nothing in a binary file.
    line: Option<usize>,
    /// Codes of a binary file before release 13 have one byte.
    is_old: bool,
}

/// How many bytes a value has in a binary file.
enum Width {
    Text,
    Double,
    Integer(usize),
    Chunk,
}

fn width(code: i32) -> Width {
    match code {
        1004 | 310..=319 => Width::Chunk,
        10..=59 | 110..=149 | 210..=239 | 460..=469 | 1010..=1059 => Width::Double,
        60..=79 | 170..=179 | 270..=289 | 370..=389 | 400..=409 | 1060..=1070 => Width::Integer(2),
        90..=99 | 420..=429 | 440..=459 | 1071 => Width::Integer(4),
        160..=169 => Width::Integer(8),
        290..=299 => Width::Integer(1),
        _ => Width::Text,
    }
}

impl<'a> Pairs<'a> {
    /// The pairs of a file.
    pub fn of(bytes: &'a [u8]) -> Self {
        if let Some(rest) = bytes.strip_prefix(BINARY) {
            // The first pair is 0, SECTION: its text follows after one byte or after two.
            return Self {
                bytes,
                next: BINARY.len(),
                line: None,
                is_old: rest.get(1).is_some_and(|second| *second != 0),
            };
        }
        let next = if bytes.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 };
        Self { bytes, next, line: Some(1), is_old: false }
    }

    fn text_line(&mut self) -> Option<Cow<'a, str>> {
        let rest = self.bytes.get(self.next..).filter(|rest| !rest.is_empty())?;
        let length = rest.iter().position(|byte| *byte == b'\n').unwrap_or(rest.len());
        self.next += length + 1;
        self.line = self.line.map(|line| line + 1);
        let line = &rest[..length];
        Some(decoded(line.strip_suffix(b"\r").unwrap_or(line)))
    }

    fn text_pair(&mut self, at: usize) -> Option<Result<Pair<'a>, String>> {
        let code = self.text_line()?;
        if code.trim().is_empty() && self.next >= self.bytes.len() {
            return None;
        }
        let Ok(code) = code.trim().parse() else {
            return Some(Err(format!("line {at} is '{}', where a code is expected", code.trim().escape_debug())));
        };
        let Some(value) = self.text_line() else {
            return Some(Err(format!("it ends after line {at}, before the value of its last code")));
        };
        Some(Ok(Pair { code, value: Value::Text(value), at }))
    }

    fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let taken = self.bytes.get(self.next..self.next.checked_add(count)?)?;
        self.next += count;
        Some(taken)
    }

    fn integer(&mut self, count: usize) -> Option<i64> {
        let taken = self.take(count)?;
        let value = taken.iter().rev().fold(0_u64, |value, byte| value << 8 | u64::from(*byte));
        // The sign is that of the highest byte.
        let unused = 64 - 8 * count as u32;
        Some((value << unused) as i64 >> unused)
    }

    fn code(&mut self) -> Option<i32> {
        if self.is_old {
            let short = self.take(1)?[0];
            if short < 255 {
                return Some(i32::from(short));
            }
        }
        self.integer(2).and_then(|code| i32::try_from(code).ok())
    }

    fn binary_value(&mut self, code: i32) -> Option<Value<'a>> {
        Some(match width(code) {
            Width::Integer(count) => Value::Number(self.integer(count)? as f64),
            Width::Double => Value::Number(f64::from_le_bytes(self.take(8)?.try_into().ok()?)),
            Width::Chunk => {
                let length = usize::from(self.take(1)?[0]);
                self.take(length)?;
                Value::Text(Cow::Borrowed(""))
            }
            Width::Text => {
                let length = self.bytes.get(self.next..)?.iter().position(|byte| *byte == 0)?;
                let text = self.take(length)?;
                self.next += 1;
                Value::Text(decoded(text))
            }
        })
    }
}

impl<'a> Iterator for Pairs<'a> {
    type Item = Result<Pair<'a>, String>;

    fn next(&mut self) -> Option<Self::Item> {
        if let Some(line) = self.line {
            return self.text_pair(line);
        }
        if self.next >= self.bytes.len() {
            return None;
        }
        let at = self.next;
        let pair = self.code().and_then(|code| Some(Pair { code, value: self.binary_value(code)?, at }));
        Some(pair.ok_or_else(|| format!("it ends within the value at byte {at}")))
    }
}

/// UTF-8, or what is none as the western code page of older files, in which letters are those of Latin-1. Characters that
/// are written as `\U+` and four hexadecimal digits are put in.
fn decoded(bytes: &[u8]) -> Cow<'_, str> {
    let latin = || Cow::Owned(bytes.iter().map(|byte| char::from(*byte)).collect());
    let text = std::str::from_utf8(bytes).map_or_else(|_| latin(), Cow::Borrowed);
    if !text.contains(ESCAPE) {
        return text;
    }
    let mut parts = text.split(ESCAPE);
    let mut whole = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let digits = part.get(..4).and_then(|digits| u32::from_str_radix(digits, 16).ok());
        match digits.and_then(char::from_u32) {
            Some(character) => {
                whole.push(character);
                whole.push_str(&part[4..]);
            }
            None => whole.extend([ESCAPE, part]),
        }
    }
    Cow::Owned(whole)
}

/// Begins a character that the file cannot write.
const ESCAPE: &str = "\\U+";

#[cfg(test)]
mod tests {
    use super::*;

    fn read(bytes: &[u8]) -> Result<Vec<(i32, Value<'_>)>, String> {
        Pairs::of(bytes).map(|pair| pair.map(|pair| (pair.code, pair.value))).collect()
    }

    fn text(text: &str) -> Value<'_> {
        Value::Text(Cow::Borrowed(text))
    }

    #[test]
    fn characters_beyond_the_code_page_are_put_in() {
        for (written, meant) in [
            (r"T\U+00FCr\U+00E4", "T\u{fc}r\u{e4}"),
            (r"\U+zz", r"\U+zz"),
            (r"\U+00F", r"\U+00F"),
            ("\\U+00\u{e4}\u{e4}", "\\U+00\u{e4}\u{e4}"),
        ] {
            assert_eq!(decoded(written.as_bytes()), meant);
        }
    }

    #[test]
    fn both_forms_say_the_same() {
        let lines = b"  0\r\nSECTION\r\n 8\r\nW\xe4nde\n10\n-1.5\n\n";
        assert_eq!(read(lines).unwrap(), [(0, text("SECTION")), (8, text("W\u{e4}nde")), (10, text("-1.5"))]);
        let value = (-1.5_f64).to_le_bytes();
        let new =
            [&BINARY[..], b"\0\0SECTION\0\x08\0W\xc3\xa4nde\0\x0a\0", &value, b"\x46\0\xff\xff\x36\x01\x02ab"].concat();
        let rest = [(8, text("W\u{e4}nde")), (10, Value::Number(-1.5)), (70, Value::Number(-1.0)), (310, text(""))];
        assert_eq!(read(&new).unwrap()[1..], rest);
        let old =
            [&BINARY[..], b"\0SECTION\0\x08W\xc3\xa4nde\0\x0a", &value, b"\x46\xff\xff\xff\x36\x01\x02ab"].concat();
        assert_eq!(read(&old).unwrap()[1..], rest);
    }

    #[test]
    fn what_is_cut_short_is_told() {
        assert!(read(b"0\nSECTION\nx\n").unwrap_err().contains("line 3 is 'x'"));
        assert!(read(b"0\nSECTION\n10\n").unwrap_err().contains("ends after line 3"));
        let cut = [&BINARY[..], b"\0\0SECTION\0\x0a\0\0\0"].concat();
        assert!(read(&cut).unwrap_err().contains("ends within the value"));
        assert!(read(&[&BINARY[..], b"\0\0SECTION"].concat()).is_err());
    }
}
