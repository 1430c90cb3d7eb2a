//! `glider`: the laptop side of the glider flight controller.

fn main() -> std::process::ExitCode {
    hil_host::cli::main()
}
