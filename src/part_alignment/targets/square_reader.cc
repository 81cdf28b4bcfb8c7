#include "part_alignment/targets/square_reader.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>
#include <vector>

#include "part_alignment/targets/grey_between.h"
#include "part_alignment/targets/square_code.h"

namespace trammel::part_alignment {
namespace {

constexpr double kMiddle = 0.5 * kSquareModules;
constexpr double kOutside = 0.6;     ///< modules from the edge at which the white is looked at
constexpr double kMostOff = 0.25;    ///< of the contrast, of a shade from where the light puts it
constexpr double kUncertain = 0.15;  ///< of the contrast, about half way between the shades

/// A sample of the picture at module coordinates.
struct Sample {
  double u = 0;
  double v = 0;
  double grey = 0;
};

/// Grey level over the marker's plane.
struct Light {
  double level = 0;
  double by_u = 0;
  double by_v = 0;
  [[nodiscard]] double At(double u, double v) const {
    return level + by_u * (u - kMiddle) + by_v * (v - kMiddle);
  }
};

/// Least squares for samples that lie evenly about the middle, as those of a frame do.
Light FitLight(const std::vector<Sample>& samples) {
  Light light;
  double uu = 0, vv = 0;
  for (const Sample& s : samples) {
    light.level += s.grey / static_cast<double>(samples.size());
    light.by_u += s.grey * (s.u - kMiddle);
    light.by_v += s.grey * (s.v - kMiddle);
    uu += (s.u - kMiddle) * (s.u - kMiddle);
    vv += (s.v - kMiddle) * (s.v - kMiddle);
  }
  light.by_u /= uu;
  light.by_v /= vv;
  return light;
}

int CountOff(const std::vector<Sample>& samples, const Light& light, double most_off) {
  return static_cast<int>(std::count_if(samples.begin(), samples.end(), [&](const Sample& s) {
    return !(std::abs(s.grey - light.At(s.u, s.v)) <= most_off);
  }));
}

class Reader {
 public:
  Reader(const PageView& picture, const std::array<ImagePoint, 4>& corners)
      : picture_(picture), plane_(corners) {}

  SquareModules Read(double min_contrast) {
    SquareModules modules;
    constexpr double kLast = kSquareModules - 0.5;
    const auto white = Frame(-kOutside, kSquareModules + kOutside);
    if (!white) {
      modules.state = SquareState::kCutOff;
      return modules;
    }
    const auto black = Frame(0.5, kLast);
    if (!black) return modules;
    const Light bright = FitLight(*white);
    const Light dark = FitLight(*black);
    modules.bright = bright.level;
    modules.dark = dark.level;
    const double contrast = bright.level - dark.level;
    if (!(contrast >= min_contrast)) return modules;
    const int off =
        CountOff(*white, bright, kMostOff * contrast) + CountOff(*black, dark, kMostOff * contrast);
    if (off > 0) {
      // A frame of which most is as it should be is one that something covers.
      constexpr int kMostHidden = 16;
      modules.state = off <= kMostHidden ? SquareState::kUnclear : SquareState::kNone;
      return modules;
    }
    SlopeOf(bright, modules);
    ReadCells(bright, dark, modules);
    return modules;
  }

 private:
  [[nodiscard]] std::optional<double> GreyAt(double u, double v) const {
    const ImagePoint p = plane_.At(u, v);
    if (!(p.x >= 0 && p.y >= 0 && p.x <= picture_.width - 1 && p.y <= picture_.height - 1)) {
      return std::nullopt;
    }
    return Between(picture_, p.x, p.y);
  }

  /// Seven samples on each side of a square from (low, low) to (high, high); absent beyond the
  /// picture.
  [[nodiscard]] std::optional<std::vector<Sample>> Frame(double low, double high) const {
    std::vector<Sample> samples;
    for (int k = 0; k < kSquareModules; ++k) {
      const double t = low + (high - low) * k / (kSquareModules - 1);
      for (const auto& [u, v] : {std::pair{t, low}, {t, high}, {low, t}, {high, t}}) {
        const auto grey = GreyAt(u, v);
        if (!grey) return std::nullopt;
        samples.push_back({u, v, *grey});
      }
    }
    return samples;
  }

  /// The slope of the light in the picture from that along the modules.
  void SlopeOf(const Light& light, SquareModules& modules) const {
    const ImagePoint u0 = plane_.At(kMiddle - 1, kMiddle);
    const ImagePoint u1 = plane_.At(kMiddle + 1, kMiddle);
    const ImagePoint v0 = plane_.At(kMiddle, kMiddle - 1);
    const ImagePoint v1 = plane_.At(kMiddle, kMiddle + 1);
    const double ux = 0.5 * (u1.x - u0.x), uy = 0.5 * (u1.y - u0.y);
    const double vx = 0.5 * (v1.x - v0.x), vy = 0.5 * (v1.y - v0.y);
    const double det = (ux * vy - uy * vx) * light.level;
    modules.light_x = (light.by_u * vy - light.by_v * uy) / det;
    modules.light_y = (light.by_v * ux - light.by_u * vx) / det;
  }

  void ReadCells(const Light& bright, const Light& dark, SquareModules& modules) const {
    for (int row = 0; row < kSquareCells; ++row) {
      for (int column = 0; column < kSquareCells; ++column) {
        double sum = 0;
        double least = 1e9;
        double most = -1e9;
        for (const double dv : {-0.2, 0.0, 0.2}) {
          for (const double du : {-0.2, 0.0, 0.2}) {
            const double u = 1.5 + column + du;
            const double v = 1.5 + row + dv;
            const auto grey = GreyAt(u, v);
            if (!grey) return;  // within a frame that is within the picture
            const double black = dark.At(u, v);
            const double share = (*grey - black) / (bright.At(u, v) - black);
            sum += share / 9;
            least = std::min(least, share);
            most = std::max(most, share);
          }
        }
        constexpr double kMostSpread = 0.7;  // of nine samples; blur and noise make half of it
        if (std::abs(sum - 0.5) < kUncertain || most - least > kMostSpread) {
          modules.state = SquareState::kUnclear;
          return;
        }
        if (sum > 0.5) modules.word |= 1U << (kSquareCells * row + column);
      }
    }
    // Every row of a marker has a white module, and one that is black.
    const int whites = std::popcount(modules.word);
    constexpr int kAll = kSquareCells * kSquareCells;
    if (whites < kSquareCells - 1 || whites > kAll - kSquareCells + 1) return;
    modules.state = SquareState::kClear;
  }

  const PageView& picture_;
  SquarePlane plane_;
};

}  // namespace

SquarePlane::SquarePlane(const std::array<ImagePoint, 4>& c) {
  // From the unit square to a quadrangle (Heckbert, Fundamentals of Texture Mapping, 1989), then
  // from 7 modules to the unit square.
  const double dx1 = c[1].x - c[2].x, dx2 = c[3].x - c[2].x;
  const double dy1 = c[1].y - c[2].y, dy2 = c[3].y - c[2].y;
  const double sx = c[0].x - c[1].x + c[2].x - c[3].x;
  const double sy = c[0].y - c[1].y + c[2].y - c[3].y;
  const double det = dx1 * dy2 - dx2 * dy1;
  const double g = (sx * dy2 - dx2 * sy) / det;
  const double h = (dx1 * sy - sx * dy1) / det;
  constexpr double kUnit = 1.0 / kSquareModules;
  a_ = (c[1].x - c[0].x + g * c[1].x) * kUnit;
  b_ = (c[3].x - c[0].x + h * c[3].x) * kUnit;
  c_ = c[0].x;
  d_ = (c[1].y - c[0].y + g * c[1].y) * kUnit;
  e_ = (c[3].y - c[0].y + h * c[3].y) * kUnit;
  f_ = c[0].y;
  g_ = g * kUnit;
  h_ = h * kUnit;
}

ImagePoint SquarePlane::At(double u, double v) const {
  const double w = g_ * u + h_ * v + 1;
  return {(a_ * u + b_ * v + c_) / w, (d_ * u + e_ * v + f_) / w};
}

SquareModules ReadSquareModules(const PageView& picture, const std::array<ImagePoint, 4>& corners,
                                double min_contrast) {
  return Reader(picture, corners).Read(min_contrast);
}

}  // namespace trammel::part_alignment
