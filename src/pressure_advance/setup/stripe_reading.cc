#include "pressure_advance/setup/stripe_reading.h"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <span>
#include <string>
#include <vector>

#include "base/square.h"
#include "base/statistics.h"
#include "geometry/linear_systems.h"
#include "geometry/robust_line.h"
#include "pressure_advance/setup/camera_scale.h"

namespace trammel::pressure_advance {
namespace {

constexpr int kValues = 4;
// Distance of a cheap camera's optical axis from the picture's middle: about 1 % of its width.
constexpr double kPrincipalPoint_px = 8;
constexpr double kMinAngle_rad = 10 * std::numbers::pi / 180;

StripeHeight None(StripeHeight found, const Measured& reason) {
  found.px_per_height_mm = found.laser_angle_rad = found.backlash_z_mm = reason;
  return found;
}

std::optional<LinearFit> Fit(std::span<const SeenStripe> stripes, double height_mm) {
  const auto count = static_cast<Eigen::Index>(stripes.size());
  Eigen::MatrixXd design(count, kValues);
  Eigen::VectorXd observed(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const SeenStripe& stripe = stripes[static_cast<std::size_t>(i)];
    const double z_mm = stripe.head.z_mm - height_mm;
    design.row(i) << 1, z_mm, -z_mm * stripe.across_px, 0.5 * stripe.head.from_z;
    observed[i] = stripe.across_px;
  }
  return FitLinear(design, observed);
}

std::string Fault(const StripeHeight& found, double backlash_mm) {
  if (found.repeat_mm > kMaxRepeat_mm) {
    return fmt::format(
        "the same height does not show the stripe at the same place: {:.3f} mm rms where {:.3f} mm "
        "are borne; tighten the mount of camera and laser",
        found.repeat_mm, kMaxRepeat_mm);
  }
  if (std::abs(backlash_mm) > kMaxBacklash_mm) {
    return fmt::format(
        "coming from above and from below shows heights {:.3f} mm apart where {:.3f} mm are borne: "
        "camera or laser is loose, or z has backlash",
        std::abs(backlash_mm), kMaxBacklash_mm);
  }
  return {};
}

}  // namespace

StripeHeight FitStripeHeight(std::span<const SeenStripe> stripes, double height_mm,
                             const Measured& px_per_mm) {
  StripeHeight found;
  const auto fit = Fit(stripes, height_mm);
  if (!fit) {
    return None(found, Measured::CannotTell(fmt::format(
                           "{} pictures of the stripe do not determine its way: see it at heights "
                           "on both sides of {:.2f} mm, reached from above and from below",
                           stripes.size(), height_mm)));
  }
  const auto [low, high] =
      std::ranges::minmax(stripes, {}, [](const SeenStripe& stripe) { return stripe.head.z_mm; });
  if (low.head.z_mm > height_mm || high.head.z_mm < height_mm) {
    return None(found, Measured::CannotTell(fmt::format(
                           "the stripe was seen from {:.2f} to {:.2f} mm, which leaves out the "
                           "height asked for, {:.2f} mm",
                           low.head.z_mm, high.head.z_mm, height_mm)));
  }
  const double across = fit->value[0], inverse_mm = fit->value[2];
  found.perspective = {height_mm, inverse_mm, std::sqrt(fit->covariance(2, 2))};
  found.across_px = across;
  found.across_uncertainty_px = std::sqrt(fit->covariance(0, 0));
  const double slope = fit->value[1] - inverse_mm * across;  // d across / d z at the height
  Eigen::VectorXd to_slope(kValues);
  to_slope << -inverse_mm, 1, -across, 0;
  constexpr double kSeen = 5;
  if (!(std::abs(slope) > kSeen * std::sqrt(Variance(*fit, to_slope)))) {
    return None(found, Measured::Refused("the stripe does not move with the head's height: the "
                                         "laser is not seen, and a glint or a lamp is taken for "
                                         "it, or laser and camera look the same way"));
  }
  found.repeat_mm = fit->residual / std::abs(slope);
  Eigen::VectorXd to_play = Eigen::VectorXd::Zero(kValues);
  to_play[3] = 1 / slope;
  const double backlash_mm = fit->value[3] / slope;
  const std::string fault = Fault(found, backlash_mm);
  if (!fault.empty()) return None(found, Measured::Refused(fault));
  const double dof = fit->degrees_of_freedom;
  found.backlash_z_mm = MeasuredFrom(backlash_mm, Variance(*fit, to_play), 0, dof);
  found.px_per_height_mm =
      MeasuredFrom(slope, Variance(*fit, to_slope), Square(slope * kAxisScaleUncertainty), dof);
  if (!px_per_mm.good()) {
    found.laser_angle_rad = px_per_mm;
    return found;
  }
  const double scale = px_per_mm.quantity().value;
  const double tangent = std::abs(fit->value[1]) / scale;
  const double gain = 1 / (1 + Square(tangent));  // d angle / d tangent
  if (std::atan(tangent) < kMinAngle_rad) {
    found.laser_angle_rad = Measured::CannotTell(fmt::format(
        "the laser stands {:.1f} degrees from the vertical, too steep to show heights: turn it to "
        "about 45 degrees",
        std::atan(tangent) * 180 / std::numbers::pi));
    return found;
  }
  Eigen::VectorXd to_angle = Eigen::VectorXd::Zero(kValues);
  to_angle[1] = gain / scale;
  const double systematic =
      Square(gain * tangent) * (Square(px_per_mm.quantity().standard_uncertainty / scale) +
                                Square(kAxisScaleUncertainty)) +
      Square(gain * inverse_mm * kPrincipalPoint_px / scale);
  found.laser_angle_rad =
      MeasuredFrom(std::atan(tangent), Variance(*fit, to_angle), systematic, dof);
  return found;
}

namespace {

constexpr int kBinsPerPx = 2;
constexpr int kPieces = 8;
constexpr double kReach = 6;  // first guesses of sigma to either side

// Sums over rows, in bins of the distance from the line.
struct Bins {
  explicit Bins(int half_px)
      : half(half_px * kBinsPerPx), sum(std::size_t(2 * half + 1)), count(sum.size()) {}
  int half;
  std::vector<double> sum, count;

  void Add(double distance_px, double value) {
    const int bin = static_cast<int>(std::lround(distance_px * kBinsPerPx)) + half;
    if (bin < 0 || bin > 2 * half) return;
    sum[static_cast<std::size_t>(bin)] += value;
    count[static_cast<std::size_t>(bin)] += 1;
  }
};

struct Gaussian {
  double amplitude = 0, centre = 0, sigma = 0, constant = 0;
  bool sound = false;
};

// Fits by Gauss-Newton from the guess; a step that would leave the window is halved.
Gaussian FitGaussian(const Bins& bins, double guess_px) {
  std::vector<double> x, y;
  for (std::size_t i = 0; i < bins.sum.size(); ++i) {
    if (bins.count[i] == 0) continue;
    x.push_back((static_cast<double>(i) - bins.half) / kBinsPerPx);
    y.push_back(bins.sum[i] / bins.count[i]);
  }
  Gaussian fit;
  if (x.size() < 8) return fit;
  const double reach = x.back();
  fit.constant = Quantile(y, 0.1);
  fit.amplitude = *std::max_element(y.begin(), y.end()) - fit.constant;
  fit.centre = x[static_cast<std::size_t>(std::max_element(y.begin(), y.end()) - y.begin())];
  fit.sigma = guess_px;
  constexpr int kSteps = 30;
  for (int step = 0; step < kSteps; ++step) {
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(4, 4);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(4);
    for (std::size_t i = 0; i < x.size(); ++i) {
      const double t = (x[i] - fit.centre) / fit.sigma;
      const double bell = std::exp(-0.5 * t * t);
      Eigen::Vector4d gradient(bell, fit.amplitude * bell * t / fit.sigma,
                               fit.amplitude * bell * t * t / fit.sigma, 1);
      normal += gradient * gradient.transpose();
      right += gradient * (y[i] - fit.constant - fit.amplitude * bell);
    }
    const auto change = geometry::SolveOfFullRank(normal, right);
    if (!change) return fit;
    fit.amplitude += (*change)[0];
    fit.centre += std::clamp((*change)[1], -fit.sigma, fit.sigma);
    fit.sigma = std::clamp(fit.sigma + (*change)[2], 0.5 * fit.sigma, 2 * fit.sigma);
    fit.constant += (*change)[3];
    if (std::abs(fit.centre) > reach || fit.sigma > reach || fit.sigma < 0.2) return fit;
    if (std::abs((*change)[1]) + std::abs((*change)[2]) < 1e-4) {
      fit.sound = fit.amplitude > 0;
      return fit;
    }
  }
  return fit;
}

// Returns the saturated columns around the stripe, in each row.
double SaturatedPx(const BgrView& frame, double offset, double slope, double reach_px) {
  constexpr int kFullScale = 250;
  std::vector<double> widths;
  for (int y = 0; y < frame.height; ++y) {
    const double centre = offset + slope * y;
    const int first = std::max(0, static_cast<int>(centre - reach_px));
    const int last = std::min(frame.width - 1, static_cast<int>(centre + reach_px));
    int width = 0;
    for (int x = first; x <= last; ++x) {
      const std::uint8_t* pixel = frame.row(y) + 3 * x;
      width += std::max({pixel[0], pixel[1], pixel[2]}) >= kFullScale ? 1 : 0;
    }
    widths.push_back(width);
  }
  return widths.empty() ? 0 : Median(widths);
}

struct StripeProfile {
  double sigma_px = 0;      // of the Gaussian that fits the profile; 0: none does
  double peak = 0;          // grey levels over the background, brightest channel
  double background = 0;    // grey levels of that channel beside the stripe
  double saturated_px = 0;  // columns at full scale, in the typical row
};

// Averages the rows of a stripe along the straight line column = offset + slope · row and fits a
// Gaussian on a constant. The tails (a plate's halo) weigh less than the core.
StripeProfile MeasureProfile(const BgrView& frame, const vision::StripeModel& model, double offset,
                             double slope, double about_px) {
  const int half_px = static_cast<int>(std::ceil(kReach * about_px)) + 4;
  Bins whole(half_px), brightness(half_px);
  std::vector<Bins> pieces(kPieces, Bins(half_px));
  for (int y = 0; y < frame.height; ++y) {
    const double centre = offset + slope * y;
    const int first = std::max(0, static_cast<int>(std::ceil(centre - half_px)));
    const int last = std::min(frame.width - 1, static_cast<int>(std::floor(centre + half_px)));
    Bins& piece = pieces[static_cast<std::size_t>(kPieces * y / frame.height)];
    for (int x = first; x <= last; ++x) {
      const std::uint8_t* pixel = frame.row(y) + 3 * x;
      const double signal =
          model.weight_b * pixel[0] + model.weight_g * pixel[1] + model.weight_r * pixel[2];
      whole.Add(x - centre, signal);
      piece.Add(x - centre, signal);
      brightness.Add(x - centre, std::max({pixel[0], pixel[1], pixel[2]}));
    }
  }
  StripeProfile profile;
  const Gaussian fit = FitGaussian(whole, about_px);
  if (!fit.sound) return profile;
  profile.sigma_px = fit.sigma;
  const auto sound = std::count_if(pieces.begin(), pieces.end(), [&](const Bins& piece) {
    return FitGaussian(piece, fit.sigma).sound;
  });
  if (sound < kPieces / 2) return StripeProfile{};
  std::vector<double> levels;
  for (std::size_t i = 0; i < brightness.sum.size(); ++i) {
    if (brightness.count[i] > 0) levels.push_back(brightness.sum[i] / brightness.count[i]);
  }
  profile.background = Quantile(levels, 0.1);
  profile.peak = *std::max_element(levels.begin(), levels.end()) - profile.background;
  profile.saturated_px = SaturatedPx(frame, offset, slope, 3 * fit.sigma + 2);
  return profile;
}

constexpr int kSmallest_px = 32;
constexpr int kLearningRows = 120;  // to learn the stripe's appearance
constexpr double kMinContrast = 3;  // the best path through pure noise reaches 2
constexpr double kMinSeen = 0.5;    // share of rows
constexpr double kMinPeak = 20;     // grey levels; below, JPEG's quantisation shapes the profile
constexpr double kStraight = 1.5;   // stripe sigmas that rows may stand off, in the median

const vision::LaserLineOptions kLine{.row_smoothing = 0, .as_good = 1.15};

Frame Turned(const BgrView& view) {
  Frame turned(view.height, view.width);
  for (int y = 0; y < view.height; ++y) {
    const std::uint8_t* from = view.row(y);
    for (int x = 0; x < view.width; ++x) {
      std::copy_n(from + 3 * x, 3, turned.row(x) + 3 * y);
    }
  }
  return turned;
}

vision::StripeModel Learn(const BgrView& frame, vision::LaserLineWorkspace& workspace) {
  BgrView thinned = frame;
  const int step = std::max(1, frame.height / kLearningRows);
  thinned.height = frame.height / step;
  thinned.stride = frame.stride * step;
  return vision::LearnStripe({&thinned, 1}, kLine, workspace);
}

// Rows with a stripe, from the picture's centre, and the columns there.
struct Centres {
  std::vector<double> row;
  std::vector<double> column;
};

struct Straight {
  double at_middle = 0;
  double slope = 0;
  double scatter_px = 0;  // median distance of all rows
};

// Least squares over the rows near a robust line.
Straight FitStraight(const Centres& centres) {
  std::vector<double> scratch;
  const auto robust = geometry::FitRobustLine(centres.row, centres.column, scratch);
  const double reach = std::max(0.5, 4 * 1.4826 * robust.median_residual);
  double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
  for (std::size_t i = 0; i < centres.row.size(); ++i) {
    if (std::abs(centres.column[i] - robust.at(centres.row[i])) > reach) continue;
    const double x = centres.row[i], y = centres.column[i];
    n += 1, sx += x, sy += y, sxx += x * x, sxy += x * y;
  }
  Straight line;
  line.scatter_px = robust.median_residual;
  const double spread = sxx - sx * sx / n;
  line.slope = spread > 0 ? (sxy - sx * sy / n) / spread : robust.slope;
  line.at_middle = (sy - line.slope * sx) / n;
  return line;
}

StripeReading Fault(std::string why, StripeReading reading = {}) {
  reading.fault = std::move(why);
  return reading;
}

StripeReading ReadUpright(const BgrView& frame, vision::LaserLineWorkspace& workspace) {
  if (frame.width < kSmallest_px || frame.height < kSmallest_px) {
    return Fault(fmt::format("a picture of {} x {} px is too small: at least {} x {} are needed",
                             frame.width, frame.height, kSmallest_px, kSmallest_px));
  }
  const vision::StripeModel model = Learn(frame, workspace);
  vision::LaserLine line;
  vision::FindLaserLine(frame, model, kLine, workspace, line);
  Centres centres;
  const double middle_row = 0.5 * (frame.height - 1), middle_column = 0.5 * (frame.width - 1);
  for (std::size_t y = 0; y < line.centre_px.size(); ++y) {
    if (!line.found(y)) continue;
    centres.row.push_back(static_cast<double>(y) - middle_row);
    centres.column.push_back(line.centre_px[y]);
  }
  const double seen = static_cast<double>(centres.row.size()) / frame.height;
  if (line.contrast < kMinContrast || seen < kMinSeen) {
    return Fault(fmt::format(
        "no laser stripe goes through the picture (contrast {:.1f} of {:.0f}, in {:.0f} % of the "
        "rows): check that the laser shines, that the stripe falls into the picture, and the "
        "camera's exposure",
        line.contrast, kMinContrast, 100 * seen));
  }
  const Straight straight = FitStraight(centres);
  if (straight.scatter_px > kStraight * std::max(1.0F, model.sigma_px)) {
    return Fault(fmt::format(
        "the brightest line of the picture is not straight (rows stand off by {:.1f} px): it is no "
        "laser stripe, or something lies on the plate",
        straight.scatter_px));
  }
  StripeReading reading;
  reading.slope = straight.slope;
  const double cosine = 1 / std::hypot(1.0, straight.slope);
  reading.across_px = (straight.at_middle - middle_column) * cosine;
  const StripeProfile profile =
      MeasureProfile(frame, model, straight.at_middle - straight.slope * middle_row, straight.slope,
                     model.sigma_px);
  reading.width_px = profile.sigma_px * cosine;
  reading.peak = profile.peak;
  reading.background = profile.background;
  reading.saturated_px = profile.saturated_px * cosine;
  if (profile.peak < kMinPeak) {
    return Fault(
        fmt::format("the laser stripe is too dark: {:.0f} grey levels over its "
                    "surroundings, at least {:.0f} are needed; raise the camera's exposure",
                    profile.peak, kMinPeak),
        reading);
  }
  if (!(profile.sigma_px > 0)) {
    return Fault("the laser stripe has no measurable width: its profile is no single peak",
                 reading);
  }
  constexpr double kMaxSaturated = 0.7;  // of the width at half height: five times full scale
  const double half_height_px = 2.355 * reading.width_px;
  if (reading.saturated_px > kMaxSaturated * half_height_px) {
    return Fault(
        fmt::format(
            "the laser stripe is overexposed: {:.0f} px of its width of {:.0f} px are at the "
            "sensor's full scale; lower the camera's exposure or dim the laser",
            reading.saturated_px, half_height_px),
        reading);
  }
  return reading;
}

}  // namespace

bool StripeRunsDown(const BgrView& frame) {
  std::vector<double> column(static_cast<std::size_t>(frame.width));
  std::vector<double> row(static_cast<std::size_t>(frame.height));
  for (int y = 0; y < frame.height; ++y) {
    const std::uint8_t* pixel = frame.row(y);
    for (int x = 0; x < frame.width; ++x, pixel += 3) {
      const double redder = std::max(0.0, pixel[2] - 0.5 * (pixel[0] + pixel[1]));
      column[static_cast<std::size_t>(x)] += redder / frame.height;
      row[static_cast<std::size_t>(y)] += redder / frame.width;
    }
  }
  if (column.empty() || row.empty()) return true;
  // A stripe is a peak in the means along it, and spread out in the means across it.
  const auto peak = [](const std::vector<double>& means) {
    return *std::max_element(means.begin(), means.end()) - Median(means);
  };
  return peak(column) >= peak(row);
}

StripeReading ReadStripe(const BgrView& frame, bool down, vision::LaserLineWorkspace& workspace) {
  StripeReading reading;
  if (down) {
    reading = ReadUpright(frame, workspace);
  } else {
    const Frame turned = Turned(frame);
    reading = ReadUpright(turned.view(), workspace);
  }
  reading.down = down;
  return reading;
}

}  // namespace trammel::pressure_advance
