#include "sim/sheet/original_sheet.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace trammel::sim {
namespace {

constexpr double kWidthMm = 8;      // width of a structure
constexpr double kAloneMm = 2;      // part of it with only one comb
constexpr double kLengthMm = 70;    // structure length for the placement
constexpr double kPeriodMm = 4;     // finger period
constexpr double kFingerMm = 0.75;  // between a finger's two legs
constexpr double kSpacingMm = 3;    // between structures
constexpr double kToBoxMm = 5;      // meant between structures and box
constexpr int kBoxLines = 3;        // 0.4 mm apart
constexpr double kNozzleMm = 0.4;
constexpr double kLayerMm = 0.2;
constexpr double kZOffsetMm = 0.15;
constexpr double kHopMm = 0.5;
constexpr double kRetractMm = 5;
constexpr double kPrintMmS = 30;
constexpr double kRetractMmS = 80;
constexpr double kFilamentMm = 1.75;
constexpr double kQuarterShare = 0.71;  // of the filament for a quarter turn
constexpr int kFingers = 17;
constexpr double kTurnMm = kFingerMm / 2;  // radius of all turns

// Orientation of a structure: its fingers follow each other along `s`, its legs run along `cross`.
struct Structure {
  bool along_v = true;
  double s0_mm = 0;
  double cross0_mm = 0;
};

struct Comb {
  Structure structure;
  double first_mm = 0;  // s of the first leg, from s0
  double step = 1;      // +1 or -1: which way the comb is stepped
  double spine_mm = 0;  // cross of the legs' outer ends
  double tip_mm = 0;
  PlaneMm shift;
};

class Writer {
 public:
  explicit Writer(const OriginalSheet& sheet) : sheet_(sheet) {
    const double radius_mm = kFilamentMm / 2;
    per_mm_ = sheet.extrusion_multiplier * kNozzleMm * kLayerMm /
              (std::numbers::pi * radius_mm * radius_mm);
  }

  std::string Write();

 private:
  void Add(std::string_view line) { out_.append(line).append("\n"); }
  [[nodiscard]] PlaneMm OnBed(const PlaneMm& uv) const {
    const double c = std::cos(sheet_.rotation_rad);
    const double s = std::sin(sheet_.rotation_rad);
    return {sheet_.centre.x_mm + c * uv.x_mm - s * uv.y_mm,
            sheet_.centre.y_mm + s * uv.x_mm + c * uv.y_mm};
  }
  void Travel(const PlaneMm& uv) {
    const PlaneMm to = OnBed(uv);
    Add(fmt::format("G1 X{:.3f} Y{:.3f} F{:.0f}", to.x_mm, to.y_mm, kPrintMmS * 60));
    at_ = uv;
  }
  void Retract() {
    Add(fmt::format("G1 Z{:.3f} E{:.5f} F{:.0f}", kZOffsetMm + kLayerMm + kHopMm, -kRetractMm,
                    kRetractMmS * 60));
  }
  void Return() {
    Add(fmt::format("G1 Z{:.3f} E{:.5f} F{:.0f}", kZOffsetMm + kLayerMm, kRetractMm,
                    kRetractMmS * 60));
  }
  void Line(const PlaneMm& uv) {
    const PlaneMm to = OnBed(uv);
    const double length = std::hypot(uv.x_mm - at_.x_mm, uv.y_mm - at_.y_mm);
    Add(fmt::format("G1 X{:.3f} Y{:.3f} E{:.5f}", to.x_mm, to.y_mm, per_mm_ * length));
    at_ = uv;
  }
  void Arc(const PlaneMm& uv, const PlaneMm& middle, double share) {
    const PlaneMm from{at_.x_mm - middle.x_mm, at_.y_mm - middle.y_mm};
    const PlaneMm to{uv.x_mm - middle.x_mm, uv.y_mm - middle.y_mm};
    // Half turns have no sign of their own; see HalfTurn.
    const double sine = from.x_mm * to.y_mm - from.y_mm * to.x_mm;
    WriteArc(uv, middle, sine > 0, share * kTurnMm * std::numbers::pi / 2);
  }
  void WriteArc(const PlaneMm& uv, const PlaneMm& middle, bool counter_clockwise,
                double filament_length_mm) {
    const PlaneMm start = OnBed(at_);
    const PlaneMm to = OnBed(uv);
    const PlaneMm centre = OnBed(middle);
    Add(fmt::format("{} X{:.3f} Y{:.3f} I{:.3f} J{:.3f} E{:.5f}", counter_clockwise ? "G3" : "G2",
                    to.x_mm, to.y_mm, centre.x_mm - start.x_mm, centre.y_mm - start.y_mm,
                    per_mm_ * filament_length_mm));
    at_ = uv;
  }
  void Draw(const Comb& comb);
  void Box();
  [[nodiscard]] Structure StructureOf(bool along_v, std::size_t pair, bool second) const;
  [[nodiscard]] PlaneMm ShiftOf(std::size_t pair, bool tested) const;
  void References(bool along_v);
  void Tested(std::size_t pair, bool along_v);
  [[nodiscard]] double across_mm() const {
    return 2 * (kWidthMm + kSpacingMm) * static_cast<double>(sheet_.tools.size()) - kSpacingMm;
  }

  const OriginalSheet& sheet_;
  double per_mm_ = 0;  // filament for a mm of line
  PlaneMm at_;
  std::string out_;
};

void Writer::Box() {
  const double full_u = across_mm() + kLengthMm + kSpacingMm + 2 * kToBoxMm - 2;
  const double full_v = std::max(across_mm(), kPeriodMm * kFingers) + 2 * kToBoxMm;
  const PlaneMm shift = ShiftOf(0, false);
  for (int i = 0; i < kBoxLines; ++i) {
    const double u = full_u / 2 - i * kNozzleMm;
    const double v = full_v / 2 - i * kNozzleMm;
    const auto corner = [&](double su, double sv) {
      return PlaneMm{su * u + shift.x_mm, sv * v + shift.y_mm};
    };
    Travel(corner(-1, -1));
    if (i == 0) Return();
    Line(corner(1, -1));
    Line(corner(1, 1));
    Line(corner(-1, 1));
    Line(corner(-1, -1));
  }
  Retract();
}

Structure Writer::StructureOf(bool along_v, std::size_t pair, bool second) const {
  const double step = 2 * (kWidthMm + kSpacingMm) * static_cast<double>(pair) +
                      (second ? kWidthMm + kSpacingMm : 0);
  const double half_u = (across_mm() + kLengthMm + kSpacingMm) / 2;
  if (along_v) return {true, -kLengthMm / 2, -half_u + step};
  return {false, half_u - kLengthMm, -across_mm() / 2 + step};
}

PlaneMm Writer::ShiftOf(std::size_t pair, bool tested) const {
  if (sheet_.offsets.empty()) return {};
  if (!sheet_.repaired) return sheet_.offsets.back();
  return tested ? sheet_.offsets[pair] : PlaneMm{};
}

void Writer::Draw(const Comb& comb) {
  const auto place = [&](double s, double cross) {
    const double along = comb.structure.s0_mm + s;
    const double beside = comb.structure.cross0_mm + cross;
    return PlaneMm{(comb.structure.along_v ? beside : along) + comb.shift.x_mm,
                   (comb.structure.along_v ? along : beside) + comb.shift.y_mm};
  };
  const double out = comb.spine_mm > comb.tip_mm ? 1 : -1;  // tip to spine
  const double step = comb.step;
  // A half turn at the tip, seen with s up and cross right, is counter-clockwise if it steps up at
  // the right end; structures along u are mirrored.
  const bool counter_clockwise = (step * -out > 0) == comb.structure.along_v;
  double s = comb.first_mm;
  Travel(place(s, comb.spine_mm));
  for (int finger = 0; finger < kFingers; ++finger) {
    if (finger == 0) {
      Travel(place(s, comb.tip_mm));
      Return();
    } else {
      Line(place(s, comb.tip_mm));
    }
    const PlaneMm middle = place(s + step * kTurnMm, comb.tip_mm);
    s += step * kFingerMm;
    WriteArc(place(s, comb.tip_mm), middle, counter_clockwise, kTurnMm * std::numbers::pi);
    Line(place(s, comb.spine_mm));
    const double spine = comb.spine_mm + out * kTurnMm;
    Arc(place(s + step * kTurnMm, spine), place(s + step * kTurnMm, comb.spine_mm), kQuarterShare);
    const double next = s + step * (kPeriodMm - kFingerMm);
    Line(place(next - step * kTurnMm, spine));
    Arc(place(next, comb.spine_mm), place(next - step * kTurnMm, comb.spine_mm), kQuarterShare);
    s = next;
  }
  Retract();
  Travel(place(s, comb.tip_mm));
}

void Writer::References(bool along_v) {
  for (std::size_t pair = 0; pair < sheet_.tools.size(); ++pair) {
    for (const bool second : {false, true}) {
      Add(fmt::format(";print {} interlocked reference pattern {}",
                      along_v ? "vertical" : "horizontal", 2 * pair + (second ? 1 : 0)));
      Draw({StructureOf(along_v, pair, second), kPeriodMm / 2, 1, kWidthMm, kAloneMm,
            ShiftOf(pair, false)});
    }
  }
}

void Writer::Tested(std::size_t pair, bool along_v) {
  for (const bool second : {false, true}) {
    Add(fmt::format(";print {} interlocked signal pattern {}", along_v ? "vertical" : "horizontal",
                    2 * pair + (second ? 1 : 0)));
    Add(fmt::format("T{}", sheet_.tools[pair]));
    const double first_mm = second ? kPeriodMm * kFingers + kFingerMm : 0;
    Draw({StructureOf(along_v, pair, second), first_mm, second ? -1.0 : 1.0, 0, kWidthMm - kAloneMm,
          ShiftOf(pair, true)});
  }
}

std::string Writer::Write() {
  for (const int tool : sheet_.tools) Add(fmt::format("G10 P{} R220 S220", tool));
  for (const char* line : {"M140 S60", "M116", "G54", "G28", "G32", "M83", "M25"}) Add(line);
  Add(fmt::format("T{}", sheet_.reference));
  Add(fmt::format("G1 Z{:.3f} F{:.0f}", kZOffsetMm + kLayerMm + kHopMm, kPrintMmS * 60));
  Box();
  References(true);
  References(false);
  for (std::size_t pair = 0; pair < sheet_.tools.size(); ++pair) {
    Tested(pair, true);
    Tested(pair, false);
  }
  for (const char* line : {"G1 Z25", "M84", "M0 H1"}) Add(line);
  return std::move(out_);
}

}  // namespace

std::string OriginalGcode(const OriginalSheet& sheet) { return Writer(sheet).Write(); }

}  // namespace trammel::sim
