// A test framework in a page: TEST(name) { CHECK(...); CHECK_EQUAL(a, b); CHECK_NEAR(a, b, tolerance); }
//
// Every *_test.cpp is a program of its own; it runs all of its tests (or those whose names hold its first
// argument, or with ~word those that do not hold the word), prints each failed check with its values, and
// returns 1 if there was one.
#pragma once

#include <cmath>
#include <cstdio>
#include <cstring>
#include <exception>
#include <sstream>
#include <string>
#include <vector>

namespace racecraft::test {

// Under a sanitizer or without optimisation every operation costs ten times as much and what is looked for is
// in each case alike: there, tests of thousands of cases take one of so many.
#if !defined(__OPTIMIZE__) || defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr int kStride = 17;
#else
constexpr int kStride = 1;
#endif
constexpr bool kEveryCase = kStride == 1;

struct Test {
    const char* name;
    void (*run)();
};

inline std::vector<Test>& tests() {
    static std::vector<Test> all;
    return all;
}

inline int& failures() {
    static int count = 0;
    return count;
}

struct Registration {
    Registration(const char* name, void (*run)()) { tests().push_back({name, run}); }
};

// Prints the first failures only: a wrong bit in a loop over a million values is one message, not a million.
inline void fail(const char* file, int line, const std::string& what) {
    if (++failures() <= 20) std::fprintf(stderr, "%s:%d: %s\n", file, line, what.c_str());
}

template <typename A, typename B>
void check_equal(const char* file, int line, const char* text, const A& a, const B& b) {
    if (a == b) return;
    std::ostringstream out;
    out.precision(17);
    out << text << ": " << a << " is not " << b;
    fail(file, line, out.str());
}

// NaN is near nothing.
inline void check_near(const char* file, int line, const char* text, double a, double b, double tolerance) {
    if (std::abs(a - b) <= tolerance) return;
    std::ostringstream out;
    out.precision(17);
    out << text << ": " << a << " is not within " << tolerance << " of " << b;
    fail(file, line, out.str());
}

// Bits, not values: tells -0 from 0 and finds a NaN equal to itself.
template <typename T>
bool same_bits(const T& a, const T& b) {
    return std::memcmp(&a, &b, sizeof(T)) == 0;
}

}  // namespace racecraft::test

#define TEST(name)                                                                        \
    static void test_##name();                                                            \
    static const ::racecraft::test::Registration registration_##name{#name, test_##name}; \
    static void test_##name()

#define CHECK(condition)  \
    ((condition) ? void() \
                 : ::racecraft::test::fail(__FILE__, __LINE__, std::string(#condition) + " is false"))
#define CHECK_EQUAL(a, b) ::racecraft::test::check_equal(__FILE__, __LINE__, #a " == " #b, a, b)
#define CHECK_NEAR(a, b, tolerance) \
    ::racecraft::test::check_near(__FILE__, __LINE__, #a " ~ " #b, a, b, tolerance)
#define CHECK_THROWS(expression, Exception)                                                                 \
    do {                                                                                                    \
        bool has_thrown = false;                                                                            \
        try {                                                                                               \
            (void)(expression);                                                                             \
        } catch (const Exception&) {                                                                        \
            has_thrown = true;                                                                              \
        }                                                                                                   \
        if (!has_thrown) ::racecraft::test::fail(__FILE__, __LINE__, #expression " throws no " #Exception); \
    } while (false)

int main(int argc, char** argv) {
    for (const auto& [name, run] : racecraft::test::tests()) {
        const bool is_without = argc > 1 && argv[1][0] == '~';
        if (argc > 1 && (std::strstr(name, argv[1] + is_without) == nullptr) != is_without) continue;
        const int before = racecraft::test::failures();
#if defined(__cpp_exceptions)
        try {
            run();
        } catch (const std::exception& error) {
            racecraft::test::fail(name, 0, std::string("exception: ") + error.what());
        }
#else
        run();
#endif
        std::printf("%s %s\n", racecraft::test::failures() == before ? "ok    " : "FAILED", name);
    }
    return racecraft::test::failures() == 0 ? 0 : 1;
}
