// Targets that read files: settings, plans, recordings, results, parts.
#include <array>
#include <cmath>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "app/config/config_file.h"
#include "files/foreign_text.h"
#include "files/json_object.h"
#include "fuzz.h"
#include "gcode/dialect.h"
#include "measurement/outcome_file.h"
#include "part_alignment/camera/camera_convert.h"
#include "part_alignment/files/alignment_file.h"
#include "part_alignment/files/alignment_result.h"
#include "part_alignment/files/board_file.h"
#include "part_alignment/files/camera_file.h"
#include "part_alignment/files/foreign_camera_file.h"
#include "part_alignment/files/part_fit_file.h"
#include "part_alignment/files/stl_file.h"
#include "part_alignment/files/survey_file.h"
#include "part_alignment/mesh/facet_error.h"
#include "part_alignment/mesh/solid_mesh.h"
#include "pressure_advance/files/plan_file.h"
#include "pressure_advance/files/recording.h"
#include "pressure_advance/files/slicer_gcode.h"
#include "pressure_advance/pattern/pattern.h"
#include "session/run_journal.h"
#include "settings/material.h"
#include "sim/print/plan_file.h"
#include "tap/analyse/analyse.h"
#include "tap/files/moves_from_z.h"
#include "tap/files/tap_csv.h"
#include "tap/files/tap_file.h"
#include "tool_offset/files/offset_files.h"
#include "tool_offset/original/original_sheet.h"
#include "tool_offset/sheet/sheet_comments.h"
#include "tool_offset/sheet/sheet_gcode.h"
#include "tool_offset/sheet/sheet_temperatures.h"

namespace trammel::fuzz {
namespace {

/// Reads the input as a file of that name. `read` gives a Result of a path.
template <class Read>
auto ReadFile(const std::string& name, std::string_view text, Read read) {
  static std::map<std::string, MemoryFile> files;  // making one for each input would take long
  const MemoryFile& file = files.try_emplace(name, name).first->second;
  file.Write(text);
  auto value = read(file.path());
  (void)Good(value);
  return value;
}

/// Requires that what `write` gives is read as it was written.
template <class Value, class Write, class Read>
void RequireSameAgain(const Value& value, Write write, Read read) {
  const std::string written = write(value);
  const auto again = read(written);
  Require(Good(again), "what was written can be read");
  Require(write(*again) == written, "it reads back as it was written");
}

// FILE_TARGET(name, file's name, expression of its `path`): there is a value or an error fit to be
// read.
#define FILE_TARGET(target, name, ...)                                                         \
  FUZZ_TARGET(target)(std::string_view text) {                                                 \
    (void)ReadFile(name, text, [](const std::filesystem::path& path) { return __VA_ARGS__; }); \
  }

FILE_TARGET(alignment_result, "result.json", files::ReadAlignmentResult(path))
FILE_TARGET(board_file, "board.json", files::ReadBoardFile(path))
FILE_TARGET(budget_file, "scene.json", files::ReadBudgetFile(path))
FILE_TARGET(calibration_grid_file, "grid.json", files::ReadCalibrationGrid(path))
FILE_TARGET(offset_file, "result.json", files::ReadOffsetFile(path))
FILE_TARGET(offset_history, "offsets.jsonl", files::ReadOffsetChanges(path))
FILE_TARGET(part_file, "part.json", files::ReadPartFile(path, files::ReadMeshFile))
FILE_TARGET(pattern_prints, "patterns.jsonl",
            files::LastPatternPrint(path, "voron", files::PrintsFor::kEither))
FILE_TARGET(slicer_gcode, "plate.gcode", files::ReadSlicerGcode(path))
FILE_TARGET(start_file, "start.json", files::ReadStart(path.parent_path()))
FILE_TARGET(supports_file, "supports.json", files::ReadSupportsFile(path))
FILE_TARGET(scale_bar_file, "part.json", files::ReadScaleBarFile(path))
FILE_TARGET(survey_file, "survey.json", files::ReadSurveyFile(path))

// Observations of a part, with and without views.
FUZZ_TARGET(alignment_file)(std::string_view text) {
  const auto read = [](std::string_view json) {
    return ReadFile("observations.json", json,
                    [](const auto& path) { return files::ReadAlignmentFile(path, 0); });
  };
  (void)ReadFile("observations.json", text,
                 [](const auto& path) { return files::ReadAlignmentFile(path); });
  if (const auto input = read(text)) RequireSameAgain(*input, files::AlignmentFileText, read);
}

// A camera and its calibration.
FUZZ_TARGET(camera_file)(std::string_view text) {
  const auto read = [](std::string_view json) {
    return ReadFile("camera.json", json, files::ReadCameraFile);
  };
  if (const auto camera = read(text)) RequireSameAgain(*camera, files::CameraFileText, read);
}

// Cameras of OpenCV, ROS and mrcal.
FUZZ_TARGET(foreign_camera_file)(std::string_view text) {
  (void)Good(files::ParseForeignCamera(text, "camera"));
}

// Python's literals, plain YAML and plain XML, as other programs write cameras.
FUZZ_TARGET(foreign_text)(std::string_view text) {
  (void)Good(files::ParseLiteral(text, "camera"));
  (void)Good(files::ParsePlainYaml(text, "camera.yaml"));
  (void)Good(files::ParsePlainXml(text, "camera.xml"));
}

// The strict reader of JSON that all files share.
FUZZ_TARGET(json_file)(std::string_view text) {
  const auto json = files::ParseJson(text, "file.json");
  if (!Good(json)) return;
  files::JsonObject object(*json, "file.json");
  (void)object.Number("number", {-1, 1}, 0);
  (void)object.Integer("integer", {0, 100});
  (void)object.Text("text");
  (void)object.OptionalChoice("choice", {"one", "other"});
  (void)object.Numbers("numbers", 0, 10);
  (void)object.OptionalNumbers("some", 0, 10);
  (void)Good(object.Finish());
  Require(files::Show(*json).size() <= 60, "a value that is shown is short");
}

// The G-code of the original generator's sheet.
FUZZ_TARGET(original_sheet)(std::string_view text) {
  const auto sheet = tool_offset::ReadOriginalGcode(text);
  if (!Good(sheet)) return;
  Require(Good(Validate(*sheet)), "a sheet that was read is valid");
  const tool_offset::SheetPlan plan = PlanOriginal(*sheet);
  Require(plan.structures.size() == 4 * sheet->tools.size(), "each pair has four structures");
  Require(!plan.notices.empty(), "a notice names that the identity is not checked");
}

// {name} in the user's own G-code.
FUZZ_TARGET(placeholders)(std::string_view text) {
  const std::array<gcode::Placeholder, 2> known = {{{"bed", "60"}, {"a", "{bed}"}}};
  (void)Good(gcode::ExpandPlaceholders(text, known));
}

// plan.json beside a pressure-advance pattern, as the analysis and as the virtual shop read it.
FUZZ_TARGET(plan_file)(std::string_view text) {
  (void)Good(sim::ParsePlan(text));
  const auto read = [](std::string_view json) { return files::ParsePlan(json, "plan.json"); };
  const auto plan = read(text);
  if (Good(plan)) RequireSameAgain(*plan, files::FormatPlan, read);
}

// Measured points as tables or as JSON.
FUZZ_TARGET(point_table)(std::string_view text) {
  (void)Good(files::ParsePointTable(text, "points.csv"));
  (void)ReadFile("points.json", text, files::ReadPointTable);
}

void PrintPattern(const files::Config& config, std::string_view text) {
  if (!Good(files::ValidateConfig(config, text, "trammel.toml"))) return;
  if (settings::FindTemperatureProblem(config.pattern)) return;
  const auto layout = pressure_advance::LayOut(config.pattern);
  (void)pressure_advance::Summarise(layout, config.pattern);
  Require(!pressure_advance::WriteGcode(layout, config.pattern).empty(), "a file is written");
  const auto plan = pressure_advance::MakePlan(layout, config.pattern, "pattern.gcode");
  const std::string written = files::FormatPlan(plan);
  Require(Good(files::ParsePlan(written, "plan.json")), "a plan of ours can be read");
  Require(Good(sim::ParsePlan(written)), "by the virtual print shop, too");
}

void PrintSheet(const tool_offset::SheetSettings& settings) {
  if (tool_offset::FindProblem(settings) || tool_offset::FindTemperatureProblem(settings)) return;
  (void)tool_offset::FindWarnings(settings);
  const auto gcode = tool_offset::WriteSheetGcode(tool_offset::PlanSheet(settings));
  Require(Good(tool_offset::ReadSheetFile(gcode.text)), "a sheet of ours can be read");
}

// Path from trammel.toml to the print: every valid configuration can be laid out, written as G-code
// and read back.
FUZZ_TARGET(printed_settings)(std::string_view text) {
  const auto config = files::ParseConfig(text, "trammel.toml");
  if (!Good(config)) return;
  PrintPattern(*config, text);
  PrintSheet(files::SheetOf(*config));
}

// A kept result, read again to be applied.
FUZZ_TARGET(result_file)(std::string_view text) {
  const auto outcome = files::ParseOutcome(text, "result.json");
  if (outcome) (void)Good(files::ParseOutcome(files::ToJson(*outcome), "again.json"));
}

// Notes of a run for restoring a printer.
FUZZ_TARGET(run_journal)(std::string_view text) {
  static const MemoryFile file("run.journal");
  file.Write(text);
  const auto journal = files::ReadJournal(file.path());
  if (!Good(journal) || !*journal) return;
  Require(files::IsRunName((*journal)->run), "a run has a name that can stand anywhere");
  Require(Good(files::WriteJournal(file.path(), **journal)), "it can be written");
  const auto again = files::ReadJournal(file.path());
  Require(Good(again) && *again, "a journal that was written can be read");
  Require((*again)->before == (*journal)->before && (*again)->given == (*journal)->given,
          "a journal reads back as it was written");
}

// scan.json, the file of a laser's recording.
FUZZ_TARGET(scan_file)(std::string_view text) {
  const auto read = [](std::string_view json) {
    return files::ParseScan(std::string(json), "scan.json");
  };
  const auto write = [](const auto& scan) { return files::FormatScan(scan, nullptr); };
  const auto scan = read(text);
  if (Good(scan)) RequireSameAgain(*scan, write, read);
}

// trammel.toml and --set.
FUZZ_TARGET(settings_file)(std::string_view text) {
  const auto parts = Parts(text, 2);
  auto config = files::ParseConfig(parts[0], "trammel.toml");
  if (!Good(config)) return;
  (void)Good(files::OverrideConfig(parts[1], *config, "scan"));
  if (!Good(files::ValidateConfig(*config, parts[0], "trammel.toml"))) return;
  (void)files::SheetOf(*config);
}

// The settings of a sheet, read back from its G-code.
FUZZ_TARGET(sheet_file)(std::string_view text) {
  const auto write = [](const auto& settings) {
    return tool_offset::FormatSheetComments(tool_offset::PlanSheet(settings));
  };
  const auto settings = tool_offset::ReadSheetFile(text);
  if (Good(settings)) RequireSameAgain(*settings, write, tool_offset::ReadSheetFile);
}

// A part's surface as triangles: whatever is read gives finite distances or an error.
FUZZ_TARGET(stl_file)(std::string_view text) {
  auto mesh = files::ParseStl(text, "part.stl", 1);
  if (!Good(mesh)) return;
  for (const bool open : {false, true}) {
    auto solid = part_alignment::MakeSolid(*mesh, open);
    if (!Good(solid)) continue;
    const part_alignment::MeshDistance distance(std::move(*solid));
    for (const Eigen::Vector3d& at :
         {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1, 2, 3), Eigen::Vector3d(-1e5, 7, 0)}) {
      const auto found = distance.At(at);
      Require(std::isfinite(found.mm) && found.outward.allFinite(), "distances are finite");
      const auto error = part_alignment::FacetErrorOf(distance, found.triangle);
      Require(std::isfinite(error.either_mm()), "a facet's error is finite");
    }
  }
}

// Recorded taps as tables, their moves beside them or derived from z.
FUZZ_TARGET(tap_csv)(std::string_view text) {
  const auto parts = Parts(text, 2);
  auto tap = files::ParseTapCsv(parts[0], "tap.csv");
  if (!Good(tap)) return;
  Require(tap->time_s.size() == tap->force_g.size(), "each sample has a time and a force");
  Require(tap->z_mm.empty() || tap->z_mm.size() == tap->time_s.size(), "or a z, too");
  (void)files::MovesFromZ(tap->time_s, tap->z_mm);
  (void)Good(files::ParseMovesCsv(parts[1], "tap.moves.csv", *tap));
}

// Recorded taps as JSON or JSON lines, and what the analysis makes of whatever they hold.
FUZZ_TARGET(tap_json)(std::string_view text) {
  const auto taps = files::ParseTaps(text, "taps.json");
  if (!Good(taps)) return;
  Require(!taps->empty(), "a file that can be read holds a tap");
  for (const tap::Recording& recording : *taps) {
    for (const tap::Method method : {tap::Method::kContact, tap::Method::kTwoLine}) {
      tap::TapOptions options;
      options.method = method;
      const tap::TapAnalysis result = tap::TapAnalyser(options).Analyse(recording.View());
      Require((result.verdict == Verdict::kGood) == std::isfinite(result.contact_mm.value),
              "a tap has a contact exactly where its verdict is good");
    }
  }
}

// sweeps.json, where a scan ended before any frame was placed.
FUZZ_TARGET(unplaced_recording)(std::string_view text) {
  static const MemoryFile file("sweeps.json");
  file.Write(text);
  const auto why = files::UnplacedRecording(file.path().parent_path());
  Require(why.has_value(), "of a folder with sweeps.json it is said why it has no scan.json");
  RequireMessage(*why);
}

}  // namespace
}  // namespace trammel::fuzz
