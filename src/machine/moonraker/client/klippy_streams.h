// Streams of Klipper (moves, forces, taps) over a separate connection that Moonraker passes through
// (/klippysocket). They end with it, while streams that Moonraker subscribes to never end.
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

/// Stream to subscribe to.
struct KlippyStream {
  std::string endpoint;   ///< "motion_report/dump_trapq"
  nlohmann::json params;  ///< without the response_template
  std::string method;     ///< method name of its batches
};

class KlippyStreams {
 public:
  /// Called on the connection's thread: must return quickly.
  using OnBatch = std::function<void(const std::string& method, const nlohmann::json& params,
                                     double received_s)>;

  /// Called once, on the connection's thread: every stream was subscribed to, or the error.
  using OnFirst = std::function<void(const std::optional<Error>& failed)>;

  /// @param address  Moonraker's, not that of a Unix socket: such a one passes nothing through
  KlippyStreams(MoonrakerAddress address, const MoonrakerOptions& options,
                std::vector<KlippyStream> streams, OnBatch on_batch, OnFirst on_first = {});

  /// True if a connection of our own to Klipper may be possible.
  [[nodiscard]] static bool MayWork(const MoonrakerAddress& address);

  /// Connects and waits until every stream is subscribed to. After a failure there is no data;
  /// after one success a lost connection (each restart of Klipper) is restored automatically.
  /// Errors: kMachine, also if the server has no such route to Klipper; kInterrupted.
  [[nodiscard]] Result<void> Start(const WaitLimit& limit);

  /// Does the same without waiting; on_first reports the result.
  void Begin() { connection_.Connect(); }

  /// Reconnects. Klipper then resends the last half minute, unless another client has the stream.
  void Reopen();

 private:
  void Subscribe();
  void OnMessage(std::string_view text);
  void Failed(const Error& error);
  void Settle(const std::optional<Error>& failed);
  [[nodiscard]] Error NoAnswer(double within_s) const;

  const std::vector<KlippyStream> streams_;
  const double answer_limit_s_;  // for all streams, from the connection on
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
