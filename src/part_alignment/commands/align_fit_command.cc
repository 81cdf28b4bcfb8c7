// trammel align fit: converts measured points and the ideal part's surfaces to the targets'
// coordinates.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <iterator>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "app/commands.h"
#include "app/slow_work.h"
#include "machine/cad/step_file.h"
#include "machine/net/file_bytes.h"
#include "part_alignment/commands/align_commands.h"
#include "part_alignment/commands/align_outputs.h"
#include "part_alignment/files/part_fit_file.h"
#include "part_alignment/files/stl_file.h"
#include "part_alignment/part_fit/part_fit.h"
#include "part_alignment/report/part_fit_report.h"

namespace trammel::app {
namespace {

std::string Ending(const std::filesystem::path& path) {
  std::string ending = path.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return ending;
}

bool NamesStep(const std::filesystem::path& path) {
  constexpr std::array<std::string_view, 5> kEndings = {".step", ".stp", ".p21", ".stpz", ".stepz"};
  return std::find(kEndings.begin(), kEndings.end(), Ending(path)) != kEndings.end();
}

bool IsStep(const std::filesystem::path& path) {
  constexpr std::size_t kLooked = 4096;
  const auto start = machine::ReadFileStart(path, kLooked);
  return NamesStep(path) ||
         (start &&
          machine::LooksLikeStep({reinterpret_cast<const char*>(start->data()), start->size()}));
}

/// True if the file has a STEP or STL ending.
bool NamesCad(const std::filesystem::path& path) {
  return NamesStep(path) || Ending(path) == ".stl";
}

/// Reads STEP or a mesh, by the first bytes, then the name (machine/cad/step_file.h, ReadMeshFile).
/// Errors (kInput) besides: a STEP file with a given unit (it has its own), or with `open`.
Result<files::MeshFile> ReadCadFile(const std::filesystem::path& path,
                                    const std::optional<files::LengthUnit>& unit, bool open) {
  if (!IsStep(path)) return files::ReadMeshFile(path, unit, open);
  if (unit) {
    return Fail(fmt::format("{}: a STEP file states its unit itself; leave out {}", path.string(),
                            unit->name));
  }
  if (open) {
    return Fail(fmt::format("{}: an open shell is taken from an STL alone; leave out \"open\"",
                            path.string()));
  }
  auto solid = TRY(machine::ReadStepFile(path));
  part_alignment::TriangleMesh mesh;
  mesh.vertices_mm = std::move(solid.vertices_mm);
  mesh.triangles = std::move(solid.triangles);
  mesh.lifts.reserve(solid.lifts.size());
  for (const machine::StepLift& lift : solid.lifts) {
    mesh.lifts.push_back({lift.middle_mm, lift.left_mm});
  }
  auto made =
      files::MakeMeshFile(path, std::move(mesh), false,
                          fmt::format("of {} faces; its unit is {}", solid.faces, solid.unit));
  if (!made) return made;
  for (const std::string& notice : solid.notices) {
    made->notices.push_back(fmt::format("{}: {}", path.filename().string(), notice));
  }
  return made;
}

struct FitArguments {
  std::string points;
  std::string part;
  std::string unit;
  std::optional<double> stock_allowance_mm;
  double min_stock_allowance_mm = 0;
  double target_thickness_mm = 0;
  double target_thickness_sigma_mm = 0;
  AnswerOptions answer;
};

/// Makes a part of a mesh alone: all points are on it, whatever the name of their surface.
Result<files::PartFile> PartOfCad(const FitArguments& arguments,
                                  std::vector<part_alignment::MeasuredPoint>& points) {
  if (!arguments.stock_allowance_mm) {
    return Fail(fmt::format(
        "{} says nothing of stock: --overstock MM is what each point is to have", arguments.part));
  }
  auto mesh = TRY(ReadCadFile(
      arguments.part, arguments.unit.empty() ? std::nullopt : files::LengthUnitOf(arguments.unit),
      false));
  files::PartFile part;
  part.notices = std::move(mesh.notices);
  part.options.min_stock_allowance_mm = arguments.min_stock_allowance_mm;
  part_alignment::IdealSurface surface;
  surface.id = std::filesystem::path(arguments.part).filename().string();
  surface.kind = part_alignment::SurfaceKind::kMesh;
  surface.stock_allowance_mm = *arguments.stock_allowance_mm;
  surface.mesh = std::move(mesh.mesh);
  for (part_alignment::MeasuredPoint& point : points) {
    if (!point.surface.empty()) point.surface = surface.id;
  }
  part.surfaces.push_back(std::move(surface));
  return part;
}

Result<files::PartFile> ReadPart(const FitArguments& arguments,
                                 std::vector<part_alignment::MeasuredPoint>& points) {
  if (NamesCad(arguments.part)) return PartOfCad(arguments, points);
  if (!arguments.unit.empty() || arguments.stock_allowance_mm) {
    return Fail(
        fmt::format("{}: --unit, --overstock and --least-overstock go with an STL or "
                    "a STEP file; this file says so itself",
                    arguments.part));
  }
  return files::ReadPartFile(arguments.part, ReadCadFile);
}

Result<int> RunFit(const FitArguments& arguments) {
  TRY(CheckFree(arguments.answer));
  auto points = TRY(files::ReadPointTable(arguments.points));
  const SlowWork work("fitting the part");
  auto part = TRY(ReadPart(arguments, points));
  const part_alignment::PartFitInput input{std::move(points), std::move(part.surfaces),
                                           std::move(part.bars), part.start};
  part.options.target_thickness_mm = arguments.target_thickness_mm;
  part.options.target_thickness_sigma_mm = arguments.target_thickness_sigma_mm;
  auto fit = part_alignment::FitPart(input, part.options);
  if (!fit) {
    return Fail(
        fmt::format("{} with {}: {}", arguments.points, arguments.part, fit.error().message),
        fit.error().kind);
  }
  fit->notices.insert(fit->notices.begin(), part.notices.begin(), part.notices.end());
  Answer answer{fit->verdict, report::ToJson(input, *fit), report::PartFitText(input, *fit)};
  answer.report = [&] {
    AnswerReport report;
    if (!fit->stock_allowances.empty()) {
      report.figures.push_back(report::StockAllowanceFigure(input, *fit));
    }
    report.page = report::PartFitPage(input, *fit, report.figures);
    return report;
  };
  if (!arguments.answer.out.empty()) answer.files = {{arguments.answer.out, answer.json}};
  return GiveAnswer(arguments.answer, answer);
}

}  // namespace

void AddAlignFitCommand(CLI::App& parent, int& exit_code) {
  CLI::App* command = parent.add_subcommand(
      "fit", "the ideal part in a raw one: stock allowance everywhere, as even as can be");
  const auto arguments = std::make_shared<FitArguments>();
  command->add_option("points", arguments->points, "measured points, CSV or JSON")->required();
  command
      ->add_option("--part", arguments->part,
                   "PART.json: the ideal part's surfaces, scale bars; or its STEP or STL")
      ->required();
  command
      ->add_option("--unit", arguments->unit,
                   "of an STL, which states none (default: mm); a STEP file has its own")
      ->check(CLI::IsMember(std::vector<std::string>(std::begin(files::kLengthUnitNames),
                                                     std::end(files::kLengthUnitNames))));
  command->add_option("--overstock", arguments->stock_allowance_mm,
                      "stock allowance that is wanted on a STEP or an STL, mm");
  command->add_option("--least-overstock", arguments->min_stock_allowance_mm,
                      "the same that every point must have, mm (default: 0)");
  command->add_option("--target-thickness", arguments->target_thickness_mm,
                      "of adhesive targets on the surfaces, mm: subtracted along the normal");
  command->add_option("--target-thickness-sigma", arguments->target_thickness_sigma_mm,
                      "standard uncertainty of it, mm, the same for all targets");
  AddAnswerOptions(*command, arguments->answer, "file for the targets, if the verdict is good",
                   "folder for report.html and the map of stock allowances");
  OnRun(*command, exit_code, [arguments] { return RunFit(*arguments); });
}

}  // namespace trammel::app
