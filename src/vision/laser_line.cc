#include "vision/laser_line.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "base/check.h"
#include "vision/stripe_search.h"

namespace trammel::vision {
namespace {

/// Prior shape of the light's own noise: speckle contrast left after the exposure's averaging.
/// Only its ratio to the sensor's noise matters, the scatter from row to row sets the scale.
constexpr double kSpeckleContrast = 0.3;

/// Steps of at least 0.3 sigma cross the reach in 14; the rest is Newton's.
constexpr int kMaxIterations = 24;

struct RowFit {
  double centre = 0;
  double sigma = 0;  ///< 0: no maximum near the start
};

/// What places the line within a row: the model's colours without those it subtracts. They tell the
/// line from white glints, but the core of a strong line is white itself, and subtracting them
/// there would hollow it out.
std::span<const float> BrightnessOf(const std::uint8_t* row, int width, const StripeModel& model,
                                    std::vector<float>& brightness) {
  const float b = std::max(0.0F, model.weight_b);
  const float g = std::max(0.0F, model.weight_g);
  const float r = std::max(0.0F, model.weight_r);
  brightness.resize(static_cast<std::size_t>(width));
  for (float& value : brightness) {
    value = b * row[0] + g * row[1] + r * row[2];
    row += 3;
  }
  return brightness;
}

/// exp(-t^2 / 2) at t = (x - centre) / sigma for x = first, first + 1, …, each from the one before.
class GaussianSteps {
 public:
  /// What all of one sigma have in common.
  struct Width {
    explicit Width(double sigma_px)
        : sigma(sigma_px), per_square(1 / (sigma * sigma)), ratio_step(std::exp(-per_square)) {}
    double sigma;
    double per_square;
    double ratio_step;
  };

  GaussianSteps(double first, double centre, const Width& width)
      : value_(std::exp(-0.5 * (first - centre) * (first - centre) * width.per_square)),
        ratio_(std::exp(-((first - centre) + 0.5) * width.per_square)),
        ratio_step_(width.ratio_step) {}

  double Next() {
    const double value = value_;
    value_ *= ratio_;
    ratio_ *= ratio_step_;
    return value;
  }

 private:
  double value_;
  double ratio_;
  double ratio_step_;
};

/// Newton's method on the likelihood of a Gaussian stripe: sum of s(x)·g'(x - c) = 0.
RowFit FitRow(std::span<const float> signal, double start, const GaussianSteps::Width& gauss,
              double pixel_noise) {
  const double sigma = gauss.sigma;
  const double per_sigma = 1 / sigma;
  const int width = static_cast<int>(signal.size());
  RowFit fit;
  double c = start;
  double curvature = 0;
  double background = 0;
  int lo = 0;
  int hi = 0;
  bool converged = false;
  for (int iteration = 0; iteration < kMaxIterations && !converged; ++iteration) {
    lo = std::max(0, static_cast<int>(std::ceil(c - kBackgroundReach * sigma)));
    hi = std::min(width - 1, static_cast<int>(c + kBackgroundReach * sigma));
    background = *std::min_element(signal.begin() + lo, signal.begin() + hi + 1);
    double slope = 0;
    curvature = 0;
    GaussianSteps gaussian(lo, c, gauss);
    for (int x = lo; x <= hi; ++x) {
      const double t = (x - c) * per_sigma;
      const double weight = (signal[static_cast<std::size_t>(x)] - background) * gaussian.Next();
      slope += weight * t;
      curvature += weight * (1 - t * t);
    }
    double step = curvature > 0 ? sigma * slope / curvature : std::copysign(0.3 * sigma, slope);
    step = std::clamp(step, -0.5 * sigma, 0.5 * sigma);
    c += step;
    if (std::abs(c - start) > kBackgroundReach * sigma || c < 0 || c > width - 1) {
      return fit;
    }
    converged = std::abs(step) < 1e-3 * sigma;
  }
  if (!converged || curvature <= 0) {
    return fit;
  }
  double variance = 0;
  GaussianSteps gaussian(lo, c, gauss);
  for (int x = lo; x <= hi; ++x) {
    const double t = (x - c) * per_sigma;
    const double influence = t * gaussian.Next();
    const double speckle = kSpeckleContrast * (signal[static_cast<std::size_t>(x)] - background);
    variance += influence * influence * (pixel_noise * pixel_noise + speckle * speckle);
  }
  fit.centre = c;
  fit.sigma = sigma * std::sqrt(variance) / curvature;
  return fit;
}

/// Rows support their neighbours, weighted by their own certainty, never across a step.
void SmoothAlongLine(const LaserLineOptions& options, float sigma, LaserLineWorkspace& ws,
                     LaserLine& line) {
  const double spread = options.row_smoothing * sigma;
  const int height = static_cast<int>(line.centre_px.size());
  ws.raw_centre.assign(line.centre_px.begin(), line.centre_px.end());
  ws.raw_weight.assign(line.sigma_px.begin(), line.sigma_px.end());
  const int reach = static_cast<int>(std::ceil(2.5 * spread));
  for (int y = 0; y < height; ++y) {
    const auto row = static_cast<std::size_t>(y);
    if (ws.raw_weight[row] <= 0) {
      continue;
    }
    double sum = 0;
    double sum_weight = 0;
    double sum_square = 0;
    const int side = std::min({reach, y, height - 1 - y});
    for (int k = -side; k <= side; ++k) {
      const auto other = static_cast<std::size_t>(y + k);
      if (ws.raw_weight[other] <= 0 ||
          !Connected(ws.path, std::min(y, y + k), std::max(y, y + k), sigma)) {
        continue;
      }
      const double variance = ws.raw_weight[other] * ws.raw_weight[other];
      const double weight = std::exp(-0.5 * k * k / (spread * spread)) / variance;
      sum += weight * ws.raw_centre[other];
      sum_weight += weight;
      sum_square += weight * weight * variance;
    }
    line.centre_px[row] = static_cast<float>(sum / sum_weight);
    line.sigma_px[row] = static_cast<float>(std::sqrt(sum_square) / sum_weight);
  }
}

/// Scales the predicted sigmas to the scatter of second differences over a lag beyond which the
/// speckle's grains are independent.
void ScaleToScatter(float sigma, const LaserLineOptions& options, LaserLineWorkspace& ws,
                    LaserLine& line) {
  const int height = static_cast<int>(line.centre_px.size());
  const int lag = std::max(2, static_cast<int>(std::ceil((1 + 2 * options.row_smoothing) * sigma)));
  ws.sample.clear();
  for (int y = lag; y + lag < height; ++y) {
    const auto a = static_cast<std::size_t>(y - lag);
    const auto b = static_cast<std::size_t>(y);
    const auto c = static_cast<std::size_t>(y + lag);
    if (!line.found(a) || !line.found(b) || !line.found(c) ||
        !Connected(ws.path, y - lag, y + lag, sigma)) {
      continue;
    }
    const float predicted =
        std::sqrt(line.sigma_px[a] * line.sigma_px[a] + 4 * line.sigma_px[b] * line.sigma_px[b] +
                  line.sigma_px[c] * line.sigma_px[c]);
    ws.sample.push_back((line.centre_px[a] - 2 * line.centre_px[b] + line.centre_px[c]) /
                        predicted);
  }
  if (ws.sample.size() < 8) {
    return;
  }
  const float scale = std::max(0.05F, kMadToSigma * MedianMagnitude(ws.sample));
  for (float& s : line.sigma_px) {
    s *= scale;
  }
}

/// Robust sigma of the response beside the line: beyond the reach of its own background box.
float NoiseBesidePath(const ImageSize& size, float sigma, LaserLineWorkspace& ws) {
  const int reach = static_cast<int>(std::ceil((kBackgroundReach + 2) * sigma));
  const int step = static_cast<int>(std::max<std::size_t>(1, size.area() / 20011));
  ws.sample.clear();
  int phase = 0;  // carried from row to row, so that a coarse step does not sample fixed columns
  for (int y = 0; y < size.height; ++y) {
    const int centre = ws.path[static_cast<std::size_t>(y)];
    int x = phase;
    for (; x < size.width; x += step) {
      if (std::abs(x - centre) > reach) {
        ws.sample.push_back(ws.response[size.at(y) + static_cast<std::size_t>(x)]);
      }
    }
    phase = x - size.width;
  }
  return kMadToSigma * MedianMagnitude(ws.sample);
}

/// Mean response on the path over the noise.
float PathContrast(const ImageSize& size, float noise, const LaserLineWorkspace& ws) {
  double sum = 0;
  for (int y = 0; y < size.height; ++y) {
    sum += ws.response[size.at(y) + static_cast<std::size_t>(ws.path[static_cast<std::size_t>(y)])];
  }
  return static_cast<float>(sum / size.height) / noise;
}

/// What row y offers as a stripe: the mean response on the path over its neighbours within half a
/// stripe sigma, but never more than twice its own.
float Supported(const ImageSize& size, int y, float sigma, const LaserLineWorkspace& ws) {
  const auto on_path = [&](int row) {
    return ws
        .response[size.at(row) + static_cast<std::size_t>(ws.path[static_cast<std::size_t>(row)])];
  };
  const int reach = static_cast<int>(std::lround(0.5F * sigma));
  float sum = 0;
  int rows = 0;
  for (int k = std::max(0, y - reach); k <= std::min(size.height - 1, y + reach); ++k) {
    if (Connected(ws.path, std::min(k, y), std::max(k, y), sigma)) {
      sum += on_path(k);
      ++rows;
    }
  }
  return std::min(sum / static_cast<float>(rows), 2 * on_path(y));
}

}  // namespace

void FindRows(const BgrView& frame, const StripeModel& model, const LaserLineOptions& options,
              LaserLineWorkspace& workspace, LaserLine& line) {
  TRAMMEL_CHECK(frame.width >= 3 && frame.height >= 1 && model.sigma_px > 0,
                "frame {}x{}, stripe sigma {}", frame.width, frame.height, model.sigma_px);
  const ImageSize size{frame.width, frame.height};
  ExtractSignal(frame, model, workspace);
  const float clutter = MatchedFilter(size, model.sigma_px, workspace);
  ShortestPath(size, model.sigma_px, clutter, options, workspace);
  const float noise = NoiseBesidePath(size, model.sigma_px, workspace);
  line.centre_px.assign(static_cast<std::size_t>(size.height), 0.0F);
  line.sigma_px.assign(static_cast<std::size_t>(size.height), 0.0F);
  const float weight_norm =
      std::sqrt(model.weight_b * model.weight_b + model.weight_g * model.weight_g +
                model.weight_r * model.weight_r);
  // White noise of one pixel behind a Gaussian of this width; half a grey level is quantisation.
  const double pixel_noise =
      std::max(noise * std::sqrt(2 * std::sqrt(M_PI) * model.sigma_px), 0.5 * weight_norm);
  const float floor = std::max(static_cast<float>(options.detection) * noise, weight_norm);
  line.contrast = PathContrast(size, std::max(noise, weight_norm), workspace);
  const GaussianSteps::Width gauss(model.sigma_px);
  for (int y = 0; y < size.height; ++y) {
    const auto row = static_cast<std::size_t>(y);
    const int x = workspace.path[row];
    if (Supported(size, y, model.sigma_px, workspace) < floor) {
      continue;
    }
    const RowFit fit = FitRow(BrightnessOf(frame.row(y), size.width, model, workspace.row_b), x,
                              gauss, pixel_noise);
    if (fit.sigma > 0) {
      line.centre_px[row] = static_cast<float>(fit.centre);
      line.sigma_px[row] = static_cast<float>(fit.sigma);
    }
  }
}

void FindLaserLine(const BgrView& frame, const StripeModel& model, const LaserLineOptions& options,
                   LaserLineWorkspace& workspace, LaserLine& line) {
  FindRows(frame, model, options, workspace, line);
  if (options.row_smoothing > 0) {
    SmoothAlongLine(options, model.sigma_px, workspace, line);
  }
  ScaleToScatter(model.sigma_px, options, workspace, line);
}

}  // namespace trammel::vision
