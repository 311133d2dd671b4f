//! `sohle window` where the program was built without its window.

use super::Error;
use super::shown::{Enough, Shoe, Walk, Watched};

/// Tells how to get the window, which this program was built without
#[derive(Debug, clap::Args)]
pub struct Args {
    /// What the window would show
    #[arg(value_name = "ARGUMENTS", trailing_var_arg = true, allow_hyphen_values = true)]
    what: Vec<String>,
}

/// There is no window, whatever is wanted.
pub fn is_wanted(_headless: bool, _quiet: bool) -> bool {
    false
}

/// Shows nothing.
pub fn show(_walk: Walk) {}

/// Hands back what cannot be shown.
pub fn watch(shoe: Shoe, enough: Enough) -> Result<Watched, Error> {
    Ok(Watched::Unopened(Error::new("this program was built without its window"), Box::new(shoe), enough))
}

/// Tells it.
pub fn run(args: Args) -> Result<(), Error> {
    Err(Error::new(format!(
        "this program was built without its window: cargo run --release --features window -- window {}",
        args.what.join(" ")
    )))
}
