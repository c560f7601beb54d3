// How fast each layer of a network is on this machine, one thread, and how fast it could be.
#pragma once

#include <string>
#include <vector>

#include "network.hpp"

namespace racecraft {

struct LayerTime {
    std::string tower, shape, pass;  // "policy", "14x19x16", "forward"
    double operations;               // of one sample, additions and multiplications
    double seconds;                  // of one sample, the best of many
};

// Every pass of every layer over `samples` samples at a time, the best of `repeats` runs.
std::vector<LayerTime> profile_layers(const NetworkSpec& spec, size_t samples, int repeats);

// Operations per second of fused multiply-adds on registers alone, with the instruction set in force.
double peak_operations_per_second();

}  // namespace racecraft
