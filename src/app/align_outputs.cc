#include "app/align_outputs.h"

#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <system_error>

#include "store/whole_file.h"

namespace trammel::app {

Result<void> WriteMetrologyReport(const std::string& folder, const MetrologyReport& report,
                                  std::span<const report::Figure> figures) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) return Fail(fmt::format("--report {}: {}", folder, error.message()));
  const std::filesystem::path base(folder);
  auto written = store::WriteWholeFile(
      base / "report.html",
      report::FigurePage(report.title, report.verdict, report.reason, report.text, figures));
  if (!written) return written;
  for (const report::Figure& figure : figures) {
    written =
        store::WriteWholeFile(base / (figure.name + ".png"), figure.canvas.ToPng(figure.png_scale));
    if (!written) return written;
    written = store::WriteWholeFile(base / (figure.name + ".svg"), figure.canvas.ToSvg());
    if (!written) return written;
  }
  return {};
}

void PrintAnswer(bool json, const std::string& json_text, const std::string& text) {
  fmt::print("{}", json ? json_text : text);
}

}  // namespace trammel::app
