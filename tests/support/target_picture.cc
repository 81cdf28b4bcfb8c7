#include "support/target_picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace trammel::test {
namespace {

constexpr int kCells = 5;  ///< a pixel and axis: the lens blurs these before pixels sum them
constexpr int kFine = 8;   ///< points a cell and axis where an edge runs through it

bool IsInked(const DrawnTarget& target, double u, double v) {
  const double square = u * u + v * v;
  if (square <= 1) return true;
  if (target.bits == 0 || square < 4 || square > 9) return false;
  double turns = std::atan2(v, u) / (2 * std::numbers::pi);
  turns -= std::floor(turns);
  const int k = static_cast<int>(turns * target.bits) % target.bits;
  return (target.word >> k & 1U) != 0;
}

/// Cells, kCells a pixel and axis; cell (0, 0) begins where pixel (0, 0) does.
struct Cells {
  int width = 0;
  int height = 0;
  std::vector<float> values;
};

/// Adds the target's coverage within the box of its outermost circle.
void Cover(const DrawnTarget& target, Cells& cells) {
  const auto& h = target.h;
  double x0 = 1e9, x1 = -1e9, y0 = 1e9, y1 = -1e9;
  const double reach = 3.1;
  for (int i = 0; i < 64; ++i) {
    const double a = 2 * std::numbers::pi * i / 64;
    const double u = reach * std::cos(a), v = reach * std::sin(a);
    const double w = h[2][0] * u + h[2][1] * v + h[2][2];
    const double x = ((h[0][0] * u + h[0][1] * v + h[0][2]) / w + 0.5) * kCells;
    const double y = ((h[1][0] * u + h[1][1] * v + h[1][2]) / w + 0.5) * kCells;
    x0 = std::min(x0, x), x1 = std::max(x1, x), y0 = std::min(y0, y), y1 = std::max(y1, y);
  }
  double inverse[3][3];
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      const int a = (j + 1) % 3, b = (j + 2) % 3, c = (i + 1) % 3, d = (i + 2) % 3;
      inverse[i][j] = h[a][c] * h[b][d] - h[a][d] * h[b][c];
    }
  }
  const auto inked = [&](double cell_x, double cell_y) {
    const double y = cell_y / kCells - 0.5;
    const double x = cell_x / kCells - 0.5;
    double p[3];
    for (int i = 0; i < 3; ++i) p[i] = inverse[i][0] * x + inverse[i][1] * y + inverse[i][2];
    return IsInked(target, p[0] / p[2], p[1] / p[2]);
  };
  const int first_y = std::max(0, static_cast<int>(y0));
  const int last_y = std::min(cells.height - 1, static_cast<int>(y1));
  const int first_x = std::max(0, static_cast<int>(x0));
  const int last_x = std::min(cells.width - 1, static_cast<int>(x1));
  if (first_y > last_y || first_x > last_x) return;
  std::vector<int> above(static_cast<std::size_t>(last_x - first_x + 2));  // corners of a row
  std::vector<int> below(above.size());
  const auto look = [&](int y, std::vector<int>& corners) {
    for (std::size_t i = 0; i < corners.size(); ++i) {
      corners[i] = inked(first_x + static_cast<int>(i), y) ? 1 : 0;
    }
  };
  look(first_y, below);
  for (int y = first_y; y <= last_y; ++y) {
    above.swap(below);
    look(y + 1, below);
    for (int x = first_x; x <= last_x; ++x) {
      const auto i = static_cast<std::size_t>(x - first_x);
      const int corners = above[i] + above[i + 1] + below[i] + below[i + 1];
      double covered = corners / 4.0;
      if (corners > 0 && corners < 4) {
        int hits = 0;
        for (int i = 0; i < kFine; ++i) {
          for (int j = 0; j < kFine; ++j) {
            hits += inked(x + (j + 0.5) / kFine, y + (i + 0.5) / kFine) ? 1 : 0;
          }
        }
        covered = static_cast<double>(hits) / (kFine * kFine);
      }
      cells.values[static_cast<std::size_t>(y * cells.width + x)] += static_cast<float>(covered);
    }
  }
}

/// The lens: a Gaussian; then the pixel sums its cells.
std::vector<double> Kernel(double blur_px) {
  const double sigma = std::max(blur_px * kCells, 1e-3);
  const int reach = static_cast<int>(std::ceil(4.5 * sigma));
  std::vector<double> lens(static_cast<std::size_t>(2 * reach + 1));
  double total = 0;
  for (int k = -reach; k <= reach; ++k) {
    const double weight = std::exp(-0.5 * k * k / (sigma * sigma));
    lens[static_cast<std::size_t>(k + reach)] = weight;
    total += weight;
  }
  std::vector<double> kernel(lens.size() + kCells - 1);
  for (std::size_t i = 0; i < lens.size(); ++i) {
    for (std::size_t cell = 0; cell < kCells; ++cell) kernel[i + cell] += lens[i] / total / kCells;
  }
  return kernel;
}

/// One line of pixels from one of cells.
void SumLine(const float* cells, int cell_stride, int cell_count, float* pixels, int pixel_stride,
             const std::vector<double>& kernel) {
  const int count = cell_count / kCells;
  const int size = static_cast<int>(kernel.size());
  for (int i = 0; i < count; ++i) {
    const int first = i * kCells + kCells / 2 - size / 2;
    double sum = 0;
    for (int k = 0; k < size; ++k) {
      const int at = std::clamp(first + k, 0, cell_count - 1);
      sum += kernel[static_cast<std::size_t>(k)] * cells[at * cell_stride];
    }
    pixels[i * pixel_stride] = static_cast<float>(sum);
  }
}

}  // namespace

DrawnTarget AffineTarget(double column, double row, double radius, double tilt_rad,
                         double towards_rad, double turn_rad) {
  const double c = std::cos(towards_rad), s = std::sin(towards_rad), f = std::cos(tilt_rad);
  const double a[2][2] = {{c * c * f + s * s, c * s * (f - 1)},
                          {c * s * (f - 1), s * s * f + c * c}};
  const double t[2][2] = {{std::cos(turn_rad), -std::sin(turn_rad)},
                          {std::sin(turn_rad), std::cos(turn_rad)}};
  DrawnTarget target;
  for (int i = 0; i < 2; ++i) {
    for (int j = 0; j < 2; ++j) target.h[i][j] = radius * (a[i][0] * t[0][j] + a[i][1] * t[1][j]);
  }
  target.h[0][2] = column;
  target.h[1][2] = row;
  return target;
}

DrawnTarget PinholeTarget(double column, double row, const PinholeView& view) {
  using Vector = std::array<double, 3>;
  const auto cross = [](const Vector& a, const Vector& b) {
    return Vector{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
  };
  const auto unit = [](Vector a) {
    const double length = std::hypot(a[0], a[1], a[2]);
    for (double& one : a) one /= length;
    return a;
  };
  const auto mix = [](double x, const Vector& a, double y, const Vector& b) {
    return Vector{x * a[0] + y * b[0], x * a[1] + y * b[1], x * a[2] + y * b[2]};
  };
  const double off = std::tan(view.off_axis_rad);
  // Axes: the line of sight and two directions across it, then the plane's own two.
  const Vector observation =
      unit({off * std::cos(view.off_towards_rad), off * std::sin(view.off_towards_rad), 1});
  const Vector right = unit(cross({0, 1, 0}, observation));
  const Vector down = cross(observation, right);
  const double c = std::cos(view.tilt_towards_rad), s = std::sin(view.tilt_towards_rad);
  const Vector across = mix(-s, right, c, down);
  const Vector along =
      mix(std::cos(view.tilt_rad), mix(c, right, s, down), std::sin(view.tilt_rad), observation);
  const double ct = std::cos(view.turn_rad), st = std::sin(view.turn_rad);
  const Vector axes[2] = {mix(ct, along, st, across), mix(-st, along, ct, across)};
  DrawnTarget target;
  const double side = view.mirrored ? -1 : 1;
  for (int j = 0; j < 3; ++j) {
    const double scale = j == 2 ? view.distance : view.radius * (j == 1 ? side : 1);
    const Vector& to = j == 2 ? observation : axes[j];
    for (int i = 0; i < 3; ++i) target.h[i][j] = (i < 2 ? view.focal_px : 1) * scale * to[i];
  }
  const double w = target.h[2][2];
  const double at[2] = {target.h[0][2] / w, target.h[1][2] / w};
  for (int j = 0; j < 3; ++j) {
    target.h[0][j] += (column - at[0]) * target.h[2][j];
    target.h[1][j] += (row - at[1]) * target.h[2][j];
    for (int i = 0; i < 3; ++i) target.h[i][j] /= w;
  }
  return target;
}

Place DiscMiddle(const DrawnTarget& target) {
  // Last column of the dual conic H diag(1, 1, -1) H^T.
  double last[3];
  for (int i = 0; i < 3; ++i) {
    last[i] = target.h[i][0] * target.h[2][0] + target.h[i][1] * target.h[2][1] -
              target.h[i][2] * target.h[2][2];
  }
  return {last[0] / last[2], last[1] / last[2]};
}

namespace {

double LightAt(const Shadow& shadow, double x, double y) {
  if (shadow.left == 1) return 1;
  const double into = std::cos(shadow.towards_rad) * (x - shadow.column) +
                      std::sin(shadow.towards_rad) * (y - shadow.row);
  const double share = 0.5 * std::erfc(-into / (std::numbers::sqrt2 * shadow.soft_px));
  return 1 - (1 - shadow.left) * share;
}

double LightOf(const Gloss& gloss, double x, double y) {
  const double away = std::hypot(x - gloss.column, y - gloss.row) / gloss.size_px;
  return gloss.grey * std::exp(-0.5 * away * away);
}

}  // namespace

GreyImage Draw(int width, int height, const std::vector<DrawnTarget>& targets, const Look& look) {
  Cells cells{width * kCells, height * kCells, {}};
  cells.values.assign(
      static_cast<std::size_t>(cells.width) * static_cast<std::size_t>(cells.height), 0);
  for (const DrawnTarget& target : targets) Cover(target, cells);
  const std::vector<double> kernel = Kernel(look.blur_px);
  std::vector<float> across(static_cast<std::size_t>(width) *
                            static_cast<std::size_t>(cells.height));
  for (int y = 0; y < cells.height; ++y) {
    SumLine(&cells.values[static_cast<std::size_t>(y * cells.width)], 1, cells.width,
            &across[static_cast<std::size_t>(y * width)], 1, kernel);
  }
  std::vector<float> down(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (int x = 0; x < width; ++x) {
    SumLine(&across[static_cast<std::size_t>(x)], width, cells.height,
            &down[static_cast<std::size_t>(x)], width, kernel);
  }
  GreyImage image{width, height, {down.begin(), down.end()}};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      double& value = image.values[static_cast<std::size_t>(y * width + x)];
      const double light =
          1 + look.gradient_x * (x - 0.5 * width) + look.gradient_y * (y - 0.5 * height);
      value = light * LightAt(look.shadow, x, y) * (look.paper + (look.ink - look.paper) * value) +
              LightOf(look.gloss, x, y);
    }
  }
  return image;
}

Page Expose(const GreyImage& image, double noise, Random& random) {
  Page page;
  page.width = image.width;
  page.height = image.height;
  page.samples.reserve(image.values.size());
  for (const double value : image.values) {
    const double noisy = noise > 0 ? random.Normal(value, noise) : value;
    page.samples.push_back(static_cast<std::uint8_t>(std::clamp(std::lround(noisy), 0L, 255L)));
  }
  return page;
}

namespace {

/// True if the point, in units of the thing's size about its centre, belongs to a thing of a kind.
bool IsInThing(int kind, double u, double v, std::uint64_t pattern) {
  const double r = std::hypot(u, v);
  const double turns = kind == 1 ? std::atan2(v, u) / (2 * std::numbers::pi) + 0.5 : 0;
  switch (kind) {
    case 0:
      return r < 0.4;
    case 1:  // a disc in a ring of pieces of unequal lengths
      return r < 0.33 ||
             (r > 0.66 && r < 1 && (pattern >> static_cast<int>(turns * turns * 13) & 1U) != 0);
    case 2:
      return std::abs(u) < 0.8 && std::abs(v) < 0.25;
    case 3:
      return r > 0.55 && r < 0.85;
    case 4:
      return std::abs(u) < 1 && std::abs(v) < 1 &&
             ((static_cast<int>(u * 4 + 8) + static_cast<int>(v * 4 + 8)) & 1) != 0;
    case 5:  // rings
      return r < 1 && (static_cast<int>(r * 7) & 1) == 0;
    default:
      return std::abs(u - 0.3 * v) < 0.06 && std::abs(v) < 1;
  }
}

}  // namespace

Page Clutter(int width, int height, Random& random) {
  GreyImage image{width, height, {}};
  image.values.assign(static_cast<std::size_t>(width) * static_cast<std::size_t>(height),
                      random.Uniform(20, 235));
  const int things = 8 + static_cast<int>(random.Below(25));
  for (int i = 0; i < things; ++i) {
    const int kind = static_cast<int>(random.Below(7));
    const double size = random.Uniform(6, 36);
    const double cx = random.Uniform(0, width), cy = random.Uniform(0, height);
    const double turn = random.Uniform(0, 6.3), squeeze = random.Uniform(0.5, 1);
    const double shade = random.Uniform(0, 255);
    const std::uint64_t pattern = random.Bits();
    const double c = std::cos(turn) / size, s = std::sin(turn) / size;
    for (int y = std::max(0, static_cast<int>(cy - 1.5 * size));
         y < std::min<double>(height, cy + 1.5 * size); ++y) {
      for (int x = std::max(0, static_cast<int>(cx - 1.5 * size));
           x < std::min<double>(width, cx + 1.5 * size); ++x) {
        const double u = c * (x - cx) + s * (y - cy);
        const double v = (c * (y - cy) - s * (x - cx)) / squeeze;
        if (IsInThing(kind, u, v, pattern)) {
          image.values[static_cast<std::size_t>(y * width + x)] = shade;
        }
      }
    }
  }
  return Expose(image, random.Uniform(0, 6), random);
}

}  // namespace trammel::test
