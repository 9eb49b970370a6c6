//! The `typodont` program; the module `cli` contains its command line.

#![deny(unsafe_code)]

mod cli;

fn main() -> std::process::ExitCode {
    cli::main()
}
