#include "klipper_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <numbers>
#include <sstream>
#include <utility>

namespace trammel::test {
namespace {

constexpr double kNoLimit = 1e300;

struct Words {
  std::string name;
  std::map<std::string, std::string> values;

  [[nodiscard]] std::optional<double> Number(const std::string& key) const {
    const auto found = values.find(key);
    if (found == values.end()) return std::nullopt;
    return std::strtod(found->second.c_str(), nullptr);
  }
};

Words Parse(const std::string& line) {
  Words words;
  std::istringstream stream(line.substr(0, line.find(';')));
  std::string word;
  stream >> words.name;
  while (stream >> word) {
    const std::size_t equals = word.find('=');
    if (equals != std::string::npos) {
      words.values[word.substr(0, equals)] = word.substr(equals + 1);
    } else {
      words.values[word.substr(0, 1)] = word.substr(1);
    }
  }
  return words;
}

// A move in Klipper's look-ahead queue.
struct QueuedMove {
  std::array<double, 4> delta{};
  bool kinematic = true;
  double length_mm = 0;
  double accel = 0;
  double pseudo_accel = 0;
  double junction_deviation = 0;
  double cruise2 = 0;
  double max_start2 = 0;
  double start = 0, cruise = 0, end = 0;
  int line = -1;

  [[nodiscard]] double Ratio(std::size_t axis) const { return delta[axis] / length_mm; }
  [[nodiscard]] double Delta2() const { return 2 * length_mm * accel; }
};

class Machine {
 public:
  explicit Machine(const ModelPrinter& printer) : printer_(printer) {
    SetLimits(printer.max_accel_mm_s2, printer.minimum_cruise_ratio);
    to_decel_ = printer.max_accel_mm_s2 * (1 - printer.minimum_cruise_ratio);
    at_ = {(printer.minimum_mm[0] + printer.maximum_mm[0]) / 2,
           (printer.minimum_mm[1] + printer.maximum_mm[1]) / 2, printer.maximum_mm[2], 0};
    absolute_ = printer.absolute_coordinates;
    absolute_e_ = printer.absolute_extrude;
    speed_factor_ = printer.speed_factor;
    extrude_factor_ = printer.extrude_factor;
    base_ = {printer.origin_mm[0], printer.origin_mm[1], printer.origin_mm[2], 0};
    for (const auto& [section, motor] : printer.motors) {
      advance_[section] = motor.pressure_advance_s;
    }
  }

  void Run(const std::string& line) {
    if (line.starts_with("; line ")) {
      print_.lines.emplace_back();
      in_line_ = true;
      return;
    }
    if (line.starts_with("; frame")) in_line_ = false;
    const Words words = Parse(line);
    if (words.name.empty()) return;
    if (words.name == "G0" || words.name == "G1") {
      Move(words);
    } else if (words.name == "SET_PRESSURE_ADVANCE") {
      SetAdvance(words);
    } else if (words.name == "SET_VELOCITY_LIMIT") {
      SetVelocityLimit(words);
    } else if (words.name == "M104" || words.name == "M109") {
      Heat(words.Number("S").value_or(0));
    } else if (words.name == "M140" || words.name == "M190") {
      HeatBed(words.Number("S").value_or(0));
    } else {
      SetMode(words);
    }
  }

  ModelPrint Take() {
    Plan();
    return std::move(print_);
  }

 private:
  [[nodiscard]] const ModelExtruder& Extruder() const {
    return printer_.extruders.at(printer_.active);
  }

  void Refuse(std::string why) {
    if (print_.refusal.empty()) print_.refusal = std::move(why);
  }

  void SetLimits(double accel, double ratio) {
    accel_ = accel;
    ratio_ = ratio;
  }

  void SetMode(const Words& words) {
    if (words.name == "G90") absolute_ = true;
    if (words.name == "G91") absolute_ = false;
    if (words.name == "M82") absolute_e_ = true;
    if (words.name == "M83") absolute_e_ = false;
    if (words.name == "M220") speed_factor_ = words.Number("S").value_or(100) / 100;
    if (words.name == "M221") {
      const double factor = words.Number("S").value_or(100) / 100;
      base_[3] = at_[3] - (at_[3] - base_[3]) / extrude_factor_ * factor;
      extrude_factor_ = factor;
    }
    if (words.name == "G92") {
      if (const auto e = words.Number("E")) base_[3] = at_[3] - *e * extrude_factor_;
    }
    if (words.name == "G28") Home();
  }

  void Home() {
    const double z_mm = std::min(printer_.maximum_mm[2], printer_.minimum_mm[2] + 15);
    at_[0] = (printer_.minimum_mm[0] + printer_.maximum_mm[0]) / 2;
    at_[1] = (printer_.minimum_mm[1] + printer_.maximum_mm[1]) / 2;
    at_[2] = z_mm;
    for (std::size_t axis = 0; axis < 3; ++axis) base_[axis] = printer_.origin_mm[axis];
  }

  void Heat(double target_c) {
    const ModelExtruder& extruder = Extruder();
    if (target_c != 0 && (target_c < extruder.min_temp_c || target_c > extruder.max_temp_c)) {
      Refuse(fmt::format("Requested temperature ({}) out of range", target_c));
    }
    nozzle_c_ = target_c;
  }

  // Without a bed's heater Klipper does not know the command M140, and ignores it.
  void HeatBed(double target_c) {
    if (printer_.bed_max_temp_c && target_c > *printer_.bed_max_temp_c) {
      Refuse(fmt::format("Requested temperature ({}) of the bed out of range", target_c));
    }
  }

  void SetAdvance(const Words& words) {
    const double advance_s = words.Number("ADVANCE").value_or(0);
    const auto named = words.values.find("EXTRUDER");
    if (named == words.values.end()) {
      const auto own = printer_.motors.find(printer_.active);
      if (own == printer_.motors.end()) {
        Refuse("Active extruder does not have a stepper");
      } else if (own->second.queue != printer_.active) {
        Refuse("Unable to infer active extruder stepper");
      } else {
        advance_[printer_.active] = advance_s;
      }
    } else {
      bool known = false;
      for (const auto& [section, motor] : printer_.motors) {
        if (section.substr(section.rfind(' ') + 1) != named->second) continue;
        advance_[section] = advance_s;
        known = true;
      }
      if (!known) Refuse("The value '" + named->second + "' is not valid for EXTRUDER");
    }
  }

  void SetVelocityLimit(const Words& words) {
    const double accel = words.Number("ACCEL").value_or(accel_);
    if (printer_.before_2024) {
      to_decel_ = words.Number("ACCEL_TO_DECEL").value_or(to_decel_);
      SetLimits(accel, 1 - std::min(1.0, to_decel_ / accel));
    } else {
      SetLimits(accel, words.Number("MINIMUM_CRUISE_RATIO").value_or(ratio_));
    }
  }

  void Move(const Words& words) {
    std::array<double, 4> to = at_;
    constexpr std::array<const char*, 4> kAxes = {"X", "Y", "Z", "E"};
    for (std::size_t axis = 0; axis < 4; ++axis) {
      const auto value = words.Number(kAxes[axis]);
      if (!value) continue;
      const double scaled = axis == 3 ? *value * extrude_factor_ : *value;
      const bool absolute = absolute_ && (axis < 3 || absolute_e_);
      to[axis] = scaled + (absolute ? base_[axis] : at_[axis]);
    }
    if (const auto feed = words.Number("F")) feed_mm_s_ = *feed / 60 * speed_factor_;
    QueuedMove move;
    for (std::size_t axis = 0; axis < 4; ++axis) move.delta[axis] = to[axis] - at_[axis];
    move.length_mm = std::hypot(move.delta[0], move.delta[1], move.delta[2]);
    move.kinematic = move.length_mm > 1e-9;
    if (!move.kinematic) move.length_mm = std::abs(move.delta[3]);
    if (move.length_mm == 0) return;
    const double speed =
        move.kinematic ? std::min(feed_mm_s_, printer_.max_velocity_mm_s) : feed_mm_s_;
    move.cruise2 = speed * speed;
    move.accel = move.kinematic ? accel_ : 1e8;
    move.pseudo_accel = accel_ * (1 - ratio_);
    const double corner = printer_.square_corner_velocity_mm_s;
    move.junction_deviation = corner * corner * (std::numbers::sqrt2 - 1) / accel_;
    if (move.kinematic) CheckPlace(to, move);
    if (move.delta[3] != 0) CheckFilament(move);
    const bool prints = move.kinematic && move.delta[3] > 0 && in_line_;
    move.line = prints ? static_cast<int>(print_.lines.size()) - 1 : -1;
    if (prints) print_.lines.back().pressure_advance_s = advance_;
    at_ = to;
    queue_.push_back(move);
  }

  void CheckPlace(const std::array<double, 4>& to, QueuedMove& move) {
    constexpr double kSlack_mm = 1e-6;
    const std::string& kinematics = printer_.kinematics;
    const std::array<double, 3>&lo = printer_.minimum_mm, &hi = printer_.maximum_mm;
    const bool round =
        kinematics == "delta" || kinematics == "rotary_delta" || kinematics == "polar";
    const bool unbounded = kinematics == "winch" || kinematics == "none";
    bool in = unbounded || (to[2] >= lo[2] - kSlack_mm && to[2] <= hi[2] + kSlack_mm);
    if (round) {
      in = in && std::hypot(to[0], to[1]) <= hi[0] + kSlack_mm;
    } else if (!unbounded) {
      in = in && to[0] >= lo[0] - kSlack_mm && to[0] <= hi[0] + kSlack_mm &&
           to[1] >= lo[1] - kSlack_mm && to[1] <= hi[1] + kSlack_mm;
    }
    if (!in) Refuse(fmt::format("Move out of range: {:.3f} {:.3f} {:.3f}", to[0], to[1], to[2]));
    if (move.delta[2] != 0) {
      Limit(move, printer_.max_z_velocity_mm_s * move.length_mm / std::abs(move.delta[2]),
            kNoLimit);
    }
    if (kinematics == "polar" && printer_.max_angular_velocity_rad_s) SlowNearCentre(move);
  }

  void SlowNearCentre(QueuedMove& move) const {
    if (move.delta[0] == 0 && move.delta[1] == 0) return;
    const double length2 = move.delta[0] * move.delta[0] + move.delta[1] * move.delta[1];
    const double share =
        std::clamp(-(at_[0] * move.delta[0] + at_[1] * move.delta[1]) / length2, 0.0, 1.0);
    const double nearest_mm =
        std::hypot(at_[0] + share * move.delta[0], at_[1] + share * move.delta[1]);
    if (nearest_mm == 0) return;
    const double angular = std::sqrt(move.cruise2) / nearest_mm;
    if (*printer_.max_angular_velocity_rad_s >= angular) return;
    const double scale = *printer_.max_angular_velocity_rad_s / angular;
    Limit(move, printer_.configured_max_velocity_mm_s * scale,
          printer_.configured_max_accel_mm_s2 * scale);
  }

  static void Limit(QueuedMove& move, double speed, double accel) {
    move.cruise2 = std::min(move.cruise2, speed * speed);
    move.accel = std::min(move.accel, accel);
    move.pseudo_accel = std::min(move.pseudo_accel, move.accel);
  }

  void CheckFilament(QueuedMove& move) {
    const ModelExtruder& extruder = Extruder();
    if (nozzle_c_ < extruder.min_extrude_temp_c) Refuse("Extrude below minimum temp");
    const double area_mm2 =
        std::numbers::pi / 4 * extruder.filament_diameter_mm * extruder.filament_diameter_mm;
    const double usual_mm2 = 4 * extruder.nozzle_diameter_mm * extruder.nozzle_diameter_mm;
    const double ratio = move.Ratio(3);
    const bool in_place = move.delta[0] == 0 && move.delta[1] == 0;
    if (in_place || ratio < 0) {
      if (std::abs(move.delta[3]) > extruder.max_extrude_only_distance_mm) {
        Refuse(fmt::format("Extrude only move too long ({:.3f}mm)", move.delta[3]));
      }
      const double speed = extruder.max_extrude_only_velocity_mm_s.value_or(
          printer_.configured_max_velocity_mm_s * usual_mm2 / area_mm2);
      const double accel = extruder.max_extrude_only_accel_mm_s2.value_or(
          printer_.configured_max_accel_mm_s2 * usual_mm2 / area_mm2);
      Limit(move, speed / std::abs(ratio), accel / std::abs(ratio));
    } else if (ratio > extruder.max_extrude_cross_section_mm2.value_or(usual_mm2) / area_mm2) {
      Refuse(fmt::format("Move exceeds maximum extrusion ({:.3f}mm^2)", ratio * area_mm2));
    }
  }

  [[nodiscard]] double JunctionSpeed2(const QueuedMove& before, const QueuedMove& move) const {
    if (!before.kinematic || !move.kinematic) return 0;
    double speed2 = std::min({move.cruise2, before.cruise2, before.max_start2 + before.Delta2()});
    const double filament = move.Ratio(3) - before.Ratio(3);
    if (filament != 0) {
      const double corner = Extruder().instantaneous_corner_velocity_mm_s / std::abs(filament);
      speed2 = std::min(speed2, corner * corner);
    }
    double turn = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) turn -= move.Ratio(axis) * before.Ratio(axis);
    const double sine = std::sqrt(std::max(0.5 * (1 - turn), 0.0));
    const double cosine = std::sqrt(std::max(0.5 * (1 + turn), 0.0));
    if (sine < 1 && cosine > 0) {
      const double radius = sine / (1 - sine);
      const double quarter = 0.25 * sine / cosine;
      speed2 = std::min({speed2, radius * move.junction_deviation * move.accel,
                         radius * before.junction_deviation * before.accel, move.Delta2() * quarter,
                         before.Delta2() * quarter});
    }
    return speed2;
  }

  // Trapezoids of the whole queue. With a minimum_cruise_ratio above 0 Klipper lowers peaks: here
  // as much as a move between two stops would be.
  void Plan() {
    const std::size_t count = queue_.size();
    for (std::size_t i = 1; i < count; ++i) {
      queue_[i].max_start2 = JunctionSpeed2(queue_[i - 1], queue_[i]);
    }
    double next2 = 0;
    for (std::size_t i = count; i-- > 0;) {
      QueuedMove& move = queue_[i];
      const double start2 = std::min(move.max_start2, next2 + move.Delta2());
      double peak2 = (start2 + next2 + move.Delta2()) / 2;
      if (move.kinematic && move.pseudo_accel < move.accel) {
        const double lower2 = (start2 + next2 + 2 * move.length_mm * move.pseudo_accel) / 2;
        peak2 = std::min(peak2, std::max({lower2, start2, next2}));
      }
      move.cruise = std::sqrt(std::min(move.cruise2, peak2));
      move.start = std::min(std::sqrt(start2), move.cruise);
      move.end = std::min(std::sqrt(next2), move.cruise);
      next2 = start2;
    }
    for (const QueuedMove& move : queue_) Keep(move);
  }

  void Keep(const QueuedMove& move) {
    if (!move.kinematic) {
      const double time_s = move.length_mm / move.cruise + move.cruise / move.accel;
      print_.longest_filament_move_s = std::max(print_.longest_filament_move_s, time_s);
      return;
    }
    if (move.line < 0) return;
    ModelLine& line = print_.lines[static_cast<std::size_t>(move.line)];
    line.pieces.push_back({move.length_mm, move.start, move.cruise, move.end, move.accel});
    line.filament_mm += move.delta[3];
  }

  const ModelPrinter& printer_;
  ModelPrint print_;
  std::vector<QueuedMove> queue_;
  std::map<std::string, double> advance_;
  std::array<double, 4> at_{};
  std::array<double, 4> base_{};
  bool absolute_ = true, absolute_e_ = true, in_line_ = false;
  double speed_factor_ = 1, extrude_factor_ = 1, feed_mm_s_ = 25, nozzle_c_ = 0;
  double accel_ = 0, ratio_ = 0, to_decel_ = 0;
};

}  // namespace

double ModelLine::Length_mm() const {
  double length_mm = 0;
  for (const ModelPiece& piece : pieces) length_mm += piece.length_mm;
  return length_mm;
}

double ModelLine::SpeedAt_mm_s(double at_mm) const {
  for (const ModelPiece& piece : pieces) {
    if (at_mm > piece.length_mm) {
      at_mm -= piece.length_mm;
      continue;
    }
    const double rising = piece.start_mm_s * piece.start_mm_s + 2 * piece.accel_mm_s2 * at_mm;
    const double falling =
        piece.end_mm_s * piece.end_mm_s + 2 * piece.accel_mm_s2 * (piece.length_mm - at_mm);
    return std::min(piece.cruise_mm_s, std::sqrt(std::min(rising, falling)));
  }
  return 0;
}

ModelPrint PrintOn(const ModelPrinter& printer, std::string_view gcode) {
  Machine machine(printer);
  std::istringstream stream{std::string(gcode)};
  std::string line;
  while (std::getline(stream, line)) machine.Run(line);
  return machine.Take();
}

}  // namespace trammel::test
