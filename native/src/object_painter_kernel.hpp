// Objects in a driver's grey frame, drawn over the room: convex solids, far to near, with exact coverage;
// compiled once per instruction set.
#pragma once

#include "camera_model.hpp"
#include "dispatch.hpp"
#include "racecraft/object_look.hpp"

namespace racecraft {

// Draws over `out` (height, width), which shows the room from the same lens. Objects are convex in plan and
// stand apart, so far to near is their right order; the room is convex, so no wall hides one. Allocates
// nothing.
#define RC_DECLARE(isa)                                                                          \
    namespace isa {                                                                              \
    void draw_objects(const CameraSpec& spec, const LensPose& lens, const ObjectsAround& around, \
                      uint8_t* out);                                                             \
    }
RC_FOR_EACH_ISA(RC_DECLARE)
#undef RC_DECLARE

}  // namespace racecraft
