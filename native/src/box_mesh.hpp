// The look of an obstacle: a cardboard box, taped over its seam, of our own design.
#pragma once

#include "car_mesh.hpp"

namespace racecraft {

const std::vector<Triangle>& box_mesh();

}  // namespace racecraft
