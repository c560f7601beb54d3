"""The command line: verbs only. Each one reads its options, calls the layer that does the work, and prints.

    racecraft train --until "5 laps"
    racecraft evaluate runs/NAME --laps 3

A file holds the verbs of one subject. Everything heavy is imported inside the verbs, so that ``--help`` is instant;
what people read is in `text`.
"""

from racecraft.cli.entry import every_verb, main

__all__ = ["every_verb", "main"]
