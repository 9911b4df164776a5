/* Four problems in single precision, the bits of their answers: the same on a desktop, on a Cortex-M4F, from Rust and from C.
 * The numbers are made by operations that no compiler fuses or reorders. */
#include "bits.h"

#include <epipole.h>

enum { COUNT = 64 };

static _Alignas(EPI_WORKSPACE_ALIGN) unsigned char workspace[EPI_ABSOLUTE_POSE_WORKSPACE_SIZE_F32(COUNT, 0)];
static float x1[COUNT][2], x2[COUNT][2], y2[COUNT][2], points[COUNT][3];
static uint8_t inliers[COUNT], verdicts[COUNT];
static epi_relative_pose_estimate_f32 relative;
static epi_homography_estimate_f32 homography;
static epi_absolute_pose_estimate_f32 absolute;

static uint32_t state;

static float next(uint32_t below) {
    state = state * 1664525u + 1013904223u;
    return (float)((state >> 8) % below);
}

static uint32_t bits_of(float x) {
    union {
        float number;
        uint32_t bits;
    } u;
    u.number = x;
    return u.bits;
}

static void print_all(print_bits print, const char *name, const float *numbers, int count) {
    for (int k = 0; k < count; ++k)
        print(name, bits_of(numbers[k]));
}

int32_t run_bits(print_bits print) {
    epi_camera_f32 camera = {0};
    state = 1;
    camera.fx = camera.fy = 500;
    camera.cx = 320, camera.cy = 240;
    for (int k = 0; k < COUNT; ++k) {
        const float depth = 4 + next(64) / 8;
        x1[k][0] = next(640), x1[k][1] = next(480);
        /* A camera that moved by one to the right; an image that moved by (5, 3). */
        x2[k][0] = x1[k][0] - 500 / depth, x2[k][1] = x1[k][1];
        y2[k][0] = x1[k][0] + 5, y2[k][1] = x1[k][1] + 3;
        points[k][0] = (x1[k][0] - 320) * depth / 500;
        points[k][1] = (x1[k][1] - 240) * depth / 500;
        points[k][2] = depth;
        if (k % 4 == 3)
            x2[k][0] = y2[k][0] = next(640), x2[k][1] = y2[k][1] = next(480);
    }

    epi_relative_pose_options_f32 relative_options;
    epi_homography_options_f32 homography_options;
    epi_absolute_pose_options_f32 absolute_options;
    int32_t status = epi_relative_pose_options_default_f32(&relative_options, sizeof relative_options);
    if (status >= 0)
        status = epi_homography_options_default_f32(&homography_options, sizeof homography_options);
    if (status >= 0)
        status = epi_absolute_pose_options_default_f32(&absolute_options, sizeof absolute_options);
    if (status >= 0)
        status = epi_relative_pose_f32(&camera, &camera, x1[0], x2[0], COUNT, &relative_options, workspace,
                                       sizeof workspace, &relative, sizeof relative, inliers);
    if (status < 0)
        return status;
    print("relative verdict", relative.verdict);
    print("relative inliers", relative.report.inliers);
    print_all(print, "relative rotation", relative.poses[0].rotation, 4);
    print_all(print, "relative translation", relative.poses[0].translation, 3);

    status = epi_homography_f32(x1[0], y2[0], COUNT, &homography_options, workspace, sizeof workspace, &homography,
                                sizeof homography, inliers);
    if (status < 0)
        return status;
    print_all(print, "homography", homography.homography[0], 9);

    status = epi_absolute_pose_f32(&camera, x2[0], points[0], COUNT, &absolute_options, workspace, sizeof workspace,
                                   &absolute, sizeof absolute, inliers);
    if (status < 0)
        return status;
    print("absolute verdict", absolute.verdict);
    print_all(print, "absolute rotation", absolute.poses[0].rotation, 4);
    print_all(print, "absolute translation", absolute.poses[0].translation, 3);

    /* The first points of two views, from bearings on z = 1. */
    float b1[4][3], b2[4][3], found[4][3];
    for (int k = 0; k < 4; ++k) {
        b1[k][0] = (x1[k][0] - 320) / 500, b1[k][1] = (x1[k][1] - 240) / 500, b1[k][2] = 1;
        b2[k][0] = (x2[k][0] - 320) / 500, b2[k][1] = (x2[k][1] - 240) / 500, b2[k][2] = 1;
    }
    status = epi_triangulate_f32(&relative.poses[0], EPI_TRIANGULATION_METHOD_OPTIMAL, b1[0], b2[0], 4, found[0], verdicts);
    if (status < 0)
        return status;
    print_all(print, "point", found[0], 12);
    return 0;
}
