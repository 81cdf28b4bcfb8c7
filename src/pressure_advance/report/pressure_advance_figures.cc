#include "pressure_advance/report/pressure_advance_figures.h"

#include <utility>

#include "base/check.h"

namespace trammel::report {

std::vector<Figure> PressureAdvanceFigures(const AnalysisRun& input) {
  std::vector<Figure> figures;
  for (const auto& make :
       {ResponseFigure, ProfilesFigure, PhotoFigure, HeightMapsFigure, DeviationFigure}) {
    if (std::optional<Figure> figure = make(input)) {
      figures.push_back(std::move(*figure));
    }
  }
  return figures;
}

}  // namespace trammel::report
