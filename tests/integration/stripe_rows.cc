#include "stripe_rows.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace trammel::test {
namespace {

constexpr int kRows = 60;
constexpr double kFullScale = 255;
constexpr double kAmbient = 14;     // levels
constexpr double kNoise = 3;        // levels at the peak, where the peak may be as high as it needs
constexpr double kBrightest = 150;  // levels; leaves room for speckle
constexpr double kShotShare = 0.5;  // of the variance at the peak
constexpr double kLeak = 0.06;      // of the red light, in green and blue
constexpr double kHaloLength_px = 12;
constexpr double kLobeAt = 1.6;    // sigmas
constexpr double kBeadPeak = 0.5;  // of the plate's
constexpr double kBeadHigh_px = 10;
constexpr double kBeadRow = 29.5;
constexpr double kBeadHalf = 6;  // rows

double Normal(double t) { return 0.5 * std::erfc(-t / std::numbers::sqrt2); }

/// Light up to x of an exponential tail behind a Gaussian, of unit light.
double TailUpTo(double x, double sigma, double length) {
  const double lag = sigma / length;
  return Normal(x / sigma) - std::exp(-x / length + 0.5 * lag * lag) * Normal(x / sigma - lag);
}

double Peak(const StripeLook& look) {
  if (look.over_full_scale > 0) return look.over_full_scale * kFullScale;
  return std::min(kBrightest, kNoise * look.signal_to_noise);
}

struct Noise {
  double read = 0;           // levels
  double shot_variance = 0;  // per level

  [[nodiscard]] double Variance(double light) const {
    return read * read + shot_variance * std::max(0.0, light);
  }
};

Noise NoiseOf(const StripeLook& look) {
  const double peak = std::min(Peak(look), kFullScale);
  const double variance = std::pow(peak / look.signal_to_noise, 2);
  return {std::sqrt((1 - kShotShare) * variance), kShotShare * variance / peak};
}

/// What a pixel at x gets of a stripe at `centre`: light that speckles, and the halo that does not.
struct PixelLight {
  double core = 0;
  double halo = 0;
};

PixelLight LightAt(const StripeLook& look, double peak, double centre, double x) {
  const double light = peak * look.sigma_px * std::sqrt(2 * std::numbers::pi);
  const auto gaussian = [&](double middle) {
    return Normal((x + 0.5 - middle) / look.sigma_px) - Normal((x - 0.5 - middle) / look.sigma_px);
  };
  PixelLight pixel;
  pixel.core = light * (gaussian(centre) + look.lobe * gaussian(centre + kLobeAt * look.sigma_px));
  pixel.halo = look.halo * light *
               (TailUpTo(x + 0.5 - centre, look.sigma_px, kHaloLength_px) -
                TailUpTo(x - 0.5 - centre, look.sigma_px, kHaloLength_px));
  return pixel;
}

int WidthOf(const StripeLook& look) {
  return 2 * static_cast<int>(std::ceil(6 * look.sigma_px + 14));
}

/// White noise behind a Gaussian, of unit variance, row by row.
std::vector<double> SmoothField(int width, int height, double grain_px, Random& random) {
  const int reach = static_cast<int>(std::ceil(3.5 * grain_px));
  std::vector<double> kernel;
  double square = 0;
  for (int i = -reach; i <= reach; ++i) {
    kernel.push_back(std::exp(-0.5 * i * i / (grain_px * grain_px)));
    square += kernel.back() * kernel.back();
  }
  const auto taps = static_cast<int>(kernel.size());
  const int wide = width + 2 * reach;
  const int high = height + 2 * reach;
  std::vector<double> white(static_cast<std::size_t>(wide) * static_cast<std::size_t>(high));
  for (double& value : white) value = random.Normal();
  std::vector<double> across(static_cast<std::size_t>(width) * static_cast<std::size_t>(high));
  for (int y = 0; y < high; ++y) {
    for (int x = 0; x < width; ++x) {
      double sum = 0;
      for (int k = 0; k < taps; ++k)
        sum += kernel[std::size_t(k)] * white[std::size_t(y * wide + x + k)];
      across[std::size_t(y * width + x)] = sum;
    }
  }
  std::vector<double> field(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      double sum = 0;
      for (int k = 0; k < taps; ++k)
        sum += kernel[std::size_t(k)] * across[std::size_t((y + k) * width + x)];
      field[std::size_t(y * width + x)] = sum / square;
    }
  }
  return field;
}

/// Intensity of speckle of mean 1: as many independent patterns add up as leave the contrast.
std::vector<double> Speckle(int width, int height, const StripeLook& look, Random& random) {
  std::vector<double> intensity(static_cast<std::size_t>(width) * static_cast<std::size_t>(height),
                                1.0);
  if (look.speckle <= 0) return intensity;
  const int patterns =
      std::max(1, static_cast<int>(std::lround(1 / (look.speckle * look.speckle))));
  std::fill(intensity.begin(), intensity.end(), 0.0);
  for (int i = 0; i < 2 * patterns; ++i) {
    const auto field = SmoothField(width, height, look.grain_px, random);
    for (std::size_t k = 0; k < field.size(); ++k) {
      intensity[k] += field[k] * field[k] / (2 * patterns);
    }
  }
  return intensity;
}

/// How far the stripe stands to the left for the bead in a row; 0 beside it.
double RiseAt(const StripeLook& look, int row) {
  const double off = (row - kBeadRow) / kBeadHalf;
  if (!look.bead || std::abs(off) >= 1) return 0;
  return look.steep ? kBeadHigh_px : kBeadHigh_px * std::sqrt(1 - off * off);
}

std::uint8_t Level(double mean, const Noise& noise, Random& random) {
  const double seen = mean + std::sqrt(noise.Variance(mean - kAmbient)) * random.Normal();
  return static_cast<std::uint8_t>(std::clamp(std::round(seen), 0.0, kFullScale));
}

/// Adds white glints of 1.5 px sigma, clear of the line.
void AddGlints(const StripeLook& look, const std::vector<double>& centre_px, Random& random,
               Frame& frame) {
  constexpr double kSigma_px = 1.5;
  constexpr double kPeak = 240;
  const double clear_px = 3 * look.sigma_px + 6;
  for (int glint = 0; glint < look.glints;) {
    const double x = random.Uniform(0, frame.width);
    const double y = random.Uniform(0, frame.height - 1);
    const double line = centre_px[centre_px.size() - kRows + static_cast<std::size_t>(y)];
    if (std::abs(x - line) < clear_px) continue;
    ++glint;
    for (int row = 0; row < frame.height; ++row) {
      for (int column = 0; column < frame.width; ++column) {
        const double off =
            (std::pow(column - x, 2) + std::pow(row - y, 2)) / (kSigma_px * kSigma_px);
        const double light = kPeak * std::exp(-0.5 * off);
        if (light < 1) continue;
        for (int c = 0; c < 3; ++c) {
          std::uint8_t& value = frame.row(row)[3 * column + c];
          value = static_cast<std::uint8_t>(std::min(kFullScale, value + light));
        }
      }
    }
  }
}

}  // namespace

StripeSweep DrawStripes(const StripeLook& look, int frames, Random& random) {
  const int width = WidthOf(look);
  const Noise noise = NoiseOf(look);
  const double middle = 0.5 * width + random.Uniform(-1, 1) + (look.bead ? 4 : 0);
  const double lean = random.Uniform(-0.03, 0.03);
  StripeSweep sweep;
  for (int f = 0; f < frames; ++f) {
    Frame frame(width, kRows);
    const auto speckle = Speckle(width, kRows, look, random);
    for (int y = 0; y < kRows; ++y) {
      const double rise = RiseAt(look, y);
      const double peak = Peak(look) * (rise > 0 ? kBeadPeak : 1);
      const double centre = middle + lean * (y - 0.5 * kRows) - rise;
      sweep.centre_px.push_back(centre);
      for (int x = 0; x < width; ++x) {
        const PixelLight light = LightAt(look, peak, centre, x);
        const double red = light.core * speckle[std::size_t(y * width + x)] + light.halo;
        std::uint8_t* pixel = frame.row(y) + 3 * x;
        pixel[0] = pixel[1] = Level(kAmbient + kLeak * red, noise, random);
        pixel[2] = Level(kAmbient + red, noise, random);
      }
    }
    AddGlints(look, sweep.centre_px, random, frame);
    sweep.frames.push_back(std::move(frame));
  }
  return sweep;
}

StripeBound BoundOf(const StripeLook& look) {
  const double s = look.sigma_px;
  const double l = look.grain_px;
  const double peak = Peak(look);
  const Noise noise = NoiseOf(look);
  StripeBound bound;
  bound.white_px =
      std::sqrt(noise.Variance(peak)) / peak * std::sqrt(2 * s / std::sqrt(std::numbers::pi));
  bound.speckle_px = look.speckle * s * s * std::sqrt(l) / std::pow(l * l + 2 * s * s, 0.75);

  const double centre = 0.5 * WidthOf(look) + 0.2;
  std::vector<double> at;  // pixels that are not clipped
  for (int x = 0; x < WidthOf(look); ++x) {
    const PixelLight light = LightAt(look, peak, centre, x);
    if (kAmbient + light.core + light.halo < kFullScale) at.push_back(x);
  }
  const auto n = static_cast<Eigen::Index>(at.size());
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(n, n);
  Eigen::MatrixXd gradient(n, 3);  // over centre, brightness, background
  for (Eigen::Index i = 0; i < n; ++i) {
    const double x = at[std::size_t(i)];
    const PixelLight light = LightAt(look, peak, centre, x);
    const auto sum = [&](double c) {
      const PixelLight p = LightAt(look, peak, c, x);
      return p.core + p.halo;
    };
    constexpr double kStep = 1e-3;
    gradient.row(i) << (sum(centre + kStep) - sum(centre - kStep)) / (2 * kStep),
        sum(centre) / peak, 1;
    constexpr double kRounding = 1.0 / 12;
    covariance(i, i) += noise.Variance(sum(centre)) + kRounding;
    for (Eigen::Index k = 0; k < n; ++k) {
      const double apart = x - at[std::size_t(k)];
      covariance(i, k) += look.speckle * look.speckle * light.core *
                          LightAt(look, peak, centre, at[std::size_t(k)]).core *
                          std::exp(-0.5 * apart * apart / (l * l));
    }
  }
  const Eigen::MatrixXd information = gradient.transpose() * covariance.ldlt().solve(gradient);
  bound.joint_px = std::sqrt(information.inverse()(0, 0));
  return bound;
}

}  // namespace trammel::test
