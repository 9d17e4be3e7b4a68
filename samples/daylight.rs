//! The program `daylight`.

fn main() -> std::process::ExitCode {
    lucerna_samples::programs::daylight::main()
}
