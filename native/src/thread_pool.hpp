// A fixed set of threads that run the same loop body over [0, count) and then wait for the next loop. In a
// browser's tab native/wasm/one_thread.cpp or shared_threads.cpp takes the place of thread_pool.cpp. In a
// forked child, which has no threads but the one that forked, the caller runs the loops alone.
#pragma once

#include <cstddef>
#include <memory>

namespace racecraft {

class ThreadPool {
  public:
    // num_threads counts the calling thread; 0 takes one per available core.
    explicit ThreadPool(int num_threads);
    ~ThreadPool();
    ThreadPool(const ThreadPool&) = delete;
    ThreadPool& operator=(const ThreadPool&) = delete;

    int num_threads() const { return num_threads_; }

    // Calls body(i) once for each i in [0, count), in any order, on all threads; returns when all are done.
    // One caller at a time; body must not throw.
    template <typename Body>
    void for_each(size_t count, const Body& body) {
        if (num_threads_ == 1 || count <= 1) {
            for (size_t i = 0; i < count; ++i) body(i);
            return;
        }
        run({[](const void* context, size_t i) { (*static_cast<const Body*>(context))(i); }, &body, count});
    }

  private:
    struct Loop {
        void (*call)(const void* context, size_t index);
        const void* context;
        size_t count;
    };
    class Workers;

    void run(const Loop& loop);

    int num_threads_;
    std::shared_ptr<Workers> workers_;  // the others; shared, as only thread_pool.cpp knows what they are
};

}  // namespace racecraft
