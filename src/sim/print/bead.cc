#include "sim/print/bead.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "base/check.h"

namespace trammel::sim {

namespace {

constexpr double kRoundShare = 1 - std::numbers::pi / 4;  // of h^2, missing in a stadium
constexpr double kFullWidthInNozzles = 1.25;
constexpr double kRisePerSurplus = 0.35;
constexpr double kDropletInBreakAreas = 1.5;
constexpr double kDropletLengthMm = 0.15;
constexpr double kDrawnBackMm = 0.3;  // length of bead that takes up what is too little
constexpr double kDropletPitchMm = 0.8;

// Returns the length represented by node i, in spacings.
double Share(std::size_t i, std::size_t count) { return i == 0 || i + 1 == count ? 0.5 : 1.0; }

// Collects the material of nodes [begin, end) in droplets.
void Gather(std::span<double> area, std::size_t begin, std::size_t end, double spacing_mm,
            double break_area_mm2, Random& random) {
  double volume = 0;  // mm^2 times spacings
  double nodes = 0;
  for (std::size_t i = begin; i < end; ++i) {
    volume += area[i] * Share(i, area.size());
    nodes += Share(i, area.size());
    area[i] = 0;
  }
  const double droplet_area = kDropletInBreakAreas * break_area_mm2;
  const double least = droplet_area * kDropletLengthMm / spacing_mm;
  const double droplets =
      std::floor(std::min(volume / least, std::max(1.0, nodes * spacing_mm / kDropletPitchMm)));
  if (droplets < 1) {
    // Too little for a droplet of its own: surface tension draws it into the end of the adjacent
    // bead, preferably the one before.
    const auto reach = static_cast<std::size_t>(std::ceil(kDrawnBackMm / spacing_mm));
    std::size_t first = begin > 0 ? begin - 1 : std::min(end, area.size() - 1);
    std::size_t last = first + 1;
    while (begin > 0 && first > 0 && last - first < reach && area[first - 1] >= break_area_mm2) {
      --first;
    }
    while (begin == 0 && last < area.size() && last - first < reach &&
           area[last] >= break_area_mm2) {
      ++last;
    }
    double share = 0;
    for (std::size_t i = first; i < last; ++i) share += Share(i, area.size());
    for (std::size_t i = first; i < last; ++i) area[i] += volume / share;
    return;
  }
  const double pitch = nodes / droplets;
  const double each = volume / droplets;
  for (int k = 0; k < static_cast<int>(droplets); ++k) {
    const double centre = (k + random.Uniform(0.3, 0.7)) * pitch;
    const double half = 0.5 * std::min(pitch, std::max(1.0, each / droplet_area));
    const auto first = begin + static_cast<std::size_t>(std::max(0.0, centre - half));
    const auto last = std::min(end, begin + static_cast<std::size_t>(centre + half) + 1);
    double share = 0;
    for (std::size_t i = first; i < last; ++i) share += Share(i, area.size());
    for (std::size_t i = first; i < last; ++i) area[i] += each / share;
  }
}

}  // namespace

double StadiumArea(double width_mm, double height_mm) {
  TRAMMEL_CHECK(height_mm >= 0 && width_mm >= height_mm, "width = {}, height = {}", width_mm,
                height_mm);
  return height_mm * (width_mm - height_mm * kRoundShare);
}

BeadShape ShapeOf(double area_mm2, double gap_mm, const BeadOptions& options) {
  TRAMMEL_CHECK(area_mm2 >= 0 && gap_mm > 0, "area = {}, gap = {}", area_mm2, gap_mm);
  const double round_mm = std::sqrt(4 * area_mm2 / std::numbers::pi);
  if (round_mm <= gap_mm) {
    return {round_mm, round_mm};
  }
  const double surplus = std::max(0.0, area_mm2 / FullArea(gap_mm, options) - 1);
  const double height_mm = std::min(
      round_mm, gap_mm * (1 + options.most_rise * -std::expm1(-kRisePerSurplus * surplus)));
  return {area_mm2 / height_mm + height_mm * kRoundShare, height_mm};
}

double FullArea(double gap_mm, const BeadOptions& options) {
  const double full_width_mm = std::max(gap_mm, kFullWidthInNozzles * options.nozzle_diameter_mm);
  return StadiumArea(full_width_mm, gap_mm);
}

void Smear(std::span<double> area_mm2, double spacing_mm, double smear_mm) {
  const auto reach = static_cast<std::ptrdiff_t>(smear_mm / spacing_mm);
  const auto count = static_cast<std::ptrdiff_t>(area_mm2.size());
  if (reach < 1 || count < 3) {
    return;
  }
  double sum = 0;
  std::vector<double> weight;
  for (std::ptrdiff_t k = 0; k <= reach; ++k) {
    weight.push_back(1 - static_cast<double>(k) * spacing_mm / smear_mm);
    sum += k == 0 ? weight.back() : 2 * weight.back();
  }
  const std::vector<double> before(area_mm2.begin(), area_mm2.end());
  // Reflection about the end nodes: index -1 is 1, count is count - 2.
  const std::ptrdiff_t period = 2 * (count - 1);
  const auto reflected = [&](std::ptrdiff_t i) {
    i = ((i % period) + period) % period;
    return before[static_cast<std::size_t>(i < count ? i : period - i)];
  };
  for (std::ptrdiff_t i = 0; i < count; ++i) {
    double total = weight[0] * reflected(i);
    for (std::ptrdiff_t k = 1; k <= reach; ++k) {
      total += weight[static_cast<std::size_t>(k)] * (reflected(i - k) + reflected(i + k));
    }
    area_mm2[static_cast<std::size_t>(i)] = total / sum;
  }
}

void SpreadSurplus(std::span<double> area_mm2, std::span<const double> full_mm2,
                   double spacing_mm) {
  // Diffusion of the surplus s with a diffusivity that rises with it: flux = d/dx s^2 / (s0 + s).
  // Over the time of kSpreadMm2 a blob of 0.6 mm^2, near 2 mm wide, gains some 0.35 mm (1 sigma).
  constexpr double kSpreadMm2 = 0.05;
  constexpr double kScaleMm2 = 0.5;
  constexpr double kStableShare = 0.4;  // below 0.5, the bound of the explicit scheme
  const std::size_t count = area_mm2.size();
  const auto steps = static_cast<int>(
      std::ceil(kSpreadMm2 / kScaleMm2 * 2 / (kStableShare * spacing_mm * spacing_mm)));
  const double share = kSpreadMm2 / kScaleMm2 * 2 / (steps * spacing_mm * spacing_mm);
  std::vector<double> pressure(count);
  // One node a step is as far as a surplus spreads: the rest of the path rests.
  std::size_t first = count;
  std::size_t last = 0;
  for (std::size_t i = 0; i < count; ++i) {
    if (area_mm2[i] <= full_mm2[i]) continue;
    first = std::min(first, i);
    last = i;
  }
  for (int step = 0; step < steps; ++step) {
    if (first > last) return;
    first -= first > 0 ? 1 : 0;
    last = std::min(last + 1, count - 1);
    for (std::size_t i = first; i <= last; ++i) {
      const double surplus = std::max(0.0, area_mm2[i] - full_mm2[i]);
      pressure[i] = surplus * surplus / (kScaleMm2 + surplus);
    }
    for (std::size_t i = first; i < last; ++i) {
      const double flow = 0.5 * share * (pressure[i] - pressure[i + 1]);
      area_mm2[i] -= flow / Share(i, count);
      area_mm2[i + 1] += flow / Share(i + 1, count);
    }
  }
}

void BreakUp(std::span<double> area_mm2, double spacing_mm, double break_area_mm2, Random& random) {
  std::size_t i = 0;
  while (i < area_mm2.size()) {
    if (area_mm2[i] >= break_area_mm2) {
      ++i;
      continue;
    }
    std::size_t end = i;
    while (end < area_mm2.size() && area_mm2[end] < break_area_mm2) ++end;
    Gather(area_mm2, i, end, spacing_mm, break_area_mm2, random);
    i = end;
  }
}

void AddFlowNoise(std::span<double> area_mm2, double spacing_mm, double sigma, double length_mm,
                  Random& random) {
  if (sigma <= 0) {
    return;
  }
  const double keep = std::exp(-spacing_mm / length_mm);
  const double fresh = sigma * std::sqrt(1 - keep * keep);
  double noise = random.Normal(0, sigma);
  for (double& area : area_mm2) {
    area *= std::max(0.0, 1 + noise);
    noise = keep * noise + random.Normal(0, fresh);
  }
}

void AddBlobs(std::span<double> area_mm2, double spacing_mm, double blobs_per_m, Random& random) {
  constexpr double kSigmaMm = 0.25;
  const double length_mm = spacing_mm * static_cast<double>(area_mm2.size() - 1);
  const int count = DrawCount(blobs_per_m, length_mm, random);
  for (int blob = 0; blob < count; ++blob) {
    const double centre_mm = random.Uniform(0, length_mm);
    const double peak_mm2 =
        random.Uniform(0.02, 0.10) / (kSigmaMm * std::sqrt(2 * std::numbers::pi));
    for (std::size_t i = 0; i < area_mm2.size(); ++i) {
      const double z = (static_cast<double>(i) * spacing_mm - centre_mm) / kSigmaMm;
      area_mm2[i] += peak_mm2 * std::exp(-0.5 * z * z);
    }
  }
}

void CutGaps(std::span<double> area_mm2, double spacing_mm, double gaps_per_m, Random& random) {
  const double length_mm = spacing_mm * static_cast<double>(area_mm2.size() - 1);
  const int count = DrawCount(gaps_per_m, length_mm, random);
  for (int gap = 0; gap < count; ++gap) {
    const double centre_mm = random.Uniform(0, length_mm);
    const double half_mm = 0.5 * random.Uniform(0.3, 1.2);
    for (std::size_t i = 0; i < area_mm2.size(); ++i) {
      if (std::abs(static_cast<double>(i) * spacing_mm - centre_mm) <= half_mm) {
        area_mm2[i] = 0;
      }
    }
  }
}

Strand DrawString(double x_mm, double y_mm, double spacing_mm, Random& random) {
  const double thickness_mm = random.Uniform(0.06, 0.10);
  const double length_mm = random.Uniform(1, 4);
  double heading_rad = random.Uniform(0, 2 * std::numbers::pi);
  double turn_rad_mm = random.Normal(0, 0.6);
  Strand strand;
  for (double s_mm = 0; s_mm <= length_mm; s_mm += spacing_mm) {
    strand.samples.push_back({x_mm, y_mm, std::numbers::pi / 4 * thickness_mm * thickness_mm,
                              thickness_mm, thickness_mm});
    x_mm += spacing_mm * std::cos(heading_rad);
    y_mm += spacing_mm * std::sin(heading_rad);
    heading_rad += turn_rad_mm * spacing_mm;
    turn_rad_mm += random.Normal(0, 0.8 * std::sqrt(spacing_mm));
  }
  return strand;
}

int DrawCount(double per_m, double length_mm, Random& random) {
  const double mean = per_m * length_mm * 1e-3;
  int count = 0;
  for (double t = -std::log(1 - random.Uniform()); t < mean; t += -std::log(1 - random.Uniform())) {
    ++count;
  }
  return count;
}

}  // namespace trammel::sim
