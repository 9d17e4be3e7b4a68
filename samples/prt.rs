//! The program `prt`.

fn main() -> std::process::ExitCode {
    lucerna_samples::programs::prt::main()
}
