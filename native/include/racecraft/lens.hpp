// A picture as a real lens and sensor take it, and a real floor throws it back:
//
//     drawn ─▶ folds of the floor ─▶ shake, defocus, motion ─▶ vignette ─▶ a lamp's reflection ─▶ noise
//
// All but the set-up works on bytes, so that vectors hold as many pixels as they can.
#pragma once

#include "racecraft/camera.hpp"
#include "racecraft/randomization.hpp"
#include "racecraft/start.hpp"

namespace racecraft {

constexpr int32_t kGlareRows = 8;      // neighbouring rows that a lamp lights alike
constexpr int32_t kNoiseTile = 512;    // pixels of noise, of which each row begins somewhere else
constexpr int32_t kNoiseTable = 8192;  // of which each picture takes a tile
constexpr int32_t kNoiseMargin = 64;   // bytes behind a tile that vectors read
constexpr int32_t kNumLamps = 4;       // of a hall, one in each quarter of the sky

// What one picture has drawn.
struct Shot {
    float focal;         // focal length, pixels
    float yaw;           // rad, shake to the left
    int32_t rows;        // shake downwards, pixels
    uint32_t noise;      // key of its noise
    int32_t smear;       // 0, 1 or 2: columns blurred by a box of 1, 2 or 4
    bool is_soft;        // rows blurred by a box of 2
    float lamp;          // rad from where the lens looks to the nearest lamp, to the left
    float lamp_row;      // tangent below the horizon at which the floor shows it
    float lamp_width;    // tangent, half its reflection's
    float fold_heading;  // rad, of the normal of the floor's folds
    float fold_spacing;  // m
};

// Focal length, pixels.
RC_HD float focal_of(const CameraSpec& spec) {
    float sine, cosine;
    sincos_of(0.5f * spec.hfov, sine, cosine);
    return 0.5f * static_cast<float>(spec.width) * cosine / sine;
}

// What a picture of a car's episode draws; heading is the car's, in rad. The two lenses of a pair shake
// together.
RC_HD Shot take_shot(const Conditions& conditions, const CameraSpec& camera, const Draws& draws, int32_t step,
                     int32_t lens, float heading, float yaw_rate) {
    const RandomBlock picture =
        philox(draws.seed, draws.stream, draws.episode, static_cast<uint32_t>(step), Purpose::picture);
    const RandomBlock hall = philox(draws.seed, draws.stream, draws.episode, 1, Purpose::hall);
    const auto about_normal = [](uint32_t word) {  // of standard deviation 1, from two evenly drawn halves
        constexpr float scale = 2.4494897f / 65536.0f;
        return scale * static_cast<float>(static_cast<int32_t>((word & 0xffff) + (word >> 16)) - 65535);
    };
    Shot shot;
    shot.focal = focal_of(camera);
    shot.yaw = conditions.shake * about_normal(picture.words[0]);
    shot.rows =
        static_cast<int32_t>(round_of(shot.focal * conditions.shake * about_normal(picture.words[1])));
    shot.noise = picture.words[2] + static_cast<uint32_t>(lens);
    const float box = abs_of(yaw_rate) * conditions.shutter * shot.focal + conditions.defocus;
    shot.smear = box < 1.0f ? 0 : box < 3.0f ? 1 : 2;
    shot.is_soft = conditions.defocus >= 1.0f;
    constexpr float quarter = 0.5f * kPi;
    const float lamps = quarter * uniform_of(hall.words[0]);
    const float away = (lamps - heading - shot.yaw) / quarter;
    shot.lamp = quarter * (away - round_of(away));
    shot.lamp_row = 0.1f + 0.4f * uniform_of(hall.words[1]);
    shot.lamp_width = 0.05f + 0.35f * uniform_of(hall.words[1] << 12);
    shot.fold_heading = 2.0f * kPi * uniform_of(hall.words[2]);
    shot.fold_spacing = 0.5f + uniform_of(hall.words[3]);
    return shot;
}

// --- light

// What is lost at a column (or row), in 256ths; the middle is at `middle` halves of the picture.
RC_HD uint8_t vignette_at(int32_t index, int32_t count, float loss, float middle) {
    const float across =
        2.0f * (static_cast<float>(index) + 0.5f) / static_cast<float>(count) - 1.0f - middle;
    return static_cast<uint8_t>(min_of(256.0f * loss * across * across, 255.0f));
}

// A reflection's share at a distance of so many of its half widths, 0 to 1.
RC_HD float glow(float distance) {
    const float rest = max_of(1.0f - distance * distance, 0.0f);
    return rest * rest;
}

// A lamp's reflection in the floor: where its middle is and how wide it is, both ways.
struct Glare {
    float column, columns;  // pixels, the latter one over a half width
    float row, rows;
    float horizon;  // row above which there is no floor to show it
};

RC_HD Glare glare_of(const Shot& shot, const CameraSpec& spec) {
    constexpr float farthest = 1.3f;  // rad, more than any lens sees
    float sine, cosine, pitch_sine, pitch_cosine;
    sincos_of(clamp(shot.lamp, -farthest, farthest), sine, cosine);
    sincos_of(spec.pitch, pitch_sine, pitch_cosine);
    Glare glare;
    glare.column = 0.5f * static_cast<float>(spec.width) - 0.5f - shot.focal * sine / cosine;
    glare.columns = 1.0f / (shot.focal * shot.lamp_width);
    glare.horizon = 0.5f * static_cast<float>(spec.height) - 0.5f - shot.focal * pitch_sine / pitch_cosine;
    glare.row = glare.horizon + shot.focal * shot.lamp_row;
    glare.rows = 1.0f / (shot.focal * (0.1f + shot.lamp_row));
    return glare;
}

// How much of it a column shows, 1 is 255.
RC_HD uint8_t glare_across(const Glare& glare, int32_t column) {
    return static_cast<uint8_t>(255.0f * glow((static_cast<float>(column) - glare.column) * glare.columns));
}

// And a row, of `sheen` at its brightest.
RC_HD uint8_t glare_down(const Glare& glare, float sheen, int32_t row) {
    const float y = static_cast<float>(row);
    if (y <= glare.horizon) return 0;
    return static_cast<uint8_t>(255.0f * clamp(sheen, 0.0f, 1.0f) * glow((y - glare.row) * glare.rows));
}

// --- bytes

RC_HD uint8_t mean_of(uint8_t a, uint8_t b) {
    return static_cast<uint8_t>((a + b + 1) >> 1);
}

RC_HD uint8_t add_bytes(uint8_t a, uint8_t b) {
    const uint8_t sum = static_cast<uint8_t>(a + b);
    return sum < a ? uint8_t{255} : sum;
}

RC_HD uint8_t subtract_bytes(uint8_t a, uint8_t b) {
    return static_cast<uint8_t>(a > b ? a - b : 0);
}

// Product over 256.
RC_HD uint8_t share_of(uint8_t a, uint8_t b) {
    return static_cast<uint8_t>((a * b) >> 8);
}

// Noise is what is added to a pixel less what is taken from it, of which one is nothing: sums of two even
// draws, off their mean.
struct NoiseTable {
    uint8_t more[kNoiseTable], less[kNoiseTable];
};
constexpr float kNoiseUnit = 104.5f;  // its standard deviation, sqrt(2 (256^2 - 1) / 12)

constexpr NoiseTable make_noise() {
    NoiseTable table{};
    for (uint32_t i = 0; i < kNoiseTable; ++i) {
        uint32_t word = (i + 1) * 0x9E3779B1u;
        word ^= word >> 15;
        word *= 0x85EBCA77u;
        word ^= word >> 14;
        const int32_t off = static_cast<int32_t>((word & 255) + ((word >> 8) & 255)) - 255;
        table.more[i] = static_cast<uint8_t>(off > 0 ? off : 0);
        table.less[i] = static_cast<uint8_t>(off < 0 ? -off : 0);
    }
    return table;
}

// The table's share, of 256, for a standard deviation of which 1 is white. Products are cut to whole numbers,
// which takes half a step off it, hence half a step more.
RC_HD uint8_t noise_share(float noise) {
    if (!(noise > 0.0f)) return 0;
    return static_cast<uint8_t>(min_of((255.0f * noise + 0.5f) * (256.0f / kNoiseUnit) + 0.5f, 255.0f));
}

// Where a picture's tile begins in the table.
RC_HD int32_t noise_tile(uint32_t key, int32_t width) {
    return static_cast<int32_t>(key % static_cast<uint32_t>(kNoiseTable - kNoiseTile - kNoiseMargin - width));
}

// Where a row's noise begins in the tile.
RC_HD int32_t noise_begin(uint32_t key, int32_t row) {
    return static_cast<int32_t>(((key + static_cast<uint32_t>(row)) * 0x9E3779B1u) >> 23);
}
static_assert(kNoiseTile == 1 << (32 - 23));

}  // namespace racecraft
