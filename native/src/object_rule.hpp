// Which objects a batch may ask for, and which it may go on from.
#pragma once

#include <vector>

#include "racecraft/objects.hpp"

namespace racecraft {

// Throws std::invalid_argument for a rule that no track could follow, or a batch that is no whole number of
// races.
void check_objects(const ObjectRule& rule, size_t num_envs, size_t cars_per_race);

// Null if saved objects are ones that a simulation can go on from.
const char* find_fault(const std::vector<ObjectState>& objects);

}  // namespace racecraft
