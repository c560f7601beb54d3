#include "dispatch.hpp"

#include <atomic>
#include <stdexcept>

namespace racecraft {
namespace {

bool can_run(Isa isa) {
#if defined(RC_HAVE_avx512)
    switch (isa) {
        case Isa::portable:
            return true;
        case Isa::avx2:
            return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
                   __builtin_cpu_supports("bmi2");
        case Isa::avx512:
            return can_run(Isa::avx2) && __builtin_cpu_supports("avx512f") &&
                   __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512dq") &&
                   __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512vnni");
    }
    return false;
#else
    return isa == Isa::portable;
#endif
}

std::atomic<Isa>& chosen() {
    static std::atomic<Isa> isa{available_isas().back()};
    return isa;
}

}  // namespace

std::vector<Isa> available_isas() {
    std::vector<Isa> isas;
    for (const Isa isa : {Isa::portable, Isa::avx2, Isa::avx512}) {
        if (can_run(isa)) isas.push_back(isa);
    }
    return isas;
}

Isa current_isa() {
    return chosen().load(std::memory_order_relaxed);
}

const char* isa_name(Isa isa) {
    switch (isa) {
        case Isa::portable:
            return "portable";
        case Isa::avx2:
            return "avx2";
        case Isa::avx512:
            return "avx512";
    }
    return "portable";
}

void set_isa(const std::string& name) {
    std::string allowed;
    for (const Isa isa : available_isas()) {
        if (name == isa_name(isa)) {
            chosen().store(isa, std::memory_order_relaxed);
            return;
        }
        allowed += std::string(allowed.empty() ? "'" : ", '") + isa_name(isa) + "'";
    }
    throw std::invalid_argument("Instruction set '" + name + "' cannot run here; choose one of " + allowed +
                                ".");
}

}  // namespace racecraft
