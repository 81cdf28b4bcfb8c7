// The shared real photos, distorted as phones, lenses, lamps and messengers distort them: how many
// are answered near a line that a person accepted, refused, or wrong.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "pressure_advance/commands/analysis_run.h"
#include "support/real_photos.h"
#include "support/temporary_folder.h"

namespace trammel {
namespace {

namespace fs = std::filesystem;
namespace pa = pressure_advance;

using test::FromAccepted;
using test::kHalfStep_s;
using test::kLines;
using test::kPhotos;
using test::kStep_s;
using test::RealPhoto;

struct Distortion {
  std::string name;
  std::function<cv::Mat(const cv::Mat&)> apply;
};

cv::Mat Turned(const cv::Mat& picture, double degrees, bool grown) {
  cv::Mat turn =
      cv::getRotationMatrix2D(cv::Point2d(picture.cols / 2.0, picture.rows / 2.0), degrees, 1);
  cv::Size size = picture.size();
  if (grown) {
    const double c = std::abs(turn.at<double>(0, 0));
    const double s = std::abs(turn.at<double>(0, 1));
    size = {static_cast<int>(picture.cols * c + picture.rows * s),
            static_cast<int>(picture.cols * s + picture.rows * c)};
    turn.at<double>(0, 2) += (size.width - picture.cols) / 2.0;
    turn.at<double>(1, 2) += (size.height - picture.rows) / 2.0;
  }
  cv::Mat turned;
  cv::warpAffine(picture, turned, turn, size, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  return turned;
}

constexpr const char* kSides[] = {"left", "right", "top", "bottom"};

cv::Mat Cropped(const cv::Mat& picture, int side, int percent) {
  const int dx = picture.cols * percent / 100, dy = picture.rows * percent / 100;
  cv::Rect keep(0, 0, picture.cols, picture.rows);
  if (side == 0) keep.x = dx;
  if (side < 2) keep.width -= dx;
  if (side == 2) keep.y = dy;
  if (side >= 2) keep.height -= dy;
  return picture(keep).clone();
}

cv::Mat Blurred(const cv::Mat& picture, double sigma_px) {
  cv::Mat out;
  cv::GaussianBlur(picture, out, {}, sigma_px);
  return out;
}

cv::Mat Resized(const cv::Mat& picture, double factor) {
  cv::Mat out;
  cv::resize(picture, out, {}, factor, factor, factor < 1 ? cv::INTER_AREA : cv::INTER_CUBIC);
  return out;
}

cv::Mat Keystone(const cv::Mat& picture, double part) {
  const float w = static_cast<float>(picture.cols), h = static_cast<float>(picture.rows);
  const float in = static_cast<float>(part / 2) * w;
  const std::vector<cv::Point2f> from{{0, 0}, {w, 0}, {w, h}, {0, h}};
  const std::vector<cv::Point2f> to{{in, 0}, {w - in, 0}, {w, h}, {0, h}};
  cv::Mat seen;
  cv::warpPerspective(picture, seen, cv::getPerspectiveTransform(from, to), picture.size(),
                      cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  return seen;
}

cv::Mat Shaded(const cv::Mat& picture) {
  cv::Mat shaded;
  picture.convertTo(shaded, CV_32FC3);
  for (int y = 0; y < picture.rows; ++y) {
    for (int x = 0; x < picture.cols; ++x) {
      // The edge of a shadow, softly across the picture.
      const double t = (x + 0.4 * y - 0.6 * picture.cols) / (0.03 * picture.cols);
      shaded.at<cv::Vec3f>(y, x) *= static_cast<float>(0.5 + 0.5 / (1 + std::exp(-t)));
    }
  }
  shaded.convertTo(shaded, CV_8UC3);
  return shaded;
}

std::vector<Distortion> Distortions() {
  std::vector<Distortion> all{{"as it is", [](const cv::Mat& in) { return in.clone(); }}};
  for (const bool grown : {false, true}) {
    for (const double degrees :
         {1.0, 2.0, -2.0, 5.0, -5.0, 10.0, 20.0, 45.0, 90.0, -90.0, 135.0, 180.0}) {
      all.push_back(
          {fmt::format("turned {:+.0f} deg, {}", degrees, grown ? "canvas grown" : "in place"),
           [=](const cv::Mat& in) { return Turned(in, degrees, grown); }});
    }
  }
  for (const int code : {0, 1}) {
    all.push_back(
        {code ? "mirrored left and right" : "mirrored top and bottom", [=](const cv::Mat& in) {
           cv::Mat out;
           cv::flip(in, out, code);
           return out;
         }});
  }
  for (int side = 0; side < 4; ++side) {
    all.push_back({fmt::format("8 % cropped, {}", kSides[side]),
                   [=](const cv::Mat& in) { return Cropped(in, side, 8); }});
  }
  all.push_back({"perspective 10 %", [](const cv::Mat& in) { return Keystone(in, 0.1); }});
  all.push_back({"perspective 20 %", [](const cv::Mat& in) { return Keystone(in, 0.2); }});
  all.push_back({"shadow", Shaded});
  for (const double sigma_px : {1.0, 2.0}) {
    all.push_back({fmt::format("blur {:.0f} px", sigma_px),
                   [=](const cv::Mat& in) { return Blurred(in, sigma_px); }});
  }
  all.push_back({"noise 10", [](const cv::Mat& in) {
                   cv::Mat noise(in.size(), CV_32FC3), out;
                   cv::RNG random(1);
                   random.fill(noise, cv::RNG::NORMAL, 0, 10);
                   in.convertTo(out, CV_32FC3);
                   out += noise;
                   out.convertTo(out, CV_8UC3);
                   return out;
                 }});
  all.push_back({"JPEG 30", [](const cv::Mat& in) {
                   std::vector<std::uint8_t> bytes;
                   cv::imencode(".jpg", in, bytes, {cv::IMWRITE_JPEG_QUALITY, 30});
                   return cv::imdecode(bytes, cv::IMREAD_COLOR);
                 }});
  all.push_back({"grey", [](const cv::Mat& in) {
                   cv::Mat grey, out;
                   cv::cvtColor(in, grey, cv::COLOR_BGR2GRAY);
                   cv::cvtColor(grey, out, cv::COLOR_GRAY2BGR);
                   return out;
                 }});
  all.push_back({"half the size", [](const cv::Mat& in) { return Resized(in, 0.5); }});
  return all;
}

// Past both ends of what can be read: most of these have to be refused.
std::vector<Distortion> Sweeps() {
  std::vector<Distortion> all;
  for (int degrees = -165; degrees <= 180; degrees += 30) {
    all.push_back({fmt::format("turned {:+d} deg, in place", degrees),
                   [=](const cv::Mat& in) { return Turned(in, degrees, false); }});
  }
  for (int side = 0; side < 4; ++side) {
    for (const int percent : {4, 12, 16, 20, 25, 30}) {
      all.push_back({fmt::format("{} % cropped, {}", percent, kSides[side]),
                     [=](const cv::Mat& in) { return Cropped(in, side, percent); }});
    }
  }
  for (const double sigma_px : {3.0, 4.0, 5.0, 6.0, 8.0}) {
    all.push_back({fmt::format("blur {:.0f} px", sigma_px),
                   [=](const cv::Mat& in) { return Blurred(in, sigma_px); }});
  }
  for (const double factor : {0.1, 0.15, 0.2, 0.25, 0.35, 0.7, 1.5, 2.4}) {
    all.push_back({fmt::format("{} times the size", factor),
                   [=](const cv::Mat& in) { return Resized(in, factor); }});
  }
  return all;
}

struct Tally {
  int asked = 0, right = 0, off = 0, wrong = 0;
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
  for (const Distortion& distortion : distortions) {
    if (only != nullptr && distortion.name.find(only) == std::string::npos) continue;
    fmt::print("{:32}", distortion.name);
    for (const RealPhoto& photo : kPhotos) {
      const fs::path file =
          fs::path(data) / "pressure_advance_photos" / (std::string(photo.name) + ".jpg");
      const cv::Mat picture = cv::imread(file.string(), cv::IMREAD_COLOR);
      ASSERT_FALSE(picture.empty()) << file;
      ASSERT_TRUE(cv::imwrite(changed.string(), distortion.apply(picture),
                              {cv::IMWRITE_PNG_COMPRESSION, 1}));
      const auto run = app::AnalysePhoto(changed, plan, pa::Method::kResponse);
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
      fmt::print(" | {:6.2f} {:5.2f} {:5}", 1e3 * quantity.value,
                 1e3 * quantity.standard_uncertainty,
                 near    ? ""
                 : holds ? "off"
                         : "WRONG");
    }
    fmt::print("\n");
    std::fflush(stdout);
  }
  fmt::print("{} of {} right, {} off within their intervals, {} wrong; refused:\n{}", tally.right,
             tally.asked, tally.off, tally.wrong, tally.reasons);
}

TEST(RealPhotoStudy, DistortedPhotosAreAnsweredOrRefusedNeverWrong) {
  Tally tally;
  Ask(Distortions(), tally);
  EXPECT_EQ(tally.wrong, 0);
}

TEST(RealPhotoStudy, PhotosBeyondWhatCanBeReadAreNeverWrong) {
  Tally tally;
  Ask(Sweeps(), tally);
  EXPECT_EQ(tally.wrong, 0);
}

}  // namespace
}  // namespace trammel
