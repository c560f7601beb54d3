// Objects in a driver's grey frame, drawn over the room: convex solids, far to near, with exact coverage.
// Rows do not depend on each other, so any of them may be drawn alone.
#pragma once

#include "racecraft/camera.hpp"
#include "racecraft/object_look.hpp"

namespace racecraft {

constexpr float kNearestDepth = 0.02f;  // m along the optical axis
constexpr int32_t kCover = 256;         // a pixel that is covered whole
constexpr int32_t kSubrows = 4;         // of a row in which a face begins, ends or has a corner
constexpr int kMostCorners = 5;         // of a quadrangle after the near plane has cut it

// The corners of a solid's faces, counter-clockwise from outside. Bits of a corner: 1 front, 2 left, 4 top.
constexpr int kMostFaces = 5;
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
          width_(spec.width),
          height_(spec.height),
          first_row_(first_row),
          last_row_(last_row),
          middle_x_(0.5f * static_cast<float>(spec.width)),
          middle_y_(0.5f * static_cast<float>(spec.height)),
          out_(out) {
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
    struct Point3 {
        float x, y, z;
    };

    // A corner as the lens sees it, m, and where in the image, pixels.
    struct View {
        float right, down, depth;
        float x, y;
    };

    struct Polygon {
        float x[kMostCorners], y[kMostCorners];  // pixels, y down
        float slope[kMostCorners];               // of the edge from here to the next corner, dx/dy
        int32_t count;
        int32_t shade;
        float top, bottom;  // the rows it spans, pixels
    };

    void draw_box() {
        draw_solid(kBoxSolid, kCardboard, kCardboard);
        if (lens_x_ * lens_x_ + lens_y_ * lens_y_ > kTapeReach * kTapeReach) return;
        const float side = lens_x_ > 0.0f ? 0.5f * kBoxLength : -0.5f * kBoxLength;
        if (abs_of(lens_x_) <= abs_of(side)) return;
        const Point3 corners[4] = {{side, -kTapeHalfWidth, kBoxHeight},
                                   {side, kTapeHalfWidth, kBoxHeight},
                                   {side, kTapeHalfWidth, kBoxHeight - kTapeLength},
                                   {side, -kTapeHalfWidth, kBoxHeight - kTapeLength}};
        View seen[4];
        for (int i = 0; i < 4; ++i) seen[i] = look_at(corners[i]);
        num_polygons_ = 0;
        add_face(seen, kTape, side > 0.0f ? sun_x_ : -sun_x_);
        draw_polygons();
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
        Point3 corners[8];
        for (int i = 0; i < 8; ++i) {
            const bool is_top = (i & 4) != 0;
            const float back = is_top ? solid.back_top : solid.back_bottom;
            const float front = is_top ? solid.front_top : solid.front_bottom;
            const float half = is_top ? solid.half_top : solid.half_bottom;
            corners[i] = {(i & 1) != 0 ? front : back, solid.y + ((i & 2) != 0 ? half : -half),
                          is_top ? solid.top : solid.bottom};
        }
        View views[8];
        bool is_left = true, is_right = true, is_above = true, is_below = true;  // of the image, all of it
        for (int i = 0; i < 8; ++i) {
            views[i] = look_at(corners[i]);
            is_left &= views[i].x < 0.0f;
            is_right &= views[i].x > 2.0f * middle_x_;
            is_above &= views[i].y < 0.0f;
            is_below &= views[i].y > 2.0f * middle_y_;
            if (views[i].depth < kNearestDepth) is_left = is_right = is_above = is_below = false;
        }
        if (is_left || is_right || is_above || is_below) return;
        num_polygons_ = 0;
        for (int face = 0; face < kMostFaces; ++face) {
            const int* at = kFaces[face];
            const Point3 quad[4] = {corners[at[0]], corners[at[1]], corners[at[2]], corners[at[3]]};
            const Point3 a = {quad[1].x - quad[0].x, quad[1].y - quad[0].y, quad[1].z - quad[0].z};
            const Point3 b = {quad[3].x - quad[0].x, quad[3].y - quad[0].y, quad[3].z - quad[0].z};
            const Point3 n = {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
            const float towards =
                n.x * (lens_x_ - quad[0].x) + n.y * (lens_y_ - quad[0].y) + n.z * (above_ - quad[0].z);
            if (towards <= 0.0f) continue;
            const float size = sqrt_of(n.x * n.x + n.y * n.y + n.z * n.z);
            const float facing = (n.x * sun_x_ + n.y * sun_y_ + n.z * kSunZ) / max_of(size, 1e-12f);
            const View seen[4] = {views[at[0]], views[at[1]], views[at[2]], views[at[3]]};
            add_face(seen, face == kTopFace ? top : sides, facing);
        }
        draw_polygons();
    }

    View look_at(Point3 corner) const {
        const float dx = corner.x - lens_x_;
        const float dy = corner.y - lens_y_;
        const float up = corner.z - above_;
        const float ahead = dx * axis_x_ + dy * axis_y_;
        return on_image(dx * axis_y_ - dy * axis_x_, -ahead * pitch_sine_ - up * pitch_cosine_,
                        ahead * pitch_cosine_ - up * pitch_sine_);
    }

    View on_image(float right, float down, float depth) const {
        const float scale = focal_ / max_of(depth, kNearestDepth);
        // Beyond these nothing is seen; without them, numbers could outgrow what a row index holds.
        return {right, down, depth, clamp(middle_x_ + scale * right, -1e5f, 1e5f),
                clamp(middle_y_ + scale * down, -1e5f, 1e5f)};
    }

    // Adds a face, cut at the near plane.
    RC_APART void add_face(const View* corners, Rgb colour, float facing) {
        Polygon& polygon = polygons_[num_polygons_];
        polygon.count = 0;
        for (int i = 0; i < 4; ++i) {
            const View& here = corners[i];
            const View& next = corners[(i + 1) & 3];
            if (here.depth >= kNearestDepth) add_corner(polygon, here);
            if ((here.depth >= kNearestDepth) != (next.depth >= kNearestDepth)) {
                const float share = (kNearestDepth - here.depth) / (next.depth - here.depth);
                add_corner(polygon, on_image(here.right + share * (next.right - here.right),
                                             here.down + share * (next.down - here.down), kNearestDepth));
            }
        }
        if (polygon.count < 3) return;
        polygon.top = polygon.bottom = polygon.y[0];
        float left = polygon.x[0];
        float right = polygon.x[0];
        for (int i = 1; i < polygon.count; ++i) {
            polygon.top = min_of(polygon.top, polygon.y[i]);
            polygon.bottom = max_of(polygon.bottom, polygon.y[i]);
            left = min_of(left, polygon.x[i]);
            right = max_of(right, polygon.x[i]);
        }
        if (right <= 0.0f || left >= static_cast<float>(width_) || polygon.bottom <= 0.0f ||
            polygon.top >= static_cast<float>(height_)) {
            return;
        }
        const uint8_t rgb[3] = {colour.red, colour.green, colour.blue};
        for (int i = 0; i < polygon.count; ++i) {
            const int k = i + 1 == polygon.count ? 0 : i + 1;
            const float dy = polygon.y[k] - polygon.y[i];
            polygon.slope[i] = dy == 0.0f ? 0.0f : (polygon.x[k] - polygon.x[i]) / dy;
        }
        polygon.shade = static_cast<int32_t>(static_cast<float>(grey_of(rgb)) * light_on(facing) + 0.5f);
        ++num_polygons_;
    }

    static void add_corner(Polygon& polygon, const View& corner) {
        polygon.x[polygon.count] = corner.x;
        polygon.y[polygon.count] = corner.y;
        ++polygon.count;
    }

    // Lays the faces of one solid over the frame. They meet without overlap, so what they cover adds up.
    RC_APART void draw_polygons() {
        if (num_polygons_ == 0) return;
        float top = polygons_[0].top;
        float bottom = polygons_[0].bottom;
        float left = 1e6f;
        float right = -1e6f;
        for (int p = 0; p < num_polygons_; ++p) {
            top = min_of(top, polygons_[p].top);
            bottom = max_of(bottom, polygons_[p].bottom);
            for (int i = 0; i < polygons_[p].count; ++i) {
                left = min_of(left, polygons_[p].x[i]);
                right = max_of(right, polygons_[p].x[i]);
            }
        }
        const int32_t first_row = max_of(static_cast<int32_t>(max_of(top, 0.0f)), first_row_);
        const int32_t last_row = static_cast<int32_t>(min_of(bottom, static_cast<float>(height_) - 0.5f));
        const int32_t end_row = min_of(last_row + 1, last_row_);
        if (first_row >= end_row) return;
        begin_ = static_cast<int32_t>(clamp(left, 0.0f, static_cast<float>(width_) - 1.0f));
        end_ = static_cast<int32_t>(clamp(right, 0.0f, static_cast<float>(width_) - 1.0f)) + 1;
        for (int32_t i = begin_; i <= end_ + 1; ++i) cover_[i] = shade_[i] = 0;
        for (int32_t row = first_row; row < end_row; ++row) {
            if (has_corner(static_cast<float>(row))) {
                draw_mixed_row(row);
            } else {
                draw_plain_row(row);
            }
        }
    }

    // Whether any face has a corner in the row; otherwise the row's middle stands for all of it.
    bool has_corner(float upper) const {
        bool is_found = false;
        for (int p = 0; p < num_polygons_; ++p) {
            const Polygon& polygon = polygons_[p];
            for (int i = 0; i < polygon.count; ++i) {
                is_found |= polygon.y[i] > upper && polygon.y[i] < upper + 1.0f;
            }
        }
        return is_found;
    }

    static bool is_beside(const Polygon& polygon, int32_t row) {
        return polygon.bottom <= static_cast<float>(row) || polygon.top >= static_cast<float>(row + 1);
    }

    // Where a line at height y is inside a polygon; false where it misses it.
    bool find_span(const Polygon& polygon, float y, float& left, float& right) const {
        left = 1e6f;
        right = -1e6f;
        for (int i = 0; i < polygon.count; ++i) {
            const int k = i + 1 == polygon.count ? 0 : i + 1;
            if ((polygon.y[i] <= y) == (polygon.y[k] <= y)) continue;
            const float x = polygon.x[i] + (y - polygon.y[i]) * polygon.slope[i];
            left = min_of(left, x);
            right = max_of(right, x);
        }
        left = clamp(left, static_cast<float>(begin_), static_cast<float>(end_));
        right = clamp(right, static_cast<float>(begin_), static_cast<float>(end_));
        return left < right;
    }

    // A row without corners: what is covered whole is filled at once, the pixels at the edges are mixed.
    void draw_plain_row(int32_t row) {
        uint8_t* line = out_ + static_cast<size_t>(row) * static_cast<size_t>(width_);
        int32_t mixed[2 * kMostFaces];
        int32_t count = 0;
        for (int p = 0; p < num_polygons_; ++p) {
            const Polygon& polygon = polygons_[p];
            if (is_beside(polygon, row)) continue;
            float left, right;
            if (!find_span(polygon, static_cast<float>(row) + 0.5f, left, right)) continue;
            const int32_t first = static_cast<int32_t>(left);
            const int32_t last = static_cast<int32_t>(right);
            const int32_t before = static_cast<int32_t>((left - static_cast<float>(first)) * kCover);
            const int32_t within = static_cast<int32_t>((right - static_cast<float>(last)) * kCover);
            if (first == last) {
                add_cover(first, within - before, polygon.shade);
            } else {
                add_cover(first, kCover - before, polygon.shade);
                add_cover(last, within, polygon.shade);
                if (last > first + 1) {
                    const uint8_t shade =
                        static_cast<uint8_t>(polygon.shade);  // a local, since bytes may alias anything
                    for (int32_t x = first + 1; x < last; ++x) line[x] = shade;
                }
                mixed[count++] = last;
            }
            mixed[count++] = first;
        }
        for (int32_t i = 0; i < count; ++i) {
            const int32_t x = mixed[i];
            if (x < end_) line[x] = mix(line[x], cover_[x], shade_[x] + kCover / 2);
            cover_[x] = 0;
            shade_[x] = 0;
        }
    }

    void add_cover(int32_t x, int32_t cover, int32_t shade) {
        cover_[x] += cover;
        shade_[x] += cover * shade;
    }

    // A row with corners: the mean of some lines, each gathered as changes from pixel to pixel.
    void draw_mixed_row(int32_t row) {
        constexpr int32_t weight = kCover / kSubrows;
        bool is_seen = false;
        for (int p = 0; p < num_polygons_; ++p) {
            if (is_beside(polygons_[p], row)) continue;
            for (int k = 0; k < kSubrows; ++k) {
                const float y = static_cast<float>(row) + (static_cast<float>(k) + 0.5f) * (1.0f / kSubrows);
                float left, right;
                if (!find_span(polygons_[p], y, left, right)) continue;
                add_edge(left, weight, polygons_[p].shade);
                add_edge(right, -weight, polygons_[p].shade);
                is_seen = true;
            }
        }
        if (!is_seen) return;
        uint8_t* line = out_ + static_cast<size_t>(row) * static_cast<size_t>(width_);
        int32_t cover = 0;
        int32_t shade = kCover / 2;
        for (int32_t x = begin_; x < end_; ++x) {
            cover += cover_[x];
            shade += shade_[x];
            cover_[x] = 0;
            shade_[x] = 0;
            line[x] = mix(line[x], cover, shade);
        }
        cover_[end_] = cover_[end_ + 1] = shade_[end_] = shade_[end_ + 1] = 0;
    }

    // From x on, the row is covered by `weight` more.
    void add_edge(float x, int32_t weight, int32_t shade) {
        const int32_t pixel = static_cast<int32_t>(x);
        const int32_t later =
            static_cast<int32_t>((x - static_cast<float>(pixel)) * static_cast<float>(weight));
        add_cover(pixel, weight - later, shade);
        add_cover(pixel + 1, later, shade);
    }

    // Rounding of shared edges may cover a pixel a little more than whole.
    static uint8_t mix(uint8_t behind, int32_t cover, int32_t shade) {
        return static_cast<uint8_t>(min_of((behind * max_of(kCover - cover, 0) + shade) >> 8, 255));
    }

    LensPose lens_;
    float above_;
    int32_t width_, height_, first_row_, last_row_;
    float middle_x_, middle_y_, focal_, pitch_sine_, pitch_cosine_;
    uint8_t* out_;
    float lens_x_ = 0.0f, lens_y_ = 0.0f;  // m, in the object's frame
    float axis_x_ = 1.0f, axis_y_ = 0.0f;  // where the lens looks, in the object's frame
    float sun_x_ = 0.0f, sun_y_ = 0.0f;
    Polygon polygons_[kMostFaces];
    int num_polygons_ = 0;
    int32_t begin_ = 0, end_ = 0;   // columns that the solid at hand spans
    int32_t cover_[kMaxWidth + 2];  // coverage of a pixel, or its change along a row; 0 between rows
    int32_t shade_[kMaxWidth + 2];  // the same times brightness
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

}  // namespace racecraft
