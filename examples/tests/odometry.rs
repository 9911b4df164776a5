//! Runs `odometry` on a short sequence that the test renders.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use epipole::nalgebra::Isometry3;
use epipole_examples::render;

fn odometry(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_odometry")).current_dir(folder).args(arguments).output().unwrap()
}

/// Three frames on the way between the two built-in views, half of it.
fn write_sequence(folder: &Path) {
    fs::create_dir_all(folder.join("image_0")).unwrap();
    let [fx, fy, cx, cy] = render::INTRINSICS;
    fs::write(folder.join("calib.txt"), format!("{fx} 0 {cx} 0 0 {fy} {cy} 0 0 0 1 0\n")).unwrap();
    let mut poses = String::new();
    for k in 0..3 {
        let pose = Isometry3::identity().lerp_slerp(&render::true_pose(), 0.25 * f64::from(k));
        render::render(&pose, k as u64).save(folder.join(format!("image_0/{k:06}.png"))).unwrap();
        let m = pose.inverse().to_homogeneous();
        let rows: Vec<String> = (0..12).map(|i| m[(i / 4, i % 4)].to_string()).collect();
        poses += &(rows.join(" ") + "\n");
    }
    fs::write(folder.join("poses.txt"), poses).unwrap();
}

#[test]
fn a_rendered_sequence() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("odometry");
    let _ = fs::remove_dir_all(&folder);
    write_sequence(&folder);
    let output =
        odometry(&folder, &[".", "--features", "1500", "--matches", "matches", "--out", "track.png"]);
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let last = text.lines().last().unwrap();
    assert!(last.starts_with("pairs=2 lost=0 "), "{text}");
    let value = |key: &str| -> f64 {
        last.split(' ').find_map(|w| w.strip_prefix(key)?.strip_prefix('=')).unwrap().parse().unwrap()
    };
    assert!(value("max_r_deg") < 0.3 && value("max_t_deg") < 2.0, "{last}");
    assert!(value("median_r_deg") <= value("max_r_deg") && value("median_t_deg") <= value("max_t_deg"));
    // The second step is as long as the first; its length was carried on by common points.
    let drift = text.lines().find(|l| l.starts_with("path ")).unwrap();
    let percent: f64 = drift.split(['(', '%']).nth(1).unwrap().trim().parse().unwrap();
    assert!(percent < 3.0, "{drift}");
    let track = image::open(folder.join("track.png")).unwrap();
    assert_eq!((track.width(), track.height()), (900, 700));
    let files = fs::read_dir(folder.join("matches")).unwrap().count();
    assert_eq!(files, 2);

    // Without the truth: a path in baselines, and no errors.
    fs::remove_file(folder.join("poses.txt")).unwrap();
    let output = odometry(&folder, &[".", "--frames", "2", "--f32", "--features", "1500"]);
    assert!(output.status.success());
    assert!(!String::from_utf8(output.stdout).unwrap().contains("median"));

    for (arguments, words) in [(["absent", "--f32"], "calib.txt"), ([".", "--frames=1"], "fewer than two")] {
        let output = odometry(&folder, &arguments);
        let message = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1));
        assert!(message.starts_with("error: ") && message.contains(words), "{message}");
    }
}
