// The car: a dynamic single-track model with saturating tyres, a friction circle, limited drive and brake forces and
// a lagging steering actuator.
//
//        front axle            One tyre per axle. Each tyre's lateral force follows its slip (sideways over forward
//      \  lf   | lr            speed) linearly at first and saturates at what friction leaves beside the drive force:
//       \------o------|   --> x
//      steer  origin  rear     F = -capacity * s / sqrt(1 + s^2),  s = stiffness * load * slip / capacity
//
// Below `slip_speed` the slip's denominator is held constant, which turns the tyre into a viscous one: no division by
// zero, no singularity at standstill, and a standing car with turned wheels feels no force.
// Integrated with classic Runge-Kutta of order 4 over fixed substeps; everything is branch-free, so a loop over cars
// becomes vector code with the same bits.
#pragma once

#include "racecraft/math.hpp"

namespace racecraft {

constexpr float kControlDt = 1.0f / 15.0f;       // seconds per control step: one camera image at 15 Hz
constexpr float kGravity = 9.8f;                 // m/s^2, as in the original's physics settings
constexpr float kMaxSteering = 0.523598776f;     // rad, 30 degrees: hard clip of the steering command
constexpr float kMinSpeedCommand = 0.1f;         // m/s; a command of exactly 0 (stop) is allowed below it
constexpr float kMaxSpeedCommand = 4.0f;         // m/s

// One value per car, so that every parameter can be randomised. Column order of Engine's parameter block.
#define RC_VEHICLE_PARAMETERS(X)                                                                            \
    X(mass)                  /* kg */                                                                       \
    X(yaw_inertia)           /* kg m^2 */                                                                   \
    X(front_axle)            /* m, car origin to the effective front axle */                                \
    X(rear_axle)             /* m, car origin to the effective rear axle */                                 \
    X(friction)              /* tyre force limit over load, 1 */                                            \
    X(front_stiffness)       /* lateral tyre force over load per unit of slip, 1 */                         \
    X(rear_stiffness)        /* the same at the rear */                                                     \
    X(slip_speed)            /* m/s below which slip turns viscous */                                       \
    X(drive_acceleration)    /* m/s^2, limit of the drive force over mass */                                \
    X(brake_acceleration)    /* m/s^2, limit of the brake force over mass, positive */                      \
    X(speed_time_constant)   /* s, of the speed controller */                                               \
    X(steering_time_constant) /* s, of the steering actuator */                                             \
    X(steering_rate)         /* rad/s, limit of the steering actuator */                                    \
    X(steering_bias)         /* rad, added to the steering command */                                       \
    X(speed_gain)            /* speed reached over speed commanded, 1 */

struct VehicleParameters {
#define RC_FIELD(name) float name;
    RC_VEHICLE_PARAMETERS(RC_FIELD)
#undef RC_FIELD
};

enum VehicleParameterIndex : int {
#define RC_INDEX(name) kVehicle_##name,
    RC_VEHICLE_PARAMETERS(RC_INDEX)
#undef RC_INDEX
        kNumVehicleParameters
};
static_assert(sizeof(VehicleParameters) == sizeof(float) * kNumVehicleParameters);

struct VehicleState {
    float x;              // m, car origin in the world
    float y;              // m
    float heading;        // rad, counter-clockwise from +x
    float speed;          // m/s, forward, never negative
    float lateral_speed;  // m/s, to the left
    float yaw_rate;       // rad/s
    float steering;       // rad, where the wheels really point
};

struct VehicleRates {
    float x, y, heading, speed, lateral_speed, yaw_rate, steering;
};

RC_HD float tyre_force(float stiffness, float load, float capacity, float sideways, float forward, float slip_speed) {
    const float slip = sideways / max_of(forward, slip_speed);
    const float s = stiffness * load * slip / capacity;
    return -capacity * s / sqrt_of(1.0f + s * s);
}

RC_HD VehicleRates vehicle_rates(const VehicleParameters& p, const VehicleState& state, float steering_command,
                                 float speed_command) {
    VehicleRates rates;
    float sin_heading, cos_heading, sin_steering, cos_steering;
    sincos_of(state.heading, sin_heading, cos_heading);
    sincos_of(state.steering, sin_steering, cos_steering);

    // What the motors ask for, shared by both axles according to their load.
    const float drive = clamp((speed_command * p.speed_gain - state.speed) / p.speed_time_constant,
                              -p.brake_acceleration, p.drive_acceleration);
    const float limit = p.friction * kGravity;
    const float acceleration = clamp(drive, -limit, limit);

    const float wheelbase = p.front_axle + p.rear_axle;
    const float front_load = p.mass * kGravity * p.rear_axle / wheelbase;
    const float rear_load = p.mass * kGravity * p.front_axle / wheelbase;
    const float share = acceleration / limit;
    // The friction circle, never quite empty so that the tyre law stays finite.
    const float grip = p.friction * sqrt_of(max_of(1.0f - share * share, 0.01f));

    const float front_sideways_body = state.lateral_speed + p.front_axle * state.yaw_rate;
    const float front_forward = state.speed * cos_steering + front_sideways_body * sin_steering;
    const float front_sideways = front_sideways_body * cos_steering - state.speed * sin_steering;
    const float rear_sideways = state.lateral_speed - p.rear_axle * state.yaw_rate;
    const float front_lateral =
        tyre_force(p.front_stiffness, front_load, front_load * grip, front_sideways, front_forward, p.slip_speed);
    const float rear_lateral =
        tyre_force(p.rear_stiffness, rear_load, rear_load * grip, rear_sideways, state.speed, p.slip_speed);
    const float front_drive = front_load / kGravity * acceleration;
    const float rear_drive = rear_load / kGravity * acceleration;

    const float front_x = front_drive * cos_steering - front_lateral * sin_steering;
    const float front_y = front_drive * sin_steering + front_lateral * cos_steering;
    rates.x = state.speed * cos_heading - state.lateral_speed * sin_heading;
    rates.y = state.speed * sin_heading + state.lateral_speed * cos_heading;
    rates.heading = state.yaw_rate;
    rates.speed = (front_x + rear_drive) / p.mass + state.yaw_rate * state.lateral_speed;
    rates.lateral_speed = (front_y + rear_lateral) / p.mass - state.yaw_rate * state.speed;
    rates.yaw_rate = (p.front_axle * front_y - p.rear_axle * rear_lateral) / p.yaw_inertia;
    rates.steering = clamp((steering_command + p.steering_bias - state.steering) / p.steering_time_constant,
                           -p.steering_rate, p.steering_rate);
    return rates;
}

RC_HD VehicleState vehicle_advance(const VehicleState& state, const VehicleRates& rates, float dt) {
    VehicleState next;
    next.x = state.x + dt * rates.x;
    next.y = state.y + dt * rates.y;
    next.heading = state.heading + dt * rates.heading;
    next.speed = state.speed + dt * rates.speed;
    next.lateral_speed = state.lateral_speed + dt * rates.lateral_speed;
    next.yaw_rate = state.yaw_rate + dt * rates.yaw_rate;
    next.steering = state.steering + dt * rates.steering;
    return next;
}

// One physics substep of sim_dt seconds.
RC_HD VehicleState vehicle_substep(const VehicleParameters& p, const VehicleState& state, float steering_command,
                                   float speed_command, float sim_dt) {
    const VehicleRates k1 = vehicle_rates(p, state, steering_command, speed_command);
    const VehicleRates k2 =
        vehicle_rates(p, vehicle_advance(state, k1, 0.5f * sim_dt), steering_command, speed_command);
    const VehicleRates k3 =
        vehicle_rates(p, vehicle_advance(state, k2, 0.5f * sim_dt), steering_command, speed_command);
    const VehicleRates k4 = vehicle_rates(p, vehicle_advance(state, k3, sim_dt), steering_command, speed_command);

    VehicleRates mean;
    mean.x = (k1.x + 2.0f * k2.x + 2.0f * k3.x + k4.x) * (1.0f / 6.0f);
    mean.y = (k1.y + 2.0f * k2.y + 2.0f * k3.y + k4.y) * (1.0f / 6.0f);
    mean.heading = (k1.heading + 2.0f * k2.heading + 2.0f * k3.heading + k4.heading) * (1.0f / 6.0f);
    mean.speed = (k1.speed + 2.0f * k2.speed + 2.0f * k3.speed + k4.speed) * (1.0f / 6.0f);
    mean.lateral_speed =
        (k1.lateral_speed + 2.0f * k2.lateral_speed + 2.0f * k3.lateral_speed + k4.lateral_speed) * (1.0f / 6.0f);
    mean.yaw_rate = (k1.yaw_rate + 2.0f * k2.yaw_rate + 2.0f * k3.yaw_rate + k4.yaw_rate) * (1.0f / 6.0f);
    mean.steering = (k1.steering + 2.0f * k2.steering + 2.0f * k3.steering + k4.steering) * (1.0f / 6.0f);

    VehicleState next = vehicle_advance(state, mean, sim_dt);
    next.heading = wrap_angle(next.heading);
    next.speed = max_of(next.speed, 0.0f);  // brakes stop the car, they do not push it backwards
    return next;
}

}  // namespace racecraft
