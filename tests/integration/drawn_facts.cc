#include <fmt/format.h>

#include <cmath>

#include "printer_draws.h"

namespace trammel::test {
namespace {

using nlohmann::json;

/// Draws a number with three digits, like a user's.
double LogUniform(Random& random, double lo, double hi) {
  const double value = lo * std::pow(hi / lo, random.Uniform());
  const double digit = std::pow(10, std::floor(std::log10(value)) - 2);
  return std::round(value / digit) * digit;
}
bool Chance(Random& random, double share) { return random.Uniform() < share; }

std::string Figure(const char* name, double value) {
  return fmt::format("{} = {:.6g}", name, value);
}

// An odd value where a number or a name is told.
json Odd(Random& random) {
  return OneOf<json>(
      random, {json("300"), json("null"), json::array(), json::array({1, "a"}), json::object(),
               json(true), json(-1), json(0), json(1e300), json(-1e300), json(), json("")});
}

std::string Distort(Random& random, Draw& draw, const std::string& place) {
  json value = Odd(random);
  // Klipper does not accept an [extruder] without its diameters.
  while (value.is_null() && place.ends_with("_diameter")) value = Odd(random);
  draw.instead.emplace_back(json::json_pointer(place), value);
  return fmt::format("{} told as {}", place, value.is_null() ? "nothing" : value.dump());
}

/// A fact that is a number of the printer, drawn anew or told oddly.
Fact NumberFact(std::string name, std::vector<std::string> words, std::string place,
                std::function<double(Random&)> draw_value, std::function<void(Draw&, double)> set) {
  return {name, std::move(words),
          [name, place, draw_value, set](Random& random, Draw& draw) -> std::string {
            if (Chance(random, 0.12)) {
              std::string at = place;
              if (const auto found = at.find("ACTIVE"); found != std::string::npos) {
                at.replace(found, 6, draw.printer.active);
              }
              return Distort(random, draw, at);
            }
            const double value = draw_value(random);
            set(draw, value);
            return Figure(name.c_str(), value);
          }};
}

void AddMotionFacts(std::vector<Fact>& facts) {
  facts.push_back(NumberFact(
      "max_velocity in force", {"max_velocity"}, "/toolhead/max_velocity",
      [](Random& r) { return LogUniform(r, 1, 1e5); },
      [](Draw& d, double v) { d.printer.max_velocity_mm_s = v; }));
  facts.push_back(NumberFact(
      "max_velocity of printer.cfg", {"max_velocity", "max_extrude_only_velocity"},
      "/configfile/settings/printer/max_velocity", [](Random& r) { return LogUniform(r, 1, 1e5); },
      [](Draw& d, double v) {
        d.printer.max_velocity_mm_s = d.printer.configured_max_velocity_mm_s = v;
      }));
  facts.push_back(NumberFact(
      "max_accel in force", {"max_accel"}, "/toolhead/max_accel",
      [](Random& r) { return LogUniform(r, 1, 1e6); },
      [](Draw& d, double v) { d.printer.max_accel_mm_s2 = v; }));
  facts.push_back(NumberFact(
      "max_accel of printer.cfg", {"max_accel", "max_extrude_only_accel"},
      "/configfile/settings/printer/max_accel", [](Random& r) { return LogUniform(r, 1, 1e6); },
      [](Draw& d, double v) {
        d.printer.max_accel_mm_s2 = d.printer.configured_max_accel_mm_s2 = v;
      }));
  facts.push_back(NumberFact(
      "minimum_cruise_ratio", {"minimum_cruise_ratio"}, "/toolhead/minimum_cruise_ratio",
      [](Random& r) { return Chance(r, 0.2) ? 0.0 : r.Uniform(0, 0.999); },
      [](Draw& d, double v) { d.printer.minimum_cruise_ratio = v; }));
  facts.push_back(NumberFact(
      "square_corner_velocity", {"square_corner_velocity"}, "/toolhead/square_corner_velocity",
      [](Random& r) { return Chance(r, 0.2) ? 0.0 : LogUniform(r, 0.01, 100); },
      [](Draw& d, double v) { d.printer.square_corner_velocity_mm_s = v; }));
  facts.push_back(NumberFact(
      "max_z_velocity", {"max_z_velocity"}, "/configfile/settings/printer/max_z_velocity",
      [](Random& r) { return LogUniform(r, 0.1, 300); },
      [](Draw& d, double v) { d.printer.max_z_velocity_mm_s = v; }));
  facts.push_back({"max_angular_velocity",
                   {"max_angular_velocity", "kinematics", "reaches"},
                   [](Random& r, Draw& d) {
                     d.printer.kinematics = "polar";
                     d.printer.minimum_mm = {-150, -150, 0};
                     d.printer.maximum_mm = {150, 150, 150};
                     d.printer.max_angular_velocity_rad_s = LogUniform(r, 0.1, 1000);
                     return Figure("max_angular_velocity", *d.printer.max_angular_velocity_rad_s);
                   }});
  facts.push_back({"Klipper before 2024", {"max_accel_to_decel"}, [](Random& r, Draw& d) {
                     d.printer.before_2024 = true;
                     d.printer.minimum_cruise_ratio = r.Uniform(0, 0.99);
                     return Figure("max_accel_to_decel by a ratio", d.printer.minimum_cruise_ratio);
                   }});
}

void AddExtruderFacts(std::vector<Fact>& facts) {
  const std::string section = "/configfile/settings/ACTIVE/";
  const auto add = [&](const char* key, std::function<double(Random&)> value,
                       std::function<void(ModelExtruder&, double)> set) {
    std::vector<std::string> words = {key};
    // Klipper's defaults of what moves filament come from the nozzle.
    if (key == std::string("nozzle_diameter")) {
      words.insert(words.end(), {"nozzle of", "max_extrude_only_velocity"});
    }
    facts.push_back(NumberFact(key, words, section + key, std::move(value),
                               [set](Draw& d, double v) { set(d.extruder(), v); }));
  };
  add(
      "filament_diameter",
      [](Random& r) {
        return Chance(r, 0.5) ? OneOf<double>(r, {1.75, 1.7, 1.73, 1.78, 1.8, 2.85, 2.9, 3.0})
                              : LogUniform(r, 0.3, 10);
      },
      [](ModelExtruder& e, double v) { e.filament_diameter_mm = v; });
  add(
      "nozzle_diameter",
      [](Random& r) {
        return Chance(r, 0.5) ? OneOf<double>(r, {0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.405, 0.42, 0.5,
                                                  0.6, 0.8, 1.0, 1.2, 1.8})
                              : LogUniform(r, 0.03, 5);
      },
      [](ModelExtruder& e, double v) { e.nozzle_diameter_mm = v; });
  add(
      "min_extrude_temp", [](Random& r) { return r.Uniform(0, 320); },
      [](ModelExtruder& e, double v) { e.min_extrude_temp_c = v; });
  add(
      "max_temp", [](Random& r) { return r.Uniform(60, 500); },
      [](ModelExtruder& e, double v) { e.max_temp_c = v; });
  add(
      "max_extrude_cross_section", [](Random& r) { return LogUniform(r, 0.005, 50); },
      [](ModelExtruder& e, double v) { e.max_extrude_cross_section_mm2 = v; });
  add(
      "max_extrude_only_distance",
      [](Random& r) { return Chance(r, 0.1) ? 0.0 : LogUniform(r, 0.01, 1000); },
      [](ModelExtruder& e, double v) { e.max_extrude_only_distance_mm = v; });
  add(
      "max_extrude_only_velocity", [](Random& r) { return LogUniform(r, 0.01, 1000); },
      [](ModelExtruder& e, double v) { e.max_extrude_only_velocity_mm_s = v; });
  add(
      "max_extrude_only_accel", [](Random& r) { return LogUniform(r, 0.1, 1e5); },
      [](ModelExtruder& e, double v) { e.max_extrude_only_accel_mm_s2 = v; });
  add(
      "instantaneous_corner_velocity",
      [](Random& r) { return Chance(r, 0.2) ? 0.0 : LogUniform(r, 1e-5, 50); },
      [](ModelExtruder& e, double v) { e.instantaneous_corner_velocity_mm_s = v; });
  facts.push_back({"max_temp of the bed",
                   {"max_temp of the bed", "heater_bed"},
                   [](Random& r, Draw& d) -> std::string {
                     if (Chance(r, 0.3)) {
                       d.printer.bed_max_temp_c.reset();
                       return "no heater_bed";
                     }
                     d.printer.bed_max_temp_c = r.Uniform(20, 200);
                     return Figure("max_temp of heater_bed", *d.printer.bed_max_temp_c);
                   }});
}

void AddAdvanceFacts(std::vector<Fact>& facts) {
  facts.push_back({"pressure_advance_model", {"pressure_advance_model"}, [](Random& r, Draw& d) {
                     d.extruder().pressure_advance_model =
                         OneOf<std::string>(r, {"linear", "Linear", "tanh", "recipr"});
                     return "pressure_advance_model = " + d.extruder().pressure_advance_model;
                   }});
  facts.push_back(NumberFact(
      "smooth_time", {"smooth_time"}, "/ACTIVE/smooth_time",
      [](Random& r) { return LogUniform(r, 0.001, 0.2); },
      [](Draw& d, double v) {
        const auto own = d.printer.motors.find(d.printer.active);
        if (own != d.printer.motors.end()) own->second.smooth_time_s = v;
      }));
  facts.push_back(NumberFact(
      "pressure_advance", {"pressure advance", "pressure_advance"}, "/ACTIVE/pressure_advance",
      [](Random& r) { return Chance(r, 0.3) ? 0.0 : LogUniform(r, 0.001, 3); },
      [](Draw& d, double v) {
        const auto own = d.printer.motors.find(d.printer.active);
        if (own != d.printer.motors.end()) own->second.pressure_advance_s = v;
      }));
  facts.push_back(
      {"extruder_stepper", {"belted"}, [](Random& r, Draw& d) {
         const std::string queue = OneOf<std::string>(r, {d.printer.active, "", "extruder1"});
         d.printer.motors["extruder_stepper belted"] = {queue, LogUniform(r, 0.01, 0.2)};
         return "extruder_stepper belted on '" + queue + "'";
       }});
  facts.push_back(
      {"stepper of the extruder", {"stepper", "push"}, [](Random& r, Draw& d) -> std::string {
         const std::string own = d.printer.active;
         switch (r.Below(4)) {
           case 0:
             d.printer.motors.erase(own);
             return "no stepper of its own";
           case 1:
             d.printer.motors.erase(own);
             d.printer.motors["extruder_stepper belted"] = {own};
             return "another stepper in its place";
           case 2:
             d.printer.extruders["extruder7"] = {};
             d.printer.motors[own] = {"extruder7"};
             return "its stepper on extruder7";
           default:
             d.printer.motors[own].synchronised = false;
             return "its stepper never synchronised";
         }
       }});
  facts.push_back(
      {"active extruder", {"extruder1", "nozzle of"}, [](Random& r, Draw& d) -> std::string {
         d.printer.extruders["extruder1"].nozzle_diameter_mm = OneOf<double>(r, {0.25, 0.4, 0.6});
         d.printer.motors["extruder1"] = {Chance(r, 0.3) ? d.printer.active
                                                         : std::string("extruder1")};
         if (Chance(r, 0.6)) {
           d.printer.active = "extruder1";
           return "extruder1 active";
         }
         return "extruder1 beside it, on " + d.printer.motors["extruder1"].queue;
       }});
}

void AddPlaceFacts(std::vector<Fact>& facts) {
  facts.push_back({"kinematics", {"kinematics", "reaches"}, [](Random& r, Draw& d) {
                     d.printer.kinematics = OneOf<std::string>(
                         r, {"cartesian", "corexy", "corexz", "hybrid_corexy", "hybrid_corexz",
                             "delta", "deltesian", "polar", "rotary_delta", "winch",
                             "generic_cartesian", "none", "limited_corexy", "morgan_scara",
                             "CoreXY", ""});
                     const bool about = d.printer.kinematics == "delta" ||
                                        d.printer.kinematics == "rotary_delta" ||
                                        d.printer.kinematics == "polar";
                     if (about) {
                       const double radius_mm = LogUniform(r, 20, 500);
                       for (const std::size_t axis : {0U, 1U}) {
                         d.printer.minimum_mm[axis] = -radius_mm;
                         d.printer.maximum_mm[axis] = radius_mm;
                       }
                     }
                     if (d.printer.kinematics == "none") {
                       d.printer.minimum_mm = d.printer.maximum_mm = {0, 0, 0};
                     }
                     return "kinematics = " + d.printer.kinematics;
                   }});
  facts.push_back({"bed", {"reach", "bed"}, [](Random& r, Draw& d) -> std::string {
                     const bool round =
                         d.printer.minimum_mm[0] == -d.printer.maximum_mm[0] &&
                         (d.printer.kinematics == "delta" || d.printer.kinematics == "polar" ||
                          d.printer.kinematics == "rotary_delta");
                     const double same_mm = LogUniform(r, 5, 3000);
                     for (const std::size_t axis : {0U, 1U}) {
                       const double size_mm = Chance(r, 0.5) ? same_mm : LogUniform(r, 5, 3000);
                       const double from_mm =
                           round || Chance(r, 0.3)
                               ? -(round ? same_mm : size_mm) / 2
                               : OneOf<double>(r, {0, -2, -20, 15, -size_mm, 60});
                       d.printer.minimum_mm[axis] = from_mm;
                       d.printer.maximum_mm[axis] = from_mm + (round ? same_mm : size_mm);
                     }
                     return fmt::format("bed X {:.4g} ... {:.4g}, Y {:.4g} ... {:.4g}",
                                        d.printer.minimum_mm[0], d.printer.maximum_mm[0],
                                        d.printer.minimum_mm[1], d.printer.maximum_mm[1]);
                   }});
  facts.push_back(
      {"axis ranges told", {"reach"}, [](Random& r, Draw& d) {
         return Distort(
             r, d, OneOf<std::string>(r, {"/toolhead/axis_minimum", "/toolhead/axis_maximum"}));
       }});
  facts.push_back({"height", {"Z", "reach"}, [](Random& r, Draw& d) {
                     d.printer.minimum_mm[2] = OneOf<double>(r, {0, -5, 0.1, 0.3, 2});
                     d.printer.maximum_mm[2] = LogUniform(r, 3, 1000);
                     return fmt::format("Z {:.4g} ... {:.4g}", d.printer.minimum_mm[2],
                                        d.printer.maximum_mm[2]);
                   }});
  facts.push_back(
      {"G-code offset", {"offset", "reach"}, [](Random& r, Draw& d) -> std::string {
         if (Chance(r, 0.1)) return Distort(r, d, "/gcode_move/homing_origin");
         const auto any = [&] {
           return OneOf<double>(r, {0, r.Uniform(-1, 1), r.Uniform(-20, 20), r.Uniform(-300, 300)});
         };
         d.printer.origin_mm = {any(), any(),
                                OneOf<double>(r, {0, r.Uniform(-0.5, 0.5), r.Uniform(-3, 3)})};
         return fmt::format("G-code offset {:.4g}, {:.4g}, {:.4g}", d.printer.origin_mm[0],
                            d.printer.origin_mm[1], d.printer.origin_mm[2]);
       }});
}

void AddModeFacts(std::vector<Fact>& facts) {
  facts.push_back(NumberFact(
      "speed_factor", {"speed_factor", "M220"}, "/gcode_move/speed_factor",
      [](Random& r) { return LogUniform(r, 0.01, 10); },
      [](Draw& d, double v) { d.printer.speed_factor = v; }));
  facts.push_back(NumberFact(
      "extrude_factor", {"extrude_factor", "M221"}, "/gcode_move/extrude_factor",
      [](Random& r) { return LogUniform(r, 0.1, 5); },
      [](Draw& d, double v) { d.printer.extrude_factor = v; }));
  facts.push_back({"modes", {"absolute"}, [](Random& r, Draw& d) {
                     d.printer.absolute_coordinates = Chance(r, 0.5);
                     d.printer.absolute_extrude = Chance(r, 0.5);
                     return fmt::format("absolute {} {}", d.printer.absolute_coordinates,
                                        d.printer.absolute_extrude);
                   }});
  facts.push_back({"sections", {"section"}, [](Random& r, Draw& d) {
                     const std::string section = OneOf<std::string>(
                         r, {"gcode_arcs", "input_shaper", "skew_correction", "bed_mesh",
                             "firmware_retraction", "pause_resume", "dual_carriage",
                             "dual_carriage carriage_u", "exclude_object"});
                     d.printer.other_sections.push_back(section);
                     return "[" + section + "]";
                   }});
  facts.push_back(
      {"missing objects", {"state", "reaches", "reports", "[heater_bed]"}, [](Random& r, Draw& d) {
         const std::string place = OneOf<std::string>(
             r, {"/configfile", "/configfile/settings", "/configfile/settings/printer",
                 "/gcode_move", "/configfile/settings/" + d.printer.active,
                 "/configfile/settings/heater_bed", "/toolhead/extruder", "/idle_timeout"});
         d.instead.emplace_back(json::json_pointer(place), json());
         return "without " + place;
       }});
}

}  // namespace

std::vector<Fact> AllFacts() {
  std::vector<Fact> facts;
  AddMotionFacts(facts);
  AddExtruderFacts(facts);
  AddAdvanceFacts(facts);
  AddPlaceFacts(facts);
  AddModeFacts(facts);
  return facts;
}

std::vector<std::string> DrawSettings(Random& random) {
  static const std::vector<std::vector<std::string>> kKinds = {
      {"acceleration=2500", "acceleration=6000", "acceleration=12000"},
      {"filament_diameter=1.75", "filament_diameter=1.72", "filament_diameter=2.85"},
      {"nozzle_diameter=0.4", "nozzle_diameter=0.6"},
      {"line_width=0.45", "line_width=0.6"},
      {"layer_height=0.2", "layer_height=0.3"},
      {"line_length=40", "line_length=60"},
      {"bed_shape=rectangle", "bed_shape=ellipse"},
      {"bed_size_x=200", "bed_size_y=200"},
      {"position_x=20", "position_y=30"},
      {"retract_length=5", "retract_length=0"},
      {"prime_length=10"},
      {"nozzle_temperature=240", "nozzle_temperature=190"},
      {"bed_temperature=0", "bed_temperature=90"},
      {"z_offset=-0.1", "z_offset=0.1"},
      {"park_lift=100"},
      {"corner_mark=true"},
      {"columns=2"}};
  std::vector<std::string> settings;
  const double any = random.Uniform();
  const int count = any < 0.4 ? 0 : any < 0.8 ? 1 : 2;
  for (int i = 0; i < count; ++i) settings.push_back(OneOf(random, OneOf(random, kKinds)));
  return settings;
}

bool Hides(const std::string& hiding, const std::string& hidden) {
  return (hiding == "missing objects" && hidden == "G-code offset") ||
         (hiding == "axis ranges told" &&
          (hidden == "height" || hidden == "bed" || hidden == "kinematics"));
}

}  // namespace trammel::test
