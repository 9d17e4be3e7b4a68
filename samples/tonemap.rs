//! The program `tonemap`.

fn main() -> std::process::ExitCode {
    lucerna_samples::programs::tonemap::main()
}
