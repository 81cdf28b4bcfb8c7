// Targets that look for printed patterns in pixels.
#include <cmath>
#include <cstdint>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "base/frame.h"
#include "fuzz.h"
#include "pressure_advance/photo/chevron_reader.h"
#include "pressure_advance/photo/photo_lines.h"
#include "pressure_advance/photo/photo_reader.h"
#include "pressure_advance/photo/photo_search.h"
#include "vision/segment_digits.h"

namespace trammel::fuzz {
namespace {

using namespace pressure_advance;

// Picture as its even width, and pairs of a run's length and its colour: 3 bits of red and green, 2
// of blue.
Frame PictureOf(std::string_view text) {
  constexpr std::size_t kMaxPixels = 120 * 120;
  if (text.empty()) return {};
  const auto width = static_cast<std::size_t>(static_cast<std::uint8_t>(text[0]) & ~1U);
  std::vector<std::uint8_t> bgr;
  for (std::size_t i = 1; i + 1 < text.size() && bgr.size() < 3 * kMaxPixels; i += 2) {
    const unsigned colour = static_cast<std::uint8_t>(text[i + 1]);
    const std::uint8_t pixel[] = {static_cast<std::uint8_t>((colour & 3) * 85),
                                  static_cast<std::uint8_t>((colour >> 2 & 7) * 36),
                                  static_cast<std::uint8_t>((colour >> 5) * 36)};
    for (int run = static_cast<std::uint8_t>(text[i]); run > 0; --run) {
      bgr.insert(bgr.end(), pixel, pixel + 3);
    }
  }
  const std::size_t height = width == 0 ? 0 : bgr.size() / (3 * width);
  if (height == 0) return {};
  bgr.resize(3 * width * height);
  Frame frame;
  frame.width = static_cast<int>(width);
  frame.height = static_cast<int>(height);
  frame.bgr = std::move(bgr);
  return frame;
}

// Chevrons in a small photo, or lines with and without a frame. Each alone, as a search takes a
// second with the sanitizers: an odd first byte selects chevrons.
FUZZ_TARGET(photo_pattern)(std::string_view text) {
  PhotoSearch photo(PictureOf(text));
  if (!text.empty() && text[0] % 2 != 0) {
    const ChevronView view = ViewChevrons(photo);
    if (!view.problem.empty()) return;
    Require(view.found.count >= 6, "chevrons are counted");
    const auto readings = ReadChevrons(view, 1);
    Require(readings.size() == static_cast<std::size_t>(view.found.count), "each corner is read");
    for (const ChevronReading& reading : readings) {
      Require(!reading.unusable.empty() || std::isfinite(reading.surplus), "a surplus is a number");
    }
    return;
  }
  PhotoOptions options;
  options.pressure_advance_s = {0, 0.01, 0.02, 0.03, 0.04, 0.05};
  for (const bool framed : {false, true}) {
    options.framed = framed;
    PhotoLines lines = FindPhotoLines(photo, options);
    if (!lines.problem.empty()) continue;
    options.pressure_advance_s.resize(PlacesOf(lines.line_pattern));
    for (std::size_t i = 0; i < options.pressure_advance_s.size(); ++i) {
      options.pressure_advance_s[i] = 0.01 * static_cast<double>(i);
    }
    const PhotoMeasurement measured = MeasurePhotoLines(std::move(lines), options);
    Require(measured.refusal.empty() != measured.profiles.empty(), "profiles, or why not");
  }
}

// Strokes of printed numbers: nine 16-bit numbers of a homography in 1/256, two of an offset in
// 0.1 mm, then the text, a line of "----" and the picture.
FUZZ_TARGET(label_strokes)(std::string_view text) {
  std::int16_t numbers[11];
  if (text.size() < sizeof numbers) return;
  std::memcpy(numbers, text.data(), sizeof numbers);
  const auto parts = Parts(text.substr(sizeof numbers), 2);
  const Frame picture = PictureOf(parts[1]);
  if (picture.width == 0) return;
  vision::Homography photo_from_label;
  for (std::size_t i = 0; i < 9; ++i) photo_from_label.m[i] = numbers[i] / 256.0;
  vision::Homography next = photo_from_label;
  next.m[5] += 20;
  constexpr int kLongest_mm = 14;
  const vision::LabelRow row(picture.view(), {photo_from_label, next}, kLongest_mm);
  const auto offset_mm = [&](int i) { return numbers[i] % 15 / 10.0; };
  const vision::StrokeTable table = row.TableAt({offset_mm(9), offset_mm(10), 1});
  for (const bool narrow : {false, true}) {
    const vision::GlyphSums sums = table.SumsOf({narrow, narrow});
    vision::StrokeSum total;
    sums.Add(0, parts[0], total);
    sums.Add(1, parts[0], total);
    Require(std::isfinite(table.LogLikelihood(total)), "a likelihood is a number");
  }
}

}  // namespace
}  // namespace trammel::fuzz
