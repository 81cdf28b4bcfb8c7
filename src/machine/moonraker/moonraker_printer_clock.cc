// MoonrakerPrinter's clocks: samples of host and print time, and what they amount to.
#include <algorithm>

#include "machine/moonraker/moonraker_printer_impl.h"
#include "machine/net/host_clock.h"
#include "machine/net/json_field.h"

namespace trammel::machine {

using nlohmann::json;

namespace {

constexpr double kLongestLead_s = 0.5;  // of a query, where the next update seems far away

}  // namespace

void MoonrakerPrinter::AddClockSample(std::optional<double> sent_s, double received_s,
                                      const json& status, double eventtime_s) {
  const auto print_s = Number(ObjectOr(status, "toolhead"), "estimated_print_time");
  if (print_s && IsTime(*print_s) && IsTime(eventtime_s)) {
    clock_.Add({sent_s, received_s, eventtime_s, print_s});
  }
}

void MoonrakerPrinter::SampleClockBeforeNextUpdate() {
  std::optional<double> next_s;
  double lead_s = 0;
  {
    const std::lock_guard lock(mutex_);
    next_s = clock_query_out_ ? std::nullopt : clock_.NextUpdate();
    lead_s = kQueryLeads_s[clock_queries_ % kQueryLeads_s.size()];
    clock_queries_ += next_s ? 1 : 0;
    clock_query_out_ = clock_query_out_ || next_s;
  }
  if (!next_s) {
    return;
  }
  moonraker_.RunAfter(std::clamp(*next_s - lead_s - HostNow(), 0.0, kLongestLead_s), [this] {
    const double sent_s = HostNow();
    moonraker_.CallLater("printer.objects.query",
                         {{"objects", {{"toolhead", {"estimated_print_time"}}}}},
                         [this, sent_s](const RpcAnswer& answer) {
                           const std::lock_guard lock(mutex_);
                           clock_query_out_ = false;
                           if (const auto eventtime_s = Number(answer.result, "eventtime")) {
                             AddClockSample(sent_s, answer.received_s,
                                            ObjectOr(answer.result, "status"), *eventtime_s);
                             changed_.notify_all();
                           }
                         });
  });
}

Result<ClockRelation> MoonrakerPrinter::Clock(double wanted_uncertainty_s, const WaitLimit& limit) {
  moonraker_.CheckMayWait();
  std::unique_lock lock(mutex_);
  std::optional<ClockRelation> relation;
  WaitFor(lock, limit, [&] {
    relation = clock_.Relation();
    return relation && relation->PrintTimeBound(HostNow()) <= wanted_uncertainty_s;
  });
  if (limit.stop.stop_requested() || !relation) {
    return tl::unexpected(WaitError("a status update that tells the print time", limit));
  }
  return *relation;
}

}  // namespace trammel::machine
