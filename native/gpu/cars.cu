// The kernels that move cars, a thread for each. Those of a frame follow in frames.cu.
//
//   step_cars, reset_cars, reset_finished, restore_cars  ->  draw_frames, draw_objects, expose_frames
//                                                        ->  scan_lidar
//
// `input` and `extra` are what the kernel's comment says; all other memory is in the batch.
#include "cars.hpp"
#include "kernel.hpp"

using namespace racecraft;

// input: actions (N, 2), steering angle in rad and speed in m/s.
RC_KERNEL(step_cars, kCarThreads) {
    const float* actions = static_cast<const float*>(input);
    RC_EACH_CAR(env) step_car(batch, env, actions[2 * env], actions[2 * env + 1]);
}

// input: mask (N,), one byte each; extra: seeds (N,) uint64, or null.
RC_KERNEL(reset_cars, kCarThreads) {
    const uint8_t* mask = static_cast<const uint8_t*>(input);
    const uint64_t* seeds = static_cast<const uint64_t*>(extra);
    RC_EACH_CAR(env) {
        if (mask[env] == 0) continue;
        if (seeds != nullptr) {
            batch.seeds[env] = seeds[env];
            batch.streams[env] = 0;
            batch.episodes[env].episode = -1;
        }
        begin_episode(batch, env);
    }
}

// Cars whose episode is over begin the next.
RC_KERNEL(reset_finished, kCarThreads) {
    RC_EACH_CAR(env) {
        if (batch.terminated[env] || batch.truncated[env]) begin_episode(batch, env);
    }
}

// After a batch was loaded: what follows from the arrays that are saved.
RC_KERNEL(restore_cars, kCarThreads) {
    RC_EACH_CAR(env) restore_car(batch, env);
}

// One ray a thread.
RC_KERNEL(scan_lidar, kLidarRays) {
    const int32_t env = RC_BLOCK;
    if (!batch.is_changed[env]) return;
    const Episode& episode = batch.episodes[env];
    const VehicleState car = load_vehicle(batch, env);
    const LidarPose pose{car.x, car.y, episode.sine, episode.cosine, batch.seeds[env], batch.streams[env],
                         static_cast<uint32_t>(episode.episode),
                         // As the engine does, which looks before it counts the prepare step.
                         static_cast<uint32_t>(episode.steps == 1 ? 0 : episode.steps)};
    RC_EACH(ray, kLidarRays) {
        batch.lidar[static_cast<size_t>(env) * kLidarRays + static_cast<size_t>(ray)] =
            measure_ray(track_of(batch, env).room, pose, around(batch, env), ray);
    }
}
