// Along a segment the nearest point of one edge first stays at the edge's one end, then runs along it, then
// stays at its other end; so the squared distance to it is a parabola in each of three stretches. What is
// nearest of all edges is their lower envelope, merged two by two like the runs of a merge sort.
#include "road_width.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace racecraft {
namespace {

// The nearest point to the place `along` metres into the segment is (x + along dx, y + along dy).
struct Foot {
    double end;  // m along the segment, up to where it is the nearest
    double x, y, dx, dy;
};

using Envelope = std::vector<Foot>;

// c0 + c1 t + c2 t^2
struct Parabola {
    double c0, c1, c2;
};

class Walk {
  public:
    explicit Walk(const Segment& segment)
        : length_(segment.length),
          x_(segment.x),
          y_(segment.y),
          dx_(segment.dx * segment.inverse_length),
          dy_(segment.dy * segment.inverse_length) {}

    // The envelope of edges [begin, end), given by their places in a border.
    Envelope nearest(const Edges& border, const size_t* begin, const size_t* end) const {
        if (end - begin == 1) return stretches(border.data() + *begin);
        const size_t* middle = begin + (end - begin) / 2;
        return lower(nearest(border, begin, middle), nearest(border, middle, end));
    }

    // The edges that can be nearest to any place of the segment.
    std::vector<size_t> candidates(const Edges& border) const {
        const double x = x_ + 0.5 * length_ * dx_;
        const double y = y_ + 0.5 * length_ * dy_;
        std::vector<double> distance;
        for (size_t i = 0; i < border.size(); i += 4) {
            const double* edge = border.data() + i;
            const double ex = edge[2] - edge[0], ey = edge[3] - edge[1];
            const double rx = x - edge[0], ry = y - edge[1];
            const double squared = ex * ex + ey * ey;
            const double share = squared > 0.0 ? clamp((rx * ex + ry * ey) / squared, 0.0, 1.0) : 0.0;
            const double ox = rx - share * ex, oy = ry - share * ey;
            distance.push_back(std::sqrt(ox * ox + oy * oy));
        }
        const double reach = *std::min_element(distance.begin(), distance.end()) + length_ + 1e-9;
        std::vector<size_t> found;
        for (size_t i = 0; i < distance.size(); ++i) {
            if (distance[i] <= reach) found.push_back(4 * i);
        }
        return found;
    }

  private:
    Envelope stretches(const double* edge) const {
        const double ex = edge[2] - edge[0], ey = edge[3] - edge[1];
        const double squared = ex * ex + ey * ey;
        // The edge's share that the foot has reached is share + along * gain.
        const double gain = squared > 0.0 ? (dx_ * ex + dy_ * ey) / squared : 0.0;
        const double share = squared > 0.0 ? ((x_ - edge[0]) * ex + (y_ - edge[1]) * ey) / squared : 0.0;
        const Foot ends[2] = {{0.0, edge[0], edge[1], 0.0, 0.0}, {0.0, edge[2], edge[3], 0.0, 0.0}};
        const Foot between{0.0, edge[0] + share * ex, edge[1] + share * ey, gain * ex, gain * ey};
        Envelope out;
        const auto until = [&](double place, const Foot& foot) {
            const double from = out.empty() ? 0.0 : out.back().end;
            if (place <= from) return;
            out.push_back(foot);
            out.back().end = std::min(place, length_);
        };
        if (gain == 0.0) {
            until(length_, share <= 0.0 ? ends[0] : share >= 1.0 ? ends[1] : between);
            return out;
        }
        const int first = gain > 0.0 ? 0 : 1;
        until((first - share) / gain, ends[first]);
        until((1 - first - share) / gain, between);
        until(length_, ends[1 - first]);
        return out;
    }

    Parabola squared_distance(const Foot& foot) const {
        const double x = x_ - foot.x, y = y_ - foot.y;
        const double dx = dx_ - foot.dx, dy = dy_ - foot.dy;
        return {x * x + y * y, 2.0 * (x * dx + y * dy), dx * dx + dy * dy};
    }

    // What is nearer of two; the first where they are equally near.
    Envelope lower(const Envelope& one, const Envelope& other) const {
        Envelope out;
        double from = 0.0;
        for (size_t i = 0, k = 0; i < one.size() && k < other.size();) {
            const double to = std::min(one[i].end, other[k].end);
            const Parabola a = squared_distance(one[i]), b = squared_distance(other[k]);
            const Parabola apart{a.c0 - b.c0, a.c1 - b.c1, a.c2 - b.c2};
            double cuts[3];
            const int count = crossings(apart, from, to, cuts);
            cuts[count] = to;
            for (int c = 0; c <= count; ++c) {
                const double middle = 0.5 * (from + cuts[c]);
                const bool is_other = apart.c0 + middle * (apart.c1 + middle * apart.c2) > 0.0;
                append(out, is_other ? other[k] : one[i], cuts[c]);
                from = cuts[c];
            }
            if (one[i].end <= to) {
                k += other[k].end <= to ? 1 : 0;
                ++i;
            } else {
                ++k;
            }
        }
        return out;
    }

    // Where a parabola is 0 inside (from, to), ascending.
    static int crossings(const Parabola& p, double from, double to, double* cuts) {
        double roots[2];
        int found = 0;
        const double discriminant = p.c1 * p.c1 - 4.0 * p.c2 * p.c0;
        if (discriminant >= 0.0) {
            const double half = -0.5 * (p.c1 + std::copysign(std::sqrt(discriminant), p.c1));
            if (p.c2 != 0.0) roots[found++] = half / p.c2;
            if (half != 0.0) roots[found++] = p.c0 / half;
        }
        if (found == 2 && roots[1] < roots[0]) std::swap(roots[0], roots[1]);
        int count = 0;
        for (int i = 0; i < found; ++i) {
            if (roots[i] > from && roots[i] < to) cuts[count++] = roots[i];
        }
        return count;
    }

    static void append(Envelope& out, const Foot& foot, double end) {
        if (!out.empty()) {
            Foot& last = out.back();
            if (end <= last.end) return;
            if (last.x == foot.x && last.y == foot.y && last.dx == foot.dx && last.dy == foot.dy) {
                last.end = end;
                return;
            }
        }
        out.push_back(foot);
        out.back().end = end;
    }

    double length_;
    double x_, y_, dx_, dy_;  // where it starts, and its direction
};

Envelope envelope(const Walk& walk, const Edges& border) {
    const std::vector<size_t> edges = walk.candidates(border);
    return walk.nearest(border, edges.data(), edges.data() + edges.size());
}

}  // namespace

std::vector<WidthPiece> width_pieces(const Segment& segment, const Edges& inner, const Edges& outer) {
    const Walk walk(segment);
    const Envelope left = envelope(walk, inner), right = envelope(walk, outer);
    std::vector<WidthPiece> pieces;
    for (size_t i = 0, k = 0; i < left.size() && k < right.size();) {
        const Foot &a = left[i], &b = right[k];
        pieces.push_back({std::min(a.end, b.end), a.x - b.x, a.y - b.y, a.dx - b.dx, a.dy - b.dy});
        i += a.end <= b.end ? 1 : 0;
        k += b.end <= a.end ? 1 : 0;
    }
    pieces.back().end = std::numeric_limits<double>::infinity();
    return pieces;
}

}  // namespace racecraft
