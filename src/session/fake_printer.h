// Test printer in memory that records its commands and fails on request. Its methods may be called
// from several threads; its members are read while none of them runs.
#pragma once

#include <functional>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "machine/moonraker/printer.h"

namespace trammel::procedure::testing {

class FakePrinter : public machine::Printer {
 public:
  machine::PrinterState state;
  std::vector<std::string> scripts;                 ///< everything that was run, in order
  std::map<std::string, std::string> refused;       ///< first line -> what the printer answers
  std::map<std::string, bool> unknown;              ///< commands that it does not have
  bool cannot_cancel = false;                       ///< it has no [pause_resume]
  bool stopped = false;                             ///< true after EmergencyStop
  bool comes_back = true;                           ///< true if WaitUntilReady succeeds
  std::vector<std::string> deleted;                 ///< files, in order
  std::map<std::string, std::string> config_files;  ///< beside the configuration
  /// Answer of Query: at first a usual configuration.
  nlohmann::json told = {{"configfile",
                          {{"settings",
                            {{"printer", {{"kinematics", "corexy"}}},
                             {"extruder", {{"nozzle_diameter", 0.4}, {"filament_diameter", 1.75}}},
                             {"heater_bed", {{"max_temp", 120}}}}}}}};
  std::map<std::string, std::function<void(const nlohmann::json&)>> methods;  ///< registered
  std::vector<std::pair<std::string, nlohmann::json>> events;                 ///< sent, in order
  /// Answers CallServer; null: no such methods.
  std::function<Result<nlohmann::json>(const std::string&, const nlohmann::json&)> server;
  std::string lost_at;  ///< the script during which the link goes, once

  [[nodiscard]] std::size_t ScriptsRun() const {
    const std::lock_guard lock(mutex_);
    return scripts.size();
  }
  /// Returns the last script that contains this text; empty: none does.
  [[nodiscard]] std::string LastScriptWith(const std::string& part) const {
    const std::lock_guard lock(mutex_);
    for (auto script = scripts.rbegin(); script != scripts.rend(); ++script) {
      if (script->find(part) != std::string::npos) return *script;
    }
    return {};
  }
  [[nodiscard]] bool Registered(const std::string& method) const {
    const std::lock_guard lock(mutex_);
    return methods.contains(method);
  }

  FakePrinter() {
    state.readiness = machine::PrinterReadiness::kReady;
    state.homed_axes = "xyz";
    state.axis_maximum_mm = {250, 250, 250};
    state.limits = {300, 5000, 0.5, 5};
    state.active_extruder = "extruder";
    state.pressure_advance["extruder"] = {0.031, 0.04, "extruder"};
    state.heaters["extruder"] = {205, 205};
    state.heaters["heater_bed"] = {60, 60};
    state.print_state = "standby";
  }

  Result<void> Run(std::string_view script, const machine::WaitLimit&) override {
    const std::lock_guard lock(mutex_);
    scripts.emplace_back(script);
    if (state.readiness != machine::PrinterReadiness::kReady) {
      return Fail("not ready", ErrorKind::kMachine);
    }
    if (scripts.back() == lost_at) {
      lost_at.clear();
      state.readiness = machine::PrinterReadiness::kDisconnected;
      return Fail("the link is gone", ErrorKind::kMachine);
    }
    const auto refusal = refused.find(scripts.back().substr(0, scripts.back().find('\n')));
    if (refusal != refused.end()) return Fail(refusal->second, ErrorKind::kMachine);
    return {};
  }
  Result<void> FinishMoves(const machine::WaitLimit& limit) override { return Run("M400", limit); }
  Result<void> EmergencyStop(const machine::WaitLimit&) override {
    const std::lock_guard lock(mutex_);
    stopped = true;
    state.readiness = machine::PrinterReadiness::kShutdown;
    return {};
  }
  Result<machine::PrinterState> State(const machine::WaitLimit&) override { return LastState(); }
  machine::PrinterState LastState() const override {
    const std::lock_guard lock(mutex_);
    return state;
  }
  Result<machine::PrinterState> WaitUntil(
      const std::function<bool(const machine::PrinterState&)>& done, std::string_view what,
      const machine::WaitLimit&) override {
    const machine::PrinterState now = LastState();
    if (done(now)) return now;
    return Fail("waited for " + std::string(what), ErrorKind::kMachine);
  }
  Result<void> WaitUntilReady(const machine::WaitLimit&) override {
    const std::lock_guard lock(mutex_);
    if (!comes_back) return Fail("it stays away", ErrorKind::kMachine);
    state.readiness = machine::PrinterReadiness::kReady;
    return {};
  }
  Result<nlohmann::json> Query(const std::vector<machine::ObjectFields>&,
                               const machine::WaitLimit&) override {
    return told;
  }
  Result<bool> HasCommand(std::string_view name, const machine::WaitLimit&) override {
    return unknown.count(std::string(name)) == 0;
  }
  Result<void> Upload(const std::string&, std::string_view, const machine::WaitLimit&) override {
    return {};
  }
  Result<void> UploadConfig(const std::string& name, std::string_view data,
                            const machine::WaitLimit&) override {
    config_files[name] = data;
    return {};
  }
  Result<std::string> DownloadConfig(const std::string& name, std::size_t max_bytes,
                                     const machine::WaitLimit&) override {
    const auto found = config_files.find(name);
    if (found == config_files.end()) return Fail(name + ": there is no such file");
    if (found->second.size() > max_bytes) return Fail(name + ": too large");
    return found->second;
  }
  Result<void> DeleteFile(const std::string& name, const machine::WaitLimit&) override {
    deleted.push_back(name);
    return {};
  }
  Result<void> StartPrint(const std::string&, const machine::WaitLimit&) override { return {}; }
  Result<void> CancelPrint(const machine::WaitLimit&) override {
    const std::lock_guard lock(mutex_);
    scripts.emplace_back("CANCEL_PRINT");
    if (state.readiness != machine::PrinterReadiness::kReady) {
      return Fail("not ready", ErrorKind::kMachine);
    }
    if (cannot_cancel) return Fail("no callback for pause_resume/cancel", ErrorKind::kMachine);
    state.print_state = "cancelled";
    return {};
  }
  Result<std::vector<machine::Webcam>> Webcams(const machine::WaitLimit&) override {
    return std::vector<machine::Webcam>{};
  }
  Result<nlohmann::json> CallServer(const std::string& method, nlohmann::json params,
                                    const machine::WaitLimit&) override {
    if (!server) return Fail("Method not found: " + method, ErrorKind::kMachine);
    return server(method, params);
  }
  Result<void> RegisterRemoteMethod(const std::string& name,
                                    std::function<void(const nlohmann::json&)> callback,
                                    const machine::WaitLimit&) override {
    const std::lock_guard lock(mutex_);
    methods[name] = std::move(callback);
    return {};
  }
  void OnRequest(machine::RequestHandler) override {}
  void SendEvent(const std::string& event, nlohmann::json data) override {
    const std::lock_guard lock(mutex_);
    events.emplace_back(event, std::move(data));
  }
  Result<machine::ClockRelation> Clock(double, const machine::WaitLimit&) override {
    return machine::ClockRelation{};
  }
  Result<void> RecordMoves(const machine::WaitLimit&) override { return {}; }
  std::vector<machine::TrapezoidMove> ReportedMoves(double, double) override { return {}; }
  Result<std::vector<machine::TrapezoidMove>> Moves(double, double,
                                                    const machine::WaitLimit&) override {
    return std::vector<machine::TrapezoidMove>{};
  }

 private:
  mutable std::mutex mutex_;
};

}  // namespace trammel::procedure::testing
