// Philox against the published known answers, and what is made of its words.
#include "racecraft/random.hpp"

#include <set>

#include "check.hpp"

namespace racecraft {
namespace {

void check_words(const RandomBlock& block, uint32_t a, uint32_t b, uint32_t c, uint32_t d) {
    CHECK_EQUAL(block.words[0], a);
    CHECK_EQUAL(block.words[1], b);
    CHECK_EQUAL(block.words[2], c);
    CHECK_EQUAL(block.words[3], d);
}

}  // namespace

// Known answers of philox4x32 with 10 rounds, from the tests that came with the paper's library, Random123.
TEST(philox_gives_the_known_answers) {
    check_words(philox(0, 0, 0, 0, static_cast<Purpose>(0)), 0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8);
    check_words(
        philox(0xffffffffffffffff, 0xffffffff, 0xffffffff, 0xffffffff, static_cast<Purpose>(0xffffffff)),
        0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd);
    // Digits of pi: counter 243f6a88 85a308d3 13198a2e 03707344, key a4093822 299f31d0.
    check_words(
        philox(0x299f31d0a4093822, 0x243f6a88, 0x85a308d3, 0x13198a2e, static_cast<Purpose>(0x03707344)),
        0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1);
}

TEST(every_key_part_matters) {
    std::set<uint32_t> seen;
    for (uint32_t bit = 0; bit < 32; ++bit) {
        const uint32_t one = 1u << bit;
        seen.insert(philox(one, 0, 0, 0, Purpose::start_pose).words[0]);
        seen.insert(philox(uint64_t{one} << 32, 0, 0, 0, Purpose::start_pose).words[0]);
        seen.insert(philox(0, one, 0, 0, Purpose::start_pose).words[0]);
        seen.insert(philox(0, 0, one, 0, Purpose::start_pose).words[0]);
        seen.insert(philox(0, 0, 0, one, Purpose::start_pose).words[0]);
    }
    seen.insert(philox(0, 0, 0, 0, Purpose::start_pose).words[0]);
    seen.insert(philox(0, 0, 0, 0, Purpose::start_position).words[0]);
    CHECK_EQUAL(seen.size(), size_t{5 * 32 + 2});
}

TEST(uniform_numbers_stay_in_their_range) {
    CHECK_EQUAL(uniform_of(0), 0.0f);
    CHECK_EQUAL(uniform_of(0xffffffff), 1.0f - 0x1p-24f);
    CHECK_EQUAL(symmetric_of(0), -1.0f);
    CHECK_EQUAL(symmetric_of(0x80000000), 0.0f);
    CHECK(symmetric_of(0xffffffff) < 1.0f);
}

TEST(uniform_numbers_are_even) {
    constexpr int kCount = 1 << 18;
    double mean = 0.0, square = 0.0;
    int bins[16] = {};
    for (uint32_t i = 0; i < kCount / 4; ++i) {
        const RandomBlock block = philox(3, i & 63, i >> 6, 0, Purpose::start_position);
        for (const uint32_t word : block.words) {
            const double u = static_cast<double>(uniform_of(word));
            mean += u / kCount;
            square += u * u / kCount;
            ++bins[static_cast<int>(u * 16.0)];
        }
    }
    CHECK_NEAR(mean, 0.5, 5.0 * 0.289 / 512.0);
    CHECK_NEAR(square, 1.0 / 3.0, 5.0 * 0.298 / 512.0);
    for (const int bin : bins) CHECK_NEAR(bin, kCount / 16, 5.0 * 124.0);
}

}  // namespace racecraft
