//! Importers against bad input: whatever the bytes are, the answer is a recording or an error, never a panic.

use super::{Preset, Profile, Recording, RecordingError, read, recordings_dir};
use proptest::prelude::*;
use proptest::sample::Index;
use std::path::Path;

/// Nothing, every preset, and a mapping that leans on no preset.
fn profiles() -> Vec<Option<Profile>> {
    let own =
        "rate_hz = 100.0\naccel = [1, 2, 3]\naccel_unit = 'g'\ngyro = [4, 5, 6]\ngyro_unit = 'deg/s'\ncomment = '#'";
    let own = Profile { mapping: toml::from_str(own).unwrap() };
    let presets = Preset::ALL.into_iter().map(|preset| Some(preset.into()));
    [None, Some(own)].into_iter().chain(presets).collect()
}

fn of(bytes: &[u8], profile: Option<&Profile>) -> Result<Recording, RecordingError> {
    read(Path::new("walk"), bytes, profile)
}

/// Every answer must be fit for use: finite samples, or one line.
fn judge(answer: Result<Recording, RecordingError>) {
    match answer {
        Ok(recording) => {
            assert!(!recording.samples.is_empty());
            assert!(recording.samples.iter().all(sohle_shared::sample::ImuSample::is_finite));
        }
        Err(error) => assert!(!error.to_string().contains(['\n', '\r']), "{error}"),
    }
}

/// A piece of a recording for each layout.
const SEEDS: [&str; 6] = [
    "Time (s),Gyroscope X (deg/s),Gyroscope Y (deg/s),Gyroscope Z (deg/s),Accelerometer X (g),Accelerometer Y (g),\
     Accelerometer Z (g)\n0,-0.14,-0.77,-0.23,-0.49,0.24,0.83\n0.0075,0.04,-0.71,-0.17,-0.49,0.23,0.83\n",
    "\r\nInertial data.\r\nHeader:  a_x [g]:\r\n   0xcb   -0.105   +0.158   +0.990   +0.005   -0.012   +0.001  130516848  0x15fd  1\r\n\
     \x20  0xcb   -0.104   +0.158   +0.991   +0.005   -0.012   +0.001  78720  0x15fd  2\r\n",
    "0.196,-0.425,9.862,-0.003,-0.017,-0.024\n-0.033,-0.425,9.732,-0.024,0.021,-0.014\n",
    "t_s,acc_x_mps2,acc_y_mps2,acc_z_mps2,gyr_x_radps,gyr_y_radps,gyr_z_radps\n0.000000,5.690,1.565,-7.855,0.004,-0.003,0.005\n\
     0.004997,5.696,1.585,-7.849,0.005,-0.002,0.007\n",
    "sensor,left_sensor,right_sensor,left_sensor,right_sensor,left_sensor,right_sensor,left_sensor,right_sensor,left_sensor,\
     right_sensor,left_sensor,right_sensor\naxis,acc_x,acc_x,acc_y,acc_y,acc_z,acc_z,gyr_x,gyr_x,gyr_y,gyr_y,gyr_z,gyr_z\n\
     0,0.88,0.31,2.76,-2.40,9.41,9.51,-0.11,-0.32,-0.03,0.08,-0.06,-0.03\n",
    "time_index,acc_x,acc_y,acc_z,gyro_x,gyro_y,gyro_z,is_zero_vel\n0,0.33,0.78,9.87,0.009,0.006,-0.004,1\n",
];

/// What a careless hand or a bad cable does to a file.
#[derive(Clone, Debug)]
enum Damage {
    Set(Index, u8),
    Remove(Index, usize),
    Insert(Index, String),
    Repeat(Index, usize),
    Cut(Index),
}

fn damage() -> impl Strategy<Value = Damage> {
    let words = prop::sample::select(vec![
        "nan",
        "-inf",
        "1e400",
        "1e38",
        "-",
        ",",
        ";",
        "\"",
        "\n",
        "\r",
        "\n\n",
        " ",
        "\t",
        "0x",
        "9".repeat(400).leak(),
        "é",
        "\u{feff}",
    ]);
    prop_oneof![
        (any::<Index>(), any::<u8>()).prop_map(|(at, byte)| Damage::Set(at, byte)),
        (any::<Index>(), 1..40_usize).prop_map(|(at, length)| Damage::Remove(at, length)),
        (any::<Index>(), words).prop_map(|(at, word)| Damage::Insert(at, word.into())),
        (any::<Index>(), 1..200_usize).prop_map(|(at, length)| Damage::Repeat(at, length)),
        any::<Index>().prop_map(Damage::Cut),
    ]
}

impl Damage {
    fn apply(&self, bytes: &mut Vec<u8>) {
        let place = |at: &Index, bytes: &[u8]| at.index(bytes.len().max(1)).min(bytes.len());
        match self {
            Self::Set(at, byte) => {
                let at = place(at, bytes);
                bytes[at..].iter_mut().take(1).for_each(|old| *old = *byte);
            }
            Self::Remove(at, length) => {
                let at = place(at, bytes);
                bytes.drain(at..(at + length).min(bytes.len()));
            }
            Self::Insert(at, word) => {
                let at = place(at, bytes);
                bytes.splice(at..at, word.bytes());
            }
            Self::Repeat(at, length) => {
                let at = place(at, bytes);
                let piece = bytes[at..(at + length).min(bytes.len())].to_vec();
                bytes.splice(at..at, piece);
            }
            Self::Cut(at) => bytes.truncate(place(at, bytes)),
        }
    }
}

proptest! {
    #[test]
    fn arbitrary_bytes(bytes in prop::collection::vec(any::<u8>(), 0..2000)) {
        for profile in profiles() {
            judge(of(&bytes, profile.as_ref()));
        }
    }

    #[test]
    fn arbitrary_tables(text in "([-+0-9.,;#\"e \t]{0,40}\n){0,20}") {
        for profile in profiles() {
            judge(of(text.as_bytes(), profile.as_ref()));
        }
    }

    #[test]
    fn damaged_tables(seed in 0..SEEDS.len(), damages in prop::collection::vec(damage(), 1..6)) {
        let mut bytes = SEEDS[seed].as_bytes().to_vec();
        damages.iter().for_each(|damage| damage.apply(&mut bytes));
        for profile in profiles() {
            judge(of(&bytes, profile.as_ref()));
        }
    }

    #[test]
    fn damaged_matlab_files(rows in 0..20_usize, damages in prop::collection::vec(damage(), 1..6)) {
        let mut bytes = super::mat::tests::walk(rows);
        damages.iter().for_each(|damage| damage.apply(&mut bytes));
        judge(of(&bytes, None));
    }

    #[test]
    fn matlab_files_with_one_changed_word(at: Index, word: u32) {
        let mut bytes = super::mat::tests::walk(5);
        let at = at.index(bytes.len() / 4) * 4;
        bytes[at..at + 4].copy_from_slice(&word.to_le_bytes());
        judge(of(&bytes, None));
    }
}

#[test]
fn tables_cut_at_any_byte() {
    for seed in SEEDS {
        for length in 0..seed.len() {
            for profile in profiles() {
                judge(of(&seed.as_bytes()[..length], profile.as_ref()));
            }
        }
    }
}

#[test]
fn real_files_cut_at_many_bytes() {
    let Some(folder) = recordings_dir() else { return };
    for file in [
        "foot_xio/short_walk.csv",
        "foot_koroglu_gcp/SensorConnectData_34_LLIO.mat",
        "foot_koroglu_count/SensorConnectData_17.csv",
        "foot_openshoe250/Measurement_100521_44.txt",
        "foot_gaitmap/imu_sample.csv",
        "foot_ucr_mocap/imuMeasLeft.csv",
    ] {
        let bytes = std::fs::read(folder.join(file)).unwrap();
        // The beginning densely, the rest at some places.
        for length in (0..600).step_by(7).chain((600..bytes.len()).step_by(bytes.len() / 13)) {
            judge(of(&bytes[..length], None));
        }
    }
}
