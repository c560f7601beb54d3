#include "car_mesh.hpp"

#include <utility>

#include "racecraft/math.hpp"

namespace racecraft {
namespace {

constexpr float kFrontAxle = 0.08231f;  // m ahead of the origin
constexpr float kRearAxle = -0.08166f;
constexpr float kHalfTrack = 0.0805f;  // m
constexpr float kWheelRadius = 0.036f;
constexpr float kWheelWidth = 0.034f;

// A cross-section of a lofted body: a trapezium, symmetric about y = 0.
struct Station {
    float x, half_bottom, half_top, bottom, top;
};

class MeshBuilder {
  public:
    std::vector<Triangle> triangles;

    void add_quad(Vector3 a, Vector3 b, Vector3 c, Vector3 d, Paint paint, int wheel = 0) {
        triangles.push_back({{a, b, c}, paint, wheel});
        triangles.push_back({{a, c, d}, paint, wheel});
    }

    void add_box(Vector3 low, Vector3 high, Paint paint) {
        const Station back = {low.x, 0.5f * (high.y - low.y), 0.5f * (high.y - low.y), low.z, high.z};
        Station front = back;
        front.x = high.x;
        add_loft({back, front}, paint, 0.5f * (low.y + high.y));
    }

    void add_loft(const std::vector<Station>& stations, Paint paint, float y = 0.0f) {
        const auto corner = [y](const Station& s, int i) {
            const float half = i < 2 ? s.half_bottom : s.half_top;
            return Vector3{s.x, y + (i == 0 || i == 3 ? -half : half), i < 2 ? s.bottom : s.top};
        };
        for (size_t k = 0; k + 1 < stations.size(); ++k) {
            for (int i = 0; i < 4; ++i) {
                const int next = (i + 1) % 4;
                add_quad(corner(stations[k], i), corner(stations[k], next), corner(stations[k + 1], next),
                         corner(stations[k + 1], i), paint);
            }
        }
        for (const Station* end : {&stations.front(), &stations.back()}) {
            add_quad(corner(*end, 0), corner(*end, 1), corner(*end, 2), corner(*end, 3), paint);
        }
    }

    void add_wheel(float x, float y, int wheel) {
        constexpr int kSides = 14;
        const float side = y > 0.0f ? 1.0f : -1.0f;
        const float outer = y + side * 0.5f * kWheelWidth;
        const float inner = y - side * 0.5f * kWheelWidth;
        const auto rim = [&](int i, float radius, float at) {
            float sine, cosine;
            sincos_of(kTwoPi * static_cast<float>(i) / kSides, sine, cosine);
            return Vector3{x + radius * cosine, at, kWheelRadius + radius * sine};
        };
        const Vector3 hub = {x, outer - side * 0.006f, kWheelRadius};
        for (int i = 0; i < kSides; ++i) {
            add_quad(rim(i, kWheelRadius, inner), rim(i + 1, kWheelRadius, inner),
                     rim(i + 1, kWheelRadius, outer), rim(i, kWheelRadius, outer), Paint::tyre, wheel);
            add_quad(rim(i, kWheelRadius, outer), rim(i + 1, kWheelRadius, outer), rim(i + 1, 0.024f, outer),
                     rim(i, 0.024f, outer), Paint::tyre, wheel);
            triangles.push_back({{rim(i, 0.024f, outer), rim(i + 1, 0.024f, outer), hub},
                                 i % 2 == 0 ? Paint::rim : Paint::tyre,
                                 wheel});
            triangles.push_back(
                {{rim(i, kWheelRadius, inner), rim(i + 1, kWheelRadius, inner), {x, inner, kWheelRadius}},
                 Paint::tyre,
                 wheel});
        }
    }
};

std::vector<Triangle> build_car() {
    MeshBuilder mesh;
    // Hull from tail to nose, the cabin on it, side pods, wings.
    mesh.add_loft({{-0.146f, 0.044f, 0.036f, 0.036f, 0.072f},
                   {-0.110f, 0.058f, 0.050f, 0.022f, 0.086f},
                   {-0.050f, 0.060f, 0.052f, 0.018f, 0.090f},
                   {0.035f, 0.058f, 0.050f, 0.018f, 0.086f},
                   {0.085f, 0.050f, 0.042f, 0.018f, 0.072f},
                   {0.150f, 0.046f, 0.036f, 0.020f, 0.052f},
                   {0.172f, 0.034f, 0.028f, 0.024f, 0.040f}},
                  Paint::body);
    mesh.add_loft({{-0.094f, 0.040f, 0.034f, 0.080f, 0.088f},
                   {-0.048f, 0.046f, 0.034f, 0.086f, 0.117f},
                   {-0.006f, 0.046f, 0.034f, 0.086f, 0.119f},
                   {0.046f, 0.044f, 0.038f, 0.080f, 0.085f}},
                  Paint::glass);
    mesh.add_box({-0.050f, -0.033f, 0.1165f}, {-0.004f, 0.033f, 0.1225f}, Paint::body);  // roof
    for (const float side : {-1.0f, 1.0f}) {
        const float y = side * 0.0745f;
        mesh.add_loft({{-0.040f, 0.020f, 0.012f, 0.018f, 0.058f}, {0.040f, 0.020f, 0.010f, 0.018f, 0.048f}},
                      Paint::accent, y);  // side pods
        mesh.add_box({-0.120f, y - 0.019f, 0.072f}, {-0.046f, y + 0.017f, 0.080f},
                     Paint::body);  // rear fender
        mesh.add_box({0.048f, y - 0.019f, 0.072f}, {0.116f, y + 0.017f, 0.078f},
                     Paint::body);  // front fender
        mesh.add_box({-0.138f, side * 0.036f - 0.003f, 0.070f}, {-0.124f, side * 0.036f + 0.003f, 0.120f},
                     Paint::accent);  // wing strut
        mesh.add_box({-0.151f, side * 0.094f - 0.003f, 0.104f}, {-0.108f, side * 0.094f + 0.003f, 0.136f},
                     Paint::body);  // wing end plate
        mesh.add_box({0.1500f, side * 0.030f - 0.008f, 0.041f}, {0.1640f, side * 0.030f + 0.006f, 0.050f},
                     Paint::light);
        mesh.add_box({-0.1490f, side * 0.030f - 0.009f, 0.052f}, {-0.1440f, side * 0.030f + 0.009f, 0.062f},
                     Paint::tail_light);
    }
    mesh.add_loft({{-0.149f, 0.092f, 0.092f, 0.126f, 0.131f}, {-0.112f, 0.092f, 0.092f, 0.119f, 0.123f}},
                  Paint::accent);                                                       // rear wing
    mesh.add_box({0.140f, -0.086f, 0.018f}, {0.1735f, 0.086f, 0.024f}, Paint::accent);  // front splitter
    mesh.add_wheel(kFrontAxle, kHalfTrack, 1);
    mesh.add_wheel(kFrontAxle, -kHalfTrack, 2);
    mesh.add_wheel(kRearAxle, kHalfTrack, 0);
    mesh.add_wheel(kRearAxle, -kHalfTrack, 0);
    return std::move(mesh.triangles);
}

}  // namespace

const std::vector<Triangle>& car_mesh() {
    static const std::vector<Triangle> mesh = build_car();
    return mesh;
}

Vector3 front_wheel(int wheel) {
    return {kFrontAxle, wheel == 1 ? kHalfTrack : -kHalfTrack, kWheelRadius};
}

}  // namespace racecraft
