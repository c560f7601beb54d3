#include "thread_pool.hpp"

#include <unistd.h>

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <vector>

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

class ThreadPool::Workers {
  public:
    explicit Workers(int count) {
        for (int i = 0; i < count; ++i) threads_.emplace_back([this] { work(); });
    }
    ~Workers();

    // A forked child has a copy of this but none of the threads.
    bool are_elsewhere() const { return getpid() != process_; }
    void run(const Loop& loop);

  private:
    void work();
    void drain(const Loop& loop);

    const pid_t process_ = getpid();  // whose threads these are
    std::mutex mutex_;
    std::condition_variable wake_;
    std::condition_variable finished_;
    Loop loop_{};
    size_t generation_ = 0;  // guarded by mutex_; counts loops, so that a worker joins each once
    size_t busy_ = 0;        // guarded by mutex_; workers that have not left the current loop
    bool stopping_ = false;  // guarded by mutex_
    std::atomic<size_t> next_{0};
    std::vector<std::thread> threads_;
};

ThreadPool::Workers::~Workers() {
    {
        const std::lock_guard lock(mutex_);
        stopping_ = true;
    }
    wake_.notify_all();
    for (std::thread& thread : threads_) thread.join();
}

void ThreadPool::Workers::drain(const Loop& loop) {
    for (size_t i = next_.fetch_add(1); i < loop.count; i = next_.fetch_add(1)) loop.call(loop.context, i);
}

void ThreadPool::Workers::run(const Loop& loop) {
    if (are_elsewhere()) {  // the lock, too, may be held by a thread that is not here
        next_.store(0);
        drain(loop);
        return;
    }
    {
        const std::lock_guard lock(mutex_);
        loop_ = loop;
        next_.store(0);
        busy_ = threads_.size();
        ++generation_;
    }
    wake_.notify_all();
    drain(loop);
    std::unique_lock lock(mutex_);
    finished_.wait(lock, [this] { return busy_ == 0; });
}

void ThreadPool::Workers::work() {
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

ThreadPool::ThreadPool(int num_threads) : num_threads_(num_threads > 0 ? num_threads : available_cores()) {
    if (num_threads_ == 1) return;
    // A forked child leaves its copy lying: its end would wait for ever, for threads that are not there.
    const auto end = [](const Workers* workers) {
        if (!workers->are_elsewhere()) delete workers;
    };
    workers_ = std::shared_ptr<Workers>(new Workers(num_threads_ - 1), end);
}

ThreadPool::~ThreadPool() = default;

void ThreadPool::run(const Loop& loop) {
    workers_->run(loop);
}

}  // namespace racecraft
