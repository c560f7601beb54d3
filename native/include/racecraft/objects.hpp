// What stands or drives on the track besides the car: boxes, parked cars, bot cars, the other cars of a race.
//
//        inner border  ----------------------------------      lane  2
//        inner lane      - - - [box] - - - - - - - - - -             1
//        centre line   . . . . . . . . . . . . . . . . .             0     An object is somewhere along the
//        centre outer lane      - - - - - - - - [bot > - - - -             -1     line and somewhere across,
//        in lanes. outer border  ----------------------------------           -2
//
// A car on a lane has both axles on the lane's line, so its heading never jumps where the line has a corner.
// Everything random is a function of (seed, stream, episode, object), as in random.hpp.
#pragma once

#include "racecraft/random.hpp"
#include "racecraft/rules.hpp"

namespace racecraft {

enum class ObjectKind : int32_t {
    box = 0,
    parked_car = 1,
    bot_car = 2,
    racer = 3,         // another agent's car
    frozen_racer = 4,  // the same while it stands as a penalty: seen, but nobody can run into it
    gone_racer = 5     // the same when its episode is over: neither seen nor hit
};
constexpr int32_t kNumObjectKinds = 6;

constexpr int32_t kMaxObjects = 32;     // obstacles and bots of one world
constexpr int32_t kMaxCarsPerRace = 8;  // agents' cars in one world
constexpr int32_t kMaxAround = kMaxObjects + kMaxCarsPerRace - 1;

// Length, width and height, m. Collisions see a box larger than it is, as the original's do.
constexpr float kBoxLength = 0.4f, kBoxWidth = 0.3f, kBoxHeight = 0.25f;
constexpr float kBoxBuffer = 0.1f;
constexpr float kCarLength = 0.3235f, kCarWidth = 0.1961f;

constexpr float kParkDistance = 100.0f;  // m beyond the room, where the cars are whose episode is over
constexpr double kStartClearance = 1.0;  // m along the track; a car that starts nearer takes the other lane

enum class Placement : int32_t { even = 0, random = 1, fixed = 2 };

// Obstacles or bot cars, and where an episode puts them.
struct ObjectGroup {
    ObjectKind kind = ObjectKind::box;
    int32_t count = 0;
    Placement placement = Placement::even;
    double min_distance = 2.0;           // m along the centre line between neighbours (random)
    double fractions[kMaxObjects] = {};  // of a lap from the first waypoint, in driving direction (fixed)
    float lanes[kMaxObjects] = {};       // 1 inner, -1 outer (fixed)
};

struct BotRule {
    float speed = 0.2f;                               // m/s
    bool changes_lane = false;                        // now and then, to the other lane
    float shortest_stay = 3.0f, longest_stay = 5.0f;  // s in a lane, uniform between
    float change_distance = 1.0f;                     // m over which it changes
};

struct ObjectRule {
    ObjectGroup obstacles, bots;  // in this order they are numbered
    BotRule bot;
};

RC_HD int32_t num_objects(const ObjectRule& rule) {
    return rule.obstacles.count + rule.bots.count;
}

struct ObjectState {
    double arc_length;      // m along the centre line; what a bot advances
    double offset;          // m from the centre line, left positive, projected
    double distance;        // m along the centre line, projected
    float x, y;             // m, of its centre
    float heading;          // rad
    float sine, cosine;     // of the heading
    float speed;            // m/s now
    float lane_from, lane;  // the lane it comes from, the one it is in or changes to
    float travelled;        // m since it began to change, up to change_distance
    float stay;             // s until it changes again
    int32_t changes;        // of lane in this episode
    ObjectKind kind;
};
static_assert(sizeof(ObjectState) == 3 * sizeof(double) + 10 * sizeof(float) + 2 * sizeof(int32_t));

// A world is an array: its obstacles, its bots, and the cars of its race where there are several. This is
// what one of these cars has around it: the same without itself.
struct ObjectsAround {
    const ObjectState* world;
    int32_t count;        // around the car
    int32_t first_racer;  // where the cars of the race begin in the world
    int32_t own;          // the car itself; first_racer where the world has no racers
};

// Where in the world the object number i around a car is.
RC_HD int32_t place_in_world(const ObjectsAround& around, int32_t i) {
    return i + (i >= around.own ? 1 : 0);
}

RC_HD const ObjectState& object_at(const ObjectsAround& around, int32_t i) {
    return around.world[place_in_world(around, i)];
}

RC_HD bool is_there(const ObjectState& object) {
    return object.kind != ObjectKind::gone_racer;
}

// Whether cars can run into it.
RC_HD bool is_solid(const ObjectState& object) {
    return object.kind < ObjectKind::frozen_racer;
}

// Half of the rectangle that collisions see, m, along and across.
RC_HD float collision_half_length(ObjectKind kind) {
    return 0.5f * (kind == ObjectKind::box ? kBoxLength + kBoxBuffer : kCarLength);
}
RC_HD float collision_half_width(ObjectKind kind) {
    return 0.5f * (kind == ObjectKind::box ? kBoxWidth + kBoxBuffer : kCarWidth);
}

// Half of the thing itself, as cameras and LIDAR see it.
RC_HD float half_length(ObjectKind kind) {
    return 0.5f * (kind == ObjectKind::box ? kBoxLength : kCarLength);
}
RC_HD float half_width(ObjectKind kind) {
    return 0.5f * (kind == ObjectKind::box ? kBoxWidth : kCarWidth);
}

RC_HD double wrap_arc_length(const TrackGeometry& track, double arc_length) {
    if (track.is_closed == 0) return clamp(arc_length, 0.0, track.length);
    const double turns = floor_of(arc_length / track.length);
    const double wrapped = arc_length - turns * track.length;
    return wrapped < track.length ? max_of(wrapped, 0.0) : 0.0;
}

// How far `to` lies ahead of `from` along the track, m: the shorter way round a closed one, negative behind.
RC_HD double distance_ahead(const TrackGeometry& track, double to, double from) {
    return lap_difference(track, to / track.length, from / track.length) * track.length;
}

struct LanePoint {
    double x, y;  // m
};

// The point of a lane's line at a place along the centre line.
RC_HD LanePoint lane_point(const TrackGeometry& track, double arc_length, float lane) {
    const double s = wrap_arc_length(track, arc_length);
    int32_t low = 0;
    int32_t high = track.num_segments;  // the segment is in [low, high)
    while (high - low > 1) {
        const int32_t middle = low + (high - low) / 2;
        if (track.segments[middle].arc_length <= s) {
            low = middle;
        } else {
            high = middle;
        }
    }
    const Segment& segment = track.segments[low];
    const double share = clamp((s - segment.arc_length) * segment.inverse_length, 0.0, 1.0);
    const LaneOffset& here = track.lane_offsets[low];
    const LaneOffset& next = track.lane_offsets[low + 1];
    const double across = static_cast<double>(lane);
    const double here_x = lane < 0.0f ? -here.outer_x : here.inner_x;
    const double here_y = lane < 0.0f ? -here.outer_y : here.inner_y;
    const double next_x = lane < 0.0f ? -next.outer_x : next.inner_x;
    const double next_y = lane < 0.0f ? -next.outer_y : next.inner_y;
    return {segment.x + share * segment.dx + across * (here_x + share * (next_x - here_x)),
            segment.y + share * segment.dy + across * (here_y + share * (next_y - here_y))};
}

struct LanePose {
    float x, y, heading;  // m, rad
    float pace;           // m along the centre line for a metre along the lane
};

// A car with its axles on the lines: from lane `rear` to lane `front`, its origin at arc_length.
RC_HD LanePose lane_pose(const TrackGeometry& track, double arc_length, float rear, float front) {
    constexpr double back = static_cast<double>(-kRearAxleX);
    constexpr double ahead = static_cast<double>(kFrontAxleX);
    double from = arc_length - back;
    double to = arc_length + ahead;
    if (track.is_closed == 0) {  // the whole car on the road at both of its ends
        from = clamp(from, 0.0, track.length - (back + ahead));
        to = from + (back + ahead);
    }
    const LanePoint a = lane_point(track, from, rear);
    const LanePoint b = lane_point(track, to, front);
    const double dx = b.x - a.x;
    const double dy = b.y - a.y;
    constexpr double share = back / (back + ahead);
    LanePose pose;
    pose.x = static_cast<float>(a.x + share * dx);
    pose.y = static_cast<float>(a.y + share * dy);
    pose.heading = atan2_of(static_cast<float>(dy), static_cast<float>(dx));
    const float length = static_cast<float>(sqrt_of(dx * dx + dy * dy));
    pose.pace = clamp(static_cast<float>(back + ahead) / max_of(length, 1e-3f), 0.25f, 4.0f);
    return pose;
}

// Where across a bot is that has `travelled` so far since it left its lane: a smooth step.
RC_HD float lane_after(const ObjectState& object, float travelled, float change_distance) {
    const float share = clamp(travelled / max_of(change_distance, 0.01f), 0.0f, 1.0f);
    const float smooth = share * share * (3.0f - 2.0f * share);
    return object.lane_from + (object.lane - object.lane_from) * smooth;
}

// Puts an object where its arc length and lane say; returns its pace along the centre line.
RC_HD float settle_object(const TrackGeometry& track, const BotRule& bot, ObjectState& object) {
    const float rear = lane_after(object, object.travelled + kRearAxleX, bot.change_distance);
    const float front = lane_after(object, object.travelled + kFrontAxleX, bot.change_distance);
    const LanePose pose = lane_pose(track, object.arc_length, rear, front);
    object.x = pose.x;
    object.y = pose.y;
    object.heading = pose.heading;
    sincos_of(object.heading, object.sine, object.cosine);
    const Projection at = project(track, static_cast<double>(pose.x), static_cast<double>(pose.y));
    object.offset = at.offset;
    object.distance = at.arc_length;
    return pose.pace;
}

// Seconds until a bot's next change of lane.
RC_HD float draw_stay(const BotRule& bot, uint64_t seed, uint32_t stream, uint32_t episode, uint32_t index,
                      int32_t changes) {
    const uint32_t number = index + (static_cast<uint32_t>(changes) << 8);
    const float share = uniform_of(philox(seed, stream, episode, number, Purpose::lane_change).words[0]);
    return bot.shortest_stay + share * (bot.longest_stay - bot.shortest_stay);
}

// Places a group at the beginning of an episode. Random places keep min_distance between neighbours, or as
// much of it as the track has room for; they are uniform among all such places.
RC_HD void place_group(const TrackGeometry& track, const ObjectGroup& group, const BotRule& bot,
                       uint64_t seed, uint32_t stream, uint32_t episode, int32_t first,
                       ObjectState* objects) {
    const int32_t count = group.count;
    const bool is_closed = track.is_closed != 0;
    // Random: of the track's length, what the gaps leave free is cut at sorted random places.
    const double begin = is_closed ? 0.0 : min_of(kStartClearance, 0.5 * track.length);
    const double room = track.length - begin;
    const int32_t gaps = is_closed ? count : count - 1;
    const double gap = gaps > 0 ? min_of(group.min_distance, room / gaps) : 0.0;
    const double free = max_of(room - gap * gaps, 0.0);
    double cuts[kMaxObjects];
    float lanes[kMaxObjects];
    double origin = begin;
    for (int32_t i = 0; i < count; ++i) {
        const uint32_t index = static_cast<uint32_t>(first + i);
        const RandomBlock random = philox(seed, stream, episode, index, Purpose::object_place);
        double cut = static_cast<double>(uniform_of(random.words[0]));
        lanes[i] = (random.words[1] >> 31) != 0 ? 1.0f : -1.0f;
        if (is_closed && i == 0) {  // the first object says where on the ring the others are counted from
            origin = cut * track.length;
            cut = 0.0;
        }
        int32_t k = i;
        for (; k > 0 && cuts[k - 1] > cut; --k) cuts[k] = cuts[k - 1];
        cuts[k] = cut;
    }
    for (int32_t i = 0; i < count; ++i) {
        ObjectState object{};
        object.kind = group.kind;
        double s = track.length * (i + 1) / (count + 1);
        float lane = (i & 1) != 0 ? 1.0f : -1.0f;
        if (group.placement == Placement::fixed) {
            s = group.fractions[i] * track.length;
            lane = group.lanes[i];
        } else if (group.placement == Placement::random) {
            s = origin + cuts[i] * free + gap * i;
            lane = lanes[i];
        }
        object.arc_length = wrap_arc_length(track, s);
        object.lane_from = object.lane = lane;
        object.travelled = bot.change_distance;
        if (group.kind == ObjectKind::bot_car) {
            object.speed = bot.speed;
            object.stay = draw_stay(bot, seed, stream, episode, static_cast<uint32_t>(first + i), 0);
        }
        settle_object(track, bot, object);
        objects[first + i] = object;
    }
}

// The lane that a start at arc_length takes: 0, the centre line, unless an object is near; then the lane
// whose nearest object is farther.
RC_HD float start_lane(const TrackGeometry& track, const ObjectsAround& around, double arc_length) {
    double nearest_inner = 1e300;
    double nearest_outer = 1e300;
    for (int32_t i = 0; i < around.count; ++i) {
        const ObjectState& object = object_at(around, i);
        const double distance = abs_of(distance_ahead(track, object.arc_length, arc_length));
        double& nearest = object.lane > 0.0f ? nearest_inner : nearest_outer;
        nearest = min_of(nearest, distance);
    }
    if (min_of(nearest_inner, nearest_outer) >= kStartClearance) return 0.0f;
    return nearest_inner < nearest_outer ? -1.0f : 1.0f;
}

// Drives a bot for a control step; `seconds` of it.
RC_HD void advance_bot(const TrackGeometry& track, const BotRule& bot, uint64_t seed, uint32_t stream,
                       uint32_t episode, int32_t index, float seconds, ObjectState& object) {
    const bool changes = bot.changes_lane && bot.speed > 0.0f;
    if (changes && object.travelled >= bot.change_distance) {
        object.stay -= seconds;
        if (object.stay <= 0.0f) {
            object.changes += 1;
            object.stay = draw_stay(bot, seed, stream, episode, static_cast<uint32_t>(index), object.changes);
            object.lane_from = object.lane;
            object.lane = -object.lane;
            object.travelled = 0.0f;
        }
    }
    const float way = bot.speed * seconds;
    const float rear = lane_after(object, object.travelled + kRearAxleX, bot.change_distance);
    const float front = lane_after(object, object.travelled + kFrontAxleX, bot.change_distance);
    const float pace = lane_pose(track, object.arc_length, rear, front).pace;
    const double before = object.arc_length;
    object.arc_length = wrap_arc_length(track, before + static_cast<double>(way * pace));
    object.travelled = min_of(object.travelled + way, bot.change_distance);
    object.speed =
        object.arc_length == before && way > 0.0f ? 0.0f : bot.speed;  // 0 at the end of an open road
    settle_object(track, bot, object);
}

// --- what rows and critics read

// Columns that follow a row's own where there are objects; then kNumObjectColumns for every object.
#define RC_OBJECT_HEADER(X)                                                  \
    X(closest_object_prev) /* index of the object behind, along the track */ \
    X(closest_object_next) /* and of the one ahead */                        \
    X(object_in_camera)    /* 0 or 1 */                                      \
    X(crashed_object)      /* index of the object that the car ran into in this step, or -1 */

#define RC_OBJECT_COLUMNS(X)                                        \
    X(object_kind)     /* ObjectKind */                             \
    X(object_x)        /* m */                                      \
    X(object_y)        /* m */                                      \
    X(object_heading)  /* rad */                                    \
    X(object_speed)    /* m/s */                                    \
    X(object_offset)   /* m, from the centre line, left positive */ \
    X(object_distance) /* m along the centre line */

enum ObjectHeader : int {
#define RC_INDEX(name) kObjectHeader_##name,
    RC_OBJECT_HEADER(RC_INDEX)
#undef RC_INDEX
        kNumObjectHeader
};

enum ObjectColumn : int {
#define RC_INDEX(name) kObject_##name,
    RC_OBJECT_COLUMNS(RC_INDEX)
#undef RC_INDEX
        kNumObjectColumns
};

RC_HD int32_t object_row_width(int32_t count) {
    return count > 0 ? kNumObjectHeader + count * kNumObjectColumns : 0;
}

// Objects ahead that the privileged state tells of: closeness 1 / (1 + metres ahead), offset over half the
// track's width, speed over 4 m/s; zeros where there is none.
constexpr int32_t kNumSeenObjects = 2;
constexpr int32_t kNumObjectState = 3 * kNumSeenObjects;

struct Neighbours {
    int32_t prev, next;
};

// The objects behind and ahead by their distance along the track, around the end of it; the first where all
// are gone.
RC_HD Neighbours closest_objects(const ObjectsAround& around, double distance) {
    int32_t prev = -1, next = -1, first = -1, last = -1;
    for (int32_t i = 0; i < around.count; ++i) {
        if (!is_there(object_at(around, i))) continue;
        const double d = object_at(around, i).distance;
        if (first < 0 || d < object_at(around, first).distance) first = i;
        if (last < 0 || d >= object_at(around, last).distance) last = i;
        if (d > distance) {
            if (next < 0 || d < object_at(around, next).distance) next = i;
        } else if (prev < 0 || d >= object_at(around, prev).distance) {
            prev = i;
        }
    }
    if (first < 0) return {0, 0};
    return {prev < 0 ? last : prev, next < 0 ? first : next};
}

// Whether any of an object's corners or its middle is within the opening angle of a camera.
RC_HD bool is_object_in_view(const ObjectState& object, float lens_x, float lens_y, float sine, float cosine,
                             float half_tangent) {
    for (int32_t corner = 0; corner < 5; ++corner) {
        const float along = corner == 4         ? 0.0f
                            : (corner & 1) != 0 ? half_length(object.kind)
                                                : -half_length(object.kind);
        const float across = corner == 4         ? 0.0f
                             : (corner & 2) != 0 ? half_width(object.kind)
                                                 : -half_width(object.kind);
        const float dx = object.x + along * object.cosine - across * object.sine - lens_x;
        const float dy = object.y + along * object.sine + across * object.cosine - lens_y;
        const float ahead = dx * cosine + dy * sine;
        const float right = dx * sine - dy * cosine;
        if (ahead > 0.0f && abs_of(right) <= half_tangent * ahead) return true;
    }
    return false;
}

RC_HD void write_objects(const ObjectsAround& around, Neighbours closest, bool in_camera, int32_t crashed,
                         double* out) {
    out[kObjectHeader_closest_object_prev] = closest.prev;
    out[kObjectHeader_closest_object_next] = closest.next;
    out[kObjectHeader_object_in_camera] = in_camera;
    out[kObjectHeader_crashed_object] = crashed;
    double* columns = out + kNumObjectHeader;
    for (int32_t i = 0; i < around.count; ++i, columns += kNumObjectColumns) {
        const ObjectState& object = object_at(around, i);
        columns[kObject_object_kind] = static_cast<int32_t>(object.kind);
        columns[kObject_object_x] = static_cast<double>(object.x);
        columns[kObject_object_y] = static_cast<double>(object.y);
        columns[kObject_object_heading] = static_cast<double>(object.heading);
        columns[kObject_object_speed] = static_cast<double>(object.speed);
        columns[kObject_object_offset] = object.offset;
        columns[kObject_object_distance] = object.distance;
    }
}

RC_HD void observe_objects(const TrackGeometry& track, const ObjectsAround& around, double distance,
                           float* out) {
    double nearest[kNumSeenObjects] = {1e300, 1e300};
    int32_t seen[kNumSeenObjects] = {-1, -1};
    for (int32_t i = 0; i < around.count; ++i) {
        if (!is_there(object_at(around, i))) continue;
        double ahead = object_at(around, i).distance - distance;
        if (track.is_closed != 0 && ahead < 0.0) ahead += track.length;
        if (ahead < 0.0 || ahead >= nearest[1]) continue;
        const bool is_first = ahead < nearest[0];
        nearest[1] = is_first ? nearest[0] : ahead;
        seen[1] = is_first ? seen[0] : i;
        nearest[0] = is_first ? ahead : nearest[0];
        seen[0] = is_first ? i : seen[0];
    }
    for (int32_t k = 0; k < kNumSeenObjects; ++k, out += 3) {
        out[0] = out[1] = out[2] = 0.0f;
        if (seen[k] < 0) continue;
        const ObjectState& object = object_at(around, seen[k]);
        const float half = 0.5f * table_at(track.width_table, table_position(track, object.distance));
        out[0] = 1.0f / (1.0f + static_cast<float>(nearest[k]));
        out[1] = clamp(static_cast<float>(object.offset) / half, -4.0f, 4.0f);
        out[2] = object.speed * (1.0f / kMaxSpeedCommand);
    }
}

}  // namespace racecraft
