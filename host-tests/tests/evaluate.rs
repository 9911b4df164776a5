//! Runs `evaluate` as a user does, on files that the test writes.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use epipole::nalgebra::{Matrix3, Rotation3, Vector3};

fn folder(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("evaluate").join(name);
    let _ = fs::remove_dir_all(&path);
    fs::create_dir_all(&path).unwrap();
    path
}

fn evaluate(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_evaluate")).current_dir(folder).args(arguments).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

/// Uniform numbers in [-1, 1): a linear congruential generator is enough for a scene.
fn random(state: &mut u64) -> f64 {
    *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

const CAMERA: [f64; 4] = [700.0, 710.0, 320.0, 240.0];

fn pixel(x: &Vector3<f64>) -> [f64; 2] {
    [CAMERA[0] * x.x / x.z + CAMERA[2], CAMERA[1] * x.y / x.z + CAMERA[3]]
}

/// A file of `count` correspondences of a general scene with 0.3 px of noise, every fourth one wrong.
fn pose_file(path: &Path, seed: u64, count: usize) {
    let mut state = seed;
    let rotation = Rotation3::from_scaled_axis(Vector3::new(0.03, -0.12, 0.05));
    let t = Vector3::new(0.8, -0.1, 0.2);
    let mut out = String::from("# size 640 480\n");
    for view in ["K1", "K2"] {
        writeln!(out, "{view} {} {} {} {}", CAMERA[0], CAMERA[1], CAMERA[2], CAMERA[3]).unwrap();
    }
    let r: Vec<String> = rotation.matrix().transpose().iter().map(f64::to_string).collect();
    writeln!(out, "R_gt {}\nt_gt {} {} {}\nn {count}", r.join(" "), t.x, t.y, t.z).unwrap();
    for k in 0..count {
        let x =
            Vector3::new(2.0 * random(&mut state), 1.5 * random(&mut state), 6.0 + 2.0 * random(&mut state));
        let ([u, v], mut q) = (pixel(&x), pixel(&(rotation * x + t)));
        if k % 4 == 3 {
            q = [320.0 * (1.0 + random(&mut state)), 240.0 * (1.0 + random(&mut state))];
        }
        let mut noise = || 0.3 * random(&mut state);
        writeln!(out, "{} {} {} {} {k}", u + noise(), v + noise(), q[0] + noise(), q[1] + noise()).unwrap();
    }
    fs::write(path, out).unwrap();
}

/// The value of a key of the pooled line, which is the last.
#[track_caller]
fn pooled(stdout: &str, key: &str) -> f64 {
    let line = stdout.lines().last().unwrap();
    assert!(line.starts_with("pooled "), "{stdout}");
    let word = line.split(' ').find_map(|w| w.strip_prefix(key)?.strip_prefix('='));
    word.unwrap_or_else(|| panic!("no {key} in {line}")).parse().unwrap()
}

#[test]
fn relative_pose_and_fundamental() {
    let folder = folder("pose");
    fs::create_dir(folder.join("scene")).unwrap();
    for k in 0..4 {
        pose_file(&folder.join(format!("scene/{k}_synthetic.txt")), k, 200);
    }
    for (problem, scalar) in
        [("relative-pose", "f64"), ("relative-pose", "f32"), ("fundamental", "f64"), ("fundamental", "f32")]
    {
        let output = evaluate(
            &folder,
            &[problem, "scene", "--scalar", scalar, "--csv", "out.csv", "--plot", "out.svg", "--seed", "7"],
        );
        let stdout = text(&output.stdout);
        assert!(output.status.success(), "{}", text(&output.stderr));
        assert!(stdout.contains("scene synthetic"), "{stdout}");
        assert_eq!(pooled(&stdout, "files"), 4.0);
        assert_eq!(pooled(&stdout, "fail"), 0.0);
        // 150 correspondences with an error of 0.17 px (rms) see a motion like this far better than half a degree.
        assert!(pooled(&stdout, "median_r_deg") < 0.5, "{problem} {scalar}: {stdout}");
        assert!(pooled(&stdout, "auc5") > 50.0 && pooled(&stdout, "auc5") <= pooled(&stdout, "auc20"));
        assert!(pooled(&stdout, "auc10") > 50.0 && pooled(&stdout, "median_t_deg") < 5.0);
        assert!(pooled(&stdout, "ms_median") > 0.0);
        let csv = fs::read_to_string(folder.join("out.csv")).unwrap();
        assert!(
            csv.starts_with("file,r_deg,t_deg,correspondences,inliers,iterations,ms,doubt,refusal\n"),
            "{csv}"
        );
        assert_eq!(csv.lines().count(), 5);
        let svg = fs::read_to_string(folder.join("out.svg")).unwrap();
        assert!(svg.starts_with("<svg") && svg.contains("scene synthetic (4)"));
    }
}

#[test]
fn curves_of_risk_and_of_time() {
    let folder = folder("curves");
    for k in 0..3 {
        pose_file(&folder.join(format!("{k}.txt")), k, 100);
    }
    for problem in ["relative-pose", "fundamental"] {
        let output = evaluate(
            &folder,
            &[problem, ".", "--plot-risk", "risk.svg", "--plot-time", "time.svg", "--csv", "a.csv"],
        );
        let stdout = text(&output.stdout);
        assert!(output.status.success(), "{}", text(&output.stderr));
        let risk = fs::read_to_string(folder.join("risk.svg")).unwrap();
        assert!(risk.starts_with("<svg") && risk.contains("by covariance, verdict and inliers"));
        let time = fs::read_to_string(folder.join("time.svg")).unwrap();
        assert!(time.starts_with("<svg") && time.contains("AUC@10 deg"));
        let budgets: Vec<&str> = stdout.lines().filter(|line| line.starts_with("budget_ms=")).collect();
        assert!(budgets.len() == 8 && budgets[7].contains(" auc5="), "{stdout}");
        assert_eq!(pooled(&stdout, "files"), 3.0);
        // Every answer has a finite doubt.
        let csv = fs::read_to_string(folder.join("a.csv")).unwrap();
        let doubts = csv.lines().skip(1).map(|row| row.split(',').nth(7).unwrap().parse::<f64>().unwrap());
        assert!(doubts.clone().count() == 3 && doubts.clone().all(|d| d > 0.0 && d < 3.0), "{csv}");
    }
}

#[test]
fn fewer_correspondences_and_iterations_are_used_when_asked() {
    let folder = folder("limits");
    pose_file(&folder.join("a.txt"), 5, 200);
    let run = |extra: &[&str]| {
        let output = evaluate(&folder, &[&["relative-pose", "a.txt", "--csv", "a.csv"], extra].concat());
        assert!(output.status.success(), "{}", text(&output.stderr));
        let csv = fs::read_to_string(folder.join("a.csv")).unwrap();
        let row = csv.lines().nth(1).unwrap().to_string();
        row.split(',').map(String::from).collect::<Vec<_>>()
    };
    assert_eq!(run(&["--max-corr", "40"])[3], "40");
    assert_eq!(run(&["--max-iterations", "3"])[5], "3");
    let tight: u32 = run(&["--threshold", "0.1"])[4].parse().unwrap();
    let loose: u32 = run(&["--threshold", "2"])[4].parse().unwrap();
    assert!(tight < loose, "{tight} {loose}");
    // The same seed gives the same row, but for the time.
    let (a, b) = (run(&["--seed", "3"]), run(&["--seed", "3"]));
    assert_eq!((&a[..6], &a[7..]), (&b[..6], &b[7..]));
    // Without time, the first question ends it.
    assert_eq!(run(&["--time-budget", "0", "--confidence", "0.999999"])[5], "8");
}

#[test]
fn homography() {
    let folder = folder("homography");
    let h = Matrix3::new(0.9, 0.1, 12.0, -0.08, 1.05, -7.0, 1e-4, -5e-5, 1.0);
    let mut state = 3;
    let mut out = String::from("# size 640 480\n");
    let values: Vec<String> = h.transpose().iter().map(f64::to_string).collect();
    writeln!(out, "H_gt {}\nn 120", values.join(" ")).unwrap();
    for k in 0..120 {
        let x = Vector3::new(320.0 * (1.0 + random(&mut state)), 240.0 * (1.0 + random(&mut state)), 1.0);
        let y = h * x;
        let wrong = if k % 3 == 0 { 80.0 } else { 0.3 };
        let mut noise = || wrong * random(&mut state);
        // Four numbers: the order is the score.
        writeln!(out, "{} {} {} {}", x.x, x.y, y.x / y.z + noise(), y.y / y.z + noise()).unwrap();
    }
    fs::write(folder.join("plane.txt"), out).unwrap();
    for scalar in ["f64", "f32"] {
        let output = evaluate(&folder, &["homography", "plane.txt", "--scalar", scalar, "--csv", "h.csv"]);
        let stdout = text(&output.stdout);
        assert!(output.status.success(), "{}", text(&output.stderr));
        assert!(pooled(&stdout, "median_px") < 0.5, "{stdout}");
        assert!(pooled(&stdout, "auc3") > 80.0 && pooled(&stdout, "auc10") > 80.0);
        assert!(fs::read_to_string(folder.join("h.csv")).unwrap().starts_with("file,error_px,"));
    }
}

#[test]
fn a_broken_file_is_named_with_its_line_and_skipped() {
    let folder = folder("broken");
    pose_file(&folder.join("good.txt"), 1, 60);
    let good = fs::read_to_string(folder.join("good.txt")).unwrap();
    let line = |k: usize, with: &str| {
        let mut lines: Vec<&str> = good.lines().collect();
        lines[k - 1] = with;
        lines.join("\n")
    };
    let cases = [
        ("number.txt", line(20, "1 2 x 4 5"), "number.txt:20: `x` is not a finite number"),
        ("nan.txt", line(20, "1 2 NaN 4 5"), "nan.txt:20: `NaN` is not a finite number"),
        ("few.txt", line(20, "1 2 3"), "few.txt:20: 3 numbers, 4 or 5 needed"),
        ("focal.txt", line(2, "K1 -700 700 320 240"), "focal.txt:2: focal length of K1 is not positive"),
        ("rotation.txt", line(4, "R_gt 1 2 3 4 5 6 7 8 9"), "rotation.txt:4: R_gt is not a rotation"),
        ("count.txt", line(6, "n many"), "count.txt:6: `many` is not a count"),
        ("short.txt", line(6, "n 61"), "short.txt:66: 60 correspondences, 61 announced"),
        ("long.txt", line(6, "n 59"), "long.txt:66: more than the 59 correspondences announced"),
        ("header.txt", line(5, "# no translation"), "header.txt: no line `t_gt`"),
        ("key.txt", line(5, "t 1 0 0"), "key.txt:5: unknown header `t`"),
    ];
    for (name, content, message) in &cases {
        fs::write(folder.join(name), content).unwrap();
        let output = evaluate(&folder, &["relative-pose", "good.txt", name]);
        assert_eq!(output.status.code(), Some(3), "{name}");
        let errors = text(&output.stderr);
        assert!(errors.contains(&format!("skipped {message}")), "{name}: {errors}");
        assert_eq!(pooled(&text(&output.stdout), "files"), 1.0);
    }
    // All of them in one run; and nothing but a broken file.
    let output = evaluate(&folder, &["relative-pose", "."]);
    assert_eq!(output.status.code(), Some(3));
    assert_eq!(text(&output.stderr).lines().count(), cases.len());
    let output = evaluate(&folder, &["relative-pose", "nan.txt"]);
    assert_eq!((output.status.code(), output.stdout.len()), (Some(1), 0));
}

#[test]
fn wrong_command_lines() {
    let folder = folder("command_line");
    pose_file(&folder.join("a.txt"), 1, 60);
    let code = |arguments: &[&str]| evaluate(&folder, arguments).status.code();
    assert_eq!(code(&["relative-pose"]), Some(2));
    assert_eq!(code(&["essential", "a.txt"]), Some(2));
    assert_eq!(code(&["relative-pose", "a.txt", "--scalar", "f16"]), Some(2));
    assert_eq!(code(&["relative-pose", "absent.txt"]), Some(1));
    assert_eq!(code(&["relative-pose", "a.txt", "--plot", "a.png"]), Some(1));
    assert_eq!(code(&["relative-pose", "a.txt", "--plot-risk", "a.png"]), Some(1));
    assert_eq!(code(&["relative-pose", "a.txt", "--time-budget", "-1"]), Some(2));
    // An option that the estimator refuses is no broken file: every answer is a refusal.
    let output = evaluate(&folder, &["relative-pose", "a.txt", "--confidence", "1.5"]);
    assert_eq!(pooled(&text(&output.stdout), "fail"), 1.0);
}

#[test]
fn absolute_pose_of_known_points() {
    let folder = folder("absolute");
    let mut state = 9;
    let rotation = Rotation3::from_scaled_axis(Vector3::new(0.03, -0.12, 0.05));
    let t = Vector3::new(0.8, -0.1, 0.2);
    let r: Vec<String> = rotation.matrix().transpose().iter().map(f64::to_string).collect();
    let mut out = format!(
        "# size 640 480\nK {} {} {} {}\nR_gt {}\nt_gt {} {} {}\nn 80\n",
        CAMERA[0],
        CAMERA[1],
        CAMERA[2],
        CAMERA[3],
        r.join(" "),
        t.x,
        t.y,
        t.z
    );
    for k in 0..80 {
        let x =
            Vector3::new(2.0 * random(&mut state), 1.5 * random(&mut state), 6.0 + 2.0 * random(&mut state));
        let [u, v] = pixel(&(rotation * x + t));
        let wrong = if k % 4 == 3 { 80.0 } else { 0.3 };
        let (du, dv) = (wrong * random(&mut state), wrong * random(&mut state));
        writeln!(out, "{} {} {} {} {} {k}", x.x, x.y, x.z, u + du, v + dv).unwrap();
    }
    fs::write(folder.join("a.txt"), &out).unwrap();
    for scalar in ["f32", "f64"] {
        let run = evaluate(&folder, &["absolute-pose", "a.txt", "--scalar", scalar]);
        assert_eq!(run.status.code(), Some(0), "{}", text(&run.stderr));
        let line = text(&run.stdout);
        assert!(line.contains("pooled files=1") && line.contains("fail=0.0000"), "{line}");
    }
    fs::write(folder.join("broken.txt"), out.replace("n 80", "n 81")).unwrap();
    let run = evaluate(&folder, &["absolute-pose", "."]);
    assert_eq!(run.status.code(), Some(3));
    assert!(text(&run.stderr).contains("80 correspondences, 81 announced"), "{}", text(&run.stderr));
}

#[test]
fn bundle_problems() {
    use epipole_host_tests::bundle::flight::{CAMERA, Flight};
    use epipole_host_tests::bundle::problem::{Problem, pinhole};
    let folder = folder("bundle");
    for seed in [1, 2] {
        let flight = Flight::new(6, 40, 0.5, seed);
        let mut state = seed;
        let mut off = || 0.05 * Vector3::new(random(&mut state), random(&mut state), random(&mut state));
        let mut problem = Problem {
            cameras: vec![pinhole(CAMERA).unwrap(); 6],
            poses: flight.poses.clone(),
            true_poses: flight.poses.clone(),
            points: flight.landmarks.iter().map(|x| x + off()).collect(),
            ..Problem::default()
        };
        for pose in &mut problem.poses[2..] {
            pose.translation.vector += off();
        }
        for (frame, seen) in flight.seen.iter().enumerate() {
            problem.observations.extend(seen.iter().map(|(track, pixel)| (frame, *track, *pixel)));
        }
        fs::write(folder.join(format!("{seed}.txt")), problem.export()).unwrap();
    }
    for scalar in ["f32", "f64"] {
        let out = evaluate(
            &folder,
            &["bundle", "1.txt", "2.txt", "--scalar", scalar, "--csv", "b.csv", "--plot", "b.svg"],
        );
        assert_eq!(out.status.code(), Some(0), "{}", text(&out.stderr));
        assert_eq!(text(&out.stdout).lines().count(), 3);
        let csv = fs::read_to_string(folder.join("b.csv")).unwrap();
        let mut rows = csv.lines().map(|l| l.split(',').collect::<Vec<_>>());
        let header = rows.next().unwrap();
        for row in rows {
            let value =
                |key: &str| -> f64 { row[header.iter().position(|h| *h == key).unwrap()].parse().unwrap() };
            assert!(value("cost_after") < 0.2 * value("cost_before"), "{csv}");
            assert!(value("rms_px_after") < 2.0 && value("r_deg_after") < 0.5, "{csv}");
            assert_eq!((row[0].len(), *row.last().unwrap()), (1, "Converged"));
        }
        assert!(fs::read_to_string(folder.join("b.svg")).unwrap().contains("Cost of bundle adjustment"));
    }
    fs::write(folder.join("broken.txt"), "2 1 1 1\n1 0 0 0 1 0 0 0 nan 0 0 0\n").unwrap();
    let out = evaluate(&folder, &["bundle", "1.txt", "broken.txt"]);
    assert!(out.status.code() == Some(3) && text(&out.stderr).contains("skipped broken.txt"));
    assert_eq!(evaluate(&folder, &["bundle", "broken.txt"]).status.code(), Some(1));
}
