#include "app/align_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

#include "machine/image_file.h"
#include "report/alignment_picture.h"
#include "report/alignment_text.h"
#include "report/part_metrology_figures.h"
#include "store/whole_file.h"

namespace trammel::app {
namespace {

namespace fs = std::filesystem;
using part_alignment::Alignment;
using part_alignment::Camera;
using part_alignment::Measurement;
using part_alignment::PartTarget;
using part_alignment::View;

Camera SolvedCamera(const Measurement& measurement, const part_alignment::Unknowns& solved,
                    const Alignment& alignment) {
  Camera camera = measurement.camera;
  if (solved.focal_length) camera.focal_length_mm = alignment.focal_length_mm;
  if (solved.camera_offset) camera.taper_from_camera.translation_mm = alignment.camera_offset_mm;
  return camera;
}

// Distances outside of those at which the camera was calibrated are extrapolated.
void AddDistanceNotice(const store::AlignmentInput& input, Alignment& alignment) {
  if (!input.calibration || alignment.verdict != Verdict::kGood) return;
  const Camera camera = SolvedCamera(input.measurement, input.unknowns, alignment);
  double nearest_mm = 1e300;
  double farthest_mm = 0;
  for (const View& view : input.measurement.views) {
    for (const part_alignment::Observation& seen : view.observations) {
      for (const PartTarget& target : input.measurement.targets) {
        if (target.id != seen.target) continue;
        const Eigen::Vector3d at_mm = part_alignment::CameraFromPart(
            camera, alignment.clamping, view, alignment.machine_from_part, target.ideal_mm);
        nearest_mm = std::min(nearest_mm, std::abs(at_mm.z()));
        farthest_mm = std::max(farthest_mm, std::abs(at_mm.z()));
      }
    }
  }
  const store::CameraCalibration& known = *input.calibration;
  if (nearest_mm >= known.nearest_mm && farthest_mm <= known.farthest_mm) return;
  alignment.notices.push_back(
      fmt::format("targets were seen from {:.0f} … {:.0f} mm, but the camera was calibrated ({}) "
                  "from {:.0f} to {:.0f} mm: its figures are extrapolated",
                  nearest_mm, farthest_mm, known.date, known.nearest_mm, known.farthest_mm));
}

std::optional<Eigen::Vector2d> Projected(const View& view, const PartTarget& target,
                                         const Measurement& measurement,
                                         const part_alignment::Unknowns& solved,
                                         const Alignment& alignment) {
  if (alignment.verdict != Verdict::kGood) return std::nullopt;
  const Camera camera = SolvedCamera(measurement, solved, alignment);
  const auto pixel = part_alignment::Project(
      camera, part_alignment::CameraFromPart(camera, alignment.clamping, view,
                                             alignment.machine_from_part, target.ideal_mm));
  const bool seen = pixel && pixel->x() >= 0 && pixel->y() >= 0 &&
                    pixel->x() <= camera.width_px - 1 && pixel->y() <= camera.height_px - 1;
  return seen ? pixel : std::nullopt;
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
    }
    if (!one.found_px) {
      one.projected_px =
          Projected(view, target, output.measurement, output.solved, output.alignment);
    }
    if (one.found_px || one.projected_px) drawn.push_back(std::move(one));
  }
  return drawn;
}

Result<report::Figure> DrawView(const report::AlignmentOutput& output, std::size_t number,
                                const fs::path& picture) {
  const Camera& camera = output.measurement.camera;
  Frame frame;
  if (!picture.empty()) {
    auto read = machine::ReadImageFile(picture);
    if (!read) return tl::unexpected(read.error());
    frame = std::move(*read);
    if (frame.width != camera.width_px || frame.height != camera.height_px) {
      return Fail(fmt::format("{} has {} x {} px, the camera {} x {}", picture.string(),
                              frame.width, frame.height, camera.width_px, camera.height_px));
    }
  }
  return report::AlignmentPicture(number, frame.view(), camera.width_px, camera.height_px,
                                  DrawnIn(output, number));
}

}  // namespace

Result<Alignment> SolveInput(const store::AlignmentInput& input,
                             const part_alignment::SolveOptions& options) {
  auto alignment = part_alignment::Solve(input.measurement, options);
  if (alignment) AddDistanceNotice(input, *alignment);
  return alignment;
}

report::AlignmentOutput OutputOf(const store::AlignmentInput& input, Alignment alignment) {
  return {input.measurement, store::NamesOf(input.unknowns), input.unknowns, input.numeric_ids,
          std::move(alignment)};
}

std::optional<Eigen::Vector2d> ProjectedIn(const View& view, const PartTarget& target,
                                           const store::AlignmentInput& input,
                                           const Alignment& alignment) {
  return Projected(view, target, input.measurement, input.unknowns, alignment);
}

Result<void> WriteAlignmentReport(const fs::path& folder, const report::AlignmentOutput& output,
                                  const std::vector<fs::path>& pictures) {
  const std::string text = report::AlignmentText(output);
  std::vector<report::Figure> figures;
  for (std::size_t i = 0; i < output.measurement.views.size(); ++i) {
    auto figure = DrawView(output, i, i < pictures.size() ? pictures[i] : fs::path());
    if (!figure) return tl::unexpected(figure.error());
    figures.push_back(std::move(*figure));
  }
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) return Fail(fmt::format("{}: {}", folder.string(), error.message()));
  const auto write = [&folder](const std::string& name, const std::string& content) {
    return store::WriteWholeFile(folder / name, content);
  };
  if (auto written = write("result.json", report::ToJson(output)); !written) return written;
  if (auto written = write("report.txt", text); !written) return written;
  for (const report::Figure& figure : figures) {
    auto written = write(figure.name + "_residuals.png", figure.canvas.ToPng(figure.png_scale));
    if (!written) return written;
  }
  return write("report.html", report::FigurePage("Where the part is", output.alignment.verdict,
                                                 output.alignment.reason, text, figures));
}

}  // namespace trammel::app
