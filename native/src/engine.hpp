// Steps a batch of cars: judge, move, observe, render. One call, no allocation, any number of threads, same
// bits.
//
// Consecutive cars make a race: they share a track, obstacles and bots, and see and hit each other. A step
// does each of these things for every car of a race before the next, so the order of the cars means nothing.
#pragma once

#include <memory>
#include <vector>

#include "camera_model.hpp"
#include "object_field.hpp"
#include "racecraft/random.hpp"
#include "racecraft/randomization.hpp"
#include "racecraft/rules.hpp"
#include "racecraft/start.hpp"
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
};

// Calls from several threads wait for each other; the arrays are shared all the same.
class Engine {
  public:
    // Tracks come in order; the reversed twin of track i is track i + num_tracks. Both drive over ground map
    // i. Without a camera there are no frames. With randomization every episode has its own conditions, and
    // colours take the place of the palette.
    Engine(const EngineConfig& config, std::vector<TrackStore> tracks,
           std::vector<std::shared_ptr<const GroundMap>> grounds, const VehicleParameters& vehicle,
           const CameraSpec* camera, const GreyPalette& palette, const Randomization* randomization = nullptr,
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

    size_t num_envs() const { return config_.num_envs; }
    size_t num_tracks() const { return tracks_.size() / 2; }
    int num_threads() const { return pool_.num_threads(); }
    size_t num_bytes() const;  // of the batch's own buffers, frames included
    const CameraModel* camera() const { return camera_.get(); }
    size_t num_lenses() const { return camera_ == nullptr ? 0 : right_camera_ == nullptr ? 1 : 2; }
    // Columns of a row and of a state: more than kNumRowColumns and kNumStateColumns where there are objects.
    size_t row_width() const { return kNumRowColumns + static_cast<size_t>(objects_.row_width()); }
    size_t state_width() const { return kNumStateColumns + static_cast<size_t>(objects_.state_width()); }
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

    static constexpr size_t kNumVehicleFields = sizeof(VehicleState) / sizeof(float);

    const TrackGeometry& track_of(size_t env) const { return tracks_[episodes_[env].track].geometry(); }
    bool is_reversed(size_t env) const { return static_cast<size_t>(episodes_[env].track) >= num_tracks(); }
    VehicleState vehicle(size_t env) const {
        const float* at = &vehicles_[env];
        const size_t n = num_envs();
        return {at[0], at[n], at[2 * n], at[3 * n], at[4 * n], at[5 * n], at[6 * n]};
    }
    void store_vehicle(size_t env, const VehicleState& state);
    bool is_over(size_t env) const { return flags_[env] || flags_[num_envs() + env]; }
    Draws draws_of_race(size_t env) const;  // of the race that a car is in
    VehicleState start_pose(size_t env, int32_t slot, bool is_new_race);
    void begin_race(size_t first, const bool* mask);
    void begin_episode(size_t env, int32_t slot, bool is_new_race, int32_t track);
    void write_prepare_row(size_t env);
    void draw_episode(size_t env);  // conditions and camera of an episode
    void publish(size_t env);       // a car to the others of its race
    void show_others(size_t env);   // the others of its race what has changed about a car between two steps
    void move_bots(size_t first);
    void forget_commands(size_t env);
    void render(const CameraModel& camera, size_t env, const VehicleState& state, uint8_t* frame);
    void look(size_t env);  // observes and renders the current pose
    void step_chunk(size_t begin, size_t end, const float* actions);
    size_t chunk_size(size_t most) const;

    template <typename Visitor>
    void visit_saved(Visitor&& visit);
    std::vector<uint8_t> snapshot() const;
    void restore(const uint8_t* bytes);
    const char* find_fault() const;  // null if the state is one that this engine can go on from

    EngineConfig config_;
    mutable std::mutex mutex_;  // held by every public call that reads or writes cars
    std::vector<TrackStore> tracks_;
    std::vector<std::shared_ptr<const GroundMap>> grounds_;
    std::unique_ptr<CameraModel> camera_, right_camera_;  // the one, or the left one, and the right one
    ObjectField objects_;
    ThreadPool pool_;

    std::vector<float> vehicles_, parameters_, steering_command_, speed_command_, is_moving_, state_;
    std::vector<double> rows_;
    std::vector<float> lidar_;
    std::vector<uint8_t> frames_;
    std::vector<Episode> episodes_;
    std::vector<int32_t> track_choice_;
    std::vector<int32_t> races_;     // (N / cars_per_race,) number of each race, empty where cars race alone
    std::vector<uint64_t> seeds_;    // (N,) with its stream, the key of each car's random numbers
    std::vector<uint32_t> streams_;  // (N,)
    std::vector<GreyPalette> palettes_;

    // Randomisation; all of it empty where there is none.
    std::unique_ptr<Randomization> randomization_;
    RgbPalette colours_;
    VehicleParameters vehicle_;                         // before randomisation
    std::vector<Conditions> conditions_;                // (N,)
    std::vector<CameraModel> cameras_, right_cameras_;  // (N,), empty unless cameras differ, or lenses
    std::vector<int32_t> delay_;                        // (N,) substeps, empty unless commands act late
    std::vector<float> earlier_;                        // (4, N), see VehicleArrays

    std::unique_ptr<bool[]> flags_;  // terminated, then truncated (std::vector<bool> has no bytes to show)
};

}  // namespace racecraft
