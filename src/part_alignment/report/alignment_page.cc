#include "part_alignment/report/alignment_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "document/canvas.h"
#include "document/interval_text.h"
#include "document/page.h"
#include "document/plot.h"
#include "part_alignment/correction/control_text.h"
#include "part_alignment/report/alignment_report.h"

namespace trammel::report {
namespace {

namespace pa = part_alignment;

constexpr double kMaxSide_px = 800;
constexpr double kUsual_px = 27;     // drawn length of an RMS residual
constexpr double kLongest_px = 150;  // of a residual's line
constexpr double kKeyRow_px = 20;
constexpr Color kFound = kSky;
constexpr Color kProjected = kVermilion;

bool IsBroad(const Canvas& canvas) { return canvas.width_px() >= kMaxSide_px; }
double Circle_px(const Canvas& canvas) { return IsBroad(canvas) ? 14 : 9; }
double Arm_px(const Canvas& canvas) { return IsBroad(canvas) ? 6 : 4; }

void Cross(const PointPx& at, const Stroke& stroke, Canvas& canvas) {
  const double arm = Arm_px(canvas);
  const std::array<PointPx, 2> across{PointPx{at.x - arm, at.y}, PointPx{at.x + arm, at.y}};
  const std::array<PointPx, 2> down{PointPx{at.x, at.y - arm}, PointPx{at.x, at.y + arm}};
  canvas.Polyline(across, stroke);
  canvas.Polyline(down, stroke);
}

// Draws dark letters on a light patch, legible on any ground.
void Label(const PointPx& at, const std::string& text, Canvas& canvas) {
  const TextStyle style{12, kInk, Align::kStart, true};
  const double width = canvas.TextWidth(text, style);
  const double room = canvas.width_px() - width - 4;
  const PointPx from{std::clamp(at.x, 4.0, std::max(4.0, room)), std::max(at.y, 16.0)};
  canvas.FillRect({from.x - 3, from.y - 12, width + 6, 16}, Color{1, 1, 1, 0.8});
  canvas.Text(from, text, style);
}

struct Drawing {
  double scale = 1;  // px of the canvas per px of the camera
  double enlarged = 1;
};

void DrawResidual(const DrawnTarget& target, const PointPx& at, const Drawing& drawing,
                  Canvas& canvas) {
  const Eigen::Vector2d residual_px = *target.found_px - *target.projected_px;
  const double px_per_px = drawing.enlarged * drawing.scale;
  if (target.sigma_px > 0) {
    // White dashes on a dark ring: visible on any ground.
    const double radius_px = std::min(kLongest_px, target.sigma_px * px_per_px);
    Stroke ring{kPaper, 1.5};
    ring.dash_px = {3, 2};
    canvas.Circle(at, radius_px, std::nullopt, Stroke{WithAlpha(kInk, 0.6), 1.5});
    canvas.Circle(at, radius_px, std::nullopt, ring);
  }
  const double norm_px = residual_px.norm();
  if (!(norm_px > 0)) return;
  const Eigen::Vector2d end = residual_px / norm_px * std::min(kLongest_px, norm_px * px_per_px);
  const std::array<PointPx, 2> line{at, PointPx{at.x + end.x(), at.y + end.y()}};
  canvas.Polyline(line, Stroke{kProjected, 2.5});
}

std::string ResidualText(const DrawnTarget& target) {
  const Eigen::Vector2d residual_px = *target.found_px - *target.projected_px;
  return fmt::format("  {:+.2g}, {:+.2g} px", residual_px.x(), residual_px.y()) +
         (target.sigma_px > 0 ? fmt::format(" (standard uncertainty {:.2g})", target.sigma_px)
                              : "");
}

void DrawTarget(const DrawnTarget& target, const Drawing& drawing, Canvas& canvas) {
  // The canvas begins at the first pixel's corner, half a pixel before its centre.
  const auto place = [&drawing](const Eigen::Vector2d& px) {
    return PointPx{(px.x() + 0.5) * drawing.scale, (px.y() + 0.5) * drawing.scale};
  };
  std::string text = target.id;
  if (target.found_px) {
    const Stroke edge{target.left_out ? kProjected : kFound, 2};
    canvas.Circle(place(*target.found_px), Circle_px(canvas), std::nullopt, edge);
    if (target.left_out) text += ", left out";
  } else {
    text += ", not found";
  }
  if (target.projected_px) {
    Stroke stroke{kProjected, 1.5};
    if (!target.found_px) stroke.dash_px = {2, 2};
    Cross(place(*target.projected_px), stroke, canvas);
  }
  if (target.found_px && target.projected_px) {
    DrawResidual(target, place(*target.projected_px), drawing, canvas);
    if (IsBroad(canvas)) text += ResidualText(target);
  }
  const PointPx at = place(target.found_px ? *target.found_px : *target.projected_px);
  Label({at.x + Circle_px(canvas) + 4, at.y - Circle_px(canvas)}, text, canvas);
}

// Draws the key of the marks, and the length of a round residual; in three rows on a phone.
void DrawKey(std::size_t view, double top, const Drawing& drawing, Canvas& canvas) {
  constexpr double kGap_px = 18;
  constexpr double kLeft_px = 8;
  const TextStyle style{.size_px = 12};
  double baseline = top + kKeyRow_px;
  double x = kLeft_px;
  const auto new_row = [&] {
    if (IsBroad(canvas)) return;
    baseline += kKeyRow_px;
    x = kLeft_px;
  };
  const auto words = [&](const std::string& text, const TextStyle& how) {
    canvas.Text({x, baseline}, text, how);
    x += canvas.TextWidth(text, how) + kGap_px;
  };
  words(fmt::format("View {}", view + 1), {.size_px = 13, .bold = true});
  canvas.Circle({x + 7, baseline - 4}, 7, std::nullopt, Stroke{kFound, 2});
  x += 20;
  words("found", style);
  const double arm = Arm_px(canvas);
  Cross({x + arm, baseline - 4}, Stroke{kProjected, 1.5}, canvas);
  x += 2 * arm + 6;
  words("projected", style);
  new_row();
  constexpr double kLongestKey_px = 60;
  x = DrawScaleKey(canvas, {x, baseline}, drawing.enlarged * drawing.scale, kLongestKey_px, "px",
                   Stroke{kProjected, 2.5});
  x += 6;
  words(fmt::format("of residual ({:g} times enlarged)", drawing.enlarged), style);
  new_row();
  Stroke ring{kMuted, 1.5};
  ring.dash_px = {3, 2};
  canvas.Circle({x + 7, baseline - 4}, 7, std::nullopt, ring);
  x += 20;
  words("its standard uncertainty", style);
}

Canvas Draw(std::size_t view, const BgrView& picture, int width_px, int height_px,
            const std::vector<DrawnTarget>& targets, double enlarged, double side_px) {
  const Drawing drawing{side_px / std::max(width_px, height_px), enlarged};
  const RectPx area{0, 0, std::ceil(width_px * drawing.scale),
                    std::ceil(height_px * drawing.scale)};
  const double key_px = kKeyRow_px * (side_px >= kMaxSide_px ? 1 : 3) + 10;
  Canvas canvas(side_px, area.height + key_px);
  if (picture.width > 0 && picture.height > 0) {
    canvas.Image(picture, area, Pixels::kPhoto);
  } else {
    canvas.FillRect(area, kGrid);
  }
  canvas.Clip(area);
  for (const DrawnTarget& target : targets) {
    if (target.found_px || target.projected_px) DrawTarget(target, drawing, canvas);
  }
  canvas.Unclip();
  DrawKey(view, area.height, drawing, canvas);
  return canvas;
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
  std::string body = fmt::format(
      "<p class=\"value\">X\u00a0{:.3f}, Y\u00a0{:.3f}, Z\u00a0{:.3f}\u00a0mm</p>\n"
      "<p class=\"quiet\">Where the part's origin is in the machine; angles are turns "
      "about the machine's axes, in mm per m.</p>\n",
      mm.x(), mm.y(), mm.z());
  Table table({{""}, {"value"}, {"interval"}});
  constexpr std::size_t kPose = 6;
  auto pose = SolvedParameters(output);
  pose.resize(kPose);
  for (const SolvedParameter& one : pose) {
    const Interval interval = one.interval95();
    table.Row({NameOf(one.name), ValueText(one.value, interval, one.style()),
               IntervalText(interval, one.style())});
  }
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

/// Returns the lines to paste; one control is open, the others on a click.
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
  for (const pa::UncertainInput& known : pa::kUncertainInputs) {
    if (input == known.name) return known.words;
  }
  constexpr std::pair<const char*, const char*> kWords[] = {
      {"all", "all together"},
      {"targets", "targets' places, with their covariance"},
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

double ResidualEnlargement(double rms_px, int width_px, int height_px) {
  constexpr double kMin = 1;
  constexpr double kMax = 1e6;
  const double side_px = std::max(width_px, height_px);
  const double wanted = kUsual_px * side_px / kMaxSide_px / rms_px;
  return RoundedDown(wanted >= kMin ? std::min(wanted, kMax) : kMin);
}

Figure AlignmentPicture(std::size_t view, const BgrView& picture, int width_px, int height_px,
                        const std::vector<DrawnTarget>& targets, double enlarged) {
  const auto draw = [&](double side_px) {
    return Draw(view, picture, width_px, height_px, targets, enlarged, side_px);
  };
  Figure figure{
      fmt::format("view-{:02}", view + 1),
      "Orange circle: left out. Dashed cross: in the picture by the solution, but not found. "
      "A residual's line ends at what its number says, but for very long ones.",
      draw(kMaxSide_px), 1};
  figure.seen = fmt::format("View {}:", view + 1);
  for (const DrawnTarget& target : targets) {
    figure.seen += fmt::format(" {} {};", target.id,
                               target.left_out   ? "left out"
                               : target.found_px ? "found"
                                                 : "not found");
  }
  figure.narrow = draw(kNarrowWidthPx);
  return figure;
}

std::string AlignmentPage(const AlignmentOutput& output, std::span<const Figure> views) {
  return FittingPage([&](std::size_t step) { return PageOf(output, views, kPhotoSteps[step]); });
}

}  // namespace trammel::report
