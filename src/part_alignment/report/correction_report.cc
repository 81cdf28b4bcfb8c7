#include "part_alignment/report/correction_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "base/json_text.h"
#include "document/interval_text.h"
#include "part_alignment/report/answer_page.h"

namespace trammel::report {
namespace {

using Json = nlohmann::ordered_json;
using part_alignment::FixtureCorrection;
using part_alignment::RemainderAt;
using part_alignment::SupportMove;

constexpr int kFormat = 1;

Json PoseJson(const geometry::Pose& pose) {
  return {{"part_mm", List(pose.translation_mm)},
          {"part_angles_rad", List(pose.angles_rad)},
          {"part_angles_mm_per_m", List(pose.angles_rad * kPerMille.scale)}};
}

Json FixtureJson(const FixtureCorrection& fixture) {
  Json supports = Json::array();
  for (const SupportMove& move : fixture.moves) {
    supports.push_back({{"id", move.id},
                        {"shim_mm", move.shim_mm},
                        {"displacement_mm", List(move.displacement_mm)}});
  }
  return {{"rotation_mm_per_m", List(fixture.rotation_rad * kPerMille.scale)},
          {"supports", std::move(supports)},
          {"freedoms_held", fixture.rank},
          {"after", PoseJson(fixture.machine_from_part)}};
}

/// "+0.000, -0.001, +1.010".
std::string Signed(const Eigen::Vector3d& v, int decimals) {
  return fmt::format("{}, {}, {}", NumberText(v.x(), decimals, true),
                     NumberText(v.y(), decimals, true), NumberText(v.z(), decimals, true));
}

std::string FixtureText(const FixtureCorrection& fixture) {
  std::string text =
      fmt::format("fixture    turn the part by {} mm/m about the machine's X, Y, Z\n",
                  Signed(fixture.rotation_rad * kPerMille.scale, 4));
  for (const SupportMove& move : fixture.moves) {
    text += fmt::format("  support {:<18} shim {} mm   (its point is to move {} mm)\n", move.id,
                        NumberText(move.shim_mm, 3, true), Signed(move.displacement_mm, 3));
  }
  constexpr double kMuch_mm = 10;
  constexpr double kMuch_rad = 0.05;
  const bool much =
      fixture.rotation_rad.norm() > kMuch_rad ||
      std::any_of(fixture.moves.begin(), fixture.moves.end(),
                  [](const SupportMove& move) { return std::abs(move.shim_mm) > kMuch_mm; });
  if (much) {
    text +=
        "  this is more than shims are for: does the part lie as the ideal of the supports file "
        "means it?\n";
  }
  return text + fmt::format("  the supports hold {} of 6 freedoms; measure again after shimming\n",
                            fixture.rank);
}

/// Describes the uncertainty of the offset's own axes; the rotation as a slope, because controls
/// differ in its sign.
std::string KnownTo(const CorrectionOutput& output, const Eigen::Matrix<double, 6, 1>& u) {
  const part_alignment::WorkOffset& offset = output.offset.offset;
  std::string text;
  const auto add = [&text](const char* name, double value, double sigma,
                           const IntervalStyle& style) {
    text += fmt::format("{:<10} {} {}\n", text.empty() ? "known to" : "", name,
                        WithInterval(value, NormalInterval95(value, sigma), style));
  };
  add("X", offset.origin_mm.x(), u(0), kMillimetres);
  add("Y", offset.origin_mm.y(), u(1), kMillimetres);
  add("Z", offset.origin_mm.z(), u(2), kMillimetres);
  add("rotation", offset.rotation_z_rad, u(5), kPerMille);
  if (output.after_shims) text += "           the shims' own errors aside: measure again\n";
  return text;
}

std::string Block(const char* label, const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) {
    text += fmt::format("{:<10} {}\n", text.empty() ? label : "", line);
  }
  return text;
}

}  // namespace

std::string ToJson(const CorrectionOutput& output) {
  const part_alignment::OffsetCorrection& offset = output.offset;
  Json points = Json::array();
  for (const RemainderAt& at : offset.remainder) {
    points.push_back({{"id", at.id}, {"error_mm", List(at.error_mm)}});
  }
  Json json = {{"format", kFormat}, {"measured", PoseJson(output.measured)}};
  json["fixture"] = output.fixture ? FixtureJson(*output.fixture) : Json(nullptr);
  json["control"] = part_alignment::ToString(output.control);
  json["work_offset"] = {{"name", output.slot.name},
                         {"after_shims", output.after_shims},
                         {"tilts", output.tilts},
                         {"origin_mm", List(offset.offset.origin_mm)},
                         {"rotation_z_rad", offset.offset.rotation_z_rad},
                         {"set", output.text.set},
                         {"use", output.text.use},
                         {"notes", output.text.notes}};
  json["remainder"] = {{"tilt_mm_per_m", List(offset.tilt_rad * kPerMille.scale)},
                       {"largest_mm", offset.largest_remainder_mm},
                       {"points", std::move(points)}};
  json["notices"] = output.notices;
  return JsonText(json);
}

std::string CorrectionText(const CorrectionOutput& output) {
  std::string text;
  if (output.fixture) text += FixtureText(*output.fixture);
  text += fmt::format("offset     {} of {}, of the part as it {}\n", output.slot.name,
                      part_alignment::ToString(output.control),
                      output.after_shims ? "will lie after the shims" : "lies now");
  text += Block("set", output.text.set) + Block("use", output.text.use);
  if (output.standard_uncertainty) text += KnownTo(output, *output.standard_uncertainty);
  const part_alignment::OffsetCorrection& offset = output.offset;
  text += fmt::format(
      "remainder  tilts of {:+.4f} (about x) and {:+.4f} mm/m (about y): {:.4f} mm at most over "
      "the {} points{}; of each, where the offset puts it less where it is:\n",
      offset.tilt_rad.x() * kPerMille.scale, offset.tilt_rad.y() * kPerMille.scale,
      offset.largest_remainder_mm, offset.remainder.size(),
      output.tilts ? " if the control did not take them" : "");
  for (const RemainderAt& at : offset.remainder) {
    text += fmt::format("  {:<20} {} mm\n", at.id, Signed(at.error_mm, 4));
  }
  return text + Block("note", output.text.notes) + Block("notice", output.notices);
}

}  // namespace trammel::report
