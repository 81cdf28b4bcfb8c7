// Where a Gaussian stripe stands in each of many rows: eight of them at a time, each about a whole
// pixel of its own.
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "vision/stripe_search.h"

namespace trammel::vision {
namespace {

/// Prior shape of the light's own noise: speckle contrast left after the exposure's averaging.
/// Only its ratio to the sensor's noise matters, the scatter from row to row sets the scale.
constexpr float kSpeckleContrast = 0.3F;

/// Steps of at least 0.3 sigma cross the reach in 14; the rest is Newton's.
constexpr int kMaxIterations = 24;

/// A step of Newton's, in sigmas, after which no further one is worth it: it would be the square.
constexpr float kLastStep = 0.01F;

/// How far a centre may lie from its window's middle, px.
constexpr float kFarthest_px = 0.75F;

/// One value a row, of which each may be taken and put by itself.
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

  /// Begins with up to kBandRows rows.
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

  /// Newton's method, until each row has its maximum or left the reach of its start.
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

  /// Puts the rows that have a maximum into `line`.
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

  /// Fills row k's window about its centre with the signal above the least of it; 0 beyond the
  /// picture.
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

  /// exp(-(i - d)² / 2 sigma²) for i = -reach, -reach + 1, …, each from the one before.
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

  /// Sums of w and of its moments about the middle, from which slope and curvature follow.
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

  /// Of the slope, times the square of sigma, from the pixels' noise and the light's own.
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
  RowValues curvature_{};  // at each row's last step
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
