// Interface to a 3D printer: its state, and the operations of a procedure. Implemented by
// MoonrakerPrinter.
#pragma once

#include <array>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "machine/moonraker/link/rpc.h"
#include "machine/net/wait.h"

namespace trammel::machine {

/// Clock b as a straight line over clock a, b = b0 + rate · (a − a0), with the error bound from the
/// samples.
struct ClockLine {
  double a0_s = 0;  ///< near the tightest bound
  double b0_s = 0;
  double rate = 1;             ///< seconds of b per second of a; 1 up to the drift of two crystals
  double half_width_s = 0;     ///< at a0: b is within ± this
  double half_width_rate = 0;  ///< grows by this per second away from a0

  [[nodiscard]] double BFromA(double a_s) const { return b0_s + rate * (a_s - a0_s); }
  [[nodiscard]] double AFromB(double b_s) const { return a0_s + (b_s - b0_s) / rate; }
  /// ± bound of b at a, seconds.
  [[nodiscard]] double HalfWidth(double a_s) const {
    const double away_s = a_s > a0_s ? a_s - a0_s : a0_s - a_s;
    return half_width_s + half_width_rate * away_s;
  }
};

/// host: this process's CLOCK_MONOTONIC (std::chrono::steady_clock). print: the firmware's print
/// time.
struct ClockRelation {
  ClockLine print_from_host;
  int samples = 0;  ///< number used for the relation

  [[nodiscard]] double PrintTimeOf(double host_s) const { return print_from_host.BFromA(host_s); }
  [[nodiscard]] double HostTimeOf(double print_s) const { return print_from_host.AFromB(print_s); }
  /// ± bound of PrintTimeOf(host), seconds; divide by √3 for a standard uncertainty.
  [[nodiscard]] double PrintTimeBound(double host_s) const {
    return print_from_host.HalfWidth(host_s);
  }
};

/// Readiness of the firmware for commands. kDisconnected: the server runs, but nothing behind it.
enum class PrinterReadiness { kReady, kStartup, kShutdown, kError, kDisconnected };

/// "ready", "startup", "shutdown", "error" or "disconnected".
[[nodiscard]] std::string_view ToString(PrinterReadiness readiness);

struct Heater {
  double temperature_c = 0;
  double target_c = 0;  ///< 0: off
};

/// Pressure advance of the motor of an extruder or of an [extruder_stepper].
struct PressureAdvance {
  double advance_s = 0;
  std::optional<double> smooth_time_s;
  std::string motion_queue = {};  ///< the extruder whose filament it moves; empty: none's now

  bool operator==(const PressureAdvance&) const = default;
};

struct VelocityLimits {
  double max_velocity_mm_s = 0;
  double max_accel_mm_s2 = 0;
  std::optional<double> minimum_cruise_ratio;  ///< 0 … 1; absent in old firmware
  double square_corner_velocity_mm_s = 0;
};

/// Modes and offsets of the G-code interpreter that a script may change and must restore.
struct GcodeModes {
  bool absolute_coordinates = true;
  bool absolute_extrude = true;
  double speed_factor = 1;                    ///< M220
  double extrude_factor = 1;                  ///< M221
  std::array<double, 4> homing_origin_mm{};   ///< G-code offset, x y z e
  std::array<double, 4> gcode_position_mm{};  ///< the last commanded position, x y z e
};

/// Lists are x y z e unless stated otherwise, in the printer's own coordinates. A field that the
/// printer has not reported is absent, empty, or at an unambiguous default.
struct PrinterState {
  PrinterReadiness readiness = PrinterReadiness::kDisconnected;
  std::string message;  ///< the firmware's own words, for example why it shut down

  std::string homed_axes;               ///< subset of "xyz"; valid only if ready
  std::array<double, 4> position_mm{};  ///< end of the last move that was planned
  std::array<double, 3> axis_minimum_mm{};
  std::array<double, 3> axis_maximum_mm{};
  VelocityLimits limits;
  std::string active_extruder;  ///< "extruder", "extruder1", …
  /// Pressure advance of all motors that push filament, by section of the configuration:
  /// "extruder", "extruder1", "extruder_stepper belted". An extruder without a motor has none.
  std::map<std::string, PressureAdvance> pressure_advance;
  GcodeModes gcode;

  std::map<std::string, Heater> heaters;  ///< "extruder", "heater_bed", "heater_generic chamber"

  std::string print_state;    ///< "standby", "printing", "paused", "complete", "cancelled", "error"
  std::string print_file;     ///< the file being or last printed, empty where none
  std::string print_message;  ///< reason for a failed print
  double print_progress = 0;  ///< 0 … 1 of the file's bytes
  double print_total_s = 0;   ///< elapsed time of the current or last print
  double print_filament_mm = 0;  ///< … and how much filament its moves have asked for
  std::string idle_state;        ///< "Idle", "Ready", "Printing" (any motion)
  bool paused = false;

  /// Scripts of this client whose wait ended (time limit or interruption), but which the printer
  /// has not answered yet.
  int abandoned_scripts = 0;
};

/// Returns the value of the active extruder's own motor; absent if it has none, or none is
/// reported.
[[nodiscard]] std::optional<double> ActiveAdvance_s(const PrinterState& state);

/// Returns the cause at the head of a firmware's message.
[[nodiscard]] std::string FirstLine(std::string_view message);

/// Returns the G-code name of a section's object (EXTRUDER=, HEATER=): "belted" of
/// "extruder_stepper belted".
[[nodiscard]] std::string NameInGcode(std::string_view section);

/// Object of the printer and its fields to query; no fields: all of them.
struct ObjectFields {
  std::string object;
  std::vector<std::string> fields;
};

/// A camera as the server lists it.
struct Webcam {
  std::string name;
  std::string service;  ///< "mjpegstreamer", "mjpegstreamer-adaptive", "webrtc-camerastreamer", …
  std::string stream_url;  ///< absolute; the server's relative ones are resolved
  bool enabled = true;
};

/// Piece of motion with constant acceleration, as planned by the firmware.
struct TrapezoidMove {
  double print_time_s = 0;            ///< start time
  double duration_s = 0;              ///< >= 0
  double start_velocity_mm_s = 0;     ///< along direction
  double acceleration_mm_s2 = 0;      ///< along direction, signed
  std::array<double, 3> start_mm{};   ///< x y z
  std::array<double, 3> direction{};  ///< unit vector, or zero where nothing moves
};

/// Printer that accepts G-code. Thread-safe: any call from any thread.
///
/// All failures are kMachine, or kInterrupted if the limit's stop token ended the wait. The message
/// states the attempt, the cause and the remedy, on request with the last messages exchanged. A
/// lost connection is restored in the background; calls fail until then.
class Printer {
 public:
  virtual ~Printer() = default;

  /// Runs G-code lines and returns once the last one was read: about 2 s of motion may still be
  /// queued, so call FinishMoves before anything that needs the head in place.
  /// Fails on an error answer, on a line that starts with `!!`, on an unknown command (which the
  /// firmware itself calls a success), on shutdown, disconnect and a lost link. Lines before the
  /// failing one were executed. If the wait ends first (time limit, interruption), the script
  /// continues on the printer; the message says so, and abandoned_scripts counts it.
  [[nodiscard]] virtual Result<void> Run(std::string_view script, const WaitLimit& limit) = 0;

  /// Waits until the head has stopped at the end of the last move (M400).
  [[nodiscard]] virtual Result<void> FinishMoves(const WaitLimit& limit) = 0;

  /// Stops everything at once: motion, heaters, pins. Does not queue behind running scripts. The
  /// printer then needs a FIRMWARE_RESTART.
  [[nodiscard]] virtual Result<void> EmergencyStop(const WaitLimit& limit) = 0;

  /// Queries the printer now. Succeeds in any readiness, if the server answers.
  [[nodiscard]] virtual Result<PrinterState> State(const WaitLimit& limit) = 0;

  /// Returns the last state that the printer sent unasked (at most about 0.3 s old while
  /// connected); does not wait. readiness is kDisconnected while the link is down.
  [[nodiscard]] virtual PrinterState LastState() const = 0;

  /// Waits until `done` is true, checked for every state received. Fails early when the printer
  /// leaves "ready", unless `done` is true for that state.
  /// @param what  ends the sentence "waited … s for …", for example "the nozzle to cool to 70 °C".
  [[nodiscard]] virtual Result<PrinterState> WaitUntil(
      const std::function<bool(const PrinterState&)>& done, std::string_view what,
      const WaitLimit& limit) = 0;

  /// Waits until the link is up and the firmware is ready, through restarts and reconnects.
  [[nodiscard]] virtual Result<void> WaitUntilReady(const WaitLimit& limit) = 0;

  /// Returns the raw status: an object with one member per queried object; unknown objects are
  /// empty. For data outside PrinterState, such as the configuration's settings.
  [[nodiscard]] virtual Result<nlohmann::json> Query(const std::vector<ObjectFields>& objects,
                                                     const WaitLimit& limit) = 0;

  /// True if the printer has a command or macro (any case).
  [[nodiscard]] virtual Result<bool> HasCommand(std::string_view name, const WaitLimit& limit) = 0;

  /// Stores a G-code file among the printable files and replaces one of the same name.
  /// @param name  relative, for example "trammel/pattern.gcode".
  [[nodiscard]] virtual Result<void> Upload(const std::string& name, std::string_view gcode,
                                            const WaitLimit& limit) = 0;
  /// Stores a file beside the printer's configuration, where front ends list and show it, and
  /// replaces one of the same name.
  /// @param name  relative, for example "trammel/pa.png".
  [[nodiscard]] virtual Result<void> UploadConfig(const std::string& name, std::string_view data,
                                                  const WaitLimit& limit) = 0;
  /// Reads a file beside the printer's configuration.
  /// Errors: kInput: no such file, or it has more bytes; kMachine.
  [[nodiscard]] virtual Result<std::string> DownloadConfig(const std::string& name,
                                                           std::size_t max_bytes,
                                                           const WaitLimit& limit) = 0;
  /// Deletes an uploaded file. Error: it is being printed.
  [[nodiscard]] virtual Result<void> DeleteFile(const std::string& name,
                                                const WaitLimit& limit) = 0;
  /// Starts printing an uploaded file; returns once it is selected. Follow it with WaitUntil on
  /// print_state.
  [[nodiscard]] virtual Result<void> StartPrint(const std::string& name,
                                                const WaitLimit& limit) = 0;
  [[nodiscard]] virtual Result<void> CancelPrint(const WaitLimit& limit) = 0;

  [[nodiscard]] virtual Result<std::vector<Webcam>> Webcams(const WaitLimit& limit) = 0;

  /// Calls a method of the server itself, such as a component's proxy. Also fails if the server has
  /// no such method.
  [[nodiscard]] virtual Result<nlohmann::json> CallServer(const std::string& method,
                                                          nlohmann::json params,
                                                          const WaitLimit& limit) = 0;

  /// Registers a method that the printer's macros can call (action_call_remote_method). `callback`
  /// receives the arguments as an object, on the connection's thread: it must return quickly and
  /// not call the printer. Remains registered over restarts and reconnects. REQUIRES a name used
  /// once.
  [[nodiscard]] virtual Result<void> RegisterRemoteMethod(
      const std::string& name, std::function<void(const nlohmann::json&)> callback,
      const WaitLimit& limit) = 0;

  /// Sets the handler of other clients' requests through the server (server.extensions.request), on
  /// the connection's thread: it must return quickly and not call the printer. An empty function
  /// removes it; all methods are unknown then. Replaces an earlier one.
  virtual void OnRequest(RequestHandler callback) = 0;

  /// Broadcasts an agent's event to all other clients of the server (notify_agent_event). Does not
  /// wait; lost while the link is down.
  virtual void SendEvent(const std::string& event, nlohmann::json data) = 0;

  /// Returns the present relation of this process's CLOCK_MONOTONIC and the printer's clocks. It is
  /// measured all the time. Waits until its uncertainty is `wanted_uncertainty_s`; at the limit,
  /// returns the best estimate with its own uncertainty. Call before and after a sweep.
  [[nodiscard]] virtual Result<ClockRelation> Clock(double wanted_uncertainty_s,
                                                    const WaitLimit& limit) = 0;

  /// Starts recording the moves that the firmware plans (the last 100 000 of them).
  [[nodiscard]] virtual Result<void> RecordMoves(const WaitLimit& limit) = 0;
  /// Returns the recorded moves that overlap [from, to] of print time, in order, as far as
  /// received. REQUIRES an earlier RecordMoves.
  [[nodiscard]] virtual std::vector<TrapezoidMove> ReportedMoves(double from_print_time_s,
                                                                 double to_print_time_s) = 0;
  /// Returns the recorded moves that overlap [from, to] of print time, in order; waits until all up
  /// to `to` are received. REQUIRES an earlier RecordMoves.
  [[nodiscard]] virtual Result<std::vector<TrapezoidMove>> Moves(double from_print_time_s,
                                                                 double to_print_time_s,
                                                                 const WaitLimit& limit) = 0;
};

}  // namespace trammel::machine
