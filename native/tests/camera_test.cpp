// The driver's camera against its reference, across instruction sets, and at poses that no car should reach.
#include <algorithm>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "../src/camera_model.hpp"
#include "../src/dispatch.hpp"
#include "check.hpp"
#include "racecraft/camera_walk.hpp"
#include "racecraft/random.hpp"
#include "ray_cast.hpp"
#include "tracks.hpp"

namespace racecraft {
namespace {

using test::Outline;

const GreyPalette kGrey = grey_palette(kPalette2018);

// Without grain, for references that know of none.
const GreyPalette kFlat = [] {
    GreyPalette palette = kGrey;
    for (uint8_t& contrast : palette.grain) contrast = 0;
    return palette;
}();

// A circuit of literal numbers only, so that a hash over its frames depends on nothing but the renderer.
Outline octagon() {
    constexpr double corners[9][2] = {{3, 0},     {2, 1.5}, {0, 2},    {-2, 1.5}, {-3, 0},
                                      {-2, -1.5}, {0, -2},  {2, -1.5}, {3, 0}};
    Outline road{{}, {}, {}, true};
    for (const auto& p : corners) {
        road.center.insert(road.center.end(), {p[0], p[1]});
        road.inner.insert(road.inner.end(), {0.8125 * p[0], 0.8125 * p[1]});
        road.outer.insert(road.outer.end(), {1.1875 * p[0], 1.1875 * p[1]});
    }
    return road;
}

std::vector<uint8_t> frame(const CameraModel& camera, const GroundMap& ground, float x, float y,
                           float heading, const GreyPalette& palette = kGrey) {
    std::vector<uint8_t> pixels(size_t(camera.spec().width) * camera.spec().height);
    render_grey(camera, ground, palette, {}, x, y, heading, pixels.data());
    return pixels;
}

struct Pose {
    float x, y, heading;
};
constexpr Pose kPoses[] = {{2.5f, 0.8f, 2.0f},  {0.0f, 2.0f, 3.3f},   {-3.0f, 0.0f, -1.5f},
                           {1.0f, -1.7f, 0.3f}, {2.9f, -0.3f, 1.2f},  {0.5f, 0.5f, 0.0f},
                           {-3.9f, 2.0f, 2.5f}, {2.0f, 1.5f, 100.0f}, {1.5f, 1.6f, -2.75f},
                           {-2.0f, -1.4f, 0.0f}};

uint64_t hash_of_frames() {
    const Outline road = octagon();
    const GroundMap ground(road.view());
    const CameraModel camera(CameraSpec{});
    CameraSpec odd;
    odd.width = 83;
    odd.height = 61;
    const CameraModel small(odd);
    uint64_t hash = 14695981039346656037u;  // FNV-1a
    for (const Pose& p : kPoses) {
        for (const CameraModel* model : {&camera, &small}) {
            for (const uint8_t byte : frame(*model, ground, p.x, p.y, p.heading))
                hash = (hash ^ byte) * 1099511628211u;
        }
    }
    return hash;
}

double mean_difference(const std::vector<uint8_t>& a, const std::vector<double>& b) {
    double sum = 0.0;
    for (size_t i = 0; i < a.size(); ++i) sum += std::abs(a[i] - b[i]);
    return sum / static_cast<double>(a.size());
}

// Equal for every compiler, optimisation level and CPU. A change here changes what every policy sees.
constexpr uint64_t kGoldenHash = 17480195572072265205u;

TEST(golden_hash_for_every_instruction_set) {
    for (const Isa isa : available_isas()) {
        set_isa(isa_name(isa));
        CHECK_EQUAL(hash_of_frames(), kGoldenHash);
    }
}

TEST(frames_agree_with_ray_casting) {
    const CameraModel camera(CameraSpec{});
    for (const Outline& road : {octagon(), test::circuit(), test::open_bend()}) {
        const GroundMap ground(road.view());
        const test::RayCaster reference(road.view(), kFlat);
        for (size_t k = 1; k < road.num_waypoints() - 1; k += road.num_waypoints() / 2) {
            const double x = road.center[2 * k] + 0.07;
            const double y = road.center[2 * k + 1] - 0.05;
            const double heading = std::atan2(road.center[2 * k + 3] - y, road.center[2 * k + 2] - x) + 0.2;
            const auto pixels = frame(camera, ground, static_cast<float>(x), static_cast<float>(y),
                                      static_cast<float>(heading), kFlat);
            CHECK_NEAR(mean_difference(pixels, reference.frame(camera.spec(), x, y, heading, 3)), 0.0, 1.0);
        }
    }
}

// A finer map only sharpens the corners of the dashes.
TEST(texel_size_hardly_matters) {
    const Outline road = octagon();
    const CameraModel camera(CameraSpec{});
    const GroundMap coarse(road.view());
    const GroundMap fine(road.view(), {.texel = 0.005f});
    for (const Pose& p : kPoses) {
        const auto a = frame(camera, coarse, p.x, p.y, p.heading, kFlat);
        const auto b = frame(camera, fine, p.x, p.y, p.heading, kFlat);
        CHECK_NEAR(mean_difference(a, {b.begin(), b.end()}), 0.0, 0.6);
    }
}

TEST(mirrored_track_gives_mirrored_frames) {
    const Outline road = octagon();
    Outline mirrored = road;
    for (auto* line : {&mirrored.center, &mirrored.inner, &mirrored.outer}) {
        for (size_t i = 1; i < line->size(); i += 2) (*line)[i] = -(*line)[i];
    }
    const GroundMap ground(road.view());
    const GroundMap mirror(mirrored.view());
    const CameraModel camera(CameraSpec{});
    // Opposite walls differ in shade, so the walls to the left and right get one.
    GreyPalette palette = kFlat;
    palette.wall[3] = palette.wall[1];
    const int width = camera.spec().width;
    std::vector<uint8_t> a(size_t(width) * camera.spec().height), b = a;
    for (const Pose& p : kPoses) {
        render_grey(camera, ground, palette, {}, p.x, p.y, p.heading, a.data());
        render_grey(camera, mirror, palette, {}, p.x, -p.y, -p.heading, b.data());
        double sum = 0.0;
        for (int i = 0; i < width * camera.spec().height; ++i) {
            sum += std::abs(a[i] - b[i / width * width + width - 1 - i % width]);
        }
        CHECK_NEAR(sum / static_cast<double>(a.size()), 0.0, 0.5);
    }
}

// What is far away must not flicker: a step of 1 mm to the side changes no far pixel by much more than its
// share.
TEST(small_steps_change_little) {
    const Outline road = test::circuit();
    const GroundMap ground(road.view());
    const CameraModel camera(CameraSpec{});
    const float x = static_cast<float>(road.center[20]);
    const float y = static_cast<float>(road.center[21]);
    auto before = frame(camera, ground, x, y, 1.9f);
    for (int step = 1; step <= 10; ++step) {
        const auto after = frame(camera, ground, x, y + 0.001f * static_cast<float>(step), 1.9f);
        CHECK_NEAR(mean_difference(after, {before.begin(), before.end()}), 0.0, 0.7);
        before = after;
    }
}

// Contrast close to the lens, none far away, and the same mean brightness as without.
TEST(grain_fades_with_distance) {
    const Outline road = test::circuit();
    const GroundMap ground(road.view());
    const CameraModel camera(CameraSpec{});
    const float x = static_cast<float>(road.center[20]);
    const float y = static_cast<float>(road.center[21]);
    const auto grained = frame(camera, ground, x, y, 1.9f);
    const auto flat = frame(camera, ground, x, y, 1.9f, kFlat);
    double contrast[120], sum = 0.0;
    for (int row = 0; row < 120; ++row) {
        double squares = 0.0;
        for (int i = 160 * row; i < 160 * (row + 1); ++i) {
            const double apart = double(grained[i]) - flat[i];
            squares += apart * apart;
            sum += apart;
        }
        contrast[row] = std::sqrt(squares / 160.0);
    }
    CHECK_NEAR(sum / (160 * 120), 0.0, 0.1);
    for (int row = 110; row < 120; ++row) CHECK(contrast[row] > 2.0 && contrast[row] < 5.0);
    for (int row = 0; row < 35; ++row) CHECK_NEAR(contrast[row], 0.0, 0.3);
}

// The lens is ahead of the car and to its left, whichever way the car points.
TEST(the_lens_is_where_the_car_carries_it) {
    const GroundMap ground(octagon().view());
    CameraSpec spec;
    spec.forward = 0.15f;
    spec.left = 0.03f;
    spec.yaw = 0.2f;
    const CameraModel camera(spec);
    const double headings[] = {0.0, 0.5 * std::numbers::pi, std::numbers::pi, -0.5 * std::numbers::pi, 0.7};
    for (const double heading : headings) {
        const LensPose lens =
            place_lens(camera.view(), ground.view(), 0.4f, -0.3f, static_cast<float>(heading));
        CHECK_NEAR(lens.x, 0.4 + 0.15 * std::cos(heading) - 0.03 * std::sin(heading), 1e-6);
        CHECK_NEAR(lens.y, -0.3 + 0.15 * std::sin(heading) + 0.03 * std::cos(heading), 1e-6);
        CHECK_NEAR(lens.cosine, std::cos(heading + 0.2), 1e-6);
        CHECK_NEAR(lens.sine, std::sin(heading + 0.2), 1e-6);
    }
}

TEST(where_walls_meet_a_pixel_shows_of_each_what_it_covers) {
    WallSpan walls[2]{};
    walls[0].wall = 2;
    walls[1].wall = 1;
    const int32_t shades[4] = {0, 6400, 640, 0};
    for (const float edge : {80.0f, 80.25f, 100.75f, 159.5f}) {
        walls[0].right = (edge - 80.0f) / 40.0f;
        const WallEdge found = wall_edge(walls, 0, 40.0f, 160, shades);
        CHECK_EQUAL(found.pixel, static_cast<int32_t>(edge));
        const float left_part = edge - std::floor(edge);
        CHECK_NEAR(found.mixture, left_part * 640.0f + (1.0f - left_part) * 6400.0f, 1.0);
    }
}

TEST(the_lens_stays_inside_the_room_wherever_the_car_is) {
    const GroundMap ground(octagon().view());
    const GroundView& room = ground.view();
    const CameraModel camera(CameraSpec{});
    const float far[] = {-100.0f, -2e6f, 100.0f, 2e6f, NAN, INFINITY};
    for (const float x : far) {
        for (const float y : far) {
            for (const float heading : {0.0f, 2.0f, 1e9f, NAN}) {
                const LensPose lens = place_lens(camera.view(), room, x, y, heading);
                CHECK(lens.x > room.min_x && lens.x < room.max_x);
                CHECK(lens.y > room.min_y && lens.y < room.max_y);
                CHECK_NEAR(lens.cosine * lens.cosine + lens.sine * lens.sine, 1.0, 1e-5);
            }
        }
    }
}

TEST(a_walk_is_cut_at_the_walls_to_the_pixel) {
    GroundView room{};
    room.min_x = -2.0f;
    room.max_x = 3.0f;
    room.min_y = -1.0f;
    room.max_y = 1.5f;
    constexpr int32_t width = 50;
    const auto is_inside = [&](float x, float y) {
        return x >= room.min_x && x <= room.max_x && y >= room.min_y && y <= room.max_y;
    };
    int cut = 0, whole = 0, none = 0;
    for (uint32_t trial = 0; trial < 4000; ++trial) {
        const RandomBlock random = philox(1, trial, 0, 0, Purpose::start_pose);
        const float x = 4.0f * symmetric_of(random.words[0]);
        const float y = 2.5f * symmetric_of(random.words[1]);
        const float step_x = 0.12f * symmetric_of(random.words[2]);
        const float step_y = 0.12f * symmetric_of(random.words[3]);
        const PixelSpan span = clip_walk(room, x, y, step_x, step_y, width);
        CHECK(span.begin >= 0 && span.begin <= span.end && span.end <= width);
        for (int32_t i = 0; i < width; ++i) {
            const float at = static_cast<float>(i);
            const bool inside = is_inside(x + at * step_x, y + at * step_y);
            // A pixel that lies on a wall to the last bits may go either way.
            const bool almost = is_inside(x + (at - 1e-4f) * step_x, y + (at - 1e-4f) * step_y) !=
                                is_inside(x + (at + 1e-4f) * step_x, y + (at + 1e-4f) * step_y);
            if (!almost) CHECK_EQUAL(i >= span.begin && i < span.end, inside);
        }
        const int32_t pixels = span.end - span.begin;
        (pixels == 0 ? none : pixels == width ? whole : cut) += 1;
    }
    CHECK(cut > 500 && whole > 100 && none > 500);
}

// The corners of a room lie where a pinhole sees them: upright edges, in every row of the picture.
TEST(walls_meet_where_a_pinhole_sees_their_corner) {
    const GroundMap ground(octagon().view());
    CameraSpec spec;
    spec.pitch = 0.3f;
    const CameraModel camera(spec);
    const CameraView& view = camera.view();
    const double focal = 0.5 * spec.width / std::tan(0.5 * spec.hfov);
    for (int32_t row = 0; row < spec.height; ++row) {
        const double b = (row + 0.5 - 0.5 * spec.height) / focal;
        const double ahead = std::cos(0.3) - b * std::sin(0.3);
        CHECK_NEAR(view.corner_scale[row], focal * ahead, 1e-3);
    }
    CHECK_EQUAL(view.row_begin[0], 0);
    CHECK_EQUAL(view.row_begin[spec.height], view.num_samples);
    for (int32_t row = 0; row < spec.height; ++row) {
        const int32_t count = view.row_begin[row + 1] - view.row_begin[row];
        CHECK(count == 1 || count == 2 || count == 4 || count == 8);
        std::vector<double> shifts;  // of the samples, pixels to the right of a pixel's middle
        for (int32_t k = 0; k < count; ++k) {
            const int32_t sample = view.row_begin[row] + k;
            if (view.kind[sample] != kSampleGround) continue;
            const double b = (row + (k + 0.5) / count - 0.5 * spec.height) / focal;
            const double fall = std::sin(0.3) + b * std::cos(0.3);
            const double reach = spec.above / fall;
            CHECK_NEAR(view.distance[sample], reach * (std::cos(0.3) - b * std::sin(0.3)), 1e-3 * reach);
            CHECK_NEAR(view.step[sample], reach / focal, 1e-5 * reach);
            shifts.push_back(view.start[sample] / view.step[sample] + 0.5 * spec.width - 0.5);
            // Of the pyramid, what is nearest to what the sample blurs: within a factor of the root of two.
            const double texels = 256.0 / view.sharpness[sample] / (0.01 * std::exp2(view.exponent[sample]));
            if (view.exponent[sample] > -8 && view.exponent[sample] < 8)
                CHECK(texels > 0.70710 && texels < 1.41422);
        }
        // Pixel 0 is half of the picture to the left, its samples spread evenly over it.
        std::sort(shifts.begin(), shifts.end());
        for (size_t k = 0; k < shifts.size() && shifts.size() == static_cast<size_t>(count); ++k)
            CHECK_NEAR(shifts[k], (static_cast<double>(k) + 0.5) / count - 0.5, 1e-4);
    }
}

TEST(a_sample_reads_the_level_of_its_size_whatever_the_maps_texel) {
    const CameraModel camera(CameraSpec{});
    const CameraView& view = camera.view();
    for (const float texel : {0.005f, 0.01f, 0.04f}) {
        const GroundMap map(octagon().view(), {.texel = texel});
        const GroundView& ground = map.view();
        const int32_t exponent = static_cast<int32_t>(std::lround(std::log2(ground.texel / 0.01f)));
        for (int32_t sample = 0; sample < view.num_samples; ++sample) {
            const int32_t level = clamp(view.exponent[sample] - exponent, 0, ground.num_levels - 1);
            CHECK_EQUAL(sample_level(view, ground, sample), level);
        }
    }
}

TEST(walls_are_told_from_left_to_right_with_the_corners_between_them) {
    const GroundMap ground(octagon().view());
    const GroundView& view = ground.view();
    const struct {
        float heading;
        int32_t wall;
    } ahead[] = {{0.0f, 0}, {0.5f * kPi, 1}, {kPi, 2}, {-0.5f * kPi, 3}};
    for (const auto& [heading, wall] : ahead) {
        LensPose lens{.x = 0.3f, .y = -0.2f, .sine = 0.0f, .cosine = 1.0f};
        sincos_of(heading, lens.sine, lens.cosine);
        WallSpan spans[kNumWalls];
        const int32_t count = walls_in_view(view, lens, spans);
        CHECK_EQUAL(count, 3);
        CHECK_EQUAL(spans[1].wall, wall);
        CHECK_EQUAL(spans[0].wall, (wall + 1) % 4);  // to the left
        CHECK_EQUAL(spans[2].wall, (wall + 3) % 4);
        for (int32_t i = 0; i + 1 < count; ++i) CHECK_NEAR(spans[i].right, spans[i + 1].left, 1e-5);
        const bool is_along_x = wall % 2 == 0;
        const double to_wall = wall == 0   ? view.max_x - lens.x
                               : wall == 1 ? view.max_y - lens.y
                               : wall == 2 ? lens.x - view.min_x
                                           : lens.y - view.min_y;
        const double left_end = is_along_x ? (wall == 0 ? view.max_y - lens.y : lens.y - view.min_y)
                                           : (wall == 1 ? lens.x - view.min_x : view.max_x - lens.x);
        CHECK_NEAR(spans[1].left, -left_end / to_wall, 1e-4);
    }
}

TEST(palette_reaches_every_part_of_a_frame) {
    const Outline road = octagon();
    const GroundMap ground(road.view());
    CameraSpec level;
    level.pitch = 0.0f;
    GreyPalette palette{};
    for (uint8_t* shades : {palette.ground, palette.wall}) {
        for (int i = 0; i < 4; ++i) shades[i] = 255;
    }
    palette.sky = 255;
    palette.outside = 255;
    std::vector<uint8_t> pixels(size_t(level.width) * level.height);
    CameraSpec above = level;  // sees over the walls
    above.above = 6.0f;
    above.pitch = 0.8f;
    for (const CameraModel& model : {CameraModel(level), CameraModel(above)}) {
        for (const Pose& p : kPoses) {
            render_grey(model, ground, palette, {}, p.x, p.y, p.heading, pixels.data());
            for (const uint8_t pixel : pixels) CHECK_EQUAL(int(pixel), 255);
        }
    }
}

// Against its formula: as the square of the cosine to the light, more or less of it the steeper a row looks
// down.
TEST(ground_shines_towards_a_light_and_nowhere_else) {
    const Outline road = octagon();
    const GroundMap ground(road.view());
    const Sheen sheen{0.6f, 0.8f, {-10, -10, -10, -10}, {30, 30, 30, 30}};
    GreyPalette palette{};
    for (uint8_t& shade : palette.ground) shade = 100;
    for (const float heading : {0.2f, 0.9272952f, 1.8f, 2.6f, -0.9f, -2.2f}) {
        for (const float pitch : {0.2385f, 1.2f}) {
            CameraSpec spec;
            spec.pitch = pitch;
            const CameraModel camera(spec);
            std::vector<uint8_t> pixels(size_t(spec.width) * spec.height);
            render_grey(camera, ground, palette, sheen, 0.0f, 0.0f, heading, pixels.data());
            const double facing = std::max(0.6 * std::cos(heading) + 0.8 * std::sin(heading), 0.0);
            const double focal = 80.0 / std::tan(0.5 * spec.hfov);
            for (int row = 60; row < spec.height; ++row) {
                const double down = std::sin(pitch) + (row - row % 4 + 2 - 60) / focal * std::cos(pitch);
                const double lit = facing * facing * (-10.0 + 2.0 * down * 40.0);
                const double expected = 100.0 + (pitch < 1.0f ? lit : 0.0);
                CHECK_NEAR(double(pixels[size_t(row) * 160 + 80]), expected, 1.01);
            }
        }
    }
}

// The sanitizers watch this one.
TEST(any_pose_is_safe) {
    const Outline road = octagon();
    constexpr float infinity = std::numeric_limits<float>::infinity();
    constexpr float nan = std::numeric_limits<float>::quiet_NaN();
    for (const float texel : {0.0025f, 0.01f, 0.08f}) {
        const GroundMap ground(road.view(), {.texel = texel});
        for (const float pitch : {-0.5f, 0.0f, 0.2618f, 1.2f, 1.5707f}) {
            for (const float above : {0.01f, 0.127f, 1.0f, 5.0f}) {
                CameraSpec spec;
                spec.width = 67;
                spec.height = 41;
                spec.pitch = pitch;
                spec.above = above;
                const CameraModel camera(spec);
                for (const float x : {-100.0f, -4.5f, 0.0f, 3.0f, 4.47f, 1e30f, infinity, nan}) {
                    for (const float heading : {0.0f, 0.785398f, 1.5707963f, 3.14159f, -2.0f, 1e20f, nan}) {
                        frame(camera, ground, x, 0.3f * x, heading);
                    }
                }
            }
        }
    }
}

TEST(impossible_cameras_are_refused) {
    const auto with = [](auto change) {
        CameraSpec spec;
        change(spec);
        return spec;
    };
    CHECK_THROWS(CameraModel(with([](CameraSpec& s) { s.width = 0; })), std::invalid_argument);
    CHECK_THROWS(CameraModel(with([](CameraSpec& s) { s.height = 5000; })), std::invalid_argument);
    CHECK_THROWS(CameraModel(with([](CameraSpec& s) { s.hfov = 3.2f; })), std::invalid_argument);
    CHECK_THROWS(CameraModel(with([](CameraSpec& s) { s.pitch = std::nanf(""); })), std::invalid_argument);
    CHECK_THROWS(CameraModel(with([](CameraSpec& s) { s.above = 0.0f; })), std::invalid_argument);
    CHECK_THROWS(CameraModel(with([](CameraSpec& s) { s.forward = std::nanf(""); })), std::invalid_argument);
    CHECK_THROWS(CameraModel(with([](CameraSpec& s) { s.min_samples = 3; })), std::invalid_argument);
}

}  // namespace
}  // namespace racecraft
