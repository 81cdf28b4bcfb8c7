#include "pressure_advance/report/pressure_advance_figures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

namespace trammel::report {

std::vector<Figure> PressureAdvanceFigures(const AnalysisRun& input) {
  std::vector<Figure> figures;
  for (const auto& make : {ResponseFigure, ProfilesFigure, PhotoFigure, HeightMapsFigure}) {
    if (std::optional<Figure> figure = make(input)) {
      figures.push_back(std::move(*figure));
    }
  }
  return figures;
}

namespace pa = pressure_advance;

std::string PressureAdvanceText(double seconds) {
  std::string text = fmt::format("{:.4f}", seconds);
  if (text.back() == '0') {
    text.pop_back();
  }
  return text;
}

std::vector<std::size_t> LinesByPressureAdvance(const pa::Analysis& analysis, std::size_t most) {
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < analysis.lines.size(); ++i) {
    if (std::isfinite(analysis.lines[i].pressure_advance_s)) {
      order.push_back(i);
    }
  }
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return analysis.lines[a].pressure_advance_s < analysis.lines[b].pressure_advance_s;
  });
  if (order.size() <= most || most < 2) {
    return order;
  }
  std::vector<std::size_t> picked;
  for (std::size_t i = 0; i < most; ++i) {
    picked.push_back(order[i * (order.size() - 1) / (most - 1)]);
  }
  return picked;
}

}  // namespace trammel::report
