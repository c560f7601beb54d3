// Choice of instruction set at run time. Results are the same bits for every choice; only the speed differs.
#pragma once

#include <string>
#include <vector>

namespace racecraft {

enum class Isa { portable, avx2, avx512 };  // slowest first

// The one in force: the best this CPU has, or what set_isa() chose.
Isa current_isa();

// The best that this CPU could run, whether this build has it or not.
Isa best_isa();

// Those that this build and this CPU can run, slowest first.
std::vector<Isa> available_isas();

const char* isa_name(Isa isa);

// Throws std::invalid_argument for a name that cannot run here.
void set_isa(const std::string& name);

}  // namespace racecraft

// Calls FUNCTION of the namespace of the instruction set in force.
#if defined(RC_HAVE_avx512)
#define RC_DISPATCH(FUNCTION, ...)                                                                       \
    (::racecraft::current_isa() == ::racecraft::Isa::avx512 ? ::racecraft::avx512::FUNCTION(__VA_ARGS__) \
     : ::racecraft::current_isa() == ::racecraft::Isa::avx2 ? ::racecraft::avx2::FUNCTION(__VA_ARGS__)   \
                                                            : ::racecraft::portable::FUNCTION(__VA_ARGS__))
#define RC_FOR_EACH_ISA(X) X(portable) X(avx2) X(avx512)
#else
#define RC_DISPATCH(FUNCTION, ...) ::racecraft::portable::FUNCTION(__VA_ARGS__)
#define RC_FOR_EACH_ISA(X) X(portable)
#endif
