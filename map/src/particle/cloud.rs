//! The particles.

/// Particles of a block: what one task moves at a time. Fixed, so that the result does not depend on the number of
/// threads.
pub(super) const BLOCK: usize = 4_096;

/// One hypothesis of where the person is (Foot, 5.3).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Particle {
    /// **Units:** m; **Frame:** building, east.
    pub x: f32,
    /// **Units:** m; **Frame:** building, north.
    pub y: f32,
    /// **Units:** m; **Frame:** building, up.
    pub z: f32,
    /// Direction of the heading frame of the last stance. **Units:** rad, in [-pi, pi]; **Frame:** building,
    /// counter-clockwise from east.
    pub heading: f32,
    /// How much longer steps really are than they were measured, as a factor.
    pub scale: f32,
    /// How likely, up to a factor that all share.
    pub weight: f32,
    /// Which floor of the map, counted from the lowest.
    pub floor: u16,
    /// Which connector it stands in, or [`Particle::ON_FLOOR`].
    pub connector: u16,
}

impl Particle {
    /// In no connector.
    pub const ON_FLOOR: u16 = u16::MAX;

    /// Whether its height is free.
    pub fn is_in_connector(&self) -> bool {
        self.connector != Self::ON_FLOOR
    }
}

const _: () = assert!(size_of::<Particle>() == 28);
