#include "vision/laser_line.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <limits>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "base/random.h"
#include "base/statistics.h"
#include "geometry/robust_line.h"
#include "vision/stripe_search.h"

namespace trammel::vision {
namespace {

struct Look {
  double sigma_px = 2.5;
  double amplitude = 180;
  double ambient = 0;
  double noise = 0;    ///< grey levels
  double speckle = 0;  ///< contrast of single pixels
};

/// A red stripe whose centre in row y is centre(y), rounded to 8 bits.
Frame Draw(int width, int height, const std::function<double(int)>& centre, const Look& look,
           Random& random) {
  Frame frame(width, height);
  for (int y = 0; y < height; ++y) {
    std::uint8_t* out = frame.row(y);
    for (int x = 0; x < width; ++x) {
      const double t = (x - centre(y)) / look.sigma_px;
      const double light = look.amplitude * std::exp(-0.5 * t * t) *
                           std::max(0.0, 1 + look.speckle * random.Normal());
      const double red = look.ambient + light + look.noise * random.Normal();
      const double other = look.ambient + std::max(0.0, light - 160) + look.noise * random.Normal();
      for (int c = 0; c < 3; ++c) {
        out[3 * x + c] =
            static_cast<std::uint8_t>(std::clamp(std::round(c == 2 ? red : other), 0.0, 255.0));
      }
    }
  }
  return frame;
}

LaserLine Find(const Frame& frame, const LaserLineOptions& options = {}) {
  LaserLineWorkspace workspace;
  const std::vector<BgrView> views{frame.view()};
  LaserLine line;
  FindLaserLine(frame.view(), LearnStripe(views, options, workspace), options, workspace, line);
  return line;
}

double FoundShare(const LaserLine& line) {
  const auto found =
      std::count_if(line.sigma_px.begin(), line.sigma_px.end(), [](float s) { return s > 0; });
  return static_cast<double>(found) / static_cast<double>(line.sigma_px.size());
}

/// Rounding to 8 bits moves a row's centre by less: 0.3 levels on a stripe of 180.
constexpr double kRoundingPx = 0.02;

TEST(LaserLine, IsExactWithoutNoiseForStripesFromThinToWide) {
  Random random(1);
  for (const double sigma_px : {0.8, 1.5, 2.5, 4.0, 6.5}) {
    const auto centre = [](int y) { return 30.3 + 0.04 * y; };
    Look look;
    look.sigma_px = sigma_px;
    const LaserLine line = Find(Draw(80, 70, centre, look, random));
    ASSERT_EQ(FoundShare(line), 1) << "sigma " << sigma_px;
    for (int y = 0; y < 70; ++y) {
      EXPECT_NEAR(line.centre_px[static_cast<std::size_t>(y)], centre(y), kRoundingPx)
          << "sigma " << sigma_px << ", row " << y;
    }
  }
}

TEST(LaserLine, KeepsItsPlaceWhenTheCoreSaturates) {
  Random random(2);
  Look look;
  look.amplitude = 900;
  const LaserLine line = Find(Draw(
      60, 60, [](int) { return 28.37; }, look, random));
  ASSERT_EQ(FoundShare(line), 1);
  for (const float centre : line.centre_px) {
    EXPECT_NEAR(centre, 28.37, 0.05);
  }
}

TEST(LaserLine, PredictsTheScatterItHas) {
  Random random(3);
  for (const double speckle : {0.0, 0.3}) {
    Look look;
    look.noise = 4;
    look.ambient = 30;
    look.speckle = speckle;
    LaserLineOptions options;
    options.row_smoothing = 0;
    std::vector<double> pulls;
    double bias = 0;
    for (int trial = 0; trial < 20; ++trial) {
      const double centre = random.Uniform(25, 35);
      const LaserLine line = Find(Draw(
                                      64, 80, [&](int) { return centre; }, look, random),
                                  options);
      for (std::size_t y = 0; y < line.centre_px.size(); ++y) {
        ASSERT_TRUE(line.found(y));
        pulls.push_back((line.centre_px[y] - centre) / line.sigma_px[y]);
        bias += (line.centre_px[y] - centre) / 1600;
      }
    }
    // The scale of each frame comes from some 70 second differences: 15 %.
    EXPECT_NEAR(StandardDeviation(pulls), 1, 0.2) << "speckle " << speckle << ", seed 3";
    EXPECT_LT(std::abs(bias), 0.02) << "speckle " << speckle << ", seed 3";
  }
}

// No unbiased estimator of a Gaussian stripe's centre in one row scatters by less, in white noise.
TEST(LaserLine, ScattersAsLittleAsWhiteNoiseAllows) {
  Random random(10);
  Look look;
  look.noise = 4;
  look.ambient = 30;
  for (const double sigma_px : {1.5, 2.5, 4.0}) {
    look.sigma_px = sigma_px;
    const double bound_px = look.noise / look.amplitude * std::sqrt(2 * sigma_px / std::sqrt(M_PI));
    LaserLineOptions options;
    options.row_smoothing = 0;
    const StripeModel model{.sigma_px = static_cast<float>(sigma_px)};
    LaserLineWorkspace workspace;
    LaserLine line;
    std::vector<double> errors;
    for (int trial = 0; trial < 40; ++trial) {
      const double centre = random.Uniform(25, 35);
      const Frame frame = Draw(
          64, 50, [&](int) { return centre; }, look, random);
      FindLaserLine(frame.view(), model, options, workspace, line);
      for (const float centre_px : line.centre_px) errors.push_back(centre_px - centre);
    }
    // 2000 rows know their scatter to 1.6 %; the background has to be found, too.
    EXPECT_LT(StandardDeviation(errors), 1.08 * bound_px) << "sigma " << sigma_px << ", seed 10";
    EXPECT_GT(StandardDeviation(errors), 0.94 * bound_px) << "sigma " << sigma_px << ", seed 10";
    EXPECT_LT(std::abs(Mean(errors)), 4 * bound_px / std::sqrt(2000.0))
        << "sigma " << sigma_px << ", seed 10";
  }
}

// In speckle the steadiest Gaussian is about twice as wide as the stripe.
TEST(LaserLine, LearnsAsWideAGaussianAsItMay) {
  Random random(14);
  const Look look{.sigma_px = 6, .noise = 2, .speckle = 0.4};
  const Frame frame = Draw(
      110, 120, [](int) { return 54.3; }, look, random);
  const BgrView view = frame.view();
  LaserLineWorkspace workspace;
  EXPECT_EQ(LearnStripe({&view, 1}, {.max_sigma_px = 8}, workspace).sigma_px, 8);
  EXPECT_LT(LearnStripe({&view, 1}, {.max_sigma_px = 7.9}, workspace).sigma_px, 7.9);
}

TEST(LaserLine, FollowsAStepToAStripeAThirdAsBright) {
  Random random(4);
  const auto on_bead = [](int y) { return y >= 24 && y < 38; };
  Frame plate = Draw(
      45, 60, [](int) { return 35.2; }, {.noise = 2}, random);
  const Frame bead = Draw(
      45, 60, [](int) { return 24.6; }, {.amplitude = 60, .noise = 2}, random);
  for (int y = 0; y < 60; ++y) {
    if (on_bead(y)) {
      std::copy_n(bead.view().row(y), 3 * 45, plate.row(y));
    }
  }
  LaserLineOptions options;
  options.row_smoothing = 0;
  const LaserLine line = Find(plate, options);
  for (int y = 0; y < 60; ++y) {
    const auto row = static_cast<std::size_t>(y);
    ASSERT_TRUE(line.found(row)) << y;
    EXPECT_NEAR(line.centre_px[row], on_bead(y) ? 24.6 : 35.2, 0.5) << y;
  }
}

TEST(LaserLine, MarksRowsInShadowAndNeverGivesNaN) {
  Random random(5);
  Frame frame = Draw(
      45, 60, [](int) { return 22.0; }, {.noise = 1}, random);
  for (int y = 20; y < 26; ++y) {
    std::fill_n(frame.row(y), 3 * 45, std::uint8_t{2});
  }
  const LaserLine line = Find(frame);
  for (std::size_t y = 0; y < 60; ++y) {
    EXPECT_TRUE(std::isfinite(line.centre_px[y]) && std::isfinite(line.sigma_px[y]));
    EXPECT_EQ(line.found(y), y < 20 || y >= 26) << y;
  }
}

TEST(LaserLine, IsNotCapturedByGlintsBesideIt) {
  Random random(6);
  Frame frame = Draw(
      120, 100, [](int y) { return 60 + 0.03 * y; }, {.noise = 3}, random);
  for (int i = 0; i < 150; ++i) {  // white, brighter than the line
    const int x = static_cast<int>(random.Below(116));
    const int y = static_cast<int>(random.Below(98));
    if (std::abs(x - 60) < 12) {
      continue;  // a glint on the line itself does move it
    }
    for (int k = 0; k < 2; ++k) {
      std::fill_n(frame.row(y + k) + 3 * x, 3 * 4, std::uint8_t{250});
    }
  }
  const LaserLine line = Find(frame);
  std::size_t close = 0;
  for (std::size_t y = 0; y < 100; ++y) {
    close +=
        line.found(y) && std::abs(line.centre_px[y] - (60 + 0.03 * static_cast<double>(y))) < 2;
  }
  EXPECT_GE(close, 98U);
}

TEST(LaserLine, FindsNothingInBlackWhiteAndGreyFrames) {
  for (const int level : {0, 128, 255}) {
    Frame frame(45, 60);
    std::fill(frame.bgr.begin(), frame.bgr.end(), static_cast<std::uint8_t>(level));
    EXPECT_EQ(FoundShare(Find(frame)), 0) << level;
  }
}

// Recorded frames: see SOURCES.md beside them. The line is straight on each plate, so what is left
// after a straight line is the finder's error. A plain centroid leaves 0.5 px on matte, 1.2 px on
// textured and 0.6 px on PEI.
class RecordedFrames : public testing::Test {
 protected:
  void SetUp() override {
    const char* folder = std::getenv("TRAMMEL_TEST_DATA");
    if (folder == nullptr) {
      GTEST_SKIP() << "set TRAMMEL_TEST_DATA to the folder with laser/plates.jpg";
    }
    folder_ = std::string(folder) + "/laser/";
  }

  static Frame Rows(const cv::Mat& image, int first, int last) {
    Frame frame(image.cols, last - first);
    for (int y = first; y < last; ++y) {
      std::copy_n(image.ptr<std::uint8_t>(y), 3 * static_cast<std::size_t>(image.cols),
                  frame.row(y - first));
    }
    return frame;
  }

  /// RMS over all found rows about a robust straight line, px.
  static double Straightness(const LaserLine& line, std::size_t first, std::size_t last) {
    std::vector<double> x, y, scratch;
    for (std::size_t row = first; row < last; ++row) {
      if (line.found(row)) {
        x.push_back(static_cast<double>(row));
        y.push_back(line.centre_px[row]);
      }
    }
    const geometry::RobustLine fit = geometry::FitRobustLine(x, y, scratch);
    double square = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
      square += (y[i] - fit.at(x[i])) * (y[i] - fit.at(x[i]));
    }
    return std::sqrt(square / static_cast<double>(x.size()));
  }

  std::string folder_;
};

TEST_F(RecordedFrames, LineOnAPlateIsStraighterThanAPlainCentroid) {
  const cv::Mat image = cv::imread(folder_ + "plates.jpg");
  ASSERT_FALSE(image.empty()) << folder_ << "plates.jpg";
  const struct {
    const char* plate;
    int first, last;
    double limit_px;
  } rows[] = {{"matte", 0, 340, 0.5}, {"textured", 380, 1172, 1.2}, {"PEI", 1195, 1515, 0.6}};
  for (const auto& row : rows) {
    const LaserLine line = Find(Rows(image, row.first, row.last));
    EXPECT_GE(FoundShare(line), 0.98) << row.plate;
    EXPECT_LT(Straightness(line, 0, line.centre_px.size()), row.limit_px) << row.plate;
  }
}

TEST_F(RecordedFrames, LineOverBlackBeadIsFoundInAllRowsAndStraightBesideTheBead) {
  const cv::Mat image = cv::imread(folder_ + "cropped.png");
  ASSERT_FALSE(image.empty()) << folder_ << "cropped.png";
  LaserLineOptions options;
  options.row_smoothing = 0;
  const LaserLine line = Find(Rows(image, 0, image.rows), options);
  EXPECT_GE(FoundShare(line), 0.98);
  EXPECT_LT(Straightness(line, 0, 22), 0.5);
  EXPECT_LT(Straightness(line, 42, 60), 0.5);
  // The bead's top stands about ten pixels to the left of the plate's line (seen by eye).
  EXPECT_NEAR(line.centre_px[30] - line.centre_px[10], -10.5, 1.5);
}

TEST(StripePath, MedianMagnitudeIsTheMiddleOfTheOrderedMagnitudes) {
  Random random(5);
  EXPECT_EQ(MedianMagnitude({}), 0);
  for (std::size_t count = 1; count < 300; ++count) {
    std::vector<float> sample;
    for (std::size_t i = 0; i < count; ++i) {
      // Many decades, both signs, and many that are alike.
      const double level = random.Normal() * std::pow(10, random.Uniform(-40, 38));
      sample.push_back(
          static_cast<float>(random.Below(3) == 0 ? std::round(3 * random.Normal()) : level));
    }
    if (count % 7 == 0) sample[0] = std::numeric_limits<float>::infinity();
    std::vector<float> ordered;
    for (const float v : sample) ordered.push_back(std::abs(v));
    std::sort(ordered.begin(), ordered.end());
    EXPECT_EQ(MedianMagnitude(sample), ordered[count / 2]) << count;
  }
}

}  // namespace
}  // namespace trammel::vision
