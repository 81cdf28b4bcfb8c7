#include "sim/print/defects.h"

#include <cmath>
#include <numbers>

namespace trammel::sim {

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
