#include "track_store.hpp"

#include <algorithm>
#include <cmath>

#include "racecraft/ground.hpp"
#include "road_width.hpp"

namespace racecraft {
namespace {

constexpr double kMargin = 1.0;         // m of grid around the borders: a car that leaves is judged within it
constexpr double kFinestCell = 0.1;     // m
constexpr double kMostCells = 20000.0;  // coarser cells beyond, so that a long track still loads at once

void append_line(Edges& edges, const std::vector<double>& points, bool is_ring) {
    const size_t count = points.size() / 2;
    for (size_t i = 0; i < (is_ring ? count : count - 1); ++i) {
        const size_t next = (i + 1) % count;
        edges.insert(edges.end(), {points[2 * i], points[2 * i + 1], points[2 * next], points[2 * next + 1]});
    }
}

// sqrt, not hypot: IEEE 754 fixes its last bit, a C library's hypot may differ.
double length_of(double dx, double dy) {
    return std::sqrt(dx * dx + dy * dy);
}

double distance_to(const Segment& segment, double x, double y) {
    const double rx = x - segment.x;
    const double ry = y - segment.y;
    const double share =
        (rx * segment.dx + ry * segment.dy) * segment.inverse_length * segment.inverse_length;
    const double along = clamp(share, 0.0, 1.0);
    return length_of(rx - along * segment.dx, ry - along * segment.dy);
}

// Appends what lies kTableReach beyond the end, so that a table needs no wrapping when it is read.
void extend(std::vector<float>& table, double samples_per_metre, bool is_closed) {
    const size_t count = table.size();
    const size_t reach = static_cast<size_t>(static_cast<double>(kTableReach) * samples_per_metre) + 3;
    for (size_t i = 0; i < reach; ++i) table.push_back(is_closed ? table[i % count] : table[count - 1]);
}

}  // namespace

TrackStore::TrackStore(const TrackOutline& outline, const std::vector<float>& widths,
                       const std::vector<float>& curvatures, double samples_per_metre)
    : widths_(widths), curvatures_(curvatures) {
    const size_t count = static_cast<size_t>(outline.count);
    double arc_length = 0.0;
    for (size_t i = 0; i + 1 < count; ++i) {
        Segment segment{};
        segment.x = outline.center[2 * i];
        segment.y = outline.center[2 * i + 1];
        segment.dx = outline.center[2 * i + 2] - segment.x;
        segment.dy = outline.center[2 * i + 3] - segment.y;
        segment.arc_length = arc_length;
        segment.length = length_of(segment.dx, segment.dy);
        segment.inverse_length = 1.0 / segment.length;
        segment.waypoint = outline.waypoints != nullptr ? outline.waypoints[i] : static_cast<int32_t>(i);
        arc_length += segment.length;
        segments_.push_back(segment);
    }
    for (size_t i = 0; i < 2 * count; i += 2) {
        lane_offsets_.push_back({0.5 * (outline.inner[i] - outline.center[i]),
                                 0.5 * (outline.inner[i + 1] - outline.center[i + 1]),
                                 0.5 * (outline.outer[i] - outline.center[i]),
                                 0.5 * (outline.outer[i + 1] - outline.center[i + 1])});
    }
    extend(widths_, samples_per_metre, outline.is_closed);
    extend(curvatures_, samples_per_metre, outline.is_closed);

    std::vector<double> inner(outline.inner, outline.inner + 2 * count);
    std::vector<double> outer(outline.outer, outline.outer + 2 * count);
    if (outline.is_closed) {
        append_line(border_, inner, true);
        append_line(border_, outer, true);
    } else {
        std::vector<double> ring = outer;
        for (size_t i = count; i-- > 0;) ring.insert(ring.end(), {inner[2 * i], inner[2 * i + 1]});
        append_line(border_, ring, true);
    }

    double x_min = inner[0], x_max = inner[0], y_min = inner[1], y_max = inner[1];
    for (size_t i = 0; i < border_.size(); i += 2) {
        x_min = std::min(x_min, border_[i]);
        x_max = std::max(x_max, border_[i]);
        y_min = std::min(y_min, border_[i + 1]);
        y_max = std::max(y_max, border_[i + 1]);
    }
    const double width = x_max - x_min + 2.0 * kMargin;
    const double height = y_max - y_min + 2.0 * kMargin;
    const double cell = std::max(kFinestCell, std::sqrt(width * height / kMostCells));

    TrackGeometry& g = geometry_;
    g.room = {static_cast<float>(x_min) - kRoomMargin, static_cast<float>(y_min) - kRoomMargin,
              static_cast<float>(x_max) + kRoomMargin, static_cast<float>(y_max) + kRoomMargin};
    g.num_segments = static_cast<int32_t>(segments_.size());
    g.is_closed = outline.is_closed ? 1 : 0;
    g.length = arc_length;
    g.segments = segments_.data();
    g.lane_offsets = lane_offsets_.data();
    g.grid_x = x_min - kMargin;
    g.grid_y = y_min - kMargin;
    g.inverse_cell = 1.0 / cell;
    g.grid_columns = static_cast<int32_t>(std::ceil(width / cell));
    g.grid_rows = static_cast<int32_t>(std::ceil(height / cell));
    g.samples_per_metre = static_cast<float>(samples_per_metre);
    g.width_table = widths_.data();
    g.curvature_table = curvatures_.data();
    build_widths(inner, outer);
    build_segments();
    build_bands();
}

void TrackStore::build_widths(const std::vector<double>& inner, const std::vector<double>& outer) {
    Edges inner_edges, outer_edges;
    append_line(inner_edges, inner, geometry_.is_closed != 0);
    append_line(outer_edges, outer, geometry_.is_closed != 0);
    width_begin_.push_back(0);
    for (const Segment& segment : segments_) {
        const std::vector<WidthPiece> pieces = width_pieces(segment, inner_edges, outer_edges);
        width_pieces_.insert(width_pieces_.end(), pieces.begin(), pieces.end());
        width_begin_.push_back(static_cast<uint32_t>(width_pieces_.size()));
    }
    geometry_.width_begin = width_begin_.data();
    geometry_.width_pieces = width_pieces_.data();
}

void TrackStore::build_segments() {
    TrackGeometry& g = geometry_;
    const double cell = 1.0 / g.inverse_cell;
    const double reach = std::sqrt(2.0) * cell;  // twice the half diagonal of a cell
    std::vector<double> distance(segments_.size());
    segment_begin_.push_back(0);
    for (int32_t row = 0; row < g.grid_rows; ++row) {
        for (int32_t column = 0; column < g.grid_columns; ++column) {
            const double x = g.grid_x + (column + 0.5) * cell;
            const double y = g.grid_y + (row + 0.5) * cell;
            double nearest = 1e300;
            for (size_t i = 0; i < segments_.size(); ++i) {
                distance[i] = distance_to(segments_[i], x, y);
                nearest = std::min(nearest, distance[i]);
            }
            for (size_t i = 0; i < segments_.size(); ++i) {
                if (distance[i] <= nearest + reach + 1e-9) segment_items_.push_back(static_cast<uint16_t>(i));
            }
            segment_begin_.push_back(static_cast<uint32_t>(segment_items_.size()));
        }
    }
    g.segment_begin = segment_begin_.data();
    g.segment_items = segment_items_.data();
}

void TrackStore::build_bands() {
    TrackGeometry& g = geometry_;
    const double cell = 1.0 / g.inverse_cell;
    band_begin_.push_back(0);
    for (int32_t row = 0; row < g.grid_rows; ++row) {
        const double low = g.grid_y + row * cell - 1e-9;
        const double high = g.grid_y + (row + 1) * cell + 1e-9;
        for (size_t i = 0; i < border_.size(); i += 4) {
            const double x0 = border_[i], y0 = border_[i + 1], x1 = border_[i + 2], y1 = border_[i + 3];
            if (y0 == y1 || std::max(y0, y1) < low || std::min(y0, y1) > high) continue;
            edge_x0_.push_back(x0);
            edge_y0_.push_back(y0);
            edge_y1_.push_back(y1);
            edge_slope_.push_back((x1 - x0) / (y1 - y0));
        }
        band_begin_.push_back(static_cast<uint32_t>(edge_x0_.size()));
    }
    g.band_begin = band_begin_.data();
    g.edge_x0 = edge_x0_.data();
    g.edge_y0 = edge_y0_.data();
    g.edge_y1 = edge_y1_.data();
    g.edge_slope = edge_slope_.data();

    // A cell no border comes near is uniform; its centre then speaks for all of it.
    const size_t cells = static_cast<size_t>(g.grid_columns) * static_cast<size_t>(g.grid_rows);
    cell_kind_.assign(cells, kCellOutside);
    for (size_t i = 0; i < border_.size(); i += 4) {
        const double x0 = border_[i], y0 = border_[i + 1], x1 = border_[i + 2], y1 = border_[i + 3];
        const auto index = [&](double value, double origin, int32_t limit) {
            return std::clamp(static_cast<int32_t>(std::floor((value - origin) * g.inverse_cell)), 0,
                              limit - 1);
        };
        const int32_t first_row = index(std::min(y0, y1) - 1e-9, g.grid_y, g.grid_rows);
        const int32_t last_row = index(std::max(y0, y1) + 1e-9, g.grid_y, g.grid_rows);
        const int32_t first_column = index(std::min(x0, x1) - 1e-9, g.grid_x, g.grid_columns);
        const int32_t last_column = index(std::max(x0, x1) + 1e-9, g.grid_x, g.grid_columns);
        for (int32_t row = first_row; row <= last_row; ++row) {
            for (int32_t column = first_column; column <= last_column; ++column) {
                cell_kind_[static_cast<size_t>(row) * g.grid_columns + column] = kCellMixed;
            }
        }
    }
    g.cell_kind = cell_kind_.data();
    for (int32_t row = 0; row < g.grid_rows; ++row) {
        for (int32_t column = 0; column < g.grid_columns; ++column) {
            uint8_t& kind = cell_kind_[static_cast<size_t>(row) * g.grid_columns + column];
            if (kind == kCellMixed) continue;
            kind = kCellMixed;  // asks is_on_road() to count for itself
            const bool inside =
                is_on_road(g, g.grid_x + (column + 0.5) * cell, g.grid_y + (row + 0.5) * cell);
            kind = inside ? kCellInside : kCellOutside;
        }
    }
}

}  // namespace racecraft
