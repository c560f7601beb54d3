// What happens to a finished frame on its way through lens and sensor.
#pragma once

#include <cstdint>

#include "dispatch.hpp"

namespace racecraft {

constexpr int kMaxExposedWidth = 4096;  // pixels

// Changes a frame (height, width) in place: uneven light, then blur.
//
// gradient_across, gradient_down: change of the light from the middle to the right and lower edge, -0.9 to
// 0.9. blur: standard deviation in pixels; made of small binomial-like filters, 1 per 2/3 px^2 of variance.
#define RC_DECLARE(isa)                                                                            \
    namespace isa {                                                                                \
    void expose(uint8_t* frame, int width, int height, float gradient_across, float gradient_down, \
                float blur);                                                                       \
    }
RC_FOR_EACH_ISA(RC_DECLARE)
#undef RC_DECLARE

}  // namespace racecraft
