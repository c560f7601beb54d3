// The thread pool: every index once, loops back to back, construction and destruction. Run under TSan as
// well.
#include "thread_pool.hpp"

#if !defined(_WIN32)
#include <sys/wait.h>
#include <unistd.h>
#endif

#include <atomic>
#include <memory>
#include <mutex>
#include <set>
#include <thread>
#include <vector>

#include "check.hpp"

namespace racecraft {

TEST(counts_the_caller_among_its_threads) {
    for (const int threads : {1, 2, 7}) CHECK_EQUAL(ThreadPool(threads).num_threads(), threads);
    CHECK(ThreadPool(0).num_threads() >= 1);
}

TEST(calls_the_body_once_for_each_index) {
    for (const int threads : {1, 2, 3, 7, 16}) {
        ThreadPool pool(threads);
        for (const size_t count :
             {size_t{0}, size_t{1}, size_t{2}, size_t{15}, size_t{1000}, size_t{20000}}) {
            std::vector<std::atomic<int>> calls(count);
            pool.for_each(count, [&](size_t i) { calls[i].fetch_add(1, std::memory_order_relaxed); });
            for (const std::atomic<int>& call : calls) CHECK_EQUAL(call.load(), 1);
        }
    }
}

TEST(plain_writes_of_the_body_are_visible_afterwards) {
    ThreadPool pool(4);
    std::vector<size_t> values(997);
    for (size_t loop = 0; loop < 200; ++loop) {
        pool.for_each(values.size(), [&](size_t i) { values[i] += i + loop; });
    }
    for (size_t i = 0; i < values.size(); ++i) CHECK_EQUAL(values[i], 200 * i + 199 * 100);
}

TEST(many_short_loops_follow_each_other) {
    ThreadPool pool(4);
    std::atomic<size_t> sum{0};
    size_t expected = 0;
    for (size_t loop = 0; loop < 5000; ++loop) {
        const size_t count = loop % 7;
        pool.for_each(count, [&](size_t i) { sum.fetch_add(i + 1, std::memory_order_relaxed); });
        expected += count * (count + 1) / 2;
        CHECK_EQUAL(sum.load(), expected);
    }
}

TEST(a_slow_thread_does_not_carry_an_old_loop_into_the_next) {
    ThreadPool pool(3);
    for (int loop = 0; loop < 300; ++loop) {
        auto owned = std::make_unique<std::vector<std::atomic<int>>>(8);
        pool.for_each(8, [&](size_t i) {
            if (i % 3 == 0) std::this_thread::yield();
            (*owned)[i].fetch_add(1);
        });
        for (const std::atomic<int>& calls : *owned) CHECK_EQUAL(calls.load(), 1);
    }
}

TEST(all_threads_take_part) {
    ThreadPool pool(3);
    std::mutex mutex;
    std::set<std::thread::id> seen;
    // A body waits until all threads are inside one, so each of them must have come.
    pool.for_each(3, [&](size_t) {
        for (size_t here = 0; here < 3;) {
            {
                const std::lock_guard lock(mutex);
                seen.insert(std::this_thread::get_id());
                here = seen.size();
            }
            std::this_thread::yield();
        }
    });
    CHECK_EQUAL(seen.size(), size_t{3});
}

TEST(pools_come_and_go) {
    for (int i = 0; i < 200; ++i) {
        ThreadPool pool(1 + i % 5);
        if (i % 2 == 0) {
            std::atomic<int> calls{0};
            pool.for_each(9, [&](size_t) { ++calls; });
            CHECK_EQUAL(calls.load(), 9);
        }
    }
}

TEST(pools_may_run_side_by_side) {
    std::vector<std::thread> users;
    std::atomic<int> calls{0};
    for (int user = 0; user < 3; ++user) {
        users.emplace_back([&] {
            ThreadPool pool(2);
            for (int loop = 0; loop < 100; ++loop) pool.for_each(10, [&](size_t) { ++calls; });
        });
    }
    for (std::thread& user : users) user.join();
    CHECK_EQUAL(calls.load(), 3 * 100 * 10);
}

#if !defined(_WIN32)  // which forks nothing

TEST(a_forked_child_runs_loops_alone_and_ends) {
    auto pool = std::make_unique<ThreadPool>(3);
    int sum = 0;
    pool->for_each(1, [&](size_t) { ++sum; });
    const pid_t child = fork();
    if (child == 0) {
        alarm(20);  // ends a child that waits for ever
        for (int loop = 0; loop < 3; ++loop) pool->for_each(100, [&](size_t) { ++sum; });
        pool.reset();
        _exit(sum == 301 ? 0 : 1);
    }
    CHECK(child > 0);
    int status = -1;
    CHECK_EQUAL(waitpid(child, &status, 0), child);
    CHECK_EQUAL(status, 0);
    std::atomic<int> calls{0};
    pool->for_each(100, [&](size_t) { ++calls; });
    CHECK_EQUAL(calls.load(), 100);
}

#endif

}  // namespace racecraft
