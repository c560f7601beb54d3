// The border between Python and the core: shapes are checked in racecraft.sim, arrays are shared without a
// copy.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <stdexcept>
#include <utility>

#include "dispatch.hpp"
#include "engine.hpp"
#include "log_judge.hpp"
#include "number_text.hpp"
#include "racecraft/lidar.hpp"
#include "racecraft/object_look.hpp"
#include "replay_kernel.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace racecraft {

void bind_learner(nb::module_& m);  // bind_learner.cpp
void bind_device(nb::module_& m);   // bind_device.cpp
void bind_ppo(nb::module_& m);      // bind_ppo.cpp
void bind_views(nb::module_& m);    // bind_views.cpp

const RgbPalette& rgb_palette(const std::string& name) {
    if (name == "2018") return kPalette2018;
    if (name == "2020") return kPalette2020;
    if (name == "2026") return kPalette2026;
    throw std::invalid_argument("Palette '" + name + "' does not exist; choose '2018', '2020' or '2026'.");
}

namespace {

template <typename T, int Dimensions>
using Array = nb::ndarray<nb::numpy, T, nb::ndim<Dimensions>, nb::c_contig>;
using Points = nb::ndarray<const double, nb::shape<-1, 2>, nb::c_contig, nb::device::cpu>;
using Table = nb::ndarray<const float, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Indices = nb::ndarray<const int32_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Mask = nb::ndarray<const bool, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Seeds = nb::ndarray<const uint64_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Bytes = nb::ndarray<const uint8_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

TrackOutline outline_of(const Points& centerline, const Points& inner, const Points& outer, bool is_closed) {
    const size_t count = centerline.shape(0);
    if (count < 2 || count > 65535 || inner.shape(0) != count || outer.shape(0) != count) {
        throw std::invalid_argument(
            "A track needs 2 to 65535 waypoints and borders of the same number of points.");
    }
    return {centerline.data(), inner.data(), outer.data(), static_cast<int>(count), is_closed};
}

// What the engine keeps of one track: its rules' geometry in both directions and the ground that the camera
// sees.
struct NativeTrack {
    Points centerline, inner, outer;
    Points reversed_centerline, reversed_inner, reversed_outer;
    Table widths, curvatures, reversed_widths, reversed_curvatures;
    double samples_per_metre;
    bool is_closed;
    Indices waypoints, reversed_waypoints;

    TrackStore store(bool reversed) const {
        const Table& width = reversed ? reversed_widths : widths;
        const Table& curvature = reversed ? reversed_curvatures : curvatures;
        if (width.shape(0) < 2 || width.shape(0) != curvature.shape(0)) {
            throw std::invalid_argument(
                "Width and curvature tables need the same number of samples, at least 2.");
        }
        TrackOutline outline =
            reversed ? outline_of(reversed_centerline, reversed_inner, reversed_outer, is_closed)
                     : outline_of(centerline, inner, outer, is_closed);
        const Indices& indices = reversed ? reversed_waypoints : waypoints;
        if (indices.shape(0) + 1 != static_cast<size_t>(outline.count)) {
            throw std::invalid_argument("Every piece of the centre line needs the index of its waypoint.");
        }
        outline.waypoints = indices.data();
        return TrackStore(outline, std::vector<float>(width.data(), width.data() + width.shape(0)),
                          std::vector<float>(curvature.data(), curvature.data() + curvature.shape(0)),
                          samples_per_metre);
    }
};

VehicleParameters vehicle_of(const std::vector<float>& values) {
    if (values.size() != kNumVehicleParameters)
        throw std::invalid_argument("Wrong number of vehicle parameters.");
    VehicleParameters parameters;
    std::memcpy(&parameters, values.data(), sizeof(parameters));
    return parameters;
}

// Ranges (low, high) of all conditions, then of tint and colour.
Randomization randomization_of(const std::vector<float>& ranges) {
    Randomization randomization;
    if (ranges.size() != sizeof(randomization) / sizeof(float))
        throw std::invalid_argument("Wrong number of ranges of a randomisation.");
    std::memcpy(&randomization, ranges.data(), sizeof(randomization));
    return randomization;
}

#define RC_NAME(name) #name,
const char* const kConditionNames[] = {RC_CONDITIONS(RC_NAME)};
const char* const kRowNames[] = {RC_ROW_COLUMNS(RC_NAME)};
const char* const kStateNames[] = {RC_STATE_COLUMNS(RC_NAME)};
const char* const kVehicleNames[] = {RC_VEHICLE_PARAMETERS(RC_NAME)};
const char* const kObjectHeaderNames[] = {RC_OBJECT_HEADER(RC_NAME)};
const char* const kObjectNames[] = {RC_OBJECT_COLUMNS(RC_NAME)};
#undef RC_NAME

template <size_t Count>
nb::tuple names_of(const char* const (&names)[Count]) {
    nb::list list;
    for (const char* name : names) list.append(name);
    return nb::tuple(list);
}

void bind_camera(nb::module_& m) {
    nb::class_<CameraSpec>(m, "CameraSpec",
                           "Where a camera sits on the car and what it covers; SI units and radians.")
        .def(
            "__init__",
            [](CameraSpec* self, int width, int height, float hfov, float forward, float left, float above,
               float pitch) { new (self) CameraSpec{width, height, hfov, pitch, forward, left, above}; },
            "width"_a, "height"_a, "hfov"_a, "forward"_a, "left"_a, "above"_a, "pitch"_a)
        .def_ro("width", &CameraSpec::width)
        .def_ro("height", &CameraSpec::height);
    nb::class_<GroundMap>(m, "GroundMap", "The ground of a track as cameras see it.")
        .def(
            "__init__",
            [](GroundMap* self, const Points& centerline, const Points& inner, const Points& outer,
               bool is_closed, float texel) {
                const TrackOutline outline = outline_of(centerline, inner, outer, is_closed);
                nb::gil_scoped_release release;
                new (self) GroundMap(outline, GroundOptions{.texel = texel});
            },
            "centerline"_a, "inner"_a, "outer"_a, "is_closed"_a, "texel"_a)
        .def_prop_ro("num_bytes", &GroundMap::num_bytes);
}

ObjectGroup group_of(int kind, int count, int placement, double min_distance,
                     const std::vector<double>& fractions, const std::vector<float>& lanes) {
    ObjectGroup group;
    group.kind = static_cast<ObjectKind>(kind);
    group.placement = static_cast<Placement>(placement);
    group.count = count;
    group.min_distance = min_distance;
    const size_t positions = group.placement == Placement::fixed ? static_cast<size_t>(count) : 0;
    if (count < 0 || count > kMaxObjects || fractions.size() < positions || lanes.size() < positions)
        throw std::invalid_argument("Wrong number of objects or of their positions.");
    std::copy_n(fractions.begin(), positions, group.fractions);
    std::copy_n(lanes.begin(), positions, group.lanes);
    return group;
}

void bind_objects(nb::module_& m) {
    nb::class_<ObjectGroup>(m, "ObjectGroup", "Obstacles or bot cars, and where an episode puts them.")
        .def(
            "__init__",
            [](ObjectGroup* self, int kind, int count, int placement, double min_distance,
               const std::vector<double>& fractions, const std::vector<float>& lanes) {
                new (self) ObjectGroup(group_of(kind, count, placement, min_distance, fractions, lanes));
            },
            "kind"_a, "count"_a, "placement"_a, "min_distance"_a, "fractions"_a, "lanes"_a);
    nb::class_<ObjectRule>(m, "ObjectRule", "What stands and drives on the track besides the car.")
        .def(
            "__init__",
            [](ObjectRule* self, const ObjectGroup& obstacles, const ObjectGroup& bots, float speed,
               bool changes_lane, float shortest_stay, float longest_stay, float change_distance) {
                new (self) ObjectRule{
                    obstacles, bots, {speed, changes_lane, shortest_stay, longest_stay, change_distance}};
            },
            "obstacles"_a, "bots"_a, "speed"_a, "changes_lane"_a, "shortest_stay"_a, "longest_stay"_a,
            "change_distance"_a);
}

void bind_engine(nb::module_& m) {
    nb::class_<NativeTrack>(m, "NativeTrack", "Both directions of one track, as arrays in metres.")
        .def(nb::init<Points, Points, Points, Points, Points, Points, Table, Table, Table, Table, double,
                      bool, Indices, Indices>(),
             "centerline"_a, "inner"_a, "outer"_a, "reversed_centerline"_a, "reversed_inner"_a,
             "reversed_outer"_a, "widths"_a, "curvatures"_a, "reversed_widths"_a, "reversed_curvatures"_a,
             "samples_per_metre"_a, "is_closed"_a, "waypoints"_a, "reversed_waypoints"_a);

    nb::class_<Engine>(m, "Engine", "A batch of cars; see racecraft.sim.Simulation, its Python face.")
        .def(
            "__init__",
            [](Engine* self, const std::vector<const NativeTrack*>& tracks,
               const std::vector<std::shared_ptr<GroundMap>>& grounds, const std::vector<float>& vehicle,
               const CameraSpec* camera, size_t num_envs, uint64_t seed, int substeps, int num_threads,
               int laps, int max_steps, double time_limit, int start_mode, double start_offset,
               double start_advance, bool start_spread, float lateral_jitter, float heading_jitter,
               int direction, const ObjectRule& objects, bool has_lidar, float baseline, bool draws_tracks,
               const std::vector<float>& randomization, const std::string& world, size_t cars_per_race,
               bool shuffle, int picture_age) {
                std::vector<TrackStore> stores;
                for (const bool reversed : {false, true}) {
                    for (const NativeTrack* track : tracks) stores.push_back(track->store(reversed));
                }
                const EngineConfig config{
                    num_envs,
                    seed,
                    substeps,
                    num_threads,
                    RuleLimits{laps, max_steps, time_limit},
                    StartRule{static_cast<StartMode>(start_mode), start_offset, start_advance, start_spread,
                              lateral_jitter, heading_jitter, shuffle},
                    static_cast<Direction>(direction),
                    objects,
                    has_lidar,
                    baseline,
                    draws_tracks,
                    cars_per_race,
                    picture_age};
                std::optional<Randomization> ranges;
                if (!randomization.empty()) ranges = randomization_of(randomization);
                new (self)
                    Engine(config, std::move(stores),
                           std::vector<std::shared_ptr<const GroundMap>>(grounds.begin(), grounds.end()),
                           vehicle_of(vehicle), camera, ranges ? &*ranges : nullptr, rgb_palette(world));
            },
            "tracks"_a, "grounds"_a, "vehicle"_a, "camera"_a.none(), "num_envs"_a, "seed"_a, "substeps"_a,
            "num_threads"_a, "laps"_a, "max_steps"_a, "time_limit"_a, "start_mode"_a, "start_offset"_a,
            "start_advance"_a, "start_spread"_a, "lateral_jitter"_a, "heading_jitter"_a, "direction"_a,
            "objects"_a, "has_lidar"_a, "baseline"_a, "draws_tracks"_a = false,
            "randomization"_a = std::vector<float>(), "world"_a = "2018", "cars_per_race"_a = size_t{1},
            "shuffle"_a = false, "picture_age"_a = 0)
        .def(
            "reset",
            [](Engine& self, Mask mask, std::optional<Seeds> seeds) {
                if (mask.shape(0) != self.num_envs())
                    throw std::invalid_argument("Wrong length of the reset mask.");
                if (seeds && seeds->shape(0) != self.num_envs())
                    throw std::invalid_argument("Wrong number of seeds.");
                const bool* masked = mask.data();
                const uint64_t* keys = seeds ? seeds->data() : nullptr;
                nb::gil_scoped_release release;
                self.reset(masked, keys);
            },
            "mask"_a, "seeds"_a = nb::none())
        .def(
            "step",
            [](Engine& self,
               nb::ndarray<const float, nb::shape<-1, 2>, nb::c_contig, nb::device::cpu> actions) {
                if (actions.shape(0) != self.num_envs())
                    throw std::invalid_argument("Wrong number of actions.");
                const float* data = actions.data();
                nb::gil_scoped_release release;
                self.step(data);
            },
            "actions"_a)
        .def("set_pose", &Engine::set_pose, "env"_a, "x"_a, "y"_a, "heading"_a, "speed"_a)
        .def("freeze", &Engine::freeze, "env"_a, "steps"_a)
        .def("save",
             [](const Engine& self) {
                 const std::vector<uint8_t> bytes = self.save();
                 uint8_t* data = new uint8_t[bytes.size()];
                 std::memcpy(data, bytes.data(), bytes.size());
                 const nb::capsule owner(data, [](void* p) noexcept { delete[] static_cast<uint8_t*>(p); });
                 return Array<uint8_t, 1>(data, {bytes.size()}, owner);
             })
        .def(
            "load", [](Engine& self, Bytes bytes) { self.load(bytes.data(), bytes.shape(0)); }, "state"_a)
        .def_prop_ro("num_threads", &Engine::num_threads)
        .def_prop_ro("num_bytes", &Engine::num_bytes)
        .def_prop_ro("rows",
                     [](nb::handle_t<Engine> self) {
                         Engine& e = nb::cast<Engine&>(self);
                         return Array<double, 2>(e.rows(), {e.num_envs(), e.row_width()}, self);
                     })
        .def_prop_ro("state",
                     [](nb::handle_t<Engine> self) {
                         Engine& e = nb::cast<Engine&>(self);
                         return Array<float, 2>(e.state(), {e.num_envs(), e.state_width()}, self);
                     })
        .def_prop_ro("frames",
                     [](nb::handle_t<Engine> self) {
                         Engine& e = nb::cast<Engine&>(self);
                         const size_t lenses = e.num_lenses();
                         const size_t height =
                             e.camera() ? static_cast<size_t>(e.camera()->spec().height) : 0;
                         const size_t width = e.camera() ? static_cast<size_t>(e.camera()->spec().width) : 0;
                         return Array<uint8_t, 4>(e.frames(), {e.num_envs(), lenses, height, width}, self);
                     })
        .def_prop_ro("lidar",
                     [](nb::handle_t<Engine> self) {
                         Engine& e = nb::cast<Engine&>(self);
                         const size_t rays = e.lidar() != nullptr ? kLidarRays : 0;
                         return Array<float, 2>(e.lidar(), {e.num_envs(), rays}, self);
                     })
        .def_prop_ro("terminated",
                     [](nb::handle_t<Engine> self) {
                         Engine& e = nb::cast<Engine&>(self);
                         return Array<bool, 1>(e.terminated(), {e.num_envs()}, self);
                     })
        .def_prop_ro("truncated",
                     [](nb::handle_t<Engine> self) {
                         Engine& e = nb::cast<Engine&>(self);
                         return Array<bool, 1>(e.truncated(), {e.num_envs()}, self);
                     })
        .def_prop_ro("vehicles",
                     [](nb::handle_t<Engine> self) {
                         Engine& e = nb::cast<Engine&>(self);
                         return Array<float, 2>(e.vehicles(),
                                                {sizeof(VehicleState) / sizeof(float), e.num_envs()}, self);
                     })
        .def_prop_ro("parameters",
                     [](nb::handle_t<Engine> self) {
                         Engine& e = nb::cast<Engine&>(self);
                         return Array<float, 2>(e.parameters(), {kNumVehicleParameters, e.num_envs()}, self);
                     })
        .def_prop_ro("conditions",
                     [](nb::handle_t<Engine> self) {
                         Engine& e = nb::cast<Engine&>(self);
                         float* values = reinterpret_cast<float*>(e.conditions());
                         return Array<float, 2>(values, {e.num_conditions(), kNumConditions}, self);
                     })
        .def_prop_ro("track_choice", [](nb::handle_t<Engine> self) {
            Engine& e = nb::cast<Engine&>(self);
            return Array<int32_t, 1>(e.track_choice(), {e.num_envs()}, self);
        });
}

void bind_replay(nb::module_& m) {
    constexpr int kNumLogged = sizeof(LoggedRow) / sizeof(double);
    using Log = nb::ndarray<const double, nb::shape<-1, kNumLogged>, nb::c_contig, nb::device::cpu>;
    using Poses = nb::ndarray<const double, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;
    using Commands = nb::ndarray<const float, nb::shape<-1, 2>, nb::c_contig, nb::device::cpu>;
    using Firsts = nb::ndarray<const int64_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

    m.def(
        "judge_log",
        [](const NativeTrack& track, bool reversed, Log log) {
            const size_t count = log.shape(0);
            double* rows = new double[count * kNumRowColumns];
            const nb::capsule owner(rows, [](void* p) noexcept { delete[] static_cast<double*>(p); });
            const TrackStore store = track.store(reversed);
            const LoggedRow* logged = reinterpret_cast<const LoggedRow*>(log.data());
            {
                nb::gil_scoped_release release;
                judge_log(store.geometry(), reversed, logged, count, rows);
            }
            return Array<double, 2>(rows, {count, kNumRowColumns}, owner);
        },
        "track"_a, "reversed"_a, "log"_a);
    m.def(
        "replay_windows",
        [](const std::vector<float>& vehicle, Poses poses, Commands commands, Table durations, Firsts first,
           int known, int free, int substeps) {
            const size_t rows = poses.shape(0), count = first.shape(0);
            if (commands.shape(0) != rows || durations.shape(0) != rows)
                throw std::invalid_argument("Poses, commands and durations need the same number of rows.");
            if (known < 2 || free < 1 || substeps < 1)
                throw std::invalid_argument(
                    "A window needs 2 known rows, 1 free row and 1 substep at least.");
            for (size_t i = 0; i < count; ++i) {
                if (first.data()[i] < 0 || static_cast<size_t>(first.data()[i]) + known + free > rows)
                    throw std::invalid_argument("A window reaches beyond the log.");
            }
            const size_t width = static_cast<size_t>(free);
            double* out = new double[count * width * 3];
            const nb::capsule owner(out, [](void* p) noexcept { delete[] static_cast<double*>(p); });
            const VehicleParameters car = vehicle_of(vehicle);
            const ReplayLog log{poses.data(), commands.data(), durations.data()};
            const ReplayWindows windows{first.data(), known, free, substeps};
            {
                nb::gil_scoped_release release;
                for (size_t begin = 0; begin < count; begin += kReplayLanes) {
                    const int lanes = static_cast<int>(std::min(count - begin, size_t{kReplayLanes}));
                    RC_DISPATCH(replay_windows, car, log, windows, begin, lanes, out);
                }
            }
            return Array<double, 3>(out, {count, width, 3}, owner);
        },
        "vehicle"_a, "poses"_a, "commands"_a, "durations"_a, "first"_a, "known"_a, "free"_a, "substeps"_a);
}

}  // namespace
}  // namespace racecraft

NB_MODULE(_native, m) {
    m.doc() = "Racecraft's native core. Private: use racecraft.sim and racecraft.learn.";
    if (const char* isa = std::getenv("RACECRAFT_ISA"); isa != nullptr && *isa != '\0')
        racecraft::set_isa(isa);
    m.attr("ROW_COLUMNS") = racecraft::names_of(racecraft::kRowNames);
    m.attr("STATE_COLUMNS") = racecraft::names_of(racecraft::kStateNames);
    m.attr("OBJECT_HEADER") = racecraft::names_of(racecraft::kObjectHeaderNames);
    m.attr("OBJECT_COLUMNS") = racecraft::names_of(racecraft::kObjectNames);
    m.attr("CONDITIONS") = racecraft::names_of(racecraft::kConditionNames);
    nb::list colours;
    for (const racecraft::Rgb& colour : racecraft::kCarColours)
        colours.append(nb::make_tuple(colour.red, colour.green, colour.blue));
    m.attr("CAR_COLOURS") = nb::tuple(colours);
    nb::list racers;
    for (const racecraft::Rgb& colour : racecraft::kRacerColours)
        racers.append(nb::make_tuple(colour.red, colour.green, colour.blue));
    m.attr("RACER_COLOURS") = nb::tuple(racers);
    m.attr("MAX_CARS_PER_RACE") = racecraft::kMaxCarsPerRace;
    m.attr("VEHICLE_PARAMETERS") = racecraft::names_of(racecraft::kVehicleNames);
    m.def(
        "number_texts",
        [](const nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>& values) {
            nb::list texts;
            char text[racecraft::kMaxNumberText];
            for (size_t i = 0; i < values.shape(0); ++i)
                texts.append(nb::str(text, racecraft::write_number(values(i), text)));
            return texts;
        },
        "values"_a, "`repr` of every number.");
    m.def("compiler", [] {
#if defined(__clang__)
        return std::string(__VERSION__);
#else
        return std::string("GCC " __VERSION__);
#endif
    });
    m.def("commit", [] { return std::string(RACECRAFT_COMMIT); }, "Of a wheel; empty in a checkout.");
    m.def("isa", [] { return std::string(racecraft::isa_name(racecraft::current_isa())); });
    m.def("available_isas", [] {
        std::vector<std::string> names;
        for (const racecraft::Isa isa : racecraft::available_isas())
            names.push_back(racecraft::isa_name(isa));
        return names;
    });
    m.def(
        "best_isa", [] { return std::string(racecraft::isa_name(racecraft::best_isa())); },
        "The best that this CPU could run, whether this build has it or not.");
    m.def("set_isa", &racecraft::set_isa, "name"_a);
    racecraft::bind_camera(m);
    racecraft::bind_views(m);
    racecraft::bind_objects(m);
    racecraft::bind_engine(m);
    racecraft::bind_replay(m);
    racecraft::bind_learner(m);
    racecraft::bind_device(m);
    racecraft::bind_ppo(m);
}
