#include "tool_offset/reading/original_match.h"

#include <algorithm>
#include <vector>

namespace trammel::tool_offset {
namespace {

struct Sum {
  double sum = 0;
  int count = 0;
  [[nodiscard]] double Mean() const { return sum / std::max(1, count); }
};

}  // namespace

SheetPlan BarOf(const SheetPlan& plan) {
  SheetPlan bar;
  bar.original = true;
  bar.settings = plan.settings;
  const double inset_mm = plan.box_insets_mm.back() / 2;
  bar.settings.line_width_mm += 2 * inset_mm;
  bar.box_insets_mm = {0};
  bar.width_mm = plan.width_mm - 2 * inset_mm;
  bar.height_mm = plan.height_mm - 2 * inset_mm;
  return bar;
}

double ReferenceMatch(const PageView& page, const SheetPlan& plan, const ChannelMix& mix,
                      const PageMap& map) {
  constexpr double kFrom_mm = 0.3;  // beyond the other comb's turns; and to the own spine
  constexpr int kPlaces = 3;
  const SheetSettings& settings = plan.settings;
  const double half_mm = settings.leg_spacing_mm / 2;
  const double low_mm = settings.overlap_mm / 2 + plan.turn_mm + kFrom_mm;
  const double high_mm = settings.leg_length_mm - settings.overlap_mm / 2 - kFrom_mm;
  Sum ink;
  Sum paper;
  std::vector<float> sample;
  for (const Structure& structure : plan.structures) {
    const bool is_x = structure.axis == Axis::kX;
    const auto add = [&](double along_mm, Sum& sum) {
      for (int i = 0; i < kPlaces; ++i) {
        const double across_mm = (is_x ? structure.middle.v_mm : structure.middle.u_mm) + low_mm +
                                 (high_mm - low_mm) * i / (kPlaces - 1);
        const SheetPoint at =
            is_x ? SheetPoint{along_mm, across_mm} : SheetPoint{across_mm, along_mm};
        // A place beside the page is no ink.
        if (SampleStrip(page, mix, {map.ToPage(at), {}, {}, 1, 1}, sample)) {
          sum.sum += static_cast<double>(sample[0]);
        }
        ++sum.count;
      }
    };
    const std::size_t comb = structure.swapped ? 0 : 1;  // the reference tool's own
    for (int finger = 0; finger < settings.teeth; ++finger) {
      if (finger == structure.incomplete[comb]) continue;
      const double at_mm = FingerPosition_mm(plan, structure, comb, finger);
      for (const double aside_mm : {-half_mm, half_mm}) add(at_mm + aside_mm, ink);
      add(at_mm, paper);
      add(at_mm - settings.pitch_mm / 2, paper);
    }
  }
  return ink.Mean() - paper.Mean();
}

}  // namespace trammel::tool_offset
