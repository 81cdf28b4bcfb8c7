#include "part_alignment/part_fit/scale_bars.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "geometry/linear_systems.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Index;

constexpr double kLimit = 3.29;       // sigmas: 0.1 % of sound bars
constexpr double kDetectable = 4.13;  // sigmas: that limit, exceeded with a probability of 80 %

std::string NameOf(const ScaleBar& bar) { return fmt::format("{}-{}", bar.from, bar.to); }

// Scale of some of the bars, and each one's error.
struct Tested {
  std::vector<Index> of;  // indices of the bars
  double ln_scale = 0;
  double sigma = 0;
  Eigen::VectorXd off;         // ln: found by the others' scale, less calibrated
  Eigen::VectorXd test;        // the same in its sigmas
  Eigen::VectorXd detectable;  // ln
  [[nodiscard]] Index Worst() const {
    Index worst = 0;
    test.cwiseAbs().maxCoeff(&worst);
    return worst;
  }
  [[nodiscard]] bool Agree() const { return std::abs(test[Worst()]) <= kLimit; }
};

Tested Test(const FoundBars& found, std::vector<Index> of) {
  Tested tested;
  tested.of = std::move(of);
  const auto count = std::ssize(tested.of);
  Eigen::VectorXd ratio(count);  // ln calibrated / found
  Eigen::MatrixXd covariance = found.covariance(tested.of, tested.of);
  for (Index i = 0; i < count; ++i) {
    const Index index = tested.of[static_cast<std::size_t>(i)];
    const ScaleBar& bar = found.bars[static_cast<std::size_t>(index)];
    ratio[i] = std::log(bar.length_mm / found.lengths[index]);
    covariance(i, i) += std::pow(bar.sigma_mm / bar.length_mm, 2);
  }
  const Eigen::MatrixXd weight = geometry::Inverse(covariance);
  const Eigen::VectorXd by_one = weight.rowwise().sum();
  tested.ln_scale = by_one.dot(ratio) / by_one.sum();
  tested.sigma = 1 / std::sqrt(by_one.sum());
  tested.off = tested.test = tested.detectable = Eigen::VectorXd::Zero(count);
  if (count < 2) return tested;
  const Eigen::MatrixXd of_residuals = weight - by_one * by_one.transpose() / by_one.sum();
  const Eigen::VectorXd weighed = of_residuals * ratio;
  for (Index i = 0; i < count; ++i) {
    const double root = std::sqrt(of_residuals(i, i));
    tested.off[i] = -weighed[i] / of_residuals(i, i);
    tested.test[i] = -weighed[i] / root;
    tested.detectable[i] = kDetectable / root;
  }
  return tested;
}

std::vector<Index> Without(std::vector<Index> of, Index i) {
  of.erase(of.begin() + i);
  return of;
}

void Note(const FoundBars& found, const Tested& tested, Index i, bool used, BarScale& scale) {
  const auto bar = static_cast<std::size_t>(tested.of[static_cast<std::size_t>(i)]);
  const double length_mm = found.bars[bar].length_mm;
  scale.bars[bar] = {used, length_mm * std::expm1(tested.off[i]), tested.test[i],
                     length_mm * tested.detectable[i]};
}

std::string LongerText(double misclosure_mm) {
  return fmt::format("{:.3f} mm {}", std::abs(misclosure_mm),
                     misclosure_mm < 0 ? "longer" : "shorter");
}

std::string FaultOf(const FoundBars& found, const Tested& all, const BarScale& scale,
                    const std::vector<Index>& suspects) {
  const auto name = [&](Index i) {
    return NameOf(found.bars[static_cast<std::size_t>(all.of[static_cast<std::size_t>(i)])]);
  };
  const Index worst = all.Worst();
  const BarTest& of_worst =
      scale.bars[static_cast<std::size_t>(all.of[static_cast<std::size_t>(worst)])];
  if (all.of.size() == 2) {
    return fmt::format(
        "the scale bars {} and {} contradict one another by {:.3f} mm, {:.1f} times what their "
        "uncertainty and the measurement let expect: check their lengths and ends, or add a third",
        name(0), name(1), std::abs(of_worst.misclosure_mm), std::abs(of_worst.test));
  }
  std::string words = fmt::format(
      "the scale bars contradict one another: {}-{} is {} than by the others ({:.1f} sigmas)",
      found.bars[static_cast<std::size_t>(all.of[static_cast<std::size_t>(worst)])].from,
      found.bars[static_cast<std::size_t>(all.of[static_cast<std::size_t>(worst)])].to,
      LongerText(of_worst.misclosure_mm), std::abs(of_worst.test));
  if (suspects.empty()) {
    words += ", and without it others still do";
  } else {
    words += "; any one of ";
    for (std::size_t i = 0; i < suspects.size(); ++i) {
      words += (i == 0 ? "" : ", ") + name(suspects[i]);
    }
    words += " may be the wrong one";
  }
  return words + ": check their lengths and ends";
}

}  // namespace

BarScale TestBars(const FoundBars& found) {
  BarScale scale;
  scale.bars.resize(found.bars.size());
  std::vector<Index> all_bars;
  for (Index i = 0; i < std::ssize(found.bars); ++i) all_bars.push_back(i);
  if (all_bars.empty()) return scale;
  const Tested all = Test(found, all_bars);
  for (Index i = 0; i < std::ssize(all_bars); ++i) Note(found, all, i, true, scale);
  Tested used = all;
  if (!all.Agree()) {
    std::vector<Index> suspects;
    for (Index i = 0; i < std::ssize(all_bars) && all_bars.size() > 2; ++i) {
      if (Test(found, Without(all_bars, i)).Agree()) suspects.push_back(i);
    }
    if (suspects.size() != 1) {
      scale.fault = FaultOf(found, all, scale, suspects);
      return scale;
    }
    const Index wrong = suspects.front();
    used = Test(found, Without(all_bars, wrong));
    for (Index i = 0; i < std::ssize(used.of); ++i) Note(found, used, i, true, scale);
    BarTest& left_out = scale.bars[static_cast<std::size_t>(wrong)];
    left_out.used = false;
    scale.notices.push_back(
        fmt::format("the scale bar {} is {} than by the others ({:.1f} sigmas): it is left out",
                    NameOf(found.bars[static_cast<std::size_t>(wrong)]),
                    LongerText(left_out.misclosure_mm), std::abs(left_out.test)));
  }
  scale.scale = std::exp(used.ln_scale);
  scale.sigma = scale.scale * used.sigma;
  if (used.of.size() == 1) {
    scale.unchecked = fmt::format(
        "the scale rests on one bar alone, {}: nothing checks its length and its ends; add a "
        "second",
        NameOf(found.bars.front()));
  }
  return scale;
}

}  // namespace trammel::part_alignment
