// The random numbers of numpy.random.default_rng(words), to the bit: what a training draws is a function of
// its seed and the iteration, and was NumPy's before this core drew it.
//
//     words ─SeedSequence─▶ PCG64 ─▶ random()  integer()  shuffle()
//
// SeedSequence is O'Neill's seed_seq_fe128
// (https://www.pcg-random.org/posts/developing-a-seed_seq-alternative.html), PCG64 her XSL RR 128/64
// (https://www.pcg-random.org/paper.html). Only whole numbers, and one exact product: nothing that an
// instruction set or a library could round otherwise. Header only, no exceptions, no allocation; 128-bit
// arithmetic is the compiler's (GCC and Clang have it for every target, WebAssembly included).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

namespace racecraft {

class NumpyRandom {
  public:
    // Up to `kMostSeeds` whole numbers, as a list of them seeds NumPy's.
    static constexpr size_t kMostSeeds = 4;
    explicit NumpyRandom(std::span<const uint64_t> seeds) {
        uint32_t words[2 * kMostSeeds] = {};
        size_t count = 0;
        for (const uint64_t seed : seeds.first(seeds.size() < kMostSeeds ? seeds.size() : kMostSeeds)) {
            words[count++] = static_cast<uint32_t>(seed);
            if (seed >> 32 != 0) words[count++] = static_cast<uint32_t>(seed >> 32);
        }
        seed_with(words, count);
    }

    // Uniform in [0, 1), 53 random bits.
    double random() { return static_cast<double>(next64() >> 11) * 0x1p-53; }

    // Uniform in [0, bound), by Lemire's method (https://arxiv.org/abs/1805.10941); bound from 1 to 2^32 - 1.
    uint32_t integer(uint32_t bound) {
        if (bound == 1) return 0;  // nothing is drawn
        uint64_t product = static_cast<uint64_t>(next32()) * bound;
        if (static_cast<uint32_t>(product) < bound) {
            const uint32_t least = (0u - bound) % bound;
            while (static_cast<uint32_t>(product) < least) product = static_cast<uint64_t>(next32()) * bound;
        }
        return static_cast<uint32_t>(product >> 32);
    }

    // In place, as Generator.permutation orders a copy; count below 2^32.
    template <typename T>
    void shuffle(T* values, size_t count) {
        for (size_t i = count; i-- > 1;) std::swap(values[i], values[at_most(static_cast<uint32_t>(i))]);
    }

  private:
    __extension__ using Word = unsigned __int128;

    void seed_with(const uint32_t* words, size_t count) {
        constexpr size_t kPool = 4;
        uint32_t constant = 0x43b0d7e5u;
        const auto hash = [&constant](uint32_t value) {
            value ^= constant;
            constant *= 0x931e8875u;
            value *= constant;
            return value ^ (value >> 16);
        };
        const auto mix = [](uint32_t x, uint32_t y) {
            const uint32_t mixed = 0xca01f9ddu * x - 0x4973f715u * y;
            return mixed ^ (mixed >> 16);
        };
        uint32_t pool[kPool];
        for (size_t i = 0; i < kPool; ++i) pool[i] = hash(i < count ? words[i] : 0);
        for (size_t from = 0; from < kPool; ++from) {
            for (size_t to = 0; to < kPool; ++to) {
                if (from != to) pool[to] = mix(pool[to], hash(pool[from]));
            }
        }
        for (size_t from = kPool; from < count; ++from) {
            for (uint32_t& word : pool) word = mix(word, hash(words[from]));
        }

        uint64_t state[4] = {};
        constant = 0x8b51f9ddu;
        for (size_t i = 0; i < 8; ++i) {
            uint32_t value = pool[i % kPool] ^ constant;
            constant *= 0x58f38dedu;
            value *= constant;
            value ^= value >> 16;
            state[i / 2] |= static_cast<uint64_t>(value) << (i % 2 * 32);
        }
        increment_ = (static_cast<Word>(state[2]) << 64 | state[3]) << 1 | 1;
        advance();
        state_ += static_cast<Word>(state[0]) << 64 | state[1];
        advance();
    }

    void advance() {
        constexpr Word kMultiplier = static_cast<Word>(2549297995355413924u) << 64 | 4865540595714422341u;
        state_ = state_ * kMultiplier + increment_;
    }

    uint64_t next64() {
        advance();
        const uint64_t value = static_cast<uint64_t>(state_ >> 64) ^ static_cast<uint64_t>(state_);
        const unsigned turn = static_cast<unsigned>(state_ >> 122);
        return value >> turn | value << (-turn & 63);
    }

    // The lower half of a word, then the upper one, whatever is drawn in between.
    uint32_t next32() {
        if (has_half_) {
            has_half_ = false;
            return half_;
        }
        const uint64_t value = next64();
        has_half_ = true;
        half_ = static_cast<uint32_t>(value >> 32);
        return static_cast<uint32_t>(value);
    }

    // Uniform in [0, most], as shuffling draws it: as many bits as `most` has, until they fit.
    uint32_t at_most(uint32_t most) {
        uint32_t mask = most;
        for (int bits = 1; bits <= 16; bits *= 2) mask |= mask >> bits;
        uint32_t value = next32() & mask;
        while (value > most) value = next32() & mask;
        return value;
    }

    Word state_ = 0, increment_ = 0;
    uint32_t half_ = 0;
    bool has_half_ = false;
};

}  // namespace racecraft
