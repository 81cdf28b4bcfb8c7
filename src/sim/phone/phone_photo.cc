#include "sim/phone/phone_photo.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "sim/scanner/scanner_optics.h"

namespace trammel::sim {
namespace {

constexpr double kAroundMm = 20;  // paper around the print
constexpr double kWaveMm = 70;
constexpr double kTable = 0.2;  // reflectance of what lies under the paper
constexpr int kBandRows = 64;
constexpr int kPaperSteps = 64;  // along each of its edges
// Blur of the pyramid of CoverageRows: a square of a pixel twice, less the square that every pixel
// has.
constexpr double kPyramidPx = 0.29;

InkOutline PaperOutline(const PhoneMap& map, double outwards) {
  InkOutline outline;
  const auto corners = map.Paper();
  for (std::size_t i = 0; i < 4; ++i) {
    const PlaneMm& a = corners[i];
    const PlaneMm& b = corners[(i + 1) % 4];
    for (int step = 0; step < kPaperSteps; ++step) {
      const double t = static_cast<double>(step) / kPaperSteps;
      outline.corners.push_back(map.PixelOf(
          {a.x_mm + t * (b.x_mm - a.x_mm), a.y_mm + t * (b.y_mm - a.y_mm)}, 0, outwards));
    }
  }
  Close(outline);
  return outline;
}

// Draws the light of one channel, reflectances, before the lens blurs it.
void DrawChannel(const PrintedSheet& sheet, const PhoneTraits& traits, const PhoneMap& map,
                 std::size_t rgb, cv::Mat& plane) {
  const double channel_px = rgb == 0 ? traits.colour_px : rgb == 2 ? -traits.colour_px : 0;
  std::vector<InkOutline> outlines;
  outlines.reserve(sheet.strokes.size());
  for (const InkStroke& stroke : sheet.strokes) {
    const auto ink = static_cast<std::size_t>(stroke.ink);
    const bool dirt = stroke.ink == kDirtInk;
    const double height_mm = dirt ? 0 : traits.line_height_mm + traits.extra_height_mm[ink];
    const double outwards = map.OutwardsBy(channel_px + traits.tool_colour_px[ink]);
    outlines.push_back(OutlineOf(
        stroke, [&](const PlaneMm& bed) { return map.PixelOf(bed, height_mm, outwards); }));
  }
  const InkOutline paper = PaperOutline(map, map.OutwardsBy(channel_px));
  CoverageRows rows;
  std::vector<std::vector<const InkOutline*>> of_ink(kInkCount);
  for (const InkOutline& outline : outlines) {
    of_ink[static_cast<std::size_t>(outline.ink)].push_back(&outline);
  }
  for (int first = 0; first < plane.rows; first += kBandRows) {
    const int count = std::min(kBandRows, plane.rows - first);
    const auto lay = [&](const std::vector<const InkOutline*>& shapes, double reflectance) {
      bool any = false;
      for (const InkOutline* shape : shapes) {
        if (shape->top_px - CoverageRows::kReachPx >= first + count ||
            shape->bottom_px + CoverageRows::kReachPx <= first ||
            shape->right_px < -CoverageRows::kReachPx ||
            shape->left_px > plane.cols + CoverageRows::kReachPx) {
          continue;
        }
        if (!any) rows.Reset(first, count, plane.cols);
        any = true;
        rows.Add(*shape);
      }
      if (!any) return;
      rows.Sum();
      for (int row = 0; row < count; ++row) {
        const auto coverage = rows.row(row);
        float* light = plane.ptr<float>(first + row);
        for (int x = 0; x < plane.cols; ++x) {
          light[x] +=
              coverage[static_cast<std::size_t>(x)] * (static_cast<float>(reflectance) - light[x]);
        }
      }
    };
    plane.rowRange(first, first + count).setTo(kTable);
    lay({&paper}, sheet.paper[rgb]);
    for (std::size_t ink = 0; ink < kInkCount; ++ink) lay(of_ink[ink], sheet.inks[ink][rgb]);
  }
}

// Applies lamp and sensor: from reflectances to bytes.
void Expose(const PhoneTraits& traits, std::size_t rgb, Random random, cv::Mat& plane,
            Frame& frame) {
  const double rest =
      std::sqrt(std::max(0.0, traits.blur_px * traits.blur_px - kPyramidPx * kPyramidPx));
  if (rest > 0.05) cv::GaussianBlur(plane, plane, cv::Size(), rest, rest, cv::BORDER_REPLICATE);
  const double half = std::hypot(frame.width, frame.height) / 2;
  const double c = std::cos(traits.gradient_rad);
  const double s = std::sin(traits.gradient_rad);
  for (int y = 0; y < frame.height; ++y) {
    float* light = plane.ptr<float>(y);
    const double v = y + 0.5 - frame.height / 2.0;
    for (int x = 0; x < frame.width; ++x) {
      const double u = x + 0.5 - frame.width / 2.0;
      const double r2 = (u * u + v * v) / (half * half);
      double value = light[x] * (1 - traits.vignetting * r2) *
                     std::max(0.05, 1 + traits.gradient * (c * u - s * v) / frame.width);
      if (traits.glare > 0) {
        const double dx = (u / frame.width - traits.glare_x) / traits.glare_size;
        const double dy = (v / frame.width - traits.glare_y) / traits.glare_size;
        const double d2 = dx * dx + dy * dy;
        if (d2 < 50) value += traits.glare * std::exp(-d2 / 2);
      }
      if (traits.noise > 0) value += random.Normal(0, traits.noise);
      light[x] = static_cast<float>(std::pow(std::clamp(value, 0.0, 1.0), 1 / traits.gamma));
    }
  }
  cv::Mat soft;
  if (traits.sharpen > 0) cv::GaussianBlur(plane, soft, cv::Size(), 1.2, 1.2);
  for (int y = 0; y < frame.height; ++y) {
    const float* light = plane.ptr<float>(y);
    const float* around = traits.sharpen > 0 ? soft.ptr<float>(y) : light;
    std::uint8_t* out = frame.row(y) + (2 - rgb);
    for (int x = 0; x < frame.width; ++x) {
      const double value = light[x] + traits.sharpen * (light[x] - around[x]);
      out[3 * x] = static_cast<std::uint8_t>(std::clamp(255 * value, 0.0, 255.0) + 0.5);
    }
  }
}

}  // namespace

PhoneMap::PhoneMap(const PrintedSheet& sheet, const PhoneTraits& traits)
    : traits_(traits), print_(Turned(sheet, 0)) {
  reach_mm_ = std::hypot(print_.half_width_mm, print_.half_height_mm);
  // Rotates the sheet in its own plane, then tilts it about the line across the tilt's direction.
  const double c = std::cos(traits.turn_rad);
  const double s = std::sin(traits.turn_rad);
  const double kx = -std::sin(traits.tilt_to_rad);
  const double ky = std::cos(traits.tilt_to_rad);
  const double cosine = std::cos(traits.tilt_rad);
  const double sine = std::sin(traits.tilt_rad);
  // Rodrigues about (kx, ky, 0): +x towards -z, which points away from the camera.
  const double tilt[3][3] = {{cosine + kx * kx * (1 - cosine), kx * ky * (1 - cosine), ky * sine},
                             {kx * ky * (1 - cosine), cosine + ky * ky * (1 - cosine), -kx * sine},
                             {-ky * sine, kx * sine, cosine}};
  const double turn[3][3] = {{c, -s, 0}, {s, c, 0}, {0, 0, 1}};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      for (std::size_t k = 0; k < 3; ++k) camera_from_sheet_[i][j] += tilt[i][k] * turn[k][j];
    }
  }
}

double PhoneMap::PaperHeightAt(double right_mm, double up_mm) const {
  const double along = right_mm * std::cos(traits_.bow_rad) + up_mm * std::sin(traits_.bow_rad);
  const double across = up_mm * std::cos(traits_.bow_rad) - right_mm * std::sin(traits_.bow_rad);
  const double u = along / reach_mm_;
  return traits_.bow_mm * u * u +
         traits_.wave_mm * std::sin(2 * std::numbers::pi * across / kWaveMm);
}

PixelPlace PhoneMap::PixelOf(const PlaneMm& bed, double height_mm, double outwards) const {
  const double x = bed.x_mm - print_.middle.x_mm;
  const double y = bed.y_mm - print_.middle.y_mm;
  const double z = height_mm + PaperHeightAt(x, y);
  const auto turned = [&](std::size_t i) {
    return camera_from_sheet_[i][0] * x + camera_from_sheet_[i][1] * y +
           camera_from_sheet_[i][2] * z;
  };
  const double depth_mm = traits_.distance_mm - turned(2);
  const double a = turned(0) / depth_mm;
  const double b = -turned(1) / depth_mm;
  const double r2 = a * a + b * b;
  const auto& k = traits_.radial;
  const auto& p = traits_.tangential;
  const double radial = 1 + r2 * (k[0] + r2 * (k[1] + r2 * k[2]));
  const double seen_a = a * radial + 2 * p[0] * a * b + p[1] * (r2 + 2 * a * a);
  const double seen_b = b * radial + p[0] * (r2 + 2 * b * b) + 2 * p[1] * a * b;
  return {traits_.width_px / 2.0 + traits_.centre_x_px + traits_.shift_x_px +
              outwards * traits_.focal_px * seen_a,
          traits_.height_px / 2.0 + traits_.centre_y_px + traits_.shift_y_px +
              outwards * traits_.focal_px * seen_b};
}

double PhoneMap::OutwardsBy(double corner_px) const {
  return 1 + corner_px / (std::hypot(traits_.width_px, traits_.height_px) / 2);
}

std::array<PlaneMm, 4> PhoneMap::Paper() const {
  const double w = print_.half_width_mm + kAroundMm;
  const double h = print_.half_height_mm + kAroundMm;
  const PlaneMm& m = print_.middle;
  return {PlaneMm{m.x_mm - w, m.y_mm - h}, PlaneMm{m.x_mm + w, m.y_mm - h},
          PlaneMm{m.x_mm + w, m.y_mm + h}, PlaneMm{m.x_mm - w, m.y_mm + h}};
}

Result<Frame> PhotographSheet(const PrintedSheet& sheet, const PhoneTraits& traits, Random random) {
  if (sheet.strokes.empty()) return Fail("no tool printed: there is nothing to photograph");
  const PhoneMap map(sheet, traits);
  Frame frame(traits.width_px, traits.height_px);
  cv::Mat plane(traits.height_px, traits.width_px, CV_32F);
  for (std::size_t rgb = 0; rgb < 3; ++rgb) {
    DrawChannel(sheet, traits, map, rgb, plane);
    Expose(traits, rgb, random.Fork(rgb), plane, frame);
  }
  return frame;
}

}  // namespace trammel::sim
