"""Several drivers against each other: contests, who is ahead, ladders and ratings."""

from racecraft.contest.standings import RANKINGS, Key, median_score, places, ranking_key, ranking_score

__all__ = ["RANKINGS", "Key", "median_score", "places", "ranking_key", "ranking_score"]
