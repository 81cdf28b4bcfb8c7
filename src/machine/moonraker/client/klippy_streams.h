// Streams of Klipper (moves, forces, taps) over a connection to it of our own, which Moonraker
// passes through (/klippysocket): they end with it, where those that Moonraker asks for never do.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "machine/moonraker/link/connection.h"
#include "machine/net/wait.h"

namespace trammel::machine {

/// One stream to subscribe to.
struct KlippyStream {
  std::string endpoint;   ///< "motion_report/dump_trapq"
  nlohmann::json params;  ///< without the response_template
  std::string method;     ///< what its batches are called
};

class KlippyStreams {
 public:
  /// Called on the connection's own thread: must return quickly.
  using OnBatch = std::function<void(const std::string& method, const nlohmann::json& params,
                                     double received_s)>;

  /// Called once, on the connection's own thread: every stream was subscribed to, or why not.
  using OnFirst = std::function<void(const std::optional<Error>& failed)>;

  /// @param address  Moonraker's, not that of a Unix socket: such a one passes nothing through
  KlippyStreams(MoonrakerAddress address, const MoonrakerOptions& options,
                std::vector<KlippyStream> streams, OnBatch on_batch, OnFirst on_first = {});

  /// Whether a connection of our own to Klipper may be possible.
  [[nodiscard]] static bool MayWork(const MoonrakerAddress& address);

  /// Connects and waits until every stream is subscribed to. Where that fails, nothing comes; where
  /// it went well once, a lost connection (each restart of Klipper) is taken up again by itself.
  /// Errors: kMachine, where the server has no such way to Klipper, too; kInterrupted.
  [[nodiscard]] Result<void> Start(const WaitLimit& limit);

  /// The same without waiting; on_first tells.
  void Begin() { connection_.Connect(); }

  /// Connects anew. Klipper then tells the last half minute where nobody else has the stream.
  void Reopen();

 private:
  void Subscribe();
  void OnMessage(std::string_view text);
  void Failed(const Error& error);
  void Settle(const std::optional<Error>& failed);
  [[nodiscard]] Error NoAnswer(double within_s) const;

  const std::vector<KlippyStream> streams_;
  const double answer_limit_s_;  // of all streams, from the connection on
  const OnBatch on_batch_;
  const OnFirst on_first_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
  bool started_ = false;
  std::optional<Error> failed_;
  std::size_t answered_ = 0;  // this and the next of the connection's thread
  std::uint64_t link_number_ = 0;
  MoonrakerConnection connection_;  // last: its thread uses all the rest
};

}  // namespace trammel::machine
