#include "machine/moonraker/client/klippy_streams.h"

#include <fmt/format.h>

#include <chrono>
#include <utility>

#include "base/bounded_json.h"
#include "machine/net/host_clock.h"
#include "machine/net/json_field.h"

namespace trammel::machine {

using nlohmann::json;

namespace {

constexpr double kAgain_s = 1;

MoonrakerAddress ThroughTo(MoonrakerAddress address) {
  address.endpoint = "/klippysocket";
  return address;
}

}  // namespace

KlippyStreams::KlippyStreams(MoonrakerAddress address, const MoonrakerOptions& options,
                             std::vector<KlippyStream> streams, OnBatch on_batch, OnFirst on_first)
    : streams_(std::move(streams)),
      answer_limit_s_(options.connect_time_limit_s),
      on_batch_(std::move(on_batch)),
      on_first_(std::move(on_first)),
      connection_(ThroughTo(std::move(address)), options,
                  {.on_open = [this] { Subscribe(); },
                   .on_message = [this](std::string_view text) { OnMessage(text); },
                   .on_down = [this](const Error& error) { Failed(error); }}) {}

bool KlippyStreams::MayWork(const MoonrakerAddress& address) {
  return address.transport != Transport::kUnix;
}

void KlippyStreams::Settle(const std::optional<Error>& failed) {
  {
    const std::lock_guard lock(mutex_);
    if (started_ || failed_) return;
    started_ = !failed;
    failed_ = failed;
    changed_.notify_all();
  }
  if (on_first_) on_first_(failed);
}

Result<void> KlippyStreams::Start(const WaitLimit& limit) {
  connection_.Connect();
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, limit.stop, std::chrono::duration<double>(limit.time_limit_s),
                    [this] { return started_ || failed_; });
  if (started_) return {};
  if (limit.stop.stop_requested()) {
    return Fail("stopped while connecting to Klipper", ErrorKind::kInterrupted);
  }
  if (!failed_) failed_ = NoAnswer(limit.time_limit_s);
  return tl::unexpected(*failed_);
}

Error KlippyStreams::NoAnswer(double within_s) const {
  return {ErrorKind::kMachine, fmt::format("Klipper did not answer through {} within {} s",
                                           connection_.address().WebSocketUrl(), within_s)};
}

void KlippyStreams::Reopen() { connection_.Connect(); }

void KlippyStreams::Subscribe() {
  answered_ = 0;
  connection_.RunAfter(answer_limit_s_, [this, link = ++link_number_] {
    if (link == link_number_ && answered_ < streams_.size()) {
      connection_.Drop(NoAnswer(answer_limit_s_));
    }
  });
  for (std::size_t i = 0; i < streams_.size(); ++i) {
    json params = streams_[i].params;
    params["response_template"] = {{"method", streams_[i].method}};
    const json message = {
        {"id", i + 1}, {"method", streams_[i].endpoint}, {"params", std::move(params)}};
    // Sending fails only if the link is down, which is reported separately.
    (void)connection_.Send(message.dump(-1, ' ', false, json::error_handler_t::replace));
  }
}

void KlippyStreams::OnMessage(std::string_view text) {
  const double received_s = HostNow();
  const Result<json> parsed = ParseBoundedJson(text, "the message");
  if (!parsed || !parsed->is_object()) {
    connection_.Drop({ErrorKind::kMachine, "Klipper sent something that is no message"});
    return;
  }
  const std::string method = TextOr(*parsed, "method", "");
  if (!method.empty()) {
    on_batch_(method, ObjectOr(*parsed, "params"), received_s);
    return;
  }
  if (Member(*parsed, "id") == nullptr) return;
  if (Member(*parsed, "result") == nullptr) {
    // The stream is not available yet, after a restart; or never.
    connection_.Drop(
        {ErrorKind::kMachine, "Klipper refused a stream: " +
                                  TextOr(ObjectOr(*parsed, "error"), "message", "no result")});
    return;
  }
  if (++answered_ == streams_.size()) Settle(std::nullopt);
}

void KlippyStreams::Failed(const Error& error) {
  ++link_number_;
  bool first = false;
  {
    const std::lock_guard lock(mutex_);
    first = !started_;
  }
  if (first) {
    Settle(error);
    return;
  }
  connection_.RunAfter(kAgain_s, [this] { connection_.Connect(); });
}

}  // namespace trammel::machine
