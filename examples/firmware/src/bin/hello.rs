//! The smallest image: a pose from five exact correspondences, to see that the tools work.
#![no_std]
#![no_main]

use epipole_firmware::{BOARD, TARGET, count, entry, println, stack};

entry!(main);

fn main() -> i32 {
    count::init();
    let x1 = [[0.1f32, 0.2], [-0.3, 0.1], [0.2, -0.2], [-0.1, -0.4], [0.4, 0.3]]
        .map(|[x, y]| epipole::nalgebra::Vector3::new(x, y, 1.0));
    let mut z = 3.0;
    let x2 = x1.map(|x| {
        z += 1.0;
        x * z + epipole::nalgebra::Vector3::new(0.5, 0.0, 0.1)
    });
    let ((poses, cost), bytes) =
        stack::high_water(8192, || count::measure(|| epipole::solvers::relpose_5pt_poses(&x1, &x2)));
    let empty = count::measure(|| ()).1;
    println!(
        "{BOARD} {TARGET}: {} poses, {cost} {}, {bytes} bytes of stack, empty {empty}",
        poses.len(),
        count::UNIT
    );
    i32::from(poses.is_empty())
}
