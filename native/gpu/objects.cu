// The kernel that draws boxes and cars; a program of its own, as it takes longest to compile.
#include "frame_of.hpp"
#include "kernel.hpp"
#include "racecraft/object_paint.hpp"

using namespace racecraft;

#if !defined(RC_IMAGE_WIDTH)
#define RC_IMAGE_WIDTH kMaxImageWidth
#endif

// Boxes and cars over them.
RC_KERNEL(draw_objects, kRowThreads) {
    const int32_t env = RC_BLOCK / batch.num_lenses;
    if (!batch.is_changed[env]) return;
    const CameraView& camera = camera_of(batch, env, RC_BLOCK % batch.num_lenses);
    uint8_t* out = frame_of(batch, RC_BLOCK);
    RC_EACH(row, camera.spec.height) {
        const LensPose lens = lens_of(batch, env, camera, ground_of(batch, env));
        paint_objects<RC_IMAGE_WIDTH>(camera.spec, lens, around(batch, env), row, row + 1, out);
    }
}
