// The renderer's reference: one ray after the other, against the track's own lines. Slow, obvious, and shares
// nothing with the renderer but the facts: sizes of lines and room, pose of the lens, colours.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "racecraft/camera.hpp"
#include "track_outline.hpp"

namespace racecraft::test {

class RayCaster {
  public:
    RayCaster(const TrackOutline& outline, const GreyPalette& palette)
        : outline_(outline), palette_(palette) {
        for (const double* line : {outline.center, outline.inner, outline.outer}) {
            for (int i = 0; i < outline.count; ++i) {
                min_x_ = std::min(min_x_, line[2 * i] - kRoomMargin);
                max_x_ = std::max(max_x_, line[2 * i] + kRoomMargin);
                min_y_ = std::min(min_y_, line[2 * i + 1] - kRoomMargin);
                max_y_ = std::max(max_y_, line[2 * i + 1] + kRoomMargin);
            }
        }
        add_border(outline.outer, false);
        add_border(outline.inner, true);
        if (!outline.is_closed) {
            const int last = outline.count - 1;
            borders_.push_back({outline.outer[0], outline.outer[1], outline.inner[0], outline.inner[1]});
            borders_.push_back({outline.outer[2 * last], outline.outer[2 * last + 1], outline.inner[2 * last],
                                outline.inner[2 * last + 1]});
        }
    }

    // Mean brightness of side x side rays per pixel (height * width).
    std::vector<double> frame(const CameraSpec& spec, double x, double y, double heading, int side) const {
        const double focal = 0.5 * spec.width / std::tan(0.5 * spec.hfov);
        const double lens_x = x + spec.forward * std::cos(heading) - spec.left * std::sin(heading);
        const double lens_y = y + spec.forward * std::sin(heading) + spec.left * std::cos(heading);
        std::vector<double> pixels(size_t(spec.width) * spec.height);
        for (int row = 0; row < spec.height; ++row) {
            for (int column = 0; column < spec.width; ++column) {
                double sum = 0.0;
                for (int k = 0; k < side * side; ++k) {
                    const double right = (column + (k % side + 0.5) / side - 0.5 * spec.width) / focal;
                    const double down = (row + (k / side + 0.5) / side - 0.5 * spec.height) / focal;
                    const double ahead = std::cos(spec.pitch) - down * std::sin(spec.pitch);
                    const double fall = std::sin(spec.pitch) + down * std::cos(spec.pitch);
                    sum += brightness(lens_x, lens_y, spec.above,
                                      ahead * std::cos(heading) + right * std::sin(heading),
                                      ahead * std::sin(heading) - right * std::cos(heading), -fall);
                }
                pixels[size_t(row) * spec.width + column] = sum / (side * side);
            }
        }
        return pixels;
    }

    Material material_at(double x, double y) const {
        bool is_road = false;
        double nearest = 1e300;
        for (const Border& b : borders_) {
            if ((b.y0 <= y) != (b.y1 <= y) && x < b.x0 + (y - b.y0) / (b.y1 - b.y0) * (b.x1 - b.x0))
                is_road = !is_road;
            nearest = std::min(nearest, squared_distance(b.x0, b.y0, b.x1, b.y1, x, y, nullptr));
        }
        if (!is_road) return kField;
        if (nearest < double(kEdgeLineWidth) * kEdgeLineWidth) return kEdgeLine;
        return is_on_dash(x, y) ? kCenterLine : kRoad;
    }

  private:
    struct Border {
        double x0, y0, x1, y1;
    };

    void add_border(const double* line, bool) {
        for (int i = 0; i + 1 < outline_.count; ++i) {
            borders_.push_back({line[2 * i], line[2 * i + 1], line[2 * i + 2], line[2 * i + 3]});
        }
    }

    static double squared_length(const double* line, int i, int j) {
        const double dx = line[2 * j] - line[2 * i];
        const double dy = line[2 * j + 1] - line[2 * i + 1];
        return dx * dx + dy * dy;
    }

    static double squared_distance(double x0, double y0, double x1, double y1, double x, double y,
                                   double* share) {
        const double dx = x1 - x0;
        const double dy = y1 - y0;
        const double size = dx * dx + dy * dy;
        const double t = size > 0.0 ? std::clamp(((x - x0) * dx + (y - y0) * dy) / size, 0.0, 1.0) : 0.0;
        if (share != nullptr) *share = t;
        const double ox = x - x0 - t * dx;
        const double oy = y - y0 - t * dy;
        return ox * ox + oy * oy;
    }

    // Dashes are 1 inch wide and 2 inches long, every 4 inches along the centre line; the first begins 5.8 cm
    // after the first waypoint.
    bool is_on_dash(double x, double y) const {
        double travelled = 0.0;
        for (int i = 0; i + 1 < outline_.count; ++i) {
            const double* p = outline_.center + 2 * i;
            const double size = std::sqrt(squared_length(outline_.center, i, i + 1));
            double share;
            const double distance = squared_distance(p[0], p[1], p[2], p[3], x, y, &share);
            const double from_first = travelled + share * size - 0.058;
            if (distance < 0.0127 * 0.0127 && from_first >= 0.0 && std::fmod(from_first, 0.1016) < 0.0508)
                return true;
            travelled += size;
        }
        return false;
    }

    double brightness(double x, double y, double z, double dx, double dy, double dz) const {
        const double to_x = dx > 0.0 ? (max_x_ - x) / dx : dx < 0.0 ? (min_x_ - x) / dx : 1e300;
        const double to_y = dy > 0.0 ? (max_y_ - y) / dy : dy < 0.0 ? (min_y_ - y) / dy : 1e300;
        const double wall_height = z + std::min(to_x, to_y) * dz;
        if (wall_height < 0.0) return palette_.ground[material_at(x - z / dz * dx, y - z / dz * dy)];
        if (wall_height > kWallHeight) return palette_.sky;
        return palette_.wall[to_x < to_y ? (dx > 0.0 ? 0 : 2) : (dy > 0.0 ? 1 : 3)];
    }

    TrackOutline outline_;
    GreyPalette palette_;
    double min_x_ = 1e300, max_x_ = -1e300, min_y_ = 1e300, max_y_ = -1e300;
    std::vector<Border> borders_;
};

}  // namespace racecraft::test
