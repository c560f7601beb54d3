// A batch of cars as plain memory: what the engine (native/src/engine.hpp) and a GPU's kernels (native/gpu)
// read and write, by the same functions (cars.hpp, race.hpp).
//
//   world   tracks, grounds, cameras: memory that never changes
//   cars    arrays of num_envs elements
#pragma once

#include "racecraft/camera_tables.hpp"
#include "racecraft/lidar.hpp"
#include "racecraft/randomization.hpp"
#include "racecraft/start.hpp"

namespace racecraft {

// The arrays of a batch: name, element, elements of one car.
#define RC_CAR_ARRAYS(X)                                                                            \
    X(vehicles, float, kNumVehicleFields)       /* (kNumVehicleFields, N), order of VehicleState */ \
    X(parameters, float, kNumVehicleParameters) /* (kNumVehicleParameters, N) */                    \
    X(state, float, state_width)                                                                    \
    X(rows, double, row_width)                                                                      \
    X(lidar, float, has_lidar* kLidarRays)                                                          \
    X(frames, uint8_t, num_lenses* num_pixels)                                                      \
    X(episodes, Episode, 1)                                                                         \
    X(objects, ObjectState, num_objects)                                                            \
    X(track_choice, int32_t, 1)                                                                     \
    X(seeds, uint64_t, 1)                                                                           \
    X(streams, uint32_t, 1)                                                                         \
    X(palettes, GreyPalette, 1)                                                                     \
    X(terminated, uint8_t, 1)                                                                       \
    X(truncated, uint8_t, 1)                                                                        \
    X(is_changed, uint8_t, 1) /* its frame is old */                                                \
    X(conditions, Conditions, is_randomized)                                                        \
    X(delay, int32_t, has_latency)             /* substeps */                                       \
    X(earlier, float, 4 * has_latency)         /* (4, N), see VehicleArrays */                      \
    X(seen_from, float, 3 * (picture_age > 0)) /* (3, N), x, y, heading: see sight_of() */          \
    X(cameras, CameraView, has_cameras)        /* of each car, where they differ */                 \
    X(camera_tables, uint8_t, has_cameras* camera_bytes)                                            \
    X(blurred, uint8_t, is_randomized * num_lenses * num_pixels) /* between two passes of a blur */

constexpr int32_t kCarThreads = 128;    // cars of a block, one thread each
constexpr int32_t kImageThreads = 256;  // threads that draw one frame
constexpr int32_t kRowThreads = 128;    // threads that draw objects, one row each at a time

constexpr int32_t kNumVehicleFields = sizeof(VehicleState) / sizeof(float);

struct Batch {
    // Sizes; of a camera, those of one frame. num_objects is what a car has around it.
    int32_t num_envs, cars_per_race, num_tracks, num_objects, num_lenses, num_pixels;
    int32_t row_width, state_width, camera_bytes;
    int32_t has_lidar, is_randomized, has_latency, has_cameras, has_lens, draws_tracks;

    // Settings.
    int32_t substeps;
    int32_t picture_age;  // substeps from when a picture is taken to the end of its step
    Direction direction;
    RuleLimits limits;
    StartRule start;
    ObjectRule rule;
    float lens_forward, lens_left, half_tangent;  // of the camera that decides what is in view
    VehicleParameters vehicle;                    // before randomisation
    Randomization randomization;
    RgbPalette colours;

    // The world.
    const TrackGeometry* tracks;  // (2 num_tracks,), the reversed twins after the others
    const GroundView* grounds;    // (num_tracks,), none without a camera; GPU only
    const CameraView* lenses;     // (num_lenses,), GPU only

#define RC_FIELD(name, type, size) type* name;
    RC_CAR_ARRAYS(RC_FIELD)
#undef RC_FIELD
    int32_t* races;  // (N / cars_per_race,) number of each race, null where cars race alone; CPU only
};

// Bytes of the tables of one camera, in the order of car_tables().
RC_HD int32_t camera_table_bytes(int32_t height) {
    const int32_t samples = (height * kMaxRowSamples + 7) / 8 * 8;
    return (height + 1 + height) * 4 + samples * (4 * 4 + 2) + 4;
}

// The tables of a camera of this height in a block of camera_table_bytes().
RC_HD CameraTables tables_in(uint8_t* block, int32_t height) {
    const int32_t samples = (height * kMaxRowSamples + 7) / 8 * 8;
    float* floats = reinterpret_cast<float*>(block);
    CameraTables tables;
    tables.distance = floats;
    tables.start = floats + samples;
    tables.step = floats + 2 * samples;
    tables.sharpness = floats + 3 * samples;
    tables.corner_scale = floats + 4 * samples;
    tables.row_begin = reinterpret_cast<int32_t*>(floats + 4 * samples + height);
    tables.kind = reinterpret_cast<uint8_t*>(tables.row_begin + height + 1);
    tables.exponent = reinterpret_cast<int8_t*>(tables.kind + samples);
    return tables;
}

}  // namespace racecraft
