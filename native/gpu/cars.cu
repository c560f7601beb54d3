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
    DriveOnDevice device{batch};
    RC_EACH_CAR(env) {
        float steering, speed, is_moving;
        const Commands commands{&steering, &speed, &is_moving, env};
        step_races(batch, env, env + 1, static_cast<const float*>(input), commands, device);
    }
}

// input: mask (N,), one byte each; extra: seeds (N,) uint64, or null.
RC_KERNEL(reset_cars, kCarThreads) {
    DriveOnDevice device{batch};
    const uint8_t* mask = static_cast<const uint8_t*>(input);
    const uint64_t* seeds = static_cast<const uint64_t*>(extra);
    RC_EACH_CAR(env) {
        if (mask[env] == 0) continue;
        if (seeds != nullptr) reseed(batch, env, seeds[env]);
        begin_race(batch, env, 1, device);
    }
}

// Cars whose episode is over begin the next.
RC_KERNEL(reset_finished, kCarThreads) {
    DriveOnDevice device{batch};
    RC_EACH_CAR(env) {
        if (is_over(batch, env)) begin_race(batch, env, 1, device);
    }
}

// After a batch was loaded: what follows from the arrays that are saved.
RC_KERNEL(restore_cars, kCarThreads) {
    DriveOnDevice device{batch};
    RC_EACH_CAR(env) restore_car(batch, env, device);
}

// One ray a thread.
RC_KERNEL(scan_lidar, kLidarRays) {
    const int32_t env = RC_BLOCK;
    if (!batch.is_changed[env]) return;
    const LidarPose pose = lidar_pose_of(batch, env);
    RC_EACH(ray, kLidarRays) {
        batch.lidar[static_cast<size_t>(env) * kLidarRays + static_cast<size_t>(ray)] =
            measure_ray(track_of(batch, env).room, pose, around(batch, env), ray);
    }
}
