// The shared real photos, distorted as phones, lenses, lamps and messengers distort them: how many
// are answered near a line that a person accepted, refused, or wrong.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
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
  const char* sides[] = {"left", "right", "top", "bottom"};
  for (int side = 0; side < 4; ++side) {
    all.push_back({fmt::format("8 % cropped, {}", sides[side]), [=](const cv::Mat& in) {
                     const int dx = in.cols * 8 / 100, dy = in.rows * 8 / 100;
                     cv::Rect keep(0, 0, in.cols, in.rows);
                     if (side == 0) keep.x = dx;
                     if (side < 2) keep.width -= dx;
                     if (side == 2) keep.y = dy;
                     if (side >= 2) keep.height -= dy;
                     return in(keep).clone();
                   }});
  }
  all.push_back({"perspective 10 %", [](const cv::Mat& in) { return Keystone(in, 0.1); }});
  all.push_back({"perspective 20 %", [](const cv::Mat& in) { return Keystone(in, 0.2); }});
  all.push_back({"shadow", Shaded});
  for (const double sigma_px : {1.0, 2.0}) {
    all.push_back({fmt::format("blur {:.0f} px", sigma_px), [=](const cv::Mat& in) {
                     cv::Mat out;
                     cv::GaussianBlur(in, out, {}, sigma_px);
                     return out;
                   }});
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
  all.push_back({"half the size", [](const cv::Mat& in) {
                   cv::Mat out;
                   cv::resize(in, out, {}, 0.5, 0.5, cv::INTER_AREA);
                   return out;
                 }});
  return all;
}

TEST(RealPhotoStudy, DistortedPhotosAreAnsweredOrRefusedNeverWrong) {
  const char* data = std::getenv("TRAMMEL_TEST_DATA");
  if (data == nullptr)
    GTEST_SKIP() << "set TRAMMEL_TEST_DATA to the folder with pressure_advance_photos/";
  const test::TemporaryFolder folder;
  const fs::path changed = folder.path() / "changed.png";
  app::PhotoPlan plan;
  for (int i = 0; i < kLines; ++i) plan.pressure_advance_s.push_back(kStep_s * i);

  int asked = 0, right = 0, off = 0, wrong = 0;
  fmt::print("\nvalue and u (ms) of each photo as distorted\n{:32}", "");
  for (const RealPhoto& photo : kPhotos) fmt::print(" | {:18}", photo.name);
  fmt::print("\n");
  std::string reasons;
  for (const Distortion& distortion : Distortions()) {
    fmt::print("{:32}", distortion.name);
    for (const RealPhoto& photo : kPhotos) {
      const fs::path file =
          fs::path(data) / "pressure_advance_photos" / (std::string(photo.name) + ".jpg");
      const cv::Mat picture = cv::imread(file.string(), cv::IMREAD_COLOR);
      ASSERT_FALSE(picture.empty()) << file;
      ASSERT_TRUE(cv::imwrite(changed.string(), distortion.apply(picture),
                              {cv::IMWRITE_PNG_COMPRESSION, 1}));
      const auto run = app::AnalysePhoto(changed, plan, pa::Method::kResponse);
      ++asked;
      if (!run || !run->analysis.pressure_advance.good()) {
        fmt::print(" | {:18}", "-");
        reasons += fmt::format("{}, {}: {}\n", distortion.name, photo.name,
                               run ? run->analysis.pressure_advance.reason() : run.error().message);
        continue;
      }
      const Quantity quantity = run->analysis.pressure_advance.quantity();
      const bool near = FromAccepted(photo, quantity.value) <= kHalfStep_s;
      right += near;
      const auto held = [&](double value_s) {
        return quantity.interval95.lo <= value_s && value_s <= quantity.interval95.hi;
      };
      // Off by more than half a step, while the interval holds what a person accepted.
      const bool holds = held(photo.accepted_s[0]) || held(photo.accepted_s[1]);
      off += !near && holds;
      wrong += !near && !holds;
      fmt::print(" | {:6.2f} {:5.2f} {:5}", 1e3 * quantity.value,
                 1e3 * quantity.standard_uncertainty,
                 near    ? ""
                 : holds ? "off"
                         : "WRONG");
    }
    fmt::print("\n");
  }
  fmt::print("{} of {} right, {} off within their intervals, {} wrong; refused:\n{}", right, asked,
             off, wrong, reasons);
  EXPECT_EQ(wrong, 0);
}

}  // namespace
}  // namespace trammel
