#include "racecraft/face_fill.hpp"

#include <algorithm>
#include <utility>

#include "check.hpp"

using namespace racecraft;

namespace {

constexpr int32_t kWidth = 32, kHeight = 40;
constexpr uint8_t kBehind = 10, kShade = 210;

// Corners in order, pixels.
Polygon polygon_of(const std::vector<std::pair<float, float>>& corners) {
    Polygon polygon{};
    for (const auto& [x, y] : corners) {
        polygon.x[polygon.count] = x;
        polygon.y[polygon.count] = y;
        ++polygon.count;
    }
    return polygon;
}

// A picture with faces over an even ground, drawn in bands of so many rows.
std::vector<uint8_t> drawn(std::vector<Polygon> polygons, int32_t band = kHeight) {
    std::vector<uint8_t> picture(kWidth * kHeight, kBehind);
    for (int32_t row = 0; row < kHeight; row += band) {
        FaceFiller<kWidth> filler(kWidth, kHeight, row, std::min(row + band, kHeight), picture.data());
        for (Polygon& polygon : polygons) filler.prepare(polygon, kShade * kCover / 256);
        filler.draw(polygons.data(), static_cast<int>(polygons.size()));
    }
    return picture;
}

// Pixels that are covered, whole and in part.
double area(const std::vector<uint8_t>& picture) {
    double sum = 0.0;
    for (const uint8_t pixel : picture) sum += (pixel - kBehind) / static_cast<double>(kShade - kBehind);
    return sum;
}

}  // namespace

TEST(a_line_through_a_corner_is_cut_where_it_goes_through) {
    Polygon diamond = polygon_of({{2, 0}, {4, 2}, {2, 4}, {0, 2}});
    CHECK(FaceFiller<kWidth>(kWidth, kHeight, 0, kHeight, nullptr).prepare(diamond, 0));
    const float y[5] = {-0.5f, 1.0f, 2.0f, 3.5f, 4.0f};
    float left[5], right[5];
    find_spans(diamond, y, 0.0f, 8.0f, left, right);
    CHECK(left[0] >= right[0]);
    CHECK_EQUAL(left[1], 1.0f);
    CHECK_EQUAL(right[1], 3.0f);
    CHECK_EQUAL(left[2], 0.0f);
    CHECK_EQUAL(right[2], 4.0f);
    CHECK_EQUAL(left[3], 1.5f);
    CHECK_EQUAL(right[3], 2.5f);
    CHECK(left[4] >= right[4]);  // a face ends above its lowest corner, where the next one begins
}

TEST(a_rectangle_covers_its_area_to_the_part_of_a_pixel) {
    const auto picture = drawn({polygon_of({{3.25f, 5.6f}, {9.5f, 5.6f}, {9.5f, 30.75f}, {3.25f, 30.75f}})});
    const auto cover = [&](int x, int y) {
        return (picture[static_cast<size_t>(y * kWidth + x)] - kBehind) /
               static_cast<double>(kShade - kBehind);
    };
    CHECK_NEAR(cover(5, 10), 1.0, 0.01);
    CHECK_NEAR(cover(3, 10), 0.75, 0.01);
    CHECK_NEAR(cover(9, 10), 0.5, 0.01);
    CHECK_NEAR(cover(5, 5), 0.5, 0.01);  // two of four lines, which lie in the middles of quarters
    CHECK_NEAR(cover(5, 30), 0.75, 0.01);
    CHECK_NEAR(cover(3, 5), 0.375, 0.01);
    CHECK_NEAR(cover(9, 5), 0.25, 0.01);
    CHECK_NEAR(cover(9, 30), 0.375, 0.01);
    CHECK_NEAR(cover(2, 10), 0.0, 0.0);
    CHECK_NEAR(cover(10, 10), 0.0, 0.0);
    CHECK_NEAR(cover(5, 4), 0.0, 0.0);
    CHECK_NEAR(cover(5, 31), 0.0, 0.0);
    CHECK_NEAR(area(picture), 6.25 * 25.15, 1.0);
}

TEST(slanted_faces_cover_their_area_in_any_bands) {
    const std::vector<Polygon> triangle = {polygon_of({{4.0f, 2.125f}, {28.0f, 12.0f}, {9.0f, 37.375f}})};
    const double expected = 0.5 * (24.0 * 35.25 - 5.0 * 9.875);
    const auto whole = drawn(triangle);
    CHECK_NEAR(area(whole), expected, 0.01 * expected);
    for (const int32_t band : {1, 3, 16, 17}) CHECK(drawn(triangle, band) == whole);
}

TEST(faces_that_share_an_edge_leave_no_gap_and_no_seam) {
    const auto picture = drawn({polygon_of({{4, 3}, {20, 3}, {14, 36}, {4, 36}}),
                                polygon_of({{20, 3}, {30, 3}, {30, 36}, {14, 36}})});
    for (int y = 3; y < 36; ++y) {
        for (int x = 4; x < 30; ++x) CHECK(picture[static_cast<size_t>(y * kWidth + x)] >= kShade - 2);
    }
}

TEST(what_the_image_does_not_show_is_left_out) {
    const FaceFiller<kWidth> filler(kWidth, kHeight, 0, kHeight, nullptr);
    for (const auto& [x, y] : {std::pair{-9.0f, 5.0f}, {32.0f, 5.0f}, {5.0f, -9.0f}, {5.0f, 40.0f}}) {
        Polygon beside = polygon_of({{x, y}, {x + 9, y}, {x + 9, y + 9}, {x, y + 9}});
        CHECK(!filler.prepare(beside, 0));
    }
    const auto half = drawn({polygon_of({{-6, -7}, {6, -7}, {6, 7}, {-6, 7}})});
    CHECK_NEAR(area(half), 42.0, 0.2);
}
