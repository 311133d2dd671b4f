//! The building as the map draws it: made once for each building.

use super::mesh::{Mesh, hull};
use super::palette::Material;
use crate::building::{Building, ConnectorKind, Floor, Outline, Point, Room, geometry};
use std::ops::Range;

/// Above the floor, so that one lies on the other. **Units:** m.
const CONNECTOR_LIFT_M: f32 = 0.012;
const DOOR_LIFT_M: f32 = 0.025;
/// Of a floor. **Units:** m.
const SLAB_M: f32 = 0.22;
/// Around a building without anything in it. **Units:** m.
const NOWHERE_M: f64 = 10.0;

/// A building that can be drawn.
#[derive(Clone, Debug)]
pub struct Scene {
    name: String,
    storeys: Vec<Storey>,
    mesh: Mesh,
    bounds: [Point; 2],
}

/// A floor of it.
#[derive(Clone, Debug)]
pub struct Storey {
    /// Its number.
    pub number: i32,
    /// What it is called; its number if it has no name.
    pub name: String,
    /// **Units:** m; **Frame:** building, up.
    pub height_m: f64,
    /// Rooms, to tell where a place is.
    plan: Floor,
    /// What is written on it, the largest area first.
    pub labels: Vec<Label>,
    /// Ways in.
    pub entrances: Vec<Point>,
    /// Outline around all of it.
    pub hull: Outline,
    /// Triangles of the floor, and of what stands on it.
    pub(super) ground: Range<u32>,
    pub(super) walls: Range<u32>,
}

/// The name of a room or of stairs.
#[derive(Clone, Debug, PartialEq)]
pub struct Label {
    /// The name.
    pub text: String,
    /// Where it is written.
    pub at: Point,
    /// From west to east and from south to north of what has the name. **Units:** m.
    pub size: [f64; 2],
}

/// A place on a floor.
#[derive(Clone, Debug, PartialEq)]
pub struct Place {
    /// Number of the floor.
    pub floor: i32,
    /// **Units:** m; **Frame:** building.
    pub point: Point,
    /// Of the floor. **Units:** m; **Frame:** building.
    pub height_m: f64,
    /// Name of the room, if it is in one.
    pub room: Option<String>,
}

impl Scene {
    /// A building as triangles.
    pub fn of(building: &Building) -> Self {
        let mut mesh = Mesh::default();
        let storeys = building.floors.iter().map(|floor| Storey::of(building, floor, &mut mesh)).collect();
        let nowhere = [[-NOWHERE_M; 2], [NOWHERE_M; 2]];
        Self { name: building.name.clone(), storeys, mesh, bounds: building.bounds().unwrap_or(nowhere) }
    }

    /// No building: level ground, for walks without a map.
    pub fn open_ground() -> Self {
        Self::of(&Building { floors: vec![Floor { name: "Ground".into(), ..Floor::default() }], ..Building::default() })
    }

    /// What the building is called.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// From the lowest to the highest.
    pub fn storeys(&self) -> &[Storey] {
        &self.storeys
    }

    /// The floor of this number: which it is, counted from the lowest, and itself.
    pub fn storey(&self, number: i32) -> Option<(usize, &Storey)> {
        self.storeys.iter().enumerate().find(|(_, storey)| storey.number == number)
    }

    /// The floor that somebody at a height is on, or climbs up from, counted from the lowest.
    pub fn storey_at(&self, height_m: f64) -> usize {
        // A foot is lifted, and a height is estimated: half a metre below the floor is on it.
        self.storeys.iter().rposition(|storey| storey.height_m <= height_m + 0.5).unwrap_or(0)
    }

    /// Lower left and upper right of all floors. **Units:** m; **Frame:** building.
    pub fn bounds(&self) -> [Point; 2] {
        self.bounds
    }

    pub(super) fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// The height of the lowest floor, from which floors are moved apart. **Units:** m.
    pub fn datum(&self) -> f64 {
        self.storeys.first().map_or(0.0, |storey| storey.height_m)
    }

    /// A place as it is shown when floors stand `spread` times as far apart as they are.
    pub fn shown(&self, [x, y, z]: [f64; 3], spread: f64) -> [f64; 3] {
        [x, y, self.datum() + (z - self.datum()) * spread]
    }

    /// Half the diagonal of all of it as it is shown. **Units:** m.
    pub fn reach(&self, spread: f64) -> f64 {
        let [low, high] = self.bounds;
        let top = self.storeys.last().map_or(0.0, |storey| storey.height_m - self.datum()) * spread + 4.0;
        ((high[0] - low[0]).powi(2) + (high[1] - low[1]).powi(2) + top * top).sqrt() / 2.0
    }

    /// What place a point of a floor is.
    pub fn place(&self, storey: usize, point: Point) -> Option<Place> {
        let storey = self.storeys.get(storey)?;
        let room = storey.plan.room_at(point).map(|room| room.name.clone()).filter(|name| !name.is_empty());
        Some(Place { floor: storey.number, point, height_m: storey.height_m, room })
    }
}

impl Storey {
    /// Whether a point is on the floor, rather than beside it.
    pub fn holds(&self, point: Point) -> bool {
        geometry::contains(&self.hull, point)
    }

    fn of(building: &Building, floor: &Floor, mesh: &mut Mesh) -> Self {
        let connectors = || {
            building.connectors.iter().flat_map(|connector| {
                let here = connector.outlines.iter().filter(|(number, _)| *number == floor.number);
                here.map(move |(_, outline)| (connector, outline))
            })
        };
        let hull = hull(floor.points().chain(connectors().flat_map(|(_, outline)| outline.iter().copied())).collect());
        let first = mesh.indices.len() as u32;
        let slab: Vec<&Outline> = if floor.rooms.is_empty() {
            vec![&hull]
        } else {
            let rooms = floor.rooms.iter().map(|room| &room.outline);
            rooms.chain(connectors().map(|(_, outline)| outline)).collect()
        };
        let slab: Vec<&Outline> = slab.into_iter().filter(|outline| outline.len() > 2).collect();
        for outline in &slab {
            mesh.edge(outline, SLAB_M);
        }
        mesh.fill(slab.iter().copied(), -0.5 * CONNECTOR_LIFT_M, Material::Slab);
        let (passages, rooms): (Vec<&Room>, Vec<&Room>) = floor.rooms.iter().partition(|room| is_passage(room));
        mesh.fill(passages.iter().map(|room| &room.outline), 0.0, Material::Passage);
        mesh.fill(rooms.iter().map(|room| &room.outline), 0.2 * CONNECTOR_LIFT_M, Material::Room);
        for (connector, outline) in connectors() {
            let elevator = connector.kind == ConnectorKind::Elevator;
            let material = if elevator { Material::Elevator } else { Material::Stairs };
            mesh.fill([outline], CONNECTOR_LIFT_M, material);
        }
        for door in &floor.doors {
            mesh.door(&door.line, DOOR_LIFT_M);
        }
        let middle = mesh.indices.len() as u32;
        for wall in &floor.walls {
            mesh.wall(wall);
        }
        let above = building.floors.iter().map(|floor| floor.height_m).filter(|height| *height > floor.height_m);
        let next = above.fold(f64::INFINITY, f64::min);
        for connector in building.connectors.iter().filter(|connector| connector.kind != ConnectorKind::Elevator) {
            for pair in connector.way.windows(2) {
                let height = pair[0][2].min(pair[1][2]);
                if height >= floor.height_m - 1e-6 && height < next - 1e-6 {
                    let [from, to] = [pair[0], pair[1]].map(|[x, y, z]| [x, y, z - floor.height_m]);
                    mesh.steps(from, to);
                }
            }
        }
        let last = mesh.indices.len() as u32;
        let mut labels: Vec<Label> =
            floor.rooms.iter().filter_map(|room| Label::of(&room.name, &room.outline)).collect();
        // One that lies in a room has the room's name already.
        let alone = connectors().filter(|(_, outline)| floor.room_at(geometry::centre(outline)).is_none());
        labels.extend(alone.filter_map(|(connector, outline)| Label::of(&connector.name, outline)));
        labels.sort_by(|a, b| (b.size[0] * b.size[1]).total_cmp(&(a.size[0] * a.size[1])));
        let entrances = building.entrances.iter().filter(|entrance| entrance.floor == floor.number);
        let name = if floor.name.is_empty() { floor.number.to_string() } else { floor.name.clone() };
        Self {
            number: floor.number,
            name,
            height_m: floor.height_m,
            plan: Floor { rooms: floor.rooms.clone(), ..Floor::default() },
            labels,
            entrances: entrances.map(|entrance| entrance.place).collect(),
            hull,
            ground: first..middle,
            walls: middle..last,
        }
    }
}

/// Whether one goes through it rather than to it.
fn is_passage(room: &Room) -> bool {
    let usage = room.usage.as_deref().unwrap_or_default().to_lowercase();
    ["corridor", "hallway", "hall", "lobby", "foyer"].iter().any(|word| usage.contains(word))
}

impl Label {
    /// Where the name of an area is written: nowhere if it has none.
    fn of(text: &str, outline: &Outline) -> Option<Self> {
        let [low, high] = geometry::bounds(outline.iter().copied())?;
        let size = [high[0] - low[0], high[1] - low[1]];
        (!text.is_empty()).then(|| Self { text: text.to_owned(), at: inside(outline, [low, high]), size })
    }
}

/// A point well inside an outline: its centre, or of a net of points the one that is farthest from the border.
fn inside(outline: &Outline, [low, high]: [Point; 2]) -> Point {
    const NET: usize = 13;
    let centre = geometry::centre(outline);
    if geometry::contains(outline, centre) {
        return centre;
    }
    let at = |index: usize, axis: usize| low[axis] + (high[axis] - low[axis]) * (index as f64 + 0.5) / NET as f64;
    let points = (0..NET * NET).map(|index| [at(index % NET, 0), at(index / NET, 1)]);
    let room = |point: &Point| {
        let near = |side| geometry::distance(geometry::nearest(&side, *point), *point);
        geometry::sides(outline).map(near).fold(f64::INFINITY, f64::min)
    };
    let within = points.filter(|point| geometry::contains(outline, *point));
    within.max_by(|a, b| room(a).total_cmp(&room(b))).unwrap_or(centre)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Two floors of a room and a corridor, with stairs between them.
    pub fn house() -> Building {
        let room = |name: &str, usage: &str, outline| Room { name: name.into(), usage: Some(usage.into()), outline };
        let floor = |number: i32, height_m| {
            let office = vec![[0.0, 0.0], [6.0, 0.0], [6.0, 4.0], [0.0, 4.0]];
            let corridor = vec![[0.0, 4.0], [10.0, 4.0], [10.0, 6.0], [0.0, 6.0]];
            let outer = [[0.0, 0.0], [10.0, 0.0], [10.0, 6.0], [0.0, 6.0]];
            Floor {
                number,
                name: format!("F{number}"),
                height_m,
                walls: geometry::sides(&outer).chain([[[6.0, 0.0], [6.0, 4.0]], [[0.0, 4.0], [4.0, 4.0]]]).collect(),
                doors: vec![crate::building::Door { line: [[4.0, 4.0], [5.0, 4.0]], name: None }],
                rooms: vec![room("Office", "office", office), room("Corridor", "corridor", corridor)],
            }
        };
        let shaft = vec![[6.0, 0.0], [10.0, 0.0], [10.0, 4.0], [6.0, 4.0]];
        let stairs = crate::building::Connector {
            name: "Stairs".into(),
            kind: ConnectorKind::Stairs,
            outlines: vec![(0, shaft.clone()), (1, shaft)],
            way: vec![[7.0, 3.5, 0.0], [7.0, 0.8, 1.6], [9.0, 0.8, 1.6], [9.0, 3.5, 3.2]],
        };
        let floors = vec![floor(0, 0.0), floor(1, 3.2)];
        Building { name: "House".into(), floors, connectors: vec![stairs], ..Building::default() }.assembled().unwrap()
    }

    #[test]
    fn a_building_becomes_floors_with_names_and_places() {
        let scene = Scene::of(&house());
        let ground = &scene.storeys()[0];
        let names: Vec<&str> = ground.labels.iter().map(|label| label.text.as_str()).collect();
        assert_eq!(names, ["Office", "Corridor", "Stairs"]);
        assert_eq!(scene.place(1, [1.0, 1.0]).unwrap().room.as_deref(), Some("Office"));
        assert!(ground.holds([9.0, 1.0]) && !ground.holds([11.0, 1.0]));
        assert_eq!((scene.storey_at(-9.0), scene.storey_at(1.6), scene.storey_at(3.0)), (0, 0, 1));
        // The stairs belong to the floor that they start from.
        let triangles = |storey: &Storey| storey.walls.len() / 3;
        assert!(triangles(ground) > triangles(&scene.storeys()[1]));
        assert_eq!(ground.ground.end, ground.walls.start);
    }

    #[test]
    fn nothing_can_be_drawn_too() {
        let scene = Scene::open_ground();
        assert!(scene.mesh().indices.is_empty() && scene.reach(1.0) > 10.0);
        assert_eq!(scene.place(0, [2.0, 3.0]).unwrap().room, None);
    }

    #[test]
    fn the_name_of_a_bent_room_is_written_in_it() {
        let bent = vec![[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [8.0, 10.0], [8.0, 2.0], [0.0, 2.0]];
        let label = Label::of("L", &bent).unwrap();
        assert!(geometry::contains(&bent, label.at), "{:?}", label.at);
    }
}
