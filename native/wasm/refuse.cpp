// A refusal becomes an exception of JavaScript's, which leaves this module's frames without unwinding them:
// the caller puts the stack pointer back (web/src/tab/module.ts); what was being built is lost memory.
#include "refuse.hpp"

#include <cstddef>

namespace racecraft {

extern "C" [[clang::import_module("racecraft"), clang::import_name("refuse"), noreturn]] void
throw_in_javascript(const char* text, size_t size);

void refuse(const std::string& message) {
    throw_in_javascript(message.data(), message.size());
}

}  // namespace racecraft
