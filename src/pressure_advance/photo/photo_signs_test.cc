// Marks, bars and numbers around drawn lines, whichever way the picture lies.
#include "pressure_advance/photo/photo_signs.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

namespace trammel::pressure_advance {
namespace {

using vision::GrayImage;
using vision::LinePattern;

constexpr double kPx = 8;  // per mm
constexpr int kWidth = 860, kHeight = 900;
constexpr double kLeft = 120, kRight = 760, kPitch = 40, kBottom = 780;

// Filament at a place of the pattern, in mm: x from the lines' starts, y up from the first line.
using Drawing = std::function<bool(double x, double y)>;

struct Drawn {
  GrayImage contrast{kWidth, kHeight};
  LinePattern pattern;
};

// Draws lines 80 mm long and 5 mm apart, and what is beside them; turned by half a turn or not.
Drawn Draw(int lines, const Drawing& beside, bool turned) {
  Drawn drawn;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const int px = turned ? kWidth - 1 - x : x, py = turned ? kHeight - 1 - y : y;
      const double x_mm = (px - kLeft) / kPx, y_mm = (kBottom - py) / kPx;
      const double place = std::round(y_mm / 5);
      const bool line =
          place >= 0 && place < lines && std::abs(y_mm - 5 * place) < 0.4 && x_mm >= 0 && x_mm < 80;
      drawn.contrast.row(y)[x] = line || beside(x_mm, y_mm) ? 100 : 0;
    }
  }
  LinePattern& p = drawn.pattern;
  const auto level = [](double value, double centre) {
    return vision::Curve{centre, 1, value, 0, 0};
  };
  for (int i = 0; i < lines; ++i) {
    const double y =
        turned ? kHeight - 1 - kBottom + i * kPitch : kBottom - (lines - 1 - i) * kPitch;
    p.rungs.push_back(level(y, kWidth / 2.0));
    if (i > 0) p.steps.push_back(1);
  }
  p.pitch_px = kPitch;
  p.bead_px = 0.8 * kPx;
  p.left_inner = level(turned ? kWidth - 1 - kRight : kLeft, kHeight / 2.0);
  p.right_inner = level(turned ? kWidth - 1 - kLeft : kRight, kHeight / 2.0);
  return drawn;
}

PrintedSigns Find(int lines, const Drawing& beside, bool turned) {
  const Drawn drawn = Draw(lines, beside, turned);
  return FindPrintedSigns(drawn.contrast, drawn.pattern, 0.25, 0.25);
}

bool Marks(double x, double y, double from_mm) {
  return y > from_mm && y < from_mm + 20 && (std::abs(x - 20) < 0.4 || std::abs(x - 60) < 0.4);
}

bool Numbers(double x, double y, int lines) {
  const double place = 2 * std::round(y / 10);
  const double in = std::fmod(x - 82, 3);
  return x > 82 && x < 90 && place >= 0 && place < lines && std::abs(y - 5 * place) < 2 &&
         (in < 0.6 || std::abs(y - 5 * place) > 1.4);
}

bool Bar(double x, double y, double at_mm, double from_mm, double to_mm) {
  return std::abs(x - at_mm) < 0.6 && y > from_mm && y < to_mm;
}

TEST(PrintedSigns, MarksAndNumbersShowLastLineAndEnds) {
  for (const bool turned : {false, true}) {
    for (const double distance_mm : {5.0, 10.0}) {
      const auto beside = [&](double x, double y) {
        return Marks(x, y, 65 + distance_mm) || Numbers(x, y, 14);
      };
      const PrintedSigns signs = Find(14, beside, turned);
      EXPECT_EQ(signs.last_at_bottom, turned) << distance_mm;
      EXPECT_EQ(signs.end_at_right, !turned) << distance_mm;
    }
  }
}

TEST(PrintedSigns, NumbersOfAnEvenCountShowTheFirstLine) {
  for (const bool turned : {false, true}) {
    for (const int lines : {13, 14}) {
      const auto beside = [&](double x, double y) { return Numbers(x, y, lines); };
      const PrintedSigns signs = Find(lines, beside, turned);
      EXPECT_EQ(signs.end_at_right, !turned) << lines;
      EXPECT_EQ(signs.last_at_bottom.has_value(), lines % 2 == 0);
      if (signs.last_at_bottom) EXPECT_EQ(*signs.last_at_bottom, turned);
    }
  }
}

TEST(PrintedSigns, BarsShowTheLastLineWhereTheyGoOn) {
  for (const bool turned : {false, true}) {
    const auto beside = [](double x, double y) {
      return Bar(x, y, 0, 0, 65) || Bar(x, y, 80, 0, 65);
    };
    const PrintedSigns signs = Find(13, beside, turned);
    EXPECT_EQ(signs.last_at_bottom, turned);
    EXPECT_FALSE(signs.end_at_right.has_value());
  }
}

TEST(PrintedSigns, OneBarAloneIsAtTheStartAndABoxAtTheEnd) {
  for (const bool turned : {false, true}) {
    const auto prime = [](double x, double y) { return Bar(x, y, -8, -20, 90); };
    EXPECT_EQ(Find(13, prime, turned).end_at_right, !turned);
    const auto box = [](double x, double y) {
      return Bar(x, y, 0, 0, 65) || (x >= 80 && y > -5 && y < 65);
    };
    EXPECT_EQ(Find(13, box, turned).end_at_right, !turned);
    EXPECT_EQ(Find(13, box, turned).last_at_bottom, turned);
  }
}

TEST(PrintedSigns, SayNothingOfBareLines) {
  const PrintedSigns signs = Find(
      13, [](double, double) { return false; }, false);
  EXPECT_FALSE(signs.last_at_bottom.has_value());
  EXPECT_FALSE(signs.end_at_right.has_value());
}

}  // namespace
}  // namespace trammel::pressure_advance
