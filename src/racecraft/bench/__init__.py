"""`racecraft bench`: speed on this machine, with the machine's limit beside each figure.

racecraft bench --only simulator --json
"""

from racecraft.bench.report import table
from racecraft.bench.suite import BENCHMARKS, run_benchmarks

__all__ = ["BENCHMARKS", "run_benchmarks", "table"]
