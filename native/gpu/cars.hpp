// What a GPU does in its own way of a race (racecraft/race.hpp): a thread drives a car, kernels of their own
// make its frame and its scan.
#pragma once

#include "racecraft/race.hpp"

namespace racecraft {

struct DriveOnDevice {
    const Batch& batch;

    void move(int32_t begin, int32_t end, const Commands& commands, int32_t first, int32_t last) {
        for (int32_t env = begin; env < end; ++env) {
            const int32_t i = env - commands.first;
            if (commands.is_moving[i] != 0.0f) {
                drive(env, commands.steering[i], commands.speed[i], first, last);
            }
        }
    }

    void aim(int32_t env) {
        if (!batch.has_cameras) return;
        const CameraSpec spec = camera_under(batch.conditions[env], batch.lenses[0].spec);
        uint8_t* block =
            batch.camera_tables + static_cast<size_t>(env) * static_cast<size_t>(batch.camera_bytes);
        batch.cameras[env] = fill_camera(spec, tables_in(block, spec.height));
    }

    void see(int32_t env) { batch.is_changed[env] = 1; }

    // Substeps [first, last) of a control step of physics.
    void drive(int32_t env, float steering, float speed, int32_t first, int32_t last) {
        const size_t n = static_cast<size_t>(batch.num_envs);
        const float* parameter = batch.parameters + env;
        const float sim_dt = kControlDt / static_cast<float>(batch.substeps);
#define RC_LOAD(name) parameter[kVehicle_##name * n],
        const VehicleConstants constants = vehicle_constants({RC_VEHICLE_PARAMETERS(RC_LOAD)});
#undef RC_LOAD
        int32_t delay = 0;
        float earlier[4] = {};
        if (batch.has_latency) {
            delay = batch.delay[env];
            for (size_t k = 0; k < 4; ++k) earlier[k] = batch.earlier[k * n + static_cast<size_t>(env)];
        }
        VehicleState car = load_vehicle(batch, env);
        for (int32_t substep = first; substep < last; ++substep) {
            car = vehicle_substep(
                constants, car,
                acting_command(substep, batch.substeps, delay, steering, earlier[0], earlier[2]),
                acting_command(substep, batch.substeps, delay, speed, earlier[1], earlier[3]), sim_dt);
        }
        store_vehicle(batch, env, car);
    }
};

}  // namespace racecraft
