//! What a viewer shows of a walk in a building: the plan, the place with its covariance, the particles.
//!
//! Messages of ROS 2 that viewers of MCAP draw without a plug-in, in the encoding of the project's own: `/building`
//! (`visualization_msgs/msg/MarkerArray`), `/place` (`geometry_msgs/msg/PoseWithCovarianceStamped`), `/particles`
//! (`sensor_msgs/msg/PointCloud2`); and `/place/line`, the JSON that other programs get. All are in the frame `building`: x
//! east, y north, z up, in metres. They are for looking at: the project itself does not read them back.

use nalgebra::Matrix3;
use sohle_shared::time::Micros;

/// Lines of a building.
#[derive(Clone, Debug, PartialEq)]
pub struct Lines {
    /// What they are.
    pub name: &'static str,
    /// Red, green, blue, opacity, from 0 to 1.
    pub colour: [f32; 4],
    /// **Units:** m.
    pub width: f64,
    /// **Units:** m; **Frame:** building.
    pub segments: Vec<[[f64; 3]; 2]>,
}

/// What was said after a step.
#[derive(Clone, Debug, PartialEq)]
pub struct Moment {
    /// End of the stance.
    pub time: Micros,
    /// The likeliest place, if there is one.
    pub place: Option<Pose>,
    /// Some of the particles. **Units:** m; **Frame:** building.
    pub particles: Vec<[f32; 3]>,
    /// The JSON object.
    pub line: String,
}

/// A place and a heading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// **Units:** m; **Frame:** building.
    pub position: [f64; 3],
    /// Of the position. **Units:** m².
    pub covariance: Matrix3<f64>,
    /// **Units:** rad; **Frame:** building, counter-clockwise from east.
    pub heading: f64,
    /// **Units:** rad².
    pub heading_variance: f64,
}

/// A message that is written and not read.
pub(super) struct Shown {
    pub topic: &'static str,
    pub schema: &'static str,
    pub definition: &'static str,
    pub bytes: Vec<u8>,
}

/// Topic of the JSON, which has no schema.
pub(super) const LINE_TOPIC: &str = "/place/line";

const FRAME: &str = "building";

/// The definitions that several messages share, each with the line that begins it.
macro_rules! with_common {
    ($own:literal) => {
        concat!(
            $own,
            "\
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
================================================================================
MSG: builtin_interfaces/Duration
int32 sec
uint32 nanosec
================================================================================
MSG: geometry_msgs/Pose
geometry_msgs/Point position
geometry_msgs/Quaternion orientation
================================================================================
MSG: geometry_msgs/Point
float64 x
float64 y
float64 z
================================================================================
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
================================================================================
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
"
        )
    };
}

const MARKERS: &str = with_common!(
    "\
visualization_msgs/Marker[] markers
================================================================================
MSG: visualization_msgs/Marker
std_msgs/Header header
string ns
int32 id
int32 type
int32 action
geometry_msgs/Pose pose
geometry_msgs/Vector3 scale
std_msgs/ColorRGBA color
builtin_interfaces/Duration lifetime
bool frame_locked
geometry_msgs/Point[] points
std_msgs/ColorRGBA[] colors
string text
string mesh_resource
bool mesh_use_embedded_materials
================================================================================
MSG: std_msgs/ColorRGBA
float32 r
float32 g
float32 b
float32 a
"
);

const POSE: &str = with_common!(
    "\
std_msgs/Header header
geometry_msgs/PoseWithCovariance pose
================================================================================
MSG: geometry_msgs/PoseWithCovariance
geometry_msgs/Pose pose
float64[36] covariance
"
);

const CLOUD: &str = with_common!(
    "\
std_msgs/Header header
uint32 height
uint32 width
sensor_msgs/PointField[] fields
bool is_bigendian
uint32 point_step
uint32 row_step
uint8[] data
bool is_dense
================================================================================
MSG: sensor_msgs/PointField
string name
uint32 offset
uint8 datatype
uint32 count
"
);

/// Of a marker that is a list of lines.
const LINE_LIST: i32 = 5;
/// Of a field that is a float32.
const FLOAT32: u8 = 7;

/// The plan.
pub(super) fn building(lines: &[Lines], time: Micros) -> Shown {
    let mut out = Cdr::new();
    out.count(lines.len());
    for (id, lines) in (0..).zip(lines) {
        out.header(time);
        out.text(lines.name);
        out.i32(id);
        out.i32(LINE_LIST);
        // Adds or replaces.
        out.i32(0);
        out.f64s(&[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
        out.f64s(&[lines.width, 0.0, 0.0]);
        out.f32s(&lines.colour);
        // For ever.
        out.i32(0);
        out.u32(0);
        out.u8(0);
        out.count(2 * lines.segments.len());
        lines.segments.iter().flatten().for_each(|point| out.f64s(point));
        out.count(0);
        out.text("");
        out.text("");
        out.u8(0);
    }
    let schema = "visualization_msgs/msg/MarkerArray";
    Shown { topic: "/building", schema, definition: MARKERS, bytes: out.0 }
}

/// The place.
pub(super) fn place(pose: &Pose, time: Micros) -> Shown {
    let mut out = Cdr::new();
    out.header(time);
    out.f64s(&pose.position);
    let (sin, cos) = (pose.heading / 2.0).sin_cos();
    out.f64s(&[0.0, 0.0, sin, cos]);
    let mut covariance = [0.0; 36];
    for row in 0..3 {
        for column in 0..3 {
            covariance[6 * row + column] = pose.covariance[(row, column)];
        }
    }
    covariance[35] = pose.heading_variance;
    out.f64s(&covariance);
    let schema = "geometry_msgs/msg/PoseWithCovarianceStamped";
    Shown { topic: "/place", schema, definition: POSE, bytes: out.0 }
}

/// The particles.
pub(super) fn cloud(particles: &[[f32; 3]], time: Micros) -> Shown {
    let mut out = Cdr::new();
    let bytes = 12 * particles.len();
    out.header(time);
    out.u32(1);
    out.count(particles.len());
    out.count(3);
    for (name, offset) in [("x", 0), ("y", 4), ("z", 8)] {
        out.text(name);
        out.u32(offset);
        out.u8(FLOAT32);
        out.u32(1);
    }
    out.u8(0);
    out.u32(12);
    out.count(bytes);
    out.count(bytes);
    particles.iter().flatten().for_each(|value| out.0.extend(value.to_le_bytes()));
    out.u8(1);
    Shown { topic: "/particles", schema: "sensor_msgs/msg/PointCloud2", definition: CLOUD, bytes: out.0 }
}

/// Writes CDR, little-endian: every number at a multiple of its size, counted from behind the four bytes of the
/// encapsulation.
struct Cdr(Vec<u8>);

impl Cdr {
    fn new() -> Self {
        Self(vec![0, 1, 0, 0])
    }

    fn align(&mut self, size: usize) {
        let length = self.0.len() - 4;
        self.0.resize(4 + length.next_multiple_of(size), 0);
    }

    fn u8(&mut self, value: u8) {
        self.0.push(value);
    }

    fn u32(&mut self, value: u32) {
        self.align(4);
        self.0.extend(value.to_le_bytes());
    }

    fn i32(&mut self, value: i32) {
        self.align(4);
        self.0.extend(value.to_le_bytes());
    }

    /// Of a sequence. Nothing here has four thousand million parts.
    fn count(&mut self, count: usize) {
        self.u32(count as u32);
    }

    fn f32s(&mut self, values: &[f32]) {
        self.align(4);
        self.0.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    }

    fn f64s(&mut self, values: &[f64]) {
        self.align(8);
        self.0.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    }

    /// With its length, in which a zero at the end counts.
    fn text(&mut self, text: &str) {
        self.count(text.len() + 1);
        self.0.extend(text.as_bytes());
        self.0.push(0);
    }

    fn header(&mut self, Micros(time): Micros) {
        // Before 1901 and after 2038 the time of a message cannot be written; its time line in the file can.
        self.i32(i32::try_from(time.div_euclid(1_000_000)).unwrap_or_default());
        self.u32(time.rem_euclid(1_000_000) as u32 * 1_000);
        self.text(FRAME);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_stand_at_multiples_of_their_size() {
        let mut out = Cdr::new();
        out.text("ab");
        out.f64s(&[1.0]);
        out.u8(7);
        out.u32(9);
        assert_eq!(out.0[..4], [0, 1, 0, 0]);
        // 4 bytes of length and 3 of text, then the number at 8.
        assert_eq!(out.0[4..12], [3, 0, 0, 0, b'a', b'b', 0, 0]);
        assert_eq!(out.0[12..20], 1.0_f64.to_le_bytes());
        assert_eq!(out.0[20..], [7, 0, 0, 0, 9, 0, 0, 0]);
    }

    #[test]
    fn the_messages_have_the_length_that_their_definitions_say() {
        let time = Micros(-1);
        let cloud = cloud(&[[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]], time);
        // The data stand before the last byte, 24 bytes behind their number.
        let data = cloud.bytes.len() - 1 - 24;
        assert_eq!(cloud.bytes[data - 4..data], 24_u32.to_le_bytes());
        assert_eq!(cloud.bytes[data..data + 4], 1.0_f32.to_le_bytes());
        // Stamp: one microsecond before zero.
        assert_eq!(cloud.bytes[4..12], [0xff, 0xff, 0xff, 0xff, 0x18, 0xc6, 0x9a, 0x3b]);
        let pose = Pose {
            position: [1.0, 2.0, 3.0],
            covariance: Matrix3::identity(),
            heading: std::f64::consts::PI,
            heading_variance: 0.5,
        };
        let place = place(&pose, time);
        // Header: 8 bytes, then 4 and 9 of text, 24 with the padding; 7 numbers of the pose, 36 of the covariance.
        assert_eq!(place.bytes.len(), 4 + 24 + 8 * (7 + 36));
        assert_eq!(place.bytes[place.bytes.len() - 8..], 0.5_f64.to_le_bytes());
        let lines = Lines { name: "w", colour: [1.0; 4], width: 0.1, segments: vec![[[0.0; 3], [1.0; 3]]; 3] };
        let one = building(std::slice::from_ref(&lines), time).bytes.len();
        assert!(one > 6 * 24 && building(&[lines.clone(), lines], time).bytes.len() > 2 * one - 40);
    }
}
