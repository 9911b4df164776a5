//! Runs `two_view` as a user does: on its own scene, on images, and on what it must refuse.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use image::{Rgb, RgbImage};
use serde_json::Value;

/// Bounds of the built-in scene, in degrees: what the program promises, not what it reaches (a tenth of it).
const MAX_ROTATION_ERROR_DEG: f64 = 0.3;
const MAX_TRANSLATION_ERROR_DEG: f64 = 2.0;

fn folder(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("two_view").join(name);
    let _ = fs::remove_dir_all(&path);
    fs::create_dir_all(&path).unwrap();
    path
}

/// Runs the program in a folder of its own.
fn two_view(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_two_view")).current_dir(folder).args(arguments).output().unwrap()
}

fn json(path: &Path) -> Value {
    serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap()
}

#[track_caller]
fn assert_success(output: &Output) {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// One sentence on standard error, nothing written, and the exit code.
#[track_caller]
fn assert_refused(folder: &Path, arguments: &[&str], code: i32, words: &[&str]) {
    let output = two_view(folder, arguments);
    let message = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(code), "{message}");
    assert!(message.starts_with("error: "), "{message}");
    for word in words {
        assert!(message.contains(word), "no `{word}` in: {message}");
    }
    assert!(!message.contains("panicked"), "{message}");
    if code == 1 {
        assert_eq!(message.trim_end().lines().count(), 1, "{message}");
    }
    assert!(!folder.join("out").exists());
}

#[track_caller]
fn assert_accurate(result: &Value) {
    let number = |key: &str| result[key].as_f64().unwrap_or_else(|| panic!("no number `{key}`"));
    assert!(number("rotation_error_deg") < MAX_ROTATION_ERROR_DEG, "{result}");
    assert!(number("translation_error_deg") < MAX_TRANSLATION_ERROR_DEG, "{result}");
    let (matches, inliers) = (number("matches"), number("inliers"));
    assert!(inliers >= 100.0 && inliers <= matches && number("iterations") >= 1.0, "{result}");
    let list = |key: &str| -> Vec<f64> {
        result[key].as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
    };
    let (r, t) = (list("R"), list("t"));
    assert_eq!((r.len(), t.len()), (9, 3));
    assert!((t.iter().map(|x| x * x).sum::<f64>() - 1.0).abs() < 1e-5);
    // Rows of a rotation are unit vectors, orthogonal to each other.
    for i in 0..3 {
        for j in 0..3 {
            let dot: f64 = (0..3).map(|k| r[3 * i + k] * r[3 * j + k]).sum();
            assert!((dot - f64::from(u8::from(i == j))).abs() < 1e-5);
        }
    }
}

#[test]
fn built_in_scene_in_both_scalars_with_every_output() {
    let folder = folder("built_in");
    let output = two_view(
        &folder,
        &["--json", "a.json", "--ply", "a.ply", "--colmap", "model", "--dump", "views", "--width", "1000"],
    );
    assert_success(&output);
    let text = String::from_utf8(output.stdout).unwrap();
    for words in ["R = [", "t = [", "inliers of", "iterations", "angle between", "in front of both", "truth"]
    {
        assert!(text.contains(words), "no `{words}` in:\n{text}");
    }
    let result = json(&folder.join("a.json"));
    assert_accurate(&result);

    let picture = image::open(folder.join("out/two_view.png")).unwrap();
    assert!(picture.width() <= 1000 && picture.width() > 900);

    let ply = fs::read_to_string(folder.join("a.ply")).unwrap();
    let (header, points) = ply.split_once("end_header\n").unwrap();
    assert!(header.starts_with("ply\nformat ascii 1.0\n"));
    let count = points.lines().count();
    assert!(header.contains(&format!("element vertex {count}\n")));
    assert_eq!(count as u64, result["in_front"].as_u64().unwrap());
    assert!(points.lines().all(|l| l.split(' ').count() == 6));

    check_colmap(&folder.join("model"), count);

    // The same images from files, with the arguments written beside them, in single precision.
    let views = folder.join("views");
    let line = fs::read_to_string(views.join("arguments.txt")).unwrap();
    let mut arguments: Vec<&str> = line.split_whitespace().collect();
    arguments.extend(["--f32", "--features", "2000", "--json", "b.json", "--out", "b.jpg"]);
    assert_success(&two_view(&views, &arguments));
    let single = json(&views.join("b.json"));
    assert_accurate(&single);
    assert!(single["matches"].as_u64() < result["matches"].as_u64());
    assert!(views.join("b.jpg").exists());

    // A lens without distortion is a pinhole, whatever its model is called.
    let lens = format!("{},0,0,0,0", arguments[3]);
    arguments[3] = &lens;
    assert_success(&two_view(&views, &arguments));
    assert_accurate(&json(&views.join("b.json")));
}

/// Two cameras, two images, and points whose tracks name existing observations.
fn check_colmap(folder: &Path, count: usize) {
    let lines = |name: &str| -> Vec<String> {
        let text = fs::read_to_string(folder.join(name)).unwrap();
        text.lines().filter(|l| !l.starts_with('#')).map(String::from).collect()
    };
    let cameras = lines("cameras.txt");
    assert!(cameras.len() == 2 && cameras[0].starts_with("1 PINHOLE 960 640 820 820 480 320"), "{cameras:?}");
    let images = lines("images.txt");
    assert_eq!(images.len(), 4);
    assert!(images[0].starts_with("1 1 0 0 0 0 0 0 1 view1.png"), "{}", images[0]);
    assert_eq!(images[3].split(' ').count(), 3 * count);
    let points = lines("points3D.txt");
    assert_eq!(points.len(), count);
    for (k, line) in points.iter().enumerate() {
        let fields: Vec<&str> = line.split(' ').collect();
        assert_eq!(fields[8..], ["1", &k.to_string(), "2", &k.to_string()]);
        assert!(fields[7].parse::<f64>().unwrap() < 1.0, "reprojection error of {line}");
    }
}

#[test]
fn refuses_with_one_sentence() {
    let folder = folder("refused");
    let camera = ["--camera", "500,500,100,100"];
    let run = |arguments: &[&str], code, words: &[&str]| assert_refused(&folder, arguments, code, words);
    let grey = |name: &str| RgbImage::from_pixel(200, 200, Rgb([90; 3])).save(folder.join(name)).unwrap();
    grey("grey1.png");
    grey("grey2.png");
    fs::write(folder.join("text.png"), "this is no image").unwrap();

    let with = |images: [&'static str; 2]| [images[0], images[1], camera[0], camera[1]];
    run(&with(["grey1.png", "absent.png"]), 1, &["absent.png"]);
    run(&with(["text.png", "grey2.png"]), 1, &["text.png"]);
    // No texture, no matches.
    run(&with(["grey1.png", "grey2.png"]), 1, &["0 correspondences", "5 needed"]);
    run(&["grey1.png", "grey2.png"], 2, &["--camera"]);
    run(&["grey1.png"], 2, &["2"]);
    for (string, word) in [
        ("500,500,100", "3 numbers"),
        ("500,500,100,x", "`x`"),
        ("500,nan,100,100", "`nan`"),
        ("0,500,100,100", "fx"),
        ("500,-500,100,100", "fy"),
    ] {
        run(&["grey1.png", "grey2.png", "--camera", string], 2, &["--camera", word]);
    }
    let fisheye = |camera: &'static str, k: &'static str| {
        ["grey1.png", "grey2.png", "--camera", camera, "--fisheye", k]
    };
    run(&fisheye("500,500,100,100", "1,2,3"), 2, &["3 numbers", "4 needed"]);
    run(&fisheye("500,500,100,100,0,0,0,0", "0,0,0,0"), 1, &["fisheye"]);
    let threshold = [&with(["grey1.png", "grey2.png"])[..], &["--threshold", "-1"]].concat();
    run(&threshold, 1, &["max_error_px"]);
}
