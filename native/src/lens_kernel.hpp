// What a real lens and its sensor make of a drawn picture (racecraft/lens.hpp).
#pragma once

#include "dispatch.hpp"
#include "racecraft/lens.hpp"

namespace racecraft {

// From `drawn` (height, width) into `frame`, another picture of that size. kDrawnMargin bytes before and
// behind what is drawn are read and mean nothing.
constexpr size_t kDrawnMargin = 128;

#define RC_DECLARE(isa)                                                                       \
    namespace isa {                                                                           \
    void take_picture(const CameraSpec& spec, const Conditions& conditions, const Shot& shot, \
                      const uint8_t* drawn, uint8_t* frame);                                  \
    }
RC_FOR_EACH_ISA(RC_DECLARE)
#undef RC_DECLARE

}  // namespace racecraft
