"""What the core's sources use of the standard library they include, themselves or by a header of ours.

A standard library includes more than it must, and less every few years: what compiles here by chance does not there.
"""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import pytest

NATIVE = Path(__file__).parents[2] / "native"
SOURCES = sorted(p for p in NATIVE.glob("*/**/*.[ch]pp") if "gpu" not in p.parts)
USES = {
    "algorithm": r"std::(?:\w*sort|clamp|copy\w*|count\w*|equal|fill\w*|find\w*|m(?:in|ax)\w*|all_of|any_of|none_of|"
    r"lower_bound|upper_bound|transform|reverse|remove_if|rotate|shuffle|nth_element)\(",
    "array": r"std::array<",
    "atomic": r"std::atomic\b",
    "bit": r"std::(?:bit_cast|popcount|countr_\w+|countl_\w+|bit_\w+|has_single_bit|endian)\b",
    "chrono": r"std::chrono",
    "cmath": r"std::(?:sqrt|a?sin|a?cos|a?tan2?|exp2?|log2?|pow|floor|ceil|round|l?rint|lround|isfinite|isnan|hypot|"
    r"fma|fmod|trunc|copysign|nextafter|remainder)\(",
    "condition_variable": r"std::condition_variable",
    "cstddef": r"std::(?:size_t|ptrdiff_t|byte)\b",
    "cstdint": r"\bu?int(?:8|16|32|64)_t\b",
    "cstdio": r"std::(?:printf|fprintf|snprintf|puts|FILE)\b",
    "cstdlib": r"std::(?:getenv|malloc|free|abort|exit|strto\w+|aligned_alloc)\b",
    "cstring": r"std::(?:mem\w+|str(?:cmp|len|ncmp))\(",
    "functional": r"std::function<",
    "limits": r"std::numeric_limits",
    "map": r"std::map<",
    "memory": r"std::(?:unique_ptr|shared_ptr|make_unique|make_shared)\b",
    "mutex": r"std::(?:mutex|lock_guard|unique_lock|scoped_lock|once_flag|call_once)\b",
    "numbers": r"std::numbers::",
    "new": r"std::align_val_t",
    "numeric": r"std::(?:iota|accumulate|inner_product)\(",
    "optional": r"std::optional\b",
    "random": r"std::(?:mt19937\w*|\w+_distribution)\b",
    "set": r"std::set<",
    "span": r"std::span\b",
    "stdexcept": r"std::(?:invalid_argument|runtime_error|logic_error|out_of_range|length_error|overflow_error)\b",
    "string": r"std::(?:string|to_string)\b",
    "string_view": r"std::string_view\b",
    "thread": r"std::j?thread\b",
    "tuple": r"std::(?:tuple|tie|apply)\b",
    "utility": r"std::(?:move|swap|exchange|forward|pair)\b",
    "vector": r"std::vector\b",
}


@cache
def included(path: Path) -> frozenset[str]:
    """The standard's headers that a source includes, itself or by headers of ours."""
    text = path.read_text()
    found = set(re.findall(r"^\s*#\s*include <(\w+)>", text, flags=re.MULTILINE))
    for name in re.findall(r'^\s*#\s*include "([\w./]+)"', text, flags=re.MULTILINE):
        places = [folder / name for folder in (path.parent, NATIVE / "include", NATIVE / "src")]
        found |= next((included(place.resolve()) for place in places if place.is_file()), frozenset())
    return frozenset(found)


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: str(path.relative_to(NATIVE)))
def test_what_is_used_is_included(path: Path) -> None:
    code = re.sub(r'//.*|"(?:[^"\\\n]|\\.)*"', "", path.read_text())
    used = {header for header, pattern in USES.items() if re.search(pattern, code)}
    assert sorted(used - included(path)) == []


def test_an_include_that_is_missing_is_seen(tmp_path: Path) -> None:
    (tmp_path / "shape.hpp").write_text("#include <vector>\n")
    (tmp_path / "use.cpp").write_text('#include "shape.hpp"\nstd::vector<int> all() { return std::clamp(1, 2, 3); }\n')
    with pytest.raises(AssertionError, match="algorithm"):
        test_what_is_used_is_included(tmp_path / "use.cpp")
