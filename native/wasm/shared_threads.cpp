// Threads in a browser's tab that is cross-origin isolated: workers of the page, each with an instance of
// this module over the same memory (web/src/tab/team.ts). They wait in help() for the loops of the one that
// calls. Only threads.wasm has this file, the other builds have one_thread.cpp.
#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <new>

#include "thread_pool.hpp"

#define RC_EXPORT(name) extern "C" [[clang::export_name(#name)]]

namespace racecraft {
namespace {

constexpr int kMostThreads = 64;
constexpr int kLooks = 4000;  // before a thread sleeps: some microseconds, as loops follow each other closely

// A number that threads wait on.
class Signal {
  public:
    std::atomic<uint32_t> value{0};

    void wait_while(uint32_t old) {
        for (int look = 0; look < kLooks; ++look) {
            if (value.load() != old) return;
        }
        __builtin_wasm_memory_atomic_wait32(address(), static_cast<int>(old), -1);
    }
    void wake() { __builtin_wasm_memory_atomic_notify(address(), kMostThreads); }

  private:
    int* address() { return reinterpret_cast<int*>(&value); }
};
static_assert(sizeof(Signal) == sizeof(int) && std::atomic<uint32_t>::is_always_lock_free);

// The helpers of this memory. One joins a loop while it is open, so that nobody waits for a helper that wakes
// up late.
class Team {
  public:
    int num_helpers = 0;  // set before the first pool is made

    void run(void (*call)(const void*, size_t), const void* context, size_t count) {
        call_ = call, context_ = context, count_ = count;
        next_.store(0);
        inside_.value.store(kOpen);
        opened_.value.fetch_add(1);
        opened_.wake();
        drain();
        inside_.value.fetch_sub(kOpen);
        for (uint32_t inside = inside_.value.load(); inside != 0; inside = inside_.value.load())
            inside_.wait_while(inside);
    }

    [[noreturn]] void help() {
        while (true) {
            const uint32_t seen = opened_.value.load();
            if (join()) {
                drain();
                if (inside_.value.fetch_sub(1) == 1) inside_.wake();  // the last one to leave a closed loop
            }
            opened_.wait_while(seen);
        }
    }

  private:
    static constexpr uint32_t kOpen = 1u << 31;

    bool join() {
        uint32_t inside = inside_.value.load();
        while ((inside & kOpen) != 0) {
            if (inside_.value.compare_exchange_weak(inside, inside + 1)) return true;
        }
        return false;
    }
    void drain() {
        for (size_t i = next_.fetch_add(1); i < count_; i = next_.fetch_add(1)) call_(context_, i);
    }

    void (*call_)(const void* context, size_t index) = nullptr;  // these three are set while nobody is inside
    const void* context_ = nullptr;
    size_t count_ = 0;
    std::atomic<size_t> next_{0};
    Signal opened_;  // loops so far
    Signal inside_;  // helpers in the loop, and kOpen
};

constinit Team team;

// Memory's keeper was built for one thread.
std::atomic<bool> is_heap_taken{false};
struct HeapLock {
    HeapLock() {
        while (is_heap_taken.exchange(true, std::memory_order_acquire)) {
        }
    }
    ~HeapLock() { is_heap_taken.store(false, std::memory_order_release); }
};

}  // namespace

ThreadPool::ThreadPool(int num_threads)
    : num_threads_(num_threads > 0 ? num_threads : 1 + team.num_helpers) {}

ThreadPool::~ThreadPool() = default;

void ThreadPool::run(const Loop& loop) {
    team.run(loop.call, loop.context, loop.count);
}

// How many helpers there are from now on.
RC_EXPORT(expect_helpers) void expect_helpers(int count) {
    team.num_helpers = count;
}
// What a helper does for the rest of its life, on a stack and with variables of its own.
RC_EXPORT(help) void help() {
    team.help();
}

}  // namespace racecraft

// ---- what the standard library, built for one thread, leaves open

void* operator new(size_t size) {
    const racecraft::HeapLock lock;
    void* memory = std::malloc(size > 0 ? size : 1);
    if (memory == nullptr) std::abort();
    return memory;
}
void* operator new(size_t size, std::align_val_t alignment) {
    const racecraft::HeapLock lock;
    const size_t unit = static_cast<size_t>(alignment);
    void* memory = std::aligned_alloc(unit, (size + unit - 1) / unit * unit);
    if (memory == nullptr) std::abort();
    return memory;
}
void operator delete(void* memory) noexcept {
    const racecraft::HeapLock lock;
    std::free(memory);
}
void operator delete(void* memory, size_t) noexcept {
    operator delete(memory);
}
void operator delete(void* memory, std::align_val_t) noexcept {
    operator delete(memory);
}
void operator delete(void* memory, size_t, std::align_val_t) noexcept {
    operator delete(memory);
}

// A variable inside of a function is made by the first thread that comes by (Itanium C++ ABI, 3.3.3): the
// first byte says that it is made, the second that somebody makes it.
extern "C" int __cxa_guard_acquire(std::atomic<uint8_t>* guard) {
    while (guard[0].load() == 0) {
        if (guard[1].exchange(1) == 0) return 1;
    }
    return 0;
}
extern "C" void __cxa_guard_release(std::atomic<uint8_t>* guard) {
    guard[0].store(1);
}

// What a thread's own variables are destroyed by when it ends (3.3.2).
extern "C" int __cxa_thread_atexit(void (*)(void*), void*, void*) {
    return 0;
}
