//! `sohle window` where the program was built without its window.

use super::Error;

/// Tells how to get the window, which this program was built without
#[derive(Debug, clap::Args)]
pub struct Args {
    /// What the window would show
    #[arg(value_name = "ARGUMENTS", trailing_var_arg = true, allow_hyphen_values = true)]
    what: Vec<String>,
}

/// Tells it.
pub fn run(args: Args) -> Result<(), Error> {
    Err(Error::new(format!(
        "this program was built without its window: cargo run --release --features window -- window {}",
        args.what.join(" ")
    )))
}
