// The shared real photos, distorted as phones, lenses, lamps and messengers distort them: how many
// are answered near a line that a person accepted, refused, or wrong.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "pressure_advance/commands/analysis_run.h"
#include "support/photo_distortions.h"
#include "support/real_photos.h"
#include "support/temporary_folder.h"

namespace trammel {
namespace {

namespace fs = std::filesystem;
namespace pa = pressure_advance;

using test::Distortion;
using test::FromAccepted;
using test::kHalfStep_s;
using test::kLines;
using test::kPhotos;
using test::kStep_s;
using test::RealPhoto;

struct Tally {
  int asked = 0, right = 0, off = 0, wrong = 0;
  double least_u = 1e9;  // over that of the photo as it is
  std::string reasons;
};

// Asks each photo under each distortion, and prints values and standard uncertainties.
void Ask(const std::vector<Distortion>& distortions, Tally& tally) {
  const char* data = std::getenv("TRAMMEL_TEST_DATA");
  if (data == nullptr)
    GTEST_SKIP() << "set TRAMMEL_TEST_DATA to the folder with pressure_advance_photos/";
  const test::TemporaryFolder folder;
  const fs::path changed = folder.path() / "changed.png";
  app::PhotoPlan plan;
  for (int i = 0; i < kLines; ++i) plan.pressure_advance_s.push_back(kStep_s * i);
  fmt::print("\nvalue and u (ms) of each photo as distorted\n{:32}", "");
  for (const RealPhoto& photo : kPhotos) fmt::print(" | {:18}", photo.name);
  fmt::print("\n");
  const char* only = std::getenv("TRAMMEL_STUDY_ROW");
  std::map<std::string, double> u_s;  // of each photo as it is
  const auto answer = [&](const cv::Mat& picture) {
    EXPECT_TRUE(cv::imwrite(changed.string(), picture, {cv::IMWRITE_PNG_COMPRESSION, 0}));
    return app::AnalysePhoto(changed, plan);
  };
  for (const Distortion& distortion : distortions) {
    if (only != nullptr && distortion.name.find(only) == std::string::npos) continue;
    fmt::print("{:32}", distortion.name);
    for (const RealPhoto& photo : kPhotos) {
      const fs::path file =
          fs::path(data) / "pressure_advance_photos" / (std::string(photo.name) + ".jpg");
      const cv::Mat picture = cv::imread(file.string(), cv::IMREAD_COLOR);
      ASSERT_FALSE(picture.empty()) << file;
      if (!u_s.contains(photo.name)) {
        const auto as_it_is = answer(picture);
        ASSERT_TRUE(as_it_is && as_it_is->analysis.pressure_advance.good()) << file;
        u_s[photo.name] = as_it_is->analysis.pressure_advance.quantity().standard_uncertainty;
      }
      const auto run = answer(distortion.apply(picture));
      ++tally.asked;
      if (!run || !run->analysis.pressure_advance.good()) {
        fmt::print(" | {:18}", "-");
        tally.reasons +=
            fmt::format("{}, {}: {}\n", distortion.name, photo.name,
                        run ? run->analysis.pressure_advance.reason() : run.error().message);
        continue;
      }
      const Quantity quantity = run->analysis.pressure_advance.quantity();
      const bool near = FromAccepted(photo, quantity.value) <= kHalfStep_s;
      tally.right += near;
      const auto held = [&](double value_s) {
        return quantity.interval95.lo <= value_s && value_s <= quantity.interval95.hi;
      };
      // Off by more than half a step, while the interval holds what a person accepted.
      const bool holds = held(photo.accepted_s[0]) || held(photo.accepted_s[1]);
      tally.off += !near && holds;
      tally.wrong += !near && !holds;
      tally.least_u = std::min(tally.least_u, quantity.standard_uncertainty / u_s[photo.name]);
      fmt::print(" | {:6.2f} {:5.2f} {:5}", 1e3 * quantity.value,
                 1e3 * quantity.standard_uncertainty,
                 near    ? ""
                 : holds ? "off"
                         : "WRONG");
    }
    fmt::print("\n");
    std::fflush(stdout);
  }
  fmt::print(
      "{} of {} right, {} off within their intervals, {} wrong; u at least {:.2f} times that of "
      "the "
      "photo as it is; refused:\n{}",
      tally.right, tally.asked, tally.off, tally.wrong, tally.least_u, tally.reasons);
}

// A worse picture must not claim more. The scatter of the same lines, read again from other pixels,
// is itself uncertain by some per cent.
constexpr double kLeastU = 0.9;

// Of 160. Turned in its place by 90 degrees a photo shows its middle rows 420 to 1499 alone. Of
// three photos these hold neither end of the pattern (17, 18 and 17 of 21 lines whole): which lines
// they are cannot be told, in 6 pictures. The others' answers may lie half a step off by chance.
constexpr int kFewestRight = 150;

TEST(RealPhotoStudy, DistortedPhotosAreAnsweredOrRefusedNeverWrong) {
  Tally tally;
  Ask(test::CommonDistortions(), tally);
  EXPECT_EQ(tally.wrong, 0);
  if (std::getenv("TRAMMEL_STUDY_ROW") == nullptr) EXPECT_GE(tally.right, kFewestRight);
  EXPECT_GE(tally.least_u, kLeastU);
}

TEST(RealPhotoStudy, PhotosBeyondWhatCanBeReadAreNeverWrong) {
  Tally tally;
  Ask(test::DistortionsBeyondUse(), tally);
  EXPECT_EQ(tally.wrong, 0);
  EXPECT_GE(tally.least_u, kLeastU);
}

TEST(RealPhotoStudy, PhotosWithOtherThingsAndOtherLightAreNeverWrong) {
  Tally tally;
  Ask(test::Surroundings(), tally);
  EXPECT_EQ(tally.wrong, 0);
}

}  // namespace
}  // namespace trammel
