//! The inputs that a target begins with, written by its own program.

use std::path::PathBuf;

/// An input and what it is called.
pub type Seed = (&'static str, Vec<u8>);

/// With the arguments `--seeds FOLDER`, writes the seeds into the folder and ends the program.
pub fn write_if_asked(seeds: fn() -> Vec<Seed>) {
    let mut arguments = std::env::args_os().skip(1);
    if arguments.next().is_none_or(|argument| argument != "--seeds") {
        return;
    }
    let Some(folder) = arguments.next().map(PathBuf::from) else {
        eprintln!("error: --seeds needs a folder");
        std::process::exit(2);
    };
    let written = std::fs::create_dir_all(&folder)
        .and_then(|()| seeds().iter().try_for_each(|(name, bytes)| std::fs::write(folder.join(name), bytes)));
    if let Err(error) = written {
        eprintln!("error: {}: {error}", folder.display());
        std::process::exit(1);
    }
    std::process::exit(0);
}
