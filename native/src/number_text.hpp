// The shortest decimal text of a double, letter for letter as Python's repr writes it. Logs are made of
// millions of them.
#pragma once

#include <cstddef>

namespace racecraft {

constexpr size_t kMaxNumberText = 32;

// Writes at most kMaxNumberText characters, without a terminating zero, and returns how many.
size_t write_number(double value, char* out);

}  // namespace racecraft
