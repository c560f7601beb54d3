// What a translated reward function (racecraft.reward.cuda) is made of: Python's arithmetic on doubles.
//
// What Python would raise sets `bad`; the row's reward is then NaN, and the interpreter is asked what
// happened.
#pragma once

#include "racecraft/platform.hpp"

#if !defined(__CUDACC_RTC__)
#include <cmath>
using std::acos, std::asin, std::atan, std::atan2, std::ceil, std::cos, std::cosh, std::exp, std::fabs,
    std::floor, std::hypot, std::isfinite, std::isnan, std::log, std::log10, std::log2, std::pow, std::sin,
    std::sinh, std::sqrt, std::tan, std::tanh, std::trunc, std::fmod;
#endif

namespace racecraft {

#if defined(__CUDACC_RTC__)
#define kNoNumber __longlong_as_double(0x7ff8000000000000LL)
#else
constexpr double kNoNumber = __builtin_nan("");
#endif

// The centre line of a track: x and y of its waypoints.
struct Waypoints {
    const double* points;
    double count;
};

struct Pair {
    double first, second;
};

// What the kernel is told; rows and waypoints lie on the device.
struct RewardTask {
    const double* rows;  // (count, width)
    double* rewards;     // (count,)
    const double* points;
    const int32_t* first_point;  // of every track, and one more
    int32_t count, width;
};

RC_HD double valid(double value, bool& bad) {
    bad = bad || isnan(value);
    return value;
}

RC_HD double divided(double a, double b, bool& bad) {
    bad = bad || b == 0.0;
    return a / b;
}

RC_HD double remainder_of(double a, double b, bool& bad) {
    bad = bad || b == 0.0;
    const double rest = fmod(a, b);
    return rest != 0.0 && (rest < 0.0) != (b < 0.0) ? rest + b : rest;
}

RC_HD double floor_divided(double a, double b, bool& bad) {
    return floor(divided(a - remainder_of(a, b, bad), b, bad) + 0.5);
}

RC_HD double power(double a, double b, bool& bad) {
    bad = bad || (a == 0.0 && b < 0.0);
    return valid(pow(a, b), bad);
}

RC_HD double lesser(double a, double b) {
    return b < a ? b : a;
}
RC_HD double greater(double a, double b) {
    return b > a ? b : a;
}

RC_HD Pair waypoint(const Waypoints& line, double index, bool& bad) {
    const double place = index < 0.0 ? index + line.count : index;
    if (!(place >= 0.0 && place < line.count)) {
        bad = true;
        return {kNoNumber, kNoNumber};
    }
    const double* point = line.points + 2 * static_cast<int32_t>(place);
    return {point[0], point[1]};
}

RC_HD Waypoints line_of(const RewardTask& task, double track) {
    const int32_t* first = task.first_point + static_cast<int32_t>(track);
    return {task.points + 2 * first[0], static_cast<double>(first[1] - first[0])};
}

}  // namespace racecraft

#if defined(__CUDACC_RTC__)
#define RC_REWARD_KERNEL                                                                                 \
    extern "C" __global__ void pay_cars(const __grid_constant__ racecraft::RewardTask task, const void*, \
                                        const void*)
#define RC_EACH_ROW(i) \
    if (const int32_t i = static_cast<int32_t>(blockIdx.x * blockDim.x + threadIdx.x); i < task.count)
#else
#define RC_REWARD_KERNEL                                                                                 \
    static void pay_cars(const racecraft::RewardTask& task);                                             \
    extern "C" void run_pay_cars(int32_t, const racecraft::RewardTask* task, const void*, const void*) { \
        pay_cars(*task);                                                                                 \
    }                                                                                                    \
    static void pay_cars(const racecraft::RewardTask& task)
#define RC_EACH_ROW(i) for (int32_t i = 0; i < task.count; ++i)
#endif
