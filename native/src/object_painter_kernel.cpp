#include "object_painter_kernel.hpp"

#include "racecraft/object_paint.hpp"

namespace racecraft::RC_ISA {

void draw_objects(const CameraSpec& spec, const LensPose& lens, const ObjectsAround& around, uint8_t* out) {
    paint_objects<kMaxImageWidth>(spec, lens, around, 0, spec.height, out);
}

}  // namespace racecraft::RC_ISA
