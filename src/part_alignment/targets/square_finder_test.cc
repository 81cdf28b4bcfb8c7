#include "part_alignment/targets/square_finder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <string>

#include "geometry/linear_systems.h"
#include "support/target_picture.h"

namespace trammel::part_alignment {
namespace {

using test::Draw;
using test::DrawnTarget;
using test::Expose;
using test::GreyImage;
using test::Look;
using test::SquareTarget;
using ::testing::HasSubstr;
using ::testing::SizeIs;

constexpr double kTurn = 2 * std::numbers::pi;
constexpr double kDegree = std::numbers::pi / 180;

std::vector<int> Ids(int n) { return DefaultSquareIds(n).value(); }
SquareBook Book(int n = 60) { return MakeSquareBook(Ids(n)).value(); }

FoundTargets Find(const Page& page, const SquareBook& book,
                  const SquareFinderOptions& options = {}) {
  SquareWorkspace workspace;
  auto found = FindSquares(page.view(), book, options, workspace);
  EXPECT_TRUE(found) << found.error().message;
  return found.value_or(FoundTargets{});
}

/// A marker somewhere about the middle of a square picture that holds it and what is white about
/// it.
struct Scene {
  int side = 0;
  DrawnTarget target;
};
Scene OneMarker(Random& random, double side, double tilt_rad, int id) {
  Scene scene;
  scene.side = static_cast<int>(1.9 * side) + 24;
  const double middle = 0.5 * scene.side;
  scene.target =
      SquareTarget(middle + random.Uniform(-0.5, 0.5), middle + random.Uniform(-0.5, 0.5), side,
                   tilt_rad, random.Uniform(0, kTurn), random.Uniform(0, kTurn));
  scene.target.word = SquareWord(id);
  return scene;
}

/// What no unbiased estimate of the centre from the outer edges can be better than, per axis: all
/// eight numbers of the homography are unknown. From differences of drawn pictures of a black
/// square; rounding to 8 bits is noise of 1/sqrt(12).
double CramerRao(const Scene& scene, const Look& look, double noise) {
  // Steps that move the corners by some 0.05 px.
  const double unit = 0.05 / 3.5;
  const double far = unit / (scene.target.h[0][2]);
  const double steps[3][3] = {{unit, unit, 0.05}, {unit, unit, 0.05}, {far, far, 0}};
  constexpr int kUnknowns = 8;
  std::vector<std::vector<double>> slopes;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      if (steps[i][j] == 0) continue;
      DrawnTarget ahead = scene.target;
      ahead.word = 0;
      DrawnTarget behind = ahead;
      ahead.h[i][j] += steps[i][j];
      behind.h[i][j] -= steps[i][j];
      const GreyImage a = Draw(scene.side, scene.side, {ahead}, look);
      const GreyImage b = Draw(scene.side, scene.side, {behind}, look);
      slopes.emplace_back();
      for (std::size_t k = 0; k < a.values.size(); ++k) {
        slopes.back().push_back((a.values[k] - b.values[k]) / (2 * steps[i][j]));
      }
    }
  }
  Eigen::Matrix<double, kUnknowns, kUnknowns> fisher;
  for (int a = 0; a < kUnknowns; ++a) {
    for (int b = 0; b < kUnknowns; ++b) {
      const auto& x = slopes[static_cast<std::size_t>(a)];
      const auto& y = slopes[static_cast<std::size_t>(b)];
      fisher(a, b) = std::inner_product(x.begin(), x.end(), y.begin(), 0.0);
    }
  }
  // The centre is (h[0][2], h[1][2]): the third and the sixth number, as h[2][2] is 1.
  const auto covariance = geometry::Inverse(fisher);
  return std::sqrt((noise * noise + 1.0 / 12) * 0.5 * (covariance(2, 2) + covariance(5, 5)));
}

struct Case {
  const char* name;
  double side;
  double tilt_deg;
  double noise;
  double ragged;
  double most_ratio;  ///< of the scatter to the bound
  Look look;
};

class SquareAccuracy : public testing::TestWithParam<Case> {};

// The bound takes blur and shades as known. Where little is left of an edge between its corners,
// and of plain white and black beside it, they cost more: 1.1 … 1.3 as a rule, 1.5 … 1.65 at 50
// degrees or with a blur of a fifth of a module, plus three times 4 %.
constexpr double kUsual = 1.5;
constexpr double kSteepOrBlurred = 1.85;
constexpr double kNoBound = 1e9;  // noise is not what moves ragged edges

// 288 squares in the mean: a relative deviation of the root of 4 %. Ragged edges have no such
// bound.
TEST_P(SquareAccuracy, IsNearTheCramerRaoBoundAndStated) {
  const Case& c = GetParam();
  constexpr std::uint64_t kSeed = 5;
  // Each ragged edge is another error, whatever the noise.
  const int scenes = c.ragged > 0 ? 24 : 12;
  const int pictures = c.ragged > 0 ? 2 : 12;
  const SquareBook book = Book();
  Random random(kSeed);
  double squares = 0;
  double stated = 0;
  double bound = 0;
  for (int i = 0; i < scenes; ++i) {
    const int id = book.ids[static_cast<std::size_t>(i)];
    Scene scene = OneMarker(random, c.side, c.tilt_deg * kDegree, id);
    scene.target.ragged = c.ragged;
    scene.target.ragged_seed = random.Bits() >> 8;
    const GreyImage image = Draw(scene.side, scene.side, {scene.target}, c.look);
    if (i == 0) bound = CramerRao(scene, c.look, c.noise);
    for (int k = 0; k < pictures; ++k) {
      const FoundTargets found = Find(Expose(image, c.noise, random), book);
      ASSERT_THAT(found.targets, SizeIs(1)) << "seed " << kSeed << ", scene " << i;
      const FoundTarget& target = found.targets[0];
      ASSERT_EQ(target.number, id);
      squares += (std::pow(target.disc.column_px - scene.target.h[0][2], 2) +
                  std::pow(target.disc.row_px - scene.target.h[1][2], 2)) /
                 (2 * scenes * pictures);
      stated += (std::pow(target.sigma_column_px, 2) + std::pow(target.sigma_row_px, 2)) /
                (2 * scenes * pictures);
    }
  }
  const double rms_px = std::sqrt(squares);
  RecordProperty("rms_px", std::to_string(rms_px));
  RecordProperty("bound_px", std::to_string(bound));
  RecordProperty("stated_over_rms", std::to_string(std::sqrt(stated) / rms_px));
  EXPECT_LT(rms_px, c.most_ratio * bound) << "seed " << kSeed;
  EXPECT_GT(std::sqrt(stated), 0.8 * rms_px);
  EXPECT_LT(std::sqrt(stated), 1.4 * rms_px);
}

INSTANTIATE_TEST_SUITE_P(
    Pictures, SquareAccuracy,
    testing::Values(
        Case{"Side26", 26, 0, 1, 0, kUsual, {}},
        Case{"Side40Tilt50", 40, 50, 1, 0, kSteepOrBlurred, {}},
        Case{"Side60", 60, 0, 1, 0, kUsual, {}}, Case{"Side60Tilt30", 60, 30, 1, 0, kUsual, {}},
        Case{"Side60Tilt50Noise3", 60, 50, 3, 0, kSteepOrBlurred, {.blur_px = 0.8}},
        Case{
            "Side60UnevenLight", 60, 30, 1, 0, kUsual, {.gradient_x = 0.003, .gradient_y = -0.002}},
        Case{"Side70Blur2", 70, 20, 1, 0, kSteepOrBlurred, {.blur_px = 2}},
        Case{"Side60Ragged", 60, 20, 1, 0.02, kNoBound, {}}),
    [](const auto& param) { return param.param.name; });

TEST(SquareFinder, ReadsEveryDefaultIdInEveryDirectionUpTo50DegreesOfTilt) {
  constexpr std::uint64_t kSeed = 3;
  Random random(kSeed);
  const SquareBook book = Book(394);
  for (std::size_t i = 0; i < book.ids.size(); i += 4) {
    const Scene scene = OneMarker(random, 45, random.Uniform(0, 50 * kDegree), book.ids[i]);
    const FoundTargets found =
        Find(Expose(Draw(scene.side, scene.side, {scene.target}, {}), 1, random), book);
    ASSERT_THAT(found.targets, SizeIs(1)) << "marker " << book.ids[i] << ", seed " << kSeed;
    EXPECT_EQ(found.targets[0].number, book.ids[i]);
    EXPECT_NEAR(found.targets[0].contrast, -150, 4);
    // Its own corners in their order, from the drawing's own homography.
    const auto& h = scene.target.h;
    constexpr double kAt[4][2] = {{-3.5, -3.5}, {3.5, -3.5}, {3.5, 3.5}, {-3.5, 3.5}};
    for (std::size_t k = 0; k < 4; ++k) {
      const double w = h[2][0] * kAt[k][0] + h[2][1] * kAt[k][1] + 1;
      const double x = (h[0][0] * kAt[k][0] + h[0][1] * kAt[k][1] + h[0][2]) / w;
      const double y = (h[1][0] * kAt[k][0] + h[1][1] * kAt[k][1] + h[1][2]) / w;
      EXPECT_NEAR(found.targets[0].square->corners[k].x, x, 0.05) << "corner " << k;
      EXPECT_NEAR(found.targets[0].square->corners[k].y, y, 0.05) << "corner " << k;
    }
  }
}

TEST(SquareFinder, ReadsMirroredPicturesWhereToldAndSaysSoWhereNot) {
  Random random(8);
  const SquareBook book = Book();
  for (int i = 0; i < 8; ++i) {
    Scene scene = OneMarker(random, 50, 0.4, book.ids[20]);
    for (auto& row : scene.target.h) row[1] = -row[1];
    const Page page = Expose(Draw(scene.side, scene.side, {scene.target}, {}), 1, random);
    const FoundTargets told = Find(page, book, {.mirrored = true});
    ASSERT_THAT(told.targets, SizeIs(1));
    EXPECT_EQ(told.targets[0].number, book.ids[20]);
    EXPECT_NEAR(told.targets[0].disc.column_px, scene.target.h[0][2], 0.02);
    const auto& corner = told.targets[0].square->corners[1];  // (3.5, -3.5) of the marker
    const auto& h = scene.target.h;
    const double w = 3.5 * (h[2][0] - h[2][1]) + 1;
    EXPECT_NEAR(corner.x, (3.5 * (h[0][0] - h[0][1]) + h[0][2]) / w, 0.05);
    const FoundTargets untold = Find(page, book);
    EXPECT_THAT(untold.targets, SizeIs(0));
    ASSERT_THAT(untold.rejected, SizeIs(1));
    EXPECT_EQ(ToString(untold.rejected[0].reason), "mirrored");
  }
}

/// A row of markers of 42 px, 90 px apart, upright.
Page RowOfMarkers(const std::vector<std::uint32_t>& words, Random& random) {
  std::vector<DrawnTarget> targets;
  for (std::size_t i = 0; i < words.size(); ++i) {
    targets.push_back(SquareTarget(50.3 + 90.0 * static_cast<double>(i), 45.2, 42));
    targets.back().word = words[i];
  }
  return Expose(Draw(static_cast<int>(90 * words.size()) + 10, 90, targets, {}), 1, random);
}

void Paint(Page& page, int x0, int y0, int x1, int y1, std::uint8_t grey) {
  for (int y = y0; y < y1; ++y) std::fill(page.row(y) + x0, page.row(y) + x1, grey);
}

RejectReason ReasonAt(const FoundTargets& found, double column) {
  for (const RejectedTarget& rejected : found.rejected) {
    if (std::abs(rejected.column_px - column) < 20) return rejected.reason;
  }
  ADD_FAILURE() << "nothing rejected at column " << column;
  return RejectReason::kSaturated;
}

TEST(SquareFinder, SaysWhyAMarkerIsRejected) {
  Random random(5);
  const SquareBook book = MakeSquareBook({5, 6, 7, 13}).value();
  const std::uint32_t one_bit_off = SquareWord(6) ^ 1U << 12;
  Page page = RowOfMarkers({SquareWord(5), one_bit_off, SquareWord(7), SquareWord(7),
                            SquareWord(20), SquareWord(13), SquareWord(13), SquareWord(13)},
                           random);
  Paint(page, 50 + 5 * 90, 40, 60 + 5 * 90, 60, 125);  // grey over its modules
  Paint(page, 20 + 6 * 90, 50, 50 + 6 * 90, 80, 200);  // paper over its corner
  page.width = 60 + 7 * 90;                            // the picture ends within the last
  Page cut = page;
  cut.samples.clear();
  for (int y = 0; y < page.height; ++y) {
    const std::uint8_t* row = page.samples.data() + std::ptrdiff_t{y} * (90 * 8 + 10);
    cut.samples.insert(cut.samples.end(), row, row + page.width);
  }
  const FoundTargets found = Find(cut, book);
  ASSERT_THAT(found.targets, SizeIs(1));
  EXPECT_EQ(found.targets[0].number, 5);
  EXPECT_EQ(ToString(ReasonAt(found, 140)), "wrong_code");
  EXPECT_EQ(ToString(ReasonAt(found, 230)), "doubled");
  EXPECT_EQ(ToString(ReasonAt(found, 320)), "doubled");
  EXPECT_EQ(ToString(ReasonAt(found, 410)), "wrong_code");
  EXPECT_EQ(ToString(ReasonAt(found, 500)), "hidden");
  EXPECT_EQ(ToString(ReasonAt(found, 590)), "hidden");
  EXPECT_EQ(ToString(ReasonAt(found, 675)), "at_border");
  for (const RejectedTarget& rejected : found.rejected) {
    if (std::abs(rejected.column_px - 410) < 20) {
      EXPECT_EQ(rejected.number, 20) << "a marker, though none of the job's";
    }
  }
  const FoundTargets small = Find(RowOfMarkers({SquareWord(5)}, random), book, {.min_side_px = 45});
  EXPECT_THAT(small.targets, SizeIs(0));
  EXPECT_EQ(ToString(ReasonAt(small, 50)), "too_small");
}

TEST(SquareFinder, WithAPartHiddenNeverReadsAnotherMarker) {
  constexpr std::uint64_t kSeed = 21;
  Random random(kSeed);
  const SquareBook book = Book(394);
  int wrong = 0;
  for (std::size_t i = 0; i < book.ids.size(); i += 6) {
    const Page whole = RowOfMarkers({SquareWord(book.ids[i])}, random);
    for (int k = 0; k < 8; ++k) {
      Page page = whole;
      const int x = 25 + static_cast<int>(random.Below(40));
      const int y = 20 + static_cast<int>(random.Below(40));
      const int size = 6 + static_cast<int>(random.Below(16));
      const double shades[4] = {50, 200, random.Uniform(0, 255), 125};
      Paint(page, x, y, x + size, y + size, static_cast<std::uint8_t>(shades[k % 4]));
      for (const FoundTarget& target : Find(page, book).targets) {
        wrong += target.number != book.ids[i] ? 1 : 0;
      }
    }
  }
  EXPECT_EQ(wrong, 0) << "seed " << kSeed;
}

TEST(SquareFinder, SaysHowFarEdgesAreBent) {
  constexpr std::uint64_t kSeed = 2;
  Random random(kSeed);
  const SquareBook book = Book();
  // 70 px of edge bent by 1e-4 (35 px)² = 0.12 px, seen upright in its middle.
  DrawnTarget target = SquareTarget(79.5, 79.5, 70);
  target.word = SquareWord(book.ids[3]);
  const auto bow = [&](double bend) {
    target.bend = bend;
    const FoundTargets found = Find(Expose(Draw(160, 160, {target}, {}), 0.5, random), book);
    EXPECT_THAT(found.targets, SizeIs(1));
    return found.targets.empty() ? SquareShape{} : *found.targets[0].square;
  };
  // The drawing moves columns only: the upright edges bend, both to the same side.
  const SquareShape bent = bow(1e-4);
  EXPECT_NEAR(std::abs(bent.bows_px[1]), 0.12, 0.02) << "seed " << kSeed;
  EXPECT_NEAR(bent.bows_px[3], -bent.bows_px[1], 0.02) << "seed " << kSeed;
  EXPECT_NEAR(bent.bows_px[0], 0, 0.02) << "seed " << kSeed;
  const SquareShape straight = bow(0);
  for (const double edge_px : straight.bows_px) {
    EXPECT_LT(std::abs(edge_px), 4 * straight.bow_sigma_px) << "seed " << kSeed;
  }
  EXPECT_LT(straight.bow_sigma_px, 0.006);
  target.bend = 1e-3;  // a rolled sheet
  const FoundTargets rolled = Find(Expose(Draw(160, 160, {target}, {}), 0.5, random), book);
  EXPECT_THAT(rolled.targets, SizeIs(0));
}

TEST(SquareFinder, FindsNoMarkerIn500PicturesOfClutter) {
  constexpr std::uint64_t kSeed = 77;
  const SquareBook book = Book(394);
  SquareWorkspace workspace;
  std::size_t markers = 0;
  for (std::uint64_t i = 0; i < 500; ++i) {
    Random random(kSeed + i);
    const Page page = test::Clutter(200, 150, random);
    const auto found = FindSquares(page.view(), book, {.min_side_px = 14}, workspace);
    ASSERT_TRUE(found);
    markers += found->targets.size();
  }
  EXPECT_EQ(markers, 0U) << "seeds from " << kSeed;
}

TEST(SquareFinder, SurvivesPicturesOfNoiseAndOfOneShade) {
  const SquareBook book = Book();
  Random random(4);
  for (const int width : {16, 17, 333}) {
    for (const int height : {16, 41, 150}) {
      Page page{width, height, 1, {}, {}, {}};
      page.samples.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
      for (const int shade : {0, 128, 255}) {
        std::fill(page.samples.begin(), page.samples.end(), static_cast<std::uint8_t>(shade));
        EXPECT_THAT(Find(page, book).targets, SizeIs(0));
      }
      for (auto& sample : page.samples) sample = static_cast<std::uint8_t>(random.Below(256));
      EXPECT_THAT(Find(page, book).targets, SizeIs(0));
      for (auto& sample : page.samples) sample = random.Below(2) == 0 ? 0 : 255;
      EXPECT_THAT(Find(page, book).targets, SizeIs(0));
    }
  }
}

TEST(SquareFinder, RefusesWhatIsNoGreyPictureByName) {
  const SquareBook book = Book();
  SquareWorkspace workspace;
  Page page;
  page.width = page.height = 64;
  page.samples.assign(64 * 64 * 3, 0);
  page.channels = 3;
  const auto message = [&](const PageView& view, const SquareFinderOptions& options) {
    const auto found = FindSquares(view, book, options, workspace);
    return found ? std::string("no error") : found.error().message;
  };
  EXPECT_THAT(message(page.view(), {}), HasSubstr("3 channels"));
  page.channels = 1;
  EXPECT_EQ(message(page.view(), {}), "no error");
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(message(page.view(), {.min_side_px = nan}), HasSubstr("min_side_px = nan"));
  EXPECT_THAT(message(page.view(), {.max_side_px = 10}), HasSubstr("max_side_px = 10"));
  EXPECT_THAT(message(page.view(), {.min_contrast = 0}), HasSubstr("min_contrast = 0"));
  EXPECT_THAT(message(PageView{}, {}), HasSubstr("channels"));
  page.width = 8;
  EXPECT_THAT(message(page.view(), {}), HasSubstr("8 x 64"));
  EXPECT_FALSE(FindSquares(Page{64, 64, 1, std::vector<std::uint8_t>(4096), {}, {}}.view(),
                           SquareBook{}, {}, workspace));
}

}  // namespace
}  // namespace trammel::part_alignment
