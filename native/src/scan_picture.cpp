#include "scan_picture.hpp"

#include <algorithm>

#include "perspective.hpp"
#include "racecraft/lidar.hpp"

namespace racecraft {
namespace {

constexpr float kBeamHeight = 0.13f;  // m, the scanner's on the car's roof
constexpr float kBeamAlpha = 0.30f;
constexpr float kDotAlpha = 0.95f;
constexpr float kDotRadius = 0.020f;  // m, as far as the picture resolves it
constexpr float kBeamColour[3] = {255.0f, 58.0f, 48.0f};

// Where a beam from (x, y) m in the unit direction (dx, dy) ends, without the sensor's noise.
float beam_length(const GroundView& ground, const ScanPicture& scan, float x, float y, float dx, float dy) {
    const Room room = {ground.min_x, ground.min_y, ground.max_x, ground.max_y};
    float distance = min_of(distance_to_walls(room, x, y, dx, dy), kLidarFarthest);
    for (int i = 0; i < scan.num_objects; ++i) {
        const CarPicture& object = scan.objects[i];
        const ObjectKind kind = object.is_box ? ObjectKind::box : ObjectKind::parked_car;
        float sine, cosine;
        sincos_of(object.heading, sine, cosine);
        const float from_x = x - object.x;
        const float from_y = y - object.y;
        const float hit = distance_to_rectangle(
            half_length(kind), half_width(kind), from_x * cosine + from_y * sine,
            from_y * cosine - from_x * sine, dx * cosine + dy * sine, dy * cosine - dx * sine);
        distance = min_of(distance, hit);
    }
    return distance;
}

class BeamPainter {
  public:
    BeamPainter(const CameraSpec& spec, const LensPose& lens, uint8_t* out)
        : spec_(spec), perspective_(spec, lens), out_(out) {}

    void line(Vector3 from, Vector3 to) {
        if (from.z < kNearestSeen && to.z < kNearestSeen) return;
        const float length = max_of(abs_of(to.x - from.x), abs_of(to.y - from.y));
        // The part of it within the picture, in shares of its length.
        float begin = 0.0f, end = 1.0f;
        clip(from.x, to.x, static_cast<float>(spec_.width), begin, end);
        clip(from.y, to.y, static_cast<float>(spec_.height), begin, end);
        if (begin >= end) return;
        const int steps = static_cast<int>((end - begin) * length) + 1;
        for (int i = 0; i < steps; ++i) {
            const float share =
                begin + (end - begin) * (static_cast<float>(i) + 0.5f) / static_cast<float>(steps);
            splat(from.x + share * (to.x - from.x), from.y + share * (to.y - from.y), kBeamAlpha);
        }
    }

    void dot(Vector3 point) {
        const Vector3 at = perspective_.project(point);
        if (at.z < kNearestSeen) return;
        const float radius = clamp(kDotRadius * perspective_.scale(at.z), 1.0f, 4.0f);
        const int x0 = pixel(at.x - radius - 1.0f, spec_.width),
                  x1 = pixel(at.x + radius + 2.0f, spec_.width);
        const int y0 = pixel(at.y - radius - 1.0f, spec_.height),
                  y1 = pixel(at.y + radius + 2.0f, spec_.height);
        for (int y = y0; y < y1; ++y) {
            for (int x = x0; x < x1; ++x) {
                const float dx = static_cast<float>(x) + 0.5f - at.x;
                const float dy = static_cast<float>(y) + 0.5f - at.y;
                blend(x, y, kDotAlpha * clamp(radius + 0.5f - sqrt_of(dx * dx + dy * dy), 0.0f, 1.0f));
            }
        }
    }

    // A beam's end may lie behind the lens: cut where the lens begins to see.
    void beam(Vector3 from, Vector3 to) {
        Vector3 a = perspective_.project(from), b = perspective_.project(to);
        if (a.z < kNearestSeen && b.z < kNearestSeen) return;
        const float share = (2.0f * kNearestSeen - a.z) / (b.z - a.z);
        const Vector3 cut = {from.x + share * (to.x - from.x), from.y + share * (to.y - from.y), from.z};
        if (a.z < kNearestSeen) a = perspective_.project(cut);
        if (b.z < kNearestSeen) b = perspective_.project(cut);
        line(a, b);
    }

  private:
    static int pixel(float value, int limit) {
        return static_cast<int>(clamp(value, 0.0f, static_cast<float>(limit)));
    }

    static void clip(float from, float to, float limit, float& begin, float& end) {
        const float span = to - from;
        if (abs_of(span) < 1e-6f) {
            if (from < 0.0f || from >= limit) end = begin;
            return;
        }
        const float low = -from / span;
        const float high = (limit - from) / span;
        begin = max_of(begin, min_of(low, high));
        end = min_of(end, max_of(low, high));
    }

    // Light on the four pixels about a point, as much as it lies in each.
    void splat(float x, float y, float alpha) {
        const float left = x - 0.5f, upper = y - 0.5f;
        const int column = static_cast<int>(left + 1.0f) - 1, row = static_cast<int>(upper + 1.0f) - 1;
        const float right_share = left - static_cast<float>(column),
                    lower_share = upper - static_cast<float>(row);
        blend(column, row, alpha * (1.0f - right_share) * (1.0f - lower_share));
        blend(column + 1, row, alpha * right_share * (1.0f - lower_share));
        blend(column, row + 1, alpha * (1.0f - right_share) * lower_share);
        blend(column + 1, row + 1, alpha * right_share * lower_share);
    }

    void blend(int x, int y, float alpha) {
        if (x < 0 || y < 0 || x >= spec_.width || y >= spec_.height) return;
        uint8_t* at =
            out_ + 3 * (static_cast<size_t>(y) * static_cast<size_t>(spec_.width) + static_cast<size_t>(x));
        for (int c = 0; c < 3; ++c) {
            at[c] = static_cast<uint8_t>(at[c] + alpha * (kBeamColour[c] - at[c]) + 0.5f);
        }
    }

    CameraSpec spec_;
    Perspective perspective_;
    uint8_t* out_;
};

}  // namespace

void draw_scan(const CameraSpec& spec, const LensPose& lens, const GroundView& ground,
               const ScanPicture& scan, ScanPart part, uint8_t* out) {
    BeamPainter painter(spec, lens, out);
    float sine, cosine;
    sincos_of(scan.heading, sine, cosine);
    const Vector3 source = {scan.x + kLidarForward * cosine, scan.y + kLidarForward * sine, kBeamHeight};
    for (int32_t ray = 0; ray < kLidarRays; ++ray) {
        float dy, dx;
        sincos_of(scan.heading + lidar_angle(ray), dy, dx);
        const float length = beam_length(ground, scan, source.x, source.y, dx, dy);
        const Vector3 end = {source.x + length * dx, source.y + length * dy, kBeamHeight};
        const bool is_facing = (end.x - lens.x) * dx + (end.y - lens.y) * dy > 0.0f;
        if (part == ScanPart::beams) painter.beam(source, end);
        if (is_facing == (part == ScanPart::facing_ends)) painter.dot(end);
    }
}

}  // namespace racecraft
