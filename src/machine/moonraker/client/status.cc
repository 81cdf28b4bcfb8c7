#include "machine/moonraker/client/status.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>
#include <utility>

#include "base/utf8.h"
#include "machine/net/json_field.h"

namespace trammel::machine {

using nlohmann::json;

namespace {

bool IsExtruderStepper(std::string_view object) { return object.starts_with("extruder_stepper "); }

bool IsExtruder(std::string_view object) {
  return object.starts_with("extruder") && !IsExtruderStepper(object);
}

bool IsHeater(std::string_view object) {
  return IsExtruder(object) || object == "heater_bed" || object.starts_with("heater_generic ");
}

// Generous limits of any printer: a value outside is the server's fault, and must not reach a
// machine.
struct Range {
  double lo = 0;
  double hi = 0;
};
constexpr Range kPlace_mm{-1e5, 1e5};
constexpr Range kFilament_mm{-1e9, 1e9};  // a place of the E axis, which only grows
constexpr Range kSpeed_mm_s{0, 1e5};
constexpr Range kAcceleration_mm_s2{0, 1e8};
constexpr Range kFactor{0, 1e4};
constexpr Range kRatio{0, 1};
constexpr Range kTime_s{0, 100};  // pressure advance and its smoothing
constexpr Range kTemperature_c{-300, 5000};
constexpr Range kTarget_c{0, 2000};
constexpr std::size_t kMaxHeaters = 100;
constexpr std::size_t kMaxMotors = 100;  // extruder motors
constexpr std::size_t kMaxDevices = kMaxHeaters + kMaxMotors + 1;
constexpr std::size_t kLongestName = 100;
constexpr std::size_t kLongestText = 2000;
constexpr std::size_t kLongestList = 2000;

/// True if a name is safe in G-code.
bool IsPlainName(std::string_view name) {
  return name.size() <= kLongestName && std::all_of(name.begin(), name.end(), [](unsigned char c) {
           return c >= 0x20 && c != 0x7F;
         });
}

/// Reads fields of known objects; values out of bounds read as absent, and the first is recorded.
class Reader {
 public:
  explicit Reader(const json& known) : known_(known) {}

  [[nodiscard]] const json& Object(const std::string& name) const { return ObjectOr(known_, name); }
  [[nodiscard]] const std::string& fault() const { return fault_; }

  std::optional<double> Within(const std::string& object, const char* field, Range range) {
    const std::optional<double> number = Number(Object(object), field);
    return number && Check(object, field, *number, range) ? number : std::nullopt;
  }

  double Within(const std::string& object, const char* field, Range range, double otherwise) {
    return Within(object, field, range).value_or(otherwise);
  }

  [[nodiscard]] std::string Text(const std::string& object, const char* field) const {
    return Utf8OrReplaced(TextOr(Object(object), field, ""), kLongestText);
  }

  /// Returns a text that is safe in G-code.
  std::string Name(const std::string& object, const char* field) {
    std::string name = TextOr(Object(object), field, "");
    if (IsPlainName(name)) return name;
    Fault(fmt::format("{}.{} is no name ({} bytes, or a control character in it)", object, field,
                      name.size()));
    return "";
  }

  /// Reads as many numbers as there are, up to N; changes nothing if the value is no list of
  /// numbers. The fourth is a length of filament.
  template <std::size_t N>
  void List(const std::string& object, const char* field, std::array<double, N>& into) {
    const json* list = Member(Object(object), field);
    if (list == nullptr || !list->is_array() || list->size() < 3) return;
    std::array<double, N> numbers = into;
    for (std::size_t i = 0; i < std::min(N, list->size()); ++i) {
      if (!(*list)[i].is_number()) return;
      numbers[i] = (*list)[i].get<double>();
      if (!Check(object, field, numbers[i], i < 3 ? kPlace_mm : kFilament_mm)) return;
    }
    into = numbers;
  }

  /// True if one more of a kind is allowed.
  bool Room(const char* kind, std::size_t count, std::size_t most) {
    if (count < most) return true;
    Fault(fmt::format("it tells of more than {} {}", most, kind));
    return false;
  }

 private:
  bool Check(const std::string& object, std::string_view field, double number, Range range) {
    if (number >= range.lo && number <= range.hi) return true;
    Fault(fmt::format("{}.{} is {:g}, which lies outside {:g} … {:g}", object, field, number,
                      range.lo, range.hi));
    return false;
  }

  void Fault(std::string words) {
    if (fault_.empty()) fault_ = std::move(words);
  }

  const json& known_;
  std::string fault_;
};

void ReadMotion(Reader& reader, PrinterState& state) {
  state.homed_axes = reader.Name("toolhead", "homed_axes");
  reader.List("toolhead", "position", state.position_mm);
  reader.List("toolhead", "axis_minimum", state.axis_minimum_mm);
  reader.List("toolhead", "axis_maximum", state.axis_maximum_mm);
  VelocityLimits& limits = state.limits;
  limits.max_velocity_mm_s = reader.Within("toolhead", "max_velocity", kSpeed_mm_s, 0);
  limits.max_accel_mm_s2 = reader.Within("toolhead", "max_accel", kAcceleration_mm_s2, 0);
  limits.minimum_cruise_ratio = reader.Within("toolhead", "minimum_cruise_ratio", kRatio);
  // Klipper before 2024: the same, as an acceleration.
  const auto to_decel = reader.Within("toolhead", "max_accel_to_decel", kAcceleration_mm_s2);
  if (!limits.minimum_cruise_ratio && to_decel && limits.max_accel_mm_s2 > 0) {
    limits.minimum_cruise_ratio = std::clamp(1 - *to_decel / limits.max_accel_mm_s2, 0.0, 1.0);
  }
  limits.square_corner_velocity_mm_s =
      reader.Within("toolhead", "square_corner_velocity", kSpeed_mm_s, 0);
  state.active_extruder = reader.Name("toolhead", "extruder");
}

void ReadGcode(Reader& reader, GcodeModes& modes) {
  const json& move = reader.Object("gcode_move");
  modes.absolute_coordinates = BoolOr(move, "absolute_coordinates", true);
  modes.absolute_extrude = BoolOr(move, "absolute_extrude", true);
  modes.speed_factor = reader.Within("gcode_move", "speed_factor", kFactor, 1);
  modes.extrude_factor = reader.Within("gcode_move", "extrude_factor", kFactor, 1);
  reader.List("gcode_move", "homing_origin", modes.homing_origin_mm);
  reader.List("gcode_move", "gcode_position", modes.gcode_position_mm);
}

void ReadHeater(Reader& reader, const std::string& name, PrinterState& state) {
  const auto temperature_c = reader.Within(name, "temperature", kTemperature_c);
  const double target_c = reader.Within(name, "target", kTarget_c, 0);
  if (!temperature_c || !reader.Room("heaters", state.heaters.size(), kMaxHeaters)) return;
  Heater& heater = state.heaters[name];
  heater.temperature_c = *temperature_c;
  heater.target_c = target_c;
}

// Klipper reports no queue (null) for an extruder's own motor until it was synchronised with
// another's.
void ReadPressureAdvance(Reader& reader, const std::string& name, PrinterState& state) {
  const auto advance_s = reader.Within(name, "pressure_advance", kTime_s);
  if (!advance_s || !reader.Room("extruder motors", state.pressure_advance.size(), kMaxMotors)) {
    return;
  }
  PressureAdvance& motor = state.pressure_advance[name];
  motor.advance_s = *advance_s;
  motor.smooth_time_s = reader.Within(name, "smooth_time", kTime_s);
  const json* queue = Member(reader.Object(name), "motion_queue");
  if (queue != nullptr && queue->is_string()) {
    motor.motion_queue = reader.Name(name, "motion_queue");
  } else if (IsExtruder(name)) {
    motor.motion_queue = name;
  }
}

void ReadDevices(const json& known, Reader& reader, PrinterState& state) {
  for (const auto& [name, object] : known.items()) {
    if (!IsPlainName(name)) {
      continue;  // never asked for
    }
    if (IsExtruder(name) || IsExtruderStepper(name)) ReadPressureAdvance(reader, name, state);
    if (IsHeater(name)) ReadHeater(reader, name, state);
  }
}

/// True if a field's value has a plausible size for a printer's fields.
/// @param left  values and characters that the whole field may still contain
bool IsSmall(const json& value, std::size_t& left, int levels = 3) {
  const std::size_t cost = 1 + (value.is_string() ? value.get_ref<const std::string&>().size() : 0);
  if (cost > left) return false;
  left -= cost;
  if (!value.is_structured()) return true;
  return levels > 0 && value.size() <= kLongestList + 1 &&
         std::all_of(value.begin(), value.end(), [&left, levels](const json& inner) {
           return IsSmall(inner, left, levels - 1);
         });
}

}  // namespace

json WantedObjects(const std::vector<std::string>& available) {
  json wanted = {{"webhooks", {"state", "state_message"}}};
  const auto want = [&wanted](const std::string& object, std::vector<std::string> fields) {
    wanted[object] = std::move(fields);
  };
  std::size_t devices = 0;
  for (const std::string& object : available) {
    if (!IsPlainName(object) || wanted.contains(object)) continue;
    const bool device = IsHeater(object) || IsExtruderStepper(object);
    if (device && ++devices > kMaxDevices) continue;
    if (object == "toolhead") {
      want(object, {"homed_axes", "position", "print_time", "estimated_print_time", "axis_minimum",
                    "axis_maximum", "max_velocity", "max_accel", "max_accel_to_decel",
                    "minimum_cruise_ratio", "square_corner_velocity", "extruder"});
    } else if (object == "motion_report") {
      want(object, {"live_velocity"});
    } else if (object == "gcode_move") {
      want(object, {"absolute_coordinates", "absolute_extrude", "speed_factor", "extrude_factor",
                    "homing_origin", "gcode_position"});
    } else if (object == "print_stats") {
      want(object, {"state", "filename", "message", "total_duration", "filament_used"});
    } else if (object == "virtual_sdcard") {
      want(object, {"progress", "is_active"});
    } else if (object == "idle_timeout") {
      want(object, {"state"});
    } else if (object == "pause_resume") {
      want(object, {"is_paused"});
    } else if (IsExtruderStepper(object)) {
      want(object, {"pressure_advance", "smooth_time", "motion_queue"});
    } else if (IsHeater(object)) {
      want(object, {"temperature", "target", "pressure_advance", "smooth_time", "motion_queue"});
    }
  }
  return wanted;
}

void MergeStatus(json& known, const json& update, const json& wanted) {
  if (!known.is_object()) known = json::object();
  if (!update.is_object()) return;
  for (const auto& [name, fields] : wanted.items()) {
    const json* told = Member(update, name);
    if (told == nullptr || !told->is_object()) continue;
    json& object = known[name];
    if (!object.is_object()) object = json::object();
    for (const json& field : fields) {
      const auto& key = field.get_ref<const std::string&>();
      if (const json* value = Member(*told, key)) {
        std::size_t left = 10 * kLongestText;
        object[key] = IsSmall(*value, left) ? *value : json();
      }
    }
  }
}

PrinterReadiness ReadinessOf(std::string_view state) {
  for (const PrinterReadiness readiness : {PrinterReadiness::kReady, PrinterReadiness::kStartup,
                                           PrinterReadiness::kShutdown, PrinterReadiness::kError}) {
    if (state == ToString(readiness)) return readiness;
  }
  return PrinterReadiness::kDisconnected;
}

PrinterState ReadStatus(const json& known, std::string* fault) {
  PrinterState state;
  Reader reader(known);
  state.readiness = ReadinessOf(TextOr(reader.Object("webhooks"), "state", ""));
  state.message = reader.Text("webhooks", "state_message");
  ReadMotion(reader, state);
  ReadGcode(reader, state.gcode);
  ReadDevices(known, reader, state);
  state.print_state = reader.Text("print_stats", "state");
  state.print_file = reader.Text("print_stats", "filename");
  state.print_message = reader.Text("print_stats", "message");
  state.print_progress =
      std::clamp(NumberOr(reader.Object("virtual_sdcard"), "progress", 0), 0.0, 1.0);
  state.print_total_s = std::max(0.0, NumberOr(reader.Object("print_stats"), "total_duration", 0));
  state.print_filament_mm = NumberOr(reader.Object("print_stats"), "filament_used", 0);
  state.idle_state = reader.Text("idle_timeout", "state");
  state.paused = BoolOr(reader.Object("pause_resume"), "is_paused", false);
  if (fault != nullptr) *fault = reader.fault();
  return state;
}

}  // namespace trammel::machine
