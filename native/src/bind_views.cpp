// The border between Python and pictures; racecraft.sim.views is its Python face.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>

#include <stdexcept>
#include <string>

#include "scene.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace racecraft {

const RgbPalette& rgb_palette(const std::string& name);  // bindings.cpp

void bind_views(nb::module_& m) {
    constexpr int kNumCarFields = 9;  // x, y, heading, steering, red, green, blue, alpha, whether a box
    using Cars = nb::ndarray<const float, nb::shape<-1, kNumCarFields>, nb::c_contig, nb::device::cpu>;
    using Picture = nb::ndarray<uint8_t, nb::shape<-1, -1, 3>, nb::c_contig, nb::device::cpu>;
    using Poses = nb::ndarray<const float, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;
    using Frames = nb::ndarray<uint8_t, nb::ndim<3>, nb::c_contig, nb::device::cpu>;

    nb::class_<CameraModel>(m, "CameraModel", "A camera that is ready to draw pictures for people.")
        .def(nb::init<const CameraSpec&>(), "spec"_a);
    m.def(
        "render_grey",
        [](const CameraModel& camera, const GroundMap& ground, const std::string& palette, Poses poses,
           Frames out) {
            const CameraSpec& spec = camera.spec();
            const size_t size = static_cast<size_t>(spec.height) * static_cast<size_t>(spec.width);
            if (out.shape(0) != poses.shape(0) || out.shape(1) != static_cast<size_t>(spec.height) ||
                out.shape(2) != static_cast<size_t>(spec.width)) {
                throw std::invalid_argument(
                    "The frames do not have the poses' number and the camera's size.");
            }
            const size_t count = poses.shape(0);
            const RgbPalette& colours = rgb_palette(palette);
            const GreyPalette grey = grey_palette(colours);
            const float* pose = poses.data();
            uint8_t* pixels = out.data();
            nb::gil_scoped_release release;
            for (size_t i = 0; i < count; ++i, pose += 3, pixels += size)
                render_grey(camera, ground, grey, colours.sheen, pose[0], pose[1], pose[2], pixels);
        },
        "camera"_a, "ground"_a, "palette"_a, "poses"_a, "out"_a);
    m.def("chase_camera", &chase_camera, "width"_a, "height"_a);
    m.def(
        "top_down_camera",
        [](const GroundMap& ground, int width, int height) {
            const FixedCamera camera = top_down_camera(ground, width, height);
            return std::make_tuple(camera.spec, camera.x, camera.y, camera.heading);
        },
        "ground"_a, "width"_a, "height"_a);
    const auto pictures_of = [](const Cars& cars) {
        std::vector<CarPicture> pictures;
        for (size_t i = 0; i < cars.shape(0); ++i) {
            const float* car = cars.data() + i * kNumCarFields;
            const auto byte = [&](int field) {
                return static_cast<uint8_t>(clamp(car[field], 0.0f, 255.0f));
            };
            pictures.push_back(
                {car[0], car[1], car[2], car[3], {byte(4), byte(5), byte(6)}, car[7], car[8] != 0.0f});
        }
        return pictures;
    };
    m.def(
        "render_rgb",
        [pictures_of](const CameraModel& camera, const GroundMap& ground, const std::string& palette, float x,
                      float y, float heading, Cars cars, Cars scan, bool lit_walls, Picture out) {
            const CameraSpec& spec = camera.spec();
            if (out.shape(0) != static_cast<size_t>(spec.height) ||
                out.shape(1) != static_cast<size_t>(spec.width)) {
                throw std::invalid_argument("The picture does not have the camera's size.");
            }
            const std::vector<CarPicture> pictures = pictures_of(cars);
            const std::vector<CarPicture> scanned = pictures_of(scan);  // the scanner, then what it can hit
            ScanPicture scanner{};
            if (!scanned.empty()) {
                scanner = {scanned[0].x, scanned[0].y, scanned[0].heading, scanned.data() + 1,
                           static_cast<int>(scanned.size()) - 1};
            }
            const RgbPalette& world = rgb_palette(palette);
            const RgbPalette colours = lit_walls ? with_lit_walls(world) : world;
            uint8_t* pixels = out.data();
            nb::gil_scoped_release release;
            render_rgb(camera, ground, colours, x, y, heading, pictures.data(),
                       static_cast<int>(pictures.size()), scanned.empty() ? nullptr : &scanner, pixels);
        },
        "camera"_a, "ground"_a, "palette"_a, "x"_a, "y"_a, "heading"_a, "cars"_a, "scan"_a, "lit_walls"_a,
        "out"_a);
}

}  // namespace racecraft
