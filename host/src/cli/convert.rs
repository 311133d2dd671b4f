//! `sohle convert`: any recording into the project's own format, or into what a sensor's registers would have shown.

use super::{Error, print};
use crate::recording::{self, Profile, Recording, counts, mcap, profile};
use indicatif::{ProgressBar, ProgressStyle};
use sohle_shared::sample::ImuSample;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// Converts a recording to the format of this program (MCAP), or to a sensor's counts for the emulated shoe
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  sohle convert short_walk.csv walk.mcap\n  \
                        sohle convert imu_sample.csv left.mcap --profile gaitmap-left\n  \
                        sohle convert mine.txt mine.mcap --profile columns.toml\n  \
                        sohle convert walk.mcap walk.counts")]
pub struct Args {
    /// The recording to read: CSV or other text, MATLAB v5, MCAP
    #[arg(value_name = "IN")]
    input: PathBuf,
    /// The file to write: a recording, or what a BMX055 would have had in its registers
    #[arg(value_name = "OUT.mcap|OUT.counts")]
    output: PathBuf,
    /// How to read it: the name of a layout or a TOML file with a mapping of columns; recognised from the content when left out
    #[arg(long, value_name = "NAME|FILE.toml", long_help = long_help())]
    profile: Option<String>,
    /// Name of the recording; that of the file when left out
    #[arg(long)]
    name: Option<String>,
    /// Overwrite the file if it is there
    #[arg(long)]
    force: bool,
}

/// What `--profile` takes.
pub(super) fn long_help() -> String {
    format!(
        "How to read it: the name of a layout ({}) or a TOML file that maps columns, for example\n\n  \
         time = \"t\"                     # column by name or number, or in place of it: rate_hz = 100.0\n  \
         time_unit = \"ms\"               # s, ms, us, ns, or seconds for each tick\n  \
         accel = [\"ax\", \"ay\", \"az\"]\n  \
         accel_unit = \"g\"               # m/s2, g, mg, or m/s² for each bit\n  \
         gyro = [\"gx\", \"gy\", \"gz\"]\n  \
         gyro_unit = \"deg/s\"            # rad/s, deg/s, mrad/s, mdeg/s, or rad/s for each bit\n  \
         axes = [\"-y\", \"x\", \"z\"]        # the new x is the recorded -y, ...\n  \
         accel_range_g = 16.0           # readings at the end of the range are marked as clipped\n  \
         gyro_range_deg_s = 2000.0\n\n\
         Further keys: base (a layout to start from), separator, skip_lines, header_lines, comment, line_start, counter. \
         When left out, the layout is recognised from the content",
        profile::known()
    )
}

/// Converts.
pub fn run(args: Args) -> Result<(), Error> {
    let profile = args.profile.as_deref().map(Profile::parse).transpose()?;
    let as_counts = match args.output.extension().and_then(|extension| extension.to_str()) {
        Some("mcap") => false,
        Some("counts") => true,
        _ => {
            let output = args.output.display();
            return Err(Error::new(format!("{output}: the file to write must end in .mcap or .counts")));
        }
    };
    if args.output.exists() && !args.force {
        return Err(Error::new(format!("{}: is there already; --force overwrites it", args.output.display())));
    }
    let mut recording = read(&args.input, profile.as_ref())?;
    if let Some(name) = args.name {
        recording.name = name;
    }
    let size = if as_counts {
        let cannot = |error| Error::new(format!("{}: cannot write: {error}", args.output.display()));
        counts::write(&args.output, &recording).map_err(cannot)?.1
    } else {
        mcap::write(&args.output, &recording)?
    };
    print(&format!("{}written         {} ({})\n", summary(&recording), args.output.display(), readable(size)))
}

/// Reads the recording, with a bar on the terminal.
fn read(path: &Path, profile: Option<&Profile>) -> Result<Recording, Error> {
    let file = recording::open_file(path)?;
    let bar = ProgressBar::new(file.metadata().map_or(0, |data| data.len()));
    bar.set_style(
        ProgressStyle::with_template("{wide_bar} {bytes}/{total_bytes}").unwrap_or(ProgressStyle::default_bar()),
    );
    let recording = recording::read(path, bar.wrap_read(file), profile);
    bar.finish_and_clear();
    Ok(recording?)
}

/// What is in a recording, on one screen.
fn summary(recording: &Recording) -> String {
    let mut text = String::new();
    let mut line = |label: &str, value: String| {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{label:<16}{value}");
    };
    let highest = |length: fn(&ImuSample) -> f32| recording.samples.iter().map(length).fold(0.0, f32::max);
    let end = |range: Option<f32>, unit: &str| range.map_or("unknown".into(), |end| format!("{end:.2} {unit}"));
    let odd = recording.irregularities;

    line("name", recording.name.clone());
    if let Some(profile) = recording.metadata.get("profile") {
        line("profile", profile.clone());
    }
    line("samples", recording.samples.len().to_string());
    line("duration", format!("{:.3} s", recording.duration_s()));
    line("rate", format!("{:.1} Hz", recording.rate_hz()));
    line("gravity at rest", recording.gravity_at_rest().map_or("unknown".into(), |value| format!("{value:.3} m/s²")));
    let (accel, gyro) = (highest(|sample| sample.accel.0.amax()), highest(|sample| sample.gyro.0.amax()));
    line("accelerometer", format!("up to {accel:.2} m/s², range {}", end(recording.range.accel, "m/s²")));
    line("gyroscope", format!("up to {gyro:.2} rad/s, range {}", end(recording.range.gyro, "rad/s")));
    line("clipped", format!("{} accelerometer, {} gyroscope samples", odd.accel_clipped, odd.gyro_clipped));
    line("repeated", format!("{} time stamps", odd.repeated));
    line("backwards", format!("{} time stamps", odd.backwards));
    line("gaps", format!("{}, longest step {:.1} ms", odd.gaps, odd.longest_gap_us as f64 * 1e-3));
    if let Some(truth) = &recording.truth {
        line("truth", format!("{} poses, {} stances", truth.poses.len(), truth.stances.len()));
    }
    if !recording.steps.is_empty() {
        line("steps", recording.steps.len().to_string());
    }
    text
}

/// A size for people. **Units:** bytes.
fn readable(bytes: u64) -> String {
    match bytes {
        0..=9_999 => format!("{bytes} bytes"),
        10_000..=9_999_999 => format!("{:.0} kB", bytes as f64 * 1e-3),
        _ => format!("{:.1} MB", bytes as f64 * 1e-6),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    const HEAD: &str = "time_s,accel_x,accel_y,accel_z,gyro_x,gyro_y,gyro_z\n";

    fn args(input: &Path, output: &Path) -> Args {
        Args { input: input.into(), output: output.into(), profile: None, name: None, force: false }
    }

    fn walk(folder: &Path, rows: &str) -> PathBuf {
        let path = folder.join("walk.csv");
        fs::write(&path, format!("{HEAD}{rows}")).unwrap();
        path
    }

    #[test]
    fn what_was_converted_is_what_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let input = walk(folder.path(), "0,0,0.1,9.81,0,0,0\n0.01,0,0.1,9.81,0,0,0.2\n0.01,0,0.1,9.82,0,0,0.2\n");
        let output = folder.path().join("walk.mcap");
        run(Args { name: Some("lunch".into()), ..args(&input, &output) }).unwrap();
        let (from, to) = (recording::open(&input, None).unwrap(), recording::open(&output, None).unwrap());
        assert_eq!((to.name.as_str(), &to.samples, to.irregularities), ("lunch", &from.samples, from.irregularities));
        assert_eq!(to.metadata.get("file").map(String::as_str), Some("walk.csv"));
        let text = summary(&to);
        assert!(text.contains("samples         3\n") && text.contains("repeated        1 time stamps\n"), "{text}");
        assert!(text.lines().count() < 20 && text.lines().all(|line| line.len() < 80), "{text}");
    }

    #[test]
    fn a_file_that_is_there_is_kept_unless_forced() {
        let folder = tempfile::tempdir().unwrap();
        let input = walk(folder.path(), "0,0,0,9.81,0,0,0\n");
        let output = folder.path().join("walk.mcap");
        fs::write(&output, "precious").unwrap();
        let message = run(args(&input, &output)).unwrap_err().to_string();
        assert!(message.ends_with("is there already; --force overwrites it"), "{message}");
        assert_eq!(fs::read(&output).unwrap(), b"precious");
        run(Args { force: true, ..args(&input, &output) }).unwrap();
        assert_eq!(recording::open(&output, None).unwrap().samples.len(), 1);
    }

    #[test]
    fn nothing_is_written_when_the_input_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let input = walk(folder.path(), "0,0,0,1,0,0,0\n0.01,0,0,1,0,0,0\n");
        let output = folder.path().join("walk.mcap");
        let message = run(args(&input, &output)).unwrap_err().to_string();
        assert!(message.ends_with("is this in g?"), "{message}");
        let unknown = run(Args { profile: Some("xsens".into()), ..args(&input, &output) }).unwrap_err().to_string();
        assert!(unknown.starts_with("unknown profile 'xsens'; known: "), "{unknown}");
        assert!(
            run(args(folder.path(), &output))
                .unwrap_err()
                .to_string()
                .ends_with("is a directory, expected a recording")
        );
        assert!(run(args(&input, &input)).unwrap_err().to_string().ends_with("must end in .mcap or .counts"));
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
