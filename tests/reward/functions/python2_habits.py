# -*- coding: utf-8 -*-
from __future__ import division
from __future__ import print_function

def reward_function (params) :
	lap = params["progress"] // 25          # quarter of the lap
	steps = params["steps"]
	keys = params.keys ()
	if "speed" in keys and not (steps % 10) :
		print ("quarter %d after %d steps" % (lap, steps))
	bonus = [1, 2, 4, 8, 16][max (0, min (4, int (lap)))]
	marks = map (lambda f : f * params["track_width"], (0.1, 0.25, 0.5))
	inside = filter (lambda m : params["distance_from_center"] <= m, marks)
	return bonus * len (list (inside)) / 3
