// Faces of a solid over a grey frame, with exact coverage: what ObjectPainter has projected, row by row.
//
// A row without corners takes the faces' edges at its middle: what lies between is filled at once, and only
// the pixels at the edges are mixed. A row in which a face begins, ends or has a corner is the mean of four
// lines. Lines are cut with all edges of a face at once, without branches, so that both turn into vector
// code.
#pragma once

#include "racecraft/math.hpp"

namespace racecraft {
namespace {  // so that one instruction set's copy can never be linked into another's kernel

constexpr int32_t kCover = 256;  // a pixel that is covered whole
constexpr int32_t kSubrows = 4;  // of a row in which a face begins, ends or has a corner
constexpr int kMostFaces = 5;
constexpr int kMostCorners = 5;  // of a quadrangle after the near plane has cut it
#if defined(__CUDACC__)
constexpr int32_t kBlockRows = 1;    // that are cut at once; a thread of a GPU draws one
constexpr int32_t kBlockPixels = 1;  // that are mixed at once
#else
constexpr int32_t kBlockRows = 16;
constexpr int32_t kBlockPixels = 8;
#endif

// Coverage and brightness of a pixel gather in one number, so that one sum carries both: whole units are
// coverage, the rest is brightness times coverage. Five faces over a pixel are 1280 and 326,400 at most.
constexpr int32_t kCoverUnit = 1 << 19;

struct Polygon {
    float x[kMostCorners + 1], y[kMostCorners + 1];  // pixels, y down; after the last corner the first again
    float slope[kMostCorners];                       // of the edge from here to the next corner, dx/dy
    int32_t count;
    int32_t ink;                     // kCoverUnit and the brightness
    float left, right, top, bottom;  // what it spans, pixels
};

// Where lines at heights y are inside a polygon, within columns [begin, end]; left is not below right where
// they miss it.
template <int kLines>
RC_HD void find_spans(const Polygon& polygon, const float (&y)[kLines], float begin, float end,
                      float (&left)[kLines], float (&right)[kLines]) {
    // Counted down from what no edge reaches: both sides gather without a branch.
    float lower[kLines], upper[kLines];
    for (int k = 0; k < kLines; ++k) {
        lower[k] = 1e6f;
        upper[k] = -1e6f;
    }
    for (int i = 0; i < polygon.count; ++i) {
        const float from_x = polygon.x[i];
        const float from_y = polygon.y[i];
        const float high = min_of(from_y, polygon.y[i + 1]);
        const float low = max_of(from_y, polygon.y[i + 1]);
        const float slope = polygon.slope[i];
#pragma GCC ivdep
#pragma GCC unroll 1
        for (int k = 0; k < kLines; ++k) {
            const float x = from_x + (y[k] - from_y) * slope;
            const bool is_cut = (high <= y[k]) & (low > y[k]);
            const float least = is_cut ? x : 1e6f;
            const float most = is_cut ? x : -1e6f;
            lower[k] = least < lower[k] ? least : lower[k];
            upper[k] = most > upper[k] ? most : upper[k];
        }
    }
    for (int k = 0; k < kLines; ++k) {
        left[k] = clamp(lower[k], begin, end);
        right[k] = clamp(upper[k], begin, end);
    }
}

// Rounding of shared edges may cover a pixel a little more than whole.
RC_HD uint8_t mix_pixel(uint8_t behind, int32_t sum) {
    const int32_t cover = sum >> 19;
    const int32_t shade = (sum & (kCoverUnit - 1)) + kCover / 2;
    return static_cast<uint8_t>(min_of((behind * max_of(kCover - cover, 0) + shade) >> 8, 255));
}

// The pixels of a block, and their sums back to 0.
RC_HD void mix_block(uint8_t* __restrict__ line, int32_t* __restrict__ sums) {
    for (int32_t i = 0; i < kBlockPixels; ++i) line[i] = mix_pixel(line[i], sums[i]);
    for (int32_t i = 0; i < kBlockPixels; ++i) sums[i] = 0;
}

template <int32_t kMaxWidth>
class FaceFiller {
  public:
    // Draws into rows [first_row, last_row) only.
    FaceFiller(int32_t width, int32_t height, int32_t first_row, int32_t last_row, uint8_t* out)
        : width_(width), height_(height), first_row_(first_row), last_row_(last_row), out_(out) {}

    // Readies a face whose corners are set; false where the image shows nothing of it.
    bool prepare(Polygon& polygon, int32_t shade) const {
        polygon.left = polygon.right = polygon.x[0];
        polygon.top = polygon.bottom = polygon.y[0];
        for (int i = 1; i < polygon.count; ++i) {
            polygon.left = min_of(polygon.left, polygon.x[i]);
            polygon.right = max_of(polygon.right, polygon.x[i]);
            polygon.top = min_of(polygon.top, polygon.y[i]);
            polygon.bottom = max_of(polygon.bottom, polygon.y[i]);
        }
        if (polygon.right <= 0.0f || polygon.left >= static_cast<float>(width_) || polygon.bottom <= 0.0f ||
            polygon.top >= static_cast<float>(height_)) {
            return false;
        }
        polygon.x[polygon.count] = polygon.x[0];
        polygon.y[polygon.count] = polygon.y[0];
        for (int i = 0; i < polygon.count; ++i) {
            const float dy = polygon.y[i + 1] - polygon.y[i];
            polygon.slope[i] = dy == 0.0f ? 0.0f : (polygon.x[i + 1] - polygon.x[i]) / dy;
        }
        polygon.ink = kCoverUnit + shade;
        return true;
    }

    // Lays the faces of one solid over the frame. They meet without overlap, so what they cover adds up.
    RC_APART void draw(const Polygon* polygons, int count) {
        if (count == 0) return;
        polygons_ = polygons;
        count_ = count;
        float top = polygons[0].top;
        float bottom = polygons[0].bottom;
        float left = polygons[0].left;
        float right = polygons[0].right;
        for (int p = 1; p < count; ++p) {
            top = min_of(top, polygons[p].top);
            bottom = max_of(bottom, polygons[p].bottom);
            left = min_of(left, polygons[p].left);
            right = max_of(right, polygons[p].right);
        }
        const int32_t first_row = max_of(static_cast<int32_t>(max_of(top, 0.0f)), first_row_);
        const int32_t last_row = static_cast<int32_t>(min_of(bottom, static_cast<float>(height_) - 0.5f));
        const int32_t end_row = min_of(last_row + 1, last_row_);
        if (first_row >= end_row) return;
        begin_ = static_cast<int32_t>(clamp(left, 0.0f, static_cast<float>(width_) - 1.0f));
        end_ = static_cast<int32_t>(clamp(right, 0.0f, static_cast<float>(width_) - 1.0f)) + 1;
        const int32_t last = end_ + 1 + kBlockPixels;  // blocks reach beyond the solid, on both sides
        for (int32_t x = max_of(begin_ - kBlockPixels, 0); x <= last; ++x) sums_[x] = 0;
        for (int32_t row = first_row; row < end_row; row += kBlockRows) {
            draw_rows(row, min_of(end_row - row, kBlockRows));
        }
    }

  private:
    void draw_rows(int32_t row, int32_t num_rows) {
        const uint32_t with_corner = rows_with_corner(row);
        float y[kBlockRows], left[kMostFaces][kBlockRows], right[kMostFaces][kBlockRows];
        if (with_corner != (1u << kBlockRows) - 1u) {
            for (int32_t k = 0; k < kBlockRows; ++k) y[k] = static_cast<float>(row + k) + 0.5f;
            for (int p = 0; p < count_; ++p) {
                find_spans(polygons_[p], y, static_cast<float>(begin_), static_cast<float>(end_), left[p],
                           right[p]);
            }
        }
        for (int32_t k = 0; k < num_rows; ++k) {
            uint8_t* line = out_ + static_cast<size_t>(row + k) * static_cast<size_t>(width_);
            if ((with_corner >> k & 1u) != 0) {
                draw_mixed_row(row + k, line);
                continue;
            }
            int32_t mixed[2 * kMostFaces];
            int32_t num_mixed = 0;
            for (int p = 0; p < count_; ++p) {
                if (left[p][k] < right[p][k]) {
                    num_mixed +=
                        fill_span(left[p][k], right[p][k], polygons_[p].ink, line, mixed + num_mixed);
                }
            }
            for (int32_t i = 0; i < num_mixed; ++i) {
                const int32_t x = mixed[i];
                if (x < end_) line[x] = mix_pixel(line[x], sums_[x]);
                sums_[x] = 0;
            }
        }
    }

    // Which of the rows from `row` on have a corner of any face inside, bit by bit.
    uint32_t rows_with_corner(int32_t row) const {
        const float upper = static_cast<float>(row);
        uint32_t found = 0;
        for (int p = 0; p < count_; ++p) {
            const Polygon& polygon = polygons_[p];
            for (int i = 0; i < polygon.count; ++i) {
                const float below = polygon.y[i] - upper;
                if (!(below > 0.0f && below < static_cast<float>(kBlockRows))) continue;
                const int32_t k = static_cast<int32_t>(below);
                if (polygon.y[i] > static_cast<float>(row + k)) found |= 1u << k;
            }
        }
        return found;
    }

    // A span of a row without corners: fills what is covered whole, adds up the rest, and tells its pixels.
    int32_t fill_span(float left, float right, int32_t ink, uint8_t* line, int32_t* mixed) {
        const int32_t first = static_cast<int32_t>(left);
        const int32_t last = static_cast<int32_t>(right);
        const int32_t before = static_cast<int32_t>((left - static_cast<float>(first)) * kCover);
        const int32_t within = static_cast<int32_t>((right - static_cast<float>(last)) * kCover);
        mixed[0] = first;
        if (first == last) {
            sums_[first] += (within - before) * ink;
            return 1;
        }
        sums_[first] += (kCover - before) * ink;
        sums_[last] += within * ink;
        const uint8_t shade = static_cast<uint8_t>(ink);  // a local, since bytes may alias anything
        for (int32_t x = first + 1; x < last; ++x) line[x] = shade;
        mixed[1] = last;
        return 2;
    }

    // A row with corners: the mean of some lines, each gathered as changes from pixel to pixel.
    void draw_mixed_row(int32_t row, uint8_t* line) {
        constexpr float kWeight = kCover / kSubrows;
        float y[kSubrows], left[kSubrows], right[kSubrows];
        int32_t first[kSubrows], last[kSubrows], before[kSubrows], within[kSubrows], weight[kSubrows];
        for (int k = 0; k < kSubrows; ++k) {
            y[k] = static_cast<float>(row) + (static_cast<float>(k) + 0.5f) * (1.0f / kSubrows);
        }
        int32_t begin = end_;
        int32_t end = begin_;
        for (int p = 0; p < count_; ++p) {
            const Polygon& polygon = polygons_[p];
            if (polygon.bottom <= y[0] || polygon.top > y[kSubrows - 1]) continue;
            find_spans(polygon, y, static_cast<float>(begin_), static_cast<float>(end_), left, right);
            for (int k = 0; k < kSubrows; ++k) {
                first[k] = static_cast<int32_t>(left[k]);
                last[k] = static_cast<int32_t>(right[k]);
                const float part = left[k] < right[k] ? kWeight : 0.0f;
                weight[k] = static_cast<int32_t>(part);
                before[k] = static_cast<int32_t>((left[k] - static_cast<float>(first[k])) * part);
                within[k] = static_cast<int32_t>((right[k] - static_cast<float>(last[k])) * part);
            }
            for (int k = 0; k < kSubrows; ++k) {
                sums_[first[k]] += (weight[k] - before[k]) * polygon.ink;
                sums_[first[k] + 1] += before[k] * polygon.ink;
                sums_[last[k]] -= (weight[k] - within[k]) * polygon.ink;
                sums_[last[k] + 1] -= within[k] * polygon.ink;
                begin = min_of(begin, first[k]);
                end = max_of(end, last[k] + 2);
            }
        }
        const int32_t stop = min_of(end, end_);
        int32_t sum = 0;
        for (int32_t x = begin; x < stop; ++x) {
            sum += sums_[x];
            sums_[x] = sum;
        }
        for (int32_t x = stop; x < end; ++x) sums_[x] = 0;
        // Whole blocks, the last moved back to the row's end; what is not covered stays as it is.
        int32_t x = begin;
        for (; x < stop && width_ >= kBlockPixels; x += kBlockPixels) {
            const int32_t at = min_of(x, width_ - kBlockPixels);
            mix_block(line + at, sums_ + at);
        }
        for (; x < stop; ++x) {
            line[x] = mix_pixel(line[x], sums_[x]);
            sums_[x] = 0;
        }
    }

    int32_t width_, height_, first_row_, last_row_;
    uint8_t* out_;
    const Polygon* polygons_ = nullptr;  // of the solid at hand
    int count_ = 0;
    int32_t begin_ = 0, end_ = 0;  // columns that it spans
    int32_t
        sums_[kMaxWidth + 2 + 2 * kBlockPixels];  // of a pixel, or their change along a row; 0 between rows
};

}  // namespace
}  // namespace racecraft
