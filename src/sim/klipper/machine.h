// Virtual Klipper: a state machine that reads G-code and moves, driven by a clock that is passed
// in. Not thread-safe.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/result.h"
#include "sim/klipper/cell_probe.h"
#include "sim/klipper/config.h"
#include "sim/klipper/history.h"
#include "sim/klipper/motion_queue.h"

namespace trammel::sim {

enum class KlippyState { kDisconnected, kStartup, kReady, kShutdown, kError };

/// Text of webhooks.state_message if the config has an error.
extern const char* const kConfigError;

/// Spelling of webhooks.state.
[[nodiscard]] const char* ToString(KlippyState state);

/// An empty text is one empty line.
[[nodiscard]] std::vector<std::string> SplitLines(const std::string& text);

/// Event that Klipper sends to its clients.
struct KlipperEvent {
  enum class Kind { kResponse, kScriptDone, kRemoteCall, kDisconnected, kReady };
  struct Argument {
    std::string key;
    std::string text;
    std::optional<double> number;  ///< if numeric
  };
  Kind kind = Kind::kResponse;
  std::string text;                  ///< response text, or method of a remote call
  std::uint64_t script = 0;          ///< completed script
  std::optional<std::string> error;  ///< script error
  std::vector<Argument> arguments;   ///< of a remote call
};

/// State that SAVE_GCODE_STATE saves. Axes: x, y, z, e.
struct GcodeState {
  bool absolute = true;
  bool absolute_extrude = true;
  std::array<double, 4> base_mm{};
  std::array<double, 4> last_mm{};
  std::array<double, 4> homing_mm{};
  double speed_mm_s = 25;
  double speed_factor = 1;
  double extrude_factor = 1;
};

/// Settings of the toolhead that G-code changes.
struct MotionSettings {
  double max_velocity_mm_s = 0;
  double max_accel_mm_s2 = 0;
  double square_corner_velocity_mm_s = 0;
  double minimum_cruise_ratio = 0;
};

/// Motor that pushes filament.
struct ExtruderMotor {
  double pressure_advance_s = 0;
  double smooth_time_s = 0;
  /// Extruder whose moves the motor follows; empty: its own's, for an [extruder_stepper] none's.
  std::string motion_queue;
};

/// Print from a file. Times are the machine's.
struct FilePrint {
  std::string filename;
  std::vector<std::string> lines;
  std::size_t next = 0;  ///< index of the next line
  std::size_t size_bytes = 0;
  std::size_t read_bytes = 0;
  bool loaded = false;
  bool running = false;
  bool paused = false;
  std::string state = "standby";  ///< as in print_stats
  std::string message;
  double started_s = 0;
  double ended_s = 0;
  double e_start_mm = 0;
};

/// Runtime state of a tool of klipper-toolchanger.
struct ToolState {
  std::array<double, 3> offset_mm{};
  std::map<std::string, std::string> parameters;  ///< changed parameters, in Python notation
};

class VirtualKlipper;

/// Condition for a script: true when it may continue; an error fails the script.
using Wait = std::function<Result<bool>(VirtualKlipper&)>;

class VirtualKlipper {
 public:
  VirtualKlipper(KlipperConfig config, KlipperFaults faults);
  VirtualKlipper(const VirtualKlipper&) = delete;
  VirtualKlipper& operator=(const VirtualKlipper&) = delete;

  /// Advances the clock; times before now() change nothing. Time is a grid of 2 ms, so that the
  /// frequency of calls does not matter.
  void Advance(double now_s);
  [[nodiscard]] double now_s() const { return now_s_; }
  /// Returns the latest time passed to Advance(), between two points of the grid: as in Klipper,
  /// the status is that of the moment of the query.
  [[nodiscard]] double clock_s() const { return clock_s_; }

  /// Queues a script; its kScriptDone has the returned number.
  std::uint64_t RunScript(const std::string& script);
  /// Not queued, as over the API.
  void EmergencyStop();
  void Restart();
  /// Returns the events since the last call, in order.
  [[nodiscard]] std::vector<KlipperEvent> TakeEvents();

  /// Files of the virtual SD card, by name.
  [[nodiscard]] std::map<std::string, std::string>& files() { return files_; }
  [[nodiscard]] const std::map<std::string, std::string>& files() const { return files_; }
  /// Files beside the configuration, by name.
  struct ConfigFile {
    std::string data;
    double modified_s = 0;  ///< since 1970
  };
  void StoreConfigFile(const std::string& name, std::string data, double modified_s) {
    config_files_[name] = {std::move(data), modified_s};
  }
  [[nodiscard]] const std::map<std::string, ConfigFile>& config_files() const {
    return config_files_;
  }
  /// Methods that clients registered since the last start.
  void RegisterRemoteMethod(const std::string& name) { remote_methods_[name] = true; }

  // Interface for the commands, the status and tests:

  [[nodiscard]] const KlipperConfig& config() const { return config_; }
  [[nodiscard]] const KlipperFaults& faults() const { return faults_; }
  /// Faults may be added during a run. Those read only at its start (another job, a config error, a
  /// weak heater) remain unchanged.
  [[nodiscard]] KlipperFaults& faults() { return faults_; }
  /// Access as for an edit of printer.cfg.
  [[nodiscard]] std::map<std::string, MacroConfig>& macros() { return config_.macros; }
  [[nodiscard]] std::optional<LoadCellConfig>& load_cell() { return config_.load_cell; }
  [[nodiscard]] std::vector<ToolConfig>& tool_configs() { return config_.tools; }
  [[nodiscard]] KlippyState state() const { return state_; }
  [[nodiscard]] const std::string& state_message() const { return state_message_; }
  [[nodiscard]] History& history() { return history_; }
  [[nodiscard]] const History& history() const { return history_; }
  [[nodiscard]] MotionQueue& motion() { return motion_; }
  [[nodiscard]] const MotionQueue& motion() const { return motion_; }
  /// Returns the print time at now().
  [[nodiscard]] double print_now_s() const { return now_s_ - epoch_s_; }
  [[nodiscard]] double PrintTimeAt(double time_s) const { return time_s - epoch_s_; }
  /// Returns the head's true position and speed, despite Klipper's.
  [[nodiscard]] HeadState TrueHead(double time_s) const;
  [[nodiscard]] bool busy() const { return !scripts_.empty(); }

  /// Null if the printer has no load cell.
  [[nodiscard]] CellProbe* cell() { return cell_.get(); }
  [[nodiscard]] const CellProbe* cell() const { return cell_.get(); }

  void Respond(std::string text);
  /// "// " before each line.
  void Inform(const std::string& text);
  void Shutdown(const std::string& reason);
  void Record(const std::string& name, double value);
  /// Runs a function at a print time, or at once if it has passed.
  void At(double print_time_s, std::function<void()> function);
  /// Queues internal lines of the printer.
  void RunInternal(const std::vector<std::string>& lines);
  void CallRemote(KlipperEvent event);
  void SetPin(const std::string& name, double value);
  void SetHeaterTarget(Heater& heater, double target_c);
  [[nodiscard]] Heater* FindHeater(const std::string& name);
  /// Returns all heaters: the nozzle's, the bed's, then those of further tools.
  [[nodiscard]] std::vector<Heater*> Heaters();
  /// Returns the heater of the active extruder.
  [[nodiscard]] const Heater& ActiveNozzle() const;
  [[nodiscard]] const ExtruderMotor& ActiveMotor() const { return motors.at(active_extruder); }
  void MindSettings(SettingsRule rule);
  void SetMotor(const std::string& section, const ExtruderMotor& motor);

  GcodeState gcode;
  std::map<std::string, GcodeState> saved;
  MotionSettings settings;
  /// Motors by section: "extruder", "extruder1", "extruder_stepper belted".
  std::map<std::string, ExtruderMotor> motors;
  /// Limits and pressure advance saved by a macro until it has restored them.
  std::optional<std::pair<MotionSettings, std::map<std::string, ExtruderMotor>>> kept_settings;
  bool kept_in_print = false;            ///< true if by a file: restored even if it ends early
  std::array<double, 4> commanded_mm{};  ///< the toolhead's last queued place: x, y, z, e
  std::array<bool, 3> homed{};
  /// True position of the head minus Klipper's.
  std::array<double, 3> physical_offset_mm{};
  Heater nozzle;
  Heater bed;
  std::vector<Heater> more_nozzles;          ///< "extruder1", ...: of the tools that there are
  std::string active_extruder = "extruder";  ///< the one that G1 E moves
  int active_tool = -1;                      ///< for klipper-toolchanger; -1: none selected
  std::map<std::string, double> pins;
  std::map<std::string, double> delayed_at_s;  ///< machine time at which a delayed_gcode runs
  FilePrint print;
  std::string idle_state = "Idle";
  double active_since_s = 0;
  bool save_config_pending = false;
  /// Values for SAVE_CONFIG to write: by section and option.
  std::map<std::string, std::map<std::string, std::string>> pending_items;
  std::map<int, ToolState> tools;  ///< by number
  double last_probe_z_mm = 0;
  std::map<std::string, std::map<std::string, std::string>> kept;  ///< stored by macros; upper case
  std::map<std::string, std::string> saved_variables;  ///< [save_variables]: JSON; restarts keep it
  double plate_cleaned_s = 0;  ///< nothing printed before lies on the plate any more
  int xy_moves = 0;
  int laser_moves = 0;

 private:
  struct Frame {
    std::vector<std::string> lines;
    std::size_t next = 0;
  };
  struct Script {
    std::uint64_t id = 0;  ///< 0: the printer's own
    bool from_file = false;
    std::vector<Frame> frames;
    Wait wait;
  };

  void Reset();
  void StopHead();
  void StepRestart();
  void SetState(KlippyState state, const std::string& message);
  void Step();
  void StepScripts();
  /// False if the script at the front has to wait.
  bool StepScript();
  void FinishScript(const std::optional<std::string>& error);
  Result<void> RunLine(const std::string& text);
  void StepHeaters();
  void StepCell();
  void StepTimers();
  void StepIdle();
  void StepFaults();
  void StepFile();

  KlipperConfig config_;
  KlipperFaults faults_;
  double now_s_ = 0;
  double clock_s_ = 0;
  std::int64_t tick_ = 0;
  double epoch_s_ = 0;
  KlippyState state_ = KlippyState::kDisconnected;
  std::string state_message_;
  double state_since_s_ = 0;
  std::optional<double> restart_at_s_;
  std::optional<double> ready_at_s_;
  std::optional<double> stopped_at_s_;  ///< the head stands since a shutdown
  HeadState stopped_head_;
  std::deque<Script> scripts_;
  std::uint64_t next_script_ = 1;
  std::multimap<double, std::function<void()>> timed_;  ///< sorted by print time
  std::map<std::string, bool> remote_methods_;
  std::map<std::string, std::string> files_;
  std::map<std::string, ConfigFile> config_files_;
  std::vector<KlipperEvent> events_;
  History history_;
  MotionQueue motion_;
  std::unique_ptr<CellProbe> cell_;
  double last_active_s_ = 0;
};

}  // namespace trammel::sim
