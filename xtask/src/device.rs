//! Building for the microcontroller, by whichever Rust on this machine can.
//!
//! A rustup toolchain with the target installed builds it as any other crate. Where rustup cannot add targets, Debian's
//! own compiler builds the core library from its source package (`-Zbuild-std`), with lld as the linker.
//! Host and microcontroller are never built in one cargo call: features of shared dependencies would be unified.

use crate::process::{self, Failure};
use crate::{in_root, tools};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Cortex-M4F and Cortex-M7F with hardware floating point.
pub const TARGET: &str = "thumbv7em-none-eabihf";

/// Where its build products go: apart from the host's, since another compiler may write them.
const TARGET_FOLDER: &str = "target/device";

/// Which Rust builds for the microcontroller.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Route {
    /// The toolchain that runs this program has the target.
    Installed,
    /// Debian's compiler with the source of its library.
    Debian,
}

/// Whether the current toolchain has a core library for the target.
pub fn rustup_target_installed() -> bool {
    let mut command = Command::new(std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into()));
    command.current_dir(crate::root()).args(["--print", "target-libdir", "--target", TARGET]);
    let folder = process::read(&mut command).map(|said| PathBuf::from(said.out.trim()));
    folder.is_ok_and(|folder| folder.is_dir())
}

impl Route {
    /// The route this machine offers.
    pub fn find() -> Result<Self, Failure> {
        if rustup_target_installed() {
            return Ok(Self::Installed);
        }
        let absent: Vec<&tools::Tool> =
            [&tools::DEBIAN_RUST, &tools::LLD].into_iter().filter(|tool| !tool.present()).collect();
        if absent.is_empty() { Ok(Self::Debian) } else { Err(tools::missing(&absent)) }
    }

    /// `cargo build --release` for the target in `folder`, up to the point where packages and features are named.
    pub fn build(self, folder: &Path) -> Command {
        self.cargo("build", folder)
    }

    /// `cargo clippy` in the same way; none when this machine's Rust for the target has no clippy.
    pub fn clippy(self, folder: &Path) -> Option<Command> {
        (self == Self::Installed || tools::DEBIAN_CLIPPY.present()).then(|| self.cargo("clippy", folder))
    }

    fn cargo(self, verb: &str, folder: &Path) -> Command {
        let mut command = match self {
            Self::Installed => process::cargo(),
            Self::Debian => {
                let mut command = Command::new("/usr/bin/cargo");
                // What the cargo that runs this program has set belongs to another toolchain.
                for name in ["RUSTUP_TOOLCHAIN", "RUSTUP_HOME", "LD_LIBRARY_PATH", "CARGO", "RUSTDOC"] {
                    command.env_remove(name);
                }
                command.env("RUSTC", "/usr/bin/rustc");
                // Cargo looks there for what is behind `cargo clippy`.
                let path = std::env::var_os("PATH").unwrap_or_default();
                let folders = std::iter::once(PathBuf::from("/usr/bin")).chain(std::env::split_paths(&path));
                command.env("PATH", std::env::join_paths(folders).unwrap_or_else(|_| path.clone()));
                // Debian ships a stable compiler; building the core library is still behind a feature gate.
                command.env("RUSTC_BOOTSTRAP", "1");
                command.env("CARGO_TARGET_THUMBV7EM_NONE_EABIHF_LINKER", "ld.lld");
                command
            }
        };
        command.current_dir(folder).args([verb, "--release", "--locked", "--target", TARGET]);
        command.arg("--target-dir").arg(in_root(TARGET_FOLDER));
        if self == Self::Debian {
            command.arg("-Zbuild-std=core");
        }
        command
    }
}

/// Where a release binary of the microcontroller is found after its build.
pub fn binary(name: &str) -> PathBuf {
    in_root(TARGET_FOLDER).join(TARGET).join("release").join(name)
}

/// Builds `sohle-shared` for the microcontroller: it must need neither std nor a heap, with any of its features.
pub fn build_shared() -> Result<(), Failure> {
    let route = Route::find()?;
    for features in [&[][..], &["--features", "serde"], &["--features", "wire,store"]] {
        let mut command = route.build(crate::root());
        command.args(["--package", "sohle-shared"]).args(features);
        process::run(&mut command)?;
    }
    println!("sohle-shared builds for {TARGET}, bare, with serde, and with wire and store");
    Ok(())
}
