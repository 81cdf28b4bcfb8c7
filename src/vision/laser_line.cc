#include "vision/laser_line.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "base/check.h"
#include "vision/stripe_search.h"

namespace trammel::vision {
namespace {

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

/// Fills ws.on_path. @returns its mean.
float TakeResponseOnPath(const ImageSize& size, LaserLineWorkspace& ws) {
  ws.on_path.resize(ws.path.size());
  double sum = 0;
  for (std::size_t y = 0; y < ws.path.size(); ++y) {
    ws.on_path[y] = ws.response[size.at(ws.path[y], static_cast<int>(y))];
    sum += ws.on_path[y];
  }
  return static_cast<float>(sum / size.height);
}

/// What row y offers as a stripe: the mean response on the path over its neighbours within half a
/// stripe sigma, but never more than twice its own.
float Supported(int y, float sigma, const LaserLineWorkspace& ws) {
  const int height = static_cast<int>(ws.path.size());
  const int reach = static_cast<int>(std::lround(0.5F * sigma));
  float sum = 0;
  int rows = 0;
  for (int k = std::max(0, y - reach); k <= std::min(height - 1, y + reach); ++k) {
    if (Connected(ws.path, std::min(k, y), std::max(k, y), sigma)) {
      sum += ws.on_path[static_cast<std::size_t>(k)];
      ++rows;
    }
  }
  return std::min(sum / static_cast<float>(rows), 2 * ws.on_path[static_cast<std::size_t>(y)]);
}

}  // namespace

void FindRows(const ImageSize& size, const StripeModel& model, const LaserLineOptions& options,
              LaserLineWorkspace& workspace, LaserLine& line) {
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
  line.contrast = TakeResponseOnPath(size, workspace) / std::max(noise, weight_norm);
  workspace.rows.clear();
  for (int y = 0; y < size.height; ++y) {
    if (Supported(y, model.sigma_px, workspace) >= floor) workspace.rows.push_back(y);
  }
  FitRows(size, BrightnessOf(model, workspace), workspace.rows, model.sigma_px,
          static_cast<float>(pixel_noise), workspace, line);
}

void FindLaserLine(const BgrView& frame, const StripeModel& model, const LaserLineOptions& options,
                   LaserLineWorkspace& workspace, LaserLine& line) {
  TRAMMEL_CHECK(frame.width >= 3 && frame.height >= 1 && model.sigma_px > 0,
                "frame {}x{}, stripe sigma {}", frame.width, frame.height, model.sigma_px);
  ExtractSignal(frame, model, workspace);
  FindRows({frame.width, frame.height}, model, options, workspace, line);
  if (options.row_smoothing > 0) {
    SmoothAlongLine(options, model.sigma_px, workspace, line);
  }
  ScaleToScatter(model.sigma_px, options, workspace, line);
}

}  // namespace trammel::vision
