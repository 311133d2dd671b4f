//! What the project's commands need beside Rust, and how a Debian machine gets it.

use crate::process::{self, Failure};
use std::path::PathBuf;
use std::process::Command;

/// Something that must be on the machine.
pub struct Tool {
    /// What it is, for people.
    what: &'static str,
    /// It is present when all of these are: programs on the PATH, or files.
    present_by: &'static [&'static str],
    /// The Debian packages that bring it.
    packages: &'static [&'static str],
}

/// Emulator of the microcontroller.
pub const QEMU: Tool =
    Tool { what: "the emulator qemu-system-arm", present_by: &["qemu-system-arm"], packages: &["qemu-system-arm"] };

/// Counter of instructions.
pub const VALGRIND: Tool = Tool { what: "valgrind", present_by: &["valgrind"], packages: &["valgrind"] };

/// Downloads with resumption, proxies and the machine's own trust anchors.
pub const CURL: Tool = Tool { what: "curl", present_by: &["curl"], packages: &["curl", "ca-certificates"] };

/// A compiler with the source of its library, for machines where rustup has no target to add.
pub const DEBIAN_RUST: Tool = Tool {
    what: "a Rust library for thumbv7em-none-eabihf",
    present_by: &["/usr/bin/rustc", "/usr/bin/cargo", "/usr/lib/rustlib/src/rust/library/core"],
    packages: &["rustc-web", "cargo-web", "rust-web-src"],
};

/// Lints for the microcontroller, with the compiler above.
pub const DEBIAN_CLIPPY: Tool = Tool {
    what: "clippy of that Rust",
    present_by: &["/usr/bin/cargo-clippy", "/usr/bin/clippy-driver"],
    packages: &["rust-web-clippy"],
};

/// Compiler of the fuzzer, which is written in C++.
pub const CXX: Tool = Tool { what: "a C++ compiler", present_by: &["c++"], packages: &["g++"] };

/// Linker for the microcontroller, with the compiler above.
pub const LLD: Tool = Tool { what: "the linker lld", present_by: &["ld.lld"], packages: &["lld"] };

/// A graphics card in software, for the pictures of the window.
pub const LAVAPIPE: Tool = Tool {
    what: "a Vulkan driver in software",
    present_by: &["/usr/share/vulkan/icd.d/lvp_icd.x86_64.json"],
    packages: &["mesa-vulkan-drivers"],
};

/// A display that nobody sees.
pub const XVFB: Tool = Tool { what: "a display in memory", present_by: &["Xvfb"], packages: &["xvfb"] };

/// What the virtual radio is written in.
pub const PYTHON: Tool = Tool { what: "Python 3", present_by: &["python3"], packages: &["python3", "python3-venv"] };

/// Its packages in a folder of their own, which Debian has apart; elsewhere they come with it, so nothing requires this.
const VENV: Tool = Tool {
    what: "Python's venv with pip",
    present_by: &["/var/lib/dpkg/info/python3-venv.list"],
    packages: &["python3-venv"],
};

/// The bus on which a program and its Bluetooth speak.
pub const DBUS: Tool = Tool { what: "the D-Bus daemon", present_by: &["dbus-daemon"], packages: &["dbus-daemon"] };

/// Everything.
pub const ALL: [Tool; 12] =
    [QEMU, VALGRIND, CURL, CXX, DEBIAN_RUST, DEBIAN_CLIPPY, LLD, LAVAPIPE, XVFB, PYTHON, VENV, DBUS];

impl Tool {
    /// Whether the machine has it.
    pub fn present(&self) -> bool {
        self.present_by.iter().all(|name| on_path(name).is_some())
    }

    /// An error that says what to install, unless it is present.
    pub fn required(&self) -> Result<(), Failure> {
        if self.present() { Ok(()) } else { Err(missing(&[self])) }
    }
}

/// The error that names what is missing and the command that brings it.
pub fn missing(tools: &[&Tool]) -> Failure {
    let what = tools.iter().map(|tool| tool.what).collect::<Vec<_>>().join(", ");
    let packages = tools.iter().flat_map(|tool| tool.packages).copied().collect::<Vec<_>>().join(" ");
    let rustup = tools.iter().any(|tool| tool.what == DEBIAN_RUST.what);
    let first = if rustup { "rustup target add thumbv7em-none-eabihf, or on Debian: " } else { "" };
    Failure::Missing { what, how: format!("{first}apt-get install {packages}") }
}

/// Where a program is; an absolute path stands for itself.
pub fn on_path(name: &str) -> Option<PathBuf> {
    let folders = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&folders).map(|folder| folder.join(name)).find(|path| path.exists())
}

/// Installs what is missing of `tools` with apt-get, as root or through sudo.
pub fn install(tools: &[Tool]) -> Result<(), Failure> {
    let target = crate::device::rustup_target_installed();
    let instead = [DEBIAN_RUST.what, DEBIAN_CLIPPY.what, LLD.what];
    let needless = |tool: &Tool| target && instead.contains(&tool.what);
    let absent: Vec<&Tool> = tools.iter().filter(|tool| !tool.present() && !needless(tool)).collect();
    if absent.is_empty() {
        println!("nothing to install");
        return Ok(());
    }
    if on_path("apt-get").is_none() {
        return Err(missing(&absent));
    }
    let packages: Vec<&str> = absent.iter().flat_map(|tool| tool.packages).copied().collect();
    println!("installing {}", packages.join(" "));
    process::read(&mut apt_get(&["update"]))?;
    let mut words = vec!["install", "--yes", "--no-install-recommends"];
    words.extend(packages);
    process::read(&mut apt_get(&words)).map(|_| ())
}

fn apt_get(words: &[&str]) -> Command {
    let root = process::read(&mut process::program("id", ["-u"])).is_ok_and(|said| said.out.trim() == "0");
    let mut command = if root || on_path("sudo").is_none() {
        process::program("apt-get", words)
    } else {
        let mut command = process::program("sudo", ["--non-interactive", "DEBIAN_FRONTEND=noninteractive", "apt-get"]);
        command.args(words);
        command
    };
    command.env("DEBIAN_FRONTEND", "noninteractive");
    command
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_missing_is_named_with_its_packages() {
        let text = missing(&[&QEMU, &LLD]).to_string();
        assert_eq!(
            text,
            "missing the emulator qemu-system-arm, the linker lld; install with: apt-get install qemu-system-arm lld"
        );
    }

    #[test]
    fn a_missing_target_names_rustup_first() {
        let text = missing(&[&DEBIAN_RUST]).to_string();
        assert!(text.contains("rustup target add thumbv7em-none-eabihf"), "{text}");
    }

    #[test]
    fn a_shell_is_on_the_path_and_nonsense_is_not() {
        assert!(on_path("sh").is_some());
        assert!(on_path("no-such-program").is_none());
    }
}
