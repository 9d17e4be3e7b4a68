//! The program `igi`.

fn main() -> std::process::ExitCode {
    lucerna_samples::programs::igi::main()
}
