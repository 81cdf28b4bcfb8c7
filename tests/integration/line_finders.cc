#include "line_finders.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

namespace trammel::test {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

using Row = std::vector<double>;

Row RowOf(const RowPicture& picture, int y) {
  return {picture.row(y), picture.row(y) + picture.width};
}

double At(const Row& row, int x) {
  return row[static_cast<std::size_t>(std::clamp(x, 0, static_cast<int>(row.size()) - 1))];
}

double MedianOf(Row row) {
  const auto middle = row.begin() + static_cast<std::ptrdiff_t>(row.size() / 2);
  std::nth_element(row.begin(), middle, row.end());
  return *middle;
}

/// A row behind a Gaussian or one of its derivatives.
Row Convolved(const Row& row, double sigma, int derivative) {
  const int reach = static_cast<int>(std::ceil(4 * sigma));
  Row out(row.size());
  double total = 0;
  for (int k = -reach; k <= reach; ++k) total += std::exp(-0.5 * k * k / (sigma * sigma));
  for (int x = 0; x < static_cast<int>(row.size()); ++x) {
    double sum = 0;
    for (int k = -reach; k <= reach; ++k) {
      const double t = k / sigma;
      const double form = derivative == 0   ? 1
                          : derivative == 1 ? -t / sigma
                                            : (t * t - 1) / (sigma * sigma);
      sum += At(row, x - k) * form * std::exp(-0.5 * t * t);
    }
    out[static_cast<std::size_t>(x)] = sum / total;
  }
  return out;
}

int Brightest(const Row& row) {
  return static_cast<int>(std::max_element(row.begin(), row.end()) - row.begin());
}

/// How far the top of a parabola through three values lies from the middle one; NaN for none.
double Top(double before, double middle, double behind) {
  const double bend = before - 2 * middle + behind;
  return bend < 0 ? 0.5 * (before - behind) / bend : kNone;
}

template <typename Find>
Centres InEachRow(const RowPicture& picture, const Find& find) {
  Centres centres;
  for (int y = 0; y < picture.height; ++y) centres.push_back(find(RowOf(picture, y)));
  return centres;
}

}  // namespace

Centres CentreOfGravity(const RowPicture& picture) {
  return InEachRow(picture, [&](const Row& row) {
    const double background = MedianOf(row);
    double centre = Brightest(Convolved(row, picture.sigma_px, 0));
    const int reach = std::max(2, static_cast<int>(std::lround(3 * picture.sigma_px)));
    for (int pass = 0; pass < 3; ++pass) {
      const int middle = static_cast<int>(std::lround(centre));
      double sum = 0;
      double moment = 0;
      for (int x = middle - reach; x <= middle + reach; ++x) {
        if (x < 0 || x >= picture.width) continue;
        const double light = std::max(0.0, At(row, x) - background);
        sum += light;
        moment += light * x;
      }
      if (sum <= 0) return kNone;
      centre = moment / sum;
    }
    return centre;
  });
}

Centres GaussianParabola(const RowPicture& picture) {
  return InEachRow(picture, [](const Row& row) {
    const double background = MedianOf(row);
    const auto logarithm = [&](int x) { return std::log(std::max(0.5, At(row, x) - background)); };
    const int peak = Brightest(row);
    return peak + Top(logarithm(peak - 1), logarithm(peak), logarithm(peak + 1));
  });
}

Centres BlaisRioux(const RowPicture& picture) {
  const int half = std::max(2, static_cast<int>(std::lround(1.5 * picture.sigma_px)));
  return InEachRow(picture, [&](const Row& row) {
    const auto difference = [&](int x) {  // rises to the left of the centre
      double sum = 0;
      for (int k = 1; k <= half; ++k) sum += At(row, x + k) - At(row, x - k);
      return sum;
    };
    const int peak = Brightest(Convolved(row, picture.sigma_px, 0));
    for (int step = 0; step <= half; ++step) {
      for (const int x : {peak + step, peak - step - 1}) {
        const double before = difference(x);
        const double behind = difference(x + 1);
        if (before > 0 && behind <= 0) return x + before / (before - behind);
      }
    }
    return kNone;
  });
}

Centres StegerRidge(const RowPicture& picture) {
  return InEachRow(picture, [&](const Row& row) {
    const Row slope = Convolved(row, picture.sigma_px, 1);
    const Row bend = Convolved(row, picture.sigma_px, 2);
    int best = static_cast<int>(std::min_element(bend.begin(), bend.end()) - bend.begin());
    for (int pass = 0; pass < 5; ++pass) {
      if (At(bend, best) >= 0) return kNone;
      const double step = -At(slope, best) / At(bend, best);
      if (std::abs(step) <= 0.5) return best + step;
      best += step > 0 ? 1 : -1;
    }
    return kNone;
  });
}

Centres ShortestPathRidge(const RowPicture& picture) {
  constexpr int kMostSideways = 3;
  constexpr double kSidewaysPrice = 0.05;
  const auto width = static_cast<std::size_t>(picture.width);
  std::vector<Row> smooth;
  std::vector<Row> cost;
  std::vector<std::vector<int>> from;
  for (int y = 0; y < picture.height; ++y) {
    smooth.push_back(Convolved(RowOf(picture, y), picture.sigma_px, 0));
    const Row& row = smooth.back();
    const double floor = MedianOf(row);
    const double range = std::max(1e-6, At(row, Brightest(row)) - floor);
    Row total(width);
    std::vector<int> came(width, 0);
    for (int x = 0; x < picture.width; ++x) {
      double least = y == 0 ? 0 : std::numeric_limits<double>::max();
      for (int step = -kMostSideways; y > 0 && step <= kMostSideways; ++step) {
        if (x + step < 0 || x + step >= picture.width) continue;
        const double price = At(cost.back(), x + step) + kSidewaysPrice * std::abs(step);
        if (price < least) least = price, came[static_cast<std::size_t>(x)] = step;
      }
      total[static_cast<std::size_t>(x)] = least + 1 - (At(row, x) - floor) / range;
    }
    cost.push_back(std::move(total));
    from.push_back(std::move(came));
  }
  Centres centres(static_cast<std::size_t>(picture.height));
  int x = static_cast<int>(std::min_element(cost.back().begin(), cost.back().end()) -
                           cost.back().begin());
  for (std::size_t y = centres.size(); y-- > 0;) {
    const Row& row = smooth[y];
    int top = x;  // the path cuts corners
    while (At(row, top + 1) > At(row, top) && top - x < picture.sigma_px) ++top;
    while (At(row, top - 1) > At(row, top) && x - top < picture.sigma_px) --top;
    centres[y] = top + Top(At(row, top - 1), At(row, top), At(row, top + 1));
    x += from[y][static_cast<std::size_t>(x)];
  }
  return centres;
}

}  // namespace trammel::test
