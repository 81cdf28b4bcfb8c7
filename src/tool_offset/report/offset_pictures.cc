// The figures of a scan, drawn while its page is at hand.
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <vector>

#include "tool_offset/report/offset_figures.h"

namespace trammel::report {
namespace {

namespace to = tool_offset;

/// How much a structure asks to be looked at: one without a value first, then by how far it lies
/// from the fit of all.
double Interest(const to::StructureReading& reading) {
  if (!reading.offset_mm.good()) return HUGE_VAL;
  const Quantity& quantity = reading.offset_mm.quantity();
  if (!reading.expected_mm || !(quantity.standard_uncertainty > 0)) return 0;
  return std::abs(quantity.value - *reading.expected_mm) / quantity.standard_uncertainty;
}

/// The place of each structure in the order in which they ask to be looked at, from 0.
std::vector<std::size_t> Ranks(const std::vector<to::StructureReading>& structures) {
  std::vector<std::size_t> order(structures.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return Interest(structures[a]) > Interest(structures[b]);
  });
  std::vector<std::size_t> ranks(structures.size());
  for (std::size_t i = 0; i < order.size(); ++i) ranks[order[i]] = i;
  return ranks;
}

/// How many structures of a scan have their picture on the page at each step.
constexpr std::array<std::size_t, kPhotoSteps.size()> kMostPictured = {8, 8, 6, 3, 1};

DrawnFigure ForPage(const Figure& figure, std::size_t rank = 0) {
  DrawnFigure drawn = Drawn(figure);
  for (std::size_t step = 0; step < kPhotoSteps.size(); ++step) {
    if (rank < kMostPictured[step]) drawn.html[step] = FigureHtml(figure, kPhotoSteps[step]);
  }
  return drawn;
}

}  // namespace

DrawnFigure Drawn(const Figure& figure) { return {figure.name, figure.canvas.ToSvg()}; }

OffsetScanPictures DrawOffsetScan(const PageView& page, const to::SheetPlan& plan,
                                  const to::SheetResult& result) {
  OffsetScanPictures pictures;
  pictures.page = ForPage(PageFigure(page, plan, result));
  const std::vector<std::size_t> ranks = Ranks(result.structures);
  for (std::size_t i = 0; i < result.structures.size(); ++i) {
    const Figure figure = StructureFigure(page, plan, result, result.structures[i]);
    pictures.structures.push_back(ForPage(figure, ranks[i]));
  }
  return pictures;
}

}  // namespace trammel::report
