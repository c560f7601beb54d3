// The car: four wheels that all turn at the commanded speed, as the original's four motors drive them, and
// that rub over the ground.
//
//    left  o--------------o        Across, one tyre law per axle: the force follows the slip (sideways over
//          |  lr     lf   |  -->   forward speed) linearly at first and saturates at what friction allows,
//          |------+-------|
//          |    origin    |        F = -friction * load * s / sqrt(1 + s^2)
//    right o--------------o        s = stiffness * slip / friction
//
//                                  Along, every wheel pulls the car towards the speed it turns at:
//                                  F = load * e / sqrt(1 + (e / limit)^2)
//                                  e = (target - forward) / time
//
// Neither takes from the other: the original's contacts are friction boxes, not circles. In a bend the inner
// wheels turn too fast for their way and the outer ones too slowly; this scrub turns the car back and is most
// of its understeer. Below `slip_speed` the slip's denominator is held constant, which turns the tyre into a
// viscous one: no division by zero, no singularity at standstill, and a standing car with turned wheels feels
// no force. Integrated with classic Runge-Kutta of order 4 over fixed substeps; everything is branch-free, so
// a loop over cars becomes vector code with the same bits.
#pragma once

#include "racecraft/math.hpp"

namespace racecraft {

constexpr float kControlDt = 1.0f / 15.0f;           // seconds per control step: one camera image at 15 Hz
constexpr float kGravity = 9.8f;                     // m/s^2, as in the original's physics settings
constexpr float kMaxSteering = 0.523598776f;         // rad, 30 degrees: no command turns the wheels further
constexpr float kMaxSteeringCommand = 0.785398163f;  // rad, 45 degrees: commands of 2018, which rows tell
constexpr float kMostSteering = 0.9f;                // rad, more than any command and bias turn the wheels
constexpr float kMinSpeedCommand = 0.1f;             // m/s; a command of exactly 0 (stop) is allowed below it
constexpr float kMaxSpeedCommand = 4.0f;             // m/s, no command drives the car faster
constexpr float kMostSpeedCommand = 12.0f;           // m/s, commands of 2019, which rows tell
// Drive and brakes give at most this many times what the slipperier axle gives across: a car that is pushed
// harder than it can be held gains speed sideways.
constexpr float kMaxDriveOverFriction = 3.0f;
// rad/s; a spin that substeps of 1/60 s still follow. Real cars stay below 10.
constexpr float kMaxYawRate = 60.0f;

// One value per car, so that every parameter can be randomised. Column order of Engine's parameter block.
#define RC_VEHICLE_PARAMETERS(X)                                                        \
    X(mass)                   /* kg */                                                  \
    X(yaw_inertia)            /* kg m^2 */                                              \
    X(front_axle)             /* m, car origin to the front axle */                     \
    X(rear_axle)              /* m, car origin to the rear axle */                      \
    X(half_track)             /* m, middle of an axle to its wheels */                  \
    X(front_load)             /* share of the weight on the front axle, 1 */            \
    X(front_friction)         /* lateral tyre force limit over load, 1 */               \
    X(rear_friction)          /* the same at the rear */                                \
    X(front_stiffness)        /* lateral tyre force over load per unit of slip, 1 */    \
    X(rear_stiffness)         /* the same at the rear */                                \
    X(slip_speed)             /* m/s below which slip turns viscous */                  \
    X(drive_acceleration)     /* m/s^2, limit of the drive force over mass */           \
    X(brake_acceleration)     /* m/s^2, limit of the brake force over mass, positive */ \
    X(speed_time_constant)    /* s, of the speed near its command */                    \
    X(steering_time_constant) /* s, of the steering actuator */                         \
    X(steering_rate)          /* rad/s, limit of the steering actuator */               \
    X(steering_bias)          /* rad, added to the steering command */                  \
    X(speed_gain)             /* speed reached over speed commanded, 1 */

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

// What the equations need of the parameters, once per control step: divisions are the dearest operations
// here.
#define RC_VEHICLE_CONSTANTS(X)                                                \
    X(front_axle)            /* m */                                           \
    X(rear_axle)             /* m */                                           \
    X(half_track)            /* m */                                           \
    X(front_load)            /* share of the weight, 1 */                      \
    X(rear_load)             /* 1 */                                           \
    X(front_friction)        /* 1 */                                           \
    X(rear_friction)         /* 1 */                                           \
    X(front_stiffness)       /* lateral force over load per unit of slip, 1 */ \
    X(rear_stiffness)        /* 1 */                                           \
    X(slip_speed)            /* m/s */                                         \
    X(inverse_drive_limit)   /* s^2/m */                                       \
    X(inverse_brake_limit)   /* s^2/m */                                       \
    X(inverse_speed_time)    /* 1/s */                                         \
    X(speed_gain)            /* 1 */                                           \
    X(inverse_steering_time) /* 1/s */                                         \
    X(steering_rate)         /* rad/s */                                       \
    X(steering_bias)         /* rad */                                         \
    X(mass_over_inertia)     /* 1/m^2 */

struct VehicleConstants {
#define RC_FIELD(name) float name;
    RC_VEHICLE_CONSTANTS(RC_FIELD)
#undef RC_FIELD
};

RC_HD VehicleConstants vehicle_constants(const VehicleParameters& p) {
    VehicleConstants c;
    const float most = kMaxDriveOverFriction * kGravity * min_of(p.front_friction, p.rear_friction);
    c.front_axle = p.front_axle;
    c.rear_axle = p.rear_axle;
    c.half_track = p.half_track;
    c.front_load = p.front_load;
    c.rear_load = 1.0f - p.front_load;
    c.front_friction = p.front_friction;
    c.rear_friction = p.rear_friction;
    c.front_stiffness = p.front_stiffness;
    c.rear_stiffness = p.rear_stiffness;
    c.slip_speed = p.slip_speed;
    c.inverse_drive_limit = 1.0f / min_of(p.drive_acceleration, most);
    c.inverse_brake_limit = 1.0f / min_of(p.brake_acceleration, most);
    c.inverse_speed_time = 1.0f / p.speed_time_constant;
    c.speed_gain = p.speed_gain;
    c.inverse_steering_time = 1.0f / p.steering_time_constant;
    c.steering_rate = p.steering_rate;
    c.steering_bias = p.steering_bias;
    c.mass_over_inertia = p.mass / p.yaw_inertia;
    return c;
}

// Lateral acceleration, m/s^2, that a tyre carrying the whole car would give: the law above with s multiplied
// out, so that one inverse root is all it takes.
RC_HD float tyre_acceleration(float stiffness, float friction, float sideways, float forward,
                              float slip_speed) {
    const float wanted = stiffness * sideways;
    const float available = friction * max_of(forward, slip_speed);
    return -(kGravity * friction) * wanted * inverse_sqrt_of(available * available + wanted * wanted);
}

// The same along, of a wheel that rolls at `forward` m/s.
RC_HD float drive_acceleration(const VehicleConstants& c, float target, float forward) {
    const float wanted = (target - forward) * c.inverse_speed_time;
    const float share = wanted * (wanted > 0.0f ? c.inverse_drive_limit : c.inverse_brake_limit);
    return wanted * inverse_sqrt_of(1.0f + share * share);
}

RC_HD VehicleRates vehicle_rates(const VehicleConstants& c, const VehicleState& state, float steering_command,
                                 float speed_command) {
    VehicleRates rates;
    float sin_heading, cos_heading, sin_steering, cos_steering;
    sincos_of(state.heading, sin_heading, cos_heading);
    small_sincos_of(clamp(state.steering, -kMostSteering, kMostSteering), sin_steering, cos_steering);

    const float front_sideways_body = state.lateral_speed + c.front_axle * state.yaw_rate;
    const float front_forward = state.speed * cos_steering + front_sideways_body * sin_steering;
    const float front_sideways = front_sideways_body * cos_steering - state.speed * sin_steering;
    const float rear_sideways = state.lateral_speed - c.rear_axle * state.yaw_rate;

    // Half of an axle's load on each of its wheels; right ones travel further in a left bend.
    const float target = speed_command * c.speed_gain;
    const float rear_scrub = c.half_track * state.yaw_rate;
    const float front_scrub = rear_scrub * cos_steering;
    const float front_left = drive_acceleration(c, target, front_forward - front_scrub);
    const float front_right = drive_acceleration(c, target, front_forward + front_scrub);
    const float rear_left = drive_acceleration(c, target, state.speed - rear_scrub);
    const float rear_right = drive_acceleration(c, target, state.speed + rear_scrub);
    const float front_half = 0.5f * c.front_load;
    const float rear_half = 0.5f * c.rear_load;
    const float front_along = front_half * (front_left + front_right);
    const float rear_along = rear_half * (rear_left + rear_right);
    const float scrub_moment = c.half_track * (front_half * cos_steering * (front_right - front_left) +
                                               rear_half * (rear_right - rear_left));
    const float front_across = c.front_load * tyre_acceleration(c.front_stiffness, c.front_friction,
                                                                front_sideways, front_forward, c.slip_speed);
    const float rear_across = c.rear_load * tyre_acceleration(c.rear_stiffness, c.rear_friction,
                                                              rear_sideways, state.speed, c.slip_speed);

    const float front_x = front_along * cos_steering - front_across * sin_steering;
    const float front_y = front_along * sin_steering + front_across * cos_steering;
    rates.x = state.speed * cos_heading - state.lateral_speed * sin_heading;
    rates.y = state.speed * sin_heading + state.lateral_speed * cos_heading;
    rates.heading = state.yaw_rate;
    rates.speed = front_x + rear_along + state.yaw_rate * state.lateral_speed;
    rates.lateral_speed = front_y + rear_across - state.yaw_rate * state.speed;
    rates.yaw_rate =
        (c.front_axle * front_y - c.rear_axle * rear_across + scrub_moment) * c.mass_over_inertia;
    rates.steering = clamp((steering_command + c.steering_bias - state.steering) * c.inverse_steering_time,
                           -c.steering_rate, c.steering_rate);
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

// The command that acts in a substep: this step's from substep `delay` on, before it the one of the step
// before, and another step earlier the one before that.
RC_HD float acting_command(int32_t substep, int32_t substeps, int32_t delay, float now, float before,
                           float earlier) {
    const bool acts = substep >= delay;
    const bool acts_before = substep >= delay - substeps;
    return acts ? now : (acts_before ? before : earlier);
}

// One physics substep of sim_dt seconds.
RC_HD VehicleState vehicle_substep(const VehicleConstants& c, const VehicleState& state,
                                   float steering_command, float speed_command, float sim_dt) {
    const VehicleRates k1 = vehicle_rates(c, state, steering_command, speed_command);
    const VehicleRates k2 =
        vehicle_rates(c, vehicle_advance(state, k1, 0.5f * sim_dt), steering_command, speed_command);
    const VehicleRates k3 =
        vehicle_rates(c, vehicle_advance(state, k2, 0.5f * sim_dt), steering_command, speed_command);
    const VehicleRates k4 =
        vehicle_rates(c, vehicle_advance(state, k3, sim_dt), steering_command, speed_command);

    VehicleRates mean;
    mean.x = (k1.x + 2.0f * k2.x + 2.0f * k3.x + k4.x) * (1.0f / 6.0f);
    mean.y = (k1.y + 2.0f * k2.y + 2.0f * k3.y + k4.y) * (1.0f / 6.0f);
    mean.heading = (k1.heading + 2.0f * k2.heading + 2.0f * k3.heading + k4.heading) * (1.0f / 6.0f);
    mean.speed = (k1.speed + 2.0f * k2.speed + 2.0f * k3.speed + k4.speed) * (1.0f / 6.0f);
    mean.lateral_speed =
        (k1.lateral_speed + 2.0f * k2.lateral_speed + 2.0f * k3.lateral_speed + k4.lateral_speed) *
        (1.0f / 6.0f);
    mean.yaw_rate = (k1.yaw_rate + 2.0f * k2.yaw_rate + 2.0f * k3.yaw_rate + k4.yaw_rate) * (1.0f / 6.0f);
    mean.steering = (k1.steering + 2.0f * k2.steering + 2.0f * k3.steering + k4.steering) * (1.0f / 6.0f);

    VehicleState next = vehicle_advance(state, mean, sim_dt);
    next.heading = wrap_angle(next.heading);
    next.yaw_rate = clamp(next.yaw_rate, -kMaxYawRate, kMaxYawRate);
    next.speed = max_of(next.speed, 0.0f);  // brakes stop the car, they do not push it backwards
    return next;
}

}  // namespace racecraft
