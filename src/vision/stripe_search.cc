#include "vision/stripe_search.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <span>

namespace trammel::vision {
namespace {

/// Computes out = b·B + g·G + r·R of the frame's pixels, in bands.
void MixColours(const BgrView& frame, float b, float g, float r, std::vector<float>& out) {
  const ImageSize size{frame.width, frame.height};
  out.resize(size.stored());
  std::array<const std::uint8_t*, kBandRows> in{};
  for (int band = 0; band < size.bands(); ++band) {
    for (int k = 0; k < kBandRows; ++k) {
      in[static_cast<std::size_t>(k)] = frame.row(std::min(kBandRows * band + k, size.height - 1));
    }
    float* to = out.data() + size.column(band, 0);
    if (b == 0 && g == 0) {
      for (int x = 0; x < size.width; ++x) {
        for (const std::uint8_t* row : in) *to++ = r * row[3 * x + 2];
      }
    } else {
      for (int x = 0; x < size.width; ++x) {
        for (const std::uint8_t* row : in) {
          *to++ = b * row[3 * x] + g * row[3 * x + 1] + r * row[3 * x + 2];
        }
      }
    }
  }
}

/// Returns the robust sigma of the response where `counts(x, y)`. Every n-th pixel suffices:
/// neighbours within a stripe sigma are redundant, and some ten thousand are plenty.
template <typename Counts>
float ResponseNoise(const ImageSize& size, float sigma, const Counts& counts,
                    LaserLineWorkspace& ws) {
  const int step =
      std::max(static_cast<int>(std::max(1.0F, sigma)), static_cast<int>(size.area() / 20011));
  ws.sample.resize(size.area() / static_cast<std::size_t>(step) + 1);
  float* sample = ws.sample.data();
  int phase = 0;  // carried from row to row, so that a coarse step does not sample fixed columns
  for (int y = 0; y < size.height; ++y) {
    const float* row = ws.response.data() + size.at(0, y);
    int x = phase;
    for (; x < size.width; x += step) {
      *sample = row[x * kBandRows];
      sample += counts(x, y) ? 1 : 0;
    }
    phase = x - size.width;
  }
  ws.sample.resize(static_cast<std::size_t>(sample - ws.sample.data()));
  return kMadToSigma * MedianMagnitude(ws.sample);
}

/// Computes one half of a Gaussian of unit sum, its middle first.
void FillKernel(float sigma, std::vector<float>& kernel) {
  const int reach = std::max(1, static_cast<int>(std::ceil(3 * sigma)));
  kernel.resize(static_cast<std::size_t>(reach) + 1);
  float total = 0;
  for (int i = 0; i <= reach; ++i) {
    const float t = static_cast<float>(i) / sigma;
    kernel[static_cast<std::size_t>(i)] = std::exp(-0.5F * t * t);
    total += (i == 0 ? 1 : 2) * kernel[static_cast<std::size_t>(i)];
  }
  for (float& weight : kernel) weight /= total;
}

/// Fills ws.padded with a band of the signal with extended ends, and ws.sums with the cumulative
/// sums of the columns before each, and of all.
void PrepareBand(const ImageSize& size, int band, int reach, LaserLineWorkspace& ws) {
  const auto place = [](int x) { return static_cast<std::size_t>(x) * kBandRows; };
  ws.padded.resize(place(size.width + 2 * reach));
  ws.sums.resize(place(size.width + 1));
  const float* signal = ws.signal.data() + size.column(band, 0);
  float* padded = ws.padded.data();
  for (int i = 0; i < reach; ++i) padded = std::copy_n(signal, kBandRows, padded);
  padded = std::copy_n(signal, place(size.width), padded);
  const float* last = signal + place(size.width - 1);
  for (int i = 0; i < reach; ++i) padded = std::copy_n(last, kBandRows, padded);
  float* sums = ws.sums.data();
  BandColumn sum;
  sum.Put(sums);
  for (int x = 0; x < size.width; ++x) {
    sum += BandColumn::At(signal + place(x));
    sum.Put(sums += kBandRows);
  }
}

/// Returns a column of the convolution, about `middle`.
BandColumn Convolve(const float* middle, std::span<const float> kernel) {
  BandColumn column = BandColumn::At(middle) * kernel[0];
  const float* before = middle;
  const float* behind = middle;
  for (const float weight : kernel.subspan(1)) {
    before -= kBandRows;
    behind += kBandRows;
    column += (BandColumn::At(before) + BandColumn::At(behind)) * weight;
  }
  return column;
}

/// Sets a row's cost to its pixels' shortfall from the row's best, 0 … 1.
void FillPixelCosts(const ImageSize& size, float floor, LaserLineWorkspace& ws) {
  const auto width = static_cast<std::size_t>(size.width);
  ws.cost.resize(size.stored());
  for (int band = 0; band < size.bands(); ++band) {
    const std::size_t row = static_cast<std::size_t>(band) * kBandRows;
    const BandColumn per_best =
        BandColumn(1) / Larger(BandColumn::At(&ws.best[row]), BandColumn(floor));
    const float* response = ws.response.data() + size.column(band, 0);
    float* to = ws.cost.data() + row * width;
    for (int x = 0; x < size.width; ++x, response += kBandRows, ++to) {
      const BandColumn share = BandColumn::At(response) * per_best;
      const BandColumn cost = BandColumn(1) - Smaller(Larger(share, BandColumn()), BandColumn(1));
      std::array<float, kBandRows> costs;
      cost.Put(costs.data());
      for (std::size_t k = 0; k < kBandRows; ++k) to[k * width] = costs[k];
    }
  }
}

/// Makes one step of the search: cost[x] += min over x' of before[x'] + price of x' -> x, the price
/// being slope·|x - x'| but never more than that of a jump. Felzenszwalb's two passes, linear in
/// width, on costs minus the slope, where only minima remain to be taken.
/// @param jumped  the minimum of `before` plus the price of a jump.
/// @param ramp    slope·x.
/// @returns the row's minimum.
float AddCheapestWay(std::span<const float> before, std::span<const float> ramp, float jumped,
                     std::span<float> way, std::span<float> cost) {
  constexpr float kNone = std::numeric_limits<float>::max();
  float least = kNone;
  for (std::size_t x = 0; x < before.size(); ++x) {
    least = std::min(least, before[x] - ramp[x]);
    way[x] = std::min(jumped, least + ramp[x]);
  }
  least = kNone;
  float cheapest = kNone;
  for (std::size_t x = before.size(); x-- > 0;) {
    least = std::min(least, before[x] + ramp[x]);
    cost[x] += std::min(way[x], least - ramp[x]);
    cheapest = std::min(cheapest, cost[x]);
  }
  return cheapest;
}

/// Finds the column in the row before from which the cheapest path reaches x.
/// @param cheapest  the least of `before`.
int CameFrom(std::span<const float> before, int x, float cheapest, float slope, float jump) {
  const auto cost = [&](int i) { return before[static_cast<std::size_t>(i)]; };
  const int width = static_cast<int>(before.size());
  int from = x;
  float best = cost(x);
  for (int step = 1; step < width; ++step) {
    const float price = slope * static_cast<float>(step);
    if (price >= jump || cheapest + price >= best) break;
    for (const int other : {x - step, x + step}) {
      if (other >= 0 && other < width && cost(other) + price < best) {
        from = other;
        best = cost(other) + price;
      }
    }
  }
  if (cheapest + jump < best) {
    from = static_cast<int>(std::min_element(before.begin(), before.end()) - before.begin());
  }
  return from;
}

}  // namespace

float MedianMagnitude(std::span<float> sample) {
  if (sample.empty()) return 0;
  // Magnitudes have the order of their bits: a count by exponent and three bits of the mantissa
  // leaves few to be sorted.
  constexpr unsigned kShift = 20;
  std::array<std::uint32_t, (std::size_t{1} << (31 - kShift))> counts{};
  const auto bin = [](float v) { return std::bit_cast<std::uint32_t>(v) >> kShift; };
  for (float& v : sample) {
    v = std::abs(v);
    ++counts[bin(v)];
  }
  std::size_t below = sample.size() / 2;  // rank among those not yet removed
  std::uint32_t middle = 0;
  while (below >= counts[middle]) below -= counts[middle++];
  std::size_t kept = 0;
  for (const float v : sample) {
    if (bin(v) == middle) sample[kept++] = v;
  }
  const auto median = sample.begin() + static_cast<std::ptrdiff_t>(below);
  std::nth_element(sample.begin(), median, sample.begin() + static_cast<std::ptrdiff_t>(kept));
  return *median;
}

std::vector<float>& BrightnessOf(const StripeModel& model, LaserLineWorkspace& workspace) {
  const bool subtracts = model.weight_b < 0 || model.weight_g < 0 || model.weight_r < 0;
  return subtracts ? workspace.core : workspace.signal;
}

void ExtractSignal(const BgrView& frame, const StripeModel& model, LaserLineWorkspace& workspace) {
  MixColours(frame, model.weight_b, model.weight_g, model.weight_r, workspace.signal);
  if (&BrightnessOf(model, workspace) == &workspace.core) {
    MixColours(frame, std::max(0.0F, model.weight_b), std::max(0.0F, model.weight_g),
               std::max(0.0F, model.weight_r), workspace.core);
  }
}

float MatchedFilter(const ImageSize& size, float sigma, LaserLineWorkspace& ws) {
  FillKernel(sigma, ws.kernel);
  const int reach = static_cast<int>(ws.kernel.size()) - 1;
  const int box = std::max(2, static_cast<int>(std::ceil(kBackgroundReach * sigma)));
  ws.response.resize(size.stored());
  ws.best.resize(static_cast<std::size_t>(size.bands()) * kBandRows);
  for (int band = 0; band < size.bands(); ++band) {
    PrepareBand(size, band, reach, ws);
    const auto sum = [&](int x) {
      return BandColumn::At(ws.sums.data() + static_cast<std::size_t>(x) * kBandRows);
    };
    const float* middle = ws.padded.data() + (ws.kernel.size() - 1) * kBandRows;
    float* response = ws.response.data() + size.column(band, 0);
    BandColumn best(std::numeric_limits<float>::lowest());
    for (int x = 0; x < size.width; ++x, middle += kBandRows, response += kBandRows) {
      const int begin = std::max(0, x - box);
      const int end = std::min(size.width, x + box + 1);
      BandColumn column = Convolve(middle, ws.kernel);
      column -= (sum(end) - sum(begin)) * (1 / static_cast<float>(end - begin));
      column.Put(response);
      best = Larger(best, column);
    }
    best.Put(&ws.best[static_cast<std::size_t>(band) * kBandRows]);
  }
  return ResponseNoise(
      size, sigma, [](int, int) { return true; }, ws);
}

float NoiseBesidePath(const ImageSize& size, float sigma, LaserLineWorkspace& ws) {
  const int reach = static_cast<int>(std::ceil((kBackgroundReach + 2) * sigma));
  const auto beside = [&](int x, int y) {
    return std::abs(x - ws.path[static_cast<std::size_t>(y)]) > reach;
  };
  return ResponseNoise(size, sigma, beside, ws);
}

void ShortestPath(const ImageSize& size, float sigma, float noise, const LaserLineOptions& options,
                  LaserLineWorkspace& ws) {
  const float slope = static_cast<float>(options.slope_cost);
  const float jump = static_cast<float>(options.jump_cost) * sigma;
  const auto width = static_cast<std::size_t>(size.width);
  const auto height = static_cast<std::size_t>(size.height);
  FillPixelCosts(size, std::max(static_cast<float>(options.detection) * noise, 1e-6F), ws);
  const auto cost = [&](std::size_t y) { return std::span(ws.cost).subspan(y * width, width); };
  ws.ramp.resize(width);
  ws.way.resize(width);
  for (std::size_t x = 0; x < width; ++x) ws.ramp[x] = slope * static_cast<float>(x);
  ws.cheapest.resize(height);
  ws.cheapest[0] = *std::min_element(cost(0).begin(), cost(0).end());
  for (std::size_t y = 1; y < height; ++y) {
    const float jumped = ws.cheapest[y - 1] + jump;
    ws.cheapest[y] = AddCheapestWay(cost(y - 1), ws.ramp, jumped, ws.way, cost(y));
  }
  ws.path.resize(height);
  const auto last = cost(height - 1);
  int x = static_cast<int>(std::min_element(last.begin(), last.end()) - last.begin());
  for (std::size_t y = height; y-- > 0;) {
    ws.path[y] = x;
    if (y > 0) x = CameFrom(cost(y - 1), x, ws.cheapest[y - 1], slope, jump);
  }
}

bool Connected(const std::vector<int>& path, int a, int b, float sigma) {
  for (int y = a; y < b; ++y) {
    const int step = path[static_cast<std::size_t>(y) + 1] - path[static_cast<std::size_t>(y)];
    if (static_cast<float>(std::abs(step)) > std::max(1.0F, sigma)) {
      return false;
    }
  }
  return true;
}

namespace {

/// Prior shape of the light's own noise: speckle contrast after the exposure's averaging. Only its
/// ratio to the sensor's noise matters; the scatter from row to row sets the scale.
constexpr float kSpeckleContrast = 0.3F;

/// Steps of at least 0.3 sigma cross the reach in 14; the rest is for Newton's method.
constexpr int kMaxIterations = 24;

/// Newton step, in sigmas, after which no further one is needed: it would be the square.
constexpr float kLastStep = 0.01F;

/// Maximum distance of a centre from its window's middle, px.
constexpr float kFarthest_px = 0.75F;

/// One value a row, individually accessible.
using RowValues = std::array<float, kBandRows>;

BandColumn Column(const RowValues& values) { return BandColumn::At(values.data()); }

BandColumn Square(const BandColumn& column) { return column * column; }

BandColumn Exp(const BandColumn& column) {
  RowValues values;
  column.Put(values.data());
  Eigen::Map<Eigen::Array<float, kBandRows, 1>> mapped(values.data());
  mapped = mapped.exp();
  return Column(values);
}

/// Rows side by side. With w(i) = (s(m + i) - background)·exp(-(i - d)² / 2 sigma²), where the
/// centre is c = m + d, the likelihood has its maximum where the sum of w·(i - d) is 0.
class RowGroup {
 public:
  RowGroup(const ImageSize& size, const std::vector<float>& brightness, float sigma,
           std::vector<float>& window)
      : size_(size),
        brightness_(brightness),
        sigma_(sigma),
        per_square_(1 / (sigma * sigma)),
        reach_(static_cast<int>(kBackgroundReach * sigma)),
        window_(window) {
    window_.assign(static_cast<std::size_t>(2 * reach_ + 1) * kBandRows, 0.0F);
  }

  /// Starts with up to kBandRows rows.
  void Begin(std::span<const int> rows, const std::vector<int>& path) {
    rows_ = rows;
    state_.fill(State::kNone);
    for (std::size_t k = 0; k < rows.size(); ++k) {
      const int row = rows[k];
      centre_[k] = start_[k] = static_cast<float>(path[static_cast<std::size_t>(row)]);
      state_[k] = State::kMoving;
      TakeWindow(k);
    }
  }

  /// Iterates Newton's method until each row has its maximum or left the reach of its start.
  void Maximise() {
    for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
      MeasureSlopes();
      bool moving = false;
      for (std::size_t k = 0; k < kBandRows; ++k) {
        if (state_[k] == State::kMoving) Step(k);
        moving = moving || state_[k] == State::kMoving;
      }
      if (!moving) return;
    }
  }

  /// Writes the rows that have a maximum to `line`.
  void Give(float pixel_noise, LaserLine& line) {
    RowValues variance;
    Variance(pixel_noise).Put(variance.data());
    for (std::size_t k = 0; k < rows_.size(); ++k) {
      if (state_[k] != State::kThere || curvature_[k] <= 0) continue;
      const auto row = static_cast<std::size_t>(rows_[k]);
      line.centre_px[row] = centre_[k];
      line.sigma_px[row] = sigma_ * std::sqrt(variance[k]) / curvature_[k];
    }
  }

 private:
  enum class State { kNone, kMoving, kThere };

  /// Fills row k's window about its centre with the signal above its minimum; 0 beyond the picture.
  void TakeWindow(std::size_t k) {
    const int row = rows_[k];
    const int middle = static_cast<int>(std::lround(centre_[k]));
    middle_[k] = static_cast<float>(middle);
    const int begin = std::max(0, middle - reach_);
    const int end = std::min(size_.width, middle + reach_ + 1);
    const float* signal = brightness_.data() + size_.at(0, row);
    float background = signal[begin * kBandRows];
    for (int x = begin; x < end; ++x) background = std::min(background, signal[x * kBandRows]);
    float* window = window_.data() + k;
    for (int i = -reach_; i <= reach_; ++i, window += kBandRows) {
      const int x = middle + i;
      const bool inside = x >= begin && x < end;
      *window = inside ? signal[x * kBandRows] - background : 0.0F;
    }
  }

  /// Values of exp(-(i - d)² / 2 sigma²) for i = -reach, -reach + 1, …, each computed from the one
  /// before.
  class Gaussians {
   public:
    Gaussians(const BandColumn& offset, int reach, float per_square)
        : value_(Exp(Square(offset + static_cast<float>(reach)) * (-0.5F * per_square))),
          ratio_(Exp((offset + (static_cast<float>(reach) - 0.5F)) * per_square)),
          ratio_step_(std::exp(-per_square)) {}

    [[nodiscard]] BandColumn Next() {
      const BandColumn value = value_;
      value_ *= ratio_;
      ratio_ *= ratio_step_;
      return value;
    }

   private:
    BandColumn value_;
    BandColumn ratio_;
    BandColumn ratio_step_;
  };

  /// Computes sums of w and of its moments about the middle, from which slope and curvature follow.
  void MeasureSlopes() {
    const BandColumn d = Column(centre_) - Column(middle_);
    Gaussians gaussian(d, reach_, per_square_);
    BandColumn sum;
    BandColumn first;
    BandColumn second;
    const float* window = window_.data();
    for (int i = -reach_; i <= reach_; ++i, window += kBandRows) {
      const BandColumn w = BandColumn::At(window) * gaussian.Next();
      const BandColumn moment = w * static_cast<float>(i);
      sum += w;
      first += moment;
      second += moment * static_cast<float>(i);
    }
    ((first - d * sum) / BandColumn(sigma_)).Put(slope_.data());
    (sum - (second - d * (first * 2 - d * sum)) * per_square_).Put(curvature_now_.data());
  }

  void Step(std::size_t k) {
    const float slope = slope_[k];
    const float curvature = curvature_now_[k];
    float step = curvature > 0 ? sigma_ * slope / curvature : std::copysign(0.3F * sigma_, slope);
    step = std::clamp(step, -0.5F * sigma_, 0.5F * sigma_);
    centre_[k] += step;
    curvature_[k] = curvature;
    State& state = state_[k];
    const float farthest = kBackgroundReach * sigma_;
    if (std::abs(centre_[k] - start_[k]) > farthest || centre_[k] < 0 ||
        centre_[k] > static_cast<float>(size_.width - 1)) {
      state = State::kNone;
      centre_[k] = middle_[k];
    } else if (std::abs(step) < kLastStep * sigma_) {
      state = State::kThere;
    } else if (std::abs(centre_[k] - middle_[k]) > kFarthest_px) {
      TakeWindow(k);
    }
  }

  /// Computes the slope's variance, times the square of sigma, from the pixels' and the light's
  /// noise.
  [[nodiscard]] BandColumn Variance(float pixel_noise) {
    const BandColumn middle = Column(middle_);
    const BandColumn d = Column(centre_) - middle;
    Gaussians gaussian(d, reach_, per_square_);
    const float noise = pixel_noise * pixel_noise;
    const float speckle = kSpeckleContrast * kSpeckleContrast;
    const auto last = static_cast<float>(size_.width - 1);
    const BandColumn none;
    const BandColumn one(1);
    BandColumn variance;
    const float* window = window_.data();
    for (int i = -reach_; i <= reach_; ++i, window += kBandRows) {
      const BandColumn influence = (BandColumn(static_cast<float>(i)) - d) * gaussian.Next();
      const BandColumn x = middle + static_cast<float>(i);
      const BandColumn beyond =  // the picture: 1, else 0
          Smaller(Larger(Larger(none - x, x - last), none), one);
      const BandColumn light = Square(BandColumn::At(window)) * speckle;
      variance += Square(influence) * ((one - beyond) * noise + light);
    }
    return variance * per_square_;
  }

  const ImageSize size_;
  const std::vector<float>& brightness_;
  const float sigma_;
  const float per_square_;
  const int reach_;
  std::vector<float>& window_;
  std::span<const int> rows_;
  std::array<State, kBandRows> state_{};
  RowValues start_{};
  RowValues centre_{};
  RowValues middle_{};
  RowValues slope_{};
  RowValues curvature_now_{};
  RowValues curvature_{};  // for each row's last step
};

}  // namespace

void FitRows(const ImageSize& size, const std::vector<float>& brightness, std::span<const int> rows,
             float sigma, float pixel_noise, LaserLineWorkspace& workspace, LaserLine& line) {
  RowGroup group(size, brightness, sigma, workspace.window);
  while (!rows.empty()) {
    const auto some = rows.first(std::min<std::size_t>(rows.size(), kBandRows));
    group.Begin(some, workspace.path);
    group.Maximise();
    group.Give(pixel_noise, line);
    rows = rows.subspan(some.size());
  }
}

}  // namespace trammel::vision
