#include "part_alignment/commands/align_outputs.h"

#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <iterator>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "app/commands.h"
#include "app/provenance.h"
#include "base/json_text.h"
#include "document/interval_text.h"
#include "files/new_file.h"
#include "machine/camera/image_file.h"
#include "measurement/outcome_file.h"
#include "part_alignment/files/alignment_result.h"
#include "part_alignment/pose/solve.h"
#include "part_alignment/report/alignment_page.h"
#include "part_alignment/report/alignment_report.h"

namespace trammel::app {
namespace {

namespace fs = std::filesystem;
using part_alignment::Alignment;
using part_alignment::Camera;
using part_alignment::PartTarget;
using part_alignment::View;

Measured MeasuredOf(const Alignment& alignment, const report::SolvedParameter& parameter) {
  if (alignment.verdict == Verdict::kRefused) return Measured::Refused(alignment.reason);
  if (alignment.verdict == Verdict::kCannotTell) return Measured::CannotTell(alignment.reason);
  TRAMMEL_CHECK(std::isfinite(parameter.sigma), "no variance of {}", parameter.name);
  return Measured::Good({parameter.value, parameter.sigma, parameter.interval95()});
}

std::vector<report::DrawnTarget> DrawnIn(const report::AlignmentOutput& output,
                                         std::size_t number) {
  const View& view = output.measurement.views[number];
  std::vector<report::DrawnTarget> drawn;
  for (const PartTarget& target : output.measurement.targets) {
    report::DrawnTarget one{target.id, {}, {}, false};
    for (const part_alignment::Observation& seen : view.observations) {
      if (seen.target == target.id) one.found_px = {seen.column_px, seen.row_px};
    }
    for (const part_alignment::AlignmentResidual& residual : output.alignment.residuals) {
      if (!one.found_px || residual.view != number || residual.target != target.id) continue;
      one.projected_px = *one.found_px - Eigen::Vector2d(residual.column_px, residual.row_px);
      one.left_out = residual.weight == 0;
      one.sigma_px = residual.sigma_px;
    }
    if (!one.found_px && output.alignment.verdict == Verdict::kGood) {
      one.projected_px =
          part_alignment::ImageOf(output.measurement, output.alignment, view, target);
    }
    if (one.found_px || one.projected_px) drawn.push_back(std::move(one));
  }
  return drawn;
}

// Returns the RMS of the observations that counted; 0 without any.
double ResidualRms_px(const part_alignment::Alignment& alignment) {
  double squares = 0;
  int count = 0;
  for (const part_alignment::AlignmentResidual& residual : alignment.residuals) {
    if (residual.weight == 0) continue;
    squares += residual.column_px * residual.column_px + residual.row_px * residual.row_px;
    ++count;
  }
  return count > 0 ? std::sqrt(squares / count) : 0;
}

Result<report::Figure> DrawView(const report::AlignmentOutput& output, std::size_t number,
                                const fs::path& picture) {
  const Camera& camera = output.measurement.camera;
  Frame frame;
  if (!picture.empty()) {
    machine::ImageReadOptions as_measured;
    as_measured.reduce_above_px = as_measured.most_pixels;
    frame = TRY(machine::ReadImageFile(picture, as_measured));
    if (frame.width != camera.width_px || frame.height != camera.height_px) {
      return Fail(fmt::format("{} has {} x {} px, the camera {} x {}", picture.string(),
                              frame.width, frame.height, camera.width_px, camera.height_px));
    }
  }
  return report::AlignmentPicture(number, frame.view(), camera.width_px, camera.height_px,
                                  DrawnIn(output, number),
                                  report::ResidualEnlargement(ResidualRms_px(output.alignment),
                                                              camera.width_px, camera.height_px));
}

/// Selects the views whose pictures a page shows: those with the largest residuals. A view without
/// a picture would be grey, and more would make the page too large to send.
std::set<std::size_t> ShownViews(const part_alignment::Alignment& alignment,
                                 const std::vector<fs::path>& pictures) {
  constexpr std::size_t kMax = 6;
  std::vector<std::pair<double, std::size_t>> views;
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    if (pictures[i].empty()) continue;
    double worst = 0;
    for (const part_alignment::AlignmentResidual& residual : alignment.residuals) {
      if (residual.view != i || !(residual.sigma_px > 0)) continue;
      worst = std::max(worst, std::hypot(residual.column_px, residual.row_px) / residual.sigma_px);
    }
    views.emplace_back(-worst, i);
  }
  std::sort(views.begin(), views.end());
  std::set<std::size_t> shown;
  for (std::size_t i = 0; i < std::min(kMax, views.size()); ++i) shown.insert(views[i].second);
  return shown;
}

Result<void> MakeReportFolder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) return Fail(fmt::format("--report {}: {}", folder.string(), error.message()));
  return {};
}

}  // namespace

void OnRun(CLI::App& command, int& exit_code, std::function<Result<int>()> run) {
  command.callback([&exit_code, run = std::move(run)] {
    const auto code = run();
    exit_code = code ? *code : PrintError(code.error());
  });
}

void AddAnswerOptions(CLI::App& command, AnswerOptions& options, const std::string& out_help,
                      const std::string& report_help) {
  command.add_option("-o,--out", options.out, out_help);
  command.add_option("--report", options.report, report_help);
  command.add_flag("--json", options.json, "one JSON object instead of text");
  command.add_flag("--force", options.force, "overwrite files");
}

Result<void> CheckFree(const AnswerOptions& options, const std::vector<std::string>& others) {
  std::vector<fs::path> paths;
  if (!options.out.empty()) paths.emplace_back(options.out);
  if (!options.report.empty()) paths.push_back(fs::path(options.report) / "report.html");
  for (const std::string& other : others) {
    if (!other.empty()) paths.emplace_back(other);
  }
  return RefuseToOverwrite(paths, options.force);
}

Result<int> GiveAnswer(const AnswerOptions& options, const Answer& answer) {
  fmt::print("{}", options.json ? answer.json : answer.text);
  if (!options.report.empty()) {
    const AnswerReport report = answer.report();
    const fs::path folder(options.report);
    TRY(MakeReportFolder(folder));
    std::vector<OutputFile> files = {{folder / "report.html", report.page}};
    for (const report::Figure& figure : report.figures) {
      files.push_back({folder / (figure.name + ".png"), figure.canvas.ToPng(figure.png_scale)});
      files.push_back({folder / (figure.name + ".svg"), figure.canvas.ToSvg()});
    }
    TRY(WriteOutputs(files, options.force));
  }
  if (answer.verdict != Verdict::kGood) return kExitNotTrusted;
  TRY(WriteOutputs(answer.files, options.force));
  return kExitGood;
}

void PrintAlignment(const report::AlignmentOutput& output, const ResultFile& result, bool json,
                    const std::string& kept) {
  const bool terminal = !json && isatty(STDOUT_FILENO) != 0;
  if (!terminal) std::fputs(JsonText(result.details).c_str(), stdout);
  if (json) return;
  std::fputs(report::AlignmentText(output).c_str(), terminal ? stdout : stderr);
  if (!terminal) return;
  fmt::print("JSON       {}\n", kept.empty() ? "with --json; -o FILE keeps it" : "in " + kept);
  std::fflush(stdout);
}

ResultFile ResultOf(const report::AlignmentOutput& output, std::string source) {
  measurement::Outcome outcome;
  outcome.provenance = ProvenanceOf(measurement::Instrument::kPartAlignment, {std::move(source)});
  constexpr std::size_t kPose = files::kPoseAnswers.size();
  for (const report::SolvedParameter& parameter : report::SolvedParameters(output)) {
    const std::size_t i = outcome.answers.size();
    const std::size_t unit = parameter.name.rfind('_');
    outcome.answers.push_back(
        {i < kPose ? std::string(files::kPoseAnswers.at(i)) : parameter.name.substr(0, unit),
         parameter.name.substr(unit + 1), MeasuredOf(output.alignment, parameter)});
  }
  outcome.notices = output.alignment.notices;
  return {std::move(outcome), report::JsonOf(output)};
}

part_alignment::SolveOptions SolveOptionsOf(const files::AlignmentInput& input) {
  part_alignment::SolveOptions options;
  options.unknowns = input.unknowns;
  options.inputs = input.inputs;
  options.target_covariance = input.target_covariance;
  if (input.calibration) options.camera_covariance = input.calibration->covariance;
  return options;
}

report::AlignmentOutput OutputOf(const files::AlignmentInput& input,
                                 part_alignment::Alignment alignment) {
  auto caveats = part_alignment::Caveats(input.measurement, SolveOptionsOf(input), alignment,
                                         input.calibration, Today());
  alignment.notices.insert(alignment.notices.end(), std::make_move_iterator(caveats.begin()),
                           std::make_move_iterator(caveats.end()));
  report::AlignmentOutput output{input.measurement, files::NamesOf(input.unknowns), input.unknowns,
                                 input.numeric_ids, std::move(alignment)};
  output.contributions =
      part_alignment::ContributionsOf(input.measurement, SolveOptionsOf(input), output.alignment);
  return output;
}

Result<void> WriteAlignmentReport(const fs::path& folder, const report::AlignmentOutput& output,
                                  const ResultFile* result, const std::vector<fs::path>& pictures,
                                  bool force) {
  std::vector<OutputFile> files = {{folder / "report.txt", report::AlignmentText(output)}};
  if (result != nullptr) files.push_back(OutputOf(folder / files::kResultFile, *result));
  const std::set<std::size_t> shown = ShownViews(output.alignment, pictures);
  std::vector<report::Figure> views;
  for (std::size_t i = 0; i < output.measurement.views.size(); ++i) {
    auto figure = TRY(DrawView(output, i, i < pictures.size() ? pictures[i] : fs::path()));
    files.push_back(
        {folder / (figure.name + "_residuals.png"), figure.canvas.ToPng(figure.png_scale)});
    // A drawing is far larger than its PNG: of thousands only the page's are stored.
    if (shown.contains(i)) views.push_back(std::move(figure));
  }
  files.push_back({folder / "report.html", report::AlignmentPage(output, views)});
  TRY(MakeReportFolder(folder));
  return WriteOutputs(files, force);
}

namespace fs = std::filesystem;

AlignmentRecord::AlignmentRecord(fs::path parent, files::AlignmentInput plan)
    : parent_(std::move(parent)), input_(std::move(plan)) {
  input_.pictures.clear();
}

Result<void> AlignmentRecord::CheckPlace() const {
  std::error_code error;
  if (!fs::is_directory(parent_, error)) {
    return Fail(fmt::format("{} is no folder; the pictures are to be kept there: make it",
                            parent_.string()));
  }
  if (access(parent_.c_str(), W_OK | X_OK) != 0) {
    return Fail(fmt::format("{} cannot be written to; the pictures are to be kept there",
                            parent_.string()));
  }
  return {};
}

Result<void> AlignmentRecord::MakeFolder() {
  if (!folder_.empty()) return {};
  const std::string name = app::RecordingName(measurement::Instrument::kPartAlignment);
  std::error_code error;
  constexpr int kMax = 100;
  for (int i = 1; i <= kMax; ++i) {
    const fs::path folder = parent_ / (i == 1 ? name : fmt::format("{}-{}", name, i));
    const bool made = fs::create_directory(folder, error);
    if (error) break;
    if (!made) continue;
    folder_ = folder;
    return {};
  }
  return Fail(fmt::format("no folder for the pictures can be made in {}: {}", parent_.string(),
                          error ? error.message() : "too many are there"));
}

Result<std::string> WritePicture(const fs::path& folder, std::size_t view,
                                 const machine::CapturedFrame& picture) {
  constexpr std::uint8_t kPngBegins = 0x89;
  const bool png = !picture.image.empty() && picture.image.front() == kPngBegins;
  std::string name = fmt::format("view-{:02}.{}", view + 1, png ? "png" : "jpg");
  const std::string_view bytes(reinterpret_cast<const char*>(picture.image.data()),
                               picture.image.size());
  TRY(files::WriteWholeFile(folder / name, bytes, files::IfThere::kReplace));
  return name;
}

Result<void> AlignmentRecord::KeepPicture(std::size_t view, const machine::CapturedFrame& picture) {
  TRY(MakeFolder());
  auto name = TRY(WritePicture(folder_, view, picture));
  input_.pictures.resize(std::max(input_.pictures.size(), view + 1));
  input_.pictures[view] = std::move(name);
  return {};
}

Result<void> AlignmentRecord::KeepObservations(const part_alignment::Measurement& so_far) {
  TRY(MakeFolder());
  input_.measurement = so_far;
  return files::WriteWholeFile(folder_ / "observations.json", files::AlignmentFileText(input_),
                               files::IfThere::kReplace);
}

Error AlignmentRecord::Stopped(const Error& error, const std::vector<std::string>& notices) const {
  if (folder_.empty()) return error;
  std::string text = error.message + "\n";
  for (const std::string& notice : notices) text += notice + "\n";
  // The first error counts; a full disk was probably its cause.
  const auto written =
      files::WriteWholeFile(folder_ / "stopped.txt", text, files::IfThere::kReplace);
  return {error.kind,
          fmt::format("{}; pictures taken ({}) and what was seen in them are kept in {}{}",
                      error.message, input_.pictures.size(), folder_.string(),
                      written ? "" : " (" + written.error().message + ")")};
}

std::vector<fs::path> AlignmentRecord::pictures() const {
  std::vector<fs::path> paths;
  for (const std::string& name : input_.pictures) {
    paths.push_back(name.empty() ? fs::path() : folder_ / name);
  }
  return paths;
}

}  // namespace trammel::app
