// The grid's answers against a search through the whole track.
#include "racecraft/track.hpp"

#include <random>

#include "check.hpp"
#include "tracks.hpp"

namespace racecraft {
namespace {

using test::Outline;
using test::Point;

std::vector<Outline> roads() {
    return {test::circuit(), test::figure_of_eight(), test::open_bend(), test::circuit(7)};
}

double distance_to_piece(const std::vector<double>& line, size_t i, Point p) {
    const double ax = line[2 * i], ay = line[2 * i + 1];
    const double dx = line[2 * i + 2] - ax, dy = line[2 * i + 3] - ay;
    const double along =
        std::fmin(1.0, std::fmax(0.0, ((p.x - ax) * dx + (p.y - ay) * dy) / (dx * dx + dy * dy)));
    return std::hypot(p.x - ax - along * dx, p.y - ay - along * dy);
}

double distance_to_line(const std::vector<double>& line, Point p) {
    double nearest = 1e300;
    for (size_t i = 0; i + 1 < line.size() / 2; ++i)
        nearest = std::fmin(nearest, distance_to_piece(line, i, p));
    return nearest;
}

// Even-odd over one ring, by the angle that each edge's crossing of the horizontal line through p makes.
bool crosses_odd(const std::vector<double>& ring, Point p) {
    bool odd = false;
    const size_t count = ring.size() / 2;
    for (size_t i = 0, j = count - 1; i < count; j = i++) {
        const double xi = ring[2 * i], yi = ring[2 * i + 1], xj = ring[2 * j], yj = ring[2 * j + 1];
        if ((yi > p.y) != (yj > p.y) && p.x < (xj - xi) * (p.y - yi) / (yj - yi) + xi) odd = !odd;
    }
    return odd;
}

bool is_on_road_slowly(const Outline& road, Point p) {
    if (road.is_closed) return crosses_odd(road.inner, p) != crosses_odd(road.outer, p);
    std::vector<double> ring = road.outer;
    for (size_t i = road.num_waypoints(); i-- > 0;) {
        ring.push_back(road.inner[2 * i]);
        ring.push_back(road.inner[2 * i + 1]);
    }
    return crosses_odd(ring, p);
}

double distance_to_border(const Outline& road, Point p) {
    double nearest = std::fmin(distance_to_line(road.inner, p), distance_to_line(road.outer, p));
    if (!road.is_closed) {
        const size_t last = road.inner.size() - 2;
        for (const size_t end : {size_t{0}, last}) {
            const std::vector<double> across = {road.inner[end], road.inner[end + 1], road.outer[end],
                                                road.outer[end + 1]};
            nearest = std::fmin(nearest, distance_to_line(across, p));
        }
    }
    return nearest;
}

// Points all over the grid and well outside of it.
template <typename Visitor>
void for_points(const TrackGeometry& track, int count, Visitor&& visit) {
    std::mt19937_64 random(5);
    const double width = track.grid_columns / track.inverse_cell;
    const double height = track.grid_rows / track.inverse_cell;
    std::uniform_real_distribution<double> u(-0.2, 1.2);
    for (int i = 0; i < count; ++i) {
        const double x = track.grid_x + u(random) * width;
        const double y = track.grid_y + u(random) * height;
        visit(Point{x, y});
    }
}

// The place of a border that is nearest to p, by trying all of its edges.
Point nearest_place(const std::vector<double>& line, Point p) {
    Point best{};
    double least = 1e300;
    for (size_t i = 0; i + 1 < line.size() / 2; ++i) {
        const double distance = distance_to_piece(line, i, p);
        if (distance >= least) continue;
        const double ax = line[2 * i], ay = line[2 * i + 1];
        const double dx = line[2 * i + 2] - ax, dy = line[2 * i + 3] - ay;
        const double along =
            std::fmin(1.0, std::fmax(0.0, ((p.x - ax) * dx + (p.y - ay) * dy) / (dx * dx + dy * dy)));
        least = distance;
        best = {ax + along * dx, ay + along * dy};
    }
    return best;
}

}  // namespace

TEST(projection_finds_the_nearest_segment) {
    for (const Outline& road : roads()) {
        const TrackStore store = test::store_of(road);
        const TrackGeometry& track = store.geometry();
        for_points(track, 20000, [&](Point p) {
            const Projection projection = project(track, p.x, p.y);
            CHECK_NEAR(abs_of(projection.offset), distance_to_line(road.center, p), 1e-12);
            CHECK(projection.segment >= 0 && projection.segment < track.num_segments);
            CHECK(projection.arc_length >= 0.0 && projection.arc_length <= track.length);
            const Segment& segment = track.segments[projection.segment];
            CHECK(segment.arc_length <= projection.arc_length);
            CHECK(projection.arc_length <= segment.arc_length + segment.length);
        });
    }
}

TEST(projected_points_lead_back_to_where_they_came_from) {
    for (const Outline& road : roads()) {
        const TrackStore store = test::store_of(road);
        const TrackGeometry& track = store.geometry();
        for (int i = 0; i < track.num_segments; ++i) {
            const Segment& segment = track.segments[i];
            for (const double offset : {-0.02, 0.0, 0.02}) {
                const double x = segment.x + 0.5 * segment.dx - offset * segment.dy / segment.length;
                const double y = segment.y + 0.5 * segment.dy + offset * segment.dx / segment.length;
                // Where the figure of eight crosses itself, the other strand is as near.
                const Projection projection = project(track, x, y);
                if (projection.segment != i && std::hypot(x, y) < 0.3) continue;
                CHECK_EQUAL(projection.segment, i);
                CHECK_NEAR(projection.offset, offset, 1e-12);
                CHECK_NEAR(projection.arc_length, segment.arc_length + 0.5 * segment.length, 1e-12);
            }
        }
    }
}

TEST(a_waypoint_belongs_to_the_segment_that_starts_there) {
    const Outline road = test::circuit();
    const TrackStore store = test::store_of(road);
    const TrackGeometry& track = store.geometry();
    for (int i = 0; i <= track.num_segments; ++i) {
        const size_t waypoint = static_cast<size_t>(i);
        const Projection projection =
            project(track, road.center[2 * waypoint], road.center[2 * waypoint + 1]);
        const int expected = i == track.num_segments ? 0 : i;
        CHECK_EQUAL(projection.segment, expected);
        CHECK_NEAR(projection.arc_length, track.segments[expected].arc_length, 1e-12);
    }
    const Outline bend = test::open_bend();
    const TrackStore open_store = test::store_of(bend);
    const TrackGeometry& open = open_store.geometry();
    const Projection end = project(open, bend.center[bend.center.size() - 2] + 1.0, bend.center.back());
    CHECK_EQUAL(end.segment, open.num_segments - 1);
    CHECK_EQUAL(end.arc_length, open.length);
}

TEST(a_lap_begins_where_it_ends) {
    for (const Outline& road : {test::circuit(), test::circuit(12)}) {
        const TrackStore store = test::store_of(road);
        const TrackGeometry& track = store.geometry();
        const Segment& last = track.segments[track.num_segments - 1];
        for (double before = 1e-18; before < 1e-12;
             before *= 1.01) {  // so little that the lap may round to whole
            const double share = before * last.inverse_length;
            const Projection at =
                project(track, track.segments[0].x - share * last.dx, track.segments[0].y - share * last.dy);
            CHECK(at.arc_length >= 0.0 && at.arc_length < track.length);
            CHECK_EQUAL(at.segment, at.arc_length < 1.0 ? 0 : track.num_segments - 1);
        }
    }
}

TEST(the_width_is_that_between_the_nearest_places_of_both_borders) {
    // Where two places are equally near either may be meant, and the width has two values; else it has one.
    std::vector<Outline> some = roads();
    some.push_back(test::circuit(12));  // edges much longer than the road is wide
    for (const Outline& road : some) {
        const TrackStore store = test::store_of(road);
        const TrackGeometry& track = store.geometry();
        int doubtful = 0, many = 0;
        for (int i = 0; i < track.num_segments; ++i) {
            const Segment& segment = track.segments[i];
            many += track.width_begin[i + 1] - track.width_begin[i] > 1;
            for (double share = 0.0; share < 1.0; share += 1.0 / 64.0) {
                const double along = share * segment.length;
                const auto slowly = [&](double at) {
                    const double part = at * segment.inverse_length;
                    const Point p{segment.x + part * segment.dx, segment.y + part * segment.dy};
                    const Point left = nearest_place(road.inner, p), right = nearest_place(road.outer, p);
                    return std::hypot(left.x - right.x, left.y - right.y);
                };
                const Projection place{segment.arc_length + along, 0.0, i, 0};
                const double width = width_at(track, place);
                if (std::fabs(width - slowly(along)) < 1e-12) continue;
                const double before = slowly(along - 1e-9), after = slowly(along + 1e-9);
                CHECK(std::fabs(width - before) < 1e-7 || std::fabs(width - after) < 1e-7);
                ++doubtful;
            }
        }
        CHECK(doubtful <= 4);
        CHECK(many > 0);
    }
}

TEST(the_road_is_what_even_odd_says) {
    for (const Outline& road : roads()) {
        const TrackStore store = test::store_of(road);
        const TrackGeometry& track = store.geometry();
        int inside = 0, doubtful = 0;
        for_points(track, 100000, [&](Point p) {
            const bool expected = is_on_road_slowly(road, p);
            inside += expected;
            if (is_on_road(track, p.x, p.y) == expected) return;
            // Only a point on the border to the last bits may go either way.
            if (distance_to_border(road, p) < 1e-12) {
                ++doubtful;
            } else {
                CHECK_EQUAL(is_on_road(track, p.x, p.y), expected);
            }
        });
        CHECK(inside > 1000);
        CHECK(doubtful < 3);
    }
}

TEST(border_points_are_stable_at_the_corners_of_cells) {
    // Cell corners and points on row borders are where a grid goes wrong.
    for (const Outline& road : roads()) {
        const TrackStore store = test::store_of(road);
        const TrackGeometry& track = store.geometry();
        const double cell = 1.0 / track.inverse_cell;
        for (int row = 0; row <= track.grid_rows; row += 3) {
            for (int column = 0; column <= track.grid_columns; column += 3) {
                for (const double nudge : {-1e-13, 0.0, 1e-13}) {
                    const Point p{track.grid_x + column * cell + nudge, track.grid_y + row * cell + nudge};
                    if (distance_to_border(road, p) < 1e-9) continue;
                    CHECK_EQUAL(is_on_road(track, p.x, p.y), is_on_road_slowly(road, p));
                    CHECK_NEAR(abs_of(project(track, p.x, p.y).offset), distance_to_line(road.center, p),
                               1e-12);
                }
            }
        }
    }
}

TEST(no_candidate_list_is_empty_or_out_of_order) {
    for (const Outline& road : roads()) {
        const TrackStore store = test::store_of(road);
        const TrackGeometry& track = store.geometry();
        for (int cell = 0; cell < track.grid_rows * track.grid_columns; ++cell) {
            CHECK(track.segment_begin[cell] < track.segment_begin[cell + 1]);
            for (uint32_t i = track.segment_begin[cell] + 1; i < track.segment_begin[cell + 1]; ++i) {
                CHECK(track.segment_items[i - 1] < track.segment_items[i]);
            }
        }
    }
}

TEST(far_away_points_are_judged_too) {
    const TrackStore store = test::store_of(test::circuit());
    for (const double far : {1e3, 1e6, 1e9}) {
        CHECK(!is_on_road(store.geometry(), far, -far));
        const Projection projection = project(store.geometry(), far, far);
        CHECK(std::isfinite(projection.offset) && std::isfinite(projection.arc_length));
    }
}

TEST(tables_go_on_around_a_circuit_and_stand_still_behind_an_open_road) {
    const std::vector<float> widths = {1.0f, 2.0f, 4.0f, 3.0f};
    const std::vector<float> curvatures = {0.0f, 0.5f, 1.0f, 1.5f};
    const Outline road = test::circuit();
    const double length = test::store_of(road).geometry().length;
    const TrackStore store(road.view(), widths, curvatures, 4.0 / length);
    const TrackGeometry& track = store.geometry();
    const auto width_at = [](const TrackGeometry& on, double arc_length) {
        return table_at(on.width_table, table_position(on, arc_length));
    };
    CHECK_NEAR(width_at(track, 0.0), 1.0, 1e-6);
    CHECK_NEAR(width_at(track, 0.375 * length), 3.0, 1e-6);
    CHECK_NEAR(width_at(track, 0.875 * length), 2.0, 1e-6);
    CHECK_NEAR(width_at(track, length), 1.0, 1e-6);
    CHECK_NEAR(width_at(track, length + 3.0), 1.0 + 4.0 * 3.0 / length, 1e-6);
    CHECK_NEAR(table_at(track.curvature_table, table_position(track, 0.625 * length)), 1.25, 1e-6);

    const Outline bend = test::open_bend();
    const double open_length = test::store_of(bend).geometry().length;
    const TrackStore open_store(bend.view(), widths, curvatures, 3.0 / open_length);
    const TrackGeometry& open = open_store.geometry();
    CHECK_NEAR(width_at(open, 0.0), 1.0, 1e-6);
    CHECK_NEAR(width_at(open, 0.5 * open_length), 3.0, 1e-6);
    CHECK_NEAR(width_at(open, open_length), 3.0, 1e-6);
    CHECK_NEAR(width_at(open, open_length + 3.0), 3.0, 1e-6);
}

TEST(tables_may_be_read_to_their_reach_at_any_resolution) {
    // Under AddressSanitizer this is a test of the tables' length.
    for (const double spacing : {0.03, 0.05, 0.4, 2.5, 40.0}) {
        for (const Outline& road : {test::circuit(), test::open_bend()}) {
            const double length = test::store_of(road).geometry().length;
            const size_t count = std::max<size_t>(2, static_cast<size_t>(std::ceil(length / spacing)));
            const double steps = static_cast<double>(road.is_closed ? count : count - 1);
            const std::vector<float> ones(count, 1.0f);
            const TrackStore store(road.view(), ones, ones, steps / length);
            const TrackGeometry& track = store.geometry();
            const float position = table_position(track, length) + kTableReach * track.samples_per_metre;
            CHECK_EQUAL(table_at(track.width_table, position), 1.0f);
        }
    }
}

TEST(a_store_may_be_moved) {
    std::vector<TrackStore> stores;
    for (int i = 0; i < 5; ++i) stores.push_back(test::store_of(test::circuit(100 + static_cast<size_t>(i))));
    for (const TrackStore& store : stores) {
        const TrackGeometry& track = store.geometry();
        const Projection projection = project(track, track.segments[3].x, track.segments[3].y);
        CHECK_EQUAL(projection.segment, 3);
    }
}

}  // namespace racecraft
