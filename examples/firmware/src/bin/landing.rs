//! A descent onto four infrared beacons, seen by a SEN0158 on a simulated I2C bus. The exit code is 0 where every pose is
//! right; the last line is the same on every machine.
#![no_std]
#![no_main]

use epipole_firmware::{entry, println};
use epipole_landing::Sighting;
use epipole_landing::simulation::descend;

entry!(main);

fn main() -> i32 {
    let report = descend(|frame, sighting| {
        if frame % 20 == 0 {
            let (name, pose) = match sighting {
                Sighting::Seen(found, _) => ("seen", Some(found)),
                Sighting::Ambiguous(found, _) => ("ambiguous", Some(found)),
                Sighting::Tracked(found) => ("three beacons", Some(found)),
                Sighting::Undecided => ("undecided", None),
                Sighting::TooFew(_) => ("too few", None),
                Sighting::Unknown => ("unknown", None),
            };
            if let Some(found) = pose {
                let t = &found.pose.translation.vector;
                println!("{frame:3} {name:13} t = ({:.3}, {:.3}, {:.3}) m", t.x, t.y, t.z);
            } else {
                println!("{frame:3} {name}");
            }
        }
    });
    println!("{report}");
    i32::from(!report.passed())
}
