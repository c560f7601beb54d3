// Tracks to test on, made from formulas: a wobbly circuit, a figure of eight, an open bend.
#pragma once

#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include "track_store.hpp"

namespace racecraft::test {

struct Outline {
    std::vector<double> center, inner, outer;  // m, (W, 2)
    bool is_closed;

    size_t num_waypoints() const { return center.size() / 2; }
    TrackOutline view() const {
        return {center.data(), inner.data(), outer.data(), static_cast<int>(num_waypoints()), is_closed};
    }
};

struct Point {
    double x, y;
};

// A road of half_width to both sides of curve(t), t from 0 to 1; inner is left.
inline Outline road_along(const std::function<Point(double)>& curve, size_t pieces, double half_width,
                          bool is_closed) {
    Outline road{{}, {}, {}, is_closed};
    for (size_t i = 0; i <= pieces; ++i) {
        const double t = static_cast<double>(i == pieces && is_closed ? 0 : i) / static_cast<double>(pieces);
        const Point here = curve(t);
        const Point before = curve(t - 1e-6);
        const Point after = curve(t + 1e-6);
        const double dx = after.x - before.x;
        const double dy = after.y - before.y;
        const double step = std::sqrt(dx * dx + dy * dy);
        const double nx = -dy / step * half_width;
        const double ny = dx / step * half_width;
        road.center.insert(road.center.end(), {here.x, here.y});
        road.inner.insert(road.inner.end(), {here.x + nx, here.y + ny});
        road.outer.insert(road.outer.end(), {here.x - nx, here.y - ny});
    }
    return road;
}

inline Outline circuit(size_t pieces = 120) {
    return road_along(
        [](double t) {
            const double angle = 2.0 * std::numbers::pi * t;
            const double radius = 3.0 + 0.6 * std::sin(3.0 * angle) + 0.3 * std::cos(2.0 * angle);
            return Point{1.0 + radius * std::cos(angle), -2.0 + radius * std::sin(angle)};
        },
        pieces, 0.4, true);
}

inline Outline figure_of_eight(size_t pieces = 150) {
    return road_along(
        [](double t) {
            const double angle = 2.0 * std::numbers::pi * t;
            return Point{4.0 * std::sin(angle), 2.5 * std::sin(2.0 * angle)};
        },
        pieces, 0.35, true);
}

inline Outline open_bend(size_t pieces = 60) {
    return road_along([](double t) { return Point{8.0 * t, 1.5 * std::sin(4.0 * t)}; }, pieces, 0.5, false);
}

// Constant tables, one sample a metre, are enough where width and curvature are not the subject.
inline TrackStore store_of(const Outline& road, float width = 0.8f) {
    double length = 0.0;
    for (size_t i = 2; i < road.center.size(); i += 2) {
        length += std::hypot(road.center[i] - road.center[i - 2], road.center[i + 1] - road.center[i - 1]);
    }
    const size_t count = static_cast<size_t>(std::ceil(length)) + 1;
    return TrackStore(road.view(), std::vector<float>(count, width), std::vector<float>(count, 0.0f), 1.0);
}

}  // namespace racecraft::test
