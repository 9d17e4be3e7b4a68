//! The program `lucerna`.

fn main() -> std::process::ExitCode {
    lucerna_samples::programs::lucerna::main()
}
