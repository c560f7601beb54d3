// Objects on and around the line where the lap begins, at the edge of what a camera sees, and on their way to
// the other lane.
#include "racecraft/objects.hpp"

#include <utility>

#include "check.hpp"
#include "object_rule.hpp"
#include "racecraft/collision.hpp"
#include "racecraft/grid.hpp"
#include "tracks.hpp"

namespace racecraft {
namespace {

// A box that stands in a lane.
ObjectState box_at(const TrackGeometry& track, double arc_length, float lane,
                   ObjectKind kind = ObjectKind::box) {
    ObjectState object{};
    object.kind = kind;
    object.arc_length = wrap_arc_length(track, arc_length);
    object.lane = object.lane_from = lane;
    object.travelled = 1.0f;
    settle_object(track, BotRule{}, object);
    return object;
}

ObjectsAround around(const std::vector<ObjectState>& objects) {
    const int32_t count = static_cast<int32_t>(objects.size());
    return {objects.data(), count, count, count};
}

}  // namespace

TEST(a_place_comes_back_into_the_lap_and_stays_on_an_open_road) {
    const TrackStore store = test::store_of(test::circuit());
    const TrackGeometry& track = store.geometry();
    for (const double place : {0.0, 1.0, track.length - 1e-9}) {
        for (const double turns : {-2.0, 0.0, 3.0}) {
            CHECK_NEAR(wrap_arc_length(track, place + turns * track.length), place, 1e-9);
        }
    }
    for (const double end : {track.length, -track.length, -1e-18, -1e-300, 7.0 * track.length}) {
        const double wrapped = wrap_arc_length(track, end);
        CHECK(wrapped >= 0.0 && wrapped < track.length);  // rounding must not give the length itself
    }
    TrackGeometry road = track;
    road.is_closed = 0;
    CHECK_EQUAL(wrap_arc_length(road, -1.0), 0.0);
    CHECK_EQUAL(wrap_arc_length(road, road.length + 1.0), road.length);
}

TEST(a_start_takes_the_lane_without_an_object_near_before_behind_and_across_the_line) {
    const TrackStore store = test::store_of(test::circuit());
    const TrackGeometry& track = store.geometry();
    for (const double start : {0.0, 0.4, 5.0, track.length - 0.4}) {
        for (const double apart : {-0.95, -0.5, 0.0, 0.5, 0.95}) {
            for (const float lane : {-1.0f, 1.0f}) {
                CHECK_EQUAL(start_lane(track, around({box_at(track, start + apart, lane)}), start), -lane);
            }
        }
        for (const double apart : {-1.05, 1.05, 5.0}) {
            CHECK_EQUAL(start_lane(track, around({box_at(track, start + apart, 1.0f)}), start), 0.0f);
        }
        // Between two, the lane whose object is farther.
        for (const double nearer : {-0.3, 0.3}) {
            const std::vector<ObjectState> two = {box_at(track, start + nearer, 1.0f),
                                                  box_at(track, start - 2.0 * nearer, -1.0f)};
            CHECK_EQUAL(start_lane(track, around(two), start), -1.0f);
        }
    }
}

TEST(a_bot_drifts_to_the_other_lane_every_time_it_changes) {
    const TrackStore store = test::store_of(test::circuit());
    const TrackGeometry& track = store.geometry();
    const BotRule bot{.speed = 1.2f, .changes_lane = true, .shortest_stay = 0.5f, .longest_stay = 1.0f};
    ObjectState object = box_at(track, 0.0, 1.0f, ObjectKind::bot_car);
    object.travelled = bot.change_distance;
    object.stay = 0.5f;
    // A lane is 0.4 m from the other, and a smooth step is one and a half times as steep as a straight one.
    const double steepest = 1.5 * 0.4 * 1.2 / 15.0 / bot.change_distance;
    double before = object.offset;
    float lane = object.lane;
    int changes = 0;
    for (int step = 0; step < 600; ++step) {
        advance_bot(track, bot, 3, 0, 0, 0, kControlDt, object);
        CHECK_NEAR(object.offset, before, 1.2 * steepest);
        before = object.offset;
        changes += object.lane != lane;
        lane = object.lane;
        CHECK_EQUAL(changes, object.changes);
        // Half a metre after the change's end it has arrived, rear axle and all.
        if (object.travelled >= bot.change_distance && object.stay < 0.3f) {
            CHECK_NEAR(object.offset, 0.2 * static_cast<double>(lane), 0.02);
        }
    }
    CHECK(changes > 15);
}

TEST(a_saved_object_of_no_kind_is_refused) {
    const TrackStore store = test::store_of(test::circuit());
    for (int32_t kind = -1; kind <= kNumObjectKinds; ++kind) {
        std::vector<ObjectState> objects(2, box_at(store.geometry(), 1.0, 1.0f));
        objects[1].kind = static_cast<ObjectKind>(kind);
        CHECK_EQUAL(find_fault(objects) == nullptr, kind >= 0 && kind < kNumObjectKinds);
    }
}

TEST(a_saved_object_that_is_nowhere_is_refused) {
    const TrackStore store = test::store_of(test::circuit());
    const auto is_fine = [&](auto change) {
        std::vector<ObjectState> objects(2, box_at(store.geometry(), 1.0, 1.0f));
        change(objects[1]);
        return find_fault(objects) == nullptr;
    };
    for (const double value : {std::nan(""), 1e7, -1e7}) {
        CHECK(!is_fine([&](ObjectState& object) { object.arc_length = value; }));
        CHECK(!is_fine([&](ObjectState& object) { object.offset = value; }));
        CHECK(!is_fine([&](ObjectState& object) { object.distance = value; }));
        CHECK(!is_fine([&](ObjectState& object) { object.x = static_cast<float>(value); }));
        CHECK(!is_fine([&](ObjectState& object) { object.stay = static_cast<float>(value); }));
    }
    CHECK(is_fine([](ObjectState& object) { object.offset = -0.5; }));
    CHECK(!is_fine([](ObjectState& object) { object.distance = -0.5; }));
}

TEST(stays_are_drawn_anew_and_fill_their_range) {
    const BotRule bot{.shortest_stay = 3.0f, .longest_stay = 5.0f};
    double low = 1e300, high = 0.0, mean = 0.0;
    float before = 0.0f;
    for (int32_t changes = 0; changes < 1000; ++changes) {
        const float stay = draw_stay(bot, 1, 2, 3, 4, changes);
        CHECK(stay != before && stay != draw_stay(bot, 1, 2, 3, 5, changes));
        before = stay;
        low = std::fmin(low, stay);
        high = std::fmax(high, stay);
        mean += stay / 1000.0;
    }
    CHECK(low >= 3.0 && low < 3.02 && high > 4.98 && high <= 5.0);
    CHECK_NEAR(mean, 4.0, 0.06);
}

TEST(two_touch_when_a_corner_of_either_is_in_the_other) {
    const Footprint across = car_footprint(1.0f, 2.0f, 1.0f, 0.0f);
    for (const float side : {-1.0f, 1.0f}) {
        // Its nose in the middle of the other's side, where none of the other's corners is.
        const auto touch = [&](float apart) {
            const Footprint nose = car_footprint(1.0f + side * apart, 2.0f, 0.0f, 1.0f);
            CHECK_EQUAL(do_touch(nose, across), do_touch(across, nose));
            return do_touch(nose, across);
        };
        const float reach = 0.5f * (kCarLength + kCarWidth);
        CHECK(touch(reach - 0.01f));
        CHECK(!touch(reach + 0.01f));
    }
}

TEST(a_critic_is_told_of_what_comes_next_also_beyond_the_line) {
    const TrackStore store = test::store_of(test::circuit());
    const TrackGeometry& track = store.geometry();
    std::vector<ObjectState> objects = {box_at(track, 0.5, 1.0f), box_at(track, 2.0, -1.0f),
                                        box_at(track, track.length - 3.0, 1.0f)};
    objects[1].speed = 2.0f;
    float seen[kNumObjectState];
    observe_objects(track, around(objects), track.length - 1.0, seen);
    CHECK_NEAR(seen[0], 1.0 / 2.5, 0.01);
    CHECK_NEAR(seen[1], 0.5, 0.02);
    CHECK_EQUAL(seen[2], 0.0f);
    CHECK_NEAR(seen[3], 1.0 / 4.0, 0.01);
    CHECK_NEAR(seen[4], -0.5, 0.02);
    CHECK_EQUAL(seen[5], 0.5f);
    // The order of the objects means nothing.
    std::swap(objects[0], objects[2]);
    float again[kNumObjectState];
    observe_objects(track, around(objects), track.length - 1.0, again);
    for (int i = 0; i < kNumObjectState; ++i) CHECK_EQUAL(again[i], seen[i]);
    // One alone comes once; on an open road what is behind never comes.
    observe_objects(track, around({objects[0]}), track.length - 1.0, again);
    CHECK(again[0] > 0.0f && again[3] == 0.0f && again[4] == 0.0f);
    const TrackStore bend = test::store_of(test::open_bend());
    observe_objects(bend.geometry(), around({box_at(bend.geometry(), 1.0, 1.0f)}), 2.0, again);
    for (const float value : again) CHECK_EQUAL(value, 0.0f);
}

TEST(an_object_is_in_view_when_a_corner_or_its_middle_is) {
    ObjectState box{};
    box.kind = ObjectKind::box;
    box.cosine = 1.0f;
    constexpr float narrow = 0.1f;
    const auto is_seen = [&](float x, float y, float turn = 0.0f) {
        box.x = x;
        box.y = y;
        sincos_of(turn, box.sine, box.cosine);
        return is_object_in_view(box, 1.0f, 2.0f, 0.0f, 1.0f, narrow);
    };
    // So near that no corner is within the opening, only the middle.
    CHECK(is_seen(1.25f, 2.0f));
    CHECK(!is_seen(1.25f, 2.05f));
    // Farther away by one of its corners: which one, says the side from which it comes in.
    for (const float side : {-1.0f, 1.0f}) {
        const float edge = 0.15f + narrow * 2.8f;  // the corner ahead, at 2.8 m, comes in first
        CHECK(is_seen(3.6f, 2.0f + side * (edge - 0.01f)));
        CHECK(!is_seen(3.6f, 2.0f + side * (edge + 0.01f)));
        // Turned by a quarter the long side lies across.
        const float turned = 0.2f + narrow * 2.75f;
        CHECK(is_seen(3.6f, 2.0f + side * (turned - 0.01f), 0.5f * kPi));
        CHECK(!is_seen(3.6f, 2.0f + side * (turned + 0.01f), 0.5f * kPi));
    }
    CHECK(!is_seen(-1.0f, 2.0f));
}

TEST(lanes_are_half_of_the_way_to_the_borders_and_the_lap_closes) {
    const TrackStore store = test::store_of(test::circuit());
    const TrackGeometry& track = store.geometry();
    for (const float lane : {-1.0f, 1.0f}) {
        for (const double s : {0.0, 1.0, 7.5, track.length - 1e-9, track.length + 2.0, -0.5}) {
            const LanePoint point = lane_point(track, s, lane);
            const Projection at = project(track, point.x, point.y);
            CHECK_NEAR(at.offset, 0.2 * static_cast<double>(lane), 0.01);
            CHECK_NEAR(lap_difference(track, at.arc_length / track.length, s / track.length), 0.0, 0.003);
        }
    }
    // Half of the way to its own border, where one is farther away than the other.
    test::Outline wide = test::circuit();
    for (size_t i = 0; i < wide.outer.size(); ++i)
        wide.outer[i] = wide.center[i] + 2.0 * (wide.outer[i] - wide.center[i]);
    const TrackStore uneven = test::store_of(wide);
    for (const double s : {0.0, 1.03, 7.5}) {
        for (const auto& [lane, offset] : {std::pair{-1.0f, -0.4}, std::pair{1.0f, 0.2}}) {
            const LanePoint point = lane_point(uneven.geometry(), s, lane);
            CHECK_NEAR(project(uneven.geometry(), point.x, point.y).offset, offset, 0.01);
        }
    }
    CHECK_EQUAL(wrap_arc_length(track, track.length), 0.0);
    CHECK_NEAR(wrap_arc_length(track, -0.5), track.length - 0.5, 1e-12);
    CHECK_NEAR(distance_ahead(track, 0.5, track.length - 0.5), 1.0, 1e-9);
    CHECK_NEAR(distance_ahead(track, track.length - 0.5, 0.5), -1.0, 1e-9);
    const TrackStore bend = test::store_of(test::open_bend());
    CHECK_EQUAL(wrap_arc_length(bend.geometry(), -1.0), 0.0);
    CHECK_EQUAL(wrap_arc_length(bend.geometry(), 1e3), bend.geometry().length);
}

TEST(a_place_near_an_object_is_not_free_also_across_the_line) {
    const TrackStore store = test::store_of(test::circuit());
    const TrackGeometry& track = store.geometry();
    // A metre and half of both lengths, collision box and all.
    const double reach = 1.0 + 0.5 * (0.3235 + 0.5);
    for (const double start : {0.0, 0.6, 5.0, track.length - 0.6}) {
        for (const double side : {-1.0, 1.0}) {
            const auto is_free_at = [&](double apart, float lane, double room = 1.0) {
                const std::vector<ObjectState> objects = {box_at(track, start + side * apart, 1.0f)};
                return is_free(track, around(objects), {start, lane}, room);
            };
            CHECK(!is_free_at(reach - 0.1, 1.0f));
            CHECK(is_free_at(reach + 0.1, 1.0f));
            CHECK(is_free_at(0.0, -1.0f) == (0.4 > 0.05 + 0.5 * (0.4 + 0.1961)));
            CHECK(is_free_at(reach - 0.1, 1.0f, 0.3));
            CHECK(!is_free_at(0.3, 1.0f, 0.0));
        }
    }
}

}  // namespace racecraft
