// Objects in a driver's grey frame, drawn over the room: convex solids, far to near, with exact coverage.
// Rows do not depend on each other, so any of them may be drawn alone.
#pragma once

#include "racecraft/camera.hpp"
#include "racecraft/face_fill.hpp"
#include "racecraft/object_look.hpp"

namespace racecraft {
namespace {  // so that one instruction set's copy can never be linked into another's kernel

constexpr float kNearestDepth = 0.02f;  // m along the optical axis

// The corners of a solid's faces, counter-clockwise from outside. Bits of a corner: 1 front, 2 left, 4 top.
constexpr int kNumCorners = 8;
constexpr int kFaces[kMostFaces][4] = {{1, 3, 7, 5}, {0, 4, 6, 2}, {2, 6, 7, 3}, {0, 1, 5, 4}, {4, 5, 7, 6}};
constexpr int kTopFace = 4;

template <int32_t kMaxWidth>
class ObjectPainter {
  public:
    // Draws into rows [first_row, last_row) only.
    ObjectPainter(const CameraSpec& spec, const LensPose& lens, int32_t first_row, int32_t last_row,
                  uint8_t* out)
        : lens_(lens),
          above_(spec.above),
          middle_x_(0.5f * static_cast<float>(spec.width)),
          middle_y_(0.5f * static_cast<float>(spec.height)),
          filler_(spec.width, spec.height, first_row, last_row, out) {
        float sine, cosine;
        sincos_of(0.5f * spec.hfov, sine, cosine);
        focal_ = middle_x_ * cosine / sine;
        sincos_of(spec.pitch, pitch_sine_, pitch_cosine_);
    }

    void draw(const ObjectState& object, Rgb body) {
        // Where the lens is and looks, seen from the object.
        const float dx = lens_.x - object.x;
        const float dy = lens_.y - object.y;
        lens_x_ = dx * object.cosine + dy * object.sine;
        lens_y_ = dy * object.cosine - dx * object.sine;
        axis_x_ = lens_.cosine * object.cosine + lens_.sine * object.sine;
        axis_y_ = lens_.sine * object.cosine - lens_.cosine * object.sine;
        sun_x_ = kSunX * object.cosine + kSunY * object.sine;
        sun_y_ = kSunY * object.cosine - kSunX * object.sine;
        if (object.kind == ObjectKind::box) {
            draw_box();
        } else {
            draw_car(body);
        }
    }

  private:
    // Points in the object's frame, m.
    template <int kCount>
    struct Points {
        float x[kCount], y[kCount], z[kCount];
    };

    // Points as the lens sees them, m, and where in the image, pixels.
    template <int kCount>
    struct Views {
        float right[kCount], down[kCount], depth[kCount];
        float x[kCount], y[kCount];
    };

    void draw_box() {
        draw_solid(kBoxSolid, kCardboard, kCardboard);
        if (lens_x_ * lens_x_ + lens_y_ * lens_y_ > kTapeReach * kTapeReach) return;
        const float side = lens_x_ > 0.0f ? 0.5f * kBoxLength : -0.5f * kBoxLength;
        if (abs_of(lens_x_) <= abs_of(side)) return;
        Points<4> corners;
        for (int i = 0; i < 4; ++i) {
            corners.x[i] = side;
            corners.y[i] = i == 0 || i == 3 ? -kTapeHalfWidth : kTapeHalfWidth;
            corners.z[i] = i < 2 ? kBoxHeight : kBoxHeight - kTapeLength;
        }
        Views<4> seen;
        look_at(corners, seen);
        num_polygons_ = 0;
        const int order[4] = {0, 1, 2, 3};
        add_face(seen, order, kTape, side > 0.0f ? sun_x_ : -sun_x_);
        filler_.draw(polygons_, num_polygons_);
    }

    void draw_car(Rgb body) {
        if (lens_x_ * lens_x_ + lens_y_ * lens_y_ > kWheelReach * kWheelReach) {
            draw_solid(kAxlesSolid, kTyre, body);
            draw_solid(kHullSolid, body, body);
            draw_solid(kCabinSolid, kGlass, body);
            return;
        }
        const float near_side = lens_y_ > 0.0f ? 1.0f : -1.0f;
        const bool from_behind = lens_x_ < 0.0f;
        const float axles[2] = {from_behind ? kFrontAxleX : kRearAxleX,
                                from_behind ? kRearAxleX : kFrontAxleX};
        for (const float axle : axles) draw_wheel(axle, -near_side, body);
        draw_solid(kHullSolid, body, body);
        for (const float axle : axles) draw_wheel(axle, near_side, body);
        if (!from_behind) draw_solid(kWingSolid, accent_of(body), body);
        draw_solid(kCabinSolid, kGlass, body);
        if (from_behind) draw_solid(kWingSolid, accent_of(body), body);
    }

    void draw_wheel(float axle, float side, Rgb fender) {
        const float back = axle - kWheelLength;
        const float front = axle + kWheelLength;
        const Solid wheel = {back,
                             front,
                             kWheelHalfWidth,
                             0.0f,
                             back,
                             front,
                             kWheelHalfWidth,
                             2.0f * kWheelLength,
                             side * kWheelMiddle};
        draw_solid(wheel, kTyre, fender);
    }

    RC_APART void draw_solid(const Solid& solid, Rgb sides, Rgb top) {
        Points<kNumCorners> corners;
        for (int i = 0; i < kNumCorners; ++i) {
            const bool is_top = (i & 4) != 0;
            const float back = is_top ? solid.back_top : solid.back_bottom;
            const float front = is_top ? solid.front_top : solid.front_bottom;
            const float half = is_top ? solid.half_top : solid.half_bottom;
            corners.x[i] = (i & 1) != 0 ? front : back;
            corners.y[i] = solid.y + ((i & 2) != 0 ? half : -half);
            corners.z[i] = is_top ? solid.top : solid.bottom;
        }
        Views<kNumCorners> views;
        look_at(corners, views);
        if (is_outside(views)) return;
        num_polygons_ = 0;
        for (int face = 0; face < kMostFaces; ++face) {
            const int* at = kFaces[face];
            const float x = corners.x[at[0]], y = corners.y[at[0]], z = corners.z[at[0]];
            const float ax = corners.x[at[1]] - x, ay = corners.y[at[1]] - y, az = corners.z[at[1]] - z;
            const float bx = corners.x[at[3]] - x, by = corners.y[at[3]] - y, bz = corners.z[at[3]] - z;
            const float nx = ay * bz - az * by, ny = az * bx - ax * bz, nz = ax * by - ay * bx;
            const float towards = nx * (lens_x_ - x) + ny * (lens_y_ - y) + nz * (above_ - z);
            if (towards <= 0.0f) continue;
            const float size = sqrt_of(nx * nx + ny * ny + nz * nz);
            const float facing = (nx * sun_x_ + ny * sun_y_ + nz * kSunZ) / max_of(size, 1e-12f);
            add_face(views, at, face == kTopFace ? top : sides, facing);
        }
        filler_.draw(polygons_, num_polygons_);
    }

    // Whether all of it is to one side of the image.
    bool is_outside(const Views<kNumCorners>& views) const {
        bool is_left = true, is_right = true, is_above = true, is_below = true, is_ahead = true;
        for (int i = 0; i < kNumCorners; ++i) {
            is_left &= views.x[i] < 0.0f;
            is_right &= views.x[i] > 2.0f * middle_x_;
            is_above &= views.y[i] < 0.0f;
            is_below &= views.y[i] > 2.0f * middle_y_;
            is_ahead &= !(views.depth[i] < kNearestDepth);
        }
        return is_ahead && (is_left || is_right || is_above || is_below);
    }

    template <int kCount>
    void look_at(const Points<kCount>& points, Views<kCount>& views) const {
        for (int i = 0; i < kCount; ++i) {
            const float dx = points.x[i] - lens_x_;
            const float dy = points.y[i] - lens_y_;
            const float up = points.z[i] - above_;
            const float ahead = dx * axis_x_ + dy * axis_y_;
            views.right[i] = dx * axis_y_ - dy * axis_x_;
            views.down[i] = -ahead * pitch_sine_ - up * pitch_cosine_;
            views.depth[i] = ahead * pitch_cosine_ - up * pitch_sine_;
        }
        for (int i = 0; i < kCount; ++i) {
            project(views.right[i], views.down[i], views.depth[i], views.x[i], views.y[i]);
        }
    }

    void project(float right, float down, float depth, float& x, float& y) const {
        const float scale = focal_ / max_of(depth, kNearestDepth);
        // Beyond these nothing is seen; without them, numbers could outgrow what a row index holds.
        x = clamp(middle_x_ + scale * right, -1e5f, 1e5f);
        y = clamp(middle_y_ + scale * down, -1e5f, 1e5f);
    }

    // Adds the face with the corners `at`, cut at the near plane, if the image shows any of it.
    template <int kCount>
    void add_face(const Views<kCount>& views, const int* at, Rgb colour, float facing) {
        Polygon& polygon = polygons_[num_polygons_];
        polygon.count = 0;
        for (int i = 0; i < 4; ++i) {
            const int here = at[i];
            const int next = at[(i + 1) & 3];
            const bool is_here = views.depth[here] >= kNearestDepth;
            if (is_here) {
                polygon.x[polygon.count] = views.x[here];
                polygon.y[polygon.count] = views.y[here];
                ++polygon.count;
            }
            if (is_here != (views.depth[next] >= kNearestDepth)) {
                const float share =
                    (kNearestDepth - views.depth[here]) / (views.depth[next] - views.depth[here]);
                project(views.right[here] + share * (views.right[next] - views.right[here]),
                        views.down[here] + share * (views.down[next] - views.down[here]), kNearestDepth,
                        polygon.x[polygon.count], polygon.y[polygon.count]);
                ++polygon.count;
            }
        }
        if (polygon.count < 3) return;
        const uint8_t rgb[3] = {colour.red, colour.green, colour.blue};
        const float shade = static_cast<float>(grey_of(rgb)) * light_on(facing) + 0.5f;
        if (filler_.prepare(polygon, static_cast<int32_t>(shade))) ++num_polygons_;
    }

    LensPose lens_;
    float above_;
    float middle_x_, middle_y_, focal_, pitch_sine_, pitch_cosine_;
    float lens_x_ = 0.0f, lens_y_ = 0.0f;  // m, in the object's frame
    float axis_x_ = 1.0f, axis_y_ = 0.0f;  // where the lens looks, in the object's frame
    float sun_x_ = 0.0f, sun_y_ = 0.0f;
    Polygon polygons_[kMostFaces];
    int num_polygons_ = 0;
    FaceFiller<kMaxWidth> filler_;
};

// Draws the objects over rows [first_row, last_row) of `out` (height, width), which shows the room from the
// same lens. Objects are convex in plan and stand apart, so far to near is their right order; the room is
// convex, so no wall hides one.
template <int32_t kMaxWidth>
RC_HD void paint_objects(const CameraSpec& spec, const LensPose& lens, const ObjectsAround& around,
                         int32_t first_row, int32_t last_row, uint8_t* out) {
    // Those that the lens looks towards, far ones first; equally far ones by their number.
    int32_t order[kMaxAround];
    float distance[kMaxAround];
    float sine, cosine, pitch_sine, pitch_cosine;
    sincos_of(0.5f * spec.hfov, sine, cosine);
    sincos_of(spec.pitch, pitch_sine, pitch_cosine);
    int32_t seen = 0;
    for (int32_t i = 0; i < around.count; ++i) {
        const ObjectState& object = object_at(around, i);
        if (!is_there(object)) continue;
        const float dx = object.x - lens.x;
        const float dy = object.y - lens.y;
        const float ahead = dx * lens.cosine + dy * lens.sine;
        const float right = abs_of(dx * lens.sine - dy * lens.cosine);
        const float reach = half_length(object.kind) + half_width(object.kind);
        // Not farther aside than the opening angle lets it be at the greatest depth that any part of it can
        // have.
        const float depth = (ahead + reach) * pitch_cosine + spec.above * abs_of(pitch_sine);
        if (depth < kNearestDepth || (right - reach) * cosine > depth * sine) continue;
        const float d = dx * dx + dy * dy;
        int32_t k = seen++;
        for (; k > 0 && distance[k - 1] < d; --k) {
            distance[k] = distance[k - 1];
            order[k] = order[k - 1];
        }
        distance[k] = d;
        order[k] = i;
    }
    if (seen == 0) return;
    ObjectPainter<kMaxWidth> painter(spec, lens, first_row, last_row, out);
    for (int32_t k = 0; k < seen; ++k) {
        painter.draw(object_at(around, order[k]), car_colour(around, order[k]));
    }
}

}  // namespace
}  // namespace racecraft
