// C++17 over epipole.h: memory that frees itself, errors as exceptions, arrays of any kind as points; Eigen's too, where it
// is there. Header only. What is not wrapped here is called as in C, through check().
#ifndef EPIPOLE_HPP
#define EPIPOLE_HPP

#include <array>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <memory>
#include <type_traits>
#include <utility>
#include <vector>

#if __has_include(<Eigen/Geometry>)
#include <Eigen/Geometry>
#define EPIPOLE_EIGEN 1
#endif

#include "epipole.h"

namespace epipole {

/// A negative status.
class Error : public std::exception {
public:
    explicit Error(std::int32_t status) noexcept : status_(status) {}
    const char *what() const noexcept override { return epi_status_string(status_); }
    std::int32_t status() const noexcept { return status_; }

private:
    std::int32_t status_;
};

/// The count that a function answers; throws its status.
inline std::int32_t check(std::int32_t answer) {
    if (answer < 0)
        throw Error(answer);
    return answer;
}

/// `count` points of `N` numbers each, seen and not owned.
template <class T, std::size_t N> class Points {
public:
    Points(const T *numbers, std::size_t count) : numbers_(numbers), count_(count) {}
    template <std::size_t M> Points(const T (&points)[M][N]) : Points(&points[0][0], M) {}
    template <std::size_t M>
    Points(const std::array<std::array<T, N>, M> &points) : Points(M ? points[0].data() : nullptr, M) {}
    Points(const std::vector<std::array<T, N>> &points)
        : Points(reinterpret_cast<const T *>(points.data()), points.size()) {}
#ifdef EPIPOLE_EIGEN
    /// One point a column.
    template <int Columns, int Options, int MaxRows, int MaxColumns>
    Points(const Eigen::Matrix<T, static_cast<int>(N), Columns, Options, MaxRows, MaxColumns> &points)
        : Points(points.data(), static_cast<std::size_t>(points.cols())) {
        static_assert((Options & Eigen::RowMajorBit) == 0, "points are columns");
    }
#endif
    const T *data() const { return numbers_; }
    std::size_t size() const { return count_; }

private:
    const T *numbers_;
    std::size_t count_;
};

/// Memory for a workspace or a window.
class Memory {
public:
    explicit Memory(std::size_t size = 0) : size_(size), blocks_(size ? new Block[(size + sizeof(Block) - 1) / sizeof(Block)]() : nullptr) {}
    void *data() { return blocks_.get(); }
    std::size_t size() const { return size_; }
    /// At least this size; what it held is forgotten where it grows.
    void grow(std::size_t size) {
        if (size > size_)
            *this = Memory(size);
    }

private:
    struct alignas(EPI_WORKSPACE_ALIGN) Block {
        unsigned char bytes[EPI_WORKSPACE_ALIGN];
    };
    std::size_t size_;
    std::unique_ptr<Block[]> blocks_;
};

/// The C types and functions of a scalar.
template <class T> struct Api;

#define EPIPOLE_API_(scalar, suffix)                                                                                   \
    template <> struct Api<scalar> {                                                                                   \
        using Camera = epi_camera_##suffix;                                                                            \
        using Pose = epi_pose_##suffix;                                                                                \
        using Window = epi_window_##suffix;                                                                            \
        using RelativePoseOptions = epi_relative_pose_options_##suffix;                                                \
        using RelativePoseEstimate = epi_relative_pose_estimate_##suffix;                                              \
        using HomographyOptions = epi_homography_options_##suffix;                                                     \
        using HomographyEstimate = epi_homography_estimate_##suffix;                                                   \
        using FundamentalOptions = epi_fundamental_options_##suffix;                                                   \
        using FundamentalEstimate = epi_fundamental_estimate_##suffix;                                                 \
        using AbsolutePoseOptions = epi_absolute_pose_options_##suffix;                                                \
        using AbsolutePoseEstimate = epi_absolute_pose_estimate_##suffix;                                              \
        using BundleOptions = epi_bundle_options_##suffix;                                                             \
        using BundleReport = epi_bundle_report_##suffix;                                                               \
        static constexpr auto relative_pose_options = epi_relative_pose_options_default_##suffix;                      \
        static constexpr auto relative_pose_size = epi_relative_pose_workspace_size_##suffix;                          \
        static constexpr auto relative_pose = epi_relative_pose_##suffix;                                              \
        static constexpr auto homography_options = epi_homography_options_default_##suffix;                            \
        static constexpr auto homography_size = epi_homography_workspace_size_##suffix;                                \
        static constexpr auto homography = epi_homography_##suffix;                                                    \
        static constexpr auto fundamental_options = epi_fundamental_options_default_##suffix;                          \
        static constexpr auto fundamental_size = epi_fundamental_workspace_size_##suffix;                              \
        static constexpr auto fundamental = epi_fundamental_##suffix;                                                  \
        static constexpr auto absolute_pose_options = epi_absolute_pose_options_default_##suffix;                      \
        static constexpr auto absolute_pose_size = epi_absolute_pose_workspace_size_##suffix;                          \
        static constexpr auto absolute_pose = epi_absolute_pose_##suffix;                                              \
        static constexpr auto triangulate = epi_triangulate_##suffix;                                                  \
        static constexpr auto pose_matrix = epi_pose_matrix_##suffix;                                                  \
        static constexpr auto bundle_options = epi_bundle_options_default_##suffix;                                    \
        static constexpr auto window_size = epi_window_size_##suffix;                                                  \
        static constexpr auto window_create = epi_window_create_##suffix;                                              \
        static constexpr auto window_add_frame = epi_window_add_frame_##suffix;                                        \
        static constexpr auto window_fix_frame = epi_window_fix_frame_##suffix;                                        \
        static constexpr auto window_pose = epi_window_pose_##suffix;                                                  \
        static constexpr auto window_add_point = epi_window_add_point_##suffix;                                        \
        static constexpr auto window_position = epi_window_position_##suffix;                                          \
        static constexpr auto window_add_observation = epi_window_add_observation_##suffix;                            \
        static constexpr auto window_optimise = epi_window_optimise_##suffix;                                          \
        static constexpr auto window_marginalise_frame = epi_window_marginalise_frame_##suffix;                        \
    }
EPIPOLE_API_(float, f32);
EPIPOLE_API_(double, f64);
#undef EPIPOLE_API_

template <class T> using Camera = typename Api<T>::Camera;
template <class T> using Pose = typename Api<T>::Pose;

template <class T> Camera<T> pinhole(T fx, T fy, T cx, T cy) {
    Camera<T> camera{};
    camera.model = EPI_CAMERA_MODEL_PINHOLE;
    camera.fx = fx, camera.fy = fy, camera.cx = cx, camera.cy = cy;
    return camera;
}

/// Options as their function fills them.
template <class Options> Options defaults(std::int32_t (*fill)(Options *, std::size_t)) {
    Options options;
    check(fill(&options, sizeof options));
    return options;
}

/// The rotation matrix of a pose, by rows.
template <class T> std::array<T, 9> rotation_matrix(const Pose<T> &pose) {
    std::array<T, 9> matrix;
    std::array<T, 3> translation;
    check(Api<T>::pose_matrix(&pose, matrix.data(), translation.data()));
    return matrix;
}

/// An estimate and the mask of its inliers.
template <class Estimate> struct Found {
    Estimate estimate;
    std::vector<std::uint8_t> inliers;
};

/// Robust estimators that keep their workspace from call to call.
template <class T> class Estimator {
    using A = Api<T>;

public:
    typename A::RelativePoseOptions relative_pose_options = defaults(A::relative_pose_options);
    typename A::HomographyOptions homography_options = defaults(A::homography_options);
    typename A::FundamentalOptions fundamental_options = defaults(A::fundamental_options);
    typename A::AbsolutePoseOptions absolute_pose_options = defaults(A::absolute_pose_options);

    Found<typename A::RelativePoseEstimate> relative_pose(const Camera<T> &camera1, const Camera<T> &camera2,
                                                          Points<T, 2> x1, Points<T, 2> x2) {
        const std::size_t count = same(x1.size(), x2.size());
        memory_.grow(A::relative_pose_size(count, wide(camera1) || wide(camera2)));
        Found<typename A::RelativePoseEstimate> found{{}, std::vector<std::uint8_t>(count)};
        check(A::relative_pose(&camera1, &camera2, x1.data(), x2.data(), count, &relative_pose_options, memory_.data(),
                               memory_.size(), &found.estimate, sizeof found.estimate, found.inliers.data()));
        return found;
    }

    Found<typename A::HomographyEstimate> homography(Points<T, 2> x1, Points<T, 2> x2) {
        const std::size_t count = same(x1.size(), x2.size());
        memory_.grow(A::homography_size(count));
        Found<typename A::HomographyEstimate> found{{}, std::vector<std::uint8_t>(count)};
        check(A::homography(x1.data(), x2.data(), count, &homography_options, memory_.data(), memory_.size(),
                            &found.estimate, sizeof found.estimate, found.inliers.data()));
        return found;
    }

    Found<typename A::FundamentalEstimate> fundamental(Points<T, 2> x1, Points<T, 2> x2) {
        const std::size_t count = same(x1.size(), x2.size());
        memory_.grow(A::fundamental_size(count));
        Found<typename A::FundamentalEstimate> found{{}, std::vector<std::uint8_t>(count)};
        check(A::fundamental(x1.data(), x2.data(), count, &fundamental_options, memory_.data(), memory_.size(),
                             &found.estimate, sizeof found.estimate, found.inliers.data()));
        return found;
    }

    Found<typename A::AbsolutePoseEstimate> absolute_pose(const Camera<T> &camera, Points<T, 2> pixels,
                                                          Points<T, 3> points) {
        const std::size_t count = same(pixels.size(), points.size());
        memory_.grow(A::absolute_pose_size(count, wide(camera)));
        Found<typename A::AbsolutePoseEstimate> found{{}, std::vector<std::uint8_t>(count)};
        check(A::absolute_pose(&camera, pixels.data(), points.data(), count, &absolute_pose_options, memory_.data(),
                               memory_.size(), &found.estimate, sizeof found.estimate, found.inliers.data()));
        return found;
    }

private:
    static std::size_t same(std::size_t a, std::size_t b) {
        if (a != b)
            throw Error(EPI_STATUS_TOO_FEW);
        return a;
    }
    static bool wide(const Camera<T> &camera) { return camera.model == EPI_CAMERA_MODEL_KANNALA_BRANDT; }

    Memory memory_;
};

/// A window of bundle adjustment and its memory.
template <class T> class Window {
    using A = Api<T>;

public:
    typename A::BundleOptions options = defaults(A::bundle_options);

    Window(std::size_t frames, std::size_t points, std::size_t observations, bool prior = true)
        : memory_(A::window_size(frames, points, observations, prior)) {
        check(A::window_create(memory_.data(), memory_.size(), frames, points, observations, prior, &window_));
    }
    /// For every function of C that this class does not wrap.
    typename A::Window *get() { return window_; }

    std::uint32_t add_frame(const Camera<T> &camera, const Pose<T> &pose, bool fixed = false) {
        std::uint32_t frame;
        check(A::window_add_frame(window_, &camera, &pose, &frame));
        check(A::window_fix_frame(window_, frame, fixed));
        return frame;
    }
    std::uint32_t add_point(const std::array<T, 3> &position) {
        std::uint32_t point;
        check(A::window_add_point(window_, position.data(), &point));
        return point;
    }
    void add_observation(std::uint32_t frame, std::uint32_t point, const std::array<T, 2> &pixel, T sigma_px = 1) {
        check(A::window_add_observation(window_, frame, point, pixel.data(), sigma_px));
    }
    Pose<T> pose(std::uint32_t frame) {
        Pose<T> pose;
        check(A::window_pose(window_, frame, &pose));
        return pose;
    }
    std::array<T, 3> position(std::uint32_t point) {
        std::array<T, 3> position;
        check(A::window_position(window_, point, position.data()));
        return position;
    }
    typename A::BundleReport optimise() {
        typename A::BundleReport report;
        check(A::window_optimise(window_, &options, nullptr, nullptr, &report, sizeof report));
        return report;
    }
    /// The points that went with the frame.
    std::int32_t marginalise_frame(std::uint32_t frame) {
        return check(A::window_marginalise_frame(window_, frame, options.loss, options.loss_scale));
    }

private:
    Memory memory_;
    typename A::Window *window_ = nullptr;
};

#ifdef EPIPOLE_EIGEN
/// A pose as Eigen's.
template <class T> Eigen::Transform<T, 3, Eigen::Isometry> to_eigen(const Pose<T> &pose) {
    Eigen::Transform<T, 3, Eigen::Isometry> out;
    out = Eigen::Translation<T, 3>(pose.translation[0], pose.translation[1], pose.translation[2]) *
          Eigen::Quaternion<T>(pose.rotation[3], pose.rotation[0], pose.rotation[1], pose.rotation[2]);
    return out;
}
inline Eigen::Isometry3f to_eigen(const epi_pose_f32 &pose) { return to_eigen<float>(pose); }
inline Eigen::Isometry3d to_eigen(const epi_pose_f64 &pose) { return to_eigen<double>(pose); }
#endif

} // namespace epipole

#endif // EPIPOLE_HPP
