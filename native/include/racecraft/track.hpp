// A track as the rules see it: polylines in metres plus a uniform grid that answers "which segment is
// nearest" and "is this point on the road" exactly, touching a handful of numbers instead of the whole track.
//
//   grid cell -> the few centre-line segments that can be nearest to any point of the cell
//             -> inside / outside the road, or mixed: then count border crossings in the cell's row band
//
// TrackGeometry only points at memory owned by TrackStore (native/src/track_store.hpp), so the same struct
// serves a GPU.
#pragma once

#include "racecraft/math.hpp"

namespace racecraft {

enum CellKind : uint8_t { kCellOutside = 0, kCellInside = 1, kCellMixed = 2 };

constexpr float kTableReach = 3.0f;  // m that a table may be read ahead of a place on the track

// One piece of the centre line, between a waypoint and the next.
struct Segment {
    double x, y;            // m, where it starts
    double dx, dy;          // m, from its start to its end
    double arc_length;      // m, of its start
    double length;          // m
    double inverse_length;  // 1/m
    int32_t waypoint;       // index of its start among the route's waypoints; its end's is one more
    int32_t unused;         // 0
};

// A stretch of a segment in which the nearest points of both borders move evenly: from the outer one to the
// inner one is (x + along dx, y + along dy), `along` metres after the segment's start.
struct WidthPiece {
    double end;     // m after the segment's start, where the stretch ends; infinite for a segment's last one
    double x, y;    // m
    double dx, dy;  // per m
};

// From a waypoint to the middle of each lane, half of the way to the border, m.
struct LaneOffset {
    double inner_x, inner_y, outer_x, outer_y;
};

// The walls around a track, m; the ground map of cameras has the same.
struct Room {
    float min_x, min_y, max_x, max_y;
};

struct TrackGeometry {
    Room room;
    int32_t num_segments;            // W - 1
    int32_t is_closed;               // 1 or 0
    double length;                   // m, of the centre line
    const Segment* segments;         //                                       (W - 1,)
    const LaneOffset* lane_offsets;  // of every waypoint                    (W,)
    const uint32_t* width_begin;     // first piece of the width of a segment (W,)
    const WidthPiece* width_pieces;

    double grid_x, grid_y;  // m, lower left corner of the grid
    double inverse_cell;    // 1/m
    int32_t grid_columns, grid_rows;
    const uint8_t* cell_kind;       // CellKind                              (rows * columns,)
    const uint32_t* segment_begin;  // first candidate segment of a cell     (rows * columns + 1,)
    const uint16_t* segment_items;  // candidate segments, ascending per cell

    const uint32_t* band_begin;  // first border edge of a grid row       (rows + 1,)
    const double* edge_x0;       // m, border edges that reach into a row band
    const double* edge_y0;
    const double* edge_y1;
    const double* edge_slope;  // dx/dy; 0 for horizontal edges, which never count

    // Samples along the centre line; they go on kTableReach beyond the end (around again, or standing still).
    float samples_per_metre;       // 1/m
    const float* width_table;      // m, local track width as a critic knows it
    const float* curvature_table;  // 1/m, left positive
};

// Where a point is, seen from the centre line.
struct Projection {
    double arc_length;  // m, in [0, length)
    double offset;      // m, left of the direction of travel positive
    int32_t segment;    // waypoints segment and segment + 1 enclose arc_length
    int32_t unused;     // 0; without a gap, a saved episode has no undefined bytes
};

RC_HD Projection project_onto_segment(const TrackGeometry& track, int32_t index, double x, double y,
                                      double& squared_distance) {
    const Segment& segment = track.segments[index];
    const double rx = x - segment.x;
    const double ry = y - segment.y;
    const double share =
        (rx * segment.dx + ry * segment.dy) * segment.inverse_length * segment.inverse_length;
    const double along = clamp(share, 0.0, 1.0);
    const double ox = rx - along * segment.dx;
    const double oy = ry - along * segment.dy;
    squared_distance = ox * ox + oy * oy;
    // The side is that of the segment; the magnitude, taken by project(), is the true distance also beyond
    // its ends.
    const double cross = segment.dx * ry - segment.dy * rx;
    return {segment.arc_length + along * segment.length, cross < 0.0 ? -1.0 : 1.0, index, 0};
}

RC_HD Projection project(const TrackGeometry& track, double x, double y) {
    const double column = floor_of((x - track.grid_x) * track.inverse_cell);
    const double row = floor_of((y - track.grid_y) * track.inverse_cell);
    const bool in_grid = column >= 0.0 && row >= 0.0 && column < track.grid_columns && row < track.grid_rows;
    uint32_t begin = 0;
    uint32_t end = static_cast<uint32_t>(track.num_segments);
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
    best.offset *= sqrt_of(best_distance);
    // A projection that falls on a waypoint belongs to the segment that starts there.
    const Segment& segment = track.segments[best.segment];
    if (best.arc_length >= segment.arc_length + segment.length) {
        if (best.segment + 1 < track.num_segments) {
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

// How wide the road is: from the inner border's nearest point to the outer one's, both seen from a projection
// on the centre line, as the original measures it.
RC_HD double width_at(const TrackGeometry& track, const Projection& place) {
    const double along = place.arc_length - track.segments[place.segment].arc_length;
    const WidthPiece* piece = track.width_pieces + track.width_begin[place.segment];
    while (along > piece->end) ++piece;
    const double x = piece->x + along * piece->dx;
    const double y = piece->y + along * piece->dy;
    return sqrt_of(x * x + y * y);
}

// Where a table is read for a place on the track, in samples.
RC_HD float table_position(const TrackGeometry& track, double arc_length) {
    return static_cast<float>(arc_length) * track.samples_per_metre;
}

// Linear interpolation between two samples.
RC_HD float table_at(const float* table, float position) {
    const int32_t index = static_cast<int32_t>(position);
    return table[index] + (position - static_cast<float>(index)) * (table[index + 1] - table[index]);
}

}  // namespace racecraft
