// Steps a batch of cars on the CPU: the races of racecraft/race.hpp, in one call, without an allocation, by
// any number of threads, to the same bits.
#pragma once

#include <memory>
#include <vector>

#include "camera_model.hpp"
#include "lock.hpp"
#include "racecraft/race.hpp"
#include "thread_pool.hpp"
#include "track_store.hpp"

namespace racecraft {

struct EngineConfig {
    size_t num_envs;  // N
    uint64_t seed;
    int substeps;     // physics steps to a control step
    int num_threads;  // 0 for one per core
    RuleLimits limits;
    StartRule start;
    Direction direction;
    ObjectRule objects{};    // none by default
    bool has_lidar = false;  // whether cars carry a LIDAR
    float baseline =
        0.0f;  // m between the two lenses of a stereo camera, left and right of its place; 0 for one
    bool draws_tracks = false;  // a track for every episode by chance, instead of track_choice
    size_t cars_per_race = 1;   // num_envs is a multiple of it
    int picture_age = 0;        // substeps from when a picture is taken to the end of its step
};

struct Shot;

// Calls from several threads wait for each other; the arrays are shared all the same.
class Engine {
  public:
    // Tracks come in order; the reversed twin of track i is track i + num_tracks. Both drive over ground map
    // i. Without a camera there are no frames. With randomization every episode has its own conditions.
    Engine(const EngineConfig& config, std::vector<TrackStore> tracks,
           std::vector<std::shared_ptr<const GroundMap>> grounds, const VehicleParameters& vehicle,
           const CameraSpec* camera, const Randomization* randomization = nullptr,
           const RgbPalette& colours = kPalette2018);

    // Puts the masked cars (all of them without a mask) at the start of their next episode. Where that is all
    // cars of a race, a new race begins, with objects placed anew; else they come back into the one that goes
    // on. With seeds (N,), for whole races, they begin anew: each race draws from now on as the first of an
    // engine with the seed of its first car, and its next episode is its first.
    void reset(const bool* mask, const uint64_t* seeds = nullptr);
    // actions: steering angle in rad and speed in m/s, interleaved (N, 2), finite.
    void step(const float* actions);
    // Puts one car somewhere else within its episode; counters of standstill and reversing begin anew.
    void set_pose(size_t env, float x, float y, float heading, float speed);
    // Keeps one car standing for so many steps from now on, as a penalty; nobody can run into it.
    void freeze(size_t env, int steps);

    size_t num_envs() const { return static_cast<size_t>(batch_.num_envs); }
    size_t num_tracks() const { return tracks_.size() / 2; }
    int num_threads() const { return pool_.num_threads(); }
    size_t num_bytes() const;  // of the batch's own buffers, frames included
    const CameraModel* camera() const { return camera_.get(); }
    size_t num_lenses() const { return static_cast<size_t>(batch_.num_lenses); }
    // Columns of a row and of a state: more than kNumRowColumns and kNumStateColumns where there are objects.
    size_t row_width() const { return static_cast<size_t>(batch_.row_width); }
    size_t state_width() const { return static_cast<size_t>(batch_.state_width); }
    double* rows() { return rows_.data(); }                  // (N, row_width())
    float* state() { return state_.data(); }                 // (N, state_width())
    float* lidar() { return lidar_.data(); }                 // (N, kLidarRays), or nothing
    uint8_t* frames() { return frames_.data(); }             // (N, num_lenses(), height, width)
    bool* terminated() { return flags_.get(); }              // (N,)
    bool* truncated() { return flags_.get() + num_envs(); }  // (N,)
    float* vehicles() { return vehicles_.data(); }           // (kNumVehicleFields, N), order of VehicleState
    float* parameters() { return parameters_.data(); }       // (kNumVehicleParameters, N)
    Conditions* conditions() { return conditions_.data(); }  // (N,), or empty without randomization
    size_t num_conditions() const { return conditions_.size(); }
    int32_t* track_choice() {
        return track_choice_.data();
    }  // (N,) track of each car from its next episode on
    GreyPalette& palette(size_t env) { return palettes_[env]; }

    // Everything that the next step depends on, as plain bytes of this build.
    std::vector<uint8_t> save() const;
    // Throws std::invalid_argument, and changes nothing, if the bytes are not from an engine of this shape.
    void load(const uint8_t* bytes, size_t size);

  private:
    friend class DevicePlan;  // reads the settings

    struct DriveHere;  // the engine's way of a race

    void set_up_batch(const EngineConfig& config, const VehicleParameters& vehicle, const CameraSpec& eyes,
                      const Randomization* randomization, const RgbPalette& colours);
    void allocate();
    void see_from(int32_t env);     // the current pose
    void show_others(int32_t env);  // the others of its race what has changed about a car between two steps
    void draw(int32_t env);
    void photograph(const CameraModel& camera, int32_t env, int32_t eye, uint8_t* frame);
    void render(const CameraModel& camera, int32_t env, const Sight& from, const Shot* shot,
                uint8_t* picture);
    size_t chunk_size(size_t most) const;
    template <typename Work>
    void for_chunks(size_t most, Work&& work);  // work(begin, end, here) by all threads

    template <typename Visitor>
    void visit_saved(Visitor&& visit);
    std::vector<uint8_t> snapshot() const;
    void restore(const uint8_t* bytes);
    const char* find_fault() const;  // null if the state is one that this engine can go on from

    uint64_t seed_;
    mutable Mutex mutex_;  // held by every public call that reads or writes cars
    std::vector<TrackStore> tracks_;
    std::vector<TrackGeometry> geometries_;  // of the tracks, side by side
    std::vector<std::shared_ptr<const GroundMap>> grounds_;
    std::unique_ptr<CameraModel> camera_, right_camera_;  // the one, or the left one, and the right one
    ThreadPool pool_;
    Batch batch_{};  // the settings, and where the arrays below lie

    std::vector<float> vehicles_, parameters_, steering_command_, speed_command_, is_moving_, state_;
    std::vector<double> rows_;
    std::vector<float> lidar_;
    std::vector<float> seen_from_;  // (3, N), empty where pictures are as new as the cars
    std::vector<uint8_t> frames_;
    std::vector<Episode> episodes_;
    std::vector<ObjectState> objects_;  // the worlds of all races, one after the other
    std::vector<int32_t> track_choice_;
    std::vector<int32_t> races_;     // (N / cars_per_race,) number of each race, empty where cars race alone
    std::vector<uint64_t> seeds_;    // (N,) with its stream, the key of each car's random numbers
    std::vector<uint32_t> streams_;  // (N,)
    std::vector<GreyPalette> palettes_;

    // Randomisation; all of it empty where there is none.
    std::vector<Conditions> conditions_;                // (N,)
    std::vector<CameraModel> cameras_, right_cameras_;  // (N,), empty unless cameras differ, or lenses
    std::vector<int32_t> delay_;                        // (N,) substeps, empty unless commands act late
    std::vector<float> earlier_;                        // (4, N), see VehicleArrays

    std::unique_ptr<bool[]> flags_;  // terminated, then truncated (std::vector<bool> has no bytes to show)
};

}  // namespace racecraft
