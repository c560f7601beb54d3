// How wide the road is beside every place of the centre line, in closed form.
#pragma once

#include <vector>

#include "racecraft/track.hpp"

namespace racecraft {

// A border as edges: x0, y0, x1, y1 of each.
using Edges = std::vector<double>;

// The pieces of one segment of the centre line, in order; the last one has no end.
std::vector<WidthPiece> width_pieces(const Segment& segment, const Edges& inner, const Edges& outer);

}  // namespace racecraft
