//! The simulated descent on the host: the image `landing` prints the same.

use epipole_landing::simulation::descend;

fn main() -> std::process::ExitCode {
    let report = descend(|_, _| ());
    println!("{report}");
    std::process::ExitCode::from(u8::from(!report.passed()))
}
