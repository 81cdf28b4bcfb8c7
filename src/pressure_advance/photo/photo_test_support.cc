#include "pressure_advance/photo/photo_test_support.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "base/random.h"
#include "base/statistics.h"
#include "pressure_advance/photo/photo_lines.h"
#include "pressure_advance/photo/photo_search.h"

namespace trammel::pressure_advance {
namespace {

// Share of a pixel that a strip covers whose edges lie `inside` px away from its centre.
double Coverage(double inside_px) { return std::clamp(inside_px + 0.5, 0.0, 1.0); }

double Filament(const DrawnPhoto& photo, double x_mm, double y_mm) {
  const double px = photo.px_per_mm;
  const auto lines = static_cast<double>(photo.pressure_advance_s.size());
  const double top_mm = (lines - 1) * photo.spacing_mm + photo.margin_mm;
  double share = 0;
  if (photo.frame) {
    const double in =
        std::min({x_mm, photo.length_mm - x_mm, y_mm + photo.margin_mm, top_mm - y_mm});
    share = std::min(Coverage(-in * px), Coverage((in + photo.bar_mm) * px));
  }
  if (photo.corner_mark) {
    const double along = std::min(x_mm, 9 - x_mm);
    const double across = std::min(y_mm + photo.margin_mm, 3 - photo.margin_mm - y_mm);
    share = std::max(share, Coverage(std::min(along, across) * px));
  }
  const double nearest = std::clamp(std::round(y_mm / photo.spacing_mm), 0.0, lines - 1);
  const auto line = static_cast<std::size_t>(nearest);
  const bool printed =
      std::find(photo.left_out.begin(), photo.left_out.end(), line) == photo.left_out.end();
  if (printed && x_mm > -0.5 && x_mm < photo.length_mm + 0.5) {
    const double width =
        DrawnWidth_mm(photo, photo.pressure_advance_s[line], x_mm / photo.length_mm);
    const double off = std::abs(y_mm - nearest * photo.spacing_mm);
    share = std::max(share, std::min(width * px, Coverage((width / 2 - off) * px)));
  }
  return share;
}

cv::Mat Grain(int rows, int cols, double smooth_px, double sigma, Random& random) {
  cv::Mat grain(rows, cols, CV_32F);
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < cols; ++x) grain.at<float>(y, x) = static_cast<float>(random.Normal());
  }
  if (smooth_px > 0) cv::GaussianBlur(grain, grain, {}, smooth_px);
  cv::Scalar mean, deviation;
  cv::meanStdDev(grain, mean, deviation);
  return grain * (sigma / deviation[0]);
}

}  // namespace

double DrawnWidth_mm(const DrawnPhoto& photo, double pressure_advance_s, double position) {
  const double error = std::clamp((pressure_advance_s - photo.right_value_s) / 0.03, -1.5, 1.5);
  const auto bump = [&](double at) {
    const double u = (position - at) / 0.025;
    return std::exp(-u * u / 2);
  };
  const double relative =
      1 + 0.35 * error * bump(photo.slow_before) - 1.1 * error * bump(1 - photo.slow_after);
  return photo.bead_mm * std::max(0.0, relative);
}

Frame Draw(const DrawnPhoto& photo) {
  Random random(photo.seed);
  const double centre_x = photo.length_mm / 2;
  const double centre_y =
      static_cast<double>(photo.pressure_advance_s.size() - 1) * photo.spacing_mm / 2 -
      photo.shift_y_mm;
  const double c = std::cos(photo.roll_rad), s = std::sin(photo.roll_rad);
  const double half = std::hypot(photo.width_px, photo.height_px) / 2;
  cv::Mat share(photo.height_px, photo.width_px, CV_32F);
  for (int y = 0; y < photo.height_px; ++y) {
    for (int x = 0; x < photo.width_px; ++x) {
      const double u0 = x - photo.width_px / 2.0, v0 = photo.height_px / 2.0 - y;
      const double bow = 1 + photo.bow * (u0 * u0 + v0 * v0) / (half * half);
      const double u = (c * u0 + s * v0) * bow, v = (c * v0 - s * u0) * bow;
      const double scale = 1 / (photo.px_per_mm * (1 - photo.tilt * v / photo.height_px));
      share.at<float>(y, x) =
          static_cast<float>(Filament(photo, centre_x + u * scale, centre_y + v * scale));
    }
  }
  cv::Mat grain = Grain(photo.height_px, photo.width_px, 1.2, photo.grain, random);
  if (photo.blur_px > 0) cv::GaussianBlur(share, share, {}, photo.blur_px);
  const cv::Mat noise = Grain(photo.height_px, photo.width_px, 0, photo.noise, random);
  Frame frame(photo.width_px, photo.height_px);
  for (int y = 0; y < photo.height_px; ++y) {
    for (int x = 0; x < photo.width_px; ++x) {
      const double light =
          1 + photo.unevenness * ((x + 2.0 * y) / (photo.width_px + 2.0 * photo.height_px) - 0.5);
      const double f = share.at<float>(y, x);
      const double plate = (photo.darker ? 150 : 90) + (1 - f) * grain.at<float>(y, x);
      const double value =
          light * (plate + (photo.darker ? -1 : 1) * f * photo.contrast) + noise.at<float>(y, x);
      for (int k = 0; k < 3; ++k) {
        const double tint = 1 - 0.1 * k * (1 - f);  // a bluish plate
        frame.row(y)[3 * x + k] =
            static_cast<std::uint8_t>(std::clamp(std::lround(value * tint), 0L, 255L));
      }
    }
  }
  return frame;
}

std::vector<double> Steps(std::size_t count, double step_s) {
  std::vector<double> steps;
  for (std::size_t i = 0; i < count; ++i) steps.push_back(step_s * static_cast<double>(i));
  return steps;
}

DrawnPhoto Usual() {
  DrawnPhoto photo;
  photo.pressure_advance_s = Steps();
  return photo;
}

PhotoOptions OptionsFor(const DrawnPhoto& photo) {
  PhotoOptions options;
  options.pressure_advance_s = photo.pressure_advance_s;
  options.slow_before = photo.slow_before;
  options.slow_after = photo.slow_after;
  options.corner_mark = photo.corner_mark;
  return options;
}

PhotoMeasurement MeasurePhoto(const BgrView& photo, const PhotoOptions& options) {
  PhotoMeasurement measurement;
  measurement.refusal = CheckPhotoInput(photo.width, photo.height, options);
  if (!measurement.refusal.empty()) return measurement;
  double scale = 1;
  PhotoSearch search(vision::ShrinkToFit(photo, std::max(photo.width, photo.height), 1e18, scale));
  return MeasurePhotoLines(FindPhotoLines(search, options), options);
}

cv::Mat ToMat(const Frame& frame) {
  return cv::Mat(frame.height, frame.width, CV_8UC3, const_cast<std::uint8_t*>(frame.bgr.data()))
      .clone();
}

BgrView View(const cv::Mat& image) {
  return {image.data, image.cols, image.rows, static_cast<std::ptrdiff_t>(image.step)};
}

double UsualWidth(const LineProfile& profile) {
  std::vector<double> widths;
  for (const ProfileSample& sample : profile.samples) {
    if (sample.width.seen()) widths.push_back(sample.width.value);
  }
  return widths.empty() ? 0 : Median(widths);
}

double Relative(const LineProfile& profile, double from, double to) {
  std::vector<double> widths;
  for (const ProfileSample& sample : profile.samples) {
    if (sample.width.seen() && sample.position > from && sample.position < to) {
      widths.push_back(sample.width.value);
    }
  }
  return widths.empty() ? -1 : Mean(widths) / UsualWidth(profile);
}

double Difference(const PhotoMeasurement& a, const PhotoMeasurement& b) {
  double largest = 0;
  for (std::size_t i = 0; i < a.profiles.size(); ++i) {
    largest = std::max(largest, std::abs(Relative(a.profiles[i], 0.65, 0.78) -
                                         Relative(b.profiles[i], 0.65, 0.78)));
  }
  return largest;
}

}  // namespace trammel::pressure_advance
