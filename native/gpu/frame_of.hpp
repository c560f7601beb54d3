// Which frame a block draws, and from where.
#pragma once

#include "cars.hpp"

namespace racecraft {

// The frame of this block, car by car and lens by lens.
RC_HD uint8_t* frame_of(const Batch& batch, int32_t block) {
    return batch.frames + static_cast<size_t>(block) * static_cast<size_t>(batch.num_pixels);
}

RC_HD const CameraView& camera_of(const Batch& batch, int32_t env, int32_t lens) {
    return batch.has_cameras && lens == 0 ? batch.cameras[env] : batch.lenses[lens];
}

RC_HD const GroundView& ground_of(const Batch& batch, int32_t env) {
    return batch.grounds[batch.episodes[env].track % batch.num_tracks];
}

RC_HD LensPose lens_of(const Batch& batch, int32_t env, const CameraView& camera, const GroundView& ground) {
    const Sight from = sight_of(batch, env);
    return place_lens(camera, ground, from.x, from.y, from.heading);
}

}  // namespace racecraft
