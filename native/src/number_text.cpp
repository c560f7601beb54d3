#include "number_text.hpp"

#include <charconv>
#include <cmath>
#include <cstring>

namespace racecraft {
namespace {

size_t copy(const char* text, char* out) {
    const size_t length = std::strlen(text);
    std::memcpy(out, text, length);
    return length;
}

}  // namespace

size_t write_number(double value, char* out) {
    if (std::isnan(value)) return copy("nan", out);
    if (std::isinf(value)) return copy(value < 0 ? "-inf" : "inf", out);
    char scientific[kMaxNumberText];  // "-d.ddde-xx", the fewest digits that read back as the same double
    const char* end =
        std::to_chars(scientific, scientific + kMaxNumberText, value, std::chars_format::scientific).ptr;
    char* at = out;
    const char* from = scientific;
    if (*from == '-') *at++ = *from++;
    const char* mark = static_cast<const char*>(std::memchr(from, 'e', static_cast<size_t>(end - from)));
    int exponent = 0;
    std::from_chars(mark[1] == '+' ? mark + 2 : mark + 1, end, exponent);
    if (exponent < -4 || exponent >= 16) {  // Python writes such numbers with their exponent, too
        std::memcpy(at, from, static_cast<size_t>(end - from));
        return static_cast<size_t>(at - out) + static_cast<size_t>(end - from);
    }
    char digits[kMaxNumberText];
    int count = 0;
    for (const char* c = from; c != mark; ++c)
        if (*c != '.') digits[count++] = *c;
    if (exponent < 0) {
        *at++ = '0';
        *at++ = '.';
        for (int i = exponent + 1; i < 0; ++i) *at++ = '0';
    }
    for (int i = 0; i < count; ++i) {
        *at++ = digits[i];
        if (i == exponent) *at++ = '.';
    }
    if (count <= exponent) {
        for (int i = count; i <= exponent; ++i) *at++ = '0';
        *at++ = '.';
    }
    if (exponent >= 0 && at[-1] == '.') *at++ = '0';
    return static_cast<size_t>(at - out);
}

}  // namespace racecraft
