// Pictures for people: the room in colour and the cars in it, from the driver's, the chase or the top-down
// camera.
#pragma once

#include "camera_model.hpp"

namespace racecraft {

// A car, or with is_box an obstacle, whose steering and colour do not matter.
struct CarPicture {
    float x, y;         // m, the car's origin
    float heading;      // rad
    float steering;     // rad, of the front wheels, left positive
    uint8_t colour[3];  // of the body, RGB
    float alpha;        // 1 is solid; a car that waits for its reset blinks between 0.3 and 1
    bool is_box;
};

// 1.5 m behind the car, 1 m up, looking 18 degrees down.
CameraSpec chase_camera(int width, int height);

// A camera straight above the track that shows it whole, with a quarter more around it.
struct FixedCamera {
    CameraSpec spec;
    float x, y, heading;  // m, rad
};
FixedCamera top_down_camera(const GroundMap& ground, int width, int height);

// A LIDAR at work: a car's pose, and what its beams can hit besides the room's walls.
struct ScanPicture {
    float x, y, heading;  // m, rad, of the car that carries it
    const CarPicture* objects;
    int num_objects;
};

// What the camera of a car at (x, y, heading) sees, into out (height, width, 3). Cars closer to the lens than
// 2 cm are left out, and so is whatever the caller leaves out of `cars`: a driver does not see the own car.
// The beams of `scan` are shown, if it is not null. Safe from any thread; allocates only while its buffers
// grow to the largest car seen so far.
void render_rgb(const CameraModel& camera, const GroundMap& ground, const RgbPalette& palette, float x,
                float y, float heading, const CarPicture* cars, int num_cars, const ScanPicture* scan,
                uint8_t* out);

}  // namespace racecraft
