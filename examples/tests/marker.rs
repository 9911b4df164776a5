//! Runs `marker` as a user does: on its own scene, on an image with corners, and on what it must refuse.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn folder(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("marker").join(name);
    let _ = fs::remove_dir_all(&path);
    fs::create_dir_all(&path).unwrap();
    path
}

fn marker(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_marker")).current_dir(folder).args(arguments).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn its_own_scene() {
    let folder = folder("own");
    for seed in 1..6 {
        let run = marker(&folder, &["--seed", &seed.to_string()]);
        assert!(run.status.success(), "{}", text(&run.stderr));
        let out = text(&run.stdout);
        let error: f64 = out
            .lines()
            .find_map(|line| line.strip_prefix("error: "))
            .and_then(|line| line.split(' ').next())
            .and_then(|number| number.parse().ok())
            .expect("an error in degrees");
        assert!(error < 2.0, "{out}");
    }
    let picture = image::open(folder.join("out/marker.png")).unwrap().to_rgb8();
    assert_eq!(picture.dimensions(), (640, 480));
    // The x axis is drawn in red.
    assert!(picture.pixels().filter(|p| p.0[0] > 200 && p.0[1] < 90 && p.0[2] < 90).count() > 100);
}

#[test]
fn an_image_with_corners_and_refusals() {
    let folder = folder("image");
    image::RgbImage::new(320, 240).save(folder.join("a.png")).unwrap();
    let camera = ["--camera", "300,300,160,120"];
    let run = marker(
        &folder,
        &["a.png", camera[0], camera[1], "--corners", "130,90,190,90,190,150,130,150", "--out", "b.png"],
    );
    assert!(run.status.success(), "{}", text(&run.stderr));
    // 60 px of 0.2 m at f = 300: one metre.
    assert!(text(&run.stdout).contains("t = (0.0000, 0.0000, 1.0000) m"), "{}", text(&run.stdout));
    assert!(folder.join("b.png").exists());
    let refused = |corners: &str, word: &str| {
        let run = marker(&folder, &["a.png", camera[0], camera[1], "--corners", corners, "--out", "c.png"]);
        assert!(!run.status.success() && text(&run.stderr).contains(word), "{}", text(&run.stderr));
        assert!(!folder.join("c.png").exists());
    };
    refused("1,2,3", "8 needed");
    refused("5,5,5,5,5,5,5,5", "no square");
    assert!(!marker(&folder, &["a.png"]).status.success());
    assert!(!marker(&folder, &["--side", "-1"]).status.success());
}
