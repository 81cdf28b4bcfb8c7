#include "tool_offset/reading/combine.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "base/check.h"
#include "base/statistics.h"

namespace trammel::tool_offset {
namespace {

/// Returns half of the 95 % interval in standard uncertainties: Student's factor, from any source.
double Factor(const Quantity& quantity) {
  if (!(quantity.standard_uncertainty > 0)) return StudentT95(1e7);
  return (quantity.interval95.hi - quantity.interval95.lo) / 2 / quantity.standard_uncertainty;
}

/// Value of one sheet, and the scatter of its scans.
struct SheetValue {
  Quantity quantity;
  double scan_squares = 0;
  int scan_freedom = 0;
};

std::optional<SheetValue> OfOneSheet(const std::vector<Measured>& scans) {
  std::vector<double> values;
  double variance = 0;
  double factor = 0;
  for (const Measured& scan : scans) {
    if (!scan.good()) continue;
    values.push_back(scan.quantity().value);
    variance += std::pow(scan.quantity().standard_uncertainty, 2);
    factor = std::max(factor, Factor(scan.quantity()));
  }
  if (values.empty()) return std::nullopt;
  const auto count = static_cast<double>(values.size());
  const double between = StandardDeviation(values);
  SheetValue sheet;
  sheet.scan_freedom = static_cast<int>(values.size()) - 1;
  sheet.scan_squares = between * between * sheet.scan_freedom;
  const double uncertainty = std::sqrt(variance / count + between * between / count);
  sheet.quantity = Around(Mean(values), uncertainty, factor);
  return sheet;
}

/// Computes the mean of the sheets, weighted by their uncertainties.
Quantity OfAllSheets(const std::vector<SheetValue>& sheets) {
  constexpr double kContradiction = 0.01;
  constexpr double kMin_mm = 1e-6;  // a drawn page without noise
  if (sheets.size() == 1) return sheets[0].quantity;
  double weights = 0;
  double sum = 0;
  double factor = 0;
  const auto weight = [&](const SheetValue& sheet) {
    return 1 / std::pow(std::max(kMin_mm, sheet.quantity.standard_uncertainty), 2);
  };
  for (const SheetValue& sheet : sheets) {
    weights += weight(sheet);
    sum += weight(sheet) * sheet.quantity.value;
    factor = std::max(factor, Factor(sheet.quantity));
  }
  const double mean = sum / weights;
  double chi_square = 0;
  for (const SheetValue& sheet : sheets) {
    chi_square += weight(sheet) * std::pow(sheet.quantity.value - mean, 2);
  }
  const int freedom = static_cast<int>(sheets.size()) - 1;
  double uncertainty = 1 / std::sqrt(weights);
  if (ChiSquareTail(chi_square, freedom) < kContradiction) {
    uncertainty *= std::sqrt(chi_square / freedom);
    factor = std::max(factor, StudentT95(freedom));
  }
  return Around(mean, uncertainty, factor);
}

using Sheets = std::span<const std::vector<SheetResult>>;
using Pick = std::function<const Measured*(const SheetResult&)>;

struct Combined {
  Measured measured;
  int sheets = 0;
  double scan_scatter = 0;
};

/// @param pick  the value of one scan; null where the scan does not count.
Combined CombineOne(Sheets sheets, const Pick& pick) {
  std::vector<SheetValue> values;
  Combined combined;
  const Measured* refused = nullptr;
  for (const std::vector<SheetResult>& scans : sheets) {
    std::vector<Measured> of_sheet;
    for (const SheetResult& scan : scans) {
      const Measured* measured = pick(scan);
      if (measured == nullptr) continue;
      if (!measured->good()) refused = measured;
      of_sheet.push_back(*measured);
    }
    if (const auto value = OfOneSheet(of_sheet)) values.push_back(*value);
  }
  combined.sheets = static_cast<int>(values.size());
  if (values.empty()) {
    combined.measured =
        refused != nullptr ? *refused : Measured::Refused("no scan has a value for it");
    return combined;
  }
  combined.measured = Measured::Good(OfAllSheets(values));
  double squares = 0;
  int freedom = 0;
  for (const SheetValue& value : values) {
    squares += value.scan_squares;
    freedom += value.scan_freedom;
  }
  combined.scan_scatter = freedom > 0 ? std::sqrt(squares / freedom) : 0;
  return combined;
}

/// Combines fine values if there are any, otherwise coarse ones.
CombinedTool CombineTool(Sheets sheets, std::size_t index) {
  CombinedTool combined;
  combined.tool = sheets[0][0].tools[index].tool;
  combined.coarse = std::all_of(sheets.begin(), sheets.end(), [&](const auto& scans) {
    return std::all_of(scans.begin(), scans.end(), [&](const SheetResult& scan) {
      return scan.tools[index].coarse || !scan.tools[index].dx_mm.good();
    });
  });
  const auto counts = [&](const ToolReading& tool) { return combined.coarse || !tool.coarse; };
  const Combined dx = CombineOne(sheets, [&](const SheetResult& scan) {
    return counts(scan.tools[index]) ? &scan.tools[index].dx_mm : nullptr;
  });
  const Combined dy = CombineOne(sheets, [&](const SheetResult& scan) {
    return counts(scan.tools[index]) ? &scan.tools[index].dy_mm : nullptr;
  });
  combined.coarse = combined.coarse && dx.measured.good();
  combined.dx_mm = dx.measured;
  combined.dy_mm = dy.measured;
  combined.sheets = dx.sheets;
  combined.scan_scatter_mm = {dx.scan_scatter, dy.scan_scatter};
  return combined;
}

}  // namespace

CombinedResult Combine(Sheets sheets) {
  TRAMMEL_CHECK(!sheets.empty(), "no sheet");
  for (const std::vector<SheetResult>& scans : sheets) {
    TRAMMEL_CHECK(!scans.empty(), "a sheet without a scan");
    for (const SheetResult& scan : scans) {
      TRAMMEL_CHECK(scan.tools.size() == sheets[0][0].tools.size(), "{} and {} tools",
                    scan.tools.size(), sheets[0][0].tools.size());
    }
  }
  CombinedResult result;
  for (std::size_t i = 0; i < sheets[0][0].tools.size(); ++i) {
    result.tools.push_back(CombineTool(sheets, i));
  }
  const auto pair = [&](AxisPair SheetResult::*member) {
    return AxisPair{
        CombineOne(sheets, [&](const SheetResult& r) { return &(r.*member).x; }).measured,
        CombineOne(sheets, [&](const SheetResult& r) { return &(r.*member).y; }).measured};
  };
  result.backlash_mm = pair(&SheetResult::backlash_mm);
  result.control_bias_mm = pair(&SheetResult::control_bias_mm);
  result.px_per_mm = pair(&SheetResult::px_per_mm);
  return result;
}

}  // namespace trammel::tool_offset
