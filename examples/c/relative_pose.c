/* The relative pose of two images from a file of correspondences, the text format of `evaluate relative-pose`: lines
 * `K1 fx fy cx cy`, `K2 fx fy cx cy`, `n N`, then N times `x1 y1 x2 y2` with a score or without. Other header lines
 * (the true pose) are passed over.
 *
 *     relative_pose FILE
 *
 * All memory that the library needs is static here. */
#include <epipole.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { CAPACITY = 4096 };

static _Alignas(EPI_WORKSPACE_ALIGN) unsigned char workspace[EPI_RELATIVE_POSE_WORKSPACE_SIZE_F64(CAPACITY, 0)];
static double x1[2 * CAPACITY], x2[2 * CAPACITY];
static uint8_t inliers[CAPACITY];
static epi_relative_pose_estimate_f64 estimate;

static const char *verdict_name(uint32_t verdict) {
    switch (verdict) {
    case EPI_RELATIVE_POSE_VERDICT_GENERAL: return "general";
    case EPI_RELATIVE_POSE_VERDICT_PLANAR: return "planar";
    case EPI_RELATIVE_POSE_VERDICT_PURE_ROTATION: return "pure rotation";
    case EPI_RELATIVE_POSE_VERDICT_NO_MOTION: return "no motion";
    case EPI_RELATIVE_POSE_VERDICT_UNOBSERVABLE: return "unobservable";
    case EPI_RELATIVE_POSE_VERDICT_TOO_FEW_INLIERS: return "too few inliers";
    case EPI_RELATIVE_POSE_VERDICT_NO_CONSENSUS: return "no consensus";
    case EPI_RELATIVE_POSE_VERDICT_GENERAL_OR_PLANAR: return "general or planar";
    default: return "unknown to this program";
    }
}

/* Reads a file; the number of its correspondences, or -1. */
static long read_file(const char *path, epi_camera_f64 cameras[2]) {
    FILE *file = fopen(path, "r");
    if (!file) {
        perror(path);
        return -1;
    }
    char line[512];
    long announced = -1, count = 0, number = 0, result = -1;
    int seen = 0;
    while (fgets(line, sizeof line, file)) {
        ++number;
        double v[5];
        const char *start = line + strspn(line, " \t\r\n");
        if (*start == '\0' || *start == '#')
            continue;
        if (announced < 0) {
            const int camera = strncmp(start, "K1 ", 3) == 0 ? 0 : strncmp(start, "K2 ", 3) == 0 ? 1 : -1;
            if (camera >= 0 && sscanf(start + 3, "%lf %lf %lf %lf", &v[0], &v[1], &v[2], &v[3]) == 4) {
                epi_camera_f64 *k = &cameras[camera];
                memset(k, 0, sizeof *k);
                k->model = EPI_CAMERA_MODEL_PINHOLE;
                k->fx = v[0], k->fy = v[1], k->cx = v[2], k->cy = v[3];
                seen |= 1 << camera;
                continue;
            }
            if (sscanf(start, "n %ld", &announced) == 1 && announced >= 0 && announced <= CAPACITY)
                continue;
            if (strncmp(start, "R_gt ", 5) == 0 || strncmp(start, "t_gt ", 5) == 0)
                continue;
        } else if (count < announced && sscanf(start, "%lf %lf %lf %lf", &v[0], &v[1], &v[2], &v[3]) == 4) {
            x1[2 * count] = v[0], x1[2 * count + 1] = v[1];
            x2[2 * count] = v[2], x2[2 * count + 1] = v[3];
            ++count;
            continue;
        }
        fprintf(stderr, "%s:%ld: not understood: %s", path, number, line);
        goto done;
    }
    if (seen != 3 || announced < 0 || count != announced)
        fprintf(stderr, "%s: K1, K2, or some of the correspondences are missing\n", path);
    else
        result = count;
done:
    fclose(file);
    return result;
}

int main(int argc, char **argv) {
    if (argc != 2) {
        fprintf(stderr, "usage: %s FILE\n", argv[0]);
        return 2;
    }
    if (epi_abi_version() != EPI_ABI_VERSION) {
        fprintf(stderr, "this program was compiled for another version of the library\n");
        return 2;
    }
    epi_camera_f64 cameras[2];
    const long count = read_file(argv[1], cameras);
    if (count < 0)
        return 2;

    epi_relative_pose_options_f64 options;
    int32_t status = epi_relative_pose_options_default_f64(&options, sizeof options);
    if (status >= 0)
        status = epi_relative_pose_f64(&cameras[0], &cameras[1], x1, x2, (size_t)count, &options, workspace,
                                       sizeof workspace, &estimate, sizeof estimate, inliers);
    if (status < 0) {
        fprintf(stderr, "%s\n", epi_status_string(status));
        return 1;
    }

    printf("verdict %s\n", verdict_name(estimate.verdict));
    printf("inliers %u of %ld, noise %.3f px\n", (unsigned)estimate.report.inliers, count, estimate.noise_px);
    for (uint32_t k = 0; k < estimate.pose_count; ++k) {
        const epi_pose_f64 *pose = &estimate.poses[k];
        printf("quaternion (i j k w) %.9f %.9f %.9f %.9f\n", pose->rotation[0], pose->rotation[1], pose->rotation[2],
               pose->rotation[3]);
        printf("translation %.9f %.9f %.9f\n", pose->translation[0], pose->translation[1], pose->translation[2]);
    }

    /* The first inlier as a point in space, in units of the baseline. */
    for (long i = 0; i < count && estimate.pose_count > 0; ++i) {
        double b1[3], b2[3], point[3];
        uint8_t seen[2], verdict;
        if (!inliers[i] || epi_camera_unproject_f64(&cameras[0], &x1[2 * i], 1, b1, &seen[0]) != 1 ||
            epi_camera_unproject_f64(&cameras[1], &x2[2 * i], 1, b2, &seen[1]) != 1)
            continue;
        if (epi_triangulate_f64(&estimate.poses[0], EPI_TRIANGULATION_METHOD_OPTIMAL, b1, b2, 1, point, &verdict) == 1) {
            printf("point of correspondence %ld: %.4f %.4f %.4f\n", i, point[0], point[1], point[2]);
            break;
        }
    }
    return 0;
}
