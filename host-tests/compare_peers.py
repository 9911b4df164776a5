#!/usr/bin/env python3
"""Our robust estimators beside OpenCV's, PoseLib's and COLMAP's on the same problems, in one run.

    pip install numpy opencv-python-headless poselib pycolmap        # those that are missing are left out
    python3 host-tests/compare_peers.py relative-pose                # synthetic scenes
    python3 host-tests/compare_peers.py homography PATH...           # files, or folders of .txt files

Tasks: relative-pose, fundamental, homography, absolute-pose. The format of files is what `evaluate --help` describes.
Our functions are called through the library that `cargo build --release -p epipole-peers` builds (done here).

Every library gets the same pixels, threshold and confidence, and one thread. "min20" is a peer whose minimum of 1000
iterations is lowered to 20. Errors: relative-pose and fundamental, the larger of rotation and direction of translation
in degrees (fundamental: of the best pose of its essential matrix); homography, the mean distance in pixels over the
part of image 1 that the truth sends into image 2; absolute-pose, the larger of rotation in degrees and position in
percent of its distance from the middle of the points. Times are CPU time of a call.
"""

import argparse
import ctypes
import os
import pathlib
import subprocess
import sys
import time

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parent.parent
WIDTH, HEIGHT, FOCAL, CX, CY = 1241, 376, 718.0, 620.5, 188.0
THRESHOLDS = {"homography": (3, 5, 10), "absolute-pose": (0.5, 1, 5)}
MAX_ERROR_PX = {"homography": 4.0, "absolute-pose": 3.0}


# Problems: dictionaries of a, b (pixels, or points and pixels), k1, k2 (fx fy cx cy), R, t or H, size.


def rotation(rng, max_deg):
    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    angle = np.radians(rng.uniform(0, max_deg))
    s = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.eye(3) + np.sin(angle) * s + (1 - np.cos(angle)) * s @ s


# What synthetic scenes usually leave out, one at a time.
DISTURBANCES = {
    "clusters": "wrong matches lead from one of three patches of 60 px to one of three others",
    "second-motion": "30 % of the matches belong to a body with another motion",
    "heavy-tails": "noise of Student's t with three degrees of freedom and the given deviation",
    "integers": "pixels are rounded",
    "focal": "the focal lengths given are 1 % too long",
    "many-to-one": "wrong matches end in five pixels",
}


def synthetic(task, scene, n, outliers, noise_px, seed, disturbance=None):
    rng = np.random.default_rng(seed)
    k = np.array([FOCAL, FOCAL, CX, CY])
    forward = scene == "forward"
    R = rotation(rng, 3 if forward else 20)
    t = np.array([0, 0, -1.0]) + 0.05 * rng.normal(size=3) if forward else rng.normal(size=3)
    t *= rng.uniform(0.5, 2) / np.linalg.norm(t)
    plane = (rng.normal(size=3) + [0, 0, 4]) / rng.uniform(20, 50)
    a, b, X = [], [], []
    while len(a) < n:
        pixel = rng.uniform(0, 1, 2) * [WIDTH, HEIGHT]
        ray = np.array([(pixel[0] - CX) / FOCAL, (pixel[1] - CY) / FOCAL, 1.0])
        depth = 1 / (plane @ ray) if scene == "planar" else rng.uniform(5, 50) if forward else rng.uniform(2, 20)
        point = depth * ray
        seen = R @ point + t
        if depth < 1 or depth > 60 or seen[2] < 0.3:
            continue
        image = FOCAL * seen[:2] / seen[2] + [CX, CY]
        if np.any(image < -600) or np.any(image > np.array([WIDTH, HEIGHT]) + 600):
            continue
        a.append(pixel), b.append(image), X.append(point)
    a, b, X = np.array(a), np.array(b), np.array(X)
    K = np.array([[FOCAL, 0, CX], [0, FOCAL, CY], [0, 0, 1]])
    H = K @ (R + np.outer(t, plane)) @ np.linalg.inv(K)
    order = rng.permutation(n)
    wrong = order[: round(outliers * n)]
    if disturbance == "second-motion":
        body = order[len(wrong) :][: round(0.3 * n)]
        moved = (X[body] - [0, 0, 8]) @ rotation(rng, 20).T + [0, 0, 8] + 2 * rng.normal(size=3)
        moved[:, 2] = np.maximum(moved[:, 2], 1)
        b[body] = FOCAL * moved[:, :2] / moved[:, 2:] + [CX, CY]
    if disturbance == "heavy-tails":
        noise = lambda shape: noise_px / np.sqrt(3) * rng.standard_t(3, shape)
    else:
        noise = lambda shape: noise_px * rng.normal(size=shape)
    a, b = a + noise(a.shape), b + noise(b.shape)
    whole = np.array([WIDTH, HEIGHT])
    if disturbance == "clusters":
        patches = rng.uniform(0, 1, (2, 3, 2)) * (whole - 60)
        which = rng.integers(0, 3, len(wrong))
        a[wrong], b[wrong] = (patch[which] + 60 * rng.uniform(0, 1, (len(wrong), 2)) for patch in patches)
    elif disturbance == "many-to-one":
        b[wrong] = (rng.uniform(0, 1, (5, 2)) * whole)[rng.integers(0, 5, len(wrong))]
    else:
        b[wrong] = rng.uniform(0, 1, (len(wrong), 2)) * whole
    if disturbance == "integers":
        a, b = np.round(a), np.round(b)
    if disturbance == "focal":
        k = k * [1.01, 1.01, 1, 1]
    truth = {"H": H} if task == "homography" else {"R": R, "t": t}
    return {"a": X if task == "absolute-pose" else a, "b": b, "k1": k, "k2": k, "size": (WIDTH, HEIGHT), **truth}


def read(path, task, max_corr, seed):
    problem, rows = {"size": None}, None
    for number, line in enumerate(path.read_text().splitlines(), 1):
        words = line.split()
        if line.startswith("# size "):
            problem["size"] = tuple(float(w) for w in words[2:4])
        if not words or line.startswith("#"):
            continue
        try:
            if rows is not None:
                rows.append([float(w) for w in words])
            elif words[0] == "n":
                rows = []
            else:
                problem[words[0]] = np.array([float(w) for w in words[1:]])
        except ValueError as error:
            sys.exit(f"{path}:{number}: {error}")
    width = 5 if task == "absolute-pose" else 4
    rows = np.array([row[:width] for row in rows[: max_corr or None]])
    np.random.default_rng(seed).shuffle(rows)  # a file is sorted, and an estimator must not profit
    split = width - 2
    found = {"a": rows[:, :split].copy(), "b": rows[:, split:].copy(), "size": problem["size"]}
    if found["size"] is None:
        found["size"] = tuple(rows[:, :2].max(axis=0) + 1)
    found["k1"] = problem.get("K1", problem.get("K", np.array([1.0, 1, 0, 0])))
    found["k2"] = problem.get("K2", found["k1"])
    if task == "homography":
        return {**found, "H": problem["H_gt"].reshape(3, 3)}
    return {**found, "R": problem["R_gt"].reshape(3, 3), "t": problem["t_gt"]}


# Errors.


def chord_deg(a, b, scale):
    return np.degrees(2 * np.arcsin(min(1.0, np.linalg.norm(a - b) / scale)))


def pose_error(R, t, d):
    t, truth = np.ravel(t) / np.linalg.norm(t), d["t"] / np.linalg.norm(d["t"])
    return max(chord_deg(R, d["R"], np.sqrt(8)), chord_deg(t, truth, 2))


def matrix(k):
    return np.array([[k[0], 0, k[2]], [0, k[1], k[3]], [0, 0, 1.0]])


def fundamental_error(F, d):
    U, _, Vt = np.linalg.svd(matrix(d["k2"]).T @ F @ matrix(d["k1"]))
    W = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    turns = [U @ w @ Vt for w in (W, W.T)]
    turns = [R * np.sign(np.linalg.det(R)) for R in turns]
    return min(pose_error(R, s * U[:, 2], d) for R in turns for s in (1, -1))


def homography_error(H, d):
    w, h = d["size"]
    grid = np.array([[x, y, 1] for y in np.linspace(0, h - 1, 21) for x in np.linspace(0, w - 1, 21)])
    want, got = grid @ d["H"].T, grid @ H.T
    front = want[:, 2] * (d["H"] @ [w / 2, h / 2, 1])[2] > 0
    want, got = want[:, :2] / want[:, 2:], got[:, :2] / got[:, 2:]
    inside = front & np.all((want >= 0) & (want <= [w - 1, h - 1]), axis=1)
    return np.mean(np.linalg.norm(want - got, axis=1)[inside])


def absolute_error(R, t, d):
    centre, truth = -R.T @ np.ravel(t), -d["R"].T @ d["t"]
    position = 100 * np.linalg.norm(centre - truth) / np.linalg.norm(d["a"].mean(axis=0) - truth)
    return max(chord_deg(R, d["R"], np.sqrt(8)), position)


def judge(task, answer, d):
    if answer is None:
        return np.inf
    with np.errstate(all="ignore"):
        error = {
            "relative-pose": lambda: pose_error(*answer, d),
            "fundamental": lambda: fundamental_error(answer, d),
            "homography": lambda: homography_error(answer, d),
            "absolute-pose": lambda: absolute_error(*answer, d),
        }[task]()
    return error if np.isfinite(error) else np.inf


def auc(errors, limit):
    errors = np.sort(errors)
    recall = np.arange(1, len(errors) + 1) / len(errors)
    below = errors < limit
    x = np.r_[0, errors[below], limit]
    y = np.r_[0, recall[below], recall[below][-1:] if below.any() else 0]
    return 100 * np.sum((x[1:] - x[:-1]) * (y[1:] + y[:-1]) / 2) / limit


# The libraries: name -> f(problem, threshold, confidence), a pose (R, t), a matrix or None.


def ours(task, iterations):
    subprocess.run(["cargo", "build", "--release", "--quiet", "-p", "epipole-peers"], cwd=ROOT, check=True)
    target = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "release"
    name = {"darwin": "libepipole_peers.dylib", "win32": "epipole_peers.dll"}.get(sys.platform, "libepipole_peers.so")
    library = ctypes.CDLL(str(target / name))
    symbol = {"relative-pose": "relpose", "absolute-pose": "abspose"}.get(task, task)
    length = 12 if task.endswith("pose") else 9
    peers = {}
    for scalar, real, c_real in (("f64", np.float64, ctypes.c_double), ("f32", np.float32, ctypes.c_float)):
        function = getattr(library, f"bench_ransac_{symbol}_{scalar}")
        pointer = ctypes.c_void_p
        numbers = [c_real, c_real, ctypes.c_int, ctypes.c_uint64]
        function.argtypes = [pointer, pointer, ctypes.c_int, pointer, *numbers, pointer]
        function.restype = ctypes.c_int

        def call(d, threshold, confidence, function=function, real=real):
            first, second = ("b", "a") if task == "absolute-pose" else ("a", "b")
            # One camera a call: pixels of view 2 are moved into camera 1.
            b = d["b"]
            if task == "relative-pose" and not np.array_equal(d["k1"], d["k2"]):
                b = (b - d["k2"][2:]) / d["k2"][:2] * d["k1"][:2] + d["k1"][2:]
            arrays = [np.ascontiguousarray(v, real) for v in ({**d, "b": b}[first], {**d, "b": b}[second], d["k1"])]
            out = np.zeros(length, real)
            x, y, k = (v.ctypes.data for v in arrays)
            n = function(x, y, len(arrays[0]), k, threshold, confidence, iterations, 1, out.ctypes.data)
            if n < 0:
                return None
            out = out.astype(float)
            return (out[:9].reshape(3, 3), out[9:]) if length == 12 else out.reshape(3, 3)

        peers[f"epipole {scalar}"] = call
    return peers


def opencv(task, _):
    import cv2

    cv2.setNumThreads(1)

    def essential(method):
        def call(d, threshold, confidence):
            K = matrix(d["k1"])
            b = (d["b"] - d["k2"][2:]) / d["k2"][:2] * d["k1"][:2] + d["k1"][2:]
            E, _ = cv2.findEssentialMat(d["a"], b, K, method=method, prob=confidence, threshold=threshold)
            if E is None or E.shape[0] < 3:
                return None
            found = [cv2.recoverPose(E[i : i + 3], d["a"], b, K) for i in range(0, E.shape[0], 3)]
            return max(found, key=lambda f: f[0])[1:3]

        return call

    def pnp(d, threshold, confidence):
        ok, r, t, _ = cv2.solvePnPRansac(
            d["a"], d["b"], matrix(d["k1"]), None,
            iterationsCount=1000, reprojectionError=threshold, confidence=confidence, flags=cv2.SOLVEPNP_EPNP,
        )
        return (cv2.Rodrigues(r)[0], t) if ok else None

    def homography(method):
        return lambda d, thr, conf: cv2.findHomography(d["a"], d["b"], method, thr, None, 2000, conf)[0]

    def fundamental(method):
        def call(d, threshold, confidence):
            F = cv2.findFundamentalMat(d["a"], d["b"], method, threshold, confidence, 2000)[0]
            return F if F is not None and F.shape == (3, 3) else None

        return call

    make = {"relative-pose": essential, "homography": homography, "fundamental": fundamental}.get(task)
    if make is None:
        return {"OpenCV EPnP": pnp}
    ransac = cv2.FM_RANSAC if task == "fundamental" else cv2.RANSAC
    return {"OpenCV RANSAC": make(ransac), "OpenCV USAC_MAGSAC": make(cv2.USAC_MAGSAC)}


def poselib(task, iterations):
    import poselib as p

    def camera(k):
        return {"model": "PINHOLE", "width": 0, "height": 0, "params": list(k)}

    def options(threshold, confidence, minimum):
        limit = "max_reproj_error" if task in MAX_ERROR_PX else "max_epipolar_error"
        steps = {"min_iterations": minimum, "max_iterations": iterations}
        return {limit: threshold, "success_prob": confidence, **steps}

    def call(minimum):
        def run(d, threshold, confidence):
            ransac = options(threshold, confidence, minimum)
            if task == "relative-pose":
                pose = p.estimate_relative_pose(d["a"], d["b"], camera(d["k1"]), camera(d["k2"]), ransac, {})[0]
                return pose.R, pose.t
            if task == "absolute-pose":
                pose = p.estimate_absolute_pose(d["b"], d["a"], camera(d["k1"]), ransac, {})[0]
                return pose.R, pose.t
            estimate = p.estimate_homography if task == "homography" else p.estimate_fundamental
            return estimate(d["a"], d["b"], ransac, {})[0]

        return run

    return {"PoseLib": call(1000), "PoseLib min20": call(20)}


def colmap(task, _):
    import pycolmap as c

    def camera(k):
        return c.Camera(model="PINHOLE", width=1, height=1, params=list(k))

    def run(d, threshold, confidence):
        ransac = c.RANSACOptions()
        ransac.max_error, ransac.confidence, ransac.random_seed, ransac.min_num_trials = threshold, confidence, 0, 20
        if task == "absolute-pose":
            options = c.AbsolutePoseEstimationOptions()
            options.ransac.max_error, options.ransac.confidence = threshold, confidence
            options.ransac.random_seed = 0
            found = c.estimate_and_refine_absolute_pose(d["b"], d["a"], camera(d["k1"]), options)
            pose = found and found["cam_from_world"]
        elif task == "relative-pose":
            cameras = camera(d["k1"]), camera(d["k2"])
            found = c.estimate_essential_matrix(d["a"], d["b"], *cameras, ransac)
            pose = found and found["cam2_from_cam1"]
        else:
            name = "H" if task == "homography" else "F"
            estimate = c.estimate_homography_matrix if name == "H" else c.estimate_fundamental_matrix
            found = estimate(d["a"], d["b"], ransac)
            return found and found[name]
        return pose and (pose.rotation.matrix(), pose.translation)

    return {"COLMAP" if task == "absolute-pose" else "COLMAP min20": run}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("task", choices=["relative-pose", "fundamental", "homography", "absolute-pose"])
    parser.add_argument("paths", nargs="*", type=pathlib.Path, metavar="PATH", help="files; synthetic scenes without")
    parser.add_argument("--scene", choices=["general", "forward", "planar"], help="default: general, or planar for homographies")
    parser.add_argument("--disturbance", choices=DISTURBANCES, help="; ".join(f"{name}: {what}" for name, what in DISTURBANCES.items()).replace("%", "%%"))
    parser.add_argument("--points", type=int, nargs="+", default=[100, 200, 2000], help="of a synthetic scene")
    parser.add_argument("--outliers", type=float, nargs="+", default=[0.1, 0.3, 0.5], help="share, 0 to 1")
    parser.add_argument("--noise", type=float, default=1.0, help="of synthetic pixels, standard deviation (default 1)")
    parser.add_argument("--trials", type=int, default=50, help="problems of each number of points and share of outliers")
    parser.add_argument("--max-corr", type=int, help="use only the best N correspondences of a file")
    parser.add_argument("--threshold", type=float, help="largest error of an inlier, pixels (default 2; homography 4, absolute-pose 3)")
    parser.add_argument("--confidence", type=float, default=0.999)
    parser.add_argument("--max-iterations", type=int, default=10_000, help="of ours and of PoseLib (default 10000)")
    parser.add_argument("--seed", type=int, default=1)
    a = parser.parse_args()

    if a.disturbance and a.task == "absolute-pose":
        parser.error("--disturbance is for two views")
    scene = a.scene or ("planar" if a.task == "homography" else "general")
    threshold = a.threshold or MAX_ERROR_PX.get(a.task, 2.0)
    if a.paths:
        files = [f for path in a.paths for f in (sorted(path.rglob("*.txt")) if path.is_dir() else [path])]
        groups = {f"{len(files)} files": [read(f, a.task, a.max_corr, a.seed) for f in files]}
    else:
        groups = {
            f"{scene}{a.disturbance and ', ' + a.disturbance or ''}, {n} points, {100 * share:.0f} % outliers": [
                synthetic(a.task, scene, n, share, a.noise, [a.seed, n, round(1000 * share), k], a.disturbance)
                for k in range(a.trials)
            ]
            for n in a.points
            for share in a.outliers
        }

    peers = ours(a.task, a.max_iterations)
    for library, make in (("poselib", poselib), ("opencv-python-headless", opencv), ("pycolmap", colmap)):
        try:
            peers.update(make(a.task, a.max_iterations))
        except ImportError:
            print(f"{library} is not installed: left out", file=sys.stderr)

    limits = THRESHOLDS.get(a.task, (5, 10, 20))
    calls, total = 0, len(peers) * sum(map(len, groups.values()))
    for title, problems in groups.items():
        print(f"\n{a.task}, {title}: {len(problems)} problems, {threshold:g} px, confidence {a.confidence:g}\n")
        header = " | ".join(f"AUC@{limit:g}" for limit in limits)
        print(f"| library | {header} | above {limits[0]:g} (% of problems) | ms median | ms mean |")
        print("|---|" + "---|" * (len(limits) + 3))
        for name, call in peers.items():
            errors, times = [], []
            call(problems[0], threshold, a.confidence)  # what a first call loads is not the estimator's time
            for d in problems:
                start = time.process_time()
                try:
                    answer = call(d, threshold, a.confidence)
                except Exception as error:  # a peer's exception is its answer: none
                    answer = None
                    print(f"{name}: {error}", file=sys.stderr)
                times.append(1e3 * (time.process_time() - start))
                errors.append(judge(a.task, answer, d))
                calls += 1
                if sys.stderr.isatty():
                    print(f"\r{calls}/{total} calls", end="\r", file=sys.stderr)
            row = " | ".join(f"{auc(errors, limit):.1f}" for limit in limits)
            wrong = 100 * np.mean(np.array(errors) > limits[0])
            print(f"| {name} | {row} | {wrong:.1f} | {np.median(times):.3f} | {np.mean(times):.3f} |", flush=True)


if __name__ == "__main__":
    main()
