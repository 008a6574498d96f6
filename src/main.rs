//! The `gib` command: one file a subcommand in `cli`.

mod cli;

fn main() -> std::process::ExitCode {
    cli::run()
}
