// From polylines to texels: blocks of 16 x 16 texels know the few border segments and dashes near them, so
// each texel finds its nearest border exactly and in constant time; blocks without any are filled in one go.
#include "ground_map.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "ground_coverage.hpp"
#include "ground_lines.hpp"
#include "refuse.hpp"

namespace racecraft {
namespace {

constexpr int kBlock = 16;                // texels
constexpr int kMaxTexelsPerSide = 16384;  // keeps 16.16 fixed point far from overflow
constexpr double kReach = 0.9;  // texels from a texel's centre within which a border is worth storing

// The nearest border of a point: distance, positive on the pair's upper side, and the unit normal towards
// that side.
struct Border {
    double distance;
    Point normal;
    int pair;
};

uint32_t pack(int x, int y, int offset, int pair) {
    return static_cast<uint32_t>(x & 255) | static_cast<uint32_t>(y & 255) << 8 |
           static_cast<uint32_t>(offset & 255) << 16 | static_cast<uint32_t>(pair) << 24;
}

int rounded(double value) {
    return static_cast<int>(std::floor(value + 0.5));
}

constexpr int kPairOfBand[2] = {0, 1};  // field to edge line, edge line to road
constexpr int kPairOfDash = 2;          // road to centre line

// A texel of one material: its two shades, parted by a line of random direction near the texel's centre.
// Every line is as likely as its mirror image, so the shades are even on average. All in integers: the same
// ground everywhere.
uint32_t grain_texel(Material material, int column, int row) {
    constexpr int kDirections[16][2] = {{64, 0},   {59, 24},  {45, 45},  {24, 59},   {0, 64},    {-24, 59},
                                        {-45, 45}, {-59, 24}, {-64, 0},  {-59, -24}, {-45, -45}, {-24, -59},
                                        {0, -64},  {24, -59}, {45, -45}, {59, -24}};
    constexpr int kSpread = 4000;  // of the line about the centre, in 1/16384 texel
    uint32_t hash = static_cast<uint32_t>(column) * 0x8da6b343u ^ static_cast<uint32_t>(row) * 0xd8163841u;
    hash = (hash ^ hash >> 15) * 0x2c1b3c6du;
    hash = (hash ^ hash >> 12) * 0x297a2d39u;
    hash ^= hash >> 15;
    const int* normal = kDirections[hash & 15];
    const int distance = (2 * static_cast<int>(hash >> 8 & 255) - 255) * kSpread / 255;
    const int offset = (2 * distance - 255 * (normal[0] + normal[1])) / (2 * kEdgeOffsetScale);
    return pack(normal[0], normal[1], offset, kGrainPairs + material);
}

// The texel in this column and row, whose centre is as far from the border as said.
uint32_t edge_texel(const Border& border, double texel, int column, int row) {
    const double distance = border.distance / texel;
    if (std::fabs(distance) > kReach) {
        const MaterialPair pair = kMaterialPairs[border.pair];
        return grain_texel(static_cast<Material>(distance > 0.0 ? pair.above : pair.below), column, row);
    }
    const int x = rounded(kEdgeNormalScale * border.normal.x);
    const int y = rounded(kEdgeNormalScale * border.normal.y);
    const int offset = rounded((kEdgeDistanceScale * distance - 127.5 * (x + y)) / kEdgeOffsetScale);
    return pack(x, y, std::clamp(offset, -127, 127), border.pair);
}

// The straight line that halves a texel around p as a corner of the dash does: same area, same direction.
Border fit_corner(const Dash& dash, Point p, double texel) {
    constexpr int kSide = 8;
    double inside = 0.0;
    Point sum{};
    for (int i = 0; i < kSide * kSide; ++i) {
        const double x = (i % kSide + 0.5) / kSide - 0.5;
        const double y = (i / kSide + 0.5) / kSide - 0.5;
        Point gradient;
        if (depth_in(dash, {p.x + x * texel, p.y + y * texel}, gradient) > 0.0) {
            inside += 1.0;
            sum = {sum.x + x, sum.y + y};
        }
    }
    const double size = std::sqrt(sum.x * sum.x + sum.y * sum.y);
    const double share = inside / (kSide * kSide);
    if (size < 1e-9) return {(share > 0.5 ? 1.0 : -1.0) * texel, {1.0, 0.0}, kPairOfDash};
    const Point normal = {sum.x / size, sum.y / size};
    const double high = std::max(std::fabs(normal.x), std::fabs(normal.y));
    const double low = std::min(std::fabs(normal.x), std::fabs(normal.y));
    double below = -0.71;
    double above = 0.71;
    for (int i = 0; i < 24; ++i) {
        const double middle = 0.5 * (below + above);
        (share_above(middle, high, low) < share ? below : above) = middle;
    }
    return {0.5 * (below + above) * texel, normal, kPairOfDash};
}

// Segments or dashes by the blocks that they may touch.
class Bins {
  public:
    Bins(int columns, int rows, Point origin, double block_size)
        : columns_(columns),
          rows_(rows),
          origin_(origin),
          block_size_(block_size),
          bins_(size_t(columns) * rows) {}

    void add(uint32_t item, Point low, Point high) {
        const int x0 = std::max(0, column(low.x)), x1 = std::min(columns_ - 1, column(high.x));
        const int y0 = std::max(0, row(low.y)), y1 = std::min(rows_ - 1, row(high.y));
        for (int y = y0; y <= y1; ++y) {
            for (int x = x0; x <= x1; ++x) bins_[size_t(y) * columns_ + x].push_back(item);
        }
    }
    Point block_center(int x, int y) const {
        return {origin_.x + (x + 0.5) * block_size_, origin_.y + (y + 0.5) * block_size_};
    }
    std::vector<uint32_t>& at(int x, int y) { return bins_[size_t(y) * columns_ + x]; }

  private:
    int column(double x) const { return static_cast<int>(std::floor((x - origin_.x) / block_size_)); }
    int row(double y) const { return static_cast<int>(std::floor((y - origin_.y) / block_size_)); }

    int columns_, rows_;
    Point origin_;
    double block_size_;
    std::vector<std::vector<uint32_t>> bins_;
};

class Painter {
  public:
    Painter(std::vector<BorderSegment> borders, std::vector<Dash> dashes, Point origin, double texel,
            int columns, int rows)
        : borders_(std::move(borders)),
          dashes_(std::move(dashes)),
          origin_(origin),
          texel_(texel),
          block_columns_((columns + kBlock - 1) / kBlock),
          block_rows_((rows + kBlock - 1) / kBlock),
          near_borders_(block_columns_, block_rows_, origin, texel * kBlock),
          near_dashes_(block_columns_, block_rows_, origin, texel * kBlock) {
        const double reach = kEdgeLineWidth + 2.0 * texel;
        for (uint32_t i = 0; i < borders_.size(); ++i) {
            const BorderSegment& s = borders_[i];
            near_borders_.add(i, {std::min(s.a.x, s.b.x) - reach, std::min(s.a.y, s.b.y) - reach},
                              {std::max(s.a.x, s.b.x) + reach, std::max(s.a.y, s.b.y) + reach});
        }
        for (uint32_t i = 0; i < dashes_.size(); ++i) {
            const Dash& d = dashes_[i];
            const double r = d.half_length + 0.5 * kDashWidth + 2.0 * texel;
            near_dashes_.add(i, {d.center.x - r, d.center.y - r}, {d.center.x + r, d.center.y + r});
        }
    }

    // Calls store(column, row, texel) for every texel.
    template <typename Store>
    void paint(int columns, int rows, const Store& store) {
        std::vector<std::vector<double>> crossings(kBlock);
        for (int by = 0; by < block_rows_; ++by) {
            for (int r = 0; r < kBlock; ++r) find_crossings(by * kBlock + r, crossings[r]);
            for (int bx = 0; bx < block_columns_; ++bx) {
                keep_near(bx, by);
                const auto& segments = near_borders_.at(bx, by);
                const auto& dashes = near_dashes_.at(bx, by);
                const int x1 = std::min(columns, (bx + 1) * kBlock);
                const int y1 = std::min(rows, (by + 1) * kBlock);
                for (int y = by * kBlock; y < y1; ++y) {
                    const auto& line = crossings[y - by * kBlock];
                    for (int x = bx * kBlock; x < x1; ++x) {
                        const Point p = {origin_.x + (x + 0.5) * texel_, origin_.y + (y + 0.5) * texel_};
                        // The nearest blocks without a border are of one material: ask once, store for all.
                        const bool is_road =
                            (std::upper_bound(line.begin(), line.end(), p.x) - line.begin()) % 2 == 1;
                        if (segments.empty() && dashes.empty()) {
                            for (; x < x1; ++x) store(x, y, grain_texel(is_road ? kRoad : kField, x, y));
                        } else {
                            store(x, y, edge_texel(border_at(p, is_road, segments, dashes), texel_, x, y));
                        }
                    }
                }
            }
        }
    }

  private:
    // Bins are by bounding box; drop what the block's circle cannot reach.
    void keep_near(int bx, int by) {
        const Point center = near_borders_.block_center(bx, by);
        const double reach = kEdgeLineWidth + (1.5 + 0.7072 * kBlock) * texel_;
        auto& segments = near_borders_.at(bx, by);
        segments.erase(std::remove_if(segments.begin(), segments.end(),
                                      [&](uint32_t i) {
                                          Point away;
                                          return distance_to(borders_[i], center, away) > reach;
                                      }),
                       segments.end());
    }

    void find_crossings(int row, std::vector<double>& line) const {
        const double y = origin_.y + (row + 0.5) * texel_;
        line.clear();
        for (const BorderSegment& s : borders_) {
            if ((s.a.y <= y) != (s.b.y <= y))
                line.push_back(s.a.x + (y - s.a.y) / (s.b.y - s.a.y) * (s.b.x - s.a.x));
        }
        std::sort(line.begin(), line.end());
    }

    bool is_inside(Point p) const {
        bool inside = false;
        for (const BorderSegment& s : borders_) {
            if ((s.a.y <= p.y) != (s.b.y <= p.y) &&
                p.x < s.a.x + (p.y - s.a.y) / (s.b.y - s.a.y) * (s.b.x - s.a.x)) {
                inside = !inside;
            }
        }
        return inside;
    }

    Border border_at(Point p, bool is_road, const std::vector<uint32_t>& segments,
                     const std::vector<uint32_t>& dashes) const {
        double nearest = 1e300;
        Point away{};
        const BorderSegment* border = nullptr;
        for (const uint32_t i : segments) {
            Point vector;
            const double distance = distance_to(borders_[i], p, vector);
            if (distance < nearest) {
                nearest = distance;
                away = vector;
                border = &borders_[i];
            }
        }
        Border best = {is_road ? 1e3 : -1e3, {0.0, 0.0}, kPairOfBand[is_road ? 1 : 0]};
        double into_road = best.distance;  // distance to the road's border, positive on the road
        if (border != nullptr) {
            Point normal;
            if (nearest > 1e-9) {
                const double scale = (is_road ? 1.0 : -1.0) / nearest;
                normal = {away.x * scale, away.y * scale};
            } else {  // the texel's centre is on the border: ask a little to the left which side the road is
                      // on
                const double dx = border->b.x - border->a.x;
                const double dy = border->b.y - border->a.y;
                const double size = std::sqrt(dx * dx + dy * dy);
                normal = {-dy / size, dx / size};
                if (!is_inside({p.x + 1e-6 * normal.x, p.y + 1e-6 * normal.y}))
                    normal = {-normal.x, -normal.y};
            }
            into_road = is_road ? nearest : -nearest;
            const double into_asphalt = into_road - kEdgeLineWidth;
            best = std::fabs(into_road) < std::fabs(into_asphalt)
                       ? Border{into_road, normal, kPairOfBand[0]}
                       : Border{into_asphalt, normal, kPairOfBand[1]};
        }
        if (into_road > kEdgeLineWidth) {
            for (const uint32_t i : dashes) {
                Point gradient;
                const double depth = depth_in(dashes_[i], p, gradient);
                if (depth > 0.0 || std::fabs(depth) < std::fabs(best.distance)) {
                    best = has_corner(dashes_[i], p, 0.75 * texel_) ? fit_corner(dashes_[i], p, texel_)
                                                                    : Border{depth, gradient, kPairOfDash};
                }
            }
        }
        return best;
    }

    std::vector<BorderSegment> borders_;
    std::vector<Dash> dashes_;
    Point origin_;
    double texel_;
    int block_columns_, block_rows_;
    Bins near_borders_, near_dashes_;
};

}  // namespace

GroundMap::GroundMap(const TrackOutline& outline, const GroundOptions& options) {
    GroundLines lines = read_lines(outline);
    if (!(options.texel >= 0.001f && options.texel <= 1.0f)) {
        refuse("Ground texel = " + std::to_string(options.texel) +
               " m must lie between 0.001 and 1 m; 0.01 is usual.");
    }

    view_.min_x = static_cast<float>(lines.low.x) - kRoomMargin;
    view_.min_y = static_cast<float>(lines.low.y) - kRoomMargin;
    view_.max_x = static_cast<float>(lines.high.x) + kRoomMargin;
    view_.max_y = static_cast<float>(lines.high.y) + kRoomMargin;
    const double size_x = static_cast<double>(view_.max_x) - view_.min_x;
    const double size_y = static_cast<double>(view_.max_y) - view_.min_y;

    // The finest allowed texel whose pyramid fits: 4/3 of level 0, and a little for rings and rounding to
    // tiles.
    double texel = 0.01;
    view_.exponent = 0;
    while (texel > options.texel * 1.4143f) texel *= 0.5, --view_.exponent;
    while (texel * 1.4143f < options.texel || size_x / texel > kMaxTexelsPerSide ||
           size_y / texel > kMaxTexelsPerSide ||
           size_x / texel * size_y / texel * 4.0 * 1.4 > static_cast<double>(options.max_bytes)) {
        texel *= 2.0, ++view_.exponent;
    }
    view_.texel = static_cast<float>(texel);

    int columns = static_cast<int>(std::ceil(size_x / texel));
    int rows = static_cast<int>(std::ceil(size_y / texel));
    size_t total = 0;
    double level_texel = texel;
    while (true) {
        GroundLevel& level = view_.levels[view_.num_levels++];
        level.columns = columns;
        level.rows = rows;
        level.offset = static_cast<uint32_t>(total);
        level.tiles_per_row = (columns + 2 + 3) / 4;
        level.texels_per_metre = static_cast<float>(1.0 / level_texel);
        total += size_t(level.tiles_per_row) * ((rows + 2 + 3) / 4) * 16;
        if (view_.num_levels == kMaxGroundLevels || std::max(columns, rows) <= 4) break;
        columns = (columns + 1) / 2;
        rows = (rows + 1) / 2;
        level_texel *= 2.0;
    }
    // Ring and padding are field; coverage bytes and edge texels say so differently.
    texels_.assign(total, kCoverageUnit << (8 * kField));
    std::fill(texels_.begin(), texels_.begin() + (view_.num_levels > 1 ? view_.levels[1].offset : total),
              pack(0, 0, -127, 0));
    view_.texels = texels_.data();

    const auto index = [](const GroundLevel& level, int column, int row) {
        return texel_index(level, static_cast<uint32_t>(column + 1) << 16,
                           static_cast<uint32_t>(row + 1) << 16);
    };
    const GroundLevel& base = view_.levels[0];
    Painter painter(std::move(lines.borders), std::move(lines.dashes), {view_.min_x, view_.min_y}, texel,
                    base.columns, base.rows);
    Covered covered(base);
    painter.paint(base.columns, base.rows, [&](int column, int row, uint32_t painted) {
        texels_[index(base, column, row)] = painted;
        covered.put(column, row, painted);
    });
    for (int l = 1; l < view_.num_levels; ++l) {
        const GroundLevel& level = view_.levels[l];
        covered = covered.coarser(level, [&](int column, int row, uint32_t painted) {
            texels_[index(level, column, row)] = painted;
        });
    }
}

}  // namespace racecraft
