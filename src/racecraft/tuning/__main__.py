"""``python -m racecraft.tuning``: makes the trials that a search gives it, see `racecraft.tuning.seats`."""

from racecraft.tuning.seats import serve_seat

serve_seat()
