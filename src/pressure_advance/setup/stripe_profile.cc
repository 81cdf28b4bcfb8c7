#include "pressure_advance/setup/stripe_profile.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <vector>

#include "base/square.h"
#include "base/statistics.h"
#include "geometry/linear_systems.h"

namespace trammel::pressure_advance {
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

// Gauss-Newton from the guess; every other step is halved where it would leave the window.
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

// Columns at full scale around the stripe, in each row.
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

}  // namespace

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
  std::vector<double> widths;
  for (const Bins& piece : pieces) {
    const Gaussian part = FitGaussian(piece, fit.sigma);
    if (part.sound) widths.push_back(part.sigma);
  }
  if (widths.size() < kPieces / 2) return StripeProfile{};
  profile.sigma_uncertainty_px =
      StandardDeviation(widths) / std::sqrt(static_cast<double>(widths.size()));
  std::vector<double> levels;
  for (std::size_t i = 0; i < brightness.sum.size(); ++i) {
    if (brightness.count[i] > 0) levels.push_back(brightness.sum[i] / brightness.count[i]);
  }
  profile.background = Quantile(levels, 0.1);
  profile.peak = *std::max_element(levels.begin(), levels.end()) - profile.background;
  profile.saturated_px = SaturatedPx(frame, offset, slope, 3 * fit.sigma + 2);
  return profile;
}

}  // namespace trammel::pressure_advance
