// Threads in a browser's tab: the caller alone, who never ends.
#include "thread_pool.hpp"

namespace racecraft {

ThreadPool::ThreadPool(int) : num_threads_(1) {}

ThreadPool::~ThreadPool() = default;

void ThreadPool::run(const Loop&) {}  // for_each() does not come here with one thread

}  // namespace racecraft

// What a thread's own variables are destroyed by when it ends (Itanium C++ ABI, 3.3.2).
extern "C" int __cxa_thread_atexit(void (*)(void*), void*, void*) {
    return 0;
}
