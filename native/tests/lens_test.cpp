// What a real lens in a real hall makes of a picture: against a plain formula, on every instruction set.
#include <algorithm>
#include <utility>

#include "../src/dispatch.hpp"
#include "../src/lens_kernel.hpp"
#include "check.hpp"
#include "racecraft/folds.hpp"
#include "racecraft/surroundings.hpp"

namespace racecraft {
namespace {

CameraSpec sized(int32_t width, int32_t height) {
    CameraSpec spec;
    spec.width = width;
    spec.height = height;
    return spec;
}

size_t count(const CameraSpec& spec) {
    return static_cast<size_t>(spec.width) * static_cast<size_t>(spec.height);
}

// A picture without any order.
std::vector<uint8_t> noise_picture(const CameraSpec& spec) {
    std::vector<uint8_t> pixels(count(spec));
    for (size_t i = 0; i < pixels.size(); ++i) {
        pixels[i] = static_cast<uint8_t>(philox(1, uint32_t(i), 0, 0, Purpose::picture).words[0]);
    }
    return pixels;
}

Shot still() {
    Shot shot{};
    shot.focal = 126.0f;
    shot.lamp = 1.3f;
    shot.lamp_row = 0.3f;
    shot.lamp_width = 0.2f;
    shot.fold_spacing = 1.0f;
    return shot;
}

std::vector<uint8_t> taken(const CameraSpec& spec, const Conditions& conditions, const Shot& shot,
                           const std::vector<uint8_t>& drawn) {
    std::vector<uint8_t> frame(drawn.size()), wide(drawn.size() + 2 * kDrawnMargin, 201);
    std::copy(drawn.begin(), drawn.end(), wide.begin() + kDrawnMargin);
    RC_DISPATCH(take_picture, spec, conditions, shot, wide.data() + kDrawnMargin, frame.data());
    return frame;
}

// Rounded mean of two bytes, halves up.
int mean(int a, int b) {
    return (a + b + 1) / 2;
}

}  // namespace

TEST(a_perfect_lens_shows_what_is_drawn) {
    const CameraSpec spec = sized(160, 120);
    const std::vector<uint8_t> drawn = noise_picture(spec);
    CHECK(taken(spec, Conditions{}, still(), drawn) == drawn);
}

TEST(every_instruction_set_takes_the_picture_of_the_plain_formula) {
    const Isa best = current_isa();
    const NoiseTable table = make_noise();
    for (const auto& [width, height] : {std::pair{160, 120}, {64, 48}, {33, 7}, {3, 2}, {2, 3}, {1, 1}}) {
        const CameraSpec spec = sized(width, height);
        const std::vector<uint8_t> drawn = noise_picture(spec);
        const auto at = [&](int x, int y) {
            return int(drawn[size_t(std::clamp(y, 0, height - 1) * width + std::clamp(x, 0, width - 1))]);
        };
        for (int i = 0; i < 12; ++i) {
            Conditions conditions{};
            conditions.vignette = 0.1f * float(i % 4);
            conditions.vignette_across = 0.5f;
            conditions.vignette_down = -0.25f;
            conditions.sheen = 0.2f * float(i % 3);
            conditions.noise = 0.02f * float(i % 2);
            Shot shot = still();
            shot.smear = i % 3;
            shot.is_soft = i % 2 == 1;
            shot.rows = i - 6;
            shot.lamp = 0.1f * float(i - 6);
            shot.noise = uint32_t(i) * 77777u;
            std::vector<uint8_t> expected(drawn.size());
            for (int y = 0; y < height; ++y) {
                const int lit = y / kGlareRows * kGlareRows;
                const int from = std::clamp(y - shot.rows, 0, height - 1);
                for (int x = 0; x < width; ++x) {
                    const auto soft = [&](int column) {
                        const int here = at(column, from);
                        return shot.is_soft ? mean(here, at(column, from + 1)) : here;
                    };
                    int level = soft(x);
                    if (shot.smear == 1 && width > 3) level = mean(level, soft(x + 1));
                    if (shot.smear == 2 && width > 3) {
                        level = mean(mean(soft(x - 1), level), mean(soft(x + 1), soft(x + 2)));
                    }
                    const int shade = vignette_at(x, width, conditions.vignette, 0.5f) +
                                      vignette_at(y, height, conditions.vignette, -0.25f);
                    level -= level * std::min(shade, 255) / 256;
                    if (conditions.sheen > 0.0f) {
                        const Glare glare = glare_of(shot, spec);
                        level += glare_across(glare, x) * glare_down(glare, conditions.sheen, lit) / 256;
                    }
                    const size_t place =
                        size_t(noise_tile(shot.noise, width) + noise_begin(shot.noise, y) + x);
                    const int share = noise_share(conditions.noise);
                    level = std::min(std::min(level, 255) + table.more[place] * share / 256, 255);
                    level -= table.less[place] * share / 256;
                    expected[size_t(y * width + x)] = uint8_t(std::max(level, 0));
                }
                if (width > 3 && shot.smear > 0) {  // the ends repeat their neighbours
                    uint8_t* row = &expected[size_t(y * width)];
                    if (shot.smear == 2) row[0] = row[1];
                    if (shot.smear == 2) row[width - 2] = row[width - 3];
                    row[width - 1] = row[width - 2];
                }
            }
            for (const Isa isa : available_isas()) {
                set_isa(isa_name(isa));
                CHECK(taken(spec, conditions, shot, drawn) == expected);
            }
        }
    }
    set_isa(isa_name(best));
}

TEST(noise_is_as_strong_as_asked_and_new_in_every_row_and_picture) {
    const CameraSpec spec = sized(160, 120);
    const std::vector<uint8_t> grey(count(spec), 128);
    Conditions conditions{};
    conditions.noise = 0.02f;
    Shot shot = still();
    std::vector<uint8_t> before;
    for (uint32_t key = 0; key < 5; ++key) {
        shot.noise = key;
        const std::vector<uint8_t> frame = taken(spec, conditions, shot, grey);
        double mean = 0.0, square = 0.0, between = 0.0, below = 0.0;
        for (size_t i = 0; i < frame.size(); ++i) {
            const double off = frame[i] - 128.0;
            mean += off / double(frame.size());
            square += off * off / double(frame.size());
            if (key > 0) between += off * (before[i] - 128.0) / double(frame.size());
            if (i >= 160) below += off * (frame[i - 160] - 128.0) / double(frame.size());
        }
        CHECK_NEAR(mean, 0.0, 0.6);
        CHECK_NEAR(std::sqrt(square), 5.1, 0.5);
        CHECK_NEAR(between, 0.0, 2.0);  // of 26
        CHECK_NEAR(below, 0.0, 5.0);
        before = frame;
    }
}

TEST(light_is_lost_away_from_the_lens_s_middle) {
    const CameraSpec spec = sized(200, 100);
    const std::vector<uint8_t> white(count(spec), 200);
    Conditions conditions{};
    conditions.vignette = 0.4f;
    conditions.vignette_across = 0.5f;
    const std::vector<uint8_t> frame = taken(spec, conditions, still(), white);
    const auto at = [&](int x, int y) { return double(frame[size_t(y * 200 + x)]); };
    CHECK_NEAR(at(150, 50), 200.0, 2.0);
    CHECK_NEAR(at(50, 50), 200.0 * 0.6, 3.0);
    CHECK_NEAR(at(150, 99), 200.0 * 0.6, 6.0);  // whose light is that of a row up to three above
    CHECK_NEAR(at(199, 50), 200.0 * 0.9, 3.0);
}

TEST(a_lamp_shines_from_the_floor_below_it) {
    const CameraSpec spec{};
    const float focal = focal_of(spec);
    const std::vector<uint8_t> black(count(spec), 0);
    Conditions conditions{};
    conditions.sheen = 0.5f;
    for (const float lamp : {-0.4f, 0.0f, 0.3f}) {
        Shot shot = still();
        shot.lamp = lamp;
        shot.lamp_row = 0.25f;
        const std::vector<uint8_t> frame = taken(spec, conditions, shot, black);
        const size_t brightest = size_t(std::max_element(frame.begin(), frame.end()) - frame.begin());
        CHECK_NEAR(frame[brightest], 127.0, 6.0);
        CHECK_NEAR(double(brightest % 160), 79.5 - double(focal) * std::tan(lamp), 8.0);
        CHECK_NEAR(double(brightest / 160), 59.5 + double(focal) * (0.25 - std::tan(0.2385)), 6.0);
        const int horizon = int(60.0 - double(focal) * std::tan(0.2385));
        CHECK(std::all_of(frame.begin(), frame.begin() + 160 * (horizon - 1),
                          [](uint8_t p) { return p == 0; }));
    }
}

TEST(a_fold_lies_where_its_line_on_the_ground_is_seen) {
    // Every point of a line on the ground, through the lens by hand, is lit or shaded in the picture.
    const CameraSpec spec{};
    const double focal = double(focal_of(spec)), sine = std::sin(0.2385), cosine = std::cos(0.2385);
    const LensPose lens{1.0f, 2.0f, std::sin(0.7f), std::cos(0.7f)};
    for (const float heading : {0.1f, 0.7f, 1.5f, 2.2f, 4.0f}) {
        Shot shot = still();
        shot.fold_heading = heading;
        shot.fold_spacing = 0.8f;
        std::vector<uint8_t> picture(count(spec), 100);
        draw_folds(spec, lens, shot, 0.1f, picture.data());
        const double nx = std::cos(heading), ny = std::sin(heading);
        const double here = nx * 1.0 + ny * 2.0;
        const double reach = nx * std::cos(0.7) + ny * std::sin(0.7);
        const double line = 0.8 * std::round((here + 0.8 * reach) / 0.8) - here;
        int seen = 0, found = 0;
        for (double along = -3.0; along < 3.0; along += 0.01) {
            const double dx = nx * line - ny * along, dy = ny * line + nx * along;
            const double ahead = dx * std::cos(0.7) + dy * std::sin(0.7);
            const double right = dx * std::sin(0.7) - dy * std::cos(0.7);
            const double depth = ahead * cosine + double(spec.above) * sine;
            if (depth < 0.05) continue;
            const int x = int(80.0 + focal * right / depth);
            const int y = int(60.0 + focal * (double(spec.above) * cosine - ahead * sine) / depth);
            if (x < 2 || x > 157 || y < 35 || y > 117) continue;
            ++seen;
            bool is_near = false;
            for (int k = 0; k < 25; ++k)
                is_near |= picture[size_t((y + k / 5 - 2) * 160 + x + k % 5 - 2)] != 100;
            found += is_near;
        }
        CHECK_EQUAL(found, seen);
        const auto changed = picture.size() - size_t(std::count(picture.begin(), picture.end(), 100));
        CHECK(changed < 1200);
        CHECK(std::all_of(picture.begin(), picture.begin() + 160 * 28, [](uint8_t p) { return p == 100; }));
    }
}

TEST(pictures_of_an_episode_shake_about_the_same_place) {
    Conditions conditions{};
    conditions.shake = 0.01f;
    double yaw = 0.0, yaws = 0.0, rows = 0.0, rows2 = 0.0;
    constexpr int kPictures = 4000;
    for (int step = 1; step <= kPictures; ++step) {
        const Shot shot = take_shot(conditions, CameraSpec{}, {5, 1, 2}, step, 0, 0.5f, 3.0f);
        const Shot right = take_shot(conditions, CameraSpec{}, {5, 1, 2}, step, 1, 0.5f, 3.0f);
        CHECK(shot.yaw == right.yaw && shot.rows == right.rows && shot.noise != right.noise);
        CHECK_EQUAL(shot.smear, 0);
        yaw += double(shot.yaw) / kPictures;
        yaws += double(shot.yaw) * double(shot.yaw) / kPictures;
        rows += double(shot.rows) / kPictures;
        rows2 += double(shot.rows) * double(shot.rows) / kPictures;
    }
    CHECK_NEAR(yaw, 0.0, 0.0006);
    CHECK_NEAR(std::sqrt(yaws), 0.01, 0.0005);
    CHECK_NEAR(rows, 0.0, 0.08);
    CHECK_NEAR(std::sqrt(rows2), 1.26, 0.08);
}

TEST(what_turns_faster_than_the_shutter_is_smeared) {
    Conditions conditions{};
    const auto smear = [&](float shutter, float defocus, float rate) {
        conditions.shutter = shutter;
        conditions.defocus = defocus;
        return take_shot(conditions, CameraSpec{}, {5, 1, 2}, 3, 0, 0.5f, rate).smear;
    };
    CHECK_EQUAL(smear(0.01f, 0.0f, 0.5f), 0);   // 0.6 pixels
    CHECK_EQUAL(smear(0.01f, 0.0f, -1.0f), 1);  // 1.3
    CHECK_EQUAL(smear(0.01f, 0.0f, 3.0f), 2);   // 3.8
    CHECK_EQUAL(smear(0.0f, 1.2f, 0.0f), 1);
}

TEST(a_lamp_and_the_hall_keep_their_direction_while_the_car_turns) {
    const Conditions conditions{};
    for (const float heading : {0.0f, 0.3f, 1.0f, 2.5f}) {
        const Shot shot = take_shot(conditions, CameraSpec{}, {5, 1, 2}, 3, 0, heading, 0.0f);
        const Shot zero = take_shot(conditions, CameraSpec{}, {5, 1, 2}, 9, 0, 0.0f, 0.0f);
        const float turned = (shot.lamp + heading - zero.lamp) / (0.5f * kPi);
        CHECK_NEAR(turned, std::round(turned), 1e-4);
        CHECK(std::abs(shot.lamp) <= 0.25f * kPi + 1e-4f);
    }
    GreyPalette palette{};
    palette.crowd = 255;
    palette.hall = 7;
    const CameraSpec spec{};
    const auto column = [&](float heading, int x) {
        LensPose lens{};
        sincos_of(heading, lens.sine, lens.cosine);
        return above_walls(palette, bearing_of(spec, lens), 3, x, 128 * 64);
    };
    int same = 0, different = 0;
    const float step = 1.13f / 160.0f;
    for (int x = 20; x < 140; ++x) {
        same += column(0.4f, x) == column(0.4f - 16.0f * step, x - 16);
        different += column(0.4f, x) != column(0.4f, x - 16);
    }
    CHECK(same > 100);
    CHECK(different > 100);
}

}  // namespace racecraft
