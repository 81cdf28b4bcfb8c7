#include "tool_offset/reading/sheet_scene_test_support.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace trammel::tool_offset {
namespace {

std::array<double, 2> PaperSize_mm(const SheetPlan& plan, const SheetScene& scene) {
  const double w = plan.width_mm * scene.scale_u;
  const double h = plan.height_mm * scene.scale_v;
  const double c = std::abs(std::cos(scene.angle_rad));
  const double s = std::abs(std::sin(scene.angle_rad));
  return {w * c + h * s + 2 * scene.margin_mm, w * s + h * c + 2 * scene.margin_mm};
}

class Press {
 public:
  Press(const SheetPlan& plan, const SheetScene& scene, Random& random)
      : plan_(plan),
        scene_(scene),
        random_(random),
        tilt_rad_(plan.settings.tilt_deg * std::numbers::pi / 180) {
    if (scene.wrinkle_mm > 0) {
      for (double& phase : phases_) phase = random.Uniform(0, 2 * std::numbers::pi);
    }
  }

  std::vector<support::PaperStroke> Print() {
    const int reference = plan_.settings.reference_tool;
    for (const double inset_mm : plan_.box_insets_mm) {
      const double u = plan_.width_mm / 2 - inset_mm;
      const double v = plan_.height_mm / 2 - inset_mm;
      Line({{-u, -v}, {u, -v}}, reference, false);
      Line({{u, -v}, {u, v}}, reference, false);
      Line({{u, v}, {-u, v}}, reference, false);
      Line({{-u, v}, {-u, -v}}, reference, false);
    }
    for (const CodeCell& cell : plan_.code) {
      if (cell.dark) Line(CodeLeg(plan_, cell), reference, false);
    }
    for (const Structure& structure : plan_.structures) {
      for (std::size_t comb = 0; comb < 2; ++comb) {
        for (int finger = 0; finger < plan_.settings.teeth; ++finger) {
          const auto legs = FingerLegs(plan_, structure, comb, finger);
          for (const std::size_t leg : {std::size_t{0}, std::size_t{1}}) {
            if (finger == structure.incomplete[comb] && leg == Missing(structure, comb)) continue;
            Line(legs[leg], structure.combs[comb].tool, true);
          }
        }
        for (const Leg& join : JoinsOfComb(plan_, structure, comb)) {
          Line(join, structure.combs[comb].tool, false);
        }
      }
    }
    return std::move(strokes_);
  }

 private:
  /// The leg of a finger that is drawn in part which is a travel: the first.
  static std::size_t Missing(const Structure& structure, std::size_t comb) {
    return structure.combs[comb].direction > 0 ? 0 : 1;
  }

  /// Returns the pen's displacement: the tool's offset and the axes' backlash, in the sheet's axes.
  SheetPoint Shift(const Leg& leg, int tool, bool backlash) const {
    const double c = std::cos(tilt_rad_);
    const double s = std::sin(tilt_rad_);
    SheetPoint bed{0, 0};
    if (const auto found = scene_.offset_mm.find(tool); found != scene_.offset_mm.end()) {
      bed = found->second;
    }
    if (backlash) {
      const double du = leg.end.u_mm - leg.start.u_mm;
      const double dv = leg.end.v_mm - leg.start.v_mm;
      bed.u_mm -= std::copysign(scene_.backlash_x_mm / 2, du * c - dv * s);
      bed.v_mm -= std::copysign(scene_.backlash_y_mm / 2, du * s + dv * c);
    }
    return {bed.u_mm * c + bed.v_mm * s, -bed.u_mm * s + bed.v_mm * c};
  }

  SheetPoint Wrinkled(SheetPoint point) const {
    const double k = 2 * std::numbers::pi / scene_.wrinkle_length_mm;
    return {
        point.u_mm + scene_.wrinkle_mm * std::sin(k * (point.u_mm + 0.4 * point.v_mm) + phases_[0]),
        point.v_mm +
            scene_.wrinkle_mm * std::sin(k * (point.v_mm - 0.3 * point.u_mm) + phases_[1])};
  }

  void Line(const Leg& leg, int tool, bool noisy) {
    if (scene_.silent_tools.contains(tool)) return;
    SheetPoint shift = Shift(leg, tool, noisy);
    if (noisy && scene_.placement_mm > 0) {
      const double length =
          std::hypot(leg.end.u_mm - leg.start.u_mm, leg.end.v_mm - leg.start.v_mm);
      const double by = random_.Normal(0, scene_.placement_mm) / length;
      shift.u_mm += by * (leg.end.v_mm - leg.start.v_mm);
      shift.v_mm -= by * (leg.end.u_mm - leg.start.u_mm);
    }
    const auto at = [&](SheetPoint point) {
      return OnPaper_mm(plan_, scene_,
                        Wrinkled({point.u_mm + shift.u_mm, point.v_mm + shift.v_mm}));
    };
    const auto from = at(leg.start);
    const auto to = at(leg.end);
    support::PaperStroke stroke{from[0], from[1], to[0], to[1], plan_.settings.line_width_mm};
    if (const auto ink = scene_.tool_ink.find(tool); ink != scene_.tool_ink.end()) {
      stroke.ink = ink->second;
    }
    strokes_.push_back(stroke);
  }

  const SheetPlan& plan_;
  const SheetScene& scene_;
  Random& random_;
  double tilt_rad_;
  std::array<double, 2> phases_{};
  std::vector<support::PaperStroke> strokes_;
};

}  // namespace

std::array<double, 2> OnPaper_mm(const SheetPlan& plan, const SheetScene& scene, SheetPoint point) {
  const double u = point.u_mm * scene.scale_u * (scene.mirrored ? -1 : 1);
  const double v = point.v_mm * scene.scale_v;
  const double c = std::cos(scene.angle_rad);
  const double s = std::sin(scene.angle_rad);
  const auto size_mm = PaperSize_mm(plan, scene);
  return {size_mm[0] / 2 + u * c - v * s, size_mm[1] / 2 - (u * s + v * c)};
}

support::PaperStroke PaperOverBoxLine(const SheetPlan& plan, const SheetScene& scene, Side side,
                                      double inset_mm) {
  constexpr double kCorner_mm = 0.3;  // extent of lines that end there
  const double u_mm = plan.width_mm / 2 - inset_mm;
  const double v_mm = plan.height_mm / 2 - inset_mm;
  const double sign = side == kRight || side == kTop ? 1 : -1;
  const bool upright = side == kLeft || side == kRight;
  const auto end = [&](double along) {
    return OnPaper_mm(plan, scene,
                      upright ? SheetPoint{sign * u_mm, along * (v_mm - kCorner_mm)}
                              : SheetPoint{along * (u_mm - kCorner_mm), sign * v_mm});
  };
  const auto a = end(-1);
  const auto b = end(1);
  return {a[0], a[1], b[0], b[1], 0.55, scene.paper.paper};
}

ScannedScene Scan(const SheetPlan& plan, SheetScene scene, Random& random) {
  const auto size_mm = PaperSize_mm(plan, scene);
  scene.paper.width_mm = size_mm[0];
  scene.paper.height_mm = size_mm[1];
  std::vector<support::PaperStroke> strokes = Press(plan, scene, random).Print();
  strokes.insert(strokes.end(), scene.more.begin(), scene.more.end());
  return {support::DrawPaper(scene.paper, strokes, random)};
}

}  // namespace trammel::tool_offset
