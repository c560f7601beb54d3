// The border between Python and what a GPU is given; racecraft.sim.cuda_simulation is its Python face.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <cstring>

#include "device_plan.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace racecraft {
namespace {

using ByteArray = nb::ndarray<nb::numpy, uint8_t, nb::ndim<1>, nb::c_contig>;

ByteArray bytes_of(const std::vector<uint8_t>& bytes) {
    uint8_t* data = new uint8_t[bytes.size()];
    if (!bytes.empty()) std::memcpy(data, bytes.data(), bytes.size());
    const nb::capsule owner(data, [](void* p) noexcept { delete[] static_cast<uint8_t*>(p); });
    return ByteArray(data, {bytes.size()}, owner);
}

}  // namespace

void bind_device(nb::module_& m) {
    nb::class_<DevicePlan> plan(m, "DevicePlan", "What a GPU needs to drive cars by an engine's settings.");
    plan.def(nb::init<const Engine&, size_t>(), "engine"_a, "num_envs"_a)
        .def_prop_ro("world_bytes", &DevicePlan::world_bytes)
        .def_prop_ro("arrays", &DevicePlan::arrays)
        .def(
            "world", [](const DevicePlan& self, uint64_t address) { return bytes_of(self.world(address)); },
            "address"_a)
        .def(
            "initial",
            [](const DevicePlan& self, const std::string& name) { return bytes_of(self.initial(name)); },
            "name"_a)
        .def(
            "batch",
            [](const DevicePlan& self, uint64_t world, const std::vector<uint64_t>& addresses) {
                return bytes_of(self.batch(world, addresses));
            },
            "world"_a, "addresses"_a);
    m.attr("BATCH_BYTES") = sizeof(Batch);
    m.attr("CAR_THREADS") = kCarThreads;
    m.attr("IMAGE_THREADS") = kImageThreads;
    m.attr("ROW_THREADS") = kRowThreads;
    m.attr("LIDAR_RAYS") = kLidarRays;
}

}  // namespace racecraft
