// Colours of the world: a palette per car turns material coverage into brightness after the fetch.
#pragma once

#include "racecraft/ground.hpp"

namespace racecraft {

constexpr int32_t kNumWalls =
    4;  // in the order +x, +y, -x, -y (where the wall stands, seen from the room's centre)

struct GreyPalette {
    uint8_t ground[kNumMaterials];  // by Material
    uint8_t wall[kNumWalls];
    uint8_t sky;
    uint8_t outside;               // the floor beyond the walls, seen only from above them
    uint8_t grain[kNumMaterials];  // contrast: a material's two shades are so many 256ths of it off its mean
    uint8_t crowd;                 // contrast of what is in the hall, see surroundings.hpp
    uint8_t hall;                  // which hall
};

// What the ground throws back of one distant light, to a lens that looks to where it comes from: as the
// square of the cosine between the two, and the more the steeper the lens looks down.
struct Sheen {
    float x, y;                     // unit vector over the ground towards the light; zero for no sheen
    int8_t grazing[kNumMaterials];  // added to the brightness of ground at the horizon
    int8_t steep[kNumMaterials];    // where a ray falls half of what it goes along the lens's axis
};

struct RgbPalette {
    uint8_t ground[kNumMaterials][3];
    uint8_t wall[kNumWalls][3];
    uint8_t sky[3];
    uint8_t outside[3];
    uint8_t grain[kNumMaterials];
    Sheen sheen;
};

// The 2018 world (re:Invent 2018), as two frames of the original show it. Walls differ in brightness by
// direction, as its lamps left them.
constexpr RgbPalette kPalette2018 = {{{106, 152, 116}, {42, 56, 73}, {218, 217, 212}, {219, 131, 1}},
                                     {{15, 29, 33}, {9, 17, 20}, {4, 7, 8}, {1, 3, 3}},
                                     {178, 180, 182},
                                     {58, 64, 66},
                                     {7, 18, 6, 0},
                                     {}};

// The world of the later tracks.
constexpr RgbPalette kPalette2020 = {{{126, 133, 65}, {64, 63, 61}, {223, 223, 222}, {225, 143, 0}},
                                     {{16, 29, 34}, {9, 17, 20}, {4, 7, 8}, {2, 3, 4}},
                                     {178, 180, 182},
                                     {58, 64, 66},
                                     {7, 18, 6, 0},
                                     {}};

// The 2018 world as the original's last version draws it, fitted to a lap of frames of March 2026
// (docs/fidelity.md).
constexpr RgbPalette kPalette2026 = {{{97, 136, 99}, {39, 51, 61}, {197, 197, 182}, {196, 121, 13}},
                                     {{14, 33, 40}, {18, 37, 43}, {28, 53, 57}, {11, 26, 31}},
                                     {218, 218, 218},
                                     {58, 64, 66},
                                     {7, 11, 9, 3},
                                     {0.970f, -0.242f, {-10, 6, -15, 1}, {10, 12, 4, 7}}};

// The same world with walls that look well to people; the driver's are almost black.
RC_HD RgbPalette with_lit_walls(RgbPalette colours) {
    constexpr uint8_t walls[kNumWalls][3] = {{62, 104, 116}, {54, 92, 103}, {47, 81, 91}, {40, 70, 80}};
    for (int32_t i = 0; i < kNumWalls; ++i) {
        for (int32_t c = 0; c < 3; ++c) colours.wall[i][c] = walls[i][c];
    }
    return colours;
}

// Luma of ITU-R BT.601 with the original's weights 0.2989, 0.587, 0.114, rounded to nearest.
RC_HD uint8_t grey_of(const uint8_t* rgb) {
    return static_cast<uint8_t>((2989 * rgb[0] + 5870 * rgb[1] + 1140 * rgb[2] + 5000) / 10000);
}

RC_HD GreyPalette grey_palette(const RgbPalette& colours) {
    GreyPalette grey{};
    for (int32_t i = 0; i < kNumMaterials; ++i) grey.ground[i] = grey_of(colours.ground[i]);
    for (int32_t i = 0; i < kNumWalls; ++i) grey.wall[i] = grey_of(colours.wall[i]);
    grey.sky = grey_of(colours.sky);
    grey.outside = grey_of(colours.outside);
    for (int32_t i = 0; i < kNumMaterials; ++i) grey.grain[i] = colours.grain[i];
    return grey;
}

// What lies between two colours, at this share of the way.
RC_HD void mix_colours(const uint8_t* from, const uint8_t* to, float share, uint8_t* out) {
    for (int32_t c = 0; c < 3; ++c) {
        const float begin = static_cast<float>(from[c]);
        out[c] = static_cast<uint8_t>(begin + share * (static_cast<float>(to[c]) - begin) + 0.5f);
    }
}

// A palette in the form the inner loop wants; see shade_edge() and shade_coverage().
struct GroundShades {
    int32_t sides[kNumMaterialPairs];
    uint32_t weights;
};

struct ShadeTable {
    GroundShades ground;
    int32_t wall[kNumWalls];  // brightness times 64
    int32_t sky;
    int32_t outside;
};

RC_HD GroundShades ground_shades(const uint8_t* ground, const uint8_t* grain) {
    GroundShades shades{};
    for (int32_t i = 0; i < kNumMaterialPairs; ++i) {
        const MaterialPair pair = kMaterialPairs[i];
        int32_t below = ground[pair.below];
        int32_t above = ground[pair.above];
        if (pair.below == pair.above) {
            const int32_t wanted = (below * grain[pair.below] + 128) >> 8;
            const int32_t contrast = clamp(wanted, 0, 255 - above);
            below -= contrast;
            above += contrast;
        }
        shades.sides[i] = above << 16 | below;
    }
    for (int32_t i = 0; i < kNumMaterials; ++i) {
        shades.weights |= static_cast<uint32_t>(ground[i]) << (8 * i);
    }
    return shades;
}

RC_HD ShadeTable shade_table(const GreyPalette& palette) {
    ShadeTable table{};
    table.ground = ground_shades(palette.ground, palette.grain);
    for (int32_t i = 0; i < kNumWalls; ++i) table.wall[i] = kCoverageUnit * palette.wall[i];
    table.sky = kCoverageUnit * palette.sky;
    table.outside = kCoverageUnit * palette.outside;
    return table;
}

// How much of its sheen the ground shows to a lens that looks this way, 0 to 1.
RC_HD float sheen_towards(const Sheen& sheen, float sine, float cosine) {
    const float facing = max_of(sheen.x * cosine + sheen.y * sine, 0.0f);
    return facing * facing;
}

// The ground where rays fall `down` per unit along the lens's axis, with so much of its sheen.
RC_HD GroundShades shades_in_sheen(const GreyPalette& palette, const Sheen& sheen, float share, float down) {
    const float steepness = 2.0f * max_of(down, 0.0f);
    uint8_t ground[kNumMaterials];
    for (int32_t i = 0; i < kNumMaterials; ++i) {
        const float grazing = static_cast<float>(sheen.grazing[i]);
        const float more = static_cast<float>(sheen.steep[i]) - grazing;
        const float lit = static_cast<float>(palette.ground[i]) + share * (grazing + steepness * more);
        ground[i] = static_cast<uint8_t>(clamp(lit, 0.0f, 255.0f) + 0.5f);
    }
    return ground_shades(ground, palette.grain);
}

}  // namespace racecraft
