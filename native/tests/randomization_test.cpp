// What an episode draws, and what becomes of a car, a camera and the colours under it.
#include "racecraft/randomization.hpp"

#include <utility>

#include "check.hpp"

namespace racecraft {
namespace {

constexpr uint32_t kEpisodes = 4000;
constexpr int kNumDrawn = kCondition_strength;  // the others, of which it is a share

// Conditions that change nothing, but for one.
Conditions neutral() {
    Conditions conditions{};
    conditions.friction = conditions.mass = conditions.speed_gain = conditions.light = 1.0f;
    conditions.strength = 1.0f;
    return conditions;
}

// Ranges of a single point: neutral ones.
Randomization fixed() {
    Randomization randomization{};
    const Conditions values = neutral();
    float numbers[kNumConditions];
    std::memcpy(numbers, &values, sizeof(values));
    for (int i = 0; i < kNumConditions; ++i) randomization.conditions[i] = {numbers[i], numbers[i]};
    randomization.tint = {1.0f, 1.0f};
    return randomization;
}

// Every material, wall and the rest in one colour.
RgbPalette painted(uint8_t red, uint8_t green, uint8_t blue) {
    RgbPalette colours{};
    const auto paint = [&](uint8_t* rgb) {
        rgb[0] = red;
        rgb[1] = green;
        rgb[2] = blue;
    };
    for (auto& rgb : colours.ground) paint(rgb);
    for (auto& rgb : colours.wall) paint(rgb);
    paint(colours.sky);
    paint(colours.outside);
    return colours;
}

struct Moments {
    double mean = 0.0, square = 0.0, low = 1e300, high = -1e300;

    void add(double value) {
        mean += value / kEpisodes;
        square += value * value / kEpisodes;
        low = std::fmin(low, value);
        high = std::fmax(high, value);
    }
    double deviation() const { return std::sqrt(square - mean * mean); }
};

}  // namespace

TEST(every_condition_fills_its_range_whatever_the_others_are) {
    Randomization wide{};
    for (int i = 0; i < kNumDrawn; ++i) {
        wide.conditions[i] = {static_cast<float>(i), static_cast<float>(2 * i + 1)};
    }
    wide.conditions[kCondition_strength] = {1.0f, 1.0f};
    Moments moments[kNumDrawn];
    int alike = 0;
    for (uint32_t episode = 0; episode < kEpisodes; ++episode) {
        const Conditions drawn = draw_conditions(wide, 7, 3, episode);
        float values[kNumConditions];
        std::memcpy(values, &drawn, sizeof(drawn));
        double shares[kNumDrawn];
        for (int i = 0; i < kNumDrawn; ++i) {
            shares[i] = (static_cast<double>(values[i]) - i) / (i + 1.0);
            moments[i].add(shares[i]);
            for (int k = 0; k < i; ++k) alike += std::abs(shares[i] - shares[k]) < 1e-5;
        }
    }
    CHECK(alike < 60);  // of each pair a fifty-thousandth by chance: 11 of half a million, not thousands
    for (const Moments& each : moments) {
        CHECK_NEAR(each.mean, 0.5, 0.02);
        CHECK_NEAR(each.deviation(), 1.0 / std::sqrt(12.0), 0.01);
        CHECK(each.low >= 0.0 && each.low < 0.01 && each.high > 0.99 && each.high <= 1.0);
    }
}

TEST(a_point_stays_a_point) {
    const Conditions drawn = draw_conditions(fixed(), 1, 2, 3);
    CHECK(test::same_bits(drawn, neutral()));
}

TEST(strength_is_the_share_of_the_way_from_nothing_to_what_was_drawn) {
    Randomization whole{};
    for (int i = 0; i < kNumDrawn; ++i) whole.conditions[i] = {-2.0f, 3.0f};
    Randomization half = whole, none = whole, beyond = whole;
    whole.conditions[kCondition_strength] = {1.0f, 1.0f};
    half.conditions[kCondition_strength] = {0.5f, 0.5f};
    none.conditions[kCondition_strength] = {0.0f, 0.0f};
    beyond.conditions[kCondition_strength] = {-1.0f, 3.0f};
    Conditions nothing = neutral();
    nothing.strength = 0.0f;
    int untouched = 0, full = 0;
    for (uint32_t episode = 0; episode < kEpisodes; ++episode) {
        const Conditions all = draw_conditions(whole, 7, 3, episode);
        const Conditions some = draw_conditions(half, 7, 3, episode);
        CHECK(test::same_bits(draw_conditions(none, 7, 3, episode), nothing));
        CHECK_NEAR(some.friction, 0.5f * (1.0f + all.friction), 1e-6);
        CHECK_NEAR(some.noise, 0.5f * all.noise, 1e-6);
        const Conditions any = draw_conditions(beyond, 7, 3, episode);
        CHECK(any.strength >= 0.0f && any.strength <= 1.0f);
        untouched += any.strength == 0.0f;
        full += any.strength == 1.0f;
        if (any.strength == 1.0f) CHECK(test::same_bits(any, all));
    }
    CHECK_NEAR(untouched, kEpisodes / 4.0, 100);
    CHECK_NEAR(full, kEpisodes / 2.0, 120);
}

TEST(a_range_counts_from_either_end) {
    Randomization randomization = fixed();
    CHECK(!randomization.has_latency());
    randomization.conditions[kCondition_latency] = {0.0f, 0.5f};
    CHECK(randomization.has_latency());
    for (int i = 0; i < kNumConditions; ++i) {
        const bool is_camera =
            (i >= kCondition_camera_pitch && i <= kCondition_camera_fov) || i == kCondition_wall_height;
        for (const Range range : {Range{-0.1f, 0.0f}, Range{0.0f, 0.1f}, Range{0.1f, 0.1f}}) {
            Randomization one = fixed();
            CHECK(!one.has_cameras());
            one.conditions[i] = range;
            CHECK_EQUAL(one.has_cameras(), is_camera);
            CHECK_EQUAL(one.has_lens(), i >= kCondition_crowd && i <= kCondition_noise);
        }
    }
}

TEST(a_car_is_changed_where_its_conditions_say_and_nowhere_else) {
    VehicleParameters car{};
    float values[kNumVehicleParameters];
    for (int i = 0; i < kNumVehicleParameters; ++i) values[i] = 1.0f + static_cast<float>(i);
    std::memcpy(&car, values, sizeof(car));
    const auto changed = [&](auto change) {
        Conditions conditions = neutral();
        change(conditions);
        const VehicleParameters under = vehicle_under(conditions, car);
        std::vector<double> factors(kNumVehicleParameters);
        float now[kNumVehicleParameters];
        std::memcpy(now, &under, sizeof(under));
        for (size_t i = 0; i < factors.size(); ++i) factors[i] = now[i] / values[i];
        return factors;
    };
    struct Case {
        std::vector<double> factors;
        std::vector<std::pair<int, double>> expected;
    };
    const float bias = values[kVehicle_steering_bias];
    const Case cases[] = {
        {changed([](Conditions& c) { c.friction = 0.5f; }),
         {{kVehicle_front_friction, 0.5}, {kVehicle_rear_friction, 0.5}}},
        // Heavier, and no stronger: motors and brakes move it less.
        {changed([](Conditions& c) { c.mass = 2.0f; }),
         {{kVehicle_mass, 2.0},
          {kVehicle_yaw_inertia, 2.0},
          {kVehicle_drive_acceleration, 0.5},
          {kVehicle_brake_acceleration, 0.5}}},
        {changed([](Conditions& c) { c.speed_gain = 1.5f; }), {{kVehicle_speed_gain, 1.5}}},
        {changed([](Conditions& c) { c.steering_bias = 0.5f; }),
         {{kVehicle_steering_bias, (bias + 0.5) / bias}}},
    };
    for (const Case& each : cases) {
        std::vector<double> expected(kNumVehicleParameters, 1.0);
        for (const auto& [index, factor] : each.expected) expected[static_cast<size_t>(index)] = factor;
        for (size_t i = 0; i < expected.size(); ++i) CHECK_NEAR(each.factors[i], expected[i], 1e-6);
    }
}

TEST(a_camera_is_moved_by_what_is_added) {
    const CameraSpec spec{};
    Conditions conditions = neutral();
    conditions.camera_pitch = 0.01f;
    conditions.camera_yaw = -0.02f;
    conditions.camera_height = 0.03f;
    conditions.camera_left = -0.04f;
    conditions.camera_forward = 0.05f;
    conditions.camera_fov = -0.06f;
    const CameraSpec moved = camera_under(conditions, spec);
    CHECK_NEAR(moved.pitch - spec.pitch, 0.01, 1e-6);
    CHECK_NEAR(moved.yaw - spec.yaw, -0.02, 1e-6);
    CHECK_NEAR(moved.above - spec.above, 0.03, 1e-6);
    CHECK_NEAR(moved.left - spec.left, -0.04, 1e-6);
    CHECK_NEAR(moved.forward - spec.forward, 0.05, 1e-6);
    CHECK_NEAR(moved.hfov - spec.hfov, -0.06, 1e-6);
    CHECK_EQUAL(moved.width, spec.width);
    CHECK_EQUAL(moved.height, spec.height);
}

TEST(without_a_draw_colours_are_what_they_are) {
    const GreyPalette drawn = palette_under(neutral(), fixed(), kPalette2018, 1, 2, 3);
    CHECK(test::same_bits(drawn, grey_palette(kPalette2018)));
}

TEST(red_green_and_blue_light_are_drawn_apart) {
    // A world of one colour is as bright as that colour's light alone.
    Randomization randomization = fixed();
    randomization.tint = {0.5f, 1.5f};
    Conditions weak = neutral();
    weak.strength = 0.0f;
    CHECK(test::same_bits(palette_under(weak, randomization, kPalette2018, 5, 0, 1),
                          palette_under(neutral(), fixed(), kPalette2018, 5, 0, 1)));
    constexpr double weights[3] = {0.2989, 0.587, 0.114};
    Moments light[3];
    double products[3] = {};
    for (uint32_t episode = 0; episode < kEpisodes; ++episode) {
        double tint[3];
        for (int c = 0; c < 3; ++c) {
            const RgbPalette colours = painted(c == 0 ? 255 : 0, c == 1 ? 255 : 0, c == 2 ? 255 : 0);
            const GreyPalette grey = palette_under(neutral(), randomization, colours, 5, 0, episode);
            tint[c] = grey.sky / (255.0 * weights[c]) - 1.0;
            light[c].add(tint[c]);
            CHECK_EQUAL(int(grey.ground[0]), int(grey.outside));
        }
        for (int c = 0; c < 3; ++c) products[c] += tint[c] * tint[(c + 1) % 3] / kEpisodes;
    }
    for (int c = 0; c < 3; ++c) {
        CHECK_NEAR(light[c].mean, 0.0, 0.02);
        CHECK_NEAR(light[c].deviation(), 1.0 / std::sqrt(12.0), 0.02);
        CHECK_NEAR(products[c], 0.0, 6.0 / 12.0 / std::sqrt(double{kEpisodes}));
    }
}

TEST(every_colour_is_shifted_by_its_own_draw) {
    Randomization randomization = fixed();
    randomization.colour = {-0.2f, 0.2f};
    Conditions weak = neutral();
    weak.strength = 0.0f;
    CHECK(test::same_bits(palette_under(weak, randomization, kPalette2018, 5, 0, 1),
                          palette_under(neutral(), fixed(), kPalette2018, 5, 0, 1)));
    constexpr int kColours = kNumMaterials + kNumWalls + 2;
    Moments shift[kColours];
    double products[kColours] = {};
    for (uint32_t episode = 0; episode < kEpisodes; ++episode) {
        const GreyPalette grey =
            palette_under(neutral(), randomization, painted(128, 128, 128), 5, 0, episode);
        double shifts[kColours];
        for (int i = 0; i < kColours; ++i) {
            const uint8_t level = i < kNumMaterials               ? grey.ground[i]
                                  : i < kNumMaterials + kNumWalls ? grey.wall[i - kNumMaterials]
                                  : i == kColours - 1             ? grey.outside
                                                                  : grey.sky;
            shifts[i] = (level - 128.0) / (0.4 * 255.0);
            shift[i].add(shifts[i]);
        }
        for (int i = 0; i < kColours; ++i) products[i] += shifts[i] * shifts[(i + 1) % kColours] / kEpisodes;
    }
    for (int i = 0; i < kColours; ++i) {
        CHECK_NEAR(shift[i].mean, 0.0, 0.02);
        CHECK_NEAR(shift[i].deviation(), 1.0 / std::sqrt(12.0), 0.01);
        CHECK_NEAR(products[i], 0.0, 6.0 / 12.0 / std::sqrt(double{kEpisodes}));
    }
}

TEST(light_multiplies_and_the_black_level_is_added) {
    const auto level = [](float light, float black, uint8_t white) {
        Conditions conditions = neutral();
        conditions.light = light;
        conditions.black_level = black;
        return int(palette_under(conditions, fixed(), painted(white, white, white), 1, 2, 3).sky);
    };
    CHECK_EQUAL(level(1.0f, 0.0f, 100), 100);
    CHECK_EQUAL(level(0.5f, 0.0f, 100), 50);
    CHECK_EQUAL(level(0.5f, 0.2f, 100), 101);
    CHECK_EQUAL(level(1.0f, -0.2f, 100), 49);
    CHECK_EQUAL(level(1.0f, -0.9f, 100), 0);
    CHECK_EQUAL(level(3.0f, 0.0f, 100), 255);
}

}  // namespace racecraft
