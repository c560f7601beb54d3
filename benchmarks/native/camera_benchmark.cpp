// Time per driver's frame on one thread, per instruction set, and per chase picture.
//
//   cmake -S . -B build/native && cmake --build build/native --target camera_benchmark &&
//   build/native/camera_benchmark
//
// The cars stand all over a wobbly circuit of 20 m and look in all directions around its own; each figure is
// the best of many short runs, because other work on the machine only ever adds time.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>

#include "../../native/src/camera_model.hpp"
#include "../../native/src/dispatch.hpp"
#include "../../native/src/scene.hpp"
#include "../../native/tests/tracks.hpp"

namespace {

using namespace racecraft;

template <typename Work>
double best_seconds(int runs, const Work& work) {
    double best = 1e9;
    for (int run = 0; run < runs; ++run) {
        const auto start = std::chrono::steady_clock::now();
        work();
        best =
            std::min(best, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    }
    return best;
}

}  // namespace

int main() {
    const test::Outline road = test::circuit();
    const double build = best_seconds(5, [&] { GroundMap(road.view()); });
    const GroundMap ground(road.view());
    const CameraModel camera(CameraSpec{});
    const GreyPalette palette = grey_palette(kPalette2018);
    std::vector<uint8_t> pixels(160 * 120);
    std::printf("ground map: %.1f ms, %.1f MB, texel %.0f mm\n", 1e3 * build,
                static_cast<double>(ground.num_bytes()) / 1e6,
                1e3 * static_cast<double>(ground.view().texel));

    constexpr int kFrames = 100;
    for (const Isa isa : available_isas()) {
        set_isa(isa_name(isa));
        const double seconds = best_seconds(isa == Isa::portable ? 20 : 200, [&] {
            for (int i = 0; i < kFrames; ++i) {
                const size_t k = static_cast<size_t>(i * 7) % (road.num_waypoints() - 1);
                const double* p = &road.center[2 * k];
                const double heading = std::atan2(p[3] - p[1], p[2] - p[0]) + 0.06 * (i % 11 - 5);
                render_grey(camera, ground, palette, {}, static_cast<float>(p[0]), static_cast<float>(p[1]),
                            static_cast<float>(heading), pixels.data());
            }
        });
        std::printf("driver 160x120, %-8s: %6.2f us, %7.0f frames/s\n", isa_name(isa),
                    1e6 * seconds / kFrames, kFrames / seconds);
    }

    std::vector<uint8_t> colour(640 * 480 * 3);
    const CameraModel chase(chase_camera(640, 480));
    const CarPicture car = {4.0f, -2.0f, 1.6f, 0.2f, {220, 40, 30}, 1.0f};
    const double seconds = best_seconds(20, [&] {
        render_rgb(chase, ground, kPalette2018, car.x, car.y, car.heading, &car, 1, nullptr, colour.data());
    });
    std::printf("chase 640x480 with its car: %.2f ms\n", 1e3 * seconds);
    return 0;
}
