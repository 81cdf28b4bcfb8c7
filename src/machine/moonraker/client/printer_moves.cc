// Moves of MoonrakerPrinter: over a separate connection to Klipper, with which they end. If the
// server supports none (an older one, a proxy, a Unix socket), a subscription belongs to the
// server's own connection and ends only with that. It then has the same name in every run, so that
// the next run receives it, and is requested once in a session of Klipper.
#include <fmt/format.h>

#include <algorithm>

#include "base/check.h"
#include "machine/moonraker/client/moonraker_printer.h"
#include "machine/net/host_clock.h"
#include "machine/net/json_field.h"

namespace trammel::machine {

using nlohmann::json;

namespace {

constexpr double kBatch_s = 0.5;       // Klipper tells moves in batches of so much time
constexpr double kAfterMoves_s = 1.0;  // a batch later, and its way
constexpr double kFirstBatch_s = 2.0;  // a motion that is not told by then is told to nobody
constexpr int kMaxNames = 9;
constexpr const char* kMovesMethod = "moves";  // batches over our own connection

constexpr double kOwnConnection_s = 5;  // before one through Moonraker is taken instead

bool Stopped(const WaitLimit& limit) { return limit.stop.stop_requested(); }

double PrintNow(const json& status) {
  return NumberOr(ObjectOr(status, "toolhead"), "estimated_print_time", 0);
}

}  // namespace

Result<void> MoonrakerPrinter::RecordMoves(const WaitLimit& limit) {
  {
    const std::lock_guard lock(mutex_);
    if (recording_moves_) return {};
    if (!wanted_.empty() && !wanted_.contains("motion_report")) {
      return Fail(
          "the printer does not tell its moves: its Klipper has no motion_report; update it",
          ErrorKind::kMachine);
    }
  }
  if (const Result<void> streamed = StreamMoves(limit); streamed || Stopped(limit)) return streamed;
  const std::string name = options_.client_name + "_moves";
  for (int number = 1;; ++number) {
    // Another trammel on the same printer has the name; its subscription would end.
    const std::string method = number == 1 ? name : fmt::format("{}_{}", name, number);
    const Result<void> registered = moonraker_.RegisterRemoteMethod(method, limit);
    if (registered) {
      const std::lock_guard lock(mutex_);
      moves_method_ = method;
      recording_moves_ = true;
      return {};
    }
    if (number == kMaxNames ||
        registered.error().message.find("already registered") == std::string::npos) {
      return registered;
    }
  }
}

Result<void> MoonrakerPrinter::StreamMoves(const WaitLimit& limit) {
  if (!KlippyStreams::MayWork(moonraker_.address())) {
    return Fail("no connection of our own can be made", ErrorKind::kMachine);
  }
  auto stream = std::make_unique<KlippyStreams>(
      moonraker_.address(), options_,
      std::vector{KlippyStream{"motion_report/dump_trapq", {{"name", "toolhead"}}, kMovesMethod}},
      [this](const std::string& method, const json& params, double) {
        if (method != kMovesMethod) return;
        const std::lock_guard lock(mutex_);
        TakeMoves(params);
        changed_.notify_all();
      });
  WaitLimit some = limit;
  some.time_limit_s = std::min(limit.time_limit_s, kOwnConnection_s);
  TRY(stream->Start(some));
  const std::lock_guard lock(mutex_);
  move_stream_ = std::move(stream);
  recording_moves_ = true;
  return {};
}

void MoonrakerPrinter::AskForMoves() {
  std::shared_ptr<KlippyStreams> stream;
  {
    const std::lock_guard lock(mutex_);
    stream = move_stream_;
  }
  if (stream) {
    stream->Reopen();
    return;
  }
  json params;
  {
    const std::lock_guard lock(mutex_);
    params = {{"name", "toolhead"}, {"response_template", {{"method", moves_method_}}}};
  }
  // If the request is refused no batch arrives, which Moves() reports.
  moonraker_.CallLater("printer.motion_report.dump_trapq", std::move(params),
                       [](const RpcAnswer&) {});
}

bool MoonrakerPrinter::MovesAreMissing() {
  if (!recording_moves_ || move_stream_ || hearing_.heard || hearing_.asked) return false;
  if (!hearing_.moving_since_s &&
      NumberOr(ObjectOr(status_, "motion_report"), "live_velocity", 0) > 0) {
    hearing_.moving_since_s = eventtime_s_;
  }
  hearing_.asked =
      hearing_.moving_since_s && eventtime_s_ - *hearing_.moving_since_s > kFirstBatch_s;
  return hearing_.asked;
}

void MoonrakerPrinter::TakeMoves(const json& batch) {
  moves_.Add(batch);
  hearing_.heard = true;
  ++hearing_.batches;
}

void MoonrakerPrinter::BeginSubscription(bool moves_ended) {
  hearing_ = {};
  if (moves_ended) moves_.Clear();
}

std::vector<TrapezoidMove> MoonrakerPrinter::ReportedMoves(double from_print_time_s,
                                                           double to_print_time_s) {
  const std::lock_guard lock(mutex_);
  TRAMMEL_CHECK(recording_moves_, "MovesTold({}, {}) before RecordMoves", from_print_time_s,
                to_print_time_s);
  return moves_.Overlapping(from_print_time_s, to_print_time_s);
}

Result<std::vector<TrapezoidMove>> MoonrakerPrinter::Moves(double from_print_time_s,
                                                           double to_print_time_s,
                                                           const WaitLimit& limit) {
  moonraker_.CheckMayWait();
  const double began_s = HostNow();
  std::unique_lock lock(mutex_);
  TRAMMEL_CHECK(recording_moves_, "Moves({}, {}) before RecordMoves", from_print_time_s,
                to_print_time_s);
  const bool told = WaitFor(lock, limit, [&] {
    return moves_.Reaches(to_print_time_s) || PrintNow(status_) > to_print_time_s + kAfterMoves_s;
  });
  if (!told) {
    return tl::unexpected(
        WaitError(fmt::format("the moves until print time {:.3f} s", to_print_time_s), limit));
  }
  std::vector<TrapezoidMove> found = moves_.Overlapping(from_print_time_s, to_print_time_s);
  if (!found.empty()) return found;
  // A batch was lost, or there is no subscription: on a new request Klipper resends the last half
  // minute.
  const std::uint64_t batches = hearing_.batches;
  const double asked_print_s = PrintNow(status_);
  hearing_.asked = true;
  lock.unlock();
  AskForMoves();
  lock.lock();
  WaitFor(lock, Rest(limit, began_s), [&] {
    return hearing_.batches != batches ||
           PrintNow(status_) > asked_print_s + 2 * kBatch_s + kAfterMoves_s;
  });
  return moves_.Overlapping(from_print_time_s, to_print_time_s);
}

}  // namespace trammel::machine
