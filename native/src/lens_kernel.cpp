#include "lens_kernel.hpp"

#include "bytes.hpp"

namespace racecraft::RC_ISA {
namespace {

constexpr NoiseTable kNoise = make_noise();
constexpr int32_t kMargin = static_cast<int32_t>(kDrawnMargin);

// What the pixels of some rows meet, byte by byte; vectors read behind the last.
struct Film {
    alignas(64) uint8_t shade[kMaxImageWidth + kMargin];  // of a column
    alignas(64) uint8_t row_shade[kMaxImageWidth];
    alignas(64) uint8_t lamp[kMaxImageWidth + kMargin];   // its reflection's share in a column
    alignas(64) uint8_t glare[kMaxImageWidth + kMargin];  // and brightness in these rows
    alignas(64) uint8_t more[kNoiseTile + kMaxImageWidth + kMargin];
    alignas(64) uint8_t less[kNoiseTile + kMaxImageWidth + kMargin];
};

template <int kSmear, bool kIsSoft>
RC_HD Bytes blurred(const uint8_t* here, const uint8_t* below) {
    const auto at = [=](int32_t column) {
        return kIsSoft ? mean_of(load_bytes(here + column), load_bytes(below + column))
                       : load_bytes(here + column);
    };
    if (kSmear == 0) return at(0);
    if (kSmear == 1) return mean_of(at(0), at(1));
    return mean_of(mean_of(at(-1), at(0)), mean_of(at(1), at(2)));
}

// Rows [first, last), lit alike by the lamp.
template <int kSmear, bool kIsSoft>
void take_rows(const CameraSpec& spec, const Shot& shot, const Film& film, const uint8_t* drawn,
               int32_t first, int32_t last, uint8_t* frame) {
    const int32_t width = spec.width;
    for (int32_t y = first; y < last; ++y) {
        const int32_t from = clamp(y - shot.rows, 0, spec.height - 1);
        const uint8_t* here = drawn + static_cast<ptrdiff_t>(from) * width;
        const uint8_t* below = from + 1 < spec.height ? here + width : here;
        const uint8_t* more = film.more + noise_begin(shot.noise, y);
        const uint8_t* less = film.less + noise_begin(shot.noise, y);
        const Bytes row_shade = splat_bytes(film.row_shade[y]);
        uint8_t* out = frame + static_cast<ptrdiff_t>(y) * width;
        const auto take = [=, &film](int32_t x) {
            const Bytes pixels = blurred<kSmear, kIsSoft>(here + x, below + x);
            const Bytes shade = add_bytes(load_bytes(film.shade + x), row_shade);
            const Bytes lit = subtract_bytes(pixels, share_of(pixels, shade));
            const Bytes bright = add_bytes(add_bytes(lit, load_bytes(film.glare + x)), load_bytes(more + x));
            return subtract_bytes(bright, load_bytes(less + x));
        };
        int32_t x = 0;
        for (; x + Bytes::kCount <= width; x += Bytes::kCount) store_bytes(out + x, take(x));
        if (x < width) store_first(out + x, take(x), width - x);
    }
    // Pixels for which another row was read repeat their neighbours; only now, when those have reached
    // memory.
    for (int32_t y = first; y < last && kSmear > 0; ++y) {
        uint8_t* out = frame + static_cast<ptrdiff_t>(y) * width;
        if (kSmear == 2) out[0] = out[1];
        if (kSmear == 2) out[width - 2] = out[width - 3];
        out[width - 1] = out[width - 2];
    }
}

using TakeRows = void (*)(const CameraSpec&, const Shot&, const Film&, const uint8_t*, int32_t, int32_t,
                          uint8_t*);
constexpr TakeRows kTakeRows[2][3] = {{take_rows<0, false>, take_rows<1, false>, take_rows<2, false>},
                                      {take_rows<0, true>, take_rows<1, true>, take_rows<2, true>}};

// What does not change from row to row.
void prepare(const CameraSpec& spec, const Conditions& conditions, const Shot& shot, const Glare& glare,
             Film& film) {
    for (int32_t x = 0; x < spec.width; ++x) {
        film.shade[x] = vignette_at(x, spec.width, conditions.vignette, conditions.vignette_across);
        film.lamp[x] = glare_across(glare, x);
        film.glare[x] = 0;
    }
    for (int32_t y = 0; y < spec.height; ++y) {
        film.row_shade[y] = vignette_at(y, spec.height, conditions.vignette, conditions.vignette_down);
    }
    const int32_t tile = noise_tile(shot.noise, spec.width);
    const Bytes share = splat_bytes(noise_share(conditions.noise));
    for (int32_t i = 0; i < kNoiseTile + spec.width; i += Bytes::kCount) {
        store_bytes(film.more + i, share_of(load_bytes(kNoise.more + tile + i), share));
        store_bytes(film.less + i, share_of(load_bytes(kNoise.less + tile + i), share));
    }
}

}  // namespace

void take_picture(const CameraSpec& spec, const Conditions& conditions, const Shot& shot,
                  const uint8_t* drawn, uint8_t* frame) {
    Film film;
    const Glare glare = glare_of(shot, spec);
    prepare(spec, conditions, shot, glare, film);
    const TakeRows take = kTakeRows[shot.is_soft][spec.width < 4 ? 0 : shot.smear];
    for (int32_t first = 0; first < spec.height; first += kGlareRows) {
        if (conditions.sheen > 0.0f) {
            const Bytes row = splat_bytes(glare_down(glare, conditions.sheen, first));
            for (int32_t x = 0; x < spec.width; x += Bytes::kCount) {
                store_bytes(film.glare + x, share_of(load_bytes(film.lamp + x), row));
            }
        }
        take(spec, shot, film, drawn, first, min_of(first + kGlareRows, spec.height), frame);
    }
}

}  // namespace racecraft::RC_ISA
