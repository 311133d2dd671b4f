//! Finds in a building what breaks tracking: each finding with its place and its cure.
//!
//! What is looked at and from where on it is an error is told by [`Kind`]. A finding is an error if a person who walks
//! correctly would be taken for lost there, and a warning if it only costs or confuses.

mod reach;
mod shape;
mod walls;

use super::geometry::Point;
use super::model::Building;

/// How bad it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Level {
    /// Tracking fails here.
    Error,
    /// Should be looked at.
    Warning,
}

/// What is wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// Longitude and latitude, or east and north, are the wrong way round. An error.
    AxisOrder,
    /// A floor has no walls at all. An error.
    NoWalls,
    /// A gap between walls, narrower than a door and no door. An error.
    Leak,
    /// Walls that miss each other by centimetres. A warning.
    TinyGap,
    /// A wall runs through a door. An error.
    ClosedDoor,
    /// No way leads to a floor. An error.
    UnreachableFloor,
    /// No way leads to a room. An error.
    UnreachableRoom,
    /// Stairs, a ramp or an elevator that cannot be entered on a floor, or that join nothing. An error.
    MeetsNothing,
    /// The outline of a room, stairs, a ramp or an elevator crosses itself. An error.
    SelfCrossing,
    /// The same wall twice. A warning.
    DoubleWall,
    /// An edge of the walk graph without a length. An error.
    ZeroEdge,
    /// An edge of the walk graph through a wall. An error.
    EdgeThroughWall,
    /// A part of the walk graph that is not joined to the rest. An error.
    SeparatePiece,
    /// Stairs, a ramp or an elevator of the walk graph that end nowhere, or are not in it. An error.
    LeadsNowhere,
    /// A room with a door that the walk graph does not lead into. An error.
    RoomOffGraph,
    /// An edge of the walk graph so short that a turn is looked for at the wrong node. A warning.
    ShortEdge,
    /// An edge of the walk graph so long that the heading drifts on it. A warning.
    LongEdge,
    /// Two edges of the walk graph that leave a node in nearly the same direction. A warning.
    NarrowFork,
    /// A crossing of the walk graph that does not have the way of those who cut its corner. A warning.
    MissingDiagonal,
}

impl Kind {
    /// How bad it is.
    pub fn level(self) -> Level {
        match self {
            Self::TinyGap
            | Self::DoubleWall
            | Self::ShortEdge
            | Self::LongEdge
            | Self::NarrowFork
            | Self::MissingDiagonal => Level::Warning,
            _ => Level::Error,
        }
    }

    /// In a list.
    pub fn word(self) -> &'static str {
        match self {
            Self::AxisOrder => "axis order",
            Self::NoWalls => "no walls",
            Self::Leak => "leak",
            Self::TinyGap => "tiny gap",
            Self::ClosedDoor => "closed door",
            Self::UnreachableFloor => "unreachable floor",
            Self::UnreachableRoom => "unreachable room",
            Self::MeetsNothing => "meets nothing",
            Self::SelfCrossing => "self-crossing",
            Self::DoubleWall => "double wall",
            Self::ZeroEdge => "zero edge",
            Self::EdgeThroughWall => "edge through wall",
            Self::SeparatePiece => "separate piece",
            Self::LeadsNowhere => "leads nowhere",
            Self::RoomOffGraph => "room off graph",
            Self::ShortEdge => "short edge",
            Self::LongEdge => "long edge",
            Self::NarrowFork => "narrow fork",
            Self::MissingDiagonal => "missing diagonal",
        }
    }
}

/// Something that is wrong.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Finding {
    /// What.
    pub kind: Kind,
    /// How bad it is.
    pub level: Level,
    /// On which floor, if on one.
    pub floor: Option<i32>,
    /// Where, if at a place. **Units:** m; **Frame:** building.
    pub place: Option<Point>,
    /// In which room, if in one.
    pub room: Option<String>,
    /// In a sentence.
    pub what: String,
    /// What to do about it.
    pub cure: String,
}

/// Looks at a building. The findings are sorted: errors first, then by kind, floor and place.
pub fn check(building: &Building) -> Vec<Finding> {
    let mut notes = Notes::of(building);
    shape::check(building, &mut notes);
    walls::check(building, &mut notes);
    reach::check(building, &mut notes);
    sorted(notes.findings())
}

/// Errors first, then by kind, floor and place.
pub fn sorted(mut findings: Vec<Finding>) -> Vec<Finding> {
    let place = |finding: &Finding| finding.place.unwrap_or_default();
    findings.sort_by(|a, b| {
        let key = |finding: &Finding| (finding.level, finding.kind, finding.floor);
        let by_place = || {
            let ([ax, ay], [bx, by]) = (place(a), place(b));
            ax.total_cmp(&bx).then(ay.total_cmp(&by))
        };
        key(a).cmp(&key(b)).then_with(by_place)
    });
    findings
}

/// Findings as they are noted.
pub(crate) struct Notes<'a> {
    building: &'a Building,
    findings: Vec<Finding>,
}

impl<'a> Notes<'a> {
    /// No findings yet.
    pub(crate) fn of(building: &'a Building) -> Self {
        Self { building, findings: Vec::new() }
    }

    /// All that were noted.
    pub(crate) fn findings(self) -> Vec<Finding> {
        self.findings
    }

    /// Notes a finding at a place of a floor, in the room that is there.
    pub(crate) fn at(&mut self, kind: Kind, floor: i32, place: Point, what: String, cure: &str) {
        let room = self.building.floor(floor).and_then(|floor| floor.room_at(place)).map(|room| room.name.clone());
        self.note(kind, Some(floor), Some(place), room, what, cure);
    }

    pub(crate) fn note(
        &mut self,
        kind: Kind,
        floor: Option<i32>,
        place: Option<Point>,
        room: Option<String>,
        what: String,
        cure: &str,
    ) {
        let cure = cure.to_owned();
        self.findings.push(Finding { kind, level: kind.level(), floor, place, room, what, cure });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::building::generate;
    use crate::building::{Connector, ConnectorKind, Door, Floor, Georeference, Room};

    fn rectangle(x0: f64, y0: f64, x1: f64, y1: f64) -> Vec<Point> {
        vec![[x0, y0], [x1, y0], [x1, y1], [x0, y1]]
    }

    /// Two rooms of 4 m by 4 m side by side with a door between them, and one from outside into the left.
    fn house() -> Building {
        let walls = vec![
            [[0.0, 0.0], [8.0, 0.0]],
            [[8.0, 0.0], [8.0, 4.0]],
            [[8.0, 4.0], [0.0, 4.0]],
            [[0.0, 4.0], [0.0, 2.0]],
            [[0.0, 1.0], [0.0, 0.0]],
            [[4.0, 0.0], [4.0, 1.0]],
            [[4.0, 2.0], [4.0, 4.0]],
        ];
        let door = |x: f64| Door { line: [[x, 1.0], [x, 2.0]], name: None };
        let room = |name: &str, outline| Room { name: name.into(), usage: None, outline };
        let floor = Floor {
            walls,
            doors: vec![door(0.0), door(4.0)],
            rooms: vec![room("left", rectangle(0.0, 0.0, 4.0, 4.0)), room("right", rectangle(4.0, 0.0, 8.0, 4.0))],
            ..Floor::default()
        };
        let entrances =
            vec![crate::building::Entrance { name: "main".into(), floor: 0, place: [0.5, 1.5], beacon: None }];
        Building { floors: vec![floor], entrances, ..Building::default() }
    }

    fn kinds(building: Building) -> Vec<Kind> {
        check(&building.assembled().unwrap()).into_iter().map(|finding| finding.kind).collect()
    }

    #[test]
    fn sound_buildings_have_no_findings() {
        assert_eq!(kinds(house()), []);
        for building in [generate::twin(2), generate::large(1)] {
            assert_eq!(check(&building), []);
        }
    }

    #[test]
    fn a_gap_that_is_no_door_is_a_leak_and_told_once() {
        let mut building = house();
        building.floors[0].walls[6][0][1] = 2.4;
        building.floors[0].doors[1].line[1][1] = 1.9;
        // The door ends 0.5 m before the wall goes on.
        let findings = check(&building.assembled().unwrap());
        assert_eq!(findings.iter().map(|finding| finding.kind).collect::<Vec<_>>(), [Kind::Leak], "{findings:?}");
        let finding = &findings[0];
        assert_eq!((finding.floor, finding.level), (Some(0), Level::Error));
        let [x, y] = finding.place.unwrap();
        assert!((x - 4.0).abs() < 0.01 && (1.9..2.4).contains(&y), "{x} {y}");
        assert!(finding.what.contains("0.50 m"), "{}", finding.what);

        let mut building = house();
        // In the middle of an outer wall: two ends look at each other.
        building.floors[0].walls[1] = [[8.0, 0.0], [8.0, 2.0]];
        building.floors[0].walls.push([[8.0, 2.3], [8.0, 4.0]]);
        assert_eq!(kinds(building), [Kind::Leak]);
    }

    #[test]
    fn walls_that_miss_by_a_centimetre_are_warned_of() {
        let mut building = house();
        building.floors[0].walls[1][1][1] = 3.99;
        assert_eq!(kinds(building), [Kind::TinyGap]);
    }

    #[test]
    fn a_wall_through_a_door_closes_it_and_the_room_behind_it() {
        let mut building = house();
        building.floors[0].walls.push([[4.0, 1.0], [4.0, 2.0]]);
        assert_eq!(kinds(building), [Kind::ClosedDoor, Kind::UnreachableRoom]);
    }

    #[test]
    fn a_room_without_a_door_is_unreachable_and_named() {
        let mut building = house();
        building.floors[0].doors.pop();
        building.floors[0].walls.push([[4.0, 1.0], [4.0, 2.0]]);
        let findings = check(&building.assembled().unwrap());
        assert_eq!(findings.len(), 1, "{findings:?}");
        assert_eq!((findings[0].kind, findings[0].room.as_deref()), (Kind::UnreachableRoom, Some("right")));
    }

    #[test]
    fn doubled_walls_are_told_once_for_each_pair() {
        let mut building = house();
        building.floors[0].walls.push([[6.0, 0.0], [2.0, 0.0]]);
        assert_eq!(kinds(building), [Kind::DoubleWall]);
    }

    #[test]
    fn outlines_that_cross_themselves_are_told_where() {
        let mut building = house();
        building.floors[0].rooms[1].outline.swap(1, 2);
        let findings = check(&building.assembled().unwrap());
        assert_eq!(findings[0].kind, Kind::SelfCrossing);
        assert_eq!((findings[0].room.as_deref(), findings[0].place), (Some("right"), Some([6.0, 2.0])));
    }

    #[test]
    fn a_floor_without_walls_is_told() {
        let mut building = house();
        building.floors[0].walls.clear();
        assert_eq!(kinds(building), [Kind::NoWalls]);
    }

    fn with_stairs(area: Vec<Point>) -> Building {
        let mut building = house();
        let mut upper = building.floors[0].clone();
        (upper.number, upper.height_m) = (1, 3.0);
        building.floors.push(upper);
        let outlines = vec![(0, area.clone()), (1, area)];
        building.connectors = vec![Connector { name: "A".into(), kind: ConnectorKind::Stairs, outlines, way: vec![] }];
        building
    }

    #[test]
    fn stairs_must_be_entered_on_every_floor() {
        let area = rectangle(6.0, 2.0, 8.0, 4.0);
        assert_eq!(kinds(with_stairs(area.clone())), []);
        let mut walled = with_stairs(area.clone());
        walled.floors[1].walls.extend([[[6.0, 2.0], [8.0, 2.0]], [[6.0, 2.0], [6.0, 4.0]]]);
        let found = kinds(walled);
        assert_eq!(found, [Kind::UnreachableFloor, Kind::MeetsNothing]);
        let mut lonely = with_stairs(area);
        lonely.connectors[0].outlines.pop();
        assert_eq!(kinds(lonely), [Kind::UnreachableFloor, Kind::MeetsNothing]);
    }

    #[test]
    fn latitude_before_longitude_shows_in_the_corners_of_rooms() {
        // A house that stands askew at 53 degrees north, whose file has latitude first.
        let right = Georeference::Geographic { origin: [10.0, 53.0], rotation_deg: 30.0 };
        let right = right.projection().unwrap().unwrap();
        let wrong = Georeference::around(53.0, 10.0).unwrap();
        let swapped = wrong.projection().unwrap().unwrap();
        let read = |point: Point| {
            let [longitude, latitude] = right.to_earth(point).unwrap();
            swapped.to_building([latitude, longitude]).unwrap()
        };
        let mut building = house();
        building.georeference = wrong;
        let floor = &mut building.floors[0];
        let lines = floor.walls.iter_mut().chain(floor.doors.iter_mut().map(|door| &mut door.line)).flatten();
        for point in lines.chain(floor.rooms.iter_mut().flat_map(|room| &mut room.outline)) {
            *point = read(*point);
        }
        building.entrances[0].place = read(building.entrances[0].place);
        assert_eq!(kinds(building), [Kind::AxisOrder]);
        let mut upright = house();
        upright.georeference = Georeference::Geographic { origin: [10.0, 53.0], rotation_deg: 30.0 };
        assert_eq!(kinds(upright), []);
    }
}
