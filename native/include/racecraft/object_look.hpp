// What objects look like: colours, and the few convex solids that a driver's camera sees of them.
//
// Pictures for people draw the same things in more detail (native/src/car_mesh.cpp), in the same colours.
#pragma once

#include "racecraft/objects.hpp"

namespace racecraft {

struct Rgb {
    uint8_t red, green, blue;
};

constexpr Rgb kCardboard = {171, 128, 82};
constexpr Rgb kTape = {214, 190, 148};
constexpr Rgb kTyre = {34, 34, 36};
constexpr Rgb kGlass = {44, 52, 62};

constexpr int32_t kNumCarColours = 6;
constexpr Rgb kCarColours[kNumCarColours] = {{236, 176, 36}, {70, 136, 226}, {214, 216, 220},
                                             {70, 178, 98},  {240, 124, 44}, {176, 104, 214}};

constexpr Rgb kRacerColours[kMaxCarsPerRace] = {{214, 60, 44},  {70, 136, 226},  {236, 176, 36},
                                                {70, 178, 98},  {214, 216, 220}, {176, 104, 214},
                                                {64, 190, 196}, {92, 96, 104}};

// The body of the car that is number i around another: the cars of a race each have their own.
RC_HD Rgb car_colour(const ObjectsAround& around, int32_t i) {
    const int32_t place = place_in_world(around, i);
    return place < around.first_racer ? kCarColours[place % kNumCarColours]
                                      : kRacerColours[(place - around.first_racer) % kMaxCarsPerRace];
}

RC_HD Rgb accent_of(Rgb body) {
    return {static_cast<uint8_t>((28 * body.red) / 100 + 14),
            static_cast<uint8_t>((28 * body.green) / 100 + 14),
            static_cast<uint8_t>((28 * body.blue) / 100 + 16)};
}

constexpr float kSunX = 0.352f, kSunY = 0.264f,
                kSunZ = 0.898f;    // unit vector towards the light, in the world
constexpr float kAmbient = 0.66f;  // share of light that comes from everywhere

// Brightness of a face by its normal's cosine to the sun.
RC_HD float light_on(float facing) {
    return kAmbient + (1.0f - kAmbient) * max_of(facing, 0.0f) + 0.08f * min_of(facing, 0.0f);
}

// A convex solid between two upright rectangles, symmetric about y, in the object's frame: x ahead, y left, z
// up.
struct Solid {
    float back_bottom, front_bottom, half_bottom, bottom;  // m
    float back_top, front_top, half_top, top;              // m
    float y;                                               // m, of its middle
};

constexpr Solid kBoxSolid = {
    -0.5f * kBoxLength, 0.5f * kBoxLength, 0.5f * kBoxWidth, 0.0f, -0.5f * kBoxLength,
    0.5f * kBoxLength,  0.5f * kBoxWidth,  kBoxHeight,       0.0f};
constexpr Solid kHullSolid = {-0.146f, 0.172f, 0.060f, 0.020f, -0.140f, 0.050f, 0.052f, 0.088f, 0.0f};
constexpr Solid kCabinSolid = {-0.094f, 0.046f, 0.045f, 0.084f, -0.050f, -0.004f, 0.034f, 0.121f, 0.0f};
constexpr Solid kWingSolid = {-0.150f, -0.110f, 0.092f, 0.119f, -0.150f, -0.110f, 0.092f, 0.131f, 0.0f};
constexpr float kWheelLength = 0.036f;  // m, half of it; a wheel is as high as it is long
constexpr float kWheelMiddle = 0.0805f, kWheelHalfWidth = 0.017f;
// Farther away the wheels are one block, and the wing is left out.
constexpr float kWheelReach = 1.6f;  // m
constexpr Solid kAxlesSolid = {-0.118f, 0.118f, 0.0975f, 0.0f, -0.118f, 0.118f, 0.0975f, 0.068f, 0.0f};

// The tape that hangs down a box's front and back, m.
constexpr float kTapeHalfWidth = 0.025f, kTapeLength = 0.08f;
constexpr float kTapeReach = 3.0f;  // m; a driver's camera does not see it from farther away

}  // namespace racecraft
