#include "vision/laser_line.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "base/check.h"
#include "base/statistics.h"
#include "geometry/robust_line.h"
#include "vision/stripe_search.h"

namespace trammel::vision {
namespace {

/// Smooths rows by their neighbours, weighted by their certainty, never across a step.
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

/// Computes row y's response as a stripe: the mean on the path over its neighbours within half a
/// stripe sigma, but at most twice its own.
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

namespace {

/// Weights of B, G and R. A neutral light (a lamp's glint) is equal in all three: the third mixture
/// halves it, the fourth removes it; the second follows a stripe into a saturated red.
constexpr std::array<std::array<float, 3>, 4> kMixtures{
    {{0, 0, 1}, {-0.25F, -0.25F, 1}, {-0.5F, -0.5F, 1}, {0, 0.5F, 1}}};

/// Scatter of a trial without a line; wider than any picture.
constexpr double kNoLine = 1e6;

/// Number of distant frames on which most models are rejected.
constexpr std::size_t kFirstFrames = 2;

bool SameMixture(const StripeModel& one, const StripeModel& other) {
  return one.weight_b == other.weight_b && one.weight_g == other.weight_g &&
         one.weight_r == other.weight_r;
}

/// Model on trial, with its results on the frames so far.
struct Trial {
  StripeModel model;
  std::vector<double> scatter_px = {};  ///< per frame, of one row
  double scatter_sum_px = 0;
  double found = 0;  ///< sum of the shares of the rows
  double contrast = 0;
  bool lost = false;  ///< a frame in which it found no line, or given up

  /// Returns the mean scatter, increased for missed rows: a missed row is worse than an inaccurate
  /// one, and the square outweighs the gain from dropping the worst rows.
  [[nodiscard]] double score() const {
    if (lost || scatter_px.empty()) return kNoLine;
    const auto frames = static_cast<double>(scatter_px.size());
    const double share = found / frames;
    return scatter_sum_px / frames / std::max(1e-3, share * share);
  }
};

/// Lists all mixtures, the simplest first, each with all widths, the narrowest first.
std::vector<Trial> ListTrials(const LaserLineOptions& options, int width) {
  std::vector<Trial> trials;
  for (const auto& [b, g, r] : kMixtures) {
    for (int step = 0;; ++step) {  // exact powers: 8 is 8, and not beyond a bound of 8
      const double sigma = std::exp2(0.5 * step);
      if (sigma > options.max_sigma_px || sigma * kNarrowestFrame_px > width) break;
      trials.push_back({{b, g, r, static_cast<float>(sigma)}});
    }
  }
  return trials;
}

/// Tries models on frames with reused buffers.
class TrialBench {
 public:
  TrialBench(const LaserLineOptions& options, LaserLineWorkspace& workspace)
      : options_(options), ws_(workspace) {}

  /// Extracts the colours for trials of one mixture.
  void Show(const BgrView& frame, const StripeModel& model) { ExtractSignal(frame, model, ws_); }

  /// Tries a model of that mixture on the current frame.
  void Try(const ImageSize& size, Trial& trial) {
    FindRows(size, trial.model, options_, ws_, line_);
    rows_.clear();
    centres_.clear();
    for (std::size_t y = 0; y < line_.centre_px.size(); ++y) {
      // A mixture whose path runs beside the brightest position has lost the line's core.
      if (line_.found(y) && std::abs(line_.centre_px[y] - static_cast<float>(ws_.path[y])) <=
                                1.5F * trial.model.sigma_px) {
        rows_.push_back(static_cast<double>(y));
        centres_.push_back(line_.centre_px[y]);
      }
    }
    trial.contrast += line_.contrast;
    trial.lost = trial.lost || rows_.size() < 4;
    if (trial.lost) return;
    trial.scatter_px.push_back(kMadToSigma *
                               geometry::FitRobustLine(rows_, centres_, scratch_).median_residual);
    trial.scatter_sum_px += trial.scatter_px.back();
    trial.found += static_cast<double>(rows_.size()) / size.height;
  }

 private:
  const LaserLineOptions& options_;
  LaserLineWorkspace& ws_;
  LaserLine line_;
  std::vector<double> rows_;
  std::vector<double> centres_;
  std::vector<double> scratch_;
};

/// Tries all models on a few frames, and lists the candidates: of two equally good ones only the
/// first, and none much worse than the best. Each is better than the one before.
std::vector<Trial*> Preselect(std::span<const BgrView> frames, const LaserLineOptions& options,
                              std::span<Trial> trials, TrialBench& bench) {
  // The scatter over a hundred rows is known to a tenth, and two models' on the same rows differ
  // less.
  constexpr double kMuchWorse = 1.25;
  // Mixtures that lead to the same pixels differ only by their searches' starts, which is less.
  constexpr double kBetter = 0.999;
  for (const BgrView& frame : frames) {
    const StripeModel* shown = nullptr;
    for (Trial& trial : trials) {
      if (shown == nullptr || !SameMixture(*shown, trial.model)) bench.Show(frame, trial.model);
      shown = &trial.model;
      bench.Try({frame.width, frame.height}, trial);
    }
  }
  std::vector<Trial*> better;
  for (Trial& trial : trials) {
    if (better.empty() || trial.score() < kBetter * better.back()->score()) {
      better.push_back(&trial);
    }
  }
  const double most = kMuchWorse * options.as_good * better.back()->score();
  std::erase_if(better, [&](const Trial* trial) { return trial->score() > most; });
  return better;
}

/// Tries a model on the remaining frames, unless its scatter shows that neither it nor a better
/// later one can make it the choice.
void TryOn(std::span<const BgrView> frames, double max_px, Trial& trial, TrialBench& bench) {
  const auto all = static_cast<double>(trial.scatter_px.size() + frames.size());
  for (const BgrView& frame : frames) {
    bench.Show(frame, trial.model);
    bench.Try({frame.width, frame.height}, trial);
    trial.lost = trial.lost || trial.scatter_sum_px > max_px * all;
    if (trial.lost) return;
  }
}

}  // namespace

StripeModel LearnStripe(std::span<const BgrView> frames, const LaserLineOptions& options,
                        LaserLineWorkspace& workspace) {
  TRAMMEL_CHECK(!frames.empty() && frames[0].width >= kNarrowestFrame_px,
                "{} frames, the first {} px wide", frames.size(),
                frames.empty() ? 0 : frames[0].width);
  TRAMMEL_CHECK(options.max_sigma_px >= 1, "max sigma {}", options.max_sigma_px);
  std::vector<BgrView> shuffled(frames.begin(), frames.end());
  if (frames.size() > kFirstFrames) std::swap(shuffled[1], shuffled[frames.size() / 2]);
  const auto first = std::span(shuffled).first(std::min(kFirstFrames, frames.size()));
  const auto others = std::span(shuffled).subspan(first.size());
  TrialBench bench(options, workspace);
  std::vector<Trial> trials = ListTrials(options, frames[0].width);
  std::vector<Trial*> left = Preselect(first, options, trials, bench);
  double lowest = kNoLine;
  for (auto trial = left.rbegin(); trial != left.rend(); ++trial) {  // the best so far first
    TryOn(others, options.as_good * lowest, **trial, bench);
    lowest = std::min(lowest, (*trial)->score());
  }
  // Among about equally good ones, selects the simplest mixture and the narrowest line, which
  // neighbours disturb least.
  const Trial& chosen = **std::find_if(left.begin(), left.end(), [&](const Trial* trial) {
    return trial->score() <= options.as_good * lowest;
  });
  StripeModel model = chosen.model;
  model.contrast = static_cast<float>(chosen.contrast / static_cast<double>(frames.size()));
  model.scatter_px = static_cast<float>(chosen.lost ? kNoLine : Median(chosen.scatter_px));
  return model;
}

}  // namespace trammel::vision
