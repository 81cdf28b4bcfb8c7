#include "part_alignment/commands/align_outputs.h"

#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <system_error>

#include "app/output_files.h"

namespace trammel::app {

Result<void> WriteMetrologyReport(const std::string& folder, const std::string& page,
                                  std::span<const report::Figure> figures, bool force) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) return Fail(fmt::format("--report {}: {}", folder, error.message()));
  const std::filesystem::path base(folder);
  std::vector<OutputFile> files = {{base / "report.html", page}};
  for (const report::Figure& figure : figures) {
    files.push_back({base / (figure.name + ".png"), figure.canvas.ToPng(figure.png_scale)});
    files.push_back({base / (figure.name + ".svg"), figure.canvas.ToSvg()});
  }
  return WriteOutputs(files, force);
}

Result<void> CheckFree(const std::string& out, const std::string& report_folder, bool force) {
  std::vector<std::filesystem::path> paths;
  if (!out.empty()) paths.emplace_back(out);
  if (!report_folder.empty()) {
    paths.push_back(std::filesystem::path(report_folder) / "report.html");
  }
  return RefuseToOverwrite(paths, force);
}

void PrintAnswer(bool json, const std::string& json_text, const std::string& text) {
  fmt::print("{}", json ? json_text : text);
}

}  // namespace trammel::app
