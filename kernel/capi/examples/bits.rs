//! What `examples/c/bits.c` computes, by the Rust API: its output is the same to the bit.

use epipole::estimate::{
    AbsolutePoseOptions, AbsolutePoseStorage, AbsolutePoseVerdict, HomographyOptions, RelativePoseOptions,
    RelativePoseVerdict, TwoViewStorage, absolute_pose, homography, relative_pose,
};
use epipole::geometry::triangulation::ViewPair;
use epipole::geometry::{Pinhole, Pose};
use epipole::nalgebra::{Vector2, Vector3};

const COUNT: usize = 64;

fn print(name: &str, numbers: impl IntoIterator<Item = f32>) {
    numbers.into_iter().for_each(|x| println!("{name} {:08x}", x.to_bits()));
}

fn print_pose(name: &str, pose: &Pose<f32>) {
    print(&format!("{name} rotation"), pose.rotation.coords.iter().copied());
    print(&format!("{name} translation"), pose.translation.vector.iter().copied());
}

fn main() {
    let mut state = 1u32;
    let mut next = |below: u32| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        ((state >> 8) % below) as f32
    };
    let camera = Pinhole::new(500.0, 500.0, 320.0, 240.0).expect("a camera");
    let mut x1 = [Vector2::zeros(); COUNT];
    let (mut x2, mut y2) = (x1, x1);
    let mut points = [Vector3::zeros(); COUNT];
    for k in 0..COUNT {
        let depth = 4.0 + next(64) / 8.0;
        x1[k] = Vector2::new(next(640), next(480));
        x2[k] = Vector2::new(x1[k].x - 500.0 / depth, x1[k].y);
        y2[k] = x1[k] + Vector2::new(5.0, 3.0);
        points[k] = Vector3::new((x1[k].x - 320.0) * depth / 500.0, (x1[k].y - 240.0) * depth / 500.0, depth);
        if k % 4 == 3 {
            x2[k] = Vector2::new(next(640), next(480));
            y2[k] = x2[k];
        }
    }

    let mut storage = TwoViewStorage::<f32, COUNT>::new();
    let options = RelativePoseOptions::default();
    let found =
        relative_pose(&camera, &camera, &x1, &x2, &options, &mut storage.workspace()).expect("sound input");
    let RelativePoseVerdict::General(motion) = &found.verdict else { panic!("{:?}", found.verdict) };
    println!("relative verdict 00000000");
    println!("relative inliers {:08x}", found.report.inliers);
    print_pose("relative", &motion.pose);

    let options = HomographyOptions::default();
    let found = homography(&x1, &y2, &options, &mut storage.workspace()).expect("sound input");
    print("homography", found.homography().expect("a homography").0.transpose().iter().copied());

    let mut storage = AbsolutePoseStorage::<f32, COUNT>::new();
    let options = AbsolutePoseOptions::default();
    let found =
        absolute_pose(&camera, &x2, &points, &options, &mut storage.workspace()).expect("sound input");
    let AbsolutePoseVerdict::Pose(absolute) = &found.verdict else { panic!("{:?}", found.verdict) };
    println!("absolute verdict 00000000");
    print_pose("absolute", &absolute.pose);

    let pair = ViewPair::new(&motion.pose);
    for (a, b) in x1.iter().zip(&x2).take(4) {
        let bearing = |u: &Vector2<f32>| Vector3::new((u.x - 320.0) / 500.0, (u.y - 240.0) / 500.0, 1.0);
        let found = pair.triangulate_optimal(&bearing(a), &bearing(b));
        use epipole::geometry::triangulation::Triangulation as T;
        let point = match found {
            T::Point(point) | T::Behind { point, .. } => point,
            T::AtInfinity { direction } => direction,
            T::Undetermined => Vector3::zeros(),
        };
        print("point", point.iter().copied());
    }
}
