// A fixed set of threads that run the same loop body over [0, count) and then wait for the next loop.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <mutex>
#include <thread>
#include <vector>

namespace racecraft {

class ThreadPool {
  public:
    // num_threads counts the calling thread; 0 takes one per available core.
    explicit ThreadPool(int num_threads);
    ~ThreadPool();
    ThreadPool(const ThreadPool&) = delete;
    ThreadPool& operator=(const ThreadPool&) = delete;

    int num_threads() const { return static_cast<int>(workers_.size()) + 1; }

    // Calls body(i) once for each i in [0, count), in any order, on all threads; returns when all are done.
    // One caller at a time; body must not throw.
    template <typename Body>
    void for_each(size_t count, const Body& body) {
        if (workers_.empty() || count <= 1) {
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

    void run(const Loop& loop);
    void work();
    void drain(const Loop& loop);

    std::mutex mutex_;
    std::condition_variable wake_;
    std::condition_variable finished_;
    Loop loop_{};
    size_t generation_ = 0;  // guarded by mutex_; counts loops, so that a worker joins each once
    size_t busy_ = 0;        // guarded by mutex_; workers that have not left the current loop
    bool stopping_ = false;  // guarded by mutex_
    std::atomic<size_t> next_{0};
    std::vector<std::thread> workers_;
};

}  // namespace racecraft
