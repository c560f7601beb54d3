#include "thread_pool.hpp"

#if defined(__linux__)
#include <sched.h>
#endif

namespace racecraft {
namespace {

int available_cores() {
#if defined(__linux__)
    cpu_set_t set;
    if (sched_getaffinity(0, sizeof(set), &set) == 0) return CPU_COUNT(&set);
#endif
    const unsigned cores = std::thread::hardware_concurrency();
    return cores > 0 ? static_cast<int>(cores) : 1;
}

}  // namespace

ThreadPool::ThreadPool(int num_threads) {
    const int threads = num_threads > 0 ? num_threads : available_cores();
    for (int i = 1; i < threads; ++i) workers_.emplace_back([this] { work(); });
}

ThreadPool::~ThreadPool() {
    {
        const std::lock_guard lock(mutex_);
        stopping_ = true;
    }
    wake_.notify_all();
    for (std::thread& worker : workers_) worker.join();
}

void ThreadPool::drain(const Loop& loop) {
    for (size_t i = next_.fetch_add(1); i < loop.count; i = next_.fetch_add(1)) loop.call(loop.context, i);
}

void ThreadPool::run(const Loop& loop) {
    {
        const std::lock_guard lock(mutex_);
        loop_ = loop;
        next_.store(0);
        busy_ = workers_.size();
        ++generation_;
    }
    wake_.notify_all();
    drain(loop);
    std::unique_lock lock(mutex_);
    finished_.wait(lock, [this] { return busy_ == 0; });
}

void ThreadPool::work() {
    size_t joined = 0;
    std::unique_lock lock(mutex_);
    while (true) {
        wake_.wait(lock, [&] { return stopping_ || generation_ != joined; });
        if (stopping_) return;
        joined = generation_;
        const Loop loop = loop_;
        lock.unlock();
        drain(loop);
        lock.lock();
        if (--busy_ == 0) finished_.notify_one();
    }
}

}  // namespace racecraft
