#include "box_mesh.hpp"

#include "racecraft/object_look.hpp"

namespace racecraft {
namespace {

constexpr float kX = 0.5f * kBoxLength, kY = 0.5f * kBoxWidth, kZ = kBoxHeight;
constexpr float kLift = 0.0015f;  // m, of what is stuck or printed on the cardboard

void add_quad(std::vector<Triangle>& mesh, Vector3 a, Vector3 b, Vector3 c, Vector3 d, Paint paint) {
    mesh.push_back({{a, b, c}, paint, 0});
    mesh.push_back({{a, c, d}, paint, 0});
}

// An arrow that says which side is up, on the right or left side.
void add_arrow(std::vector<Triangle>& mesh, float x, float side) {
    const float y = side * (kY + kLift);
    mesh.push_back({{{x - 0.022f, y, 0.105f}, {x + 0.022f, y, 0.105f}, {x, y, 0.135f}}, Paint::ink, 0});
    add_quad(mesh, {x - 0.008f, y, 0.060f}, {x + 0.008f, y, 0.060f}, {x + 0.008f, y, 0.105f},
             {x - 0.008f, y, 0.105f}, Paint::ink);
    add_quad(mesh, {x - 0.024f, y, 0.044f}, {x + 0.024f, y, 0.044f}, {x + 0.024f, y, 0.050f},
             {x - 0.024f, y, 0.050f}, Paint::ink);
}

std::vector<Triangle> build_box() {
    std::vector<Triangle> mesh;
    for (const float side : {-1.0f, 1.0f}) {
        const float x = side * kX;
        const float y = side * kY;
        add_quad(mesh, {x, -kY, 0.0f}, {x, kY, 0.0f}, {x, kY, kZ}, {x, -kY, kZ}, Paint::cardboard);
        add_quad(mesh, {-kX, y, 0.0f}, {kX, y, 0.0f}, {kX, y, kZ}, {-kX, y, kZ}, Paint::cardboard);
        // The two flaps of the lid meet under the tape; the tape hangs down in front and behind.
        add_quad(mesh, {-kX, y, kZ}, {kX, y, kZ}, {kX, side * 0.002f, kZ}, {-kX, side * 0.002f, kZ},
                 Paint::flap);
        const float hang = side * (kX + kLift);
        add_quad(mesh, {hang, -kTapeHalfWidth, kZ}, {hang, kTapeHalfWidth, kZ},
                 {hang, kTapeHalfWidth, kZ - kTapeLength}, {hang, -kTapeHalfWidth, kZ - kTapeLength},
                 Paint::tape);
        add_arrow(mesh, -0.135f, side);
        add_arrow(mesh, -0.075f, side);
        // A label on each of the long sides.
        const float label = side * (kY + kLift);
        add_quad(mesh, {0.060f, label, 0.060f}, {0.155f, label, 0.060f}, {0.155f, label, 0.130f},
                 {0.060f, label, 0.130f}, Paint::tape);
    }
    add_quad(mesh, {-kX, -kTapeHalfWidth, kZ + kLift}, {kX, -kTapeHalfWidth, kZ + kLift},
             {kX, kTapeHalfWidth, kZ + kLift}, {-kX, kTapeHalfWidth, kZ + kLift}, Paint::tape);
    return mesh;
}

}  // namespace

const std::vector<Triangle>& box_mesh() {
    static const std::vector<Triangle> mesh = build_box();
    return mesh;
}

}  // namespace racecraft
