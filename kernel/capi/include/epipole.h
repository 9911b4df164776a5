#ifndef EPIPOLE_H
#define EPIPOLE_H

/* Made by cbindgen from kernel/capi/src: see kernel/capi/tests/header.rs. The rules of this interface, frames, units and
   the order of covariances: kernel/CONVENTIONS.md. */

#include <stddef.h>
#include <stdint.h>
/* Bytes of workspaces, for static allocation: what the functions `.._workspace_size` answer, as constants. Align the memory
   to EPI_WORKSPACE_ALIGN. `wide` is not 0 if a camera is a fisheye. */
#define EPI_WORKSPACE_SIZE_(bytes_a_number, numbers, count)                                                            \
    ((((size_t)(count) + 3) / 4 * 4) * ((size_t)(bytes_a_number) * (numbers) + 5))
#define EPI_TWO_VIEW_SIZE_(bytes_a_number, count, wide)                                                                \
    EPI_WORKSPACE_SIZE_(bytes_a_number, (wide) ? EPI_TWO_VIEW_WIDE_NUMBERS : EPI_TWO_VIEW_NUMBERS, count)
#define EPI_ABSOLUTE_POSE_SIZE_(bytes_a_number, count, wide)                                                           \
    EPI_WORKSPACE_SIZE_(bytes_a_number, (wide) ? EPI_ABSOLUTE_POSE_WIDE_NUMBERS : EPI_ABSOLUTE_POSE_NUMBERS, count)
#define EPI_RELATIVE_POSE_WORKSPACE_SIZE_F32(count, wide) EPI_TWO_VIEW_SIZE_(4, count, wide)
#define EPI_RELATIVE_POSE_WORKSPACE_SIZE_F64(count, wide) EPI_TWO_VIEW_SIZE_(8, count, wide)
#define EPI_HOMOGRAPHY_WORKSPACE_SIZE_F32(count) EPI_TWO_VIEW_SIZE_(4, count, 0)
#define EPI_HOMOGRAPHY_WORKSPACE_SIZE_F64(count) EPI_TWO_VIEW_SIZE_(8, count, 0)
#define EPI_FUNDAMENTAL_WORKSPACE_SIZE_F32(count) EPI_TWO_VIEW_SIZE_(4, count, 0)
#define EPI_FUNDAMENTAL_WORKSPACE_SIZE_F64(count) EPI_TWO_VIEW_SIZE_(8, count, 0)
#define EPI_ABSOLUTE_POSE_WORKSPACE_SIZE_F32(count, wide) EPI_ABSOLUTE_POSE_SIZE_(4, count, wide)
#define EPI_ABSOLUTE_POSE_WORKSPACE_SIZE_F64(count, wide) EPI_ABSOLUTE_POSE_SIZE_(8, count, wide)

/* Bytes of a window, as `epi_window_size` tells them. `prior` is not 0 for a window that marginalises. */
#define EPI_ROUND_8_(bytes) (((size_t)(bytes) + 7) / 8 * 8)
#define EPI_WINDOW_SCALARS_(frames, prior)                                                                             \
    (18 * (size_t)(frames) * ((size_t)(frames) + 1) + 24 * (size_t)(frames) + 16 +                                     \
     ((prior) ? 3 * (size_t)(frames) * (6 * (size_t)(frames) + 1) + 6 * (size_t)(frames) : 0))
#define EPI_WINDOW_SIZE_F32(frames, points, observations, prior)                                                       \
    (EPI_WINDOW_HEAD + EPI_ROUND_8_(EPI_WINDOW_FRAME_F32 * (size_t)(frames)) +                                         \
     EPI_ROUND_8_(EPI_WINDOW_POINT_F32 * (size_t)(points)) +                                                           \
     EPI_ROUND_8_(EPI_WINDOW_OBSERVATION_F32 * (size_t)(observations)) + EPI_ROUND_8_(4 * EPI_WINDOW_SCALARS_(frames, prior)))
#define EPI_WINDOW_SIZE_F64(frames, points, observations, prior)                                                       \
    (EPI_WINDOW_HEAD + EPI_ROUND_8_(EPI_WINDOW_FRAME_F64 * (size_t)(frames)) +                                         \
     EPI_ROUND_8_(EPI_WINDOW_POINT_F64 * (size_t)(points)) +                                                           \
     EPI_ROUND_8_(EPI_WINDOW_OBSERVATION_F64 * (size_t)(observations)) + EPI_ROUND_8_(8 * EPI_WINDOW_SCALARS_(frames, prior)))


// Grows with every change of the ABI that an older program would notice.
#define EPI_ABI_VERSION 1

// Essential matrices of `epi_relpose_5pt`, poses of `epi_relpose_5pt_poses`.
#define EPI_RELPOSE_5PT_MAX 10

// Fundamental matrices of `epi_relpose_7pt`.
#define EPI_RELPOSE_7PT_MAX 3

// Poses of `epi_relpose_upright_3pt`.
#define EPI_RELPOSE_UPRIGHT_3PT_MAX 4

// Poses of `epi_p3p`.
#define EPI_P3P_MAX 4

// Poses of `epi_abspose_upright_2pt`.
#define EPI_ABSPOSE_UPRIGHT_2PT_MAX 2

// Poses of `epi_abspose_npt`.
#define EPI_ABSPOSE_NPT_MAX 4

// Poses of `epi_abspose_planar`.
#define EPI_ABSPOSE_PLANAR_MAX 2

// Poses of `epi_essential_poses`.
#define EPI_ESSENTIAL_POSES_MAX 4

// Motions of `epi_homography_motions` and `epi_homography_visible_motions`.
#define EPI_HOMOGRAPHY_MOTIONS_MAX 4

// Views that `epi_triangulate_dlt` and `epi_refine_point` take at the most: they stand on the stack.
#define EPI_POINT_MAX_VIEWS 16

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

// Bytes of a window's head.
#define EPI_WINDOW_HEAD 48

// Bytes of a frame in a window of `float`.
#define EPI_WINDOW_FRAME_F32 520

// Bytes of a frame in a window of `double`.
#define EPI_WINDOW_FRAME_F64 1024

// Bytes of a point in a window of `float`.
#define EPI_WINDOW_POINT_F32 28

// Bytes of a point in a window of `double`.
#define EPI_WINDOW_POINT_F64 56

// Bytes of an observation in a window of `float`.
#define EPI_WINDOW_OBSERVATION_F32 16

// Bytes of an observation in a window of `double`.
#define EPI_WINDOW_OBSERVATION_F64 32

// Frames, and points, that a window counts at the most.
#define EPI_WINDOW_MAX 65534

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
    // A prior needs finite directions or a rotation, and a positive uncertainty.
    EPI_STATUS_PRIOR = -38,
    // The pose to start from has a translation of zero.
    EPI_STATUS_START = -39,
    // An error that this version of the header does not name.
    EPI_STATUS_OTHER = -40,
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
    // So few correspondences that chance could explain them.
    EPI_RELATIVE_POSE_VERDICT_TOO_FEW_INLIERS = 5,
    // No model explains more correspondences than chance.
    EPI_RELATIVE_POSE_VERDICT_NO_CONSENSUS = 6,
    // A verdict that this version of the header does not name.
    EPI_RELATIVE_POSE_VERDICT_OTHER = 7,
    // A general motion unless the scene is a plane, which `no_planes` left unexamined: `poses[0]`, covariance 5x5.
    EPI_RELATIVE_POSE_VERDICT_GENERAL_OR_PLANAR = 8,
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
    // The confidence was reached: of the inliers found, or that no consensus of any use is there.
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

// How much a residual r counts; the scale k is `loss_scale`.
enum epi_loss
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    // r^2; the scale is ignored.
    EPI_LOSS_SQUARED = 0,
    // min(r^2, k^2).
    EPI_LOSS_TRUNCATED = 1,
    // r^2 up to k, linear beyond.
    EPI_LOSS_HUBER = 2,
    // k^2 ln(1 + r^2 / k^2).
    EPI_LOSS_CAUCHY = 3,
    // Tukey's biweight, constant beyond k.
    EPI_LOSS_TUKEY = 4,
    // r^2 / (1 + r^2 / k^2).
    EPI_LOSS_GEMAN_MC_CLURE = 5,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum epi_loss epi_loss;
#else
typedef uint32_t epi_loss;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// What correspondences say about a homography.
enum epi_homography_verdict
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    // A homography and its uncertainty.
    EPI_HOMOGRAPHY_VERDICT_FOUND = 0,
    // The inliers agree, and many homographies explain them: see `unobservable`.
    EPI_HOMOGRAPHY_VERDICT_UNOBSERVABLE = 1,
    // So few correspondences that chance could explain them.
    EPI_HOMOGRAPHY_VERDICT_TOO_FEW_INLIERS = 2,
    // No homography explains more correspondences than chance.
    EPI_HOMOGRAPHY_VERDICT_NO_CONSENSUS = 3,
    // A verdict that this version of the header does not name.
    EPI_HOMOGRAPHY_VERDICT_OTHER = 4,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum epi_homography_verdict epi_homography_verdict;
#else
typedef uint32_t epi_homography_verdict;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// What correspondences say about the epipolar geometry of two images.
enum epi_fundamental_verdict
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    // A fundamental matrix.
    EPI_FUNDAMENTAL_VERDICT_FOUND = 0,
    // All inliers agree with one homography, which is the matrix of the answer.
    EPI_FUNDAMENTAL_VERDICT_PLANAR = 1,
    // The inliers agree, and no epipolar geometry follows: see `unobservable`.
    EPI_FUNDAMENTAL_VERDICT_UNOBSERVABLE = 2,
    // So few correspondences that chance could explain them.
    EPI_FUNDAMENTAL_VERDICT_TOO_FEW_INLIERS = 3,
    // No epipolar geometry explains more correspondences than chance.
    EPI_FUNDAMENTAL_VERDICT_NO_CONSENSUS = 4,
    // A verdict that this version of the header does not name.
    EPI_FUNDAMENTAL_VERDICT_OTHER = 5,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum epi_fundamental_verdict epi_fundamental_verdict;
#else
typedef uint32_t epi_fundamental_verdict;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// What pixels of known points say about the camera's pose.
enum epi_absolute_pose_verdict
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    // One pose.
    EPI_ABSOLUTE_POSE_VERDICT_POSE = 0,
    // Two poses of a plane that fit alike, the more likely first.
    EPI_ABSOLUTE_POSE_VERDICT_PLANAR_AMBIGUITY = 1,
    // The inliers agree, and no pose follows: see `unobservable`.
    EPI_ABSOLUTE_POSE_VERDICT_UNOBSERVABLE = 2,
    // The points agree only behind the camera: an axis of a frame is reversed.
    EPI_ABSOLUTE_POSE_VERDICT_BEHIND_CAMERA = 3,
    // Something agrees, on no more correspondences than chance explains.
    EPI_ABSOLUTE_POSE_VERDICT_TOO_FEW_INLIERS = 4,
    // No pose explains more correspondences than chance.
    EPI_ABSOLUTE_POSE_VERDICT_NO_CONSENSUS = 5,
    // A verdict that this version of the header does not name.
    EPI_ABSOLUTE_POSE_VERDICT_OTHER = 6,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum epi_absolute_pose_verdict epi_absolute_pose_verdict;
#else
typedef uint32_t epi_absolute_pose_verdict;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// What became of a prior.
enum epi_prior_fit
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    // None was given, or no pose found.
    EPI_PRIOR_FIT_NONE = 0,
    // It took part in the refinement.
    EPI_PRIOR_FIT_FITS = 1,
    // The correspondences contradict it, and it was left aside.
    EPI_PRIOR_FIT_CONTRADICTED = 2,
    // Something that this version of the header does not name.
    EPI_PRIOR_FIT_OTHER = 3,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum epi_prior_fit epi_prior_fit;
#else
typedef uint32_t epi_prior_fit;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Which unknowns of a window move. Fixed frames and fixed points never do.
enum epi_unknowns
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    // Frames and points.
    EPI_UNKNOWNS_FRAMES_AND_POINTS = 0,
    // Frames alone.
    EPI_UNKNOWNS_FRAMES = 1,
    // Points alone.
    EPI_UNKNOWNS_POINTS = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum epi_unknowns epi_unknowns;
#else
typedef uint32_t epi_unknowns;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Why the optimisation of a window ended.
enum epi_termination
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    // The cost falls no further than the tolerance.
    EPI_TERMINATION_CONVERGED = 0,
    // `max_iterations` are done.
    EPI_TERMINATION_ITERATION_LIMIT = 1,
    // The next iteration would exceed `max_evaluations`.
    EPI_TERMINATION_BUDGET_SPENT = 2,
    // The caller answered no.
    EPI_TERMINATION_INTERRUPTED = 3,
    // No step lowers the cost, however strongly damped.
    EPI_TERMINATION_NO_PROGRESS = 4,
    // A reason that this version of the header does not name.
    EPI_TERMINATION_OTHER = 5,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum epi_termination epi_termination;
#else
typedef uint32_t epi_termination;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// What is known of a relative pose beforehand.
enum epi_relative_pose_prior
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    // Nothing; the fields of the others are ignored.
    EPI_RELATIVE_POSE_PRIOR_NONE = 0,
    // The direction of gravity in both views.
    EPI_RELATIVE_POSE_PRIOR_GRAVITY = 1,
    // The rotation.
    EPI_RELATIVE_POSE_PRIOR_ROTATION = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum epi_relative_pose_prior epi_relative_pose_prior;
#else
typedef uint32_t epi_relative_pose_prior;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// A window of frames, points and observations. Made by `epi_window_create`, in the caller's memory.
typedef struct epi_window_f32 epi_window_f32;

// A window of frames, points and observations. Made by `epi_window_create`, in the caller's memory.
typedef struct epi_window_f64 epi_window_f64;

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
    // Residuals evaluated at the most; 2^32 - 1 and more: no limit but that.
    uint64_t max_residuals;
    // The same seed and input give the same bits.
    uint64_t seed;
    // Probability, in (0, 1), that a sample of inliers only has been drawn when the search stops by itself.
    float confidence;
    // Largest Sampson error of an inlier, pixels.
    float max_error_px;
    // Standard deviation of the noise of one image coordinate, pixels; 0 for half of `max_error_px`.
    float sigma_px;
    // Displacement between the views, pixels, that is no motion where at least half of all correspondences stay below it
    // and at most one inlier in ten moves by twice as much; 0 leaves the decision to the noise alone, and a negative number
    // stands for five times `sigma_px`.
    float least_motion_px;
    // Of gravity as a prior: its direction in view 1, of any length.
    float prior_view1[3];
    // Its direction in view 2.
    float prior_view2[3];
    // Standard deviation of each of the two directions, about each axis across it, rad.
    float prior_sigma_rad;
    // Of the rotation as a prior: a unit quaternion `i j k w`.
    float prior_rotation[4];
    // Covariance of w of `R <- Exp(w) R`, rad^2: 3x3 by rows.
    float prior_covariance[3][3];
    // What is known: one of `epi_relative_pose_prior`, of which a library without the feature `prior` takes none.
    uint32_t prior;
    // Not 0: whether the inliers lie on a plane, which leaves two poses, is not examined, and a general motion's verdict is
    // `GENERAL_OR_PLANAR`.
    uint32_t no_planes;
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
    // Of relative poses: what the best other solution that was met explains, as a share of what the best one does; near 1
    // where two explain the correspondences alike, 0 where no other was met.
    float rival_share;
} epi_search_report_f32;

// A pose into the camera, `x_cam = R X + t`; of two views, `X2 = R X1 + t`.
typedef struct epi_pose_f32 {
    // Unit quaternion `i j k w`.
    float rotation[4];
    // The translation.
    float translation[3];
} epi_pose_f32;

// What `epi_refine_relative_pose` found.
typedef struct epi_refined_relative_pose_f32 {
    // Of view 2 in the frame of view 1, |t| = 1.
    struct epi_pose_f32 pose;
    // 5x5 by rows: w of `R <- Exp(w) R` (rad), then t in its tangent basis; zeros without.
    float covariance[5][5];
    // 1 where there is a covariance, 0 where a direction is open.
    uint32_t has_covariance;
} epi_refined_relative_pose_f32;

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
    // What became of a prior: one of `epi_prior_fit`.
    uint32_t prior;
    // Of a plane: 1 where `general` holds a general motion, else 0.
    uint32_t has_general;
    // Rows of each covariance: 5, 8 or 3 by the verdict, 0 where the inliers leave a direction open.
    uint32_t covariance_size[2];
    // Robust estimate of the noise of one image coordinate, pixels; 0 without inliers.
    float noise_px;
    // By how many standard deviations a prior and the pose found differ.
    float prior_deviations;
    // Of view 2 in the frame of view 1, |t| = 1.
    struct epi_pose_f32 poses[2];
    // Of a plane: its unit normal in the frame of view 1.
    float normals[2][3];
    // Of a plane: the length of the true translation over the plane's distance from view 1.
    float baseline_over_distance[2];
    // By rows, in the first `covariance_size` squared numbers. Order: `kernel/CONVENTIONS.md`.
    float covariance[2][64];
    // Of a plane: the general motion that explains more correspondences than both poses of the plane, although by no more
    // than chance might. The better answer where the scene is but nearly a plane.
    struct epi_refined_relative_pose_f32 general;
} epi_relative_pose_estimate_f32;

// A robust estimation asks, before every eighth iteration: may I go on? A window before every one. 0 means no.
// `context` is what the caller gave.
typedef int32_t (*epi_keep_going)(void *context, uint32_t iterations);

// Options of `epi_homography`.
typedef struct epi_homography_options_f32 {
    // Of this struct, in bytes.
    uint32_t size;
    // Samples drawn at the least.
    uint32_t min_iterations;
    // Samples drawn at the most.
    uint32_t max_iterations;
    // Minimal problems solved at the most.
    uint32_t max_solver_calls;
    // Residuals evaluated at the most; 2^32 - 1 and more: no limit but that.
    uint64_t max_residuals;
    // The same seed and input give the same bits.
    uint64_t seed;
    // Probability, in (0, 1), that a sample of inliers only has been drawn when the search stops by itself.
    float confidence;
    // Largest transfer error of an inlier, pixels.
    float max_error_px;
    // Standard deviation of the noise of one image coordinate, pixels; 0 for a third of `max_error_px`.
    float sigma_px;
} epi_homography_options_f32;

// What `epi_homography` found.
typedef struct epi_homography_estimate_f32 {
    // How the search went.
    struct epi_search_report_f32 report;
    // One of `epi_homography_verdict`.
    uint32_t verdict;
    // One of `epi_unobservable`.
    uint32_t unobservable;
    // 1 where there is a covariance, 0 where a direction is open.
    uint32_t has_covariance;
    // Robust estimate of the noise of one image coordinate, pixels; 0 without inliers.
    float noise_px;
    // `x2 ~ H x1` between pixels, 3x3 by rows, |H| = 1.
    float homography[3][3];
    // Four pixels of view 1 around the inliers.
    float corners[4][2];
    // Of the pixels of view 2 to which the corners go, px^2: 8x8 by rows.
    float covariance[8][8];
} epi_homography_estimate_f32;

// Options of `epi_fundamental`.
typedef struct epi_fundamental_options_f32 {
    // Of this struct, in bytes.
    uint32_t size;
    // Samples drawn at the least.
    uint32_t min_iterations;
    // Samples drawn at the most.
    uint32_t max_iterations;
    // Minimal problems solved at the most.
    uint32_t max_solver_calls;
    // Residuals evaluated at the most; 2^32 - 1 and more: no limit but that.
    uint64_t max_residuals;
    // The same seed and input give the same bits.
    uint64_t seed;
    // Probability, in (0, 1), that a sample of inliers only has been drawn when the search stops by itself.
    float confidence;
    // Largest Sampson error of an inlier, pixels.
    float max_error_px;
    // Standard deviation of the noise of one image coordinate, pixels; 0 for half of `max_error_px`.
    float sigma_px;
} epi_fundamental_options_f32;

// What `epi_fundamental` found.
typedef struct epi_fundamental_estimate_f32 {
    // How the search went.
    struct epi_search_report_f32 report;
    // One of `epi_fundamental_verdict`.
    uint32_t verdict;
    // One of `epi_unobservable`.
    uint32_t unobservable;
    // Robust estimate of the noise of one image coordinate, pixels; 0 without inliers.
    float noise_px;
    // `x2' F x1 = 0` between pixels, 3x3 by rows, |F| = 1; of a plane its homography `x2 ~ H x1` instead.
    float matrix[3][3];
} epi_fundamental_estimate_f32;

// Options of `epi_absolute_pose`.
typedef struct epi_absolute_pose_options_f32 {
    // Of this struct, in bytes.
    uint32_t size;
    // Samples drawn at the least.
    uint32_t min_iterations;
    // Samples drawn at the most.
    uint32_t max_iterations;
    // Minimal problems solved at the most.
    uint32_t max_solver_calls;
    // Residuals evaluated at the most; 2^32 - 1 and more: no limit but that.
    uint64_t max_residuals;
    // The same seed and input give the same bits.
    uint64_t seed;
    // Probability, in (0, 1), that a sample of inliers only has been drawn when the search stops by itself.
    float confidence;
    // Largest reprojection error of an inlier, pixels.
    float max_error_px;
    // Standard deviation of the noise of one image coordinate, pixels; 0 for half of `max_error_px`.
    float sigma_px;
    // Of a gravity prior: its direction in the world, of any length.
    float gravity_world[3];
    // Its direction in the camera, of any length.
    float gravity_camera[3];
    // Standard deviation of the angle between the two, rad.
    float gravity_sigma_rad;
    // 1 if gravity is known (not in a library without the feature `prior`), else 0 and the three above are ignored.
    uint32_t has_gravity;
} epi_absolute_pose_options_f32;

// What `epi_absolute_pose` found.
typedef struct epi_absolute_pose_estimate_f32 {
    // How the search went.
    struct epi_search_report_f32 report;
    // One of `epi_absolute_pose_verdict`.
    uint32_t verdict;
    // One of `epi_unobservable`.
    uint32_t unobservable;
    // Poses found: 1, of a plane 2, the more likely first; else 0.
    uint32_t pose_count;
    // What became of a gravity prior: one of `epi_prior_fit`.
    uint32_t gravity;
    // For each pose 1 where there is a covariance, 0 where a direction is open.
    uint32_t has_covariance[2];
    // Estimate of the noise of one image coordinate, pixels; 0 without a pose.
    float noise_px;
    // Of a gravity prior: by how many standard deviations it differs from the pose found.
    float gravity_deviations;
    // Root mean square of the inliers' reprojection errors, pixels.
    float rms_px[2];
    // World to camera.
    struct epi_pose_f32 poses[2];
    // 6x6 by rows: w of `R <- Exp(w) R` (rad), then t.
    float covariance[2][6][6];
} epi_absolute_pose_estimate_f32;

// Options of `epi_refine_absolute_pose`.
typedef struct epi_refine_absolute_pose_options_f32 {
    // Of this struct, in bytes.
    uint32_t size;
    // Passes over the correspondences at the most.
    uint32_t max_passes;
    // Of the reprojection error: one of `epi_loss`.
    uint32_t loss;
    // 1 if a prior is given, else 0 and the prior is ignored.
    uint32_t has_prior;
    // Scale of the loss, pixels.
    float loss_scale;
    // Standard deviation of the noise of one image coordinate, pixels.
    float sigma_px;
    // The pose that a prior expects.
    struct epi_pose_f32 prior_pose;
    // The inverse of its covariance, rotation (rad) then translation: 6x6 by rows.
    float prior_information[6][6];
} epi_refine_absolute_pose_options_f32;

// What `epi_refine_absolute_pose` found.
typedef struct epi_refined_absolute_pose_f32 {
    // World to camera; the start where nothing could be improved.
    struct epi_pose_f32 pose;
    // 6x6 by rows: w of `R <- Exp(w) R` (rad), then t; zeros without.
    float covariance[6][6];
    // Sum of the losses, px^2, and of the prior's share.
    float cost;
    // The cost at the start.
    float initial_cost;
    // 1 where there is a covariance, 0 where a direction is open.
    uint32_t has_covariance;
    // Points that the camera sees with a weight above zero.
    uint32_t active;
    // Passes over the correspondences.
    uint32_t passes;
} epi_refined_absolute_pose_f32;

// Options of `epi_refine_homography` and `epi_refine_fundamental`.
typedef struct epi_refine_two_view_options_f32 {
    // Of this struct, in bytes.
    uint32_t size;
    // Passes over the correspondences at the most.
    uint32_t max_passes;
    // Of the error: one of `epi_loss`.
    uint32_t loss;
    // Scale of the loss, pixels.
    float loss_scale;
} epi_refine_two_view_options_f32;

// What `epi_refine_homography` and `epi_refine_fundamental` found.
typedef struct epi_refined_two_view_f32 {
    // 3x3 by rows, of length 1; the start where nothing could be improved.
    float matrix[3][3];
    // Sum of the losses, px^2.
    float cost;
    // The cost at the start.
    float initial_cost;
    // How many correspondences have a weight above zero.
    uint32_t active;
    // Passes over the correspondences.
    uint32_t passes;
} epi_refined_two_view_f32;

// What the rays of views determine.
typedef struct epi_triangulated_point_f32 {
    // By the verdict a point, a unit direction, or zeros.
    float point[3];
    // One of `epi_triangulation_verdict`.
    uint32_t verdict;
    // The first view that the point lies behind.
    uint32_t view;
    // How many views it lies behind.
    uint32_t behind;
} epi_triangulated_point_f32;

// A point of least reprojection error.
typedef struct epi_refined_point_f32 {
    // In the world.
    float point[3];
    // Sum of the squared reprojection errors.
    float cost_px_sq;
    // Of the point for a noise of 1 px, 3x3 by rows; zeros without.
    float covariance_per_px_sq[3][3];
    // 1 where there is a covariance, 0 where a direction is open.
    uint32_t has_covariance;
    // 1 where the iteration converged.
    uint32_t converged;
    // Evaluations of all residuals.
    uint32_t evaluations;
} epi_refined_point_f32;

// Options of `epi_window_optimise` and of what refines a part of a window.
typedef struct epi_bundle_options_f32 {
    // Of this struct, in bytes.
    uint32_t size;
    // Of an observation's distance in standard deviations: one of `epi_loss`.
    uint32_t loss;
    // Which unknowns move: one of `epi_unknowns`.
    uint32_t unknowns;
    // Iterations at the most, rejected steps included.
    uint32_t max_iterations;
    // Evaluations of observations at the most, three to an observation and iteration.
    uint32_t max_evaluations;
    // Scale of the loss, standard deviations.
    float loss_scale;
    // Converged where an iteration lowers the cost by less than this share.
    float cost_tolerance;
    // Damping of the first iteration, relative to the diagonal.
    float initial_damping;
    // An observation further off than this many standard deviations is reported as an outlier.
    float outlier_sigma;
} epi_bundle_options_f32;

// What a window knows of a frame: covariances by rows.
typedef struct epi_frame_covariance_f32 {
    // Of the pose: rotation (rad), then translation, of `R <- Exp(w) R`, `t <- t + dt`.
    float pose[6][6];
    // Of the camera's centre in the world.
    float centre[3][3];
    // Of the motion in the camera's own frame: rotation (rad), then the translation v of `centre <- centre - R' v`.
    float motion[6][6];
} epi_frame_covariance_f32;

// What an optimisation did.
typedef struct epi_bundle_report_f32 {
    // Why it ended: one of `epi_termination`.
    uint32_t termination;
    // 1 if any frame or point has moved.
    uint32_t changed;
    // Iterations, rejected steps included.
    uint32_t iterations;
    // Evaluations of observations.
    uint32_t evaluations;
    // Observations that counted.
    uint32_t observations;
    // Of them, outliers afterwards. More than half: the result is not to be trusted.
    uint32_t outliers;
    // Observations that did not count, the point being out of the camera's view.
    uint32_t behind;
    // Free points that did not move, seen fewer than twice.
    uint32_t unused_points;
    // `1/2 sum rho` of observations, priors and distances before.
    float cost_before;
    // The same after; never larger.
    float cost_after;
} epi_bundle_report_f32;

// How well the observations of one point agree with it.
typedef struct epi_point_report_f32 {
    // Observations.
    uint32_t observations;
    // Of them, outliers.
    uint32_t outliers;
    // Of them, where the camera does not see the point.
    uint32_t behind;
    // Root mean square of the distances, in standard deviations, of those that see it.
    float rms_sigma;
} epi_point_report_f32;

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
    // Residuals evaluated at the most; 2^32 - 1 and more: no limit but that.
    uint64_t max_residuals;
    // The same seed and input give the same bits.
    uint64_t seed;
    // Probability, in (0, 1), that a sample of inliers only has been drawn when the search stops by itself.
    double confidence;
    // Largest Sampson error of an inlier, pixels.
    double max_error_px;
    // Standard deviation of the noise of one image coordinate, pixels; 0 for half of `max_error_px`.
    double sigma_px;
    // Displacement between the views, pixels, that is no motion where at least half of all correspondences stay below it
    // and at most one inlier in ten moves by twice as much; 0 leaves the decision to the noise alone, and a negative number
    // stands for five times `sigma_px`.
    double least_motion_px;
    // Of gravity as a prior: its direction in view 1, of any length.
    double prior_view1[3];
    // Its direction in view 2.
    double prior_view2[3];
    // Standard deviation of each of the two directions, about each axis across it, rad.
    double prior_sigma_rad;
    // Of the rotation as a prior: a unit quaternion `i j k w`.
    double prior_rotation[4];
    // Covariance of w of `R <- Exp(w) R`, rad^2: 3x3 by rows.
    double prior_covariance[3][3];
    // What is known: one of `epi_relative_pose_prior`, of which a library without the feature `prior` takes none.
    uint32_t prior;
    // Not 0: whether the inliers lie on a plane, which leaves two poses, is not examined, and a general motion's verdict is
    // `GENERAL_OR_PLANAR`.
    uint32_t no_planes;
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
    // Of relative poses: what the best other solution that was met explains, as a share of what the best one does; near 1
    // where two explain the correspondences alike, 0 where no other was met.
    double rival_share;
} epi_search_report_f64;

// A pose into the camera, `x_cam = R X + t`; of two views, `X2 = R X1 + t`.
typedef struct epi_pose_f64 {
    // Unit quaternion `i j k w`.
    double rotation[4];
    // The translation.
    double translation[3];
} epi_pose_f64;

// What `epi_refine_relative_pose` found.
typedef struct epi_refined_relative_pose_f64 {
    // Of view 2 in the frame of view 1, |t| = 1.
    struct epi_pose_f64 pose;
    // 5x5 by rows: w of `R <- Exp(w) R` (rad), then t in its tangent basis; zeros without.
    double covariance[5][5];
    // 1 where there is a covariance, 0 where a direction is open.
    uint32_t has_covariance;
} epi_refined_relative_pose_f64;

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
    // What became of a prior: one of `epi_prior_fit`.
    uint32_t prior;
    // Of a plane: 1 where `general` holds a general motion, else 0.
    uint32_t has_general;
    // Rows of each covariance: 5, 8 or 3 by the verdict, 0 where the inliers leave a direction open.
    uint32_t covariance_size[2];
    // Robust estimate of the noise of one image coordinate, pixels; 0 without inliers.
    double noise_px;
    // By how many standard deviations a prior and the pose found differ.
    double prior_deviations;
    // Of view 2 in the frame of view 1, |t| = 1.
    struct epi_pose_f64 poses[2];
    // Of a plane: its unit normal in the frame of view 1.
    double normals[2][3];
    // Of a plane: the length of the true translation over the plane's distance from view 1.
    double baseline_over_distance[2];
    // By rows, in the first `covariance_size` squared numbers. Order: `kernel/CONVENTIONS.md`.
    double covariance[2][64];
    // Of a plane: the general motion that explains more correspondences than both poses of the plane, although by no more
    // than chance might. The better answer where the scene is but nearly a plane.
    struct epi_refined_relative_pose_f64 general;
} epi_relative_pose_estimate_f64;

// Options of `epi_homography`.
typedef struct epi_homography_options_f64 {
    // Of this struct, in bytes.
    uint32_t size;
    // Samples drawn at the least.
    uint32_t min_iterations;
    // Samples drawn at the most.
    uint32_t max_iterations;
    // Minimal problems solved at the most.
    uint32_t max_solver_calls;
    // Residuals evaluated at the most; 2^32 - 1 and more: no limit but that.
    uint64_t max_residuals;
    // The same seed and input give the same bits.
    uint64_t seed;
    // Probability, in (0, 1), that a sample of inliers only has been drawn when the search stops by itself.
    double confidence;
    // Largest transfer error of an inlier, pixels.
    double max_error_px;
    // Standard deviation of the noise of one image coordinate, pixels; 0 for a third of `max_error_px`.
    double sigma_px;
} epi_homography_options_f64;

// What `epi_homography` found.
typedef struct epi_homography_estimate_f64 {
    // How the search went.
    struct epi_search_report_f64 report;
    // One of `epi_homography_verdict`.
    uint32_t verdict;
    // One of `epi_unobservable`.
    uint32_t unobservable;
    // 1 where there is a covariance, 0 where a direction is open.
    uint32_t has_covariance;
    // Robust estimate of the noise of one image coordinate, pixels; 0 without inliers.
    double noise_px;
    // `x2 ~ H x1` between pixels, 3x3 by rows, |H| = 1.
    double homography[3][3];
    // Four pixels of view 1 around the inliers.
    double corners[4][2];
    // Of the pixels of view 2 to which the corners go, px^2: 8x8 by rows.
    double covariance[8][8];
} epi_homography_estimate_f64;

// Options of `epi_fundamental`.
typedef struct epi_fundamental_options_f64 {
    // Of this struct, in bytes.
    uint32_t size;
    // Samples drawn at the least.
    uint32_t min_iterations;
    // Samples drawn at the most.
    uint32_t max_iterations;
    // Minimal problems solved at the most.
    uint32_t max_solver_calls;
    // Residuals evaluated at the most; 2^32 - 1 and more: no limit but that.
    uint64_t max_residuals;
    // The same seed and input give the same bits.
    uint64_t seed;
    // Probability, in (0, 1), that a sample of inliers only has been drawn when the search stops by itself.
    double confidence;
    // Largest Sampson error of an inlier, pixels.
    double max_error_px;
    // Standard deviation of the noise of one image coordinate, pixels; 0 for half of `max_error_px`.
    double sigma_px;
} epi_fundamental_options_f64;

// What `epi_fundamental` found.
typedef struct epi_fundamental_estimate_f64 {
    // How the search went.
    struct epi_search_report_f64 report;
    // One of `epi_fundamental_verdict`.
    uint32_t verdict;
    // One of `epi_unobservable`.
    uint32_t unobservable;
    // Robust estimate of the noise of one image coordinate, pixels; 0 without inliers.
    double noise_px;
    // `x2' F x1 = 0` between pixels, 3x3 by rows, |F| = 1; of a plane its homography `x2 ~ H x1` instead.
    double matrix[3][3];
} epi_fundamental_estimate_f64;

// Options of `epi_absolute_pose`.
typedef struct epi_absolute_pose_options_f64 {
    // Of this struct, in bytes.
    uint32_t size;
    // Samples drawn at the least.
    uint32_t min_iterations;
    // Samples drawn at the most.
    uint32_t max_iterations;
    // Minimal problems solved at the most.
    uint32_t max_solver_calls;
    // Residuals evaluated at the most; 2^32 - 1 and more: no limit but that.
    uint64_t max_residuals;
    // The same seed and input give the same bits.
    uint64_t seed;
    // Probability, in (0, 1), that a sample of inliers only has been drawn when the search stops by itself.
    double confidence;
    // Largest reprojection error of an inlier, pixels.
    double max_error_px;
    // Standard deviation of the noise of one image coordinate, pixels; 0 for half of `max_error_px`.
    double sigma_px;
    // Of a gravity prior: its direction in the world, of any length.
    double gravity_world[3];
    // Its direction in the camera, of any length.
    double gravity_camera[3];
    // Standard deviation of the angle between the two, rad.
    double gravity_sigma_rad;
    // 1 if gravity is known (not in a library without the feature `prior`), else 0 and the three above are ignored.
    uint32_t has_gravity;
} epi_absolute_pose_options_f64;

// What `epi_absolute_pose` found.
typedef struct epi_absolute_pose_estimate_f64 {
    // How the search went.
    struct epi_search_report_f64 report;
    // One of `epi_absolute_pose_verdict`.
    uint32_t verdict;
    // One of `epi_unobservable`.
    uint32_t unobservable;
    // Poses found: 1, of a plane 2, the more likely first; else 0.
    uint32_t pose_count;
    // What became of a gravity prior: one of `epi_prior_fit`.
    uint32_t gravity;
    // For each pose 1 where there is a covariance, 0 where a direction is open.
    uint32_t has_covariance[2];
    // Estimate of the noise of one image coordinate, pixels; 0 without a pose.
    double noise_px;
    // Of a gravity prior: by how many standard deviations it differs from the pose found.
    double gravity_deviations;
    // Root mean square of the inliers' reprojection errors, pixels.
    double rms_px[2];
    // World to camera.
    struct epi_pose_f64 poses[2];
    // 6x6 by rows: w of `R <- Exp(w) R` (rad), then t.
    double covariance[2][6][6];
} epi_absolute_pose_estimate_f64;

// Options of `epi_refine_absolute_pose`.
typedef struct epi_refine_absolute_pose_options_f64 {
    // Of this struct, in bytes.
    uint32_t size;
    // Passes over the correspondences at the most.
    uint32_t max_passes;
    // Of the reprojection error: one of `epi_loss`.
    uint32_t loss;
    // 1 if a prior is given, else 0 and the prior is ignored.
    uint32_t has_prior;
    // Scale of the loss, pixels.
    double loss_scale;
    // Standard deviation of the noise of one image coordinate, pixels.
    double sigma_px;
    // The pose that a prior expects.
    struct epi_pose_f64 prior_pose;
    // The inverse of its covariance, rotation (rad) then translation: 6x6 by rows.
    double prior_information[6][6];
} epi_refine_absolute_pose_options_f64;

// What `epi_refine_absolute_pose` found.
typedef struct epi_refined_absolute_pose_f64 {
    // World to camera; the start where nothing could be improved.
    struct epi_pose_f64 pose;
    // 6x6 by rows: w of `R <- Exp(w) R` (rad), then t; zeros without.
    double covariance[6][6];
    // Sum of the losses, px^2, and of the prior's share.
    double cost;
    // The cost at the start.
    double initial_cost;
    // 1 where there is a covariance, 0 where a direction is open.
    uint32_t has_covariance;
    // Points that the camera sees with a weight above zero.
    uint32_t active;
    // Passes over the correspondences.
    uint32_t passes;
} epi_refined_absolute_pose_f64;

// Options of `epi_refine_homography` and `epi_refine_fundamental`.
typedef struct epi_refine_two_view_options_f64 {
    // Of this struct, in bytes.
    uint32_t size;
    // Passes over the correspondences at the most.
    uint32_t max_passes;
    // Of the error: one of `epi_loss`.
    uint32_t loss;
    // Scale of the loss, pixels.
    double loss_scale;
} epi_refine_two_view_options_f64;

// What `epi_refine_homography` and `epi_refine_fundamental` found.
typedef struct epi_refined_two_view_f64 {
    // 3x3 by rows, of length 1; the start where nothing could be improved.
    double matrix[3][3];
    // Sum of the losses, px^2.
    double cost;
    // The cost at the start.
    double initial_cost;
    // How many correspondences have a weight above zero.
    uint32_t active;
    // Passes over the correspondences.
    uint32_t passes;
} epi_refined_two_view_f64;

// What the rays of views determine.
typedef struct epi_triangulated_point_f64 {
    // By the verdict a point, a unit direction, or zeros.
    double point[3];
    // One of `epi_triangulation_verdict`.
    uint32_t verdict;
    // The first view that the point lies behind.
    uint32_t view;
    // How many views it lies behind.
    uint32_t behind;
} epi_triangulated_point_f64;

// A point of least reprojection error.
typedef struct epi_refined_point_f64 {
    // In the world.
    double point[3];
    // Sum of the squared reprojection errors.
    double cost_px_sq;
    // Of the point for a noise of 1 px, 3x3 by rows; zeros without.
    double covariance_per_px_sq[3][3];
    // 1 where there is a covariance, 0 where a direction is open.
    uint32_t has_covariance;
    // 1 where the iteration converged.
    uint32_t converged;
    // Evaluations of all residuals.
    uint32_t evaluations;
} epi_refined_point_f64;

// Options of `epi_window_optimise` and of what refines a part of a window.
typedef struct epi_bundle_options_f64 {
    // Of this struct, in bytes.
    uint32_t size;
    // Of an observation's distance in standard deviations: one of `epi_loss`.
    uint32_t loss;
    // Which unknowns move: one of `epi_unknowns`.
    uint32_t unknowns;
    // Iterations at the most, rejected steps included.
    uint32_t max_iterations;
    // Evaluations of observations at the most, three to an observation and iteration.
    uint32_t max_evaluations;
    // Scale of the loss, standard deviations.
    double loss_scale;
    // Converged where an iteration lowers the cost by less than this share.
    double cost_tolerance;
    // Damping of the first iteration, relative to the diagonal.
    double initial_damping;
    // An observation further off than this many standard deviations is reported as an outlier.
    double outlier_sigma;
} epi_bundle_options_f64;

// What a window knows of a frame: covariances by rows.
typedef struct epi_frame_covariance_f64 {
    // Of the pose: rotation (rad), then translation, of `R <- Exp(w) R`, `t <- t + dt`.
    double pose[6][6];
    // Of the camera's centre in the world.
    double centre[3][3];
    // Of the motion in the camera's own frame: rotation (rad), then the translation v of `centre <- centre - R' v`.
    double motion[6][6];
} epi_frame_covariance_f64;

// What an optimisation did.
typedef struct epi_bundle_report_f64 {
    // Why it ended: one of `epi_termination`.
    uint32_t termination;
    // 1 if any frame or point has moved.
    uint32_t changed;
    // Iterations, rejected steps included.
    uint32_t iterations;
    // Evaluations of observations.
    uint32_t evaluations;
    // Observations that counted.
    uint32_t observations;
    // Of them, outliers afterwards. More than half: the result is not to be trusted.
    uint32_t outliers;
    // Observations that did not count, the point being out of the camera's view.
    uint32_t behind;
    // Free points that did not move, seen fewer than twice.
    uint32_t unused_points;
    // `1/2 sum rho` of observations, priors and distances before.
    double cost_before;
    // The same after; never larger.
    double cost_after;
} epi_bundle_report_f64;

// How well the observations of one point agree with it.
typedef struct epi_point_report_f64 {
    // Observations.
    uint32_t observations;
    // Of them, outliers.
    uint32_t outliers;
    // Of them, where the camera does not see the point.
    uint32_t behind;
    // Root mean square of the distances, in standard deviations, of those that see it.
    double rms_sigma;
} epi_point_report_f64;

// Every code, in falling order.
#define epi_status_ALL { epi_status_Ok, epi_status_NullPointer, epi_status_Misaligned, epi_status_Overlap, epi_status_TooLarge, epi_status_Capacity, epi_status_Workspace, epi_status_StructSize, epi_status_UnknownEnum, epi_status_TooFew, epi_status_NotFinite, epi_status_Camera, epi_status_Rotation, epi_status_MaxError, epi_status_Sigma, epi_status_Confidence, epi_status_NoIterations, epi_status_Gravity, epi_status_NotVisible, epi_status_Unobservable, epi_status_NotAWindow, epi_status_FramesFull, epi_status_PointsFull, epi_status_ObservationsFull, epi_status_StaleFrame, epi_status_StalePoint, epi_status_DuplicateObservation, epi_status_NoSuchObservation, epi_status_NotPositive, epi_status_NotPositiveSemidefinite, epi_status_SameFrame, epi_status_ContradictoryFixedFrames, epi_status_NoPriorMemory, epi_status_BadOption, epi_status_NothingFree, epi_status_NoObservations, epi_status_NoUsablePoint, epi_status_UnconstrainedFrame, epi_status_Prior, epi_status_Start, epi_status_Other, }

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

// The pixel of one point with its Jacobian by the point: 2x3 by rows. Answers 1, or 0 where the camera does not see it.
int32_t epi_camera_project_with_jacobian_f32(const struct epi_camera_f32 *camera,
                                             const float *point,
                                             float *pixel,
                                             float *jacobian);

// The unit bearing of one pixel with its Jacobian by the pixel, rad/px: 3x2 by rows. Answers 1, or 0 where the lens has
// none.
int32_t epi_camera_unproject_with_jacobian_f32(const struct epi_camera_f32 *camera,
                                               const float *pixel,
                                               float *bearing,
                                               float *jacobian);

// Fills the options of `epi_relative_pose` with their defaults. `size`: `sizeof` of the struct.
int32_t epi_relative_pose_options_default_f32(struct epi_relative_pose_options_f32 *options, size_t size);

// Bytes of the workspace of `epi_relative_pose` for `count` correspondences; 0 where no memory is that large. `wide`: not 0
// if a camera is a fisheye.
size_t epi_relative_pose_workspace_size_f32(size_t count,
                                            uint32_t wide);

// The pose of view 2 in the frame of view 1 from pixel correspondences, many of which may be wrong, or why there is
// none: `X2 = R X1 + t`, |t| = 1.
//
// `x1`, `x2`: `count >= 5` times u v.
// `workspace`: of the size that `epi_relative_pose_workspace_size` tells. `estimate_size`: `sizeof` of the struct. `inliers`:
// `count` times 1 or 0, the mask of the verdict's model. Answers how many poses there are.
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

// Fills the options of `epi_homography` with their defaults. `size`: `sizeof` of the struct.
int32_t epi_homography_options_default_f32(struct epi_homography_options_f32 *options, size_t size);

// Bytes of the workspace of `epi_homography` for `count` correspondences; 0 where no memory is that large.
size_t epi_homography_workspace_size_f32(size_t count);

// The homography `x2 ~ H x1` of pixel correspondences, many of which may be wrong, or why there is none.
//
// `x1`, `x2`: `count >= 4` times u v.
// `workspace`: of the size that `epi_homography_workspace_size` tells. `estimate_size`: `sizeof` of the struct. `inliers`:
// `count` times 1 or 0, the mask of the verdict's model. Answers 1 where there is one, else 0.
int32_t epi_homography_f32(const float *x1,
                           const float *x2,
                           size_t count,
                           const struct epi_homography_options_f32 *options,
                           void *workspace,
                           size_t workspace_size,
                           struct epi_homography_estimate_f32 *estimate,
                           size_t estimate_size,
                           uint8_t *inliers);

// `epi_homography` with match scores, or with a caller's "may I go on?".
//
// `scores`: null, or `count` numbers, lower is better, by which samples are drawn best first. `keep_going`: null, or
// asked before every eighth iteration.
int32_t epi_homography_guided_f32(const float *x1,
                                  const float *x2,
                                  const float *scores,
                                  size_t count,
                                  const struct epi_homography_options_f32 *options,
                                  epi_keep_going keep_going,
                                  void *context,
                                  void *workspace,
                                  size_t workspace_size,
                                  struct epi_homography_estimate_f32 *estimate,
                                  size_t estimate_size,
                                  uint8_t *inliers);

// Fills the options of `epi_fundamental` with their defaults. `size`: `sizeof` of the struct.
int32_t epi_fundamental_options_default_f32(struct epi_fundamental_options_f32 *options, size_t size);

// Bytes of the workspace of `epi_fundamental` for `count` correspondences; 0 where no memory is that large.
size_t epi_fundamental_workspace_size_f32(size_t count);

// The fundamental matrix `x2' F x1 = 0` of pixel correspondences, many of which may be wrong, or why there is none.
//
// `x1`, `x2`: `count >= 7` times u v.
// `workspace`: of the size that `epi_fundamental_workspace_size` tells. `estimate_size`: `sizeof` of the struct. `inliers`:
// `count` times 1 or 0, the mask of the verdict's model. Answers 1 where there is one, else 0.
int32_t epi_fundamental_f32(const float *x1,
                            const float *x2,
                            size_t count,
                            const struct epi_fundamental_options_f32 *options,
                            void *workspace,
                            size_t workspace_size,
                            struct epi_fundamental_estimate_f32 *estimate,
                            size_t estimate_size,
                            uint8_t *inliers);

// `epi_fundamental` with match scores, or with a caller's "may I go on?".
//
// `scores`: null, or `count` numbers, lower is better, by which samples are drawn best first. `keep_going`: null, or
// asked before every eighth iteration.
int32_t epi_fundamental_guided_f32(const float *x1,
                                   const float *x2,
                                   const float *scores,
                                   size_t count,
                                   const struct epi_fundamental_options_f32 *options,
                                   epi_keep_going keep_going,
                                   void *context,
                                   void *workspace,
                                   size_t workspace_size,
                                   struct epi_fundamental_estimate_f32 *estimate,
                                   size_t estimate_size,
                                   uint8_t *inliers);

// Fills the options of `epi_absolute_pose` with their defaults. `size`: `sizeof` of the struct.
int32_t epi_absolute_pose_options_default_f32(struct epi_absolute_pose_options_f32 *options, size_t size);

// Bytes of the workspace of `epi_absolute_pose` for `count` correspondences; 0 where no memory is that large. `wide`: not 0
// if a camera is a fisheye.
size_t epi_absolute_pose_workspace_size_f32(size_t count,
                                            uint32_t wide);

// The pose of a camera, world to camera, from pixels of known points, many of which may be wrong, or why there is
// none: `x ~ project(R X + t)`.
//
// `pixels`: `count >= 4` times u v. `points`: `count` times x y z.
// `workspace`: of the size that `epi_absolute_pose_workspace_size` tells. `estimate_size`: `sizeof` of the struct. `inliers`:
// `count` times 1 or 0, the mask of the verdict's model. Answers how many poses there are.
int32_t epi_absolute_pose_f32(const struct epi_camera_f32 *camera,
                              const float *pixels,
                              const float *points,
                              size_t count,
                              const struct epi_absolute_pose_options_f32 *options,
                              void *workspace,
                              size_t workspace_size,
                              struct epi_absolute_pose_estimate_f32 *estimate,
                              size_t estimate_size,
                              uint8_t *inliers);

// `epi_absolute_pose` with match scores, or with a caller's "may I go on?".
//
// `scores`: null, or `count` numbers, lower is better, by which samples are drawn best first. `keep_going`: null, or
// asked before every eighth iteration.
int32_t epi_absolute_pose_guided_f32(const struct epi_camera_f32 *camera,
                                     const float *pixels,
                                     const float *points,
                                     const float *scores,
                                     size_t count,
                                     const struct epi_absolute_pose_options_f32 *options,
                                     epi_keep_going keep_going,
                                     void *context,
                                     void *workspace,
                                     size_t workspace_size,
                                     struct epi_absolute_pose_estimate_f32 *estimate,
                                     size_t estimate_size,
                                     uint8_t *inliers);

// A relative pose refined on all correspondences that agree with it, and its covariance.
//
// `x1`, `x2`: `count >= 5` times u v. `start`: of view 2 in the frame of view 1. `workspace`: of the size that
// `epi_relative_pose_workspace_size` tells. `refined_size`: `sizeof` of the struct. `inliers`: `count` times 1 or 0.
// Answers 1, or 0 where fewer than six agree or leave a direction open; then nothing is written but the mask.
int32_t epi_refine_relative_pose_f32(const struct epi_camera_f32 *camera1,
                                     const struct epi_camera_f32 *camera2,
                                     const float *x1,
                                     const float *x2,
                                     size_t count,
                                     const struct epi_pose_f32 *start,
                                     const struct epi_relative_pose_options_f32 *options,
                                     void *workspace,
                                     size_t workspace_size,
                                     struct epi_refined_relative_pose_f32 *refined,
                                     size_t refined_size,
                                     uint8_t *inliers);

// The pose of a rotation matrix, which is checked, and a translation.
int32_t epi_pose_from_matrix_f32(const float *matrix, const float *translation, struct epi_pose_f32 *pose);

// The rotation matrix and the translation of a pose.
int32_t epi_pose_matrix_f32(const struct epi_pose_f32 *pose, float *matrix, float *translation);

// The pose of the second camera in the frame of the first, from two poses world to camera.
int32_t epi_pose_relative_f32(const struct epi_pose_f32 *first,
                              const struct epi_pose_f32 *second,
                              struct epi_pose_f32 *relative);

// The camera's centre in the world, `-R' t`.
int32_t epi_pose_centre_f32(const struct epi_pose_f32 *pose, float *centre);

// The pose moved by `delta`, a rotation vector w (rad) and dt: `R <- Exp(w) R`, `t <- t + dt`, the chart of covariances.
int32_t epi_pose_retract_f32(const struct epi_pose_f32 *pose,
                             const float *delta,
                             struct epi_pose_f32 *moved);

// The rotation of a rotation vector, rad.
int32_t epi_rotation_exp_f32(const float *vector, float *quaternion);

// The rotation vector of a rotation, of length in [0, pi].
int32_t epi_rotation_log_f32(const float *quaternion, float *vector);

// The rotation nearest to a matrix. Answers 1, or 0 where more than one is as near.
int32_t epi_nearest_rotation_f32(const float *matrix, float *nearest);

// The turn that takes a direction of gravity to +y, for the upright solvers. Answers 1, or 0 for no direction.
int32_t epi_upright_f32(const float *gravity,
                        float *matrix);

// The two tangents of a unit vector in which covariances of directions are given: 3x2 by rows.
int32_t epi_tangent_basis_f32(const float *unit, float *basis);

// `E = [t]x R`.
int32_t epi_essential_from_pose_f32(const struct epi_pose_f32 *pose, float *essential);

// `E = K2' F K1`.
int32_t epi_essential_from_fundamental_f32(const float *fundamental,
                                           const float *k1,
                                           const float *k2,
                                           float *essential);

// `F = K2^-T E K1^-1`. Answers 1, or 0 where a calibration matrix is singular.
int32_t epi_essential_to_fundamental_f32(const float *essential,
                                         const float *k1,
                                         const float *k2,
                                         float *fundamental);

// The essential matrix nearest to a matrix. Answers 1, or 0 where none is.
int32_t epi_essential_nearest_f32(const float *matrix, float *nearest);

// The four poses of an essential matrix, |t| = 1, in the order (R1, t), (R1, -t), (R2, t), (R2, -t).
//
// `poses`: `capacity >= EPI_ESSENTIAL_POSES_MAX`. Answers 4, or 0 for a matrix without.
int32_t epi_essential_poses_f32(const float *essential, struct epi_pose_f32 *poses, size_t capacity);

// The pose of an essential matrix that has the most points in front of both cameras.
//
// `x1`, `x2`: `count` times x y z. `in_front`: how many points, then how many of the second best pose: as many, and the
// points do not tell the poses apart. Answers 1, or 0 for a matrix without poses.
int32_t epi_essential_pose_by_cheirality_f32(const float *essential,
                                             const float *x1,
                                             const float *x2,
                                             size_t count,
                                             struct epi_pose_f32 *pose,
                                             uint32_t *in_front);

// The matrix of rank 2 nearest to a matrix. Answers 1, or 0 where none is.
int32_t epi_fundamental_nearest_f32(const float *matrix, float *nearest);

// The epipoles of both views, `F e1 = 0` and `F' e2 = 0`, unit vectors. Answers 1, or 0 where they are not determined.
int32_t epi_fundamental_epipoles_f32(const float *fundamental,
                                     float *epipole1,
                                     float *epipole2);

// The motions and planes of a homography between normalised points, `H ~ R + t n' / d`: poses with t / d, unit normals.
//
// `poses`, `normals`: `capacity >= EPI_HOMOGRAPHY_MOTIONS_MAX`. Answers how many.
int32_t epi_homography_motions_f32(const float *homography,
                                   struct epi_pose_f32 *poses,
                                   float *normals,
                                   size_t capacity);

// Those of the motions that have the most of the points `x1` in front of the camera, `count` times x y z.
//
// `poses`, `normals`: `capacity >= EPI_HOMOGRAPHY_MOTIONS_MAX`. Answers how many.
int32_t epi_homography_visible_motions_f32(const float *homography,
                                           const float *x1,
                                           size_t count,
                                           struct epi_pose_f32 *poses,
                                           float *normals,
                                           size_t capacity);

// `K2 H K1^-1`, between pixels. Answers 1, or 0 where K1 is singular.
int32_t epi_homography_to_pixels_f32(const float *homography,
                                     const float *k1,
                                     const float *k2,
                                     float *pixels);

// `K2^-1 H K1`, between normalised points. Answers 1, or 0 where K2 is singular.
int32_t epi_homography_to_normalised_f32(const float *homography,
                                         const float *k1,
                                         const float *k2,
                                         float *normalised);

// The homography from view 2 to view 1. Answers 1, or 0 where H is singular.
int32_t epi_homography_inverse_f32(const float *homography, float *inverse);

// Points of view 1 in view 2.
//
// `x1`, `x2`: `count` times u v; zeros in x2 where the homography takes a point to infinity. `valid`: `count` times 1 or
// 0. Answers how many are valid.
int32_t epi_homography_transfer_f32(const float *homography,
                                    const float *x1,
                                    size_t count,
                                    float *x2,
                                    uint8_t *valid);

// Which points lie in front of both cameras.
//
// `pose`: of view 2 in the frame of view 1. `x1`, `x2`: `count` times x y z. `in_front`: `count` times 1 or 0. Answers
// how many do.
int32_t epi_in_front_of_both_f32(const struct epi_pose_f32 *pose,
                                 const float *x1,
                                 const float *x2,
                                 size_t count,
                                 uint8_t *in_front);

// Fills the options of `epi_refine_absolute_pose` with their defaults. `size`: `sizeof` of the struct.
int32_t epi_refine_absolute_pose_options_default_f32(struct epi_refine_absolute_pose_options_f32 *options,
                                                     size_t size);

// The pose, world to camera, of least robust reprojection error in the distorted image, from a start.
//
// `pixels`: `count` times u v, at least 3, with a prior any number. `points`: `count` times x y z. `refined_size`:
// `sizeof` of the struct. Answers 1.
int32_t epi_refine_absolute_pose_f32(const struct epi_camera_f32 *camera,
                                     const float *pixels,
                                     const float *points,
                                     size_t count,
                                     const struct epi_pose_f32 *start,
                                     const struct epi_refine_absolute_pose_options_f32 *options,
                                     struct epi_refined_absolute_pose_f32 *refined,
                                     size_t refined_size);

// Fills the options of `epi_refine_homography` and `epi_refine_fundamental` with their defaults. `size`: `sizeof` of the
// struct.
int32_t epi_refine_two_view_options_default_f32(struct epi_refine_two_view_options_f32 *options,
                                                size_t size);

// The homography `x2 ~ H x1` of least robust error near a start.
//
// `x1`, `x2`: `count >= 4` times u v. `start`: 3x3 by rows. `refined_size`: `sizeof` of the struct. Answers 1, or 0 where
// the start is singular.
int32_t epi_refine_homography_f32(const float *x1,
                                  const float *x2,
                                  size_t count,
                                  const float *start,
                                  const struct epi_refine_two_view_options_f32 *options,
                                  struct epi_refined_two_view_f32 *refined,
                                  size_t refined_size);

// The fundamental matrix `x2' F x1 = 0` of rank 2 and of least robust Sampson error near a start.
//
// `x1`, `x2`: `count >= 7` times u v. `start`: 3x3 by rows. `refined_size`: `sizeof` of the struct. Answers 1, or 0 where
// no matrix of rank 2 is nearest to the start.
int32_t epi_refine_fundamental_f32(const float *x1,
                                   const float *x2,
                                   size_t count,
                                   const float *start,
                                   const struct epi_refine_two_view_options_f32 *options,
                                   struct epi_refined_two_view_f32 *refined,
                                   size_t refined_size);

// After `EPI_STATUS_NOT_FINITE`: which number of an array it is.
//
// `numbers`: `count` of them. `index`: of the first that is NaN or infinite; divided by the numbers a point, that of the
// point. Answers 1, or 0 where all are finite; then nothing is written.
int32_t epi_find_not_finite_f32(const float *numbers,
                                size_t count,
                                uint32_t *index);

// Sampson errors, signed: `x2' M x1` over the length of its gradient, in the unit of the points.
//
// `matrix`: E of normalised points or F of pixels, by rows. `x1`, `x2`: `count` times x y. `errors`, `valid`: `count`.
// Answers how many exist.
int32_t epi_sampson_f32(const float *matrix,
                        const float *x1,
                        const float *x2,
                        size_t count,
                        float *errors,
                        uint8_t *valid);

// Sums of the squared distances of both points from their epipolar lines.
//
// `matrix`: E of normalised points or F of pixels, by rows. `x1`, `x2`: `count` times x y. `errors_sq`, `valid`: `count`.
// Answers how many exist.
int32_t epi_symmetric_epipolar_sq_f32(const float *matrix,
                                      const float *x1,
                                      const float *x2,
                                      size_t count,
                                      float *errors_sq,
                                      uint8_t *valid);

// Transfer errors of a homography, `H x1 - x2`.
//
// `homography`: by rows. `x1`, `x2`: `count` times u v. `errors`: `count` times u v. `valid`: `count`. Answers how many
// exist.
int32_t epi_transfer_f32(const float *homography,
                         const float *x1,
                         const float *x2,
                         size_t count,
                         float *errors,
                         uint8_t *valid);

// Sums of the squared transfer errors of both directions.
//
// `homography`, `inverse` (see `epi_homography_inverse`): by rows. `x1`, `x2`: `count` times u v. `errors_sq`, `valid`:
// `count`. Answers how many exist.
int32_t epi_symmetric_transfer_sq_f32(const float *homography,
                                      const float *inverse,
                                      const float *x1,
                                      const float *x2,
                                      size_t count,
                                      float *errors_sq,
                                      uint8_t *valid);

// Reprojection errors, projected minus measured, px.
//
// `pose`: world to camera. `points`: `count` times x y z. `pixels`: `count` times u v. `errors`: `count` times u v.
// `valid`: `count`. Answers how many exist.
int32_t epi_reprojection_f32(const struct epi_camera_f32 *camera,
                             const struct epi_pose_f32 *pose,
                             const float *points,
                             const float *pixels,
                             size_t count,
                             float *errors,
                             uint8_t *valid);

// `epi_reprojection` of one point with its Jacobians.
//
// `error`: u v. `by_pose`: 2x6 by rows, by the w and dt of `R <- Exp(w) R`, `t <- t + dt`. `by_point`: 2x3 by rows.
// Answers 1, or 0 where the camera does not see the point.
int32_t epi_reprojection_with_jacobians_f32(const struct epi_camera_f32 *camera,
                                            const struct epi_pose_f32 *pose,
                                            const float *point,
                                            const float *pixel,
                                            float *error,
                                            float *by_pose,
                                            float *by_point);

// Essential matrices of five bearing pairs, `x2' E x1 = 0`.
//
// `x1`, `x2`: 5 times x y z. `essentials`: `capacity >= EPI_RELPOSE_5PT_MAX` matrices by rows, |E| = 1. Answers how many.
int32_t epi_relpose_5pt_f32(const float *x1,
                            const float *x2,
                            float *essentials,
                            size_t capacity);

// Poses of view 2 in the frame of view 1 of five bearing pairs, all five points in front of both cameras, |t| = 1.
//
// `x1`, `x2`: 5 times x y z. `poses`: `capacity >= EPI_RELPOSE_5PT_MAX`. Answers how many.
int32_t epi_relpose_5pt_poses_f32(const float *x1,
                                  const float *x2,
                                  struct epi_pose_f32 *poses,
                                  size_t capacity);

// Fundamental matrices of seven correspondences, `x2' F x1 = 0`.
//
// `x1`, `x2`: 7 times x y z. `fundamentals`: `capacity >= EPI_RELPOSE_7PT_MAX` matrices by rows, |F| = 1. Answers how
// many.
int32_t epi_relpose_7pt_f32(const float *x1,
                            const float *x2,
                            float *fundamentals,
                            size_t capacity);

// The essential matrix of eight and more correspondences.
//
// `x1`, `x2`: `count >= 8` times x y z. `essential`: by rows. Answers 1, or 0 where none is determined.
int32_t epi_relpose_8pt_f32(const float *x1, const float *x2, size_t count, float *essential);

// The fundamental matrix of eight and more correspondences.
//
// `x1`, `x2`: `count >= 8` times x y z. `fundamental`: by rows. Answers 1, or 0 where none is determined.
int32_t epi_fundamental_8pt_f32(const float *x1, const float *x2, size_t count, float *fundamental);

// Poses of view 2 in the frame of view 1 of three bearing pairs, both frames turned until gravity is along +y, |t| = 1.
//
// `x1`, `x2`: 3 times x y z. `poses`: `capacity >= EPI_RELPOSE_UPRIGHT_3PT_MAX`. Answers how many.
int32_t epi_relpose_upright_3pt_f32(const float *x1,
                                    const float *x2,
                                    struct epi_pose_f32 *poses,
                                    size_t capacity);

// The homography of four correspondences, `x2 ~ H x1`.
//
// `x1`, `x2`: 4 times x y z. `homography`: by rows. Answers 1, or 0 where three points are on a line or change their sense.
int32_t epi_homography_4pt_f32(const float *x1,
                               const float *x2,
                               float *homography);

// The homography of four and more correspondences.
//
// `x1`, `x2`: `count >= 4` times x y z. `homography`: by rows. Answers 1, or 0 where none is determined.
int32_t epi_homography_npt_f32(const float *x1, const float *x2, size_t count, float *homography);

// Poses, world to camera, that show three points along three unit bearings.
//
// `bearings`, `points`: 3 times x y z. `poses`: `capacity >= EPI_P3P_MAX`. Answers how many.
int32_t epi_p3p_f32(const float *bearings, const float *points, struct epi_pose_f32 *poses, size_t capacity);

// Poses, world to camera, that show two points along two bearings, both frames turned until gravity is along +y.
//
// `bearings`, `points`: 2 times x y z. `poses`: `capacity >= EPI_ABSPOSE_UPRIGHT_2PT_MAX`. Answers how many.
int32_t epi_abspose_upright_2pt_f32(const float *bearings,
                                    const float *points,
                                    struct epi_pose_f32 *poses,
                                    size_t capacity);

// Poses, world to camera, of least error of four and more points, a plane of them included: the better first.
//
// `bearings`, `points`: `count >= 4` times x y z. `poses`: `capacity >= EPI_ABSPOSE_NPT_MAX`. Answers how many.
int32_t epi_abspose_npt_f32(const float *bearings,
                            const float *points,
                            size_t count,
                            struct epi_pose_f32 *poses,
                            size_t capacity);

// The one or two poses, target to camera, that show four and more points of the target's plane z = 0: the better first.
//
// `bearings`: `count >= 4` times x y z. `points`: `count` times x y. `poses`, `rms_rad` (of the angles):
// `capacity >= EPI_ABSPOSE_PLANAR_MAX`. Answers how many.
int32_t epi_abspose_planar_f32(const float *bearings,
                               const float *points,
                               size_t count,
                               struct epi_pose_f32 *poses,
                               float *rms_rad,
                               size_t capacity);

// The projection matrix `x ~ P (X, 1)` of six and more points.
//
// `pixels`: `count >= 6` times u v. `points`: `count` times x y z. `projection`: 3x4 by rows. Answers 1, or 0 where none
// is determined.
int32_t epi_resection_dlt_f32(const float *pixels,
                              const float *points,
                              size_t count,
                              float *projection);

// Calibration and pose of a projection matrix.
//
// `projection`: 3x4 by rows. `calibration`: 3x3 by rows, upper triangular, its last entry 1. Answers 1, or 0 for a matrix
// of no camera.
int32_t epi_decompose_projection_f32(const float *projection,
                                     float *calibration,
                                     struct epi_pose_f32 *pose);

// The rotation of two bearing pairs, `x2 ~ R x1`, best in the middle between them.
//
// `x1`, `x2`: 2 times x y z. `quaternion`: i j k w. Answers 1, or 0 where none is determined.
int32_t epi_rotation_2pt_f32(const float *x1, const float *x2, float *quaternion);

// The least-squares rotation of two and more bearing pairs.
//
// `x1`, `x2`: `count >= 2` times x y z. `quaternion`: i j k w. Answers 1, or 0 where none is determined.
int32_t epi_rotation_npt_f32(const float *x1, const float *x2, size_t count, float *quaternion);

// The unit translation of two bearing pairs, the rotation (i j k w) being known.
//
// `x1`, `x2`: 2 times x y z. `translation`: x y z. Answers 1, or 0 where none is determined.
int32_t epi_translation_2pt_f32(const float *quaternion,
                                const float *x1,
                                const float *x2,
                                float *translation);

// The least-squares unit translation of two and more bearing pairs, the rotation (i j k w) being known.
//
// `x1`, `x2`: `count >= 2` times x y z. `translation`: x y z. Answers 1, or 0 where none is determined.
int32_t epi_translation_npt_f32(const float *quaternion,
                                const float *x1,
                                const float *x2,
                                size_t count,
                                float *translation);

// The least-squares pose of three and more points, `b = R a + t`.
//
// `a`, `b`: `count >= 3` times x y z. Answers 1, or 0 where none is determined.
int32_t epi_absolute_orientation_npt_f32(const float *a,
                                         const float *b,
                                         size_t count,
                                         struct epi_pose_f32 *pose);

// The least-squares similarity of three and more points, `b = s R a + t`.
//
// `a`, `b`: `count >= 3` times x y z. `pose`: R and t. `scale`: s > 0. Answers 1, or 0 where none is determined.
int32_t epi_absolute_orientation_with_scale_npt_f32(const float *a,
                                                    const float *b,
                                                    size_t count,
                                                    struct epi_pose_f32 *pose,
                                                    float *scale);

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

// The point of two and more views from its bearings: algebraic error, a start for `epi_refine_point`.
//
// `poses`: 2 to `EPI_POINT_MAX_VIEWS`, world to camera. `bearings`: `count` times x y z. Answers 1 for the verdict
// `EPI_TRIANGULATION_VERDICT_POINT`, else 0.
int32_t epi_triangulate_dlt_f32(const struct epi_pose_f32 *poses,
                                const float *bearings,
                                size_t count,
                                struct epi_triangulated_point_f32 *point);

// The point of least reprojection error in two to `EPI_POINT_MAX_VIEWS` views, from a start.
//
// `cameras`, `poses` (world to camera): `count`. `pixels`: `count` times u v. `start`: x y z. Answers 1.
int32_t epi_refine_point_f32(const struct epi_camera_f32 *cameras,
                             const struct epi_pose_f32 *poses,
                             const float *pixels,
                             size_t count,
                             const float *start,
                             struct epi_refined_point_f32 *point);

// Angles between the rays of two views to points, rad.
//
// `pose`: of view 2 in the frame of view 1. `points`: `count` times x y z in the frame of view 1. `angles`: `count`.
int32_t epi_parallax_f32(const struct epi_pose_f32 *pose,
                         const float *points,
                         size_t count,
                         float *angles);

// The covariance of a point of two views whose bearings have the standard deviation `sigma_rad`: 3x3 by rows.
//
// `point`: x y z in the frame of view 1. Answers 1, or 0 where a direction is open.
int32_t epi_point_covariance_f32(const struct epi_pose_f32 *pose,
                                 const float *point,
                                 float sigma_rad,
                                 float *covariance);

// Bytes of the memory of a window for so many frames, points and observations; 0 where no memory is that large.
// `prior`: not 0 for a window that marginalises.
size_t epi_window_size_f32(size_t frames,
                           size_t points,
                           size_t observations,
                           uint32_t prior);

// An empty window in `size` bytes of memory, aligned to `EPI_WORKSPACE_ALIGN`; see `epi_window_size`. It is a part of the
// memory: nothing is to be freed.
int32_t epi_window_create_f32(void *memory,
                              size_t size,
                              size_t frames,
                              size_t points,
                              size_t observations,
                              uint32_t prior,
                              struct epi_window_f32 **window);

// Fills the options of `epi_window_optimise` with their defaults. `size`: `sizeof` of the struct.
int32_t epi_bundle_options_default_f32(struct epi_bundle_options_f32 *options, size_t size);

// Removes everything. Frames and points that were named are no longer.
int32_t epi_window_clear_f32(struct epi_window_f32 *window);

// Answers the number of frames in the window.
int32_t epi_window_frame_count_f32(struct epi_window_f32 *window);

// Answers the number of points in the window.
int32_t epi_window_point_count_f32(struct epi_window_f32 *window);

// Answers the number of observations in the window.
int32_t epi_window_observation_count_f32(struct epi_window_f32 *window);

// Answers the number of frames in the marginalisation prior.
int32_t epi_window_prior_frame_count_f32(struct epi_window_f32 *window);

// Adds a frame with its camera and its pose, world to camera. `frame`: its name.
int32_t epi_window_add_frame_f32(struct epi_window_f32 *window,
                                 const struct epi_camera_f32 *camera,
                                 const struct epi_pose_f32 *pose,
                                 uint32_t *frame);

// Removes a frame with its observations, its prior and its distances.
int32_t epi_window_remove_frame_f32(struct epi_window_f32 *window, uint32_t frame);

// Holds a frame where it is (`fixed` 1), or lets it go (0).
int32_t epi_window_fix_frame_f32(struct epi_window_f32 *window, uint32_t frame, uint32_t fixed);

// The pose of a frame, world to camera.
int32_t epi_window_pose_f32(struct epi_window_f32 *window, uint32_t frame, struct epi_pose_f32 *pose);

// Puts a frame at a pose.
int32_t epi_window_set_pose_f32(struct epi_window_f32 *window,
                                uint32_t frame,
                                const struct epi_pose_f32 *pose);

// Adds a point of the world, x y z. `point`: its name.
int32_t epi_window_add_point_f32(struct epi_window_f32 *window, const float *position, uint32_t *point);

// Removes a point with its observations.
int32_t epi_window_remove_point_f32(struct epi_window_f32 *window, uint32_t point);

// Holds a point where it is (`fixed` 1), or lets it go (0).
int32_t epi_window_fix_point_f32(struct epi_window_f32 *window, uint32_t point, uint32_t fixed);

// The position of a point in the world, x y z.
int32_t epi_window_position_f32(struct epi_window_f32 *window, uint32_t point, float *position);

// Puts a point at a position, x y z.
int32_t epi_window_set_position_f32(struct epi_window_f32 *window, uint32_t point, const float *position);

// Adds the observation of a point by a frame at a pixel u v, each coordinate with the standard deviation `sigma_px`. A frame
// observes a point once at the most.
int32_t epi_window_add_observation_f32(struct epi_window_f32 *window,
                                       uint32_t frame,
                                       uint32_t point,
                                       const float *pixel,
                                       float sigma_px);

// Removes one observation; frame and point stay.
int32_t epi_window_remove_observation_f32(struct epi_window_f32 *window, uint32_t frame, uint32_t point);

// The names of the frames. `frames`: `capacity`, no fewer than `epi_window_frame_count`. Answers how many.
int32_t epi_window_frames_f32(struct epi_window_f32 *window, uint32_t *frames, size_t capacity);

// The names of the points. `points`: `capacity`, no fewer than `epi_window_point_count`. Answers how many.
int32_t epi_window_points_f32(struct epi_window_f32 *window, uint32_t *points, size_t capacity);

// The observations of a point: frames, and pixels u v. `frames`, `pixels`: `capacity`, no fewer than the observations.
// Answers how many.
int32_t epi_window_observations_of_f32(struct epi_window_f32 *window,
                                       uint32_t point,
                                       uint32_t *frames,
                                       float *pixels,
                                       size_t capacity);

// Sets what is known of a frame's camera centre in the world, x y z, with the standard deviation of each coordinate. A frame
// has one prior at the most.
int32_t epi_window_set_position_prior_f32(struct epi_window_f32 *window,
                                          uint32_t frame,
                                          const float *centre,
                                          float sigma);

// Sets what is known of a frame's rotation, i j k w, with the standard deviation about each axis, rad.
int32_t epi_window_set_rotation_prior_f32(struct epi_window_f32 *window,
                                          uint32_t frame,
                                          const float *quaternion,
                                          float sigma_rad);

// Sets what is known of a frame's pose. `information`: the inverse covariance, rotation then translation, 6x6 by rows.
int32_t epi_window_set_pose_prior_f32(struct epi_window_f32 *window,
                                      uint32_t frame,
                                      const struct epi_pose_f32 *pose,
                                      const float *information);

// Removes the prior of a frame.
int32_t epi_window_remove_pose_prior_f32(struct epi_window_f32 *window, uint32_t frame);

// Sets a known distance between the centres of two frames with its standard deviation: what gives a window of one camera its
// scale. A frame `a` has one at the most.
int32_t epi_window_set_distance_f32(struct epi_window_f32 *window,
                                    uint32_t a,
                                    uint32_t b,
                                    float distance,
                                    float sigma);

// Removes the distance set from a frame to another.
int32_t epi_window_remove_distance_f32(struct epi_window_f32 *window, uint32_t a);

// Takes a frame out and leaves what it said as a prior on the others. `loss`: one of `epi_loss`. Answers how many points went
// with it.
int32_t epi_window_marginalise_frame_f32(struct epi_window_f32 *window,
                                         uint32_t frame,
                                         uint32_t loss,
                                         float loss_scale);

// Takes a point out and leaves what its observations said about the frames. `loss`: one of `epi_loss`.
int32_t epi_window_marginalise_point_f32(struct epi_window_f32 *window,
                                         uint32_t point,
                                         uint32_t loss,
                                         float loss_scale);

// Forgets the marginalisation prior.
int32_t epi_window_clear_prior_f32(struct epi_window_f32 *window);

// The covariances of a frame, all other frames and points being unknown too. `loss`: one of `epi_loss`.
int32_t epi_window_frame_covariance_f32(struct epi_window_f32 *window,
                                        uint32_t frame,
                                        uint32_t loss,
                                        float loss_scale,
                                        struct epi_frame_covariance_f32 *covariance);

// The covariance of a point, all frames and other points being unknown too: 3x3 by rows. `loss`: one of `epi_loss`.
int32_t epi_window_point_covariance_f32(struct epi_window_f32 *window,
                                        uint32_t point,
                                        uint32_t loss,
                                        float loss_scale,
                                        float *covariance);

// Moves frames and points to the least cost. `keep_going`: null, or asked before every iteration. `report_size`: `sizeof` of
// the struct.
int32_t epi_window_optimise_f32(struct epi_window_f32 *window,
                                const struct epi_bundle_options_f32 *options,
                                epi_keep_going keep_going,
                                void *context,
                                struct epi_bundle_report_f32 *report,
                                size_t report_size);

// Moves one frame alone, all else held. `report_size`: `sizeof` of the struct.
int32_t epi_window_refine_frame_f32(struct epi_window_f32 *window,
                                    uint32_t frame,
                                    const struct epi_bundle_options_f32 *options,
                                    struct epi_bundle_report_f32 *report,
                                    size_t report_size);

// Moves one point alone, all frames held. `report_size`: `sizeof` of the struct.
int32_t epi_window_refine_point_f32(struct epi_window_f32 *window,
                                    uint32_t point,
                                    const struct epi_bundle_options_f32 *options,
                                    struct epi_bundle_report_f32 *report,
                                    size_t report_size);

// How well the observations of a point agree with it, `outlier_sigma` deviations being the limit. `report_size`: `sizeof` of
// the struct.
int32_t epi_window_point_report_f32(struct epi_window_f32 *window,
                                    uint32_t point,
                                    float outlier_sigma,
                                    struct epi_point_report_f32 *report,
                                    size_t report_size);

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

// The pixel of one point with its Jacobian by the point: 2x3 by rows. Answers 1, or 0 where the camera does not see it.
int32_t epi_camera_project_with_jacobian_f64(const struct epi_camera_f64 *camera,
                                             const double *point,
                                             double *pixel,
                                             double *jacobian);

// The unit bearing of one pixel with its Jacobian by the pixel, rad/px: 3x2 by rows. Answers 1, or 0 where the lens has
// none.
int32_t epi_camera_unproject_with_jacobian_f64(const struct epi_camera_f64 *camera,
                                               const double *pixel,
                                               double *bearing,
                                               double *jacobian);

// Fills the options of `epi_relative_pose` with their defaults. `size`: `sizeof` of the struct.
int32_t epi_relative_pose_options_default_f64(struct epi_relative_pose_options_f64 *options, size_t size);

// Bytes of the workspace of `epi_relative_pose` for `count` correspondences; 0 where no memory is that large. `wide`: not 0
// if a camera is a fisheye.
size_t epi_relative_pose_workspace_size_f64(size_t count,
                                            uint32_t wide);

// The pose of view 2 in the frame of view 1 from pixel correspondences, many of which may be wrong, or why there is
// none: `X2 = R X1 + t`, |t| = 1.
//
// `x1`, `x2`: `count >= 5` times u v.
// `workspace`: of the size that `epi_relative_pose_workspace_size` tells. `estimate_size`: `sizeof` of the struct. `inliers`:
// `count` times 1 or 0, the mask of the verdict's model. Answers how many poses there are.
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

// Fills the options of `epi_homography` with their defaults. `size`: `sizeof` of the struct.
int32_t epi_homography_options_default_f64(struct epi_homography_options_f64 *options, size_t size);

// Bytes of the workspace of `epi_homography` for `count` correspondences; 0 where no memory is that large.
size_t epi_homography_workspace_size_f64(size_t count);

// The homography `x2 ~ H x1` of pixel correspondences, many of which may be wrong, or why there is none.
//
// `x1`, `x2`: `count >= 4` times u v.
// `workspace`: of the size that `epi_homography_workspace_size` tells. `estimate_size`: `sizeof` of the struct. `inliers`:
// `count` times 1 or 0, the mask of the verdict's model. Answers 1 where there is one, else 0.
int32_t epi_homography_f64(const double *x1,
                           const double *x2,
                           size_t count,
                           const struct epi_homography_options_f64 *options,
                           void *workspace,
                           size_t workspace_size,
                           struct epi_homography_estimate_f64 *estimate,
                           size_t estimate_size,
                           uint8_t *inliers);

// `epi_homography` with match scores, or with a caller's "may I go on?".
//
// `scores`: null, or `count` numbers, lower is better, by which samples are drawn best first. `keep_going`: null, or
// asked before every eighth iteration.
int32_t epi_homography_guided_f64(const double *x1,
                                  const double *x2,
                                  const double *scores,
                                  size_t count,
                                  const struct epi_homography_options_f64 *options,
                                  epi_keep_going keep_going,
                                  void *context,
                                  void *workspace,
                                  size_t workspace_size,
                                  struct epi_homography_estimate_f64 *estimate,
                                  size_t estimate_size,
                                  uint8_t *inliers);

// Fills the options of `epi_fundamental` with their defaults. `size`: `sizeof` of the struct.
int32_t epi_fundamental_options_default_f64(struct epi_fundamental_options_f64 *options, size_t size);

// Bytes of the workspace of `epi_fundamental` for `count` correspondences; 0 where no memory is that large.
size_t epi_fundamental_workspace_size_f64(size_t count);

// The fundamental matrix `x2' F x1 = 0` of pixel correspondences, many of which may be wrong, or why there is none.
//
// `x1`, `x2`: `count >= 7` times u v.
// `workspace`: of the size that `epi_fundamental_workspace_size` tells. `estimate_size`: `sizeof` of the struct. `inliers`:
// `count` times 1 or 0, the mask of the verdict's model. Answers 1 where there is one, else 0.
int32_t epi_fundamental_f64(const double *x1,
                            const double *x2,
                            size_t count,
                            const struct epi_fundamental_options_f64 *options,
                            void *workspace,
                            size_t workspace_size,
                            struct epi_fundamental_estimate_f64 *estimate,
                            size_t estimate_size,
                            uint8_t *inliers);

// `epi_fundamental` with match scores, or with a caller's "may I go on?".
//
// `scores`: null, or `count` numbers, lower is better, by which samples are drawn best first. `keep_going`: null, or
// asked before every eighth iteration.
int32_t epi_fundamental_guided_f64(const double *x1,
                                   const double *x2,
                                   const double *scores,
                                   size_t count,
                                   const struct epi_fundamental_options_f64 *options,
                                   epi_keep_going keep_going,
                                   void *context,
                                   void *workspace,
                                   size_t workspace_size,
                                   struct epi_fundamental_estimate_f64 *estimate,
                                   size_t estimate_size,
                                   uint8_t *inliers);

// Fills the options of `epi_absolute_pose` with their defaults. `size`: `sizeof` of the struct.
int32_t epi_absolute_pose_options_default_f64(struct epi_absolute_pose_options_f64 *options, size_t size);

// Bytes of the workspace of `epi_absolute_pose` for `count` correspondences; 0 where no memory is that large. `wide`: not 0
// if a camera is a fisheye.
size_t epi_absolute_pose_workspace_size_f64(size_t count,
                                            uint32_t wide);

// The pose of a camera, world to camera, from pixels of known points, many of which may be wrong, or why there is
// none: `x ~ project(R X + t)`.
//
// `pixels`: `count >= 4` times u v. `points`: `count` times x y z.
// `workspace`: of the size that `epi_absolute_pose_workspace_size` tells. `estimate_size`: `sizeof` of the struct. `inliers`:
// `count` times 1 or 0, the mask of the verdict's model. Answers how many poses there are.
int32_t epi_absolute_pose_f64(const struct epi_camera_f64 *camera,
                              const double *pixels,
                              const double *points,
                              size_t count,
                              const struct epi_absolute_pose_options_f64 *options,
                              void *workspace,
                              size_t workspace_size,
                              struct epi_absolute_pose_estimate_f64 *estimate,
                              size_t estimate_size,
                              uint8_t *inliers);

// `epi_absolute_pose` with match scores, or with a caller's "may I go on?".
//
// `scores`: null, or `count` numbers, lower is better, by which samples are drawn best first. `keep_going`: null, or
// asked before every eighth iteration.
int32_t epi_absolute_pose_guided_f64(const struct epi_camera_f64 *camera,
                                     const double *pixels,
                                     const double *points,
                                     const double *scores,
                                     size_t count,
                                     const struct epi_absolute_pose_options_f64 *options,
                                     epi_keep_going keep_going,
                                     void *context,
                                     void *workspace,
                                     size_t workspace_size,
                                     struct epi_absolute_pose_estimate_f64 *estimate,
                                     size_t estimate_size,
                                     uint8_t *inliers);

// A relative pose refined on all correspondences that agree with it, and its covariance.
//
// `x1`, `x2`: `count >= 5` times u v. `start`: of view 2 in the frame of view 1. `workspace`: of the size that
// `epi_relative_pose_workspace_size` tells. `refined_size`: `sizeof` of the struct. `inliers`: `count` times 1 or 0.
// Answers 1, or 0 where fewer than six agree or leave a direction open; then nothing is written but the mask.
int32_t epi_refine_relative_pose_f64(const struct epi_camera_f64 *camera1,
                                     const struct epi_camera_f64 *camera2,
                                     const double *x1,
                                     const double *x2,
                                     size_t count,
                                     const struct epi_pose_f64 *start,
                                     const struct epi_relative_pose_options_f64 *options,
                                     void *workspace,
                                     size_t workspace_size,
                                     struct epi_refined_relative_pose_f64 *refined,
                                     size_t refined_size,
                                     uint8_t *inliers);

// The pose of a rotation matrix, which is checked, and a translation.
int32_t epi_pose_from_matrix_f64(const double *matrix, const double *translation, struct epi_pose_f64 *pose);

// The rotation matrix and the translation of a pose.
int32_t epi_pose_matrix_f64(const struct epi_pose_f64 *pose, double *matrix, double *translation);

// The pose of the second camera in the frame of the first, from two poses world to camera.
int32_t epi_pose_relative_f64(const struct epi_pose_f64 *first,
                              const struct epi_pose_f64 *second,
                              struct epi_pose_f64 *relative);

// The camera's centre in the world, `-R' t`.
int32_t epi_pose_centre_f64(const struct epi_pose_f64 *pose, double *centre);

// The pose moved by `delta`, a rotation vector w (rad) and dt: `R <- Exp(w) R`, `t <- t + dt`, the chart of covariances.
int32_t epi_pose_retract_f64(const struct epi_pose_f64 *pose,
                             const double *delta,
                             struct epi_pose_f64 *moved);

// The rotation of a rotation vector, rad.
int32_t epi_rotation_exp_f64(const double *vector, double *quaternion);

// The rotation vector of a rotation, of length in [0, pi].
int32_t epi_rotation_log_f64(const double *quaternion, double *vector);

// The rotation nearest to a matrix. Answers 1, or 0 where more than one is as near.
int32_t epi_nearest_rotation_f64(const double *matrix, double *nearest);

// The turn that takes a direction of gravity to +y, for the upright solvers. Answers 1, or 0 for no direction.
int32_t epi_upright_f64(const double *gravity,
                        double *matrix);

// The two tangents of a unit vector in which covariances of directions are given: 3x2 by rows.
int32_t epi_tangent_basis_f64(const double *unit, double *basis);

// `E = [t]x R`.
int32_t epi_essential_from_pose_f64(const struct epi_pose_f64 *pose, double *essential);

// `E = K2' F K1`.
int32_t epi_essential_from_fundamental_f64(const double *fundamental,
                                           const double *k1,
                                           const double *k2,
                                           double *essential);

// `F = K2^-T E K1^-1`. Answers 1, or 0 where a calibration matrix is singular.
int32_t epi_essential_to_fundamental_f64(const double *essential,
                                         const double *k1,
                                         const double *k2,
                                         double *fundamental);

// The essential matrix nearest to a matrix. Answers 1, or 0 where none is.
int32_t epi_essential_nearest_f64(const double *matrix, double *nearest);

// The four poses of an essential matrix, |t| = 1, in the order (R1, t), (R1, -t), (R2, t), (R2, -t).
//
// `poses`: `capacity >= EPI_ESSENTIAL_POSES_MAX`. Answers 4, or 0 for a matrix without.
int32_t epi_essential_poses_f64(const double *essential, struct epi_pose_f64 *poses, size_t capacity);

// The pose of an essential matrix that has the most points in front of both cameras.
//
// `x1`, `x2`: `count` times x y z. `in_front`: how many points, then how many of the second best pose: as many, and the
// points do not tell the poses apart. Answers 1, or 0 for a matrix without poses.
int32_t epi_essential_pose_by_cheirality_f64(const double *essential,
                                             const double *x1,
                                             const double *x2,
                                             size_t count,
                                             struct epi_pose_f64 *pose,
                                             uint32_t *in_front);

// The matrix of rank 2 nearest to a matrix. Answers 1, or 0 where none is.
int32_t epi_fundamental_nearest_f64(const double *matrix, double *nearest);

// The epipoles of both views, `F e1 = 0` and `F' e2 = 0`, unit vectors. Answers 1, or 0 where they are not determined.
int32_t epi_fundamental_epipoles_f64(const double *fundamental,
                                     double *epipole1,
                                     double *epipole2);

// The motions and planes of a homography between normalised points, `H ~ R + t n' / d`: poses with t / d, unit normals.
//
// `poses`, `normals`: `capacity >= EPI_HOMOGRAPHY_MOTIONS_MAX`. Answers how many.
int32_t epi_homography_motions_f64(const double *homography,
                                   struct epi_pose_f64 *poses,
                                   double *normals,
                                   size_t capacity);

// Those of the motions that have the most of the points `x1` in front of the camera, `count` times x y z.
//
// `poses`, `normals`: `capacity >= EPI_HOMOGRAPHY_MOTIONS_MAX`. Answers how many.
int32_t epi_homography_visible_motions_f64(const double *homography,
                                           const double *x1,
                                           size_t count,
                                           struct epi_pose_f64 *poses,
                                           double *normals,
                                           size_t capacity);

// `K2 H K1^-1`, between pixels. Answers 1, or 0 where K1 is singular.
int32_t epi_homography_to_pixels_f64(const double *homography,
                                     const double *k1,
                                     const double *k2,
                                     double *pixels);

// `K2^-1 H K1`, between normalised points. Answers 1, or 0 where K2 is singular.
int32_t epi_homography_to_normalised_f64(const double *homography,
                                         const double *k1,
                                         const double *k2,
                                         double *normalised);

// The homography from view 2 to view 1. Answers 1, or 0 where H is singular.
int32_t epi_homography_inverse_f64(const double *homography, double *inverse);

// Points of view 1 in view 2.
//
// `x1`, `x2`: `count` times u v; zeros in x2 where the homography takes a point to infinity. `valid`: `count` times 1 or
// 0. Answers how many are valid.
int32_t epi_homography_transfer_f64(const double *homography,
                                    const double *x1,
                                    size_t count,
                                    double *x2,
                                    uint8_t *valid);

// Which points lie in front of both cameras.
//
// `pose`: of view 2 in the frame of view 1. `x1`, `x2`: `count` times x y z. `in_front`: `count` times 1 or 0. Answers
// how many do.
int32_t epi_in_front_of_both_f64(const struct epi_pose_f64 *pose,
                                 const double *x1,
                                 const double *x2,
                                 size_t count,
                                 uint8_t *in_front);

// Fills the options of `epi_refine_absolute_pose` with their defaults. `size`: `sizeof` of the struct.
int32_t epi_refine_absolute_pose_options_default_f64(struct epi_refine_absolute_pose_options_f64 *options,
                                                     size_t size);

// The pose, world to camera, of least robust reprojection error in the distorted image, from a start.
//
// `pixels`: `count` times u v, at least 3, with a prior any number. `points`: `count` times x y z. `refined_size`:
// `sizeof` of the struct. Answers 1.
int32_t epi_refine_absolute_pose_f64(const struct epi_camera_f64 *camera,
                                     const double *pixels,
                                     const double *points,
                                     size_t count,
                                     const struct epi_pose_f64 *start,
                                     const struct epi_refine_absolute_pose_options_f64 *options,
                                     struct epi_refined_absolute_pose_f64 *refined,
                                     size_t refined_size);

// Fills the options of `epi_refine_homography` and `epi_refine_fundamental` with their defaults. `size`: `sizeof` of the
// struct.
int32_t epi_refine_two_view_options_default_f64(struct epi_refine_two_view_options_f64 *options,
                                                size_t size);

// The homography `x2 ~ H x1` of least robust error near a start.
//
// `x1`, `x2`: `count >= 4` times u v. `start`: 3x3 by rows. `refined_size`: `sizeof` of the struct. Answers 1, or 0 where
// the start is singular.
int32_t epi_refine_homography_f64(const double *x1,
                                  const double *x2,
                                  size_t count,
                                  const double *start,
                                  const struct epi_refine_two_view_options_f64 *options,
                                  struct epi_refined_two_view_f64 *refined,
                                  size_t refined_size);

// The fundamental matrix `x2' F x1 = 0` of rank 2 and of least robust Sampson error near a start.
//
// `x1`, `x2`: `count >= 7` times u v. `start`: 3x3 by rows. `refined_size`: `sizeof` of the struct. Answers 1, or 0 where
// no matrix of rank 2 is nearest to the start.
int32_t epi_refine_fundamental_f64(const double *x1,
                                   const double *x2,
                                   size_t count,
                                   const double *start,
                                   const struct epi_refine_two_view_options_f64 *options,
                                   struct epi_refined_two_view_f64 *refined,
                                   size_t refined_size);

// After `EPI_STATUS_NOT_FINITE`: which number of an array it is.
//
// `numbers`: `count` of them. `index`: of the first that is NaN or infinite; divided by the numbers a point, that of the
// point. Answers 1, or 0 where all are finite; then nothing is written.
int32_t epi_find_not_finite_f64(const double *numbers,
                                size_t count,
                                uint32_t *index);

// Sampson errors, signed: `x2' M x1` over the length of its gradient, in the unit of the points.
//
// `matrix`: E of normalised points or F of pixels, by rows. `x1`, `x2`: `count` times x y. `errors`, `valid`: `count`.
// Answers how many exist.
int32_t epi_sampson_f64(const double *matrix,
                        const double *x1,
                        const double *x2,
                        size_t count,
                        double *errors,
                        uint8_t *valid);

// Sums of the squared distances of both points from their epipolar lines.
//
// `matrix`: E of normalised points or F of pixels, by rows. `x1`, `x2`: `count` times x y. `errors_sq`, `valid`: `count`.
// Answers how many exist.
int32_t epi_symmetric_epipolar_sq_f64(const double *matrix,
                                      const double *x1,
                                      const double *x2,
                                      size_t count,
                                      double *errors_sq,
                                      uint8_t *valid);

// Transfer errors of a homography, `H x1 - x2`.
//
// `homography`: by rows. `x1`, `x2`: `count` times u v. `errors`: `count` times u v. `valid`: `count`. Answers how many
// exist.
int32_t epi_transfer_f64(const double *homography,
                         const double *x1,
                         const double *x2,
                         size_t count,
                         double *errors,
                         uint8_t *valid);

// Sums of the squared transfer errors of both directions.
//
// `homography`, `inverse` (see `epi_homography_inverse`): by rows. `x1`, `x2`: `count` times u v. `errors_sq`, `valid`:
// `count`. Answers how many exist.
int32_t epi_symmetric_transfer_sq_f64(const double *homography,
                                      const double *inverse,
                                      const double *x1,
                                      const double *x2,
                                      size_t count,
                                      double *errors_sq,
                                      uint8_t *valid);

// Reprojection errors, projected minus measured, px.
//
// `pose`: world to camera. `points`: `count` times x y z. `pixels`: `count` times u v. `errors`: `count` times u v.
// `valid`: `count`. Answers how many exist.
int32_t epi_reprojection_f64(const struct epi_camera_f64 *camera,
                             const struct epi_pose_f64 *pose,
                             const double *points,
                             const double *pixels,
                             size_t count,
                             double *errors,
                             uint8_t *valid);

// `epi_reprojection` of one point with its Jacobians.
//
// `error`: u v. `by_pose`: 2x6 by rows, by the w and dt of `R <- Exp(w) R`, `t <- t + dt`. `by_point`: 2x3 by rows.
// Answers 1, or 0 where the camera does not see the point.
int32_t epi_reprojection_with_jacobians_f64(const struct epi_camera_f64 *camera,
                                            const struct epi_pose_f64 *pose,
                                            const double *point,
                                            const double *pixel,
                                            double *error,
                                            double *by_pose,
                                            double *by_point);

// Essential matrices of five bearing pairs, `x2' E x1 = 0`.
//
// `x1`, `x2`: 5 times x y z. `essentials`: `capacity >= EPI_RELPOSE_5PT_MAX` matrices by rows, |E| = 1. Answers how many.
int32_t epi_relpose_5pt_f64(const double *x1,
                            const double *x2,
                            double *essentials,
                            size_t capacity);

// Poses of view 2 in the frame of view 1 of five bearing pairs, all five points in front of both cameras, |t| = 1.
//
// `x1`, `x2`: 5 times x y z. `poses`: `capacity >= EPI_RELPOSE_5PT_MAX`. Answers how many.
int32_t epi_relpose_5pt_poses_f64(const double *x1,
                                  const double *x2,
                                  struct epi_pose_f64 *poses,
                                  size_t capacity);

// Fundamental matrices of seven correspondences, `x2' F x1 = 0`.
//
// `x1`, `x2`: 7 times x y z. `fundamentals`: `capacity >= EPI_RELPOSE_7PT_MAX` matrices by rows, |F| = 1. Answers how
// many.
int32_t epi_relpose_7pt_f64(const double *x1,
                            const double *x2,
                            double *fundamentals,
                            size_t capacity);

// The essential matrix of eight and more correspondences.
//
// `x1`, `x2`: `count >= 8` times x y z. `essential`: by rows. Answers 1, or 0 where none is determined.
int32_t epi_relpose_8pt_f64(const double *x1, const double *x2, size_t count, double *essential);

// The fundamental matrix of eight and more correspondences.
//
// `x1`, `x2`: `count >= 8` times x y z. `fundamental`: by rows. Answers 1, or 0 where none is determined.
int32_t epi_fundamental_8pt_f64(const double *x1, const double *x2, size_t count, double *fundamental);

// Poses of view 2 in the frame of view 1 of three bearing pairs, both frames turned until gravity is along +y, |t| = 1.
//
// `x1`, `x2`: 3 times x y z. `poses`: `capacity >= EPI_RELPOSE_UPRIGHT_3PT_MAX`. Answers how many.
int32_t epi_relpose_upright_3pt_f64(const double *x1,
                                    const double *x2,
                                    struct epi_pose_f64 *poses,
                                    size_t capacity);

// The homography of four correspondences, `x2 ~ H x1`.
//
// `x1`, `x2`: 4 times x y z. `homography`: by rows. Answers 1, or 0 where three points are on a line or change their sense.
int32_t epi_homography_4pt_f64(const double *x1,
                               const double *x2,
                               double *homography);

// The homography of four and more correspondences.
//
// `x1`, `x2`: `count >= 4` times x y z. `homography`: by rows. Answers 1, or 0 where none is determined.
int32_t epi_homography_npt_f64(const double *x1, const double *x2, size_t count, double *homography);

// Poses, world to camera, that show three points along three unit bearings.
//
// `bearings`, `points`: 3 times x y z. `poses`: `capacity >= EPI_P3P_MAX`. Answers how many.
int32_t epi_p3p_f64(const double *bearings,
                    const double *points,
                    struct epi_pose_f64 *poses,
                    size_t capacity);

// Poses, world to camera, that show two points along two bearings, both frames turned until gravity is along +y.
//
// `bearings`, `points`: 2 times x y z. `poses`: `capacity >= EPI_ABSPOSE_UPRIGHT_2PT_MAX`. Answers how many.
int32_t epi_abspose_upright_2pt_f64(const double *bearings,
                                    const double *points,
                                    struct epi_pose_f64 *poses,
                                    size_t capacity);

// Poses, world to camera, of least error of four and more points, a plane of them included: the better first.
//
// `bearings`, `points`: `count >= 4` times x y z. `poses`: `capacity >= EPI_ABSPOSE_NPT_MAX`. Answers how many.
int32_t epi_abspose_npt_f64(const double *bearings,
                            const double *points,
                            size_t count,
                            struct epi_pose_f64 *poses,
                            size_t capacity);

// The one or two poses, target to camera, that show four and more points of the target's plane z = 0: the better first.
//
// `bearings`: `count >= 4` times x y z. `points`: `count` times x y. `poses`, `rms_rad` (of the angles):
// `capacity >= EPI_ABSPOSE_PLANAR_MAX`. Answers how many.
int32_t epi_abspose_planar_f64(const double *bearings,
                               const double *points,
                               size_t count,
                               struct epi_pose_f64 *poses,
                               double *rms_rad,
                               size_t capacity);

// The projection matrix `x ~ P (X, 1)` of six and more points.
//
// `pixels`: `count >= 6` times u v. `points`: `count` times x y z. `projection`: 3x4 by rows. Answers 1, or 0 where none
// is determined.
int32_t epi_resection_dlt_f64(const double *pixels,
                              const double *points,
                              size_t count,
                              double *projection);

// Calibration and pose of a projection matrix.
//
// `projection`: 3x4 by rows. `calibration`: 3x3 by rows, upper triangular, its last entry 1. Answers 1, or 0 for a matrix
// of no camera.
int32_t epi_decompose_projection_f64(const double *projection,
                                     double *calibration,
                                     struct epi_pose_f64 *pose);

// The rotation of two bearing pairs, `x2 ~ R x1`, best in the middle between them.
//
// `x1`, `x2`: 2 times x y z. `quaternion`: i j k w. Answers 1, or 0 where none is determined.
int32_t epi_rotation_2pt_f64(const double *x1, const double *x2, double *quaternion);

// The least-squares rotation of two and more bearing pairs.
//
// `x1`, `x2`: `count >= 2` times x y z. `quaternion`: i j k w. Answers 1, or 0 where none is determined.
int32_t epi_rotation_npt_f64(const double *x1, const double *x2, size_t count, double *quaternion);

// The unit translation of two bearing pairs, the rotation (i j k w) being known.
//
// `x1`, `x2`: 2 times x y z. `translation`: x y z. Answers 1, or 0 where none is determined.
int32_t epi_translation_2pt_f64(const double *quaternion,
                                const double *x1,
                                const double *x2,
                                double *translation);

// The least-squares unit translation of two and more bearing pairs, the rotation (i j k w) being known.
//
// `x1`, `x2`: `count >= 2` times x y z. `translation`: x y z. Answers 1, or 0 where none is determined.
int32_t epi_translation_npt_f64(const double *quaternion,
                                const double *x1,
                                const double *x2,
                                size_t count,
                                double *translation);

// The least-squares pose of three and more points, `b = R a + t`.
//
// `a`, `b`: `count >= 3` times x y z. Answers 1, or 0 where none is determined.
int32_t epi_absolute_orientation_npt_f64(const double *a,
                                         const double *b,
                                         size_t count,
                                         struct epi_pose_f64 *pose);

// The least-squares similarity of three and more points, `b = s R a + t`.
//
// `a`, `b`: `count >= 3` times x y z. `pose`: R and t. `scale`: s > 0. Answers 1, or 0 where none is determined.
int32_t epi_absolute_orientation_with_scale_npt_f64(const double *a,
                                                    const double *b,
                                                    size_t count,
                                                    struct epi_pose_f64 *pose,
                                                    double *scale);

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

// The point of two and more views from its bearings: algebraic error, a start for `epi_refine_point`.
//
// `poses`: 2 to `EPI_POINT_MAX_VIEWS`, world to camera. `bearings`: `count` times x y z. Answers 1 for the verdict
// `EPI_TRIANGULATION_VERDICT_POINT`, else 0.
int32_t epi_triangulate_dlt_f64(const struct epi_pose_f64 *poses,
                                const double *bearings,
                                size_t count,
                                struct epi_triangulated_point_f64 *point);

// The point of least reprojection error in two to `EPI_POINT_MAX_VIEWS` views, from a start.
//
// `cameras`, `poses` (world to camera): `count`. `pixels`: `count` times u v. `start`: x y z. Answers 1.
int32_t epi_refine_point_f64(const struct epi_camera_f64 *cameras,
                             const struct epi_pose_f64 *poses,
                             const double *pixels,
                             size_t count,
                             const double *start,
                             struct epi_refined_point_f64 *point);

// Angles between the rays of two views to points, rad.
//
// `pose`: of view 2 in the frame of view 1. `points`: `count` times x y z in the frame of view 1. `angles`: `count`.
int32_t epi_parallax_f64(const struct epi_pose_f64 *pose,
                         const double *points,
                         size_t count,
                         double *angles);

// The covariance of a point of two views whose bearings have the standard deviation `sigma_rad`: 3x3 by rows.
//
// `point`: x y z in the frame of view 1. Answers 1, or 0 where a direction is open.
int32_t epi_point_covariance_f64(const struct epi_pose_f64 *pose,
                                 const double *point,
                                 double sigma_rad,
                                 double *covariance);

// Bytes of the memory of a window for so many frames, points and observations; 0 where no memory is that large.
// `prior`: not 0 for a window that marginalises.
size_t epi_window_size_f64(size_t frames,
                           size_t points,
                           size_t observations,
                           uint32_t prior);

// An empty window in `size` bytes of memory, aligned to `EPI_WORKSPACE_ALIGN`; see `epi_window_size`. It is a part of the
// memory: nothing is to be freed.
int32_t epi_window_create_f64(void *memory,
                              size_t size,
                              size_t frames,
                              size_t points,
                              size_t observations,
                              uint32_t prior,
                              struct epi_window_f64 **window);

// Fills the options of `epi_window_optimise` with their defaults. `size`: `sizeof` of the struct.
int32_t epi_bundle_options_default_f64(struct epi_bundle_options_f64 *options, size_t size);

// Removes everything. Frames and points that were named are no longer.
int32_t epi_window_clear_f64(struct epi_window_f64 *window);

// Answers the number of frames in the window.
int32_t epi_window_frame_count_f64(struct epi_window_f64 *window);

// Answers the number of points in the window.
int32_t epi_window_point_count_f64(struct epi_window_f64 *window);

// Answers the number of observations in the window.
int32_t epi_window_observation_count_f64(struct epi_window_f64 *window);

// Answers the number of frames in the marginalisation prior.
int32_t epi_window_prior_frame_count_f64(struct epi_window_f64 *window);

// Adds a frame with its camera and its pose, world to camera. `frame`: its name.
int32_t epi_window_add_frame_f64(struct epi_window_f64 *window,
                                 const struct epi_camera_f64 *camera,
                                 const struct epi_pose_f64 *pose,
                                 uint32_t *frame);

// Removes a frame with its observations, its prior and its distances.
int32_t epi_window_remove_frame_f64(struct epi_window_f64 *window, uint32_t frame);

// Holds a frame where it is (`fixed` 1), or lets it go (0).
int32_t epi_window_fix_frame_f64(struct epi_window_f64 *window, uint32_t frame, uint32_t fixed);

// The pose of a frame, world to camera.
int32_t epi_window_pose_f64(struct epi_window_f64 *window, uint32_t frame, struct epi_pose_f64 *pose);

// Puts a frame at a pose.
int32_t epi_window_set_pose_f64(struct epi_window_f64 *window,
                                uint32_t frame,
                                const struct epi_pose_f64 *pose);

// Adds a point of the world, x y z. `point`: its name.
int32_t epi_window_add_point_f64(struct epi_window_f64 *window, const double *position, uint32_t *point);

// Removes a point with its observations.
int32_t epi_window_remove_point_f64(struct epi_window_f64 *window, uint32_t point);

// Holds a point where it is (`fixed` 1), or lets it go (0).
int32_t epi_window_fix_point_f64(struct epi_window_f64 *window, uint32_t point, uint32_t fixed);

// The position of a point in the world, x y z.
int32_t epi_window_position_f64(struct epi_window_f64 *window, uint32_t point, double *position);

// Puts a point at a position, x y z.
int32_t epi_window_set_position_f64(struct epi_window_f64 *window, uint32_t point, const double *position);

// Adds the observation of a point by a frame at a pixel u v, each coordinate with the standard deviation `sigma_px`. A frame
// observes a point once at the most.
int32_t epi_window_add_observation_f64(struct epi_window_f64 *window,
                                       uint32_t frame,
                                       uint32_t point,
                                       const double *pixel,
                                       double sigma_px);

// Removes one observation; frame and point stay.
int32_t epi_window_remove_observation_f64(struct epi_window_f64 *window, uint32_t frame, uint32_t point);

// The names of the frames. `frames`: `capacity`, no fewer than `epi_window_frame_count`. Answers how many.
int32_t epi_window_frames_f64(struct epi_window_f64 *window, uint32_t *frames, size_t capacity);

// The names of the points. `points`: `capacity`, no fewer than `epi_window_point_count`. Answers how many.
int32_t epi_window_points_f64(struct epi_window_f64 *window, uint32_t *points, size_t capacity);

// The observations of a point: frames, and pixels u v. `frames`, `pixels`: `capacity`, no fewer than the observations.
// Answers how many.
int32_t epi_window_observations_of_f64(struct epi_window_f64 *window,
                                       uint32_t point,
                                       uint32_t *frames,
                                       double *pixels,
                                       size_t capacity);

// Sets what is known of a frame's camera centre in the world, x y z, with the standard deviation of each coordinate. A frame
// has one prior at the most.
int32_t epi_window_set_position_prior_f64(struct epi_window_f64 *window,
                                          uint32_t frame,
                                          const double *centre,
                                          double sigma);

// Sets what is known of a frame's rotation, i j k w, with the standard deviation about each axis, rad.
int32_t epi_window_set_rotation_prior_f64(struct epi_window_f64 *window,
                                          uint32_t frame,
                                          const double *quaternion,
                                          double sigma_rad);

// Sets what is known of a frame's pose. `information`: the inverse covariance, rotation then translation, 6x6 by rows.
int32_t epi_window_set_pose_prior_f64(struct epi_window_f64 *window,
                                      uint32_t frame,
                                      const struct epi_pose_f64 *pose,
                                      const double *information);

// Removes the prior of a frame.
int32_t epi_window_remove_pose_prior_f64(struct epi_window_f64 *window, uint32_t frame);

// Sets a known distance between the centres of two frames with its standard deviation: what gives a window of one camera its
// scale. A frame `a` has one at the most.
int32_t epi_window_set_distance_f64(struct epi_window_f64 *window,
                                    uint32_t a,
                                    uint32_t b,
                                    double distance,
                                    double sigma);

// Removes the distance set from a frame to another.
int32_t epi_window_remove_distance_f64(struct epi_window_f64 *window, uint32_t a);

// Takes a frame out and leaves what it said as a prior on the others. `loss`: one of `epi_loss`. Answers how many points went
// with it.
int32_t epi_window_marginalise_frame_f64(struct epi_window_f64 *window,
                                         uint32_t frame,
                                         uint32_t loss,
                                         double loss_scale);

// Takes a point out and leaves what its observations said about the frames. `loss`: one of `epi_loss`.
int32_t epi_window_marginalise_point_f64(struct epi_window_f64 *window,
                                         uint32_t point,
                                         uint32_t loss,
                                         double loss_scale);

// Forgets the marginalisation prior.
int32_t epi_window_clear_prior_f64(struct epi_window_f64 *window);

// The covariances of a frame, all other frames and points being unknown too. `loss`: one of `epi_loss`.
int32_t epi_window_frame_covariance_f64(struct epi_window_f64 *window,
                                        uint32_t frame,
                                        uint32_t loss,
                                        double loss_scale,
                                        struct epi_frame_covariance_f64 *covariance);

// The covariance of a point, all frames and other points being unknown too: 3x3 by rows. `loss`: one of `epi_loss`.
int32_t epi_window_point_covariance_f64(struct epi_window_f64 *window,
                                        uint32_t point,
                                        uint32_t loss,
                                        double loss_scale,
                                        double *covariance);

// Moves frames and points to the least cost. `keep_going`: null, or asked before every iteration. `report_size`: `sizeof` of
// the struct.
int32_t epi_window_optimise_f64(struct epi_window_f64 *window,
                                const struct epi_bundle_options_f64 *options,
                                epi_keep_going keep_going,
                                void *context,
                                struct epi_bundle_report_f64 *report,
                                size_t report_size);

// Moves one frame alone, all else held. `report_size`: `sizeof` of the struct.
int32_t epi_window_refine_frame_f64(struct epi_window_f64 *window,
                                    uint32_t frame,
                                    const struct epi_bundle_options_f64 *options,
                                    struct epi_bundle_report_f64 *report,
                                    size_t report_size);

// Moves one point alone, all frames held. `report_size`: `sizeof` of the struct.
int32_t epi_window_refine_point_f64(struct epi_window_f64 *window,
                                    uint32_t point,
                                    const struct epi_bundle_options_f64 *options,
                                    struct epi_bundle_report_f64 *report,
                                    size_t report_size);

// How well the observations of a point agree with it, `outlier_sigma` deviations being the limit. `report_size`: `sizeof` of
// the struct.
int32_t epi_window_point_report_f64(struct epi_window_f64 *window,
                                    uint32_t point,
                                    double outlier_sigma,
                                    struct epi_point_report_f64 *report,
                                    size_t report_size);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* EPIPOLE_H */
