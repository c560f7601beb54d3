#include "scene.hpp"

#include <algorithm>
#include <numeric>
#include <vector>

#include "box_mesh.hpp"
#include "camera_kernel.hpp"
#include "car_mesh.hpp"
#include "perspective.hpp"
#include "racecraft/object_look.hpp"
#include "scan_picture.hpp"

namespace racecraft {
namespace {

constexpr int kSupersampling = 3;                   // per direction, of the cars
constexpr Vector3 kSun = {0.352f, 0.264f, 0.898f};  // unit vector towards the light, in the world
constexpr float kAmbient = 0.50f;                   // share of light that comes from everywhere
constexpr float kShadowLength = 0.205f;             // m, half axes of the soft shadow under a car
constexpr float kShadowWidth = 0.135f;
constexpr float kBoxShadowLength = 0.262f;
constexpr float kBoxShadowWidth = 0.205f;
constexpr float kShadowDepth = 0.55f;  // share of light that the shadow takes at most

// Pixels [x0, x1) x [y0, y1) of the image.
struct Box {
    int x0, y0, x1, y1;

    void cover(Vector3 p, const CameraSpec& spec) {
        const auto pixel = [](float value, int limit) {
            return static_cast<int>(clamp(value, 0.0f, static_cast<float>(limit)));
        };
        x0 = std::min(x0, pixel(p.x - 1.0f, spec.width));
        y0 = std::min(y0, pixel(p.y - 1.0f, spec.height));
        x1 = std::max(x1, pixel(p.x + 2.0f, spec.width));
        y1 = std::max(y1, pixel(p.y + 2.0f, spec.height));
    }
    bool is_empty() const { return x0 >= x1 || y0 >= y1; }
};

Box nothing(const CameraSpec& spec) {
    return {spec.width, spec.height, 0, 0};
}

struct Colour {
    float red, green, blue;
};

Colour paint_colour(Paint paint, const CarPicture& car) {
    const float red = car.colour[0], green = car.colour[1], blue = car.colour[2];
    switch (paint) {
        case Paint::body:
            return {red, green, blue};
        case Paint::accent:
            return {0.28f * red + 14.0f, 0.28f * green + 14.0f, 0.28f * blue + 16.0f};
        case Paint::glass:
            return {44.0f, 52.0f, 62.0f};
        case Paint::tyre:
            return {34.0f, 34.0f, 36.0f};
        case Paint::rim:
            return {170.0f, 172.0f, 178.0f};
        case Paint::light:
            return {250.0f, 248.0f, 230.0f};
        case Paint::tail_light:
            return {225.0f, 28.0f, 24.0f};
        case Paint::cardboard:
            return {kCardboard.red + 20.0f, kCardboard.green + 16.0f, kCardboard.blue + 10.0f};
        case Paint::flap:
            return {kCardboard.red + 12.0f, kCardboard.green + 10.0f, kCardboard.blue + 6.0f};
        case Paint::tape:
            return {kTape.red, kTape.green, kTape.blue};
        case Paint::ink:
            return {92.0f, 62.0f, 38.0f};
    }
    return {};
}

struct Sample {
    float depth;
    uint8_t red, green, blue, is_covered;
};

// One car, drawn into its own small supersampled depth buffer and laid over the picture.
class CarPainter {
  public:
    CarPainter(const CameraSpec& spec, const LensPose& lens) : spec_(spec), perspective_(spec, lens) {}

    void draw(const CarPicture& car, std::vector<Sample>& samples, uint8_t* out) {
        place(car);
        draw_shadow(car, out);
        const auto& mesh = car.is_box ? box_mesh() : car_mesh();
        box_ = nothing(spec_);
        for (const Triangle& triangle : mesh) {
            for (const Vector3& corner : triangle.corners) {
                const Vector3 p = perspective_.project(to_world(corner, triangle.wheel));
                if (p.z < kNearestSeen) return;  // the lens is inside the car
                box_.cover(p, spec_);
            }
        }
        if (box_.is_empty()) return;
        columns_ = (box_.x1 - box_.x0) * kSupersampling;
        rows_ = (box_.y1 - box_.y0) * kSupersampling;
        samples.assign(size_t(columns_) * rows_, Sample{1e30f, 0, 0, 0, 0});
        for (const Triangle& triangle : mesh) draw_triangle(triangle, car, samples);
        blend(car.alpha, samples, out);
    }

  private:
    void place(const CarPicture& car) {
        x_ = car.x;
        y_ = car.y;
        sincos_of(car.heading, sine_, cosine_);
        sincos_of(car.steering, steering_sine_, steering_cosine_);
    }

    Vector3 to_world(Vector3 p, int wheel) const {
        if (wheel != 0) {
            const Vector3 hub = front_wheel(wheel);
            const float dx = p.x - hub.x;
            const float dy = p.y - hub.y;
            p.x = hub.x + dx * steering_cosine_ - dy * steering_sine_;
            p.y = hub.y + dx * steering_sine_ + dy * steering_cosine_;
        }
        return {x_ + p.x * cosine_ - p.y * sine_, y_ + p.x * sine_ + p.y * cosine_, p.z};
    }

    void draw_shadow(const CarPicture& car, uint8_t* out) const {
        const float length = car.is_box ? kBoxShadowLength : kShadowLength;
        const float width = car.is_box ? kBoxShadowWidth : kShadowWidth;
        Box box = nothing(spec_);
        for (const float x : {-length, length}) {
            for (const float y : {-width, width}) {
                const Vector3 p = perspective_.project(to_world({x, y, 0.0f}, 0));
                if (p.z < kNearestSeen) return;
                box.cover(p, spec_);
            }
        }
        for (int row = box.y0; row < box.y1; ++row) {
            for (int column = box.x0; column < box.x1; ++column) {
                float x, y;
                if (!perspective_.find_ground(column, row, x, y)) continue;
                const float along = ((x - x_) * cosine_ + (y - y_) * sine_) / length;
                const float across = ((y - y_) * cosine_ - (x - x_) * sine_) / width;
                const float edge = along * along * along * along + across * across * across * across;
                if (edge >= 1.0f) continue;
                const float light = 1.0f - car.alpha * kShadowDepth * (1.0f - edge);
                uint8_t* pixel = out + 3 * (size_t(row) * spec_.width + column);
                for (int c = 0; c < 3; ++c) pixel[c] = static_cast<uint8_t>(pixel[c] * light + 0.5f);
            }
        }
    }

    void draw_triangle(const Triangle& triangle, const CarPicture& car, std::vector<Sample>& samples) const {
        Vector3 world[3], image[3];
        for (int i = 0; i < 3; ++i) {
            world[i] = to_world(triangle.corners[i], triangle.wheel);
            image[i] = perspective_.project(world[i]);
            image[i].x = (image[i].x - static_cast<float>(box_.x0)) * kSupersampling;
            image[i].y = (image[i].y - static_cast<float>(box_.y0)) * kSupersampling;
        }
        const float area = (image[1].x - image[0].x) * (image[2].y - image[0].y) -
                           (image[2].x - image[0].x) * (image[1].y - image[0].y);
        if (abs_of(area) < 1e-6f) return;
        const Sample shaded = shade(world, area > 0.0f, triangle.paint, car);

        const auto range = [](float a, float b, float c, int limit, int& begin, int& end) {
            begin = static_cast<int>(clamp(std::min({a, b, c}) - 0.5f, 0.0f, static_cast<float>(limit)));
            end = static_cast<int>(clamp(std::max({a, b, c}) + 1.5f, 0.0f, static_cast<float>(limit)));
        };
        int x0, x1, y0, y1;
        range(image[0].x, image[1].x, image[2].x, columns_, x0, x1);
        range(image[0].y, image[1].y, image[2].y, rows_, y0, y1);
        // Barycentric weights, linear in the image; 1 / depth is linear there, too.
        const float inverse = 1.0f / area;
        const float depth0 = 1.0f / image[0].z, depth1 = 1.0f / image[1].z, depth2 = 1.0f / image[2].z;
        for (int y = y0; y < y1; ++y) {
            const float py = static_cast<float>(y) + 0.5f;
            for (int x = x0; x < x1; ++x) {
                const float px = static_cast<float>(x) + 0.5f;
                const float w1 = ((px - image[0].x) * (image[2].y - image[0].y) -
                                  (image[2].x - image[0].x) * (py - image[0].y)) *
                                 inverse;
                const float w2 = ((image[1].x - image[0].x) * (py - image[0].y) -
                                  (px - image[0].x) * (image[1].y - image[0].y)) *
                                 inverse;
                const float w0 = 1.0f - w1 - w2;
                if (w0 < 0.0f || w1 < 0.0f || w2 < 0.0f) continue;
                const float depth = 1.0f / (w0 * depth0 + w1 * depth1 + w2 * depth2);
                Sample& sample = samples[size_t(y) * columns_ + x];
                if (depth < sample.depth) {
                    sample = shaded;
                    sample.depth = depth;
                }
            }
        }
    }

    // Flat shading: ambient light and the sun, on the side that faces the lens.
    Sample shade(const Vector3* p, bool is_clockwise, Paint paint, const CarPicture& car) const {
        const Vector3 a = {p[1].x - p[0].x, p[1].y - p[0].y, p[1].z - p[0].z};
        const Vector3 b = {p[2].x - p[0].x, p[2].y - p[0].y, p[2].z - p[0].z};
        const Vector3 n = {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
        const float size = sqrt_of(n.x * n.x + n.y * n.y + n.z * n.z);
        float facing = size > 0.0f ? (n.x * kSun.x + n.y * kSun.y + n.z * kSun.z) / size : 0.0f;
        if (is_clockwise) facing = -facing;  // image y points down
        const float light =
            kAmbient + (1.0f - kAmbient) * max_of(facing, 0.0f) + 0.08f * min_of(facing, 0.0f);
        const bool glows = paint == Paint::light || paint == Paint::tail_light;
        const Colour colour = paint_colour(paint, car);
        const auto byte = [&](float value) {
            return static_cast<uint8_t>(clamp(value * (glows ? 1.0f : light) + 0.5f, 0.0f, 255.0f));
        };
        return {0.0f, byte(colour.red), byte(colour.green), byte(colour.blue), 1};
    }

    void blend(float alpha, const std::vector<Sample>& samples, uint8_t* out) const {
        constexpr float share = 1.0f / (kSupersampling * kSupersampling);
        for (int row = box_.y0; row < box_.y1; ++row) {
            for (int column = box_.x0; column < box_.x1; ++column) {
                int sum[3] = {0, 0, 0};
                int covered = 0;
                for (int k = 0; k < kSupersampling; ++k) {
                    const Sample* line = &samples[size_t((row - box_.y0) * kSupersampling + k) * columns_ +
                                                  size_t(column - box_.x0) * kSupersampling];
                    for (int i = 0; i < kSupersampling; ++i) {
                        covered += line[i].is_covered;
                        sum[0] += line[i].red;
                        sum[1] += line[i].green;
                        sum[2] += line[i].blue;
                    }
                }
                if (covered == 0) continue;
                const float rest = 1.0f - alpha * share * static_cast<float>(covered);
                uint8_t* pixel = out + 3 * (size_t(row) * spec_.width + column);
                for (int c = 0; c < 3; ++c) {
                    pixel[c] = static_cast<uint8_t>(pixel[c] * rest +
                                                    alpha * share * static_cast<float>(sum[c]) + 0.5f);
                }
            }
        }
    }

    CameraSpec spec_;
    Perspective perspective_;
    float x_ = 0.0f, y_ = 0.0f, sine_ = 0.0f, cosine_ = 1.0f, steering_sine_ = 0.0f, steering_cosine_ = 1.0f;
    Box box_{};
    int columns_ = 0, rows_ = 0;
};

GreyPalette channel_of(const RgbPalette& colours, int channel) {
    GreyPalette grey{};
    for (int i = 0; i < kNumMaterials; ++i) grey.ground[i] = colours.ground[i][channel];
    for (int i = 0; i < kNumWalls; ++i) grey.wall[i] = colours.wall[i][channel];
    grey.sky = colours.sky[channel];
    grey.outside = colours.outside[channel];
    for (int i = 0; i < kNumMaterials; ++i) grey.grain[i] = colours.grain[i];
    return grey;
}

}  // namespace

CameraSpec chase_camera(int width, int height) {
    CameraSpec spec;
    spec.width = width;
    spec.height = height;
    spec.pitch = 0.31416f;
    spec.forward = -1.5f;
    spec.above = 1.0f;
    spec.min_samples = 4;
    return spec;
}

FixedCamera top_down_camera(const GroundMap& ground, int width, int height) {
    const GroundView& view = ground.view();
    const float size_x = view.max_x - view.min_x - 2.0f * kRoomMargin;
    const float size_y = view.max_y - view.min_y - 2.0f * kRoomMargin;
    FixedCamera camera;
    camera.spec.width = width;
    camera.spec.height = height;
    camera.spec.pitch = 0.5f * kPi;
    camera.spec.forward = 0.0f;
    camera.spec.min_samples = 4;
    camera.x = 0.5f * (view.min_x + view.max_x);
    camera.y = 0.5f * (view.min_y + view.max_y);
    float sine, cosine;
    sincos_of(0.5f * camera.spec.hfov, sine, cosine);
    // Height at which `across` metres fill the width and `along` metres the height of the picture.
    const auto height_for = [&](float across, float along) {
        const float widest = max_of(across, along * static_cast<float>(width) / static_cast<float>(height));
        return 1.25f * 0.5f * widest * cosine / sine;
    };
    const float upright = height_for(size_x, size_y);
    const float turned = height_for(size_y, size_x);
    camera.heading = turned < upright ? 0.0f : 0.5f * kPi;
    camera.spec.above = clamp(min_of(upright, turned), 0.5f, 99.0f);
    return camera;
}

void render_rgb(const CameraModel& camera, const GroundMap& ground, const RgbPalette& palette, float x,
                float y, float heading, const CarPicture* cars, int num_cars, const ScanPicture* scan,
                uint8_t* out) {
    const LensPose lens = place_lens(camera.view(), ground.view(), x, y, heading);
    GreyPalette channels[3];
    for (int c = 0; c < 3; ++c) channels[c] = channel_of(palette, c);
    RC_DISPATCH(render_room, camera.view(), ground.view(), channels, palette.sheen, 3, lens, out);
    if (scan != nullptr) draw_scan(camera.spec(), lens, ground.view(), *scan, ScanPart::beams, out);

    // Far cars first, so that near ones cover them.
    thread_local std::vector<int> order;
    thread_local std::vector<Sample> samples;
    order.resize(static_cast<size_t>(max_of(num_cars, 0)));
    std::iota(order.begin(), order.end(), 0);
    const auto distance = [&](int i) {
        const float dx = cars[i].x - lens.x;
        const float dy = cars[i].y - lens.y;
        return dx * dx + dy * dy;
    };
    std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return distance(a) > distance(b); });
    CarPainter painter(camera.spec(), lens);
    for (const int i : order) painter.draw(cars[i], samples, out);
    if (scan != nullptr) draw_scan(camera.spec(), lens, ground.view(), *scan, ScanPart::facing_ends, out);
}

}  // namespace racecraft
