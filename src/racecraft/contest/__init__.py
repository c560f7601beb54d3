"""Several drivers against each other: contests, who is ahead, ladders and ratings."""

from racecraft.contest.standings import RANKINGS, places, ranking_score

__all__ = ["RANKINGS", "places", "ranking_score"]
