"""The command line: verbs only. Each one reads its options, calls the layer that does the work, and prints.

    racecraft train --until "5 laps"
    racecraft evaluate runs/NAME --laps 3

A file holds the verbs of one subject. Everything heavy is imported inside the verbs, so that ``--help`` is instant;
what people read is in `text`.
"""

from __future__ import annotations

import sys

__all__ = ["main"]


def main() -> None:
    """Run the command line, see `racecraft.cli.entry.main`; Ctrl-C while it is being imported ends it quietly, too."""
    try:
        from racecraft.cli import entry  # a tenth of a second, in which somebody may think better of it
    except KeyboardInterrupt:
        sys.exit(130)  # as of every later one
    entry.main()
