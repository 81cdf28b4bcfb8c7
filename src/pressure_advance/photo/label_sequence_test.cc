// Drawn labels: strokes of filament on plate, or of the tab's own filament by their shading.
#include "pressure_advance/photo/label_sequence.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "base/random.h"

namespace trammel::pressure_advance {
namespace {

using ::testing::DoubleNear;
using ::testing::HasSubstr;
using ::testing::Pointwise;

constexpr double kPx = 10;  // per mm
constexpr double kRow_mm = 8, kLeft_mm = 6;

// Strokes of the digits 0 to 9 in a cell of 2 x 4 mm, as pairs of ends.
using Strokes = std::vector<std::array<double, 4>>;

Strokes StrokesOf(char character) {
  static const std::vector<Strokes> kDigits = {
      {{0, 0, 2, 0}, {2, 0, 2, 4}, {2, 4, 0, 4}, {0, 4, 0, 0}},
      {{1, 0, 1, 4}},
      {{0, 4, 2, 4}, {2, 4, 2, 2}, {2, 2, 0, 2}, {0, 2, 0, 0}, {0, 0, 2, 0}},
      {{0, 4, 2, 4}, {2, 4, 2, 0}, {2, 0, 0, 0}, {0, 2, 2, 2}},
      {{0, 4, 0, 2}, {0, 2, 2, 2}, {2, 4, 2, 0}},
      {{2, 4, 0, 4}, {0, 4, 0, 2}, {0, 2, 2, 2}, {2, 2, 2, 0}, {2, 0, 0, 0}},
      {{2, 4, 0, 4}, {0, 4, 0, 0}, {0, 0, 2, 0}, {2, 0, 2, 2}, {2, 2, 0, 2}},
      {{0, 4, 2, 4}, {2, 4, 2, 0}},
      {{0, 0, 2, 0}, {2, 0, 2, 4}, {2, 4, 0, 4}, {0, 4, 0, 0}, {0, 2, 2, 2}},
      {{2, 2, 0, 2}, {0, 2, 0, 4}, {0, 4, 2, 4}, {2, 4, 2, 0}}};
  if (character == '.') return {{1, 0, 1, 1}};
  return kDigits[static_cast<std::size_t>(character - '0')];
}

struct Drawing {
  std::vector<std::string> texts;
  bool shaded = false;  // strokes have the ground's colour, one bright and one dark flank
  double noise = 8;
  double aside_mm = 0.3;
};

// Draws the labels from the bottom upwards, in Orca's cells.
Frame Draw(const Drawing& drawing) {
  const int width = 28 * static_cast<int>(kPx);
  const int height = static_cast<int>(kRow_mm * kPx) * static_cast<int>(drawing.texts.size() + 1);
  cv::Mat grey(height, width, CV_8U, cv::Scalar(120));
  const auto stroke = [&](double from_x, double from_y, const std::array<double, 4>& ends,
                          double off_px, int value, int thickness) {
    const auto at = [&](double x, double y) {
      return cv::Point(cvRound((from_x + x) * kPx + off_px), cvRound(from_y - y * kPx + off_px));
    };
    cv::line(grey, at(ends[0], ends[1]), at(ends[2], ends[3]), value, thickness, cv::LINE_AA);
  };
  for (std::size_t label = 0; label < drawing.texts.size(); ++label) {
    double x = kLeft_mm + drawing.aside_mm;
    const double y = height - kRow_mm * kPx * (static_cast<double>(label) + 0.5);
    for (const char character : drawing.texts[label]) {
      for (const auto& ends : StrokesOf(character)) {
        if (drawing.shaded) {
          stroke(x, y, ends, -2, 150, 2);
          stroke(x, y, ends, 2, 90, 2);
        } else {
          stroke(x, y, ends, 0, 220, 5);
        }
      }
      x += 3;
    }
  }
  cv::GaussianBlur(grey, grey, {}, 1);
  Random random(3);
  Frame frame(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const auto value = cv::saturate_cast<std::uint8_t>(grey.at<std::uint8_t>(y, x) +
                                                         drawing.noise * random.Normal());
      for (int c = 0; c < 3; ++c) frame.row(y)[3 * x + c] = value;
    }
  }
  return frame;
}

SequenceReading Read(const Drawing& drawing, const std::vector<double>& given_s = {}) {
  const Frame frame = Draw(drawing);
  LabelPlaces places;
  places.formats = {{{}, false, 4, 5}};
  for (std::size_t label = 0; label < drawing.texts.size(); ++label) {
    const double y = frame.height - kRow_mm * kPx * (static_cast<double>(label) + 0.5);
    places.photo_from_label.push_back({{kPx, 0, kLeft_mm * kPx, 0, -kPx, y, 0, 0, 1}});
  }
  return ReadSequence(frame.view(), {places}, 2 * drawing.texts.size() - 1, given_s);
}

std::vector<double> Values(double start, double step, int count) {
  std::vector<double> values;
  for (int i = 0; i < count; ++i) values.push_back(start + i * step);
  return values;
}

const std::vector<std::string> kUsual = {"0",    "0.01", "0.02", "0.03", "0.04",
                                         "0.05", "0.06", "0.07", "0.08"};

TEST(ReadSequence, ReadsFilamentOnPlateAndOnATab) {
  for (const bool shaded : {false, true}) {
    const SequenceReading reading = Read({kUsual, shaded});
    ASSERT_EQ(reading.problem, "") << shaded;
    EXPECT_THAT(reading.values_s, Pointwise(DoubleNear(1e-9), Values(0, 0.005, 17)));
  }
}

TEST(ReadSequence, ReadsValuesThatWereCut) {
  const SequenceReading reading =
      Read({{"0.01", "0.015", "0.02", "0.025", "0.03", "0.035", "0.04", "0.045"}});
  ASSERT_EQ(reading.problem, "");
  EXPECT_THAT(reading.values_s, Pointwise(DoubleNear(1e-9), Values(0.01, 0.0025, 15)));
  const SequenceReading cut = Read({{"0", "0.002", "0.005", "0.007", "0.01", "0.012", "0.015"}});
  ASSERT_EQ(cut.problem, "");
  EXPECT_THAT(cut.values_s, Pointwise(DoubleNear(1e-9), Values(0, 0.00125, 13)));
}

TEST(ReadSequence, AHiddenLabelDoesNoHarm) {
  std::vector<std::string> texts = kUsual;
  texts[3].clear();
  EXPECT_EQ(Read({texts}).problem, "");
}

TEST(ReadSequence, RefusesWhatIsNoSequence) {
  EXPECT_NE(Read({std::vector<std::string>(9)}).problem, "");
  std::vector<std::string> texts = kUsual;
  texts[6] = "0.09";
  EXPECT_THAT(Read({texts}).problem, HasSubstr("0.09"));
  // Steps of 0.0137 are in no list: near ones must not be taken for them.
  EXPECT_NE(Read({{"0.013", "0.040", "0.067", "0.095", "0.122", "0.150", "0.177"}}).problem, "");
}

TEST(ReadSequence, RefusesNoiseThatHidesTheDigits) {
  Drawing drawing{kUsual, true};
  drawing.noise = 200;
  EXPECT_NE(Read(drawing).problem, "");
}

TEST(ReadSequence, PrefersGivenValuesUnlessTheLabelsContradict) {
  EXPECT_TRUE(Read({kUsual}, Values(0, 0.005, 17)).values_s.empty());
  EXPECT_FALSE(Read({kUsual}, Values(0, 0.004, 17)).values_s.empty());
}

}  // namespace
}  // namespace trammel::pressure_advance
