#ifndef EPIPOLE_H
#define EPIPOLE_H

/* Made by cbindgen from kernel/capi/src: see kernel/capi/tests/header.rs. The rules of this interface, frames, units and
   the order of covariances: kernel/CONVENTIONS.md. */

#include <stddef.h>
#include <stdint.h>
/* Bytes of workspaces and windows, for static allocation: what the functions `.._size` answer, as constants. Align the
   memory to EPI_WORKSPACE_ALIGN. `wide` is not 0 if a camera is a fisheye. */
#define EPI_WORKSPACE_SIZE_(bytes_a_number, numbers, count)                                                            \
    ((((size_t)(count) + 3) / 4 * 4) * ((size_t)(bytes_a_number) * (numbers) + 5))
#define EPI_RELATIVE_POSE_WORKSPACE_SIZE_F32(count, wide)                                                              \
    EPI_WORKSPACE_SIZE_(4, (wide) ? EPI_TWO_VIEW_WIDE_NUMBERS : EPI_TWO_VIEW_NUMBERS, count)
#define EPI_RELATIVE_POSE_WORKSPACE_SIZE_F64(count, wide)                                                              \
    EPI_WORKSPACE_SIZE_(8, (wide) ? EPI_TWO_VIEW_WIDE_NUMBERS : EPI_TWO_VIEW_NUMBERS, count)


// Grows with every change of the ABI that an older program would notice.
#define EPI_ABI_VERSION 1

// What every workspace and window is aligned to, bytes.
#define EPI_WORKSPACE_ALIGN 8

// Numbers a correspondence in a two-view workspace of pinhole and Brown-Conrady cameras, and of pixels.
#define EPI_TWO_VIEW_NUMBERS 4

// Numbers a correspondence in a two-view workspace where a camera is a fisheye.
#define EPI_TWO_VIEW_WIDE_NUMBERS 18

// Numbers a correspondence in an absolute-pose workspace of a pinhole or Brown-Conrady camera.
#define EPI_ABSOLUTE_POSE_NUMBERS 5

// Numbers a correspondence in an absolute-pose workspace of a fisheye.
#define EPI_ABSOLUTE_POSE_WIDE_NUMBERS 12

// Why a function did nothing: negative codes, after which nothing that the caller owns has changed, but for the content
// of a workspace. Functions answer `int32_t`: one of these, or a count from 0.
enum epi_status
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    // Done.
    EPI_STATUS_OK = 0,
    // A pointer is null that must not be.
    EPI_STATUS_NULL_POINTER = -1,
    // A pointer is not aligned for its type, or a workspace not to `EPI_WORKSPACE_ALIGN`.
    EPI_STATUS_MISALIGNED = -2,
    // An output overlaps another argument.
    EPI_STATUS_OVERLAP = -3,
    // A count of elements whose bytes no memory holds.
    EPI_STATUS_TOO_LARGE = -4,
    // An output holds fewer elements than the function may write.
    EPI_STATUS_CAPACITY = -5,
    // A workspace is smaller than its size query says.
    EPI_STATUS_WORKSPACE = -6,
    // The size of a struct is none that this version knows.
    EPI_STATUS_STRUCT_SIZE = -7,
    // An integer is no value of its enumeration.
    EPI_STATUS_UNKNOWN_ENUM = -8,
    // Fewer points than the problem needs.
    EPI_STATUS_TOO_FEW = -9,
    // A number is NaN or infinite.
    EPI_STATUS_NOT_FINITE = -10,
    // A focal length is not positive, or a camera's parameter not finite.
    EPI_STATUS_CAMERA = -11,
    // The four numbers of a rotation are no unit quaternion.
    EPI_STATUS_ROTATION = -12,
    // `max_error_px` is not positive and finite.
    EPI_STATUS_MAX_ERROR = -13,
    // `sigma_px` is neither 0 nor positive and finite.
    EPI_STATUS_SIGMA = -14,
    // `confidence` is not between 0 and 1.
    EPI_STATUS_CONFIDENCE = -15,
    // `max_iterations` is 0.
    EPI_STATUS_NO_ITERATIONS = -16,
    // A gravity prior needs two directions and a positive uncertainty.
    EPI_STATUS_GRAVITY = -17,
    // A view does not see the point.
    EPI_STATUS_NOT_VISIBLE = -18,
    // What was asked for is not determined.
    EPI_STATUS_UNOBSERVABLE = -19,
    // The memory holds no window of this scalar.
    EPI_STATUS_NOT_A_WINDOW = -20,
    // All frames are taken.
    EPI_STATUS_FRAMES_FULL = -21,
    // All points are taken.
    EPI_STATUS_POINTS_FULL = -22,
    // All observations are taken.
    EPI_STATUS_OBSERVATIONS_FULL = -23,
    // The frame is no longer in the window.
    EPI_STATUS_STALE_FRAME = -24,
    // The point is no longer in the window.
    EPI_STATUS_STALE_POINT = -25,
    // The frame already observes the point.
    EPI_STATUS_DUPLICATE_OBSERVATION = -26,
    // The frame does not observe the point.
    EPI_STATUS_NO_SUCH_OBSERVATION = -27,
    // A standard deviation or a distance is zero or less.
    EPI_STATUS_NOT_POSITIVE = -28,
    // An information matrix is not positive semi-definite.
    EPI_STATUS_NOT_POSITIVE_SEMIDEFINITE = -29,
    // A distance between a frame and itself.
    EPI_STATUS_SAME_FRAME = -30,
    // Fixed frames contradict a distance between them.
    EPI_STATUS_CONTRADICTORY_FIXED_FRAMES = -31,
    // The window was created without memory for a prior.
    EPI_STATUS_NO_PRIOR_MEMORY = -32,
    // An option is NaN, or zero or less where it must be positive.
    EPI_STATUS_BAD_OPTION = -33,
    // Every frame and every point is fixed, or there is none.
    EPI_STATUS_NOTHING_FREE = -34,
    // No observation of a live frame and point.
    EPI_STATUS_NO_OBSERVATIONS = -35,
    // Each point is seen fewer than twice, or lies behind its cameras.
    EPI_STATUS_NO_USABLE_POINT = -36,
    // A free frame has no observation of a usable point, no prior and no distance.
    EPI_STATUS_UNCONSTRAINED_FRAME = -37,
    // An error that this version of the header does not name.
    EPI_STATUS_OTHER = -38,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum epi_status epi_status;
#else
typedef int32_t epi_status;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// The lens of a camera, and what `distortion` holds.
enum epi_camera_model
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    // No distortion.
    EPI_CAMERA_MODEL_PINHOLE = 0,
    // Radial and tangential distortion: `k1 k2 p1 p2 k3`, OpenCV's order.
    EPI_CAMERA_MODEL_BROWN_CONRADY = 1,
    // Fisheye: `k1 k2 k3 k4`, OpenCV's `fisheye`.
    EPI_CAMERA_MODEL_KANNALA_BRANDT = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum epi_camera_model epi_camera_model;
#else
typedef uint32_t epi_camera_model;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// How a point of two views is found.
enum epi_triangulation_method
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    // The middle of the shortest line between the rays: fastest.
    EPI_TRIANGULATION_METHOD_MIDPOINT = 0,
    // The null vector of the homogeneous system.
    EPI_TRIANGULATION_METHOD_DLT = 1,
    // Least reprojection error on the planes z = 1; bearings with `z <= 0` have none.
    EPI_TRIANGULATION_METHOD_OPTIMAL = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum epi_triangulation_method epi_triangulation_method;
#else
typedef uint32_t epi_triangulation_method;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// What rays determine.
enum epi_triangulation_verdict
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    // A point in front of every view.
    EPI_TRIANGULATION_VERDICT_POINT = 0,
    // The best fit lies behind a view.
    EPI_TRIANGULATION_VERDICT_BEHIND = 1,
    // Parallel rays: the unit direction in place of a point.
    EPI_TRIANGULATION_VERDICT_AT_INFINITY = 2,
    // Nothing: no baseline, rays along it, or numbers out of range. Zeros in place of a point.
    EPI_TRIANGULATION_VERDICT_UNDETERMINED = 3,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum epi_triangulation_verdict epi_triangulation_verdict;
#else
typedef uint32_t epi_triangulation_verdict;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// What two views say about the motion between them.
enum epi_relative_pose_verdict
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    // A general motion: `poses[0]`, covariance 5x5.
    EPI_RELATIVE_POSE_VERDICT_GENERAL = 0,
    // All inliers on one plane: one or two poses, the more likely first, each with its plane and an 8x8 covariance.
    EPI_RELATIVE_POSE_VERDICT_PLANAR = 1,
    // The camera turned in place: the rotation of `poses[0]`, its translation zero; covariance 3x3.
    EPI_RELATIVE_POSE_VERDICT_PURE_ROTATION = 2,
    // Every inlier stayed where it was.
    EPI_RELATIVE_POSE_VERDICT_NO_MOTION = 3,
    // The inliers agree, and no pose follows: see `unobservable`.
    EPI_RELATIVE_POSE_VERDICT_UNOBSERVABLE = 4,
    // Something agrees, on no more correspondences than chance explains.
    EPI_RELATIVE_POSE_VERDICT_TOO_FEW_INLIERS = 5,
    // No model explains more correspondences than chance.
    EPI_RELATIVE_POSE_VERDICT_NO_CONSENSUS = 6,
    // A verdict that this version of the header does not name.
    EPI_RELATIVE_POSE_VERDICT_OTHER = 7,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum epi_relative_pose_verdict epi_relative_pose_verdict;
#else
typedef uint32_t epi_relative_pose_verdict;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Why inliers that agree fix no model.
enum epi_unobservable
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    // The verdict is another.
    EPI_UNOBSERVABLE_NO = 0,
    // They lie on one line in an image.
    EPI_UNOBSERVABLE_COLLINEAR = 1,
    // They are repetitions of too few distinct points.
    EPI_UNOBSERVABLE_TOO_FEW_DISTINCT = 2,
    // A reason that this version of the header does not name.
    EPI_UNOBSERVABLE_OTHER = 3,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum epi_unobservable epi_unobservable;
#else
typedef uint32_t epi_unobservable;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Why a search ended.
enum epi_stop_reason
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    // The confidence was reached.
    EPI_STOP_REASON_CONFIDENT = 0,
    // `max_iterations` was reached.
    EPI_STOP_REASON_MAX_ITERATIONS = 1,
    // `max_solver_calls` was reached.
    EPI_STOP_REASON_MAX_SOLVER_CALLS = 2,
    // `max_residuals` was reached.
    EPI_STOP_REASON_MAX_RESIDUALS = 3,
    // The caller answered no. The same input with `max_iterations` set to the reported iterations gives the same bits.
    EPI_STOP_REASON_INTERRUPTED = 4,
    // A reason that this version of the header does not name.
    EPI_STOP_REASON_OTHER = 5,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum epi_stop_reason epi_stop_reason;
#else
typedef uint32_t epi_stop_reason;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// A camera. Pixels: the centre of the top-left pixel is (0, 0).
typedef struct epi_camera_f32 {
    // One of `epi_camera_model`.
    uint32_t model;
    // Horizontal focal length, px.
    float fx;
    // Vertical focal length, px.
    float fy;
    // Principal point, px from the left.
    float cx;
    // Principal point, px from the top.
    float cy;
    // Coefficients of the model; those that it does not have are ignored.
    float distortion[8];
} epi_camera_f32;

// Options of `epi_relative_pose`.
typedef struct epi_relative_pose_options_f32 {
    // Of this struct, in bytes.
    uint32_t size;
    // Samples drawn at the least.
    uint32_t min_iterations;
    // Samples drawn at the most.
    uint32_t max_iterations;
    // Minimal problems solved at the most.
    uint32_t max_solver_calls;
    // Residuals evaluated at the most.
    uint64_t max_residuals;
    // The same seed and input give the same bits.
    uint64_t seed;
    // Probability, in (0, 1), that a sample of inliers only has been drawn when the search stops by itself.
    float confidence;
    // Largest Sampson error of an inlier, pixels.
    float max_error_px;
    // Standard deviation of the noise of one image coordinate, pixels; 0 for half of `max_error_px`.
    float sigma_px;
} epi_relative_pose_options_f32;

// How a search went.
typedef struct epi_search_report_f32 {
    // Residuals evaluated.
    uint64_t residuals;
    // Samples drawn.
    uint32_t iterations;
    // Minimal problems solved.
    uint32_t solver_calls;
    // Hypotheses scored.
    uint32_t hypotheses;
    // Local optimisations made.
    uint32_t refinements;
    // Why the search ended: one of `epi_stop_reason`.
    uint32_t stop;
    // Inliers of the verdict's model.
    uint32_t inliers;
    // Truncated squared error of the search's best model: the sum of min(r^2 / threshold^2, 1).
    float cost;
    // Probability that no sample of inliers only was drawn, given the inliers found.
    float miss_probability;
    // Without consensus: a larger share of inliers would have been sampled, with the confidence asked.
    float excluded_inlier_ratio;
} epi_search_report_f32;

// A pose into the camera, `x_cam = R X + t`; of two views, `X2 = R X1 + t`.
typedef struct epi_pose_f32 {
    // Unit quaternion `i j k w`.
    float rotation[4];
    // The translation.
    float translation[3];
} epi_pose_f32;

// What `epi_relative_pose` found.
typedef struct epi_relative_pose_estimate_f32 {
    // How the search went.
    struct epi_search_report_f32 report;
    // One of `epi_relative_pose_verdict`.
    uint32_t verdict;
    // One of `epi_unobservable`.
    uint32_t unobservable;
    // Poses found: 1 of a general motion, 1 or 2 of a plane, else 0.
    uint32_t pose_count;
    // Rows of each covariance: 5, 8 or 3 by the verdict, 0 where the inliers leave a direction open.
    uint32_t covariance_size[2];
    // Robust estimate of the noise of one image coordinate, pixels; 0 without inliers.
    float noise_px;
    // Of view 2 in the frame of view 1, |t| = 1.
    struct epi_pose_f32 poses[2];
    // Of a plane: its unit normal in the frame of view 1.
    float normals[2][3];
    // Of a plane: the length of the true translation over the plane's distance from view 1.
    float baseline_over_distance[2];
    // Row-major, in the first `covariance_size` squared numbers. Order: `kernel/CONVENTIONS.md`.
    float covariance[2][64];
} epi_relative_pose_estimate_f32;

// A robust estimation asks, before every eighth iteration: may I go on? A window before every one. 0 means no.
// `context` is what the caller gave.
typedef int32_t (*epi_keep_going)(void *context, uint32_t iterations);

// A camera. Pixels: the centre of the top-left pixel is (0, 0).
typedef struct epi_camera_f64 {
    // One of `epi_camera_model`.
    uint32_t model;
    // Horizontal focal length, px.
    double fx;
    // Vertical focal length, px.
    double fy;
    // Principal point, px from the left.
    double cx;
    // Principal point, px from the top.
    double cy;
    // Coefficients of the model; those that it does not have are ignored.
    double distortion[8];
} epi_camera_f64;

// Options of `epi_relative_pose`.
typedef struct epi_relative_pose_options_f64 {
    // Of this struct, in bytes.
    uint32_t size;
    // Samples drawn at the least.
    uint32_t min_iterations;
    // Samples drawn at the most.
    uint32_t max_iterations;
    // Minimal problems solved at the most.
    uint32_t max_solver_calls;
    // Residuals evaluated at the most.
    uint64_t max_residuals;
    // The same seed and input give the same bits.
    uint64_t seed;
    // Probability, in (0, 1), that a sample of inliers only has been drawn when the search stops by itself.
    double confidence;
    // Largest Sampson error of an inlier, pixels.
    double max_error_px;
    // Standard deviation of the noise of one image coordinate, pixels; 0 for half of `max_error_px`.
    double sigma_px;
} epi_relative_pose_options_f64;

// How a search went.
typedef struct epi_search_report_f64 {
    // Residuals evaluated.
    uint64_t residuals;
    // Samples drawn.
    uint32_t iterations;
    // Minimal problems solved.
    uint32_t solver_calls;
    // Hypotheses scored.
    uint32_t hypotheses;
    // Local optimisations made.
    uint32_t refinements;
    // Why the search ended: one of `epi_stop_reason`.
    uint32_t stop;
    // Inliers of the verdict's model.
    uint32_t inliers;
    // Truncated squared error of the search's best model: the sum of min(r^2 / threshold^2, 1).
    double cost;
    // Probability that no sample of inliers only was drawn, given the inliers found.
    double miss_probability;
    // Without consensus: a larger share of inliers would have been sampled, with the confidence asked.
    double excluded_inlier_ratio;
} epi_search_report_f64;

// A pose into the camera, `x_cam = R X + t`; of two views, `X2 = R X1 + t`.
typedef struct epi_pose_f64 {
    // Unit quaternion `i j k w`.
    double rotation[4];
    // The translation.
    double translation[3];
} epi_pose_f64;

// What `epi_relative_pose` found.
typedef struct epi_relative_pose_estimate_f64 {
    // How the search went.
    struct epi_search_report_f64 report;
    // One of `epi_relative_pose_verdict`.
    uint32_t verdict;
    // One of `epi_unobservable`.
    uint32_t unobservable;
    // Poses found: 1 of a general motion, 1 or 2 of a plane, else 0.
    uint32_t pose_count;
    // Rows of each covariance: 5, 8 or 3 by the verdict, 0 where the inliers leave a direction open.
    uint32_t covariance_size[2];
    // Robust estimate of the noise of one image coordinate, pixels; 0 without inliers.
    double noise_px;
    // Of view 2 in the frame of view 1, |t| = 1.
    struct epi_pose_f64 poses[2];
    // Of a plane: its unit normal in the frame of view 1.
    double normals[2][3];
    // Of a plane: the length of the true translation over the plane's distance from view 1.
    double baseline_over_distance[2];
    // Row-major, in the first `covariance_size` squared numbers. Order: `kernel/CONVENTIONS.md`.
    double covariance[2][64];
} epi_relative_pose_estimate_f64;

// Every code, in falling order.
#define epi_status_ALL { epi_status_Ok, epi_status_NullPointer, epi_status_Misaligned, epi_status_Overlap, epi_status_TooLarge, epi_status_Capacity, epi_status_Workspace, epi_status_StructSize, epi_status_UnknownEnum, epi_status_TooFew, epi_status_NotFinite, epi_status_Camera, epi_status_Rotation, epi_status_MaxError, epi_status_Sigma, epi_status_Confidence, epi_status_NoIterations, epi_status_Gravity, epi_status_NotVisible, epi_status_Unobservable, epi_status_NotAWindow, epi_status_FramesFull, epi_status_PointsFull, epi_status_ObservationsFull, epi_status_StaleFrame, epi_status_StalePoint, epi_status_DuplicateObservation, epi_status_NoSuchObservation, epi_status_NotPositive, epi_status_NotPositiveSemidefinite, epi_status_SameFrame, epi_status_ContradictoryFixedFrames, epi_status_NoPriorMemory, epi_status_BadOption, epi_status_NothingFree, epi_status_NoObservations, epi_status_NoUsablePoint, epi_status_UnconstrainedFrame, epi_status_Other, }

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// The ABI of this library, to be compared with `EPI_ABI_VERSION`.
uint32_t epi_abi_version(void);

// What a status means: a sentence that is always there, also for a number that is no status.
const char *epi_status_string(int32_t status);

// What every workspace must be aligned to, in bytes: `EPI_WORKSPACE_ALIGN`.
size_t epi_workspace_align(void);

// The pixels of points of the camera frame.
//
// `points`: `count` times x y z. `pixels`: `count` times u v, zeros where the camera does not see the point.
// `visible`: `count` times 1 or 0. Answers how many are visible.
int32_t epi_camera_project_f32(const struct epi_camera_f32 *camera,
                               const float *points,
                               size_t count,
                               float *pixels,
                               uint8_t *visible);

// The unit bearings of pixels.
//
// `pixels`: `count` times u v. `bearings`: `count` times x y z, zeros where the lens has none.
// `valid`: `count` times 1 or 0. Answers how many have a bearing.
int32_t epi_camera_unproject_f32(const struct epi_camera_f32 *camera,
                                 const float *pixels,
                                 size_t count,
                                 float *bearings,
                                 uint8_t *valid);

// Fills the options with their defaults. `size`: `sizeof` of the struct.
int32_t epi_relative_pose_options_default_f32(struct epi_relative_pose_options_f32 *options, size_t size);

// Bytes of the workspace of `epi_relative_pose` for `count` correspondences; 0 where no memory is that large.
// `wide`: not 0 if a camera is a fisheye.
size_t epi_relative_pose_workspace_size_f32(size_t count, uint32_t wide);

// The pose of view 2 in the frame of view 1 from pixel correspondences, many of which may be wrong, or why there is
// none: `X2 = R X1 + t`, |t| = 1.
//
// `x1`, `x2`: `count >= 5` times u v. `workspace`: of the size that `epi_relative_pose_workspace_size` tells.
// `estimate_size`: `sizeof` of the struct. `inliers`: `count` times 1 or 0, the mask of the verdict's model.
// Answers how many poses there are.
int32_t epi_relative_pose_f32(const struct epi_camera_f32 *camera1,
                              const struct epi_camera_f32 *camera2,
                              const float *x1,
                              const float *x2,
                              size_t count,
                              const struct epi_relative_pose_options_f32 *options,
                              void *workspace,
                              size_t workspace_size,
                              struct epi_relative_pose_estimate_f32 *estimate,
                              size_t estimate_size,
                              uint8_t *inliers);

// `epi_relative_pose` with match scores, or with a caller's "may I go on?".
//
// `scores`: null, or `count` numbers, lower is better, by which samples are drawn best first. `keep_going`: null, or
// asked before every eighth iteration.
int32_t epi_relative_pose_guided_f32(const struct epi_camera_f32 *camera1,
                                     const struct epi_camera_f32 *camera2,
                                     const float *x1,
                                     const float *x2,
                                     const float *scores,
                                     size_t count,
                                     const struct epi_relative_pose_options_f32 *options,
                                     epi_keep_going keep_going,
                                     void *context,
                                     void *workspace,
                                     size_t workspace_size,
                                     struct epi_relative_pose_estimate_f32 *estimate,
                                     size_t estimate_size,
                                     uint8_t *inliers);

// Points of two views from their bearings.
//
// `pose`: of view 2 in the frame of view 1; the points have the unit of its translation. `method`: one of
// `epi_triangulation_method`. `x1`, `x2`: `count` times x y z, bearings of any length. `points`: `count` times x y z in
// the frame of view 1, by the verdict. `verdicts`: `count` times one of `epi_triangulation_verdict`. Answers how many
// have the verdict `EPI_TRIANGULATION_VERDICT_POINT`.
int32_t epi_triangulate_f32(const struct epi_pose_f32 *pose,
                            uint32_t method,
                            const float *x1,
                            const float *x2,
                            size_t count,
                            float *points,
                            uint8_t *verdicts);

// The pixels of points of the camera frame.
//
// `points`: `count` times x y z. `pixels`: `count` times u v, zeros where the camera does not see the point.
// `visible`: `count` times 1 or 0. Answers how many are visible.
int32_t epi_camera_project_f64(const struct epi_camera_f64 *camera,
                               const double *points,
                               size_t count,
                               double *pixels,
                               uint8_t *visible);

// The unit bearings of pixels.
//
// `pixels`: `count` times u v. `bearings`: `count` times x y z, zeros where the lens has none.
// `valid`: `count` times 1 or 0. Answers how many have a bearing.
int32_t epi_camera_unproject_f64(const struct epi_camera_f64 *camera,
                                 const double *pixels,
                                 size_t count,
                                 double *bearings,
                                 uint8_t *valid);

// Fills the options with their defaults. `size`: `sizeof` of the struct.
int32_t epi_relative_pose_options_default_f64(struct epi_relative_pose_options_f64 *options, size_t size);

// Bytes of the workspace of `epi_relative_pose` for `count` correspondences; 0 where no memory is that large.
// `wide`: not 0 if a camera is a fisheye.
size_t epi_relative_pose_workspace_size_f64(size_t count, uint32_t wide);

// The pose of view 2 in the frame of view 1 from pixel correspondences, many of which may be wrong, or why there is
// none: `X2 = R X1 + t`, |t| = 1.
//
// `x1`, `x2`: `count >= 5` times u v. `workspace`: of the size that `epi_relative_pose_workspace_size` tells.
// `estimate_size`: `sizeof` of the struct. `inliers`: `count` times 1 or 0, the mask of the verdict's model.
// Answers how many poses there are.
int32_t epi_relative_pose_f64(const struct epi_camera_f64 *camera1,
                              const struct epi_camera_f64 *camera2,
                              const double *x1,
                              const double *x2,
                              size_t count,
                              const struct epi_relative_pose_options_f64 *options,
                              void *workspace,
                              size_t workspace_size,
                              struct epi_relative_pose_estimate_f64 *estimate,
                              size_t estimate_size,
                              uint8_t *inliers);

// `epi_relative_pose` with match scores, or with a caller's "may I go on?".
//
// `scores`: null, or `count` numbers, lower is better, by which samples are drawn best first. `keep_going`: null, or
// asked before every eighth iteration.
int32_t epi_relative_pose_guided_f64(const struct epi_camera_f64 *camera1,
                                     const struct epi_camera_f64 *camera2,
                                     const double *x1,
                                     const double *x2,
                                     const double *scores,
                                     size_t count,
                                     const struct epi_relative_pose_options_f64 *options,
                                     epi_keep_going keep_going,
                                     void *context,
                                     void *workspace,
                                     size_t workspace_size,
                                     struct epi_relative_pose_estimate_f64 *estimate,
                                     size_t estimate_size,
                                     uint8_t *inliers);

// Points of two views from their bearings.
//
// `pose`: of view 2 in the frame of view 1; the points have the unit of its translation. `method`: one of
// `epi_triangulation_method`. `x1`, `x2`: `count` times x y z, bearings of any length. `points`: `count` times x y z in
// the frame of view 1, by the verdict. `verdicts`: `count` times one of `epi_triangulation_verdict`. Answers how many
// have the verdict `EPI_TRIANGULATION_VERDICT_POINT`.
int32_t epi_triangulate_f64(const struct epi_pose_f64 *pose,
                            uint32_t method,
                            const double *x1,
                            const double *x2,
                            size_t count,
                            double *points,
                            uint8_t *verdicts);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* EPIPOLE_H */
