#include "support/photo_distortions.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace trammel::test {
namespace {

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

// Fingers that reach into the picture from a side, and cover what lies beneath.
cv::Mat WithHand(const cv::Mat& picture, int side) {
  cv::Mat out = picture.clone();
  const cv::Scalar skin(120, 150, 205);
  const double w = picture.cols, h = picture.rows;
  for (int finger = 0; finger < 3; ++finger) {
    const double along = 0.55 + 0.09 * finger, reach = 0.16 + 0.02 * finger;
    const cv::Point2d from = side == 0   ? cv::Point2d(0, along * h)
                             : side == 1 ? cv::Point2d(w, along * h)
                             : side == 2 ? cv::Point2d(along * w, 0)
                                         : cv::Point2d(along * w, h);
    const cv::Point2d to = side == 0   ? from + cv::Point2d(reach * w, 0.01 * h)
                           : side == 1 ? from - cv::Point2d(reach * w, 0.01 * h)
                           : side == 2 ? from + cv::Point2d(0.01 * w, reach * h)
                                       : from - cv::Point2d(0.01 * w, reach * h);
    cv::line(out, from, to, skin * (0.9 + 0.05 * finger), static_cast<int>(0.05 * h), cv::LINE_AA);
  }
  return out;
}

// The same pattern a second time, smaller, beside the first.
cv::Mat WithSecondPattern(const cv::Mat& picture, double size) {
  cv::Mat small;
  cv::resize(picture, small, {}, size, size, cv::INTER_AREA);
  cv::Mat out(picture.rows, picture.cols + small.cols, CV_8UC3, cv::Scalar(40, 45, 50));
  picture.copyTo(out(cv::Rect(0, 0, picture.cols, picture.rows)));
  small.copyTo(out(cv::Rect(picture.cols, 0, small.cols, small.rows)));
  return out;
}

cv::Mat WithBrightSpot(const cv::Mat& picture, double x, double y, double radius) {
  cv::Mat out;
  picture.convertTo(out, CV_32FC3);
  for (int row = 0; row < out.rows; ++row) {
    for (int column = 0; column < out.cols; ++column) {
      const double r = std::hypot(column - x * out.cols, row - y * out.rows) / (radius * out.cols);
      const auto light = static_cast<float>(260 * std::exp(-r * r));
      out.at<cv::Vec3f>(row, column) += cv::Vec3f(light, light, light);
    }
  }
  out.convertTo(out, CV_8UC3);
  return out;
}

cv::Mat Lit(const cv::Mat& picture, const cv::Vec3f& gain, double noise) {
  cv::Mat out, grain(picture.size(), CV_32FC3);
  cv::RNG random(2);
  random.fill(grain, cv::RNG::NORMAL, 0, noise);
  picture.convertTo(out, CV_32FC3);
  cv::multiply(out, cv::Scalar(gain[0], gain[1], gain[2]), out);
  out += grain;
  out.convertTo(out, CV_8UC3);
  return out;
}

cv::Mat Shaken(const cv::Mat& picture, int length_px, double degrees) {
  cv::Mat kernel = cv::Mat::zeros(length_px, length_px, CV_32F), out;
  const double c = std::cos(degrees * CV_PI / 180), s = std::sin(degrees * CV_PI / 180);
  const double middle = (length_px - 1) / 2.0;
  cv::line(kernel, cv::Point2d(middle - c * middle, middle - s * middle),
           cv::Point2d(middle + c * middle, middle + s * middle), cv::Scalar(1));
  kernel /= cv::sum(kernel)[0];
  cv::filter2D(picture, out, -1, kernel);
  return out;
}

cv::Mat BentByLens(const cv::Mat& picture, double part) {
  cv::Mat x(picture.size(), CV_32F), y(picture.size(), CV_32F), out;
  const double cx = picture.cols / 2.0, cy = picture.rows / 2.0, far = std::hypot(cx, cy);
  for (int row = 0; row < picture.rows; ++row) {
    for (int column = 0; column < picture.cols; ++column) {
      const double u = (column - cx) / far, v = (row - cy) / far;
      const double k = 1 + part * (u * u + v * v);
      x.at<float>(row, column) = static_cast<float>(cx + u * k * far);
      y.at<float>(row, column) = static_cast<float>(cy + v * k * far);
    }
  }
  cv::remap(picture, out, x, y, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  return out;
}

}  // namespace

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

std::vector<Distortion> CommonDistortions() {
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
    all.push_back({code ? "mirrored left and right" : "mirrored top and bottom",
                   [=](const cv::Mat& in) {
                     cv::Mat out;
                     cv::flip(in, out, code);
                     return out;
                   },
                   true});
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

std::vector<Distortion> Surroundings() {
  std::vector<Distortion> all;
  for (int side = 0; side < 4; ++side) {
    all.push_back({fmt::format("a hand, {}", kSides[side]),
                   [=](const cv::Mat& in) { return WithHand(in, side); }});
  }
  for (const double size : {0.6, 1.0}) {
    all.push_back({fmt::format("a second pattern, {} times the size", size),
                   [=](const cv::Mat& in) { return WithSecondPattern(in, size); }});
  }
  all.push_back({"a bright spot on the lines",
                 [](const cv::Mat& in) { return WithBrightSpot(in, 0.4, 0.5, 0.12); }});
  all.push_back({"a bright spot at the end",
                 [](const cv::Mat& in) { return WithBrightSpot(in, 0.7, 0.7, 0.15); }});
  all.push_back({"dusk", [](const cv::Mat& in) { return Lit(in, {0.25F, 0.25F, 0.25F}, 3); }});
  all.push_back({"a lamp", [](const cv::Mat& in) { return Lit(in, {0.5F, 0.85F, 1.2F}, 1); }});
  all.push_back({"too bright", [](const cv::Mat& in) { return Lit(in, {1.6F, 1.6F, 1.6F}, 1); }});
  for (const double degrees : {0.0, 45.0, 90.0}) {
    all.push_back({fmt::format("shaken by 7 px along {} deg", degrees),
                   [=](const cv::Mat& in) { return Shaken(in, 7, degrees); }});
  }
  for (const double part : {-0.04, 0.04}) {
    all.push_back({fmt::format("bent by {:+} at the corner", part),
                   [=](const cv::Mat& in) { return BentByLens(in, part); }});
  }
  return all;
}

std::vector<Distortion> DistortionsBeyondUse() {
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

}  // namespace trammel::test
