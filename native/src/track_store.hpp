// Owns the memory behind one TrackGeometry and builds its grid.
#pragma once

#include <cstdint>
#include <vector>

#include "racecraft/track.hpp"
#include "track_outline.hpp"

namespace racecraft {

class TrackStore {
  public:
    // widths and curvatures are samples at i / samples_per_metre along the centre line.
    TrackStore(const TrackOutline& outline, const std::vector<float>& widths,
               const std::vector<float>& curvatures, double samples_per_metre);
    TrackStore(TrackStore&&) = default;
    TrackStore(const TrackStore&) = delete;

    const TrackGeometry& geometry() const { return geometry_; }
    size_t num_samples() const { return widths_.size(); }  // of the width and the curvature table

  private:
    void build_widths(const std::vector<double>& inner, const std::vector<double>& outer);
    void build_segments();
    void build_bands();

    TrackGeometry geometry_{};
    std::vector<Segment> segments_;
    std::vector<LaneOffset> lane_offsets_;
    std::vector<uint32_t> width_begin_;
    std::vector<WidthPiece> width_pieces_;
    std::vector<double> border_;  // x0, y0, x1, y1 of every border edge
    std::vector<uint8_t> cell_kind_;
    std::vector<uint32_t> segment_begin_;
    std::vector<uint16_t> segment_items_;
    std::vector<uint32_t> band_begin_;
    std::vector<double> edge_x0_, edge_y0_, edge_y1_, edge_slope_;
    std::vector<float> widths_, curvatures_;
};

}  // namespace racecraft
