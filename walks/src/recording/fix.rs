//! What other sources said of the place while a walk was recorded: each fix as it was said, in its own frame, so that a replay
//! judges it anew.

use super::message::{Decoder, Encoder, Message};
use crate::fixes::{Fix, Frame, Measured};
use nalgebra::Matrix2;
use sohle_shared::time::Micros;

/// Code of a place in longitude and latitude.
const GEOGRAPHIC: u32 = 4_326;
/// Code of the frame of the building, which has none.
const BUILDING: u32 = 0;

impl Message for Fix {
    const TOPIC: &'static str = "/fix";
    const SCHEMA: &'static str = "sohle/msg/Fix";
    const DEFINITION: &'static str = "\
# A position, or a distance to an anchor, as its source said it.
# when it was measured and when it came, by the clock of the steps
int64 time_us
int64 arrived_us
# of the person or the anchor, in the frame
float64[2] place
# m^2, of a position along the axes of the frame, row by row; of a distance the first is its variance, the others are 0
float64[4] covariance
# m; of a position both are 0
float64 range
float64 anchor_above
# EPSG; 0 is the frame of the building in metres
uint32 frame
# 0 unless floor_known
int32 floor
string source
bool is_range
bool floor_known
";

    fn time(&self) -> Micros {
        // On the time line it stands where it was heard.
        let Self { arrived, .. } = self;
        *arrived
    }

    fn put(&self, out: &mut Encoder) {
        let (place, covariance, range, above, is_range) = match self.measured {
            Measured::Position { place, covariance: c } => {
                (place, [c[(0, 0)], c[(0, 1)], c[(1, 0)], c[(1, 1)]], 0.0, 0.0, false)
            }
            Measured::Range { anchor, above_m, metres, sigma_m } => {
                (anchor, [sigma_m * sigma_m.abs(), 0.0, 0.0, 0.0], metres, above_m, true)
            }
        };
        out.time(self.time);
        out.time(self.arrived);
        out.f64s(&place);
        out.f64s(&covariance);
        out.f64s(&[range, above]);
        out.u32(match self.frame {
            Frame::Building => BUILDING,
            Frame::Geographic => GEOGRAPHIC,
            Frame::Utm(epsg) => epsg,
        });
        out.i32(self.floor.unwrap_or(0));
        out.string(&self.source);
        out.flags([is_range, self.floor.is_some()]);
    }

    fn take(from: &mut Decoder<'_>) -> Option<Self> {
        let (time, arrived) = (from.time()?, from.time()?);
        let place = from.f64s()?;
        let [xx, xy, yx, yy] = from.f64s()?;
        let [metres, above_m] = from.f64s()?;
        let frame = match from.u32()? {
            BUILDING => Frame::Building,
            GEOGRAPHIC => Frame::Geographic,
            epsg => Frame::Utm(epsg),
        };
        let floor = from.i32()?;
        let source = from.string()?.into();
        let (is_range, floor_known) = (from.flag()?, from.flag()?);
        let measured = if is_range {
            Measured::Range { anchor: place, above_m, metres, sigma_m: xx.signum() * xx.abs().sqrt() }
        } else {
            Measured::Position { place, covariance: Matrix2::new(xx, xy, yx, yy) }
        };
        Some(Self { time, arrived, source, frame, measured, floor: floor_known.then_some(floor) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn frame() -> impl Strategy<Value = Frame> {
        prop_oneof![Just(Frame::Building), Just(Frame::Geographic), (32_601_u32..32_661).prop_map(Frame::Utm)]
    }

    fn measured() -> impl Strategy<Value = Measured> {
        let position = (any::<[f64; 2]>(), any::<[f64; 4]>());
        let position =
            position.prop_map(|(place, c)| Measured::Position { place, covariance: Matrix2::from_row_slice(&c) });
        let range = (any::<[f64; 2]>(), any::<f64>(), any::<f64>(), -40_i32..40);
        // Squares and roots of powers of two are exact.
        let range = range.prop_map(|(anchor, above_m, metres, power)| {
            let sigma_m = 2.0_f64.powi(power);
            Measured::Range { anchor, above_m, metres, sigma_m }
        });
        prop_oneof![position, range]
    }

    proptest! {
        #[test]
        fn every_fix_comes_back_and_no_part_of_one_does(
            (time, arrived, floor) in any::<(i64, i64, Option<i32>)>(),
            source in "\\PC{0,12}",
            frame in frame(),
            measured in measured(),
        ) {
            let source = source.as_str().into();
            let fix = Fix { time: Micros(time), arrived: Micros(arrived), source, frame, measured, floor };
            let mut buffer = Encoder::default();
            let bytes = fix.encode(&mut buffer).to_vec();
            prop_assert_eq!(Fix::decode(&bytes), Some(fix));
            for length in 0..bytes.len() {
                prop_assert_eq!(Fix::decode(&bytes[..length]), None);
            }
        }
    }

    #[test]
    fn the_name_of_a_source_is_a_string_of_cdr() {
        let measured = Measured::Position { place: [1.0, 2.0], covariance: Matrix2::identity() };
        let source = "5g".into();
        let fix =
            Fix { time: Micros(1), arrived: Micros(2), source, frame: Frame::Building, measured, floor: Some(-1) };
        let mut buffer = Encoder::default();
        let bytes = fix.encode(&mut buffer);
        // Length with the zero at the end, then the bytes; the number is aligned to four from the encapsulation on.
        let at = 4 + 2 * 8 + 8 * 8 + 4 + 4;
        assert_eq!((at - 4) % 4, 0);
        assert_eq!(bytes[at..], [3, 0, 0, 0, b'5', b'g', 0, 0, 1]);
    }
}
