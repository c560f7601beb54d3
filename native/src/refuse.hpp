// How the core turns down what it cannot work with, in a sentence. A browser's tab has no exceptions: there
// native/wasm/refuse.cpp takes the place of refuse.cpp.
#pragma once

#include <string>

namespace racecraft {

// Throws std::invalid_argument.
[[noreturn]] void refuse(const std::string& message);

}  // namespace racecraft
