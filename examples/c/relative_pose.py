#!/usr/bin/env python3
"""A relative pose through the shared library, with ctypes and nothing else.

    relative_pose.py LIBRARY
"""

import ctypes
import math
import sys


class Camera(ctypes.Structure):
    _fields_ = [("model", ctypes.c_uint32)] + [(name, ctypes.c_double) for name in ("fx", "fy", "cx", "cy")] + [
        ("distortion", ctypes.c_double * 8)
    ]


class Pose(ctypes.Structure):
    _fields_ = [("rotation", ctypes.c_double * 4), ("translation", ctypes.c_double * 3)]


class Options(ctypes.Structure):
    _fields_ = [(name, ctypes.c_uint32) for name in ("size", "min_iterations", "max_iterations", "max_solver_calls")] + [
        ("max_residuals", ctypes.c_uint64), ("seed", ctypes.c_uint64),
        ("confidence", ctypes.c_double), ("max_error_px", ctypes.c_double), ("sigma_px", ctypes.c_double),
        ("least_motion_px", ctypes.c_double),
        ("prior_view1", ctypes.c_double * 3), ("prior_view2", ctypes.c_double * 3), ("prior_sigma_rad", ctypes.c_double),
        ("prior_rotation", ctypes.c_double * 4), ("prior_covariance", ctypes.c_double * 9), ("prior", ctypes.c_uint32),
        ("no_planes", ctypes.c_uint32),
    ]


class Report(ctypes.Structure):
    _fields_ = [("residuals", ctypes.c_uint64)] + [
        (name, ctypes.c_uint32)
        for name in ("iterations", "solver_calls", "hypotheses", "refinements", "stop", "inliers")
    ] + [(name, ctypes.c_double) for name in ("cost", "miss_probability", "excluded_inlier_ratio", "rival_share")]


class Estimate(ctypes.Structure):
    _fields_ = [
        ("report", Report), ("verdict", ctypes.c_uint32), ("unobservable", ctypes.c_uint32),
        ("pose_count", ctypes.c_uint32), ("prior", ctypes.c_uint32), ("has_general", ctypes.c_uint32),
        ("covariance_size", ctypes.c_uint32 * 2), ("noise_px", ctypes.c_double), ("prior_deviations", ctypes.c_double),
        ("poses", Pose * 2), ("normals", ctypes.c_double * 6), ("baseline_over_distance", ctypes.c_double * 2),
        ("covariance", ctypes.c_double * 64 * 2),
        ("general", Pose), ("general_covariance", ctypes.c_double * 25), ("general_has_covariance", ctypes.c_uint32),
    ]


def main():
    library = ctypes.CDLL(sys.argv[1])
    library.epi_relative_pose_workspace_size_f64.restype = ctypes.c_size_t
    library.epi_status_string.restype = ctypes.c_char_p

    # A camera that turns by 0.1 rad and moves by (-0.8, 0, 0.6); every third match wrong.
    count, f, centre = 60, 718.0, (620.5, 188.0)
    c, s = math.cos(0.1), math.sin(0.1)
    x1, x2 = (ctypes.c_double * (2 * count))(), (ctypes.c_double * (2 * count))()
    for k in range(count):
        x, y, z = 4 * math.sin(1.7 * k), math.cos(2.3 * k), 8 + 3 * math.sin(0.9 * k)
        u, v, w = c * x + s * z - 0.8, y, -s * x + c * z + 0.6
        x1[2 * k : 2 * k + 2] = [f * x / z + centre[0], f * y / z + centre[1]]
        x2[2 * k : 2 * k + 2] = [f * u / w + centre[0], f * v / w + centre[1]]
        if k % 3 == 0:
            x2[2 * k : 2 * k + 2] = [k * 77.0 % 1241, k * 31.0 % 376]

    camera = Camera(0, f, f, *centre)
    options, estimate, inliers = Options(), Estimate(), (ctypes.c_uint8 * count)()
    size = ctypes.sizeof
    status = library.epi_relative_pose_options_default_f64(ctypes.byref(options), ctypes.c_size_t(size(options)))
    assert status == 0, library.epi_status_string(status)
    needed = library.epi_relative_pose_workspace_size_f64(ctypes.c_size_t(count), 0)
    workspace = (ctypes.c_uint64 * ((needed + 7) // 8))()
    status = library.epi_relative_pose_f64(
        ctypes.byref(camera), ctypes.byref(camera), x1, x2, ctypes.c_size_t(count), ctypes.byref(options), workspace,
        ctypes.c_size_t(size(workspace)), ctypes.byref(estimate), ctypes.c_size_t(size(estimate)), inliers,
    )
    assert status == 1, library.epi_status_string(status)
    pose = estimate.poses[0]
    print("verdict", estimate.verdict, "inliers", sum(inliers), "rotation", *pose.rotation, "translation", *pose.translation)
    assert estimate.verdict == 0 and sum(inliers) == 40
    assert abs(pose.rotation[1] - math.sin(0.05)) < 1e-6 and abs(pose.translation[0] + 0.8) < 1e-6


if __name__ == "__main__":
    main()
