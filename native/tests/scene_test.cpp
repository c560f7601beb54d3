// Colour frames for people: the same ground as the driver's, cars where they are, nothing where they are not.
#include "../src/scene.hpp"

#include "../src/dispatch.hpp"
#include "check.hpp"
#include "tracks.hpp"

namespace racecraft {
namespace {

std::vector<uint8_t> frame(const CameraModel& camera, const GroundMap& ground, float x, float y,
                           float heading, const std::vector<CarPicture>& cars) {
    std::vector<uint8_t> pixels(size_t(camera.spec().width) * camera.spec().height * 3);
    render_rgb(camera, ground, kPalette2018, x, y, heading, cars.data(), static_cast<int>(cars.size()),
               nullptr, pixels.data());
    return pixels;
}

CarPicture car_at(float x, float y, float heading) {
    return {x, y, heading, 0.2f, {220, 30, 20}, 1.0f, false};
}

// Mean position of the pixels that differ, and how many there are.
struct Change {
    double column = 0.0, row = 0.0, count = 0.0;
};

Change difference(const std::vector<uint8_t>& a, const std::vector<uint8_t>& b, int width) {
    Change change;
    for (size_t i = 0; i < a.size() / 3; ++i) {
        if (a[3 * i] == b[3 * i] && a[3 * i + 1] == b[3 * i + 1] && a[3 * i + 2] == b[3 * i + 2]) continue;
        change.count += 1.0;
        change.column += static_cast<double>(i % static_cast<size_t>(width));
        change.row += static_cast<double>(i / static_cast<size_t>(width));
    }
    if (change.count > 0.0) {
        change.column /= change.count;
        change.row /= change.count;
    }
    return change;
}

TEST(colour_and_grey_show_the_same) {
    const test::Outline road = test::circuit();
    const GroundMap ground(road.view());
    const CameraModel camera(CameraSpec{});
    std::vector<uint8_t> grey(160 * 120);
    const float x = static_cast<float>(road.center[40]);
    const float y = static_cast<float>(road.center[41]);
    render_grey(camera, ground, grey_palette(kPalette2018), {}, x, y, 2.0f, grey.data());
    const auto colour = frame(camera, ground, x, y, 2.0f, {});
    double sum = 0.0;
    for (size_t i = 0; i < grey.size(); ++i) sum += std::abs(grey[i] - grey_of(&colour[3 * i]));
    // Grey rows near the lens share a texel between two pixels, so that their grain is not quite the same.
    CHECK_NEAR(sum / static_cast<double>(grey.size()), 0.0, 0.6);
}

TEST(every_instruction_set_draws_the_same) {
    const test::Outline road = test::circuit();
    const GroundMap ground(road.view());
    const CameraModel camera(chase_camera(320, 240));
    std::vector<uint8_t> first;
    for (const Isa isa : available_isas()) {
        set_isa(isa_name(isa));
        const auto pixels = frame(camera, ground, 3.0f, -2.0f, 1.5f, {car_at(3.0f, -2.0f, 1.5f)});
        if (first.empty()) first = pixels;
        CHECK(pixels == first);
    }
}

TEST(chase_camera_has_its_car_in_the_middle) {
    const test::Outline road = test::circuit();
    const GroundMap ground(road.view());
    const CameraModel camera(chase_camera(320, 240));
    const auto empty = frame(camera, ground, 1.0f, -2.0f, 0.7f, {});
    const Change change =
        difference(empty, frame(camera, ground, 1.0f, -2.0f, 0.7f, {car_at(1.0f, -2.0f, 0.7f)}), 320);
    CHECK(change.count > 1000.0);
    CHECK_NEAR(change.column, 159.5, 4.0);
    // 1.5 m ahead, 1 m down less half a car: 33.7 degrees below the horizon, 15.7 below the axis.
    CHECK_NEAR(change.row, 119.5 + 252.4 * std::tan(0.588 - 0.31416), 12.0);
}

// From above: their front ends swing to the side to which they steer.
TEST(front_wheels_point_to_where_they_steer) {
    const test::Outline road = test::circuit();
    const GroundMap ground(road.view());
    CameraSpec above;
    above.above = 0.9f;
    above.pitch = 1.5707f;
    above.forward = 0.0f;
    const CameraModel camera(above);
    const auto picture = [&](float steering) {
        CarPicture car = car_at(1.0f, -2.0f, 0.0f);
        car.steering = steering;
        return frame(camera, ground, 1.0f, -2.0f, 0.0f, {car});
    };
    const double focal = 80.0 / std::tan(0.5 * above.hfov);
    const int hub = static_cast<int>(60.0 - focal * 0.08231 / 0.87);  // row of the front wheels' middle
    const auto straight = picture(0.0f);
    double swing[2] = {};  // of what is darker than with straight wheels, to the right
    for (const int side : {0, 1}) {
        const auto turned = picture(side == 0 ? 0.5f : -0.5f);
        for (int i = 0; i < 160 * hub; ++i) {
            const size_t at = 3 * static_cast<size_t>(i);
            swing[side] += (grey_of(&straight[at]) - grey_of(&turned[at])) * (i % 160 - 79.5);
        }
    }
    CHECK(swing[0] < 0.0 && swing[1] > 0.0);
}

TEST(top_down_camera_shows_the_whole_track) {
    for (const test::Outline& road : {test::circuit(), test::open_bend()}) {
        const GroundMap ground(road.view());
        const FixedCamera fixed = top_down_camera(ground, 320, 240);
        const CameraModel camera(fixed.spec);
        const auto empty = frame(camera, ground, fixed.x, fixed.y, fixed.heading, {});
        for (size_t i = 0; i + 1 < road.num_waypoints(); i += 5) {
            const CarPicture car = car_at(static_cast<float>(road.center[2 * i]),
                                          static_cast<float>(road.center[2 * i + 1]), 0.5f);
            const Change change =
                difference(empty, frame(camera, ground, fixed.x, fixed.y, fixed.heading, {car}), 320);
            CHECK(change.count > 20.0);
        }
    }
}

TEST(unseen_cars_change_nothing) {
    const test::Outline road = test::circuit();
    const GroundMap ground(road.view());
    const CameraModel camera(CameraSpec{});
    const auto empty = frame(camera, ground, 1.0f, -2.0f, 0.0f, {});
    CarPicture ghost = car_at(1.8f, -2.0f, 0.0f);
    ghost.alpha = 0.0f;
    CHECK(frame(camera, ground, 1.0f, -2.0f, 0.0f, {ghost}) == empty);
    CHECK(frame(camera, ground, 1.0f, -2.0f, 0.0f, {car_at(-0.5f, -2.0f, 0.0f)}) == empty);  // behind
    CHECK(frame(camera, ground, 1.0f, -2.0f, 0.0f, {car_at(1.8f, -2.0f, 0.0f)}) != empty);
}

// The nearer car hides the other, whatever their order.
TEST(order_of_cars_does_not_matter) {
    const test::Outline road = test::circuit();
    const GroundMap ground(road.view());
    const CameraModel camera(CameraSpec{});
    CarPicture near = car_at(1.7f, -2.0f, 0.0f);
    CarPicture far = car_at(2.1f, -1.95f, 0.3f);
    far.colour[0] = 10;
    CHECK(frame(camera, ground, 1.0f, -2.0f, 0.0f, {near, far}) ==
          frame(camera, ground, 1.0f, -2.0f, 0.0f, {far, near}));
}

TEST(any_car_is_safe) {
    const test::Outline road = test::circuit();
    const GroundMap ground(road.view());
    for (const CameraSpec& spec :
         {CameraSpec{}, chase_camera(160, 120), top_down_camera(ground, 96, 64).spec}) {
        const CameraModel camera(spec);
        for (const float x : {-50.0f, 0.0f, 1.0f, 1.1f, 1.145f, 1.3f, 50.0f, 1e6f}) {
            for (const float heading : {0.0f, 1.0f, 3.0f, -2.0f}) {
                frame(camera, ground, 1.0f, -2.0f, 0.0f,
                      {car_at(x, -2.0f, heading), car_at(1.0f, x, heading)});
            }
        }
    }
}

}  // namespace
}  // namespace racecraft
