#include "ground_lines.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "refuse.hpp"

namespace racecraft {
namespace {

// As measured in frames of the original: 2 inches of dash, 2 inches of gap, counted from the first waypoint.
constexpr double kDashLength = 0.0508;  // m
constexpr double kDashPeriod = 0.1016;  // m
constexpr double kFirstDash = 0.058;    // m along the centre line
constexpr double kShortestDash = 0.01;  // m, of the one that the end of the line cuts off

std::vector<Point> read_points(const double* values, int count, const char* name) {
    std::vector<Point> points;
    for (int i = 0; i < count; ++i) {
        const Point p = {values[2 * i], values[2 * i + 1]};
        if (!std::isfinite(p.x) || !std::isfinite(p.y)) {
            refuse("Track " + std::string(name) + "[" + std::to_string(i) +
                   "] is not finite; every coordinate must be a number in metres.");
        }
        if (points.empty() || p.x != points.back().x || p.y != points.back().y) points.push_back(p);
    }
    if (points.size() > 1 && points.front().x == points.back().x && points.front().y == points.back().y) {
        points.pop_back();
    }
    if (points.size() < 2) {
        refuse("Track " + std::string(name) + " has fewer than two different points.");
    }
    return points;
}

void add_ring(const std::vector<Point>& points, std::vector<BorderSegment>& segments) {
    for (size_t i = 0; i < points.size(); ++i)
        segments.push_back({points[i], points[(i + 1) % points.size()]});
}

std::vector<Dash> place_dashes(std::vector<Point> line, bool is_closed) {
    if (is_closed) line.push_back(line.front());
    std::vector<double> arc_length = {0.0};
    for (size_t i = 1; i < line.size(); ++i) {
        const double dx = line[i].x - line[i - 1].x;
        const double dy = line[i].y - line[i - 1].y;
        arc_length.push_back(arc_length.back() + std::sqrt(dx * dx + dy * dy));
    }
    const double length = arc_length.back();
    const int count =
        static_cast<int>(std::min(std::ceil((length - kFirstDash - kShortestDash) / kDashPeriod), 1e6));
    size_t segment = 0;
    const auto point_at = [&](double s) {
        while (segment > 0 && arc_length[segment] > s) --segment;
        while (segment + 2 < line.size() && arc_length[segment + 1] < s) ++segment;
        const double t = (s - arc_length[segment]) / (arc_length[segment + 1] - arc_length[segment]);
        return Point{line[segment].x + t * (line[segment + 1].x - line[segment].x),
                     line[segment].y + t * (line[segment + 1].y - line[segment].y)};
    };
    std::vector<Dash> dashes;
    for (int i = 0; i < count; ++i) {
        const double begin = kFirstDash + i * kDashPeriod;
        const Point a = point_at(begin);
        const Point b = point_at(std::min(begin + kDashLength, length));
        const double dx = b.x - a.x;
        const double dy = b.y - a.y;
        const double chord = std::sqrt(dx * dx + dy * dy);
        if (chord < 1e-6) continue;
        dashes.push_back({{0.5 * (a.x + b.x), 0.5 * (a.y + b.y)}, {dx / chord, dy / chord}, 0.5 * chord});
    }
    return dashes;
}

}  // namespace

GroundLines read_lines(const TrackOutline& outline) {
    const auto center = read_points(outline.center, outline.count, "centerline");
    const auto inner = read_points(outline.inner, outline.count, "inner border");
    const auto outer = read_points(outline.outer, outline.count, "outer border");
    GroundLines lines{{}, place_dashes(center, outline.is_closed), {1e300, 1e300}, {-1e300, -1e300}};
    if (outline.is_closed) {
        add_ring(outer, lines.borders);
        add_ring(inner, lines.borders);
    } else {
        std::vector<Point> road = outer;
        road.insert(road.end(), inner.rbegin(), inner.rend());
        add_ring(road, lines.borders);
    }
    for (const auto* line : {&center, &inner, &outer}) {
        for (const Point& p : *line) {
            lines.low = {std::min(lines.low.x, p.x), std::min(lines.low.y, p.y)};
            lines.high = {std::max(lines.high.x, p.x), std::max(lines.high.y, p.y)};
        }
    }
    return lines;
}

double distance_to(const BorderSegment& segment, Point p, Point& away) {
    const double dx = segment.b.x - segment.a.x;
    const double dy = segment.b.y - segment.a.y;
    const double along = ((p.x - segment.a.x) * dx + (p.y - segment.a.y) * dy) / (dx * dx + dy * dy);
    const double t = std::min(std::max(along, 0.0), 1.0);
    away = {p.x - (segment.a.x + t * dx), p.y - (segment.a.y + t * dy)};
    return std::sqrt(away.x * away.x + away.y * away.y);
}

double depth_in(const Dash& dash, Point p, Point& gradient) {
    const double dx = p.x - dash.center.x;
    const double dy = p.y - dash.center.y;
    const double along = dx * dash.along.x + dy * dash.along.y;
    const double across = dy * dash.along.x - dx * dash.along.y;
    const double over_end = std::fabs(along) - dash.half_length;
    const double over_side = std::fabs(across) - 0.5 * kDashWidth;
    double toward_end = over_end > over_side ? 1.0 : 0.0;
    double toward_side = 1.0 - toward_end;
    double outside = std::max(over_end, over_side);
    if (over_end > 0.0 && over_side > 0.0) {
        outside = std::sqrt(over_end * over_end + over_side * over_side);
        toward_end = over_end / outside;
        toward_side = over_side / outside;
    }
    const double u = along < 0.0 ? toward_end : -toward_end;
    const double v = across < 0.0 ? toward_side : -toward_side;
    gradient = {u * dash.along.x - v * dash.along.y, u * dash.along.y + v * dash.along.x};
    return -outside;
}

bool has_corner(const Dash& dash, Point p, double reach) {
    const double dx = p.x - dash.center.x;
    const double dy = p.y - dash.center.y;
    const double over_end = std::fabs(dx * dash.along.x + dy * dash.along.y) - dash.half_length;
    const double over_side = std::fabs(dy * dash.along.x - dx * dash.along.y) - 0.5 * kDashWidth;
    return std::fabs(over_end) < reach && std::fabs(over_side) < reach;
}

}  // namespace racecraft
