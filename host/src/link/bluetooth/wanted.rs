//! Which shoe is wanted: `any`, a name, or an address.

use super::radio::Sighting;
use std::fmt;

/// Which shoe.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Wanted {
    /// The one that is heard best.
    Any,
    /// The one of this name, in capitals or not.
    Name(String),
    /// The one of this address: six pairs of hexadecimal digits, or what macOS has instead.
    Address(String),
}

impl Wanted {
    /// Reads what stands behind `ble:`; none if nothing does.
    pub fn parse(text: &str) -> Option<Self> {
        let text = text.trim();
        if text.is_empty() {
            return None;
        }
        Some(match address(text) {
            _ if text.eq_ignore_ascii_case("any") => Self::Any,
            Some(address) => Self::Address(address),
            None => Self::Name(text.to_owned()),
        })
    }

    /// Whether this is the shoe.
    pub fn is(&self, shoe: &Sighting) -> bool {
        match self {
            Self::Any => true,
            Self::Name(name) => shoe.name.as_ref().is_some_and(|shoe| shoe.eq_ignore_ascii_case(name)),
            Self::Address(address) => shoe.address.eq_ignore_ascii_case(address),
        }
    }
}

/// The text as an address, in the form in which systems tell it.
fn address(text: &str) -> Option<String> {
    let hexadecimal = |part: &str| part.bytes().all(|byte| byte.is_ascii_hexdigit());
    let parts: Vec<&str> = text.split([':', '-']).collect();
    if !parts.iter().all(|part| hexadecimal(part)) {
        return None;
    }
    let lengths: Vec<usize> = parts.iter().map(|part| part.len()).collect();
    match lengths[..] {
        [2, 2, 2, 2, 2, 2] => Some(parts.join(":").to_ascii_uppercase()),
        [8, 4, 4, 4, 12] => Some(parts.join("-").to_ascii_uppercase()),
        _ => None,
    }
}

impl fmt::Display for Wanted {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Any => out.write_str("any"),
            Self::Name(text) | Self::Address(text) => out.write_str(text),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shoe(name: Option<&str>, address: &str) -> Sighting {
        Sighting { name: name.map(str::to_owned), address: address.to_owned(), signal_dbm: Some(-60) }
    }

    #[test]
    fn a_shoe_is_named_by_name_or_address_or_not_at_all() {
        assert_eq!(Wanted::parse(" "), None);
        assert_eq!(Wanted::parse("ANY"), Some(Wanted::Any));
        assert_eq!(Wanted::parse("Sohle-1A2B"), Some(Wanted::Name("Sohle-1A2B".into())));
        assert_eq!(Wanted::parse("c0-5e-00-00-00-0a"), Some(Wanted::Address("C0:5E:00:00:00:0A".into())));
        let macos = "6e400001-b5a3-f393-e0a9-e50e24dcca9e";
        assert_eq!(Wanted::parse(macos), Some(Wanted::Address(macos.to_uppercase())));
        // Not quite an address: a name.
        assert_eq!(Wanted::parse("c0:5e:00:00:00"), Some(Wanted::Name("c0:5e:00:00:00".into())));
    }

    #[test]
    fn only_the_shoe_that_was_named_is_it() {
        let (left, right) = (shoe(Some("Sohle-1A2B"), "C0:5E:00:00:00:0A"), shoe(None, "C0:5E:00:00:00:0B"));
        let is = |text: &str, shoe: &Sighting| Wanted::parse(text).unwrap().is(shoe);
        assert!(is("any", &left) && is("any", &right));
        assert!(is("sohle-1a2b", &left) && !is("Sohle-1A2B", &right) && !is("Sohle-1A2", &left));
        assert!(is("c0:5e:00:00:00:0b", &right) && !is("c0:5e:00:00:00:0b", &left));
    }
}
