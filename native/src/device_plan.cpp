#include "device_plan.hpp"

#include <cstring>
#include <stdexcept>

namespace racecraft {
namespace {

constexpr size_t kAlignment = 256;  // bytes, of every table

// Of one array, where the sizes have their names.
struct SizedBatch : Batch {
    explicit SizedBatch(const Batch& batch) : Batch(batch) {}
    std::vector<std::pair<std::string, size_t>> arrays() const {
#define RC_SIZE(name, type, size) \
    {#name, sizeof(type) * static_cast<size_t>(num_envs) * static_cast<size_t>(size)},
        return {RC_CAR_ARRAYS(RC_SIZE)};
#undef RC_SIZE
    }
};

template <typename T, typename Value>
std::vector<uint8_t> filled(size_t count, Value&& value) {
    std::vector<uint8_t> bytes(count * sizeof(T));
    for (size_t i = 0; i < count; ++i) {
        const T item = value(i);
        std::memcpy(bytes.data() + i * sizeof(T), &item, sizeof(T));
    }
    return bytes;
}

}  // namespace

// Offset of a copy of the values.
template <typename T>
size_t DevicePlan::put(const T* values, size_t count) {
    const size_t offset = (world_.size() + kAlignment - 1) / kAlignment * kAlignment;
    world_.resize(offset + count * sizeof(T));
    if (count > 0) std::memcpy(world_.data() + offset, values, count * sizeof(T));
    return offset;
}

// Makes the pointer that lies at `slot` of the object at `base`, whose copy begins at `object`, point to
// `target`.
template <typename T>
void DevicePlan::point(size_t object, const T* const* slot, const void* base, size_t target) {
    const size_t place = object + static_cast<size_t>(reinterpret_cast<const uint8_t*>(slot) -
                                                      static_cast<const uint8_t*>(base));
    const uint64_t value = target;
    std::memcpy(world_.data() + place, &value, sizeof(value));
    relocations_.push_back(place);
}

DevicePlan::DevicePlan(const Engine& engine, size_t num_envs)
    : batch_(engine.batch_), palette_(engine.palettes_.front()), seed_(engine.seed_) {
    Batch& b = batch_;
    if (b.cars_per_race != 1)
        throw std::invalid_argument("A GPU drives cars that race alone; cars_per_race must be 1.");
    b.num_envs = static_cast<int32_t>(num_envs);
    if (engine.camera_ != nullptr) b.camera_bytes = camera_table_bytes(engine.camera_->spec().height);

    const std::vector<TrackGeometry>& tracks = engine.geometries_;
    tracks_ = put(tracks.data(), tracks.size());
    for (size_t i = 0; i < tracks.size(); ++i) {
        const TrackGeometry& g = tracks[i];
        const size_t at = tracks_ + i * sizeof(g);
        const size_t segments = static_cast<size_t>(g.num_segments);
        const size_t rows = static_cast<size_t>(g.grid_rows);
        const size_t cells = rows * static_cast<size_t>(g.grid_columns);
        const size_t edges = g.band_begin[rows];
        const size_t samples = engine.tracks_[i].num_samples();
        point(at, &g.segments, &g, put(g.segments, segments));
        point(at, &g.lane_offsets, &g, put(g.lane_offsets, segments + 1));
        point(at, &g.width_begin, &g, put(g.width_begin, segments + 1));
        point(at, &g.width_pieces, &g, put(g.width_pieces, g.width_begin[segments]));
        point(at, &g.cell_kind, &g, put(g.cell_kind, cells));
        point(at, &g.segment_begin, &g, put(g.segment_begin, cells + 1));
        point(at, &g.segment_items, &g, put(g.segment_items, g.segment_begin[cells]));
        point(at, &g.band_begin, &g, put(g.band_begin, rows + 1));
        point(at, &g.edge_x0, &g, put(g.edge_x0, edges));
        point(at, &g.edge_y0, &g, put(g.edge_y0, edges));
        point(at, &g.edge_y1, &g, put(g.edge_y1, edges));
        point(at, &g.edge_slope, &g, put(g.edge_slope, edges));
        point(at, &g.width_table, &g, put(g.width_table, samples));
        point(at, &g.curvature_table, &g, put(g.curvature_table, samples));
    }

    std::vector<GroundView> grounds;
    for (const auto& ground : engine.grounds_) grounds.push_back(ground->view());
    grounds_ = put(grounds.data(), grounds.size());
    for (size_t i = 0; i < grounds.size(); ++i) {
        const size_t texels = engine.grounds_[i]->num_bytes() / sizeof(uint32_t);
        point(grounds_ + i * sizeof(GroundView), &grounds[i].texels, &grounds[i],
              put(grounds[i].texels, texels));
    }

    std::vector<CameraView> lenses;
    for (const CameraModel* model : {engine.camera_.get(), engine.right_camera_.get()}) {
        if (model != nullptr) lenses.push_back(model->view());
    }
    lenses_ = put(lenses.data(), lenses.size());
    for (size_t i = 0; i < lenses.size(); ++i) {
        const CameraView& v = lenses[i];
        const size_t at = lenses_ + i * sizeof(v);
        const size_t rows = static_cast<size_t>(v.spec.height);
        const size_t samples = static_cast<size_t>(v.num_samples);
        point(at, &v.row_begin, &v, put(v.row_begin, rows + 1));
        point(at, &v.kind, &v, put(v.kind, samples));
        point(at, &v.exponent, &v, put(v.exponent, samples));
        point(at, &v.distance, &v, put(v.distance, samples));
        point(at, &v.start, &v, put(v.start, samples));
        point(at, &v.step, &v, put(v.step, samples));
        point(at, &v.sharpness, &v, put(v.sharpness, samples));
        point(at, &v.corner_scale, &v, put(v.corner_scale, rows));
    }
}

std::vector<uint8_t> DevicePlan::world(uint64_t address) const {
    std::vector<uint8_t> bytes = world_;
    for (const size_t place : relocations_) {
        uint64_t value;
        std::memcpy(&value, bytes.data() + place, sizeof(value));
        value += address;
        std::memcpy(bytes.data() + place, &value, sizeof(value));
    }
    return bytes;
}

std::vector<std::pair<std::string, size_t>> DevicePlan::arrays() const {
    return SizedBatch(batch_).arrays();
}

std::vector<uint8_t> DevicePlan::initial(const std::string& name) const {
    const size_t n = static_cast<size_t>(batch_.num_envs);
    if (name == "parameters") {
        float values[kNumVehicleParameters];
        std::memcpy(values, &batch_.vehicle, sizeof(values));
        return filled<float>(n * kNumVehicleParameters, [&](size_t i) { return values[i / n]; });
    }
    if (name == "track_choice") {
        return filled<int32_t>(n, [&](size_t i) { return static_cast<int32_t>(i) % batch_.num_tracks; });
    }
    if (name == "seeds") return filled<uint64_t>(n, [&](size_t) { return seed_; });
    if (name == "streams") return filled<uint32_t>(n, [](size_t i) { return static_cast<uint32_t>(i); });
    if (name == "palettes") return filled<GreyPalette>(n, [&](size_t) { return palette_; });
    if (name == "episodes") {
        return filled<Episode>(n, [](size_t) {
            Episode episode{};
            episode.episode = -1;
            return episode;
        });
    }
    return {};
}

std::vector<uint8_t> DevicePlan::batch(uint64_t world, const std::vector<uint64_t>& addresses) const {
    Batch placed = batch_;
    placed.tracks = reinterpret_cast<const TrackGeometry*>(world + tracks_);
    placed.grounds = reinterpret_cast<const GroundView*>(world + grounds_);
    placed.lenses = reinterpret_cast<const CameraView*>(world + lenses_);
    size_t i = 0;
    if (addresses.size() != arrays().size())
        throw std::invalid_argument("Wrong number of arrays of a batch.");
#define RC_PLACE(name, type, size) placed.name = reinterpret_cast<type*>(addresses[i++]);
    RC_CAR_ARRAYS(RC_PLACE)
#undef RC_PLACE
    std::vector<uint8_t> bytes(sizeof(placed));
    std::memcpy(bytes.data(), &placed, sizeof(placed));
    return bytes;
}

}  // namespace racecraft
