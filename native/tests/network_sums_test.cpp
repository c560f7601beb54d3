// The fused multiply-adds of machines that have none in hardware, against the C library's, bit by bit. In
// WebAssembly, and on Windows, whose C library rounds small results twice, against the scalar one, which is
// held to the C library's elsewhere.
#include <bit>
#include <limits>
#include <random>

#include "check.hpp"

// A kernel's header, compiled as the portable kernels are.
#define RC_ISA portable
#include "../src/network_sums.hpp"

namespace racecraft {
namespace {

using portable::FloatLanes;

float reference(float a, float b, float c) {
#if defined(__wasm__) || defined(_WIN32)
    return scalar_multiply_add(a, b, c);  // which is the C library's where that is right
#else
    return std::fma(a, b, c);
#endif
}

bool same(float a, float b) {
    return (a != a && b != b) || std::bit_cast<uint32_t>(a) == std::bit_cast<uint32_t>(b);
}

// Checks a * b + c in each lane among others that are harmless.
void check_fused(float a, float b, float c) {
    CHECK(same(scalar_multiply_add(a, b, c), reference(a, b, c)));
    static int lane = 0;
    lane = (lane + 1) % FloatLanes::kCount;
    float x[16], y[16], z[16], out[16];
    for (int i = 0; i < FloatLanes::kCount; ++i) x[i] = y[i] = 1.5f, z[i] = -0.75f;
    x[lane] = a;
    y[lane] = b;
    z[lane] = c;
    store(out, fused_multiply_add(portable::load(x), portable::load(y), portable::load(z)));
    if (same(out[lane], reference(a, b, c))) return;
    char text[200];
    std::snprintf(text, sizeof text, "fma(%a, %a, %a) is %a, not %a", static_cast<double>(a),
                  static_cast<double>(b), static_cast<double>(c), static_cast<double>(out[lane]),
                  static_cast<double>(reference(a, b, c)));
    test::fail(__FILE__, __LINE__, text);
}

float any_float(std::mt19937& rng) {
    return std::bit_cast<float>(static_cast<uint32_t>(rng()));
}

// Calls check(a, b, c) where the product is a little more or less than half of the last bit of c, down to
// where a double cannot tell, and beyond both ends of the normal numbers.
template <typename Check>
void near_middles(const Check& check) {
    const float mantissas[] = {1.0f, 1.0f + 0x1p-23f, 1.5f, 0x1.555554p0f, 2.0f - 0x1p-23f};
    // (1 + 443 * 2^-23) (1 - 443 * 2^-23) is three quarters of a double's last bit away from a middle
    const int parts[] = {-443, -2, -1, 0, 1, 2, 443};
    const int exponents[] = {-149, -148, -140, -127, -126, -125, -100, -1, 0, 60, 126, 127};
    for (const float mantissa : mantissas) {
        for (const int exponent : exponents) {
            const float c = std::ldexp(mantissa, exponent);
            for (int shift = -56; shift <= 2; ++shift) {
                for (const int i : parts) {
                    for (const int j : parts) {
                        const int half = (exponent + shift) / 2;
                        const float a = std::ldexp(1.0f + static_cast<float>(i) * 0x1p-23f, half);
                        const float b =
                            std::ldexp(1.0f + static_cast<float>(j) * 0x1p-23f, exponent + shift - half);
                        check(a, b, c);
                        check(-a, b, c);
                        check(a, b, -c);
                    }
                }
            }
        }
    }
}

TEST(fused_multiply_add_of_special_values) {
    const float largest = std::numeric_limits<float>::max(),
                infinite = std::numeric_limits<float>::infinity();
    const float values[] = {0.0f,     1.0f,      1.0f + 0x1p-23f, 1.0f - 0x1p-24f, 0x1p-75f,
                            0x1p-74f, 0x1p-126f, 0x1p-127f,       0x1p-149f,       0x1.8p-140f,
                            0x1p63f,  0x1p64f,   largest,         infinite,        std::nanf("")};
    for (const float a : values)
        for (const float b : values)
            for (const float c : values)
                for (int signs = 0; signs < 8; ++signs)
                    check_fused(signs & 1 ? -a : a, signs & 2 ? -b : b, signs & 4 ? -c : c);
}

TEST(fused_multiply_add_of_any_bits) {
    std::mt19937 rng(1);
    for (int i = 0; i < 1000000; ++i) check_fused(any_float(rng), any_float(rng), any_float(rng));
    for (int i = 0; i < 1000000; ++i) {  // a sum that is about as large as the product, or cancels it
        const float a = std::ldexp(static_cast<float>(rng()), -32),
                    b = std::ldexp(static_cast<float>(rng()), -32);
        check_fused(a, b, std::ldexp(i % 3 ? -a * b : static_cast<float>(rng()), i % 3 ? 0 : -34));
    }
}

TEST(fused_multiply_add_between_two_floats) {
    near_middles(check_fused);
}

#if defined(RC_HAS_DOUBLES)

using portable::DoubledSums;
using portable::Magnitudes;

bool fits(float a, float b, float c) {
    Magnitudes x, w;
    x.look_at(&a, 1);
    w.look_at(&b, 1);
    return fit_doubled_sums(x, w, std::abs(static_cast<double>(c)));
}

// Checks sums that fit, and counts them.
int check_doubled(float a, float b, float c) {
    if (!fits(a, b, c)) return 0;
    using Lanes = DoubledSums::Lanes;
    const Lanes w[2] = {widen(portable::splat(0.3f)), widen(portable::splat(b))};
    Lanes sums[1][2] = {{widen(portable::splat(0.7f)), widen(portable::splat(c))}};
    DoubledSums arithmetic;
    add_steps(arithmetic, sums, 1, [&](auto& exactly, auto& to, size_t, size_t) {
        exactly.add_products(exactly.broadcast(a), w, to[0]);
    });
    float out[FloatLanes::kCount];
    store(out, narrow(sums[0][1]));
    for (const float value : out) CHECK(same(value, reference(a, b, c)));
    return 1;
}

TEST(doubled_sums_are_fused_multiply_adds) {
    int middles = 0, any = 0;
    near_middles([&](float a, float b, float c) { middles += check_doubled(a, b, c); });
    CHECK(middles > 50000);
    std::mt19937 rng(2);
    for (int i = 0; i < 1000000; ++i) any += check_doubled(any_float(rng), any_float(rng), any_float(rng));
    CHECK(any > 100000);
    for (int i = 0; i < 1000000; ++i) {  // as a network's
        const auto number = [&] { return std::ldexp(static_cast<float>(rng() >> 8), -24) - 0.5f; };
        CHECK_EQUAL(check_doubled(number(), i % 2 ? 1.0f : number(), number()), 1);
    }
}

TEST(numbers_beyond_the_range_fit_no_doubled_sums) {
    const float infinite = std::numeric_limits<float>::infinity();
    for (const float bad : {std::nanf(""), infinite, -infinite, 0x1p126f, 0x1p-102f}) {
        for (size_t at = 0; at < 7; ++at) {
            float values[7] = {0.0f, 1.0f, -2.0f, 0.5f, 0.0f, 3.0f, 1.0f};
            Magnitudes good, found;
            good.look_at(values, 7);
            CHECK(fit_doubled_sums(good, good, 1.0));
            values[at] = bad;
            found.look_at(values, 7);
            CHECK(!fit_doubled_sums(found, good, 1.0));
            CHECK(!fit_doubled_sums(good, found, 1.0));
        }
    }
    CHECK(!fit_doubled_sums(Magnitudes{}, Magnitudes{}, std::nan("")));
    CHECK(fit_doubled_sums(Magnitudes{}, Magnitudes{}, 0.0));
}

#endif

}  // namespace
}  // namespace racecraft
