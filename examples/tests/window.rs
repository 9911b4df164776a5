//! Runs `window` over a short flight, and on a file that the test writes.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use epipole::nalgebra::{Vector2, Vector3};
use epipole_host_tests::bundle::flight::{CAMERA, Flight};
use epipole_host_tests::bundle::problem::{Problem, pinhole};

fn window(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_window")).current_dir(folder).args(arguments).output().unwrap()
}

fn folder(name: &str) -> std::path::PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    folder
}

fn text(output: &Output) -> String {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout.clone()).unwrap()
}

#[test]
fn a_flight() {
    let folder = folder("window_flight");
    for scalar in [&[][..], &["--f32"]] {
        let arguments = [&["--length", "100", "--out", "path.svg"], scalar].concat();
        let table = text(&window(&folder, &arguments));
        let last: Vec<f64> = table
            .lines()
            .rfind(|l| l.trim_start().starts_with("100 "))
            .unwrap()
            .split_ascii_whitespace()
            .map(|w| w.parse().unwrap())
            .collect();
        let [_, iterations, before, after, _, error, sigma, dead_reckoning] = last[..] else {
            panic!("{table}")
        };
        assert!(iterations >= 1.0 && after <= before, "{table}");
        assert!(error < dead_reckoning && error < 4.0 * sigma, "{table}");
        let picture = fs::read_to_string(folder.join("path.svg")).unwrap();
        assert!(picture.starts_with("<svg") && picture.matches("<polyline").count() >= 3);
    }
}

/// Eight frames of a flight, with points a little off.
fn problem() -> Problem {
    let flight = Flight::new(8, 40, 1.0, 3);
    let mut p = Problem {
        cameras: vec![pinhole(CAMERA).unwrap(); 8],
        poses: flight.poses.clone(),
        true_poses: flight.poses.clone(),
        points: flight.landmarks.iter().map(|x| x + Vector3::new(0.05, -0.05, 0.1)).collect(),
        true_points: flight.landmarks.clone(),
        fixed: 2,
        ..Problem::default()
    };
    for (frame, seen) in flight.seen.iter().enumerate() {
        p.observations.extend(seen.iter().map(|(track, pixel)| (frame, *track, *pixel)));
    }
    p.observations.push((0, 0, Vector2::new(600.0, 10.0)));
    p.observations.sort_by_key(|o| (o.1, o.0));
    p.observations.dedup_by_key(|o| (o.1, o.0));
    p
}

#[test]
fn a_file() {
    let folder = folder("window_file");
    fs::write(folder.join("problem.txt"), problem().export()).unwrap();
    for scalar in [&[][..], &["--f32"]] {
        let arguments = [&["problem.txt", "--points", "30", "--out", "path.svg"], scalar].concat();
        let table = text(&window(&folder, &arguments));
        assert!(table.starts_with("8 of 8 frames, 30 of "), "{table}");
        let last = table.lines().find(|l| l.contains(" after ")).unwrap();
        assert!(last.starts_with("Converged"), "{table}");
        let costs: Vec<f64> =
            last.split("cost ").nth(1).unwrap().split([' ', ';']).filter_map(|w| w.parse().ok()).collect();
        assert!(costs[1] < 0.5 * costs[0], "{table}");
        assert!(fs::read_to_string(folder.join("path.svg")).unwrap().starts_with("<svg"));
    }
    fs::write(folder.join("broken.txt"), "3 2 1 1\n1 0 0").unwrap();
    for (arguments, words) in [
        (&["absent.txt"][..], "o such file"),
        (&["--frames", "2"], "three frames"),
        (&["broken.txt"], "too early"),
    ] {
        let output = window(&folder, arguments);
        let message = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1));
        assert!(message.starts_with("error: ") && message.contains(words), "{message}");
    }
}
