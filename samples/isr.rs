//! The program `isr`.

fn main() -> std::process::ExitCode {
    lucerna_samples::programs::isr::main()
}
