// The kernels that draw, a block for every frame.
#include "frame_of.hpp"
#include "frames.hpp"
#include "kernel.hpp"

using namespace racecraft;

// Ground, walls and sky of every frame whose car has changed.
RC_KERNEL(draw_frames, kImageThreads) {
    RC_SHARED DrawnFrame frame;
    RC_SHARED DrawnSample samples[kMostSamples];
    RC_SHARED DrawnRow rows[kMostSamples];
    const int32_t env = RC_BLOCK / batch.num_lenses;
    if (!batch.is_changed[env]) return;
    const CameraView& camera = camera_of(batch, env, RC_BLOCK % batch.num_lenses);
    const int32_t width = camera.spec.width;
    const int32_t height = camera.spec.height;
    uint8_t* out = frame_of(batch, RC_BLOCK);
    RC_EACH(only, 1) {
        frame.ground = ground_of(batch, env);
        frame.table = shade_table(batch.palettes[env]);
        frame.lens = lens_of(batch, env, camera, frame.ground);
        frame.sheen = sheen_share(camera, batch.colours.sheen, frame.lens);
        frame.num_walls = walls_in_view(frame.ground, frame.lens, frame.walls);
        frame.is_above_walls = camera.spec.above >= camera.spec.wall_height;
    }
    for (int32_t row = 0; row < height;) {
        const int32_t first = camera.row_begin[row];
        int32_t end = row + 1;
        while (end < height && camera.row_begin[end + 1] - first <= kMostSamples) ++end;
        RC_SYNC();
        RC_EACH(i, camera.row_begin[end] - first) samples[i] = draw_sample(camera, frame, first + i);
        RC_SYNC();
        RC_EACH(i, end - row) {
            rows[i] =
                draw_row(camera, frame, batch.palettes[env], batch.colours.sheen, samples, first, row + i);
        }
        RC_SYNC();
        const int32_t quads = (width + kQuad - 1) / kQuad;
        RC_EACH(i, (end - row) * quads) {
            const int32_t line = i / quads;
            const int32_t x = (i - line * quads) * kQuad;
            uint8_t* pixels = out + static_cast<size_t>(row + line) * static_cast<size_t>(width) + x;
            alignas(4) uint8_t quad[kQuad];
            draw_quad(frame, rows[line], samples, x, quad);
            if (width % kQuad == 0) {
                __builtin_memcpy(__builtin_assume_aligned(pixels, kQuad), quad, kQuad);
            } else {
                for (int32_t k = 0; k < kQuad && x + k < width; ++k) pixels[k] = quad[k];
            }
        }
        row = end;
    }
}

// Light and blur of an episode's conditions.
RC_KERNEL(expose_frames, kImageThreads) {
    const int32_t env = RC_BLOCK / batch.num_lenses;
    if (!batch.is_changed[env]) return;
    const Conditions& light = batch.conditions[env];
    const int32_t width = batch.lenses[0].spec.width;
    const int32_t height = batch.lenses[0].spec.height;
    uint8_t* out = frame_of(batch, RC_BLOCK);
    uint8_t* across = batch.blurred + static_cast<size_t>(RC_BLOCK) * static_cast<size_t>(batch.num_pixels);
    if (light.gradient_across != 0.0f || light.gradient_down != 0.0f) {
        RC_EACH(i, batch.num_pixels) {
            const int32_t row = i / width;
            out[i] = lit_pixel(out[i], light_at(i - row * width, width, light.gradient_across),
                               light_at(row, height, light.gradient_down));
        }
    }
    const BlurFilter filter = blur_filter(light.blur);
    for (int32_t pass = 0; pass < filter.passes; ++pass) {
        RC_SYNC();
        RC_EACH(i, batch.num_pixels) {
            const int32_t x = i % width;
            across[i] =
                blurred_pixel(out[x > 0 ? i - 1 : i], out[i], out[x + 1 < width ? i + 1 : i], filter.side);
        }
        RC_SYNC();
        RC_EACH(i, batch.num_pixels) {
            const uint8_t above = across[i >= width ? i - width : i];
            const uint8_t below = across[i + width < batch.num_pixels ? i + width : i];
            out[i] = blurred_pixel(above, across[i], below, filter.side);
        }
    }
}
