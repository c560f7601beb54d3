// What a GPU needs in order to drive cars by an engine's settings: the world as one block of memory, and the
// batch (include/racecraft/batch.hpp) that points to it and to the arrays of the cars.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "engine.hpp"
#include "racecraft/batch.hpp"

namespace racecraft {

class DevicePlan {
  public:
    // Settings, tracks, grounds and cameras are those of the engine, the number of cars is not.
    DevicePlan(const Engine& engine, size_t num_envs);

    // The block, ready to lie at this address of the device.
    std::vector<uint8_t> world(uint64_t address) const;
    size_t world_bytes() const { return world_.size(); }

    // Name and bytes of every array of the cars, in the order in which batch() takes their addresses.
    std::vector<std::pair<std::string, size_t>> arrays() const;
    // What an array holds before the first reset; empty where that is zeros.
    std::vector<uint8_t> initial(const std::string& name) const;
    // The bytes of the Batch; throws std::invalid_argument for a wrong number of addresses.
    std::vector<uint8_t> batch(uint64_t world, const std::vector<uint64_t>& addresses) const;

  private:
    template <typename T>
    size_t put(const T* values, size_t count);
    template <typename T>
    void point(size_t object, const T* const* slot, const void* base, size_t target);

    Batch batch_;
    GreyPalette palette_;
    uint64_t seed_;
    std::vector<uint8_t> world_;       // with offsets into itself in place of addresses
    std::vector<size_t> relocations_;  // where those are
    size_t tracks_ = 0, grounds_ = 0, lenses_ = 0;
};

}  // namespace racecraft
