//! Where a walk begins, in words.

use super::Error;
use crate::building::{Building, Entrance, geometry};
use crate::particle::{Start, StartPlace};

/// How well somebody knows a place whose coordinates were given (standard deviation). **Units:** m.
const GIVEN_SIGMA_M: f32 = 0.3;
/// And a heading. **Units:** rad.
const GIVEN_HEADING_SIGMA: f32 = 0.2;
/// And that it was this entrance. **Units:** m.
const ENTRANCE_SIGMA_M: f32 = 1.0;

/// What a start in words means in a building: `anywhere`, `entrances`, the name of a room or of an entrance, or
/// `FLOOR,X,Y[,HEADING_DEG]`. A room comes before an entrance of its name.
///
/// # Errors
/// For words that mean nothing there, and for `entrances` where there are none.
pub fn parse(building: &Building, text: &str) -> Result<Start, Error> {
    let at = |entrance: &Entrance| StartPlace {
        sigma_m: ENTRANCE_SIGMA_M,
        ..StartPlace::exactly(entrance.floor, entrance.place.map(|value| value as f32))
    };
    match text.trim() {
        "anywhere" => return Ok(Start::Anywhere),
        "entrances" => {
            let places: Vec<_> = building.entrances.iter().map(at).collect();
            return if places.is_empty() { Err(Error::NoEntrances) } else { Ok(Start::At(places)) };
        }
        _ => {}
    }
    if let Some((floor, room)) = building.room(text.trim()) {
        let area = geometry::area(&room.outline).abs();
        let middle = geometry::centre(&room.outline).map(|value| value as f32);
        // An even distribution over a square has 0.29 of its side as standard deviation.
        let sigma_m = 0.29 * area.sqrt() as f32;
        return Ok(Start::At(vec![StartPlace { sigma_m, ..StartPlace::exactly(floor.number, middle) }]));
    }
    if let Some(entrance) = building.entrances.iter().find(|entrance| entrance.name == text.trim()) {
        return Ok(Start::At(vec![at(entrance)]));
    }
    let wrong = || Error::Start(text.to_owned());
    let mut words = text.split(',').map(str::trim);
    let floor = words.next().and_then(|word| word.parse().ok()).ok_or_else(wrong)?;
    let numbers: Vec<f32> = words.map(str::parse).collect::<Result<_, _>>().map_err(|_| wrong())?;
    let (place, heading) = match numbers[..] {
        [x, y] => ([x, y], None),
        [x, y, heading] if heading.is_finite() => ([x, y], Some((heading.to_radians(), GIVEN_HEADING_SIGMA))),
        _ => return Err(wrong()),
    };
    Ok(Start::At(vec![StartPlace { floor, place, sigma_m: GIVEN_SIGMA_M, heading }]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::building::generate;

    #[test]
    fn a_start_is_read_as_it_is_meant() {
        let building = generate::twin(2);
        let at = |text: &str| match parse(&building, text) {
            Ok(Start::At(places)) => places,
            other => panic!("{other:?}"),
        };
        assert_eq!(parse(&building, "anywhere").unwrap(), Start::Anywhere);
        assert_eq!((at("entrances")[0].place, at("entrances")[0].floor), ([26.0, 0.3], 0));
        assert_eq!(at("main"), at("entrances"));
        assert_eq!(at("1, 26,7")[0], StartPlace { floor: 1, place: [26.0, 7.0], sigma_m: 0.3, heading: None });
        assert!((at("0,26,7,-90")[0].heading.unwrap().0 + std::f32::consts::FRAC_PI_2).abs() < 1e-6);
        let room = at("F1/W16")[0];
        assert!(room.floor == 1 && (room.sigma_m - 1.42).abs() < 0.05, "{room:?}");
        for wrong in ["", "nowhere", "0,1", "0,1,2,3,4", "0,x,2", "0,1,2,NaN"] {
            assert!(parse(&building, wrong).unwrap_err().to_string().starts_with("--start"), "{wrong}");
        }
    }
}
