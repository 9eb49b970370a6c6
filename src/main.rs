//! The `typodont` program.

fn main() -> std::process::ExitCode {
    typodont::cli::main()
}
