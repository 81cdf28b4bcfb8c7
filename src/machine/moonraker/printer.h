// The seam to a 3D printer: its state, and what a procedure may ask of it. MoonrakerPrinter
// implements it.
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

/// Clock b as a straight line over clock a, b = b0 + rate · (a − a0), with the bound that the
/// samples leave.
struct ClockLine {
  double a0_s = 0;  ///< where the bound is tightest is near here
  double b0_s = 0;
  double rate = 1;             ///< seconds of b per second of a; 1 up to the drift of two crystals
  double half_width_s = 0;     ///< at a0: b lies within ± this
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
  int samples = 0;  ///< that the relation rests on

  [[nodiscard]] double PrintTimeOf(double host_s) const { return print_from_host.BFromA(host_s); }
  [[nodiscard]] double HostTimeOf(double print_s) const { return print_from_host.AFromB(print_s); }
  /// ± bound of PrintTimeOf(host), seconds; divide by √3 for a standard uncertainty.
  [[nodiscard]] double PrintTimeBound(double host_s) const {
    return print_from_host.HalfWidth(host_s);
  }
};

/// Whether the firmware takes commands. kDisconnected: the server runs, but nothing behind it.
enum class PrinterReadiness { kReady, kStartup, kShutdown, kError, kDisconnected };

/// "ready", "startup", "shutdown", "error" or "disconnected".
[[nodiscard]] std::string_view ToString(PrinterReadiness readiness);

struct Heater {
  double temperature_c = 0;
  double target_c = 0;  ///< 0: off
};

/// How far the motor of an extruder or of an [extruder_stepper] runs ahead of the melt.
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

/// The G-code interpreter's modes and offsets: what a script may change and has to put back.
struct GcodeModes {
  bool absolute_coordinates = true;
  bool absolute_extrude = true;
  double speed_factor = 1;                    ///< M220
  double extrude_factor = 1;                  ///< M221
  std::array<double, 4> homing_origin_mm{};   ///< G-code offset, x y z e
  std::array<double, 4> gcode_position_mm{};  ///< the last commanded position, x y z e
};

/// Lists are x y z e unless they say otherwise, in the printer's own coordinates. A field that the
/// printer has not told is absent, empty, or at its default where it cannot be doubted.
struct PrinterState {
  PrinterReadiness readiness = PrinterReadiness::kDisconnected;
  std::string message;  ///< the firmware's own words, for example why it shut down

  std::string homed_axes;               ///< of "xyz"; not to be trusted unless ready
  std::array<double, 4> position_mm{};  ///< end of the last move that was planned
  std::array<double, 3> axis_minimum_mm{};
  std::array<double, 3> axis_maximum_mm{};
  VelocityLimits limits;
  std::string active_extruder;  ///< "extruder", "extruder1", …
  /// Of every motor that pushes filament, by its section of the configuration: "extruder",
  /// "extruder1", "extruder_stepper belted". An extruder without a motor has none.
  std::map<std::string, PressureAdvance> pressure_advance;
  GcodeModes gcode;

  std::map<std::string, Heater> heaters;  ///< "extruder", "heater_bed", "heater_generic chamber"

  std::string print_state;    ///< "standby", "printing", "paused", "complete", "cancelled", "error"
  std::string print_file;     ///< the file being or last printed, empty where none
  std::string print_message;  ///< why a print failed
  double print_progress = 0;  ///< 0 … 1 of the file's bytes
  double print_total_s = 0;   ///< of the file being or last printed: how long it has taken
  double print_filament_mm = 0;  ///< … and how much filament its moves have asked for
  std::string idle_state;        ///< "Idle", "Ready", "Printing" (any motion)
  bool paused = false;

  /// Scripts that this client sent and whose answer it no longer waits for (a time limit or an
  /// interruption ended the wait), but which the printer has not answered yet.
  int abandoned_scripts = 0;
};

/// Of the active extruder's own motor; absent where it has none, or the printer reports none.
[[nodiscard]] std::optional<double> ActiveAdvance_s(const PrinterState& state);

/// The cause at the head of a firmware's message.
[[nodiscard]] std::string FirstLine(std::string_view message);

/// How G-code names the object of a section (EXTRUDER=, HEATER=): "belted" of
/// "extruder_stepper belted".
[[nodiscard]] std::string NameInGcode(std::string_view section);

/// One object of the printer and which of its fields to ask for; no fields: all of them.
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

/// One piece of motion with constant acceleration, as the firmware planned it.
struct TrapezoidMove {
  double print_time_s = 0;            ///< its start
  double duration_s = 0;              ///< >= 0
  double start_velocity_mm_s = 0;     ///< along direction
  double acceleration_mm_s2 = 0;      ///< along direction, signed
  std::array<double, 3> start_mm{};   ///< x y z
  std::array<double, 3> direction{};  ///< unit vector, or zero where nothing moves
};

/// A printer that takes G-code. Thread-safe: any call from any thread.
///
/// All failures are kMachine, or kInterrupted where the limit's stop token ended the wait. The
/// message names what was tried, what came back, and what to do, on request with the last messages
/// of the conversation. A lost connection is taken up again in the background; calls fail until it
/// is back.
class Printer {
 public:
  virtual ~Printer() = default;

  /// Runs G-code lines and returns once the last one was read: motion may still be queued (about
  /// 2 s of it), so put FinishMoves before whatever needs the head in place.
  /// Fails on an error answer, on a line that starts with `!!`, on an unknown command (which the
  /// firmware itself calls a success), on shutdown, disconnect and a lost link. Lines before the
  /// failing one were carried out. Where the wait ends first (time limit, interruption) the
  /// script goes on running on the printer; the message says so, and abandoned_scripts counts it.
  [[nodiscard]] virtual Result<void> Run(std::string_view script, const WaitLimit& limit) = 0;

  /// Waits until the head stands still where the last move ended (M400).
  [[nodiscard]] virtual Result<void> FinishMoves(const WaitLimit& limit) = 0;

  /// Stops everything at once: motion, heaters, pins. Does not queue behind running scripts. The
  /// printer then needs a FIRMWARE_RESTART.
  [[nodiscard]] virtual Result<void> EmergencyStop(const WaitLimit& limit) = 0;

  /// Asks the printer now. Succeeds whatever the readiness is, as long as the server answers.
  [[nodiscard]] virtual Result<PrinterState> State(const WaitLimit& limit) = 0;

  /// What the printer last told by itself (at most about 0.3 s old while it is connected); does
  /// not wait. readiness is kDisconnected while the link is down.
  [[nodiscard]] virtual PrinterState LastState() const = 0;

  /// Waits until `done` holds, looking at every state that arrives. Fails early when the printer
  /// leaves "ready", unless `done` holds for that very state.
  /// @param what  ends the sentence "waited … s for …", for example "the nozzle to cool to 70 °C".
  [[nodiscard]] virtual Result<PrinterState> WaitUntil(
      const std::function<bool(const PrinterState&)>& done, std::string_view what,
      const WaitLimit& limit) = 0;

  /// Waits until the link is up and the firmware is ready, through restarts and reconnects.
  [[nodiscard]] virtual Result<void> WaitUntilReady(const WaitLimit& limit) = 0;

  /// Raw status: an object with one member per asked object; unknown objects come back empty.
  /// For what PrinterState does not hold, such as the configuration's settings.
  [[nodiscard]] virtual Result<nlohmann::json> Query(const std::vector<ObjectFields>& objects,
                                                     const WaitLimit& limit) = 0;

  /// Whether the printer knows a command or macro (any case).
  [[nodiscard]] virtual Result<bool> HasCommand(std::string_view name, const WaitLimit& limit) = 0;

  /// Stores a G-code file under its printable files, replacing one of the same name.
  /// @param name  relative, for example "trammel/pattern.gcode".
  [[nodiscard]] virtual Result<void> Upload(const std::string& name, std::string_view gcode,
                                            const WaitLimit& limit) = 0;
  /// Stores a file beside the printer's configuration, where front ends list and show it, replacing
  /// one of the same name.
  /// @param name  relative, for example "trammel/pa.png".
  [[nodiscard]] virtual Result<void> UploadConfig(const std::string& name, std::string_view data,
                                                  const WaitLimit& limit) = 0;
  /// Reads a file beside the printer's configuration.
  /// Errors: kInput: there is none of that name, or it has more bytes; kMachine.
  [[nodiscard]] virtual Result<std::string> DownloadConfig(const std::string& name,
                                                           std::size_t most_bytes,
                                                           const WaitLimit& limit) = 0;
  /// Deletes an uploaded file; one that is being printed stays, which is an error.
  [[nodiscard]] virtual Result<void> DeleteFile(const std::string& name,
                                                const WaitLimit& limit) = 0;
  /// Starts printing an uploaded file; returns once it is selected. Follow it with WaitUntil on
  /// print_state.
  [[nodiscard]] virtual Result<void> StartPrint(const std::string& name,
                                                const WaitLimit& limit) = 0;
  [[nodiscard]] virtual Result<void> CancelPrint(const WaitLimit& limit) = 0;

  [[nodiscard]] virtual Result<std::vector<Webcam>> Webcams(const WaitLimit& limit) = 0;

  /// Calls a method of the server that is no printer's, such as a component's proxy. Fails where
  /// the server has no such method, too.
  [[nodiscard]] virtual Result<nlohmann::json> CallServer(const std::string& method,
                                                          nlohmann::json params,
                                                          const WaitLimit& limit) = 0;

  /// Lets the printer's macros call us (action_call_remote_method). `callback` gets the call's
  /// arguments as an object, on the connection's own thread: it must return quickly and not call
  /// the printer. Stays registered over restarts and reconnects. REQUIRES a name used once.
  [[nodiscard]] virtual Result<void> RegisterRemoteMethod(
      const std::string& name, std::function<void(const nlohmann::json&)> callback,
      const WaitLimit& limit) = 0;

  /// Answers requests that other clients make of us through the server (server.extensions.request),
  /// on the connection's own thread: it must return quickly and not call the printer. An empty
  /// function ends it; all are unknown then. Replaces an earlier one.
  virtual void OnRequest(RequestHandler callback) = 0;

  /// Tells all other clients of the server something, as an agent's event (notify_agent_event).
  /// Waits for nothing; while the link is down nobody hears it.
  virtual void SendEvent(const std::string& event, nlohmann::json data) = 0;

  /// How this process's CLOCK_MONOTONIC and the printer's clocks go together now. Measured all
  /// the time; waits where that is not yet known to `wanted_uncertainty_s`, and returns the best
  /// there is (its own uncertainty stated) when the limit is reached. Ask before and after a sweep.
  [[nodiscard]] virtual Result<ClockRelation> Clock(double wanted_uncertainty_s,
                                                    const WaitLimit& limit) = 0;

  /// Starts keeping the moves that the firmware plans (the last 100 000 of them).
  [[nodiscard]] virtual Result<void> RecordMoves(const WaitLimit& limit) = 0;
  /// The kept moves that overlap [from, to] of print time, in order, as far as they were told.
  /// REQUIRES RecordMoves before.
  [[nodiscard]] virtual std::vector<TrapezoidMove> MovesTold(double from_print_time_s,
                                                             double to_print_time_s) = 0;
  /// The kept moves that overlap [from, to] of print time, in order; waits until the printer has
  /// told everything up to `to`. REQUIRES RecordMoves before.
  [[nodiscard]] virtual Result<std::vector<TrapezoidMove>> Moves(double from_print_time_s,
                                                                 double to_print_time_s,
                                                                 const WaitLimit& limit) = 0;
};

}  // namespace trammel::machine
