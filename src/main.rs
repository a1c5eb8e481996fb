//! The `planisphere` program; everything is in the library's [`planisphere::cli`].

use std::process::ExitCode;

fn main() -> ExitCode {
    planisphere::cli::main()
}
