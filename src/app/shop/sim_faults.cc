#include "app/shop/sim_faults.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <string_view>

namespace trammel::app {
namespace {

template <class Faults>
struct FaultSwitch {
  const char* name;
  void (*set)(double value, Faults&);
};

using CameraFaults = std::vector<sim::CameraFault>;

template <sim::CameraFaultKind kind>
void AddCameraFault(double at_s, CameraFaults& faults) {
  sim::CameraFault fault;
  fault.kind = kind;
  fault.at_s = at_s;
  if (kind == sim::CameraFaultKind::kHalfJpeg) fault.duration_s = 0;
  faults.push_back(fault);
}

constexpr FaultSwitch<PrinterFaults> kPrinterFaults[] = {
    {"refuse-move",
     [](double v, PrinterFaults& f) { f.klipper.refuse_move = static_cast<int>(v); }},
    {"refuse-laser-move",
     [](double v, PrinterFaults& f) { f.klipper.refuse_laser_move = static_cast<int>(v); }},
    {"shutdown-at-laser-move",
     [](double v, PrinterFaults& f) { f.klipper.shutdown_at_laser_move = static_cast<int>(v); }},
    {"restart-at-laser-move",
     [](double v, PrinterFaults& f) { f.klipper.restart_at_laser_move = static_cast<int>(v); }},
    {"shutdown-at-script",
     [](double v, PrinterFaults& f) { f.klipper.shutdown_at_script = static_cast<int>(v); }},
    {"restart-at-script",
     [](double v, PrinterFaults& f) { f.klipper.restart_at_script = static_cast<int>(v); }},
    {"shutdown-at", [](double v, PrinterFaults& f) { f.klipper.shutdown_at_s = v; }},
    {"restart-at", [](double v, PrinterFaults& f) { f.klipper.restart_at_s = v; }},
    {"weak-nozzle",
     [](double v, PrinterFaults& f) {
       f.klipper.weak_heater = "extruder";
       f.klipper.weak_heater_c = v;
     }},
    {"weak-bed",
     [](double v, PrinterFaults& f) {
       f.klipper.weak_heater = "heater_bed";
       f.klipper.weak_heater_c = v;
     }},
    {"blind-to-heaters", [](double v, PrinterFaults& f) { f.klipper.verify_heaters = v == 0; }},
    {"deaf-tools", [](double v, PrinterFaults& f) { f.klipper.deaf_tools = v != 0; }},
    {"included-tools", [](double v, PrinterFaults& f) { f.klipper.included_tools = v != 0; }},
    {"printing", [](double v, PrinterFaults& f) { f.klipper.printing_at_start = v != 0; }},
    {"error", [](double v, PrinterFaults& f) { f.klipper.error_at_start = v != 0; }},
    {"startup", [](double v, PrinterFaults& f) { f.klipper.startup_s = v; }},
    {"close-at", [](double v, PrinterFaults& f) { f.server.close_at_s = v; }},
    {"close-at-laser-move",
     [](double v, PrinterFaults& f) { f.server.close_at_laser_move = static_cast<int>(v); }},
    {"refuse-for", [](double v, PrinterFaults& f) { f.server.refuse_for_s = v; }},
    {"silent-from", [](double v, PrinterFaults& f) { f.server.silent_from_s = v; }},
    {"answer-delay", [](double v, PrinterFaults& f) { f.server.answer_delay_s = v; }},
};

constexpr FaultSwitch<CameraFaults> kCameraFaults[] = {
    {"camera-stall-at", AddCameraFault<sim::CameraFaultKind::kStall>},
    {"camera-close-at", AddCameraFault<sim::CameraFaultKind::kClose>},
    {"camera-half-at", AddCameraFault<sim::CameraFaultKind::kHalfJpeg>},
    {"camera-size-at", AddCameraFault<sim::CameraFaultKind::kSizeChange>},
    {"camera-black-at", AddCameraFault<sim::CameraFaultKind::kBlack>},
    {"camera-laserless-at", AddCameraFault<sim::CameraFaultKind::kLaserAbsent>},
    {"camera-drop",
     [](double v, CameraFaults& f) {
       sim::CameraFault fault;
       fault.kind = sim::CameraFaultKind::kDropFrames;
       fault.fraction = std::min(1.0, v);
       f.push_back(fault);
     }},
};

template <class Table>
std::string NamesIn(const Table& table) {
  std::string names;
  for (const auto& fault : table) {
    names += fmt::format("{}{}", names.empty() ? "" : ", ", fault.name);
  }
  return names;
}

// Whether the table has the name.
template <class Table, class Faults>
bool SetIn(const Table& table, std::string_view name, double value, Faults* faults) {
  if (faults == nullptr) return false;
  for (const auto& fault : table) {
    if (name != fault.name) continue;
    fault.set(value, *faults);
    return true;
  }
  return false;
}

}  // namespace

std::string PrinterFaultNames() { return NamesIn(kPrinterFaults); }
std::string CameraFaultNames() { return NamesIn(kCameraFaults); }

Result<void> SetFault(const std::string& text, PrinterFaults* printer, CameraFaults* camera) {
  constexpr double kLargest = 1e6;
  const std::size_t equals = text.find('=');
  double value = 0;
  char rest = 0;
  const bool number = equals != std::string::npos &&
                      std::sscanf(text.c_str() + equals + 1, "%lf%c", &value, &rest) == 1 &&
                      value >= 0 && value <= kLargest;
  if (!number) {
    return Fail(fmt::format("--fault {}: must be NAME=NUMBER with a number within 0 ... {}",
                            text.substr(0, 60), kLargest));
  }
  const std::string_view name = std::string_view(text).substr(0, equals);
  if (SetIn(kPrinterFaults, name, value, printer) || SetIn(kCameraFaults, name, value, camera)) {
    return {};
  }
  std::string names = printer != nullptr ? PrinterFaultNames() : "";
  if (camera != nullptr) names += (names.empty() ? "" : ", ") + CameraFaultNames();
  return Fail(
      fmt::format("--fault {}: no such fault here; there are {}", text.substr(0, 60), names));
}

}  // namespace trammel::app
