// The inner loops of the renderer, compiled once per instruction set.
#pragma once

#include "dispatch.hpp"
#include "racecraft/camera.hpp"

namespace racecraft {

// Ground, walls and sky as seen from the lens, one channel per palette, into out (height, width,
// num_channels).
#define RC_DECLARE(isa)                                                                               \
    namespace isa {                                                                                   \
    void render_room(const CameraView& camera, const GroundView& ground, const GreyPalette* palettes, \
                     const Sheen& sheen, int num_channels, const LensPose& lens, uint8_t* out);       \
    }
RC_FOR_EACH_ISA(RC_DECLARE)
#undef RC_DECLARE

}  // namespace racecraft
