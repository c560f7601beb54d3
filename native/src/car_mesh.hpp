// The look of our race car: a few hundred triangles, 1/18 scale, of our own design.
#pragma once

#include <vector>

namespace racecraft {

struct Vector3 {
    float x, y, z;  // m in the car's frame: x ahead, y left, z up, z = 0 on the ground
};

enum class Paint : int { body, accent, glass, tyre, rim, light, tail_light, cardboard, flap, tape, ink };

struct Triangle {
    Vector3 corners[3];
    Paint paint;
    int wheel;  // 1 and 2: front left and front right, which steer; 0 otherwise
};

const std::vector<Triangle>& car_mesh();

// Centre of a front wheel, about which it steers.
Vector3 front_wheel(int wheel);

}  // namespace racecraft
