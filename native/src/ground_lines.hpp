// The painted lines of a track as geometry: border segments, dashes, and how far a point is from each.
#pragma once

#include <vector>

#include "racecraft/ground.hpp"
#include "track_outline.hpp"

namespace racecraft {

constexpr double kDashWidth = 0.0254;  // m

struct Point {
    double x, y;
};

struct BorderSegment {
    Point a, b;
};

// A dash of the centre line: an oriented rectangle.
struct Dash {
    Point center, along;
    double half_length;
};

struct GroundLines {
    std::vector<BorderSegment> borders;  // an odd number of crossings to a point's left means road
    std::vector<Dash> dashes;
    Point low, high;  // m, bounding box
};

// Throws std::invalid_argument for lines with fewer than two different points or with numbers that are not
// finite.
GroundLines read_lines(const TrackOutline& outline);

// Distance to the segment and the vector from its nearest point.
double distance_to(const BorderSegment& segment, Point p, Point& away);

// Signed distance into the dash and its gradient; outside a corner it points to the corner.
double depth_in(const Dash& dash, Point p, Point& gradient);

// Whether one of the dash's corners is about as near as reach.
bool has_corner(const Dash& dash, Point p, double reach);

}  // namespace racecraft
