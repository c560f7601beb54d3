// Counter-based random numbers: Philox4x32-10 (Salmon et al., "Parallel random numbers: as easy as 1, 2, 3",
// SC11).
//
// A number depends only on what it is for (seed, environment, episode, step, purpose), so batch size, thread
// count and the order of calls cannot change it, and nothing has to be stored.
#pragma once

#include "racecraft/platform.hpp"

namespace racecraft {

// What a random number is for; one value each, never reused, so that adding one leaves the others as they
// were.
enum class Purpose : uint32_t {
    start_position = 1,  // where along the lap an episode starts
    start_pose = 2,      // lateral and heading jitter of the start
    object_place = 3,    // where objects stand at the start of an episode
    lane_change = 4,     // when a bot car changes its lane
    lidar_noise = 5,     // of every ray
    grid = 6,            // who starts where in a race
    track = 16,          // which of several tracks an episode is driven on
    conditions = 17,     // of an episode, see randomization.hpp; word i is that of quantity i
    tint = 18,           // colour of an episode's light
    colours = 19,        // of an episode's world
    hall = 20,           // what stands in an episode's world, where its lamps hang and its floor is folded
    picture = 21,        // shake and noise of a single picture
};

struct RandomBlock {
    uint32_t words[4];
};

RC_HD RandomBlock philox(uint64_t seed, uint32_t env, uint32_t episode, uint32_t step, Purpose purpose) {
    uint32_t counter[4] = {env, episode, step, static_cast<uint32_t>(purpose)};
    uint32_t key0 = static_cast<uint32_t>(seed);
    uint32_t key1 = static_cast<uint32_t>(seed >> 32);
    for (int round = 0; round < 10; ++round) {
        const uint64_t product0 = uint64_t{0xD2511F53u} * counter[0];
        const uint64_t product1 = uint64_t{0xCD9E8D57u} * counter[2];
        const uint32_t next0 = static_cast<uint32_t>(product1 >> 32) ^ counter[1] ^ key0;
        const uint32_t next2 = static_cast<uint32_t>(product0 >> 32) ^ counter[3] ^ key1;
        counter[1] = static_cast<uint32_t>(product1);
        counter[3] = static_cast<uint32_t>(product0);
        counter[0] = next0;
        counter[2] = next2;
        key0 += 0x9E3779B9u;
        key1 += 0xBB67AE85u;
    }
    return {{counter[0], counter[1], counter[2], counter[3]}};
}

// Uniform in [0, 1), 24 random bits, exact in float.
RC_HD float uniform_of(uint32_t word) {
    return static_cast<float>(word >> 8) * (1.0f / 16777216.0f);
}

// Uniform in [-1, 1).
RC_HD float symmetric_of(uint32_t word) {
    return 2.0f * uniform_of(word) - 1.0f;
}

}  // namespace racecraft
