//! Tells what is no building.

use super::*;

#[test]
fn floors_have_numbers_by_name() {
    let known = [("EG", 0), ("1OG", 1), ("4. OG", 4), ("2UG", -2), ("UG", -1), ("F3", 3), ("B1", -1), ("-2", -2)];
    for (name, number) in known {
        assert_eq!(floor_number(name), Some(number), "{name}");
    }
    for name in ["", "roof", "F", "99999999999OG"] {
        assert_eq!(floor_number(name), None, "{name}");
    }
}

#[test]
fn what_is_no_building_is_told() {
    let home = tempfile::tempdir().unwrap();
    let message = |name: &str| open(&home.path().join(name), &Options::default()).unwrap_err().to_string();
    assert!(message("absent.geojson").ends_with("absent.geojson cannot be read"));
    fs::write(home.path().join("noise"), [0, 159, 146, 150]).unwrap();
    assert!(message("noise").ends_with("it is no text (UTF-8)"));
    fs::write(home.path().join("empty"), "").unwrap();
    assert!(message("empty").contains("nothing in it tells which format"));
    fs::create_dir(home.path().join("folder")).unwrap();
    assert!(message("folder").contains("the folder holds neither"));
    let floor = r#"{"type":"FeatureCollection","features":[{"type":"Feature","properties":{"ifc_class":"IfcWall"},"geometry":null}]}"#;
    fs::write(home.path().join("plan.geojson"), floor).unwrap();
    assert!(message("plan.geojson").contains("must be that of the floor"));
    fs::write(home.path().join("EG.geojson"), floor).unwrap();
    assert_eq!(message("EG.geojson"), "the building has no floors");
}
