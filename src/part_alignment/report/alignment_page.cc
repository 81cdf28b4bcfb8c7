#include "part_alignment/report/alignment_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "document/interval_text.h"
#include "document/page.h"
#include "part_alignment/correction/control_text.h"
#include "part_alignment/report/alignment_text.h"

namespace trammel::report {
namespace {

namespace pa = part_alignment;

double Sigma(const pa::Alignment& alignment, std::size_t parameter) {
  const auto i = static_cast<Eigen::Index>(parameter);
  if (i >= alignment.covariance.rows()) return NAN;
  return std::sqrt(std::max(0.0, alignment.covariance(i, i)));
}

/// "clamp_angle_rad" -> "clamp angle".
std::string NameOf(std::string parameter) {
  for (const char* unit : {"_mm", "_rad"}) {
    if (parameter.ends_with(unit)) parameter.resize(parameter.rfind('_'));
  }
  std::replace(parameter.begin(), parameter.end(), '_', ' ');
  return parameter;
}

void AddValue(Table& table, const pa::Alignment& alignment, std::size_t parameter, double value) {
  if (parameter >= alignment.parameters.size()) return;
  const std::string& name = alignment.parameters[parameter];
  const IntervalStyle& style = name.ends_with("_rad") ? kPerMille : kMillimetres;
  const Interval interval = NormalInterval95(value, Sigma(alignment, parameter));
  table.Row({NameOf(name), ValueText(value, interval, style), IntervalText(interval, style)});
}

std::string Head(const AlignmentOutput& output) {
  const pa::Alignment& alignment = output.alignment;
  if (alignment.verdict != Verdict::kGood) {
    std::string body = "<p class=\"value\">No place</p>\n";
    body += fmt::format("<p class=\"reason\">{}</p>\n", EscapeHtml(alignment.reason));
    body += fmt::format("<pre>{}</pre>\n",
                        EscapeHtml(ObservabilityText(alignment.observability, alignment.reason)));
    return HeadCard(alignment.verdict, body);
  }
  const Eigen::Vector3d& mm = alignment.machine_from_part.translation_mm;
  const Eigen::Vector3d& rad = alignment.machine_from_part.angles_rad;
  std::string body = fmt::format(
      "<p class=\"value\">X\u00a0{:.3f}, Y\u00a0{:.3f}, Z\u00a0{:.3f}\u00a0mm</p>\n"
      "<p class=\"quiet\">Where the part's origin is in the machine; angles are turns "
      "about the machine's axes, in mm per m.</p>\n",
      mm.x(), mm.y(), mm.z());
  Table table({{""}, {"value"}, {"interval"}});
  const double values[] = {mm.x(), mm.y(), mm.z(), rad.x(), rad.y(), rad.z()};
  for (std::size_t i = 0; i < 6; ++i) AddValue(table, alignment, i, values[i]);
  return HeadCard(alignment.verdict, body + table.Html());
}

std::string LinesOf(const pa::ControlText& text) {
  std::string lines;
  for (const auto* part : {&text.set, &text.use}) {
    for (const std::string& line : *part) lines += line + "\n";
  }
  std::string notes;
  for (const std::string& note : text.notes) {
    notes += fmt::format("<li>{}</li>\n", EscapeHtml(note));
  }
  return fmt::format("<pre>{}</pre>\n{}", EscapeHtml(lines),
                     notes.empty() ? "" : "<ul class=\"quiet\">\n" + notes + "</ul>\n");
}

/// The lines to paste; one control is open, the others on a click.
std::string Next(const AlignmentOutput& output) {
  const pa::Alignment& alignment = output.alignment;
  if (alignment.verdict != Verdict::kGood) {
    return Card(
        "What to do next",
        "<p>Change no offset. Put right what the reason above names, then measure again.</p>\n");
  }
  constexpr std::pair<pa::Control, const char*> kControls[] = {
      {pa::Control::kLinuxCnc, "LinuxCNC"},
      {pa::Control::kSiemens, "Siemens"},
      {pa::Control::kHeidenhain, "Heidenhain"},
      {pa::Control::kFanuc, "Fanuc"}};
  std::string body;
  for (const auto& [control, name] : kControls) {
    const auto slot =
        pa::ParseOffsetSlot(control, control == pa::Control::kHeidenhain ? "1" : "G54");
    if (!slot) continue;
    const auto text = pa::TextFor(control, *slot, alignment.machine_from_part, false);
    if (!text) continue;
    body += fmt::format("<details{}>\n<summary>{}, offset {}</summary>\n{}</details>\n",
                        body.empty() ? " open=\"open\"" : "", name, EscapeHtml(slot->name),
                        LinesOf(*text));
  }
  body +=
      "<p class=\"quiet\">trammel align correct says the same for other offsets, writes "
      "LinuxCNC's, and finds the shims that take a tilt out.</p>\n";
  return Card("The work offset", body);
}

std::string WordsOf(const std::string& input) {
  constexpr std::pair<const char*, const char*> kWords[] = {
      {"all", "all together"},
      {"machine_mm", "repeatability of the machine"},
      {"target_mm", "targets' places on the part"},
      {"targets", "targets' places, with their covariance"},
      {"clamp_angle_rad", "angle of the clamping"},
      {"clamp_eccentricity_mm", "eccentricity of the clamping"},
      {"clamp_tilt_rad", "tilt of the clamping"},
      {"focal_length_mm", "focal length"},
      {"camera_offset_mm", "camera's place in its taper"},
      {"camera", "calibration of the camera"},
      {"pixels", "the pictures alone, all else exact"}};
  for (const auto& [name, words] : kWords) {
    if (input == name) return words;
  }
  return input;
}

std::string SizeOf(const pa::Contribution& part) {
  if (!(part.size > 0)) return "";
  const bool angle = part.input.ends_with("_rad");
  return fmt::format("{:.4f} {}{}", part.size * (angle ? kPerMille.scale : 1),
                     angle ? "mm/m" : "mm", part.usual ? ", not stated" : "");
}

std::string BudgetCard(const AlignmentOutput& output) {
  if (output.contributions.empty()) return "";
  Table table({{"were this exact"}, {"its size (standard uncertainty)"}, {"X"}, {"Y"}, {"Z"}});
  for (const pa::Contribution& part : output.contributions) {
    std::vector<std::string> cells = {WordsOf(part.input), SizeOf(part)};
    for (const double sigma : {part.sigma_mm.x(), part.sigma_mm.y(), part.sigma_mm.z()}) {
      cells.push_back(fmt::format("{:.4f}", kNormal95 * sigma));
    }
    table.Row(cells);
  }
  return Card(
      "What the uncertainty is made of",
      "<p class=\"quiet\">95 % within so many mm of the stated X, Y, Z: as stated in the "
      "first row, then if one contributor were exact; the one that helps most is on top. "
      "\"Not stated\" counts with its usual size, machine and targets with what the residuals "
      "ask for: state your own in "
      "<code>input_uncertainty</code>.</p>\n" +
          table.Html());
}

std::string ViewsCard(std::span<const Figure> views, const PhotoDetail& detail) {
  if (views.empty()) return "";
  std::string body = fmt::format("<p class=\"quiet\">{}</p>\n", EscapeHtml(views.front().caption));
  for (const Figure& figure : views) {
    body += fmt::format("<div class=\"view\">{}</div>\n", DrawingHtml(figure, detail));
  }
  return Card("The views", body);
}

std::string PageOf(const AlignmentOutput& output, std::span<const Figure> views,
                   const PhotoDetail& detail) {
  const pa::Alignment& alignment = output.alignment;
  std::string page = PageBegin("Part alignment", "Where the part is");
  page += Head(output) + Next(output) + ListCard("Worth knowing", alignment.notices);
  page += BudgetCard(output);
  page += Card("",
               "<details>\n<summary>All in words, with the clamping and what the views tell"
               "</summary>\n<pre>" +
                   EscapeHtml(AlignmentText(output)) + "</pre>\n</details>\n");
  page += ViewsCard(views, detail);
  return page + PageEnd();
}

}  // namespace

std::string AlignmentPage(const AlignmentOutput& output, std::span<const Figure> views) {
  return FittingPage([&](std::size_t step) { return PageOf(output, views, kPhotoSteps[step]); });
}

}  // namespace trammel::report
