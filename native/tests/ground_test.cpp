// The ground pyramid: right material everywhere, nothing lost from level to level, bad tracks refused.
#include <limits>
#include <stdexcept>

#include "../src/ground_map.hpp"
#include "check.hpp"
#include "ray_cast.hpp"
#include "tracks.hpp"

namespace racecraft {
namespace {

using test::Outline;

uint32_t fixed(double texels) {
    return static_cast<uint32_t>(static_cast<int64_t>(texels * 65536.0));
}

Material material_at(const GroundView& view, double x, double y) {
    const GroundLevel& level = view.levels[0];
    const uint32_t u = fixed((x - view.min_x) * level.texels_per_metre + 1.0);
    const uint32_t v = fixed((y - view.min_y) * level.texels_per_metre + 1.0);
    const uint32_t texel = view.texels[texel_index(level, u, v)];
    const MaterialPair pair = kMaterialPairs[texel >> 24];
    return static_cast<Material>(edge_distance(texel, u, v) > 0 ? pair.above : pair.below);
}

TEST(material_is_that_of_the_lines) {
    for (const Outline& road : {test::circuit(), test::figure_of_eight(), test::open_bend()}) {
        const GroundMap ground(road.view());
        const test::RayCaster reference(road.view(), GreyPalette{});
        const GroundView& view = ground.view();
        int wrong = 0;
        constexpr int kSide = 101;
        for (int i = 0; i < kSide * kSide; ++i) {
            const double x = view.min_x + (view.max_x - view.min_x) * (i % kSide + 0.37) / kSide;
            const double y = view.min_y + (view.max_y - view.min_y) * (i / kSide + 0.73) / kSide;
            wrong += material_at(view, x, y) != reference.material_at(x, y);
        }
        CHECK_NEAR(wrong, 0, 8);  // only where two lines cross or end within a texel
    }
}

// Along the track, where it is dense with lines: the middle of every stripe.
TEST(stripes_lie_where_they_should) {
    const Outline road = test::circuit(240);
    const GroundMap ground(road.view());
    const auto between = [&](size_t i, const std::vector<double>& line, double metres) {
        const double dx = line[2 * i] - road.center[2 * i];
        const double dy = line[2 * i + 1] - road.center[2 * i + 1];
        const double share = metres / std::sqrt(dx * dx + dy * dy);
        return material_at(ground.view(), road.center[2 * i] + share * dx,
                           road.center[2 * i + 1] + share * dy);
    };
    for (size_t i = 0; i < road.num_waypoints(); ++i) {
        for (const auto* line : {&road.inner, &road.outer}) {
            CHECK_EQUAL(int(between(i, *line, 0.2)), int(kRoad));
            CHECK_EQUAL(int(between(i, *line, 0.4 - 0.0762 - 0.004)), int(kRoad));
            CHECK_EQUAL(int(between(i, *line, 0.4 - 0.0762 + 0.004)), int(kEdgeLine));
            CHECK_EQUAL(int(between(i, *line, 0.4 - 0.004)), int(kEdgeLine));
            CHECK_EQUAL(int(between(i, *line, 0.4 + 0.004)), int(kField));
        }
    }
}

TEST(coverage_sums_to_the_unit_and_keeps_its_area) {
    const Outline road = test::circuit();
    const GroundMap ground(road.view());
    const GroundView& view = ground.view();
    double first[kNumMaterials] = {};
    for (int l = 1; l < view.num_levels; ++l) {
        const GroundLevel& level = view.levels[l];
        double area[kNumMaterials] = {};  // m2
        for (int row = -1; row <= level.rows; ++row) {
            for (int column = -1; column <= level.columns; ++column) {
                const uint32_t texel = view.texels[texel_index(level, static_cast<uint32_t>(column + 1) << 16,
                                                               static_cast<uint32_t>(row + 1) << 16)];
                uint32_t sum = 0;
                for (int m = 0; m < kNumMaterials; ++m) {
                    const uint32_t share = texel >> (8 * m) & 255;
                    sum += share;
                    area[m] += share / (64.0 * level.texels_per_metre * level.texels_per_metre);
                }
                CHECK_EQUAL(sum, 64u);
            }
        }
        for (int m = kRoad; m < kNumMaterials; ++m) {
            if (l == 1) first[m] = area[m];
            // Coarse texels round the thin dashes away; they are drawn only where nobody could see them.
            if (m != kCenterLine || level.texels_per_metre > 10.0f) CHECK_NEAR(area[m] / first[m], 1.0, 0.05);
        }
    }
    // Lines of 3 inches on both sides, dashes of 2 by 1 inches every 4 inches.
    double length = 0.0;
    for (size_t i = 1; i < road.num_waypoints(); ++i) {
        const double dx = road.center[2 * i] - road.center[2 * i - 2];
        const double dy = road.center[2 * i + 1] - road.center[2 * i - 1];
        length += std::sqrt(dx * dx + dy * dy);
    }
    CHECK_NEAR(first[kEdgeLine] / (2.0 * 0.0762 * length), 1.0, 0.02);
    CHECK_NEAR(first[kCenterLine] / (0.5 * 0.0254 * length), 1.0, 0.02);
    CHECK_NEAR((first[kRoad] + first[kEdgeLine] + first[kCenterLine]) / (0.8 * length), 1.0, 0.02);
}

// Every texel of one material has two shades, parted anywhere; altogether as much of the darker as of the
// lighter one, in every direction, and the same on every map of the same ground.
TEST(grain_is_even_and_always_the_same) {
    const Outline road = test::circuit();
    const GroundMap ground(road.view());
    const GroundMap again(road.view());
    const GroundView& view = ground.view();
    const GroundLevel& level = view.levels[0];
    double lighter[kNumMaterials] = {}, count[kNumMaterials] = {}, along_x = 0.0, along_y = 0.0;
    for (int row = 0; row < level.rows; ++row) {
        for (int column = 0; column < level.columns; ++column) {
            const uint32_t u = static_cast<uint32_t>(column + 1) << 16;
            const uint32_t v = static_cast<uint32_t>(row + 1) << 16;
            const uint32_t index = texel_index(level, u, v);
            const uint32_t texel = view.texels[index];
            CHECK_EQUAL(texel, again.view().texels[index]);
            const MaterialPair pair = kMaterialPairs[texel >> 24];
            if (pair.below != pair.above) continue;
            for (int k = 0; k < 16; ++k) {  // rays into the texel
                const uint32_t x = u + static_cast<uint32_t>(k % 4) * 16384 + 8192;
                const uint32_t y = v + static_cast<uint32_t>(k / 4) * 16384 + 8192;
                lighter[pair.above] += edge_distance(texel, x, y) > 0;
                count[pair.above] += 1.0;
            }
            along_x += static_cast<int8_t>(texel & 255) / 64.0;
            along_y += static_cast<int8_t>(texel >> 8 & 255) / 64.0;
        }
    }
    const double texels = (count[kField] + count[kRoad] + count[kEdgeLine]) / 16.0;
    CHECK(texels > 0.8 * level.rows * level.columns);
    for (const Material m : {kField, kRoad, kEdgeLine}) CHECK_NEAR(lighter[m] / count[m], 0.5, 0.01);
    CHECK_NEAR(along_x / texels, 0.0, 0.01);
    CHECK_NEAR(along_y / texels, 0.0, 0.01);
}

TEST(memory_limit_coarsens_the_texel) {
    const Outline road = test::circuit();
    const GroundMap free_size(road.view(), {.texel = 0.005f});
    const GroundMap limited(road.view(), {.texel = 0.005f, .max_bytes = 2u << 20});
    CHECK_NEAR(free_size.view().texel, 0.005, 1e-9);
    CHECK(limited.num_bytes() <= 2u << 20);
    CHECK(limited.view().texel > 0.005f);
    CHECK_NEAR(limited.view().levels[0].texels_per_metre * limited.view().texel, 1.0, 1e-6);
}

TEST(room_is_the_track_and_a_margin) {
    const Outline road = test::open_bend();
    const GroundMap ground(road.view());
    double min_x = 1e9, max_x = -1e9;
    for (const auto* line : {&road.center, &road.inner, &road.outer}) {
        for (size_t i = 0; i < line->size(); i += 2) {
            min_x = std::min(min_x, (*line)[i]);
            max_x = std::max(max_x, (*line)[i]);
        }
    }
    CHECK_NEAR(ground.view().min_x, min_x - kRoomMargin, 1e-5);
    CHECK_NEAR(ground.view().max_x, max_x + kRoomMargin, 1e-5);
}

TEST(bad_tracks_are_refused) {
    Outline road = test::circuit();
    CHECK_THROWS(GroundMap(road.view(), {.texel = 0.0f}), std::invalid_argument);
    road.inner[7] = std::numeric_limits<double>::quiet_NaN();
    CHECK_THROWS(GroundMap(road.view()), std::invalid_argument);
    const double point[] = {1.0, 2.0, 1.0, 2.0};
    CHECK_THROWS(GroundMap(TrackOutline{point, point, point, 2, false}), std::invalid_argument);
}

}  // namespace
}  // namespace racecraft
