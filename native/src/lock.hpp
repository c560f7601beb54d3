// One caller at a time; nothing where there is one thread, as in a browser's tab.
#pragma once

#if defined(__wasm__)

namespace racecraft {

struct Mutex {};

struct Lock {
    explicit Lock(const Mutex&) {}
};

}  // namespace racecraft

#else

#include <mutex>

namespace racecraft {

using Mutex = std::mutex;
using Lock = std::lock_guard<std::mutex>;

}  // namespace racecraft

#endif
