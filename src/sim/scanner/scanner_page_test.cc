#include "sim/scanner/scanner_page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <numbers>
#include <vector>

#include "sim/scanner/scanner_traits.h"

namespace trammel::sim {
namespace {

constexpr std::uint64_t kSeed = 21;  // development
// A twentieth of the smallest effect that anybody looks for on such a page.
constexpr double kPlaceMm = 0.0001;

// Straight lines of one tool with ideal edges, 0.4 mm wide, from (x, y) along +y.
PrintedSheet Lines(const std::vector<double>& x_mm, double y_mm = 0, double length_mm = 6) {
  PrintedSheet sheet;
  sheet.paper = {0.8, 0.8, 0.8};
  sheet.inks.fill({0.05, 0.05, 0.05});
  for (const double x : x_mm) {
    InkStroke stroke{0, 1, true, {0, 1}, {}};
    for (int i = 0; i <= 120; ++i)
      stroke.points.push_back({{x, y_mm + length_mm * i / 120}, 0.2, 0.2});
    sheet.strokes.push_back(stroke);
  }
  return sheet;
}

// 16 bits and no gamma: samples are proportional to reflectance.
ScannerTraits Exact() {
  ScannerTraits traits;
  traits.gamma = 1;
  traits.bits = 16;
  return traits;
}

double At(const ScannedPage& page, int x, int y, int channel = 0) {
  const auto at =
      static_cast<std::size_t>((y * page.format.width_px + x) * page.format.channels + channel);
  if (page.format.bits == 8) return page.samples[at] / 255.0;
  std::uint16_t value = 0;
  std::memcpy(&value, page.samples.data() + 2 * at, 2);
  return value / 65535.0;
}

ScannedPage Scanned(const PrintedSheet& sheet, const ScannerTraits& traits) {
  const auto page = ScanSheet(sheet, traits, Random(kSeed));
  EXPECT_TRUE(page) << (page ? "" : page.error().message);
  return page ? *page : ScannedPage{};
}

// The centroid of the darkness in a window of a row or, `across`, of a column; px.
double Centroid(const ScannedPage& page, double near_px, int other_px, double half_px,
                bool along_y = false) {
  double mass = 0;
  double moment = 0;
  const int first = static_cast<int>(near_px - half_px);
  for (int i = first; i <= first + static_cast<int>(2 * half_px); ++i) {
    const double dark = 0.8 - (along_y ? At(page, other_px, i) : At(page, i, other_px));
    mass += dark;
    moment += dark * i;
  }
  return moment / mass;
}

TEST(ScannerPage, LinesLieWhereTheyBelongToATenthOfAMicron) {
  std::vector<double> x_mm;
  for (int i = 0; i < 40; ++i) x_mm.push_back(1.0371 * i);
  const PrintedSheet sheet = Lines(x_mm);
  for (const double dpi : {300.0, 600.0, 1200.0}) {
    for (const double blur_mm : {0.0, 0.03}) {
      ScannerTraits traits = Exact();
      traits.dpi = dpi;
      traits.blur_mm = blur_mm;
      const ScannedPage page = Scanned(sheet, traits);
      const auto scan = SheetScan::Lay(sheet, traits);
      double worst_mm = 0;
      for (const double x : x_mm) {
        const auto place = scan->PlaceOf({x, 3});
        const double seen = Centroid(page, place[0], static_cast<int>(place[1]), 0.45 * dpi / 25.4);
        worst_mm = std::max(worst_mm, std::abs(seen - place[0]) * 25.4 / dpi);
      }
      EXPECT_LT(worst_mm, kPlaceMm) << dpi << " dpi, blur " << blur_mm;
    }
  }
}

TEST(ScannerPage, TurnedSkewedScaledAndMirroredLinesToo) {
  const PrintedSheet sheet = Lines({0, 2.013, 7.771}, 0, 20);
  for (const double turn_deg : {3.0, 45.0, 88.0, 181.5, 272.0}) {
    for (const bool mirrored : {false, true}) {
      ScannerTraits traits = Exact();
      traits.rotation_rad = turn_deg * std::numbers::pi / 180;
      traits.scale_x = 1.004;
      traits.scale_y = 0.997;
      traits.skew = 0.001;
      traits.bar = {{0.03, 200, 1}};
      traits.mirrored = mirrored;
      const ScannedPage page = Scanned(sheet, traits);
      const auto scan = SheetScan::Lay(sheet, traits);
      const auto top = scan->PlaceOf({2.013, 5});
      const auto bottom = scan->PlaceOf({2.013, 15});
      const bool along_y = std::abs(top[0] - bottom[0]) > std::abs(top[1] - bottom[1]);
      const std::size_t across = along_y ? 1 : 0;
      // Mean over whole rows from one known place to the other.
      const std::size_t run = 1 - across;
      const int first = static_cast<int>(std::min(top[run], bottom[run]));
      const int last = static_cast<int>(std::max(top[run], bottom[run]));
      double worst_px = 0;
      for (int row = first; row <= last; row += 7) {
        const double share = (row - top[run]) / (bottom[run] - top[run]);
        const double line = top[across] + share * (bottom[across] - top[across]);
        const double seen = Centroid(page, line, row, 15, along_y);
        worst_px = std::max(worst_px, std::abs(seen - line));
      }
      // The bar's error bends the line by 0.03 (pi 10 / 200)^2 / 2 mm = 0.4 um at most.
      EXPECT_LT(worst_px * 25.4 / 600, kPlaceMm + 0.0004) << turn_deg << " mirrored " << mirrored;
    }
  }
}

TEST(ScannerPage, InkCoversItsAreaExactly) {
  const PrintedSheet sheet = Lines({0.0171});
  const ScannedPage page = Scanned(sheet, Exact());
  double dark = 0;
  for (int y = 0; y < page.format.height_px; ++y) {
    for (int x = 0; x < page.format.width_px; ++x) dark += 0.8 - At(page, x, y);
  }
  // A rectangle and two half circles, these as half polygons of 16 sides.
  const double round_mm2 = 8 * 0.2 * 0.2 * std::sin(std::numbers::pi / 8);
  const double area_mm2 = dark / 0.75 * (25.4 / 600) * (25.4 / 600);
  // Rounding to 16 bit leaves 1e-5 of each of the edge's pixels.
  EXPECT_NEAR(area_mm2, 0.4 * 6 + round_mm2, 2e-4);
}

TEST(ScannerPage, ShadowsFallOnOneSideOfALineAcrossTheBar) {
  PrintedSheet sheet = Lines({0});
  ScannerTraits traits = Exact();
  traits.rotation_rad = std::numbers::pi / 2;  // the line lies across the bar's way
  traits.shadow_strength = 0.4;
  traits.shadow_mm = 0.2;
  const auto brightness = [&](double x_mm) {
    const ScannedPage page = Scanned(sheet, traits);
    const auto place = SheetScan::Lay(sheet, traits)->PlaceOf({x_mm, 3});
    return At(page, static_cast<int>(std::lround(place[0])),
              static_cast<int>(std::lround(place[1])));
  };
  // +x of the sheet is up in the picture: the shadow falls below, at -x.
  EXPECT_NEAR(brightness(0.3), 0.8, 1e-3);
  EXPECT_NEAR(brightness(-0.5), 0.8, 1e-3);
  // Half way through the penumbra half of the loss is left; a pixel is a fifth of it wide.
  EXPECT_NEAR(brightness(-0.3), 0.8 * (1 - 0.2), 0.8 * 0.4 * 0.25);
  traits.shadow_below = false;
  EXPECT_NEAR(brightness(-0.3), 0.8, 1e-3);
  EXPECT_LT(brightness(0.3), 0.72);
}

TEST(ScannerPage, APageSeenAslantIsLargerWhereItIsNearer) {
  ScannerTraits traits = Exact();
  traits.perspective_x = 0.04;
  const PrintedSheet sheet = Lines({-20, -18, 0, 2, 18, 20});
  const auto map = ScannerMap::Make(sheet, traits);
  ASSERT_TRUE(map);
  const auto x = [&](double at_mm) { return map->PixelOf({at_mm, 3}).x_px; };
  const double area_mm = 2 * (20 + 10);
  const auto larger = [&](double at_mm) { return std::pow(1 - 0.04 * at_mm / area_mm, -2.0); };
  EXPECT_NEAR((x(20) - x(18)) / (x(-18) - x(-20)), larger(19) / larger(-19), 1e-3);
  EXPECT_NEAR(x(0), 30 * traits.dpi / 25.4, 1e-9);  // the middle stays
}

}  // namespace
}  // namespace trammel::sim
