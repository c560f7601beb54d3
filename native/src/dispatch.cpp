#include "dispatch.hpp"

#include <atomic>
#include <cstdint>

#include "refuse.hpp"

#if defined(__x86_64__)
#include <cpuid.h>
#endif

namespace racecraft {
namespace {

// Asked of the CPU and its operating system themselves: what a compiler's runtime knows of them was wrong
// with one. Bits as in Intel's manual, volume 2, CPUID; volume 1, section 14.3, on what the system must save
// of a thread.
Isa best_of_cpu() {
#if defined(__x86_64__)
    constexpr uint32_t kFma = 1u << 12, kSystemSaves = 1u << 27, kAvx = 1u << 28;  // leaf 1, ecx
    constexpr uint32_t kAvx2 = 1u << 5, kBmi2 = 1u << 8;                           // leaf 7, ebx
    constexpr uint32_t kAvx512 = 1u << 16 | 1u << 17 | 1u << 30 | 1u << 31;        // F, DQ, BW, VL
    constexpr uint32_t kVnni = 1u << 11;                                           // leaf 7, ecx
    constexpr uint32_t kVectors = 0x06, kWideVectors = 0xe6;                       // saved registers
    const auto has = [](uint32_t bits, uint32_t all) { return (bits & all) == all; };
    uint32_t eax = 0, ebx = 0, ecx = 0, edx = 0;
    if (!__get_cpuid_count(1, 0, &eax, &ebx, &ecx, &edx) || !has(ecx, kFma | kSystemSaves | kAvx))
        return Isa::portable;
    if (!__get_cpuid_count(7, 0, &eax, &ebx, &ecx, &edx) || !has(ebx, kAvx2 | kBmi2)) return Isa::portable;
    uint32_t saved = 0;
    __asm__("xgetbv" : "=a"(saved), "=d"(edx) : "c"(0));
    if (!has(saved, kVectors)) return Isa::portable;
    return has(saved, kWideVectors) && has(ebx, kAvx512) && has(ecx, kVnni) ? Isa::avx512 : Isa::avx2;
#else
    return Isa::portable;
#endif
}

bool is_built(Isa isa) {
#if defined(RC_HAVE_avx512)
    return isa <= Isa::avx512;
#else
    return isa == Isa::portable;
#endif
}

std::atomic<Isa>& chosen() {
    static std::atomic<Isa> isa{available_isas().back()};
    return isa;
}

}  // namespace

Isa best_isa() {
    static const Isa best = best_of_cpu();
    return best;
}

std::vector<Isa> available_isas() {
    std::vector<Isa> isas;
    for (const Isa isa : {Isa::portable, Isa::avx2, Isa::avx512}) {
        if (isa <= best_isa() && is_built(isa)) isas.push_back(isa);
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
    refuse("Instruction set '" + name + "' cannot run here; choose one of " + allowed + ".");
}

}  // namespace racecraft
