/* The C interface under the address and undefined-behaviour sanitizers: every buffer is as long as it is said to be, on the
 * heap, with canaries behind what the library writes. Also: workspace macros say what the functions say. */
#include <epipole.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { COUNT = 40, GUARD = 64 };

#define CHECK(condition)                                                                                               \
    do {                                                                                                               \
        if (!(condition)) {                                                                                            \
            fprintf(stderr, "%s:%d: %s\n", __FILE__, __LINE__, #condition);                                            \
            exit(1);                                                                                                   \
        }                                                                                                              \
    } while (0)

/* Memory with a canary behind it. The library is not instrumented itself, so what it writes too far shows here. */
static void *lend(size_t size) {
    unsigned char *memory = malloc(size + GUARD);
    CHECK(memory);
    memset(memory, 0xA5, size + GUARD);
    return memory;
}

static void take_back(void *memory, size_t size) {
    for (size_t k = 0; k < GUARD; ++k)
        CHECK(((unsigned char *)memory)[size + k] == 0xA5);
    free(memory);
}

static int32_t twice(void *context, uint32_t iterations) {
    (void)iterations;
    return ++*(int *)context < 3;
}

int main(void) {
    for (size_t n = 0; n < 70; ++n) {
        CHECK(EPI_RELATIVE_POSE_WORKSPACE_SIZE_F32(n, 0) == epi_relative_pose_workspace_size_f32(n, 0));
        CHECK(EPI_RELATIVE_POSE_WORKSPACE_SIZE_F64(n, 1) == epi_relative_pose_workspace_size_f64(n, 1));
        CHECK(EPI_ABSOLUTE_POSE_WORKSPACE_SIZE_F32(n, 1) == epi_absolute_pose_workspace_size_f32(n, 1));
        CHECK(EPI_ABSOLUTE_POSE_WORKSPACE_SIZE_F64(n, 0) == epi_absolute_pose_workspace_size_f64(n, 0));
        CHECK(EPI_HOMOGRAPHY_WORKSPACE_SIZE_F32(n) == epi_homography_workspace_size_f32(n));
        CHECK(EPI_FUNDAMENTAL_WORKSPACE_SIZE_F64(n) == epi_fundamental_workspace_size_f64(n));
        CHECK(EPI_WINDOW_SIZE_F32(n, 3 * n, 7 * n, 1) == epi_window_size_f32(n, 3 * n, 7 * n, 1));
        CHECK(EPI_WINDOW_SIZE_F64(n, 3 * n, 7 * n, 0) == epi_window_size_f64(n, 3 * n, 7 * n, 0));
    }
    CHECK(epi_workspace_align() == EPI_WORKSPACE_ALIGN && epi_abi_version() == EPI_ABI_VERSION);

    /* Two views, a fisheye and a pinhole, every fourth match wrong. */
    epi_camera_f32 cameras[2] = {{0}, {0}};
    for (int k = 0; k < 2; ++k)
        cameras[k].fx = cameras[k].fy = 500, cameras[k].cx = 320, cameras[k].cy = 240;
    cameras[0].model = EPI_CAMERA_MODEL_KANNALA_BRANDT;
    const size_t pixels = 2 * COUNT * sizeof(float), vectors = 3 * COUNT * sizeof(float);
    float *x1 = lend(pixels), *x2 = lend(pixels), *points = lend(vectors), *moved = lend(vectors);
    uint8_t *mask = lend(COUNT);
    for (int k = 0; k < COUNT; ++k) {
        points[3 * k] = (float)(k * 37 % 41) / 10 - 2, points[3 * k + 1] = (float)(k * 17 % 31) / 10 - 1.5f;
        points[3 * k + 2] = 4 + (float)(k * 29 % 23) / 6;
        memcpy(moved + 3 * k, points + 3 * k, 3 * sizeof(float));
        moved[3 * k] -= 1;
    }
    CHECK(epi_camera_project_f32(&cameras[0], points, COUNT, x1, mask) == COUNT);
    CHECK(epi_camera_project_f32(&cameras[1], moved, COUNT, x2, mask) == COUNT);
    for (int k = 3; k < COUNT; k += 4)
        x2[2 * k] = (float)(k * 91 % 640), x2[2 * k + 1] = (float)(k * 57 % 480);

    const size_t size = epi_relative_pose_workspace_size_f32(COUNT, 1);
    void *workspace = lend(size);
    epi_relative_pose_options_f32 *options = lend(sizeof *options);
    epi_relative_pose_estimate_f32 *estimate = lend(sizeof *estimate);
    CHECK(epi_relative_pose_options_default_f32(options, sizeof *options) == 0);
    CHECK(epi_relative_pose_f32(&cameras[0], &cameras[1], x1, x2, COUNT, options, workspace, size, estimate,
                                sizeof *estimate, mask) == 1);
    CHECK(estimate->verdict == EPI_RELATIVE_POSE_VERDICT_GENERAL && estimate->poses[0].translation[0] < -0.99f);
    int asked = 0;
    options->confidence = 0.9999999f;
    options->min_iterations = 1000;
    CHECK(epi_relative_pose_guided_f32(&cameras[0], &cameras[1], x1, x2, NULL, COUNT, options, twice, &asked, workspace,
                                       size, estimate, sizeof *estimate, mask) >= 0);
    CHECK(asked == 3 && estimate->report.stop == EPI_STOP_REASON_INTERRUPTED);

    /* A window over exactly the memory that it needs. */
    const size_t bytes = epi_window_size_f32(3, COUNT, 3 * COUNT, 1);
    void *memory = lend(bytes);
    epi_window_f32 *window;
    CHECK(epi_window_create_f32(memory, bytes, 3, COUNT, 3 * COUNT, 1, &window) == 0);
    uint32_t frames[3], point;
    for (int f = 0; f < 3; ++f) {
        const epi_pose_f32 pose = {{0, 0, 0, 1}, {-(float)(f > 0), f == 2 ? 0.05f : 0, 0}};
        CHECK(epi_window_add_frame_f32(window, &cameras[f > 0], &pose, &frames[f]) == 0);
        CHECK(epi_window_fix_frame_f32(window, frames[f], f < 2) == 0);
    }
    for (int k = 0; k < COUNT; ++k) {
        CHECK(epi_window_add_point_f32(window, points + 3 * k, &point) == 0);
        for (int f = 0; f < 3; ++f)
            CHECK(epi_window_add_observation_f32(window, frames[f], point, (f ? x2 : x1) + 2 * k, 1) == 0);
    }
    CHECK(epi_window_add_point_f32(window, points, &point) == EPI_STATUS_POINTS_FULL);
    epi_bundle_options_f32 bundle;
    epi_bundle_report_f32 report;
    CHECK(epi_bundle_options_default_f32(&bundle, sizeof bundle) == 0);
    CHECK(epi_window_optimise_f32(window, &bundle, NULL, NULL, &report, sizeof report) == 0 && report.changed == 1);
    CHECK(epi_window_marginalise_frame_f32(window, frames[2], EPI_LOSS_HUBER, 1.5f) >= 0);
    CHECK(epi_window_prior_frame_count_f32(window) >= 0 && epi_window_clear_f32(window) == 0);

    take_back(memory, bytes);
    take_back(workspace, size);
    take_back(options, sizeof *options);
    take_back(estimate, sizeof *estimate);
    take_back(x1, pixels), take_back(x2, pixels), take_back(points, vectors), take_back(moved, vectors);
    take_back(mask, COUNT);
    puts("clean");
    return 0;
}
