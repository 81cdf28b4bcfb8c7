#include "support/paper_sheet.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace trammel::support {
namespace {

/// Fraction of a pixel on the inner side of an edge at `distance_px` from its centre (positive: the
/// centre is inside).
class Edge {
 public:
  /// @param across_x, across_y  the edge's normal, of length 1.
  Edge(double blur_px, double across_x, double across_y)
      : blur_px_(blur_px),
        wide_(std::max(std::abs(across_x), std::abs(across_y))),
        narrow_(std::max(1e-4, std::min(std::abs(across_x), std::abs(across_y)))) {}

  [[nodiscard]] double Cover(double distance_px) const {
    if (blur_px_ > 0) return std::erfc(-distance_px / (blur_px_ * std::numbers::sqrt2)) / 2;
    // A square's cut is the sum of two uniform variables: three pieces of parabolas.
    const auto ramp = [](double x) { return x > 0 ? x * x / 2 : 0; };
    const double outer = (wide_ + narrow_) / 2;
    const double inner = (wide_ - narrow_) / 2;
    const double area = ramp(distance_px + outer) - ramp(distance_px + inner) -
                        ramp(distance_px - inner) + ramp(distance_px - outer);
    return std::clamp(area / (wide_ * narrow_), 0.0, 1.0);
  }

 private:
  double blur_px_;
  double wide_;
  double narrow_;
};

/// An edge's displacement along a stroke, from one support to the next in straight pieces.
class RoughEdge {
 public:
  RoughEdge(double sigma, double step, double length, Random& random) : step_(step) {
    if (sigma <= 0) return;
    for (int i = 0; i < static_cast<int>(length / step) + 3; ++i) {
      values_.push_back(random.Normal(0, sigma));
    }
  }
  [[nodiscard]] double at(double along) const {
    if (values_.empty()) return 0;
    const double place =
        std::clamp(along / step_, 0.0, static_cast<double>(values_.size()) - 1.001);
    const auto i = static_cast<std::size_t>(place);
    return values_[i] + (place - static_cast<double>(i)) * (values_[i + 1] - values_[i]);
  }

 private:
  double step_;
  std::vector<double> values_;
};

class Canvas {
 public:
  explicit Canvas(const PaperOptions& options)
      : options_(options),
        width_(static_cast<int>(std::lround(options.width_mm * options.dpi_x / 25.4))),
        height_(static_cast<int>(std::lround(options.height_mm * options.dpi_y / 25.4))),
        levels_(static_cast<std::size_t>(width_ * height_ * options.channels)) {
    for (std::size_t i = 0; i < levels_.size(); ++i) {
      levels_[i] = static_cast<float>(Level(options.paper, static_cast<int>(i) % options.channels));
    }
  }

  void Draw(const PaperStroke& stroke, Random& random) {
    const double kx = options_.dpi_x / 25.4;
    const double ky = options_.dpi_y / 25.4;
    const double x0 = stroke.x0_mm * kx - 0.5;
    const double y0 = stroke.y0_mm * ky - 0.5;
    const double dx = (stroke.x1_mm - stroke.x0_mm) * kx;
    const double dy = (stroke.y1_mm - stroke.y0_mm) * ky;
    const double length = std::hypot(dx, dy);
    const double ux = dx / length;
    const double uy = dy / length;
    const double scale = std::hypot(uy * kx, ux * ky);  // px per mm across
    const double half = stroke.width_mm / 2 * scale;
    const double step = options_.rough_step_mm * scale;
    const RoughEdge left(options_.rough_mm * scale, step, length, random);
    const RoughEdge right(options_.rough_mm * scale, step, length, random);
    const Edge side(options_.blur_px, -uy, ux);
    const Edge end(options_.blur_px, ux, uy);
    const double margin = half + 5 * options_.rough_mm * scale + 6 * options_.blur_px + 2;
    const auto range = [&](double a, double d, int size) {
      return std::pair(std::clamp(static_cast<int>(std::min(a, a + d) - margin), 0, size),
                       std::clamp(static_cast<int>(std::max(a, a + d) + margin) + 1, 0, size));
    };
    const auto [top, bottom] = range(y0, dy, height_);
    const auto [first, last] = range(x0, dx, width_);
    for (int y = top; y < bottom; ++y) {
      for (int x = first; x < last; ++x) {
        const double s = (x - x0) * ux + (y - y0) * uy;
        const double t = -(x - x0) * uy + (y - y0) * ux;
        if (std::abs(t) > margin || s < -margin || s > length + margin) continue;
        const double cover =
            (side.Cover(half + right.at(s) - t) - side.Cover(-half - left.at(s) - t)) *
            (end.Cover(s) - end.Cover(s - length));
        if (cover > 0) Blend(x, y, cover, stroke.ink);
      }
    }
  }

  [[nodiscard]] PaperPage Finish(Random& random) const {
    PaperPage page{width_, height_, options_.channels, {}};
    page.pixels.resize(levels_.size());
    for (std::size_t i = 0; i < levels_.size(); ++i) {
      const auto column = static_cast<double>(i / static_cast<std::size_t>(options_.channels) %
                                              static_cast<std::size_t>(width_));
      double level = static_cast<double>(levels_[i]) * (1 + options_.gradient * column / width_);
      if (options_.noise > 0) level += random.Normal(0, options_.noise);
      page.pixels[i] = static_cast<std::uint8_t>(std::clamp(level + 0.5, 0.0, 255.0));
    }
    return page;
  }

 private:
  [[nodiscard]] double Level(const std::array<double, 3>& colour, int channel) const {
    return options_.channels == 1 ? (colour[0] + colour[1] + colour[2]) / 3
                                  : colour[static_cast<std::size_t>(channel)];
  }
  void Blend(int x, int y, double cover, const std::array<double, 3>& ink) {
    for (int c = 0; c < options_.channels; ++c) {
      float& level = levels_[static_cast<std::size_t>((y * width_ + x) * options_.channels + c)];
      level += static_cast<float>(cover) * (static_cast<float>(Level(ink, c)) - level);
    }
  }

  const PaperOptions& options_;
  int width_;
  int height_;
  std::vector<float> levels_;
};

}  // namespace

PaperPage DrawPaper(const PaperOptions& options, const std::vector<PaperStroke>& strokes,
                    Random& random) {
  Canvas canvas(options);
  for (const PaperStroke& stroke : strokes) canvas.Draw(stroke, random);
  return canvas.Finish(random);
}

}  // namespace trammel::support
