//! The program `sohle`. Everything it does is in [`sohle::cli`].

use std::process::ExitCode;

fn main() -> ExitCode {
    sohle::cli::main(std::env::args_os())
}
