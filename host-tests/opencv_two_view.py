#!/usr/bin/env python3
"""The classic OpenCV program beside ours: ORB 5000, cross-check, findEssentialMat (RANSAC, 0.999, 1 px), recoverPose.

Needs opencv-python-headless and numpy. A comparison on a sequence, once with our matches and once with OpenCV's given
to both:

    cargo run --release --bin odometry -- SEQUENCE --matches out/ours
    python3 host-tests/opencv_two_view.py SEQUENCE --write-matches out/opencv
    python3 host-tests/opencv_two_view.py SEQUENCE --matches out/ours
    cargo run --release --bin evaluate -- relative-pose out/ours --threshold 1
    cargo run --release --bin evaluate -- relative-pose out/opencv --threshold 1

SEQUENCE holds calib.txt, poses.txt and the frames in image_l or image_0, as `odometry --help` says; the files of
matches have the format that `evaluate --help` describes.
"""

import argparse
import pathlib

import cv2
import numpy as np


def chord_deg(a, b):
    """The angle between two rotations, or two directions, by the chord."""
    if a.shape == (3, 3):
        return np.degrees(2 * np.arcsin(min(1.0, np.linalg.norm(a - b) / np.sqrt(8))))
    a, b = a / np.linalg.norm(a), b / np.linalg.norm(b)
    return np.degrees(2 * np.arcsin(min(1.0, np.linalg.norm(a - b) / 2)))


def read_sequence(folder):
    """Frames, K, and the true pose of every pair (X2 = R X1 + t)."""
    images = next(folder / name for name in ("image_l", "image_0") if (folder / name).is_dir())
    frames = sorted(p for p in images.iterdir() if p.suffix in (".png", ".jpg", ".jpeg"))
    K = np.array((folder / "calib.txt").read_text().splitlines()[0].split()[:12], float).reshape(3, 4)[:, :3]
    poses = np.loadtxt(folder / "poses.txt").reshape(-1, 3, 4)
    pairs = []
    for k in range(len(frames) - 1):
        (Ra, ca), (Rb, cb) = ((p[:, :3], p[:, 3]) for p in (poses[k], poses[k + 1]))
        pairs.append((frames[k], frames[k + 1], Rb.T @ Ra, Rb.T @ (ca - cb)))
    return K, pairs


def orb_matches(paths, features):
    """Cross-checked ORB correspondences, best first: x1 y1 x2 y2 distance."""
    orb = cv2.ORB_create(features)
    found = [orb.detectAndCompute(cv2.imread(str(p), cv2.IMREAD_GRAYSCALE), None) for p in paths]
    (k1, d1), (k2, d2) = found
    matches = sorted(cv2.BFMatcher(cv2.NORM_HAMMING, crossCheck=True).match(d1, d2), key=lambda m: m.distance)
    return np.array([[*k1[m.queryIdx].pt, *k2[m.trainIdx].pt, m.distance] for m in matches])


def read_matches(path):
    with open(path) as f:
        for line in f:
            if line.startswith("n "):
                return np.loadtxt(f, ndmin=2)
    raise SystemExit(f"{path}: no line `n N`")


def write_matches(path, size, K, R, t, rows):
    camera = " ".join(f"{v:.17g}" for v in (K[0, 0], K[1, 1], K[0, 2], K[1, 2]))
    with open(path, "w") as f:
        f.write(f"# size {size[0]} {size[1]}\nK1 {camera}\nK2 {camera}\n")
        f.write("R_gt " + " ".join(f"{v:.17g}" for v in R.ravel()) + "\n")
        f.write("t_gt " + " ".join(f"{v:.17g}" for v in t) + f"\nn {len(rows)}\n")
        np.savetxt(f, rows, fmt="%.4f")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sequence", type=pathlib.Path)
    parser.add_argument("--matches", type=pathlib.Path, help="use these correspondences instead of ORB's")
    parser.add_argument("--write-matches", type=pathlib.Path, help="write the correspondences used")
    parser.add_argument("--features", type=int, default=5000)
    parser.add_argument("--threshold", type=float, default=1.0)
    args = parser.parse_args()

    K, pairs = read_sequence(args.sequence)
    if args.write_matches:
        args.write_matches.mkdir(parents=True, exist_ok=True)
    errors = []
    for first, second, R_gt, t_gt in pairs:
        name = f"{first.stem}-{second.stem}_orb.txt"
        rows = read_matches(args.matches / name) if args.matches else orb_matches((first, second), args.features)
        if args.write_matches:
            height, width = cv2.imread(str(first), cv2.IMREAD_GRAYSCALE).shape
            write_matches(args.write_matches / name, (width, height), K, R_gt, t_gt, rows)
        # Files are sorted best first; the order must not help anyone.
        rows = rows[np.random.default_rng(1).permutation(len(rows))]
        x1, x2 = np.ascontiguousarray(rows[:, :2]), np.ascontiguousarray(rows[:, 2:4])
        cv2.setRNGSeed(1)
        E, mask = cv2.findEssentialMat(x1, x2, K, method=cv2.RANSAC, prob=0.999, threshold=args.threshold)
        if E is None or E.shape != (3, 3):
            errors.append((180.0, 180.0))
            continue
        _, R, t, _ = cv2.recoverPose(E, x1, x2, K, mask=mask)
        errors.append((chord_deg(R, R_gt), chord_deg(t.ravel(), t_gt)))
        print(f"{name:32} {len(rows):6} matches   rotation {errors[-1][0]:8.4f}   direction of t {errors[-1][1]:8.3f}")
    r, t = np.array(errors).T
    fail = np.mean(np.maximum(r, t) > 5)
    print(
        f"opencv {cv2.__version__} pairs={len(r)} median_r_deg={np.median(r):.4f} median_t_deg={np.median(t):.3f} "
        f"max_r_deg={r.max():.4f} max_t_deg={t.max():.3f} fail={fail:.4f}"
    )


if __name__ == "__main__":
    main()
