//! The devices that have paired with the shoe by Bluetooth, and the keys shared with them.

use heapless::Vec;
use serde::{Deserialize, Serialize};

/// So many devices are remembered.
pub const BONDS: usize = 4;

/// A device that has paired.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Bond {
    /// Kind of the identity address: 0 public, 1 random and static (Bluetooth Core Specification 5.4, volume 4, part E,
    /// 7.8.12).
    pub address_kind: u8,
    /// Identity address, the lowest byte first.
    pub address: [u8; 6],
    /// Identity resolving key, by which a device that changes its address is known, the lowest byte first.
    pub identity_key: Option<[u8; 16]>,
    /// Long-term key, the lowest byte first.
    pub long_term_key: [u8; 16],
}

impl Bond {
    /// Whether both are of one device.
    pub fn is_of_same(&self, other: &Self) -> bool {
        let known = self.identity_key.is_some() && self.identity_key == other.identity_key;
        known || (self.address_kind, self.address) == (other.address_kind, other.address)
    }
}

/// All of them, the oldest first.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Bonds(Vec<Bond, BONDS>);

impl Bonds {
    /// None.
    pub const NONE: Self = Self(Vec::new());

    /// Adds a device; another bond with the same gives way, or else the oldest when there is no room: told is which.
    pub fn add(&mut self, bond: Bond) -> Option<Bond> {
        let same = self.0.iter().position(|known| known.is_of_same(&bond));
        let place = same.or_else(|| self.0.is_full().then_some(0));
        let gone = place.map(|place| self.0.remove(place));
        // There is room: one has given way, or none had to.
        let _ = self.0.push(bond);
        gone
    }

    /// The bonds, the oldest first.
    pub fn iter(&self) -> impl Iterator<Item = &Bond> {
        self.0.iter()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bond(number: u8) -> Bond {
        Bond { address_kind: 1, address: [number; 6], identity_key: None, long_term_key: [number ^ 0xff; 16] }
    }

    #[test]
    fn the_fifth_takes_the_place_of_the_oldest() {
        let mut bonds = Bonds::NONE;
        assert!((0..4).all(|number| bonds.add(bond(number)).is_none()));
        assert_eq!(bonds.add(bond(4)), Some(bond(0)));
        assert!(bonds.iter().map(|bond| bond.address[0]).eq(1..=4));
    }

    #[test]
    fn who_pairs_again_is_the_newest_and_takes_nobodys_place() {
        let mut bonds = Bonds::NONE;
        (0..4).for_each(|number| assert_eq!(bonds.add(bond(number)), None));
        let again = Bond { long_term_key: [9; 16], ..bond(1) };
        assert_eq!(bonds.add(again), Some(bond(1)));
        assert!(bonds.iter().map(|bond| bond.address[0]).eq([0, 2, 3, 1]));
        // By its resolving key, under another address.
        let private = Bond { identity_key: Some([3; 16]), ..bond(7) };
        assert_eq!(bonds.add(private), Some(bond(0)));
        assert_eq!(bonds.add(Bond { address: [8; 6], ..private }), Some(private));
    }
}
