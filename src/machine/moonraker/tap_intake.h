// What a printer's messages say of taps, whatever link they came over.
#pragma once

#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "machine/moonraker/tap_builder.h"
#include "machine/moonraker/tap_stream.h"

namespace trammel::machine {

/// A load cell by the name that requests want.
struct LoadCellName {
  std::string name;
  bool probe = false;  ///< It has dump_taps, too.
};

/// The first load cell among the printer's objects, a probe before any other. "load_cell_probe" is
/// called so in requests, "load_cell_probe left" by its last word.
[[nodiscard]] std::optional<LoadCellName> FirstLoadCell(const nlohmann::json& objects);

/// Turns messages into events. Of one thread, but for temperature().
class TapIntake {
 public:
  explicit TapIntake(TapStreamEvents events) : events_(std::move(events)) {}

  void TakeTap(const nlohmann::json& params, double received_s);
  void TakeForces(const nlohmann::json& batch, double received_s);
  void TakeMoves(const nlohmann::json& batch, double received_s);
  /// @param first  The answer to a subscription: its probe result is of an earlier tap.
  void TakeStatus(const nlohmann::json& status, double received_s, bool first);
  void TakeLine(const std::string& line, double received_s);
  void TakeCall(const nlohmann::json& arguments, double received_s) const;
  void Tell(const std::string& news) const { events_.on_news(news); }
  /// Print time begins anew.
  void Restart();
  /// The printer has dump_taps, which tells with the first tap whether it sends whole ones.
  void ExpectTaps() { source_ = Source::kUnknown; }
  /// A macro has just moved, and nothing was told of it: the moves have to be asked for again. True
  /// once for each restart.
  [[nodiscard]] bool MissesMoves();
  /// Z offset of the probe's settings.
  void TakeSettings(const nlohmann::json& status);

  [[nodiscard]] std::optional<double> temperature_c() const;

 private:
  /// Who puts the taps together.
  enum class Source { kUnknown, kPrinter, kBuilder };
  void HandOnBuilt(double received_s);

  const TapStreamEvents events_;
  TapBuilder builder_;
  Source source_ = Source::kBuilder;
  std::vector<nlohmann::json> held_;  ///< built while nobody knew whether the printer sends its own
  bool missed_moves_ = false;
  nlohmann::json last_whole_;  ///< a second subscription brings each tap twice
  double z_offset_mm_ = 0;
  bool by_position_ = false;  ///< the printer tells last_probe_position alone
  mutable std::mutex mutex_;
  std::optional<double> temperature_c_;
};

}  // namespace trammel::machine
