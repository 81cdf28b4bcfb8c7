#include "part_alignment/commands/align_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <set>
#include <string>
#include <system_error>
#include <utility>

#include "app/output_files.h"
#include "app/provenance.h"
#include "machine/camera/image_file.h"
#include "measurement/outcome_file.h"
#include "part_alignment/pose/caveats.h"
#include "part_alignment/pose/solution.h"
#include "part_alignment/report/alignment_page.h"
#include "part_alignment/report/alignment_picture.h"
#include "part_alignment/report/alignment_text.h"

namespace trammel::app {
namespace {

namespace fs = std::filesystem;
using part_alignment::Camera;
using part_alignment::PartTarget;
using part_alignment::View;

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

// Of those that counted; 0 without any.
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
    auto read = TRY(machine::ReadImageFile(picture, as_measured));
    frame = std::move(read);
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

/// The views whose pictures a page holds: those with the largest residuals; one without a picture
/// would show grey, and more would make the page too large to be sent.
std::set<std::size_t> ShownViews(const part_alignment::Alignment& alignment,
                                 const std::vector<fs::path>& pictures) {
  constexpr std::size_t kMost = 6;
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
  for (std::size_t i = 0; i < std::min(kMost, views.size()); ++i) shown.insert(views[i].second);
  return shown;
}

}  // namespace

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
    // A drawing is far larger than its PNG: of thousands only the page's are kept.
    if (shown.contains(i)) views.push_back(std::move(figure));
  }
  files.push_back({folder / "report.html", report::AlignmentPage(output, views)});
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) return Fail(fmt::format("{}: {}", folder.string(), error.message()));
  return WriteOutputs(files, force);
}

}  // namespace trammel::app
