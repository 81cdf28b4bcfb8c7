#include "part_alignment/correction/control_text.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <numbers>
#include <utility>

namespace trammel::part_alignment {
namespace {

using geometry::Pose;

constexpr double kDegrees = 180 / std::numbers::pi;
constexpr std::array<std::pair<std::string_view, Control>, 4> kControls = {{
    {"linuxcnc", Control::kLinuxCnc},
    {"siemens", Control::kSiemens},
    {"heidenhain", Control::kHeidenhain},
    {"fanuc", Control::kFanuc},
}};

// Formats a number, never as "-0.000000", which some controls' editors reject.
std::string Fixed(double value, int decimals) {
  std::string text = fmt::format("{:.{}f}", value, decimals);
  if (text.find_first_not_of("-0.") == std::string::npos && text.front() == '-') text.erase(0, 1);
  return text;
}
std::string Mm(double mm) { return Fixed(mm, 6); }
std::string Deg(double rad) { return Fixed(rad * kDegrees, 9); }
// Adds the sign that Klartext requires.
std::string Signed(const std::string& number) {
  return number.front() == '-' ? number : "+" + number;
}

// Parses the number behind `prefix`; absent if there is more text.
std::optional<int> NumberBehind(const std::string& text, const std::string& prefix) {
  constexpr std::size_t kMaxDigits = 4;
  if (!text.starts_with(prefix)) return std::nullopt;
  const std::string digits = text.substr(prefix.size());
  if (digits.empty() || digits.size() > kMaxDigits ||
      digits.find_first_not_of("0123456789") != std::string::npos) {
    return std::nullopt;
  }
  return std::stoi(digits);
}

std::optional<OffsetSlot> FindSlot(Control control, const std::string& name) {
  const auto within = [&](const std::string& prefix, int lo, int hi, int number_of_lo,
                          bool additional = false) -> std::optional<OffsetSlot> {
    const auto number = NumberBehind(name, prefix);
    if (!number || *number < lo || *number > hi) return std::nullopt;
    return OffsetSlot{name, *number - lo + number_of_lo, additional};
  };
  switch (control) {
    case Control::kLinuxCnc:
      if (auto slot = within("G59.", 1, 3, 7)) return slot;
      return within("G", 54, 59, 1);
    case Control::kSiemens:
      if (auto slot = within("G", 54, 57, 1)) return slot;
      return within("G", 505, 599, 5);
    case Control::kFanuc:
      if (auto slot = within("G54.1 P", 1, 300, 1, true)) return slot;
      return within("G", 54, 59, 1);
    case Control::kHeidenhain:
      return within("", 1, 9999, 1);
  }
  return std::nullopt;
}

ControlText LinuxCncText(const OffsetSlot& slot, const Pose& pose) {
  const Eigen::Vector3d& at = pose.translation_mm;
  return {
      {"G21", fmt::format("G10 L2 P{} X{} Y{} Z{} R{}", slot.number, Mm(at.x()), Mm(at.y()),
                          Mm(at.z()), Deg(pose.angles_rad.z()))},
      {slot.name},
      {"machine = offset + Rz(R) (program + G92) + tool: the rotation is about the offset's own "
       "origin, counter-clockwise seen from +Z; the tool's length is added afterwards, unturned",
       "an active G92 or G52 shifts the part: cancel it with G92.1",
       "G21 makes the numbers millimetres and stays on: programs in inches begin with G20"}};
}

ControlText SiemensText(const OffsetSlot& slot, const Pose& pose, bool tilts) {
  const Eigen::Vector3d& at = pose.translation_mm;
  const Eigen::Vector3d& turn = pose.angles_rad;
  std::string rotation = fmt::format("Z,{}", Deg(turn.z()));
  if (tilts) {
    rotation = fmt::format("X,{},Y,{},{}", Deg(turn.x()), Deg(turn.y()), rotation);
  }
  return {
      {fmt::format("$P_UIFR[{}]=CTRANS(X,{},Y,{},Z,{}):CROT({})", slot.number, Mm(at.x()),
                   Mm(at.y()), Mm(at.z()), rotation)},
      {slot.name},
      {"frames chain from the left: the coordinate system is shifted, then turned about its new "
       "origin, right-handed, in the order Z, Y', X'' (RPY: machine data 10600 = 1, the "
       "default)",
       "the frame takes effect when the offset is next selected; a fine offset (CFINE) of it is "
       "cleared by the assignment, and G500, base frames and TRANS/ROT act besides"}};
}

ControlText HeidenhainText(const OffsetSlot& slot, const Pose& pose, bool tilts) {
  const Eigen::Vector3d& at = pose.translation_mm;
  const Eigen::Vector3d turn = tilts ? pose.angles_rad : Eigen::Vector3d(0, 0, pose.angles_rad.z());
  ControlText text;
  text.set = {
      fmt::format("preset table, row {} (edit, not correct):", slot.number),
      fmt::format("X {}   Y {}   Z {}", Signed(Mm(at.x())), Signed(Mm(at.y())), Signed(Mm(at.z()))),
      fmt::format("SPA {}   SPB {}   SPC {}", Signed(Deg(turn.x())), Signed(Deg(turn.y())),
                  Signed(Deg(turn.z())))};
  text.use = {"CYCL DEF 247 DATUM SETTING ~", fmt::format("  Q339=+{} ;DATUM NUMBER", slot.number)};
  text.notes = {
      "the preset is where the part's origin lies in the machine; SPA, SPB, SPC turn about the "
      "machine's fixed X, then Y, then Z axis, right-handed",
      "an older control (iTNC 530) keeps only a basic rotation: its column ROT is SPC",
      "in a program instead, from a preset at the machine's datum: CYCL DEF 7 with the same X, Y "
      "and Z, then CYCL DEF 10 with ROT = SPC, in this order"};
  return text;
}

ControlText FanucText(const OffsetSlot& slot, const Pose& pose) {
  const Eigen::Vector3d& at = pose.translation_mm;
  return {{"G21", fmt::format("G90 G10 L{} P{} X{} Y{} Z{}", slot.additional ? 20 : 2, slot.number,
                              Mm(at.x()), Mm(at.y()), Mm(at.z()))},
          {slot.name, fmt::format("G17 G90 G68 X0. Y0. R{}", Deg(pose.angles_rad.z()))},
          {"the offset keeps no rotation: every program turns itself by G68 about the offset's "
           "origin, counter-clockwise, and ends with G69",
           "R must be absolute (parameter 6400 bit 0); the control may round to its input "
           "increment, 0.001 mm and 0.001 degree on many: 0.001 degree is 0.017 mm at 1 m",
           "G90 matters: under G91, G10 adds to the offset that is there; the external offset (P0) "
           "and G52, G92 act besides"}};
}

void AddTiltNote(const Pose& pose, bool tilts, ControlText& text) {
  const Eigen::Vector2d tilt = pose.angles_rad.head<2>();
  if (tilt.isZero()) return;
  constexpr double kPerMille = 1e3;
  const std::string figure = fmt::format("{:.4f} mm/m about X and {:.4f} mm/m about Y",
                                         tilt.x() * kPerMille, tilt.y() * kPerMille);
  text.notes.push_back(
      tilts
          ? fmt::format("the tilt ({}) moves every programmed point; the tool still comes along "
                        "the machine's Z unless the machine swivels it",
                        figure)
          : fmt::format("the tilt ({}) is not in this offset: take it out at the fixture", figure));
}

}  // namespace

std::optional<Control> ParseControl(std::string_view name) {
  for (const auto& [known, control] : kControls) {
    if (name == known) return control;
  }
  return std::nullopt;
}

std::string_view ToString(Control control) {
  for (const auto& [name, known] : kControls) {
    if (control == known) return name;
  }
  return "";
}

Result<OffsetSlot> ParseOffsetSlot(Control control, const std::string& name) {
  if (auto slot = FindSlot(control, name)) return *slot;
  constexpr std::array<std::string_view, 4> kKnown = {
      "G54 … G59 and G59.1 … G59.3", "G54 … G57 and G505 … G599",
      "the rows 1 … 9999 of the preset table", "G54 … G59 and \"G54.1 P1\" … \"G54.1 P300\""};
  return Fail(fmt::format("work offset {}: {} knows {}", name, ToString(control),
                          kKnown[static_cast<std::size_t>(control)]));
}

Result<ControlText> TextFor(Control control, const OffsetSlot& slot, const Pose& machine_from_part,
                            bool tilts) {
  if (!machine_from_part.translation_mm.allFinite() || !machine_from_part.angles_rad.allFinite()) {
    return Fail("the part's pose has a number that is not finite");
  }
  if (tilts && control != Control::kSiemens && control != Control::kHeidenhain) {
    return Fail(fmt::format("a work offset of {} takes no tilt; take it out at the fixture",
                            ToString(control)));
  }
  ControlText text;
  switch (control) {
    case Control::kLinuxCnc:
      text = LinuxCncText(slot, machine_from_part);
      break;
    case Control::kSiemens:
      text = SiemensText(slot, machine_from_part, tilts);
      break;
    case Control::kHeidenhain:
      text = HeidenhainText(slot, machine_from_part, tilts);
      break;
    case Control::kFanuc:
      text = FanucText(slot, machine_from_part);
      break;
  }
  AddTiltNote(machine_from_part, tilts, text);
  return text;
}

}  // namespace trammel::part_alignment
