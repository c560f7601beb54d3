// A track as the rules see it: polylines in metres plus a uniform grid that answers "which segment is nearest" and
// "is this point on the road" exactly, touching a handful of numbers instead of the whole track.
//
//   grid cell -> the few centre-line segments that can be nearest to any point of the cell
//             -> inside / outside the road, or mixed: then count border crossings in the cell's row band
//
// TrackGeometry only points at memory owned by TrackStore (native/src/track_store.hpp), so the same struct serves a GPU.
#pragma once

#include "racecraft/math.hpp"

namespace racecraft {

enum CellKind : uint8_t { kCellOutside = 0, kCellInside = 1, kCellMixed = 2 };

struct TrackGeometry {
    int32_t num_waypoints;          // W; closed tracks repeat the first waypoint at the end
    int32_t is_closed;              // 1 or 0
    double length;                  // m, of the centre line
    const double* waypoint_x;       // m                                     (W,)
    const double* waypoint_y;       // m                                     (W,)
    const double* arc_length;       // m, from the first waypoint            (W,)

    double grid_x, grid_y;          // m, lower left corner of the grid
    double inverse_cell;            // 1/m
    int32_t grid_columns, grid_rows;
    const uint8_t* cell_kind;       // CellKind                              (rows * columns,)
    const uint32_t* segment_begin;  // first candidate segment of a cell     (rows * columns + 1,)
    const uint16_t* segment_items;  // candidate segments, ascending per cell

    const uint32_t* band_begin;     // first border edge of a grid row       (rows + 1,)
    const double* edge_x0;          // m, border edges that reach into a row band
    const double* edge_y0;
    const double* edge_y1;
    const double* edge_slope;       // dx/dy; 0 for horizontal edges, which never count

    int32_t num_samples;            // of the tables over arc length
    double samples_per_metre;       // 1/m
    const float* width_table;       // m, local track width                  (num_samples,)
    const float* curvature_table;   // 1/m, left positive                    (num_samples,)
};

// Where a point is, seen from the centre line.
struct Projection {
    double arc_length;   // m, in [0, length)
    double offset;       // m, left of the direction of travel positive
    int32_t segment;     // waypoints segment and segment + 1 enclose arc_length
};

RC_HD Projection project_onto_segment(const TrackGeometry& track, int32_t segment, double x, double y,
                                      double& squared_distance) {
    const double ax = track.waypoint_x[segment];
    const double ay = track.waypoint_y[segment];
    const double dx = track.waypoint_x[segment + 1] - ax;
    const double dy = track.waypoint_y[segment + 1] - ay;
    const double squared_length = dx * dx + dy * dy;
    const double along = clamp(((x - ax) * dx + (y - ay) * dy) / squared_length, 0.0, 1.0);
    const double ox = x - (ax + along * dx);
    const double oy = y - (ay + along * dy);
    squared_distance = ox * ox + oy * oy;
    Projection projection;
    projection.arc_length =
        track.arc_length[segment] + along * (track.arc_length[segment + 1] - track.arc_length[segment]);
    // The side is that of the segment; its magnitude is the true distance also beyond the segment's ends.
    const double cross = dx * (y - ay) - dy * (x - ax);
    const double distance = sqrt_of(squared_distance);
    projection.offset = cross < 0.0 ? -distance : distance;
    projection.segment = segment;
    return projection;
}

RC_HD Projection project(const TrackGeometry& track, double x, double y) {
    const double column = floor_of((x - track.grid_x) * track.inverse_cell);
    const double row = floor_of((y - track.grid_y) * track.inverse_cell);
    const bool in_grid = column >= 0.0 && row >= 0.0 && column < track.grid_columns && row < track.grid_rows;
    uint32_t begin = 0;
    uint32_t end = static_cast<uint32_t>(track.num_waypoints - 1);
    if (in_grid) {
        const int32_t cell = static_cast<int32_t>(row) * track.grid_columns + static_cast<int32_t>(column);
        begin = track.segment_begin[cell];
        end = track.segment_begin[cell + 1];
    }
    Projection best{};
    double best_distance = 1e300;
    for (uint32_t i = begin; i < end; ++i) {
        const int32_t segment = in_grid ? track.segment_items[i] : static_cast<int32_t>(i);
        double distance;
        const Projection candidate = project_onto_segment(track, segment, x, y, distance);
        if (distance < best_distance) {
            best_distance = distance;
            best = candidate;
        }
    }
    // A projection that falls on a waypoint belongs to the segment that starts there.
    if (best.arc_length >= track.arc_length[best.segment + 1]) {
        if (best.segment + 2 < track.num_waypoints) {
            best.segment += 1;
        } else if (track.is_closed) {
            best.segment = 0;
            best.arc_length = 0.0;
        }
    }
    return best;
}

// Even-odd rule over both borders, exact up to rounding.
RC_HD bool is_on_road(const TrackGeometry& track, double x, double y) {
    const double column = floor_of((x - track.grid_x) * track.inverse_cell);
    const double row = floor_of((y - track.grid_y) * track.inverse_cell);
    if (!(column >= 0.0 && row >= 0.0 && column < track.grid_columns && row < track.grid_rows)) {
        return false;
    }
    const int32_t cell = static_cast<int32_t>(row) * track.grid_columns + static_cast<int32_t>(column);
    if (track.cell_kind[cell] != kCellMixed) {
        return track.cell_kind[cell] == kCellInside;
    }
    const uint32_t begin = track.band_begin[static_cast<int32_t>(row)];
    const uint32_t end = track.band_begin[static_cast<int32_t>(row) + 1];
    int32_t crossings = 0;
    for (uint32_t i = begin; i < end; ++i) {
        const int32_t spans = (track.edge_y0[i] <= y) != (track.edge_y1[i] <= y);
        const int32_t right = x < track.edge_x0[i] + (y - track.edge_y0[i]) * track.edge_slope[i];
        crossings += spans & right;
    }
    return (crossings & 1) != 0;
}

// Linear interpolation in a table over arc length; wraps on a closed track, clamps on an open one.
RC_HD float table_at(const TrackGeometry& track, const float* table, double arc_length) {
    double position = arc_length * track.samples_per_metre;
    const double count = static_cast<double>(track.num_samples);
    if (track.is_closed) {
        position = position - floor_of(position / count) * count;
    } else {
        position = clamp(position, 0.0, count - 1.0);
    }
    int32_t index = static_cast<int32_t>(position);
    index = index < track.num_samples ? index : track.num_samples - 1;
    int32_t next = index + 1;
    next = next < track.num_samples ? next : (track.is_closed ? 0 : index);
    const float weight = static_cast<float>(position - index);
    return table[index] + weight * (table[next] - table[index]);
}

}  // namespace racecraft
