//! The program `fiv`.

fn main() -> std::process::ExitCode {
    lucerna_samples::programs::fiv::main()
}
