//! The readers of recordings: whatever the bytes are, the answer is a recording that is fit for use, or an error of one line.

use crate::seeds::Seed;
use sohle::recording::mapping::Mapping;
use sohle::recording::{Preset, Profile, Recording, RecordingError, mcap, read};
use sohle_shared::sample::ImuSample;
use sohle_shared::selftest::Walk;
use std::path::Path;

/// What is said about the columns: nothing, a mapping that leans on no preset, or a preset.
fn profile(choice: u8) -> Option<Profile> {
    let choice = usize::from(choice) % (Preset::ALL.len() + 2);
    match choice.checked_sub(2) {
        Some(preset) => Some(Preset::ALL[preset].into()),
        None if choice == 1 => {
            let own = "rate_hz = 100.0\naccel = [1, 2, 3]\naccel_unit = 'g'\ngyro = [4, 5, 6]\ngyro_unit = 'deg/s'\n\
                       comment = '#'";
            let mapping: Mapping = toml::from_str(own).expect("the mapping is written as it should be");
            Some(Profile { mapping })
        }
        None => None,
    }
}

/// The first byte says what is said about the columns, the rest is the file.
pub fn run(data: &[u8]) {
    let Some((&choice, bytes)) = data.split_first() else { return };
    judge(read(Path::new("walk"), bytes, profile(choice).as_ref()));
}

fn judge(answer: Result<Recording, RecordingError>) {
    match answer {
        Ok(recording) => {
            assert!(!recording.samples.is_empty());
            assert!(recording.samples.iter().all(ImuSample::is_finite));
            assert!(recording.rate_hz().is_finite() && recording.duration_s().is_finite());
            assert!(recording.gravity_at_rest().is_none_or(f64::is_finite));
        }
        Err(error) => assert!(!error.to_string().contains(['\n', '\r']), "{error}"),
    }
}

/// A piece of a recording for each layout of text.
const TEXTS: [(&str, &str); 6] = [
    (
        "xio",
        "Time (s),Gyroscope X (deg/s),Gyroscope Y (deg/s),Gyroscope Z (deg/s),Accelerometer X (g),Accelerometer Y (g),\
         Accelerometer Z (g)\n0,-0.1,-0.8,-0.2,-0.5,0.2,0.8\n0.01,0.1,-0.7,-0.2,-0.5,0.2,0.8\n",
    ),
    (
        "openshoe",
        "\r\nInertial data.\r\nHeader:  a_x [g]:\r\n   0xcb   -0.1   +0.2   +1.0   +0.0   -0.0   +0.0  130516848  0x15fd  1\r\n\
         \x20  0xcb   -0.1   +0.2   +1.0   +0.0   -0.0   +0.0  78720  0x15fd  2\r\n",
    ),
    ("plain", "0.2,-0.4,9.8,-0.0,-0.0,-0.0\n-0.0,-0.4,9.7,-0.0,0.0,-0.0\n"),
    (
        "named",
        "t_s,acc_x_mps2,acc_y_mps2,acc_z_mps2,gyr_x_radps,gyr_y_radps,gyr_z_radps\n0.0,5.7,1.6,-7.9,0.0,-0.0,0.0\n\
         0.005,5.7,1.6,-7.8,0.0,-0.0,0.0\n",
    ),
    (
        "gaitmap",
        "sensor,left_sensor,right_sensor,left_sensor,right_sensor,left_sensor,right_sensor,left_sensor,right_sensor,\
         left_sensor,right_sensor,left_sensor,right_sensor\naxis,acc_x,acc_x,acc_y,acc_y,acc_z,acc_z,gyr_x,gyr_x,gyr_y,\
         gyr_y,gyr_z,gyr_z\n0,0.9,0.3,2.8,-2.4,9.4,9.5,-0.1,-0.3,-0.0,0.1,-0.1,-0.0\n",
    ),
    ("ucr", "time_index,acc_x,acc_y,acc_z,gyro_x,gyro_y,gyro_z,is_zero_vel\n0,0.3,0.8,9.9,0.0,0.0,-0.0,1\n"),
];

/// An element of a MATLAB v5 file: its kind, its length, its bytes filled up to eight.
fn element(kind: u32, data: &[u8]) -> Vec<u8> {
    let mut bytes = [&kind.to_le_bytes()[..], &(data.len() as u32).to_le_bytes(), data].concat();
    bytes.resize(bytes.len().next_multiple_of(8), 0);
    bytes
}

/// A MATLAB v5 file with a foot at rest.
fn matlab() -> Vec<u8> {
    let rows = 4;
    let variable = |name: &str, numbers: &[f64]| {
        let words = |words: [u32; 2]| words.map(u32::to_le_bytes).concat();
        let numbers_in_bytes: Vec<u8> = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
        let shape = words([rows as u32, (numbers.len() / rows) as u32]);
        let parts = [(6, words([6, 0])), (5, shape), (1, name.as_bytes().to_vec()), (9, numbers_in_bytes)];
        element(14, &parts.iter().flat_map(|(kind, data)| element(*kind, data)).collect::<Vec<_>>())
    };
    let mut bytes = b"MATLAB 5.0 MAT-file".to_vec();
    bytes.resize(124, b' ');
    bytes.extend(b"\x00\x01IM");
    bytes.extend(variable("timestamps", &[0.0, 0.01, 0.02, 0.03]));
    bytes.extend(variable("imu_data", &[[0.0; 4], [0.0; 4], [9.81; 4], [0.01; 4], [0.0; 4], [0.0; 4]].concat()));
    bytes
}

/// The project's own format with a few samples.
fn own() -> Vec<u8> {
    let path = std::env::temp_dir().join(format!("sohle-fuzz-seed-{}", std::process::id()));
    let samples = Walk::new(5_000).take(4).collect();
    mcap::write(&path, &Recording { name: "walk".into(), samples, ..Recording::default() })
        .expect("the folder for what is temporary takes a file");
    let bytes = std::fs::read(&path).expect("it was just written");
    // One that stays is no harm.
    let _ = std::fs::remove_file(&path);
    bytes
}

/// A piece of a recording for each layout, and the project's own.
pub fn seeds() -> Vec<Seed> {
    let recognised = |bytes: &[u8]| [&[0], bytes].concat();
    let mut seeds: Vec<Seed> = TEXTS.iter().map(|(name, text)| (*name, recognised(text.as_bytes()))).collect();
    seeds.push(("matlab", recognised(&matlab())));
    seeds.push(("own", recognised(&own())));
    seeds.push(("mapped", [&[1][..], b"# mine\n0,0,1,0,0,0\n0,0,1,0,0,1\n"].concat()));
    seeds
}
