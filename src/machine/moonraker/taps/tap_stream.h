// Taps of a printer as they come, through Moonraker.
#pragma once

#include <functional>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "base/result.h"
#include "machine/moonraker/link/address.h"
#include "machine/net/wait.h"

namespace trammel::machine {

/// All called on the connection's own thread: they must return quickly and not call the stream.
/// Times are of HostNow().
struct TapStreamEvents {
  /// An object with "time", "force" and "moves", as dump_taps sends it or as TapBuilder makes it.
  std::function<void(const nlohmann::json& tap, double received_s)> on_tap;
  /// Where the printer says that the nozzle was triggered: its console, probe.last_z_result, or
  /// probe.last_probe_position where Klipper has removed that.
  std::function<void(double z_mm, double received_s)> on_firmware_z;
  /// A macro called the remote method.
  std::function<void(const nlohmann::json& arguments, double received_s)> on_call;
  /// Of the link and the firmware, for people.
  std::function<void(const std::string& text)> on_news;
};

struct TapStreamOptions {
  MoonrakerOptions moonraker;
  std::string remote_method;  ///< Registered where not empty.
  /// Until a stream that was refused is asked for again, > 0.
  double ask_again_s = 2;
};

/// Subscribes to load_cell_probe/dump_taps, load_cell/dump_force and motion_report/dump_trapq of
/// the first load cell that the printer has, again after every restart and reconnect. Taps that
/// come with their moves are handed on as they are; until one did, taps are built from forces and
/// moves.
class TapStream {
 public:
  virtual ~TapStream() = default;
  /// Sends G-code without waiting for its end; errors come as news.
  virtual void Send(const std::string& script) = 0;
  /// Of the extruder, where the printer says it.
  [[nodiscard]] virtual std::optional<double> NozzleTemperature() const = 0;
};

/// A printer without a load cell is told as news: it may get one with the next restart.
/// Errors: those of ConnectToMoonraker.
[[nodiscard]] Result<std::unique_ptr<TapStream>> OpenTapStream(const TapStreamOptions& options,
                                                               TapStreamEvents events,
                                                               const WaitLimit& limit);

/// What Klipper's console says of a probe.
struct ConsoleResult {
  double z_mm = 0;
  bool less_offset = false;  ///< the probe's z_offset has been taken off
};

/// Reads "// probe at 1.0,2.0 is z=0.5", as Klipper said until January 2026, and since then
/// "// probe: at 1.0,2.0 bed will contact at z=0.5". Other lines have none, the summary of several
/// samples included ("Result: …", "probe accuracy results: …").
[[nodiscard]] std::optional<ConsoleResult> ProbeResult(const std::string& line);

}  // namespace trammel::machine
