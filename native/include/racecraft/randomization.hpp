// Domain randomisation: every episode of a car has its own friction, light, camera pose, ..., each drawn
// evenly from its range.
//
// The draws are a function of (seed, car, episode, quantity), so that neither the size of the batch nor
// another quantity's range changes them. A range that is a single point costs nothing and changes no bit.
#pragma once

#include "racecraft/camera.hpp"
#include "racecraft/palette.hpp"
#include "racecraft/random.hpp"
#include "racecraft/vehicle.hpp"

namespace racecraft {

// What an episode has one value of, in the order of their random words: new ones go to the end.
#define RC_CONDITIONS(X)                                                                                  \
    X(friction)        /* factor on the tyres' friction, 1 */                                             \
    X(mass)            /* factor on mass and inertia; motors and brakes stay as strong as they are */     \
    X(speed_gain)      /* factor on the speed reached, 1 */                                               \
    X(steering_bias)   /* rad, added */                                                                   \
    X(latency)         /* control steps before a command acts, 0 to kMaxLatency */                        \
    X(camera_pitch)    /* rad, added */                                                                   \
    X(camera_yaw)      /* rad, to the left */                                                             \
    X(camera_height)   /* m, added */                                                                     \
    X(camera_left)     /* m, added */                                                                     \
    X(camera_forward)  /* m, added */                                                                     \
    X(camera_fov)      /* rad, added to the horizontal field of view */                                   \
    X(light)           /* factor on every brightness, 1 */                                                \
    X(black_level)     /* added to every brightness, 1 is white */                                        \
    X(gradient_across) /* change of the light from the picture's middle to its right edge, 1 */           \
    X(gradient_down)   /* change of the light from the picture's middle to its lower edge, 1 */           \
    X(blur)            /* pixels, standard deviation */                                                   \
    X(pale_dashes)     /* share of the edge lines' colour in the dashes */                                \
    X(pale_walls)      /* share of white in the walls */                                                  \
    X(wall_height)     /* m, added */                                                                     \
    X(crowd)           /* contrast of what hangs on the walls and stands behind them */                   \
    X(sheen)           /* a lamp's reflection in the floor at its brightest, 1 is white */                \
    X(folds)           /* light on one side of a fold in the floor, shade on the other, 1 is white */     \
    X(vignette)        /* light lost a half of the picture away from the lens's middle, across or down */ \
    X(vignette_across) /* where that middle is, halves of the picture to the right */                     \
    X(vignette_down)   /* and down */                                                                     \
    X(defocus)         /* pixels of a box */                                                              \
    X(shutter)         /* s that a picture takes: a car that turns smears it */                           \
    X(shake)           /* rad, standard deviation of the lens from picture to picture */                  \
    X(noise)           /* standard deviation, 1 is white */                                               \
    X(strength)        /* share of all this that the episode has, 0 none to 1 all; drawn beyond, the end */

enum ConditionIndex : int {
#define RC_INDEX(name) kCondition_##name,
    RC_CONDITIONS(RC_INDEX)
#undef RC_INDEX
        kNumConditions
};

constexpr int kMaxLatency = 2;  // control steps

struct Conditions {
#define RC_FIELD(name) float name;
    RC_CONDITIONS(RC_FIELD)
#undef RC_FIELD
};
static_assert(sizeof(Conditions) == sizeof(float) * kNumConditions);

struct Range {
    float low, high;
};

struct Randomization {
    Range conditions[kNumConditions];
    Range tint;    // factor on the light's red, green and blue, drawn for each
    Range colour;  // added to every colour's brightness, drawn for each; 1 is white

    // Whether pictures are taken by a real lens (lens.hpp), in a real hall (surroundings.hpp).
    bool has_lens() const { return is_any(kCondition_crowd, kCondition_noise); }
    bool has_latency() const { return conditions[kCondition_latency].high > 0.0f; }
    bool has_cameras() const {
        return is_any(kCondition_camera_pitch, kCondition_camera_fov) ||
               is_any(kCondition_wall_height, kCondition_wall_height);
    }

    // Whether any of the quantities first..last, which are 0 where they change nothing, may differ from it.
    bool is_any(int first, int last) const {
        for (int i = first; i <= last; ++i) {
            if (conditions[i].low != 0.0f || conditions[i].high != 0.0f) return true;
        }
        return false;
    }
};

RC_HD float draw(const Range& range, uint32_t word) {
    return range.low + (range.high - range.low) * uniform_of(word);
}

// What was drawn, but only a share of its way from what changes nothing. All of it changes no bit.
RC_HD float weakened(float drawn, float neutral, float strength) {
    return strength == 1.0f ? drawn : neutral + strength * (drawn - neutral);
}

RC_HD float neutral_of(int condition) {
    const bool is_factor = condition == kCondition_friction || condition == kCondition_mass ||
                           condition == kCondition_speed_gain || condition == kCondition_light;
    return is_factor ? 1.0f : 0.0f;
}

RC_HD Conditions draw_conditions(const Randomization& randomization, uint64_t seed, uint32_t car,
                                 uint32_t episode) {
    float values[kNumConditions];
    for (int32_t i = 0; i < kNumConditions; ++i) {
        const RandomBlock block =
            philox(seed, car, episode, static_cast<uint32_t>(i / 4), Purpose::conditions);
        values[i] = draw(randomization.conditions[i], block.words[i % 4]);
    }
    const float strength = clamp(values[kCondition_strength], 0.0f, 1.0f);
    for (int32_t i = 0; i < kCondition_strength; ++i) {
        values[i] = weakened(values[i], neutral_of(i), strength);
    }
    values[kCondition_strength] = strength;
#define RC_TAKE(name) values[kCondition_##name],
    return {RC_CONDITIONS(RC_TAKE)};
#undef RC_TAKE
}

RC_HD VehicleParameters vehicle_under(const Conditions& conditions, VehicleParameters car) {
    car.front_friction *= conditions.friction;
    car.rear_friction *= conditions.friction;
    car.mass *= conditions.mass;
    car.yaw_inertia *= conditions.mass;
    car.drive_acceleration /= conditions.mass;
    car.brake_acceleration /= conditions.mass;
    car.speed_gain *= conditions.speed_gain;
    car.steering_bias += conditions.steering_bias;
    return car;
}

RC_HD CameraSpec camera_under(const Conditions& conditions, CameraSpec camera) {
    camera.pitch += conditions.camera_pitch;
    camera.yaw += conditions.camera_yaw;
    camera.above += conditions.camera_height;
    camera.left += conditions.camera_left;
    camera.forward += conditions.camera_forward;
    camera.hfov += conditions.camera_fov;
    camera.wall_height += conditions.wall_height;
    return camera;
}

// The world's colours in an episode's light. Each has its own shift: dyes fade, carpets are laid anew.
RC_HD GreyPalette palette_under(const Conditions& conditions, const Randomization& randomization,
                                const RgbPalette& colours, uint64_t seed, uint32_t car, uint32_t episode) {
    const RandomBlock tints = philox(seed, car, episode, 0, Purpose::tint);
    float weights[3] = {0.2989f, 0.587f, 0.114f};
    for (int32_t c = 0; c < 3; ++c) {
        weights[c] *= weakened(draw(randomization.tint, tints.words[c]), 1.0f, conditions.strength);
    }
    uint32_t index = 0;
    const auto grey = [&](const uint8_t* rgb) {
        const RandomBlock block = philox(seed, car, episode, index / 4, Purpose::colours);
        const float drawn = draw(randomization.colour, block.words[index % 4]);
        const float shift = 255.0f * weakened(drawn, 0.0f, conditions.strength);
        ++index;
        const float seen = weights[0] * static_cast<float>(rgb[0]) + weights[1] * static_cast<float>(rgb[1]) +
                           weights[2] * static_cast<float>(rgb[2]);
        const float lit =
            conditions.light * max_of(seen + shift, 0.0f) + 255.0f * conditions.black_level + 0.5f;
        return static_cast<uint8_t>(clamp(lit, 0.0f, 255.0f));
    };
    GreyPalette palette{};
    constexpr uint8_t white[3] = {255, 255, 255};
    for (int32_t i = 0; i < kNumMaterials; ++i) {
        uint8_t rgb[3];
        const float share = i == kCenterLine ? conditions.pale_dashes : 0.0f;
        mix_colours(colours.ground[i], colours.ground[kEdgeLine], share, rgb);
        palette.ground[i] = grey(rgb);
    }
    for (int32_t i = 0; i < kNumWalls; ++i) {
        uint8_t rgb[3];
        mix_colours(colours.wall[i], white, conditions.pale_walls, rgb);
        palette.wall[i] = grey(rgb);
    }
    palette.sky = grey(colours.sky);
    palette.outside = grey(colours.outside);
    for (int32_t i = 0; i < kNumMaterials; ++i) palette.grain[i] = colours.grain[i];
    palette.crowd = static_cast<uint8_t>(clamp(255.0f * conditions.crowd, 0.0f, 255.0f) + 0.5f);
    if (palette.crowd > 0) {
        palette.hall = static_cast<uint8_t>(philox(seed, car, episode, 0, Purpose::hall).words[0] >> 24);
    }
    return palette;
}

}  // namespace racecraft
