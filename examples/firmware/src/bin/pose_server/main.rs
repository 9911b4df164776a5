//! A camera module's firmware: correspondences in over the UART, poses out. See the README of `wire` for the format.
//!
//! The host program `pose_client` runs this image in QEMU, talks to it and compares its answers bit by bit.
#![no_std]
#![no_main]

epipole_firmware::entry!(main);

#[cfg(uart = "cmsdk")]
mod cmsdk;
#[cfg(uart = "cmsdk")]
use cmsdk as machine;
#[cfg(uart = "ns16550")]
mod ns16550;
#[cfg(uart = "ns16550")]
use ns16550 as machine;

#[cfg(any(uart = "cmsdk", uart = "ns16550"))]
fn main() -> i32 {
    use epipole_firmware::{BOARD, count};
    use epipole_server::{Activity, Clock, Limits, Memory, Server, frame_bytes};

    /// Correspondences of a request.
    const CAPACITY: usize = 200;

    struct Micros;
    impl Clock for Micros {
        fn now_us(&mut self) -> u64 {
            count::micros()
        }
    }

    count::init();
    let mut memory = Memory::<CAPACITY, { frame_bytes(CAPACITY) }>::new();
    defmt::info!("{=str}: {=usize} correspondences in {=usize} bytes", BOARD, CAPACITY, size_of_val(&memory));
    // The emulator's time goes by instructions and runs ahead of the bytes that the host sends.
    let limits = Limits { pause_us: 30_000_000, ..Limits::default() };
    let mut server =
        Server::new(&mut memory, machine::Uart::new(), machine::DataReady::new(), Micros, limits);
    loop {
        match server.poll() {
            Activity::Idle if !server.pending() => machine::wait(),
            Activity::Idle | Activity::Answered => (),
            Activity::Refused(reason) => defmt::debug!("refused: {}", defmt::Display2Format(&reason)),
            // A board would reset itself; an emulator ends, with its partner's work done.
            Activity::Restart => {
                let statistics = server.statistics();
                for (name, count) in statistics.entries() {
                    defmt::info!("{=str} {=u32}", name, count);
                }
                return i32::from(statistics.output_errors != 0);
            }
        }
    }
}

/// Boards whose UART has no driver here: hand `Server` the one of your HAL.
#[cfg(not(any(uart = "cmsdk", uart = "ns16550")))]
fn main() -> i32 {
    epipole_firmware::println!("{}: no UART driver here", epipole_firmware::BOARD);
    2
}
