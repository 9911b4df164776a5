// A camera flies past points: a window of bundle adjustment from a bad start, then the absolute pose of a last frame, in C++.
// Works without Eigen; with it, the same points are given as a matrix.
#include <cmath>
#include <cstdio>
#include <epipole.hpp>

namespace {

using Vec2 = std::array<double, 2>;
using Vec3 = std::array<double, 3>;

epi_pose_f64 at(double x) { return {{0, 0, 0, 1}, {-x, 0, 0}}; }

Vec2 project(const epi_camera_f64 &camera, const epi_pose_f64 &pose, const Vec3 &point) {
    const Vec3 moved = {point[0] + pose.translation[0], point[1] + pose.translation[1], point[2] + pose.translation[2]};
    Vec2 pixel;
    std::uint8_t visible;
    epipole::check(epi_camera_project_f64(&camera, moved.data(), 1, pixel.data(), &visible));
    return pixel;
}

double distance(const epi_pose_f64 &a, const epi_pose_f64 &b) {
    double sum = 0;
    for (int k = 0; k < 3; ++k)
        sum += (a.translation[k] - b.translation[k]) * (a.translation[k] - b.translation[k]);
    return std::sqrt(sum);
}

} // namespace

int main() try {
    const auto camera = epipole::pinhole(500.0, 500.0, 320.0, 240.0);
    std::vector<Vec3> points;
    for (int k = 0; k < 24; ++k)
        points.push_back({k % 7 - 3.0, std::sin(1.7 * k), 6 + std::cos(2.3 * k)});

    // Two known frames, one that is a bad guess, and points two per cent off.
    epipole::Window<double> window(3, points.size(), 3 * points.size());
    std::array<std::uint32_t, 3> frames;
    for (int k = 0; k < 3; ++k)
        frames[k] = window.add_frame(camera, at(k == 2 ? 1.9 : k), k < 2);
    for (const auto &point : points) {
        const auto name = window.add_point({1.02 * point[0], 1.02 * point[1], 1.02 * point[2]});
        for (int k = 0; k < 3; ++k)
            window.add_observation(frames[k], name, project(camera, at(k), point));
    }
    const auto report = window.optimise();
    const double error = distance(window.pose(frames[2]), at(2));
    std::printf("window: %u iterations, cost %.3g, error of the newest frame %.2g\n", report.iterations,
                report.cost_after, error);

    // A later frame sees the same points; a few of its pixels are wrong.
    std::vector<Vec2> pixels;
    for (const auto &point : points)
        pixels.push_back(project(camera, at(2.5), point));
    for (std::size_t k = 0; k < pixels.size(); k += 6)
        pixels[k] = {10.0 * double(k), 400.0 - 7.0 * double(k)};
    epipole::Estimator<double> estimator;
    const auto found = estimator.absolute_pose(camera, pixels, points);
    const double absolute = distance(found.estimate.poses[0], at(2.5));
    std::printf("absolute pose: verdict %u, %u of %zu inliers, error %.2g\n", found.estimate.verdict,
                found.estimate.report.inliers, pixels.size(), absolute);
    bool good = error < 1e-6 && found.estimate.verdict == EPI_ABSOLUTE_POSE_VERDICT_POSE && absolute < 1e-6;

#ifdef EPIPOLE_EIGEN
    Eigen::Matrix<double, 2, Eigen::Dynamic> u(2, static_cast<Eigen::Index>(pixels.size()));
    Eigen::Matrix<double, 3, Eigen::Dynamic> x(3, static_cast<Eigen::Index>(points.size()));
    for (std::size_t k = 0; k < points.size(); ++k) {
        u.col(static_cast<Eigen::Index>(k)) << pixels[k][0], pixels[k][1];
        x.col(static_cast<Eigen::Index>(k)) << points[k][0], points[k][1], points[k][2];
    }
    const auto same = estimator.absolute_pose(camera, u, x);
    const Eigen::Isometry3d pose = epipole::to_eigen(same.estimate.poses[0]);
    std::printf("by Eigen: centre %.6f %.6f %.6f\n", pose.inverse().translation().x(), pose.inverse().translation().y(),
                pose.inverse().translation().z());
    good = good && std::abs(pose.inverse().translation().x() - 2.5) < 1e-6;
#endif

    // An error is an exception that says what it is.
    try {
        pixels.resize(3);
        estimator.absolute_pose(camera, pixels, {points[0].data(), 3});
        good = false;
    } catch (const epipole::Error &refused) {
        std::printf("three points: %s\n", refused.what());
        good = good && refused.status() == EPI_STATUS_TOO_FEW;
    }
    std::puts(good ? "all good" : "WRONG");
    return good ? 0 : 1;
} catch (const epipole::Error &error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 2;
}
