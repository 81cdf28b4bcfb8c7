#include "tap/commands/tap_watcher.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <utility>

#include "app/commands.h"
#include "app/provenance.h"
#include "base/statistics.h"
#include "document/interval_text.h"
#include "files/new_file.h"
#include "machine/net/host_clock.h"
#include "machine/net/json_field.h"
#include "service/tap_log.h"
#include "tap/files/tap_file.h"
#include "tap/report/tap_json.h"
#include "tap/report/tap_text.h"
#include "tap/samples/finding.h"

namespace trammel::app {
namespace {

using nlohmann::json;

/// Maximum wait for the printer's result: Klipper reports its own z within milliseconds, status
/// updates every 0.25 s.
constexpr double kWaitForFirmware_s = 0.7;
/// Maximum delay of a tap behind its rise, and lead of the printer's own z: taps are built from
/// forces, which arrive in batches.
constexpr double kLooseZ_s = 2;
constexpr double kSameZ_mm = 2e-6;
/// Maximum age of a tap for the calling macro: an older one is not meant, if its rise time is
/// unknown.
constexpr double kFresh_s = 5;
constexpr std::size_t kMaxEvents = 1000;
constexpr const char* kRiseTime = "x_rise_print_time_s";

/// Filters a macro's ID to the characters that cannot break out of a G-code line.
std::string PlainId(const json& arguments) {
  std::string id;
  if (!arguments.is_object() || !arguments.contains("id")) return id;
  const json& given = arguments.at("id");
  const std::string text =
      given.is_string() ? given.get<std::string>()
                        : given.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  for (const char c : text) {
    const bool plain = std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '-';
    if (plain && id.size() < 40) id += c;
  }
  return id;
}

// A scatter of two differences is nearly meaningless.
std::string DifferenceText(const std::vector<double>& differences_mm) {
  constexpr std::size_t kMinForScatter = 3;
  const double mean_mm = Mean(differences_mm);
  const std::size_t count = differences_mm.size();
  const std::string over = fmt::format("over {} tap{}", count, count == 1 ? "" : "s");
  if (count < kMinForScatter) return fmt::format("{:+.4f} mm {}", mean_mm, over);
  const double half_mm = StudentT95(static_cast<double>(count) - 1) *
                         StandardDeviation(differences_mm) / std::sqrt(static_cast<double>(count));
  return report::WithInterval(mean_mm, {mean_mm - half_mm, mean_mm + half_mm},
                              report::kOffsetMillimetres) +
         " in the mean " + over;
}

/// Returns the time from a stream-built tap's halt to its last sample; 0 for others, whose z
/// arrives after them.
double RiseTime(const json& tap) {
  const auto rise_s = machine::Number(tap, kRiseTime);
  if (!rise_s || !tap.contains("time") || tap["time"].empty()) return 0;
  const json& last = tap["time"].back();
  return last.is_number() ? std::max(0.0, last.get<double>() - *rise_s) : 0;
}

std::string WithId(std::string script, const std::string& id) {
  return id.empty() ? script : script + " ID=" + id;
}

}  // namespace

std::string AnswerScript(const tap::TapAnalysis& analysis, const std::string& id) {
  if (analysis.verdict != Verdict::kGood) {
    return WithId(fmt::format("TRAMMEL_TAP_RESULT VERDICT={} REASON={}", ToString(analysis.verdict),
                              tap::Name(analysis.reason.code)),
                  id);
  }
  std::string script =
      fmt::format("TRAMMEL_TAP_RESULT VERDICT=good Z={:.6f} U={:.6f} LO={:.6f} HI={:.6f}",
                  analysis.contact_mm.value, analysis.contact_mm.standard_uncertainty,
                  analysis.contact_mm.interval95.lo, analysis.contact_mm.interval95.hi);
  if (std::isfinite(analysis.quality)) script += fmt::format(" QUALITY={:.0f}", analysis.quality);
  return WithId(std::move(script), id);
}

std::string NoTapScript(const std::string& id) {
  return WithId("TRAMMEL_TAP_RESULT VERDICT=refused REASON=no_tap", id);
}

TapWatcher::TapWatcher(WatchOptions options)
    : options_(std::move(options)), analyser_(options_.tap) {}

machine::TapStreamEvents TapWatcher::Events() {
  return {.on_tap =
              [this](const json& tap, double received_s) {
                Push(TapCame{tap, received_s});
              },
          .on_firmware_z =
              [this](double z_mm, double received_s) {
                Push(FirmwareZ{z_mm, received_s});
              },
          .on_call =
              [this](const json& arguments, double received_s) {
                const double since_s = machine::NumberOr(arguments, "since", -HUGE_VAL);
                const double took_s = machine::NumberOr(arguments, "now", since_s) - since_s;
                Push(Call{PlainId(arguments), since_s, took_s > 0 ? took_s : 0, received_s});
              },
          .on_news = [this](const std::string& text) { Push(News{text}); }};
}

void TapWatcher::Push(Event event) {
  const std::lock_guard lock(mutex_);
  if (events_.size() < kMaxEvents) events_.push_back(std::move(event));
  came_.notify_all();
}

double TapWatcher::NextDeadline() const {
  constexpr double kIdle_s = 60;
  double deadline_s = machine::HostNow() + kIdle_s;
  if (open_) deadline_s = std::min(deadline_s, open_->received_s + kWaitForFirmware_s);
  if (unanswered_s_ && options_.count > 0 && taps_.size() >= options_.count) {
    deadline_s = std::min(deadline_s, *unanswered_s_ + options_.answer_within_s);
  }
  if (asked_) deadline_s = std::min(deadline_s, asked_->received_s + options_.answer_within_s);
  return deadline_s;
}

std::optional<TapWatcher::Event> TapWatcher::Next(const std::stop_token& stop) {
  const double wait_s = std::max(0.0, NextDeadline() - machine::HostNow());
  std::unique_lock lock(mutex_);
  came_.wait_for(lock, stop, std::chrono::duration<double>(wait_s),
                 [this] { return !events_.empty(); });
  if (events_.empty()) return std::nullopt;
  Event event = std::move(events_.front());
  events_.pop_front();
  return event;
}

bool TapWatcher::Enough() const {
  if (options_.count == 0 || taps_.size() < options_.count || asked_) return false;
  // A macro requests the last tap right after it.
  return !options_.answer || !unanswered_s_ ||
         machine::HostNow() >= *unanswered_s_ + options_.answer_within_s;
}

int TapWatcher::Serve(machine::TapStream& stream, const std::stop_token& stop) {
  while (!stop.stop_requested() && !Enough()) {
    auto event = Next(stop);
    if (event) {
      if (auto* came = std::get_if<TapCame>(&*event)) {
        Take(*came, stream);
      } else if (const auto* firmware = std::get_if<FirmwareZ>(&*event)) {
        Take(*firmware);
      } else if (const auto* call = std::get_if<Call>(&*event)) {
        Take(*call, stream);
      } else {
        fmt::print(stderr, "trammel: {}\n", std::get<News>(*event).text);
      }
    }
    const double now_s = machine::HostNow();
    if (open_ && now_s >= open_->received_s + kWaitForFirmware_s) Close();
    Answer(stream, now_s);
  }
  if (open_) Close();
  PrintSummary();
  return ExitCodeOf(taps_);
}

void TapWatcher::Take(TapCame& came, machine::TapStream& stream) {
  if (open_) Close();
  if (const auto temperature = stream.NozzleTemperature()) {
    came.tap["x_nozzle_temperature_c"] = *temperature;
  }
  auto taps = files::ParseTaps(came.tap.dump(-1, ' ', false, json::error_handler_t::replace),
                               fmt::format("tap {}", taps_.size() + 1));
  if (!taps) {
    fmt::print(stderr, "trammel: a tap came that cannot be read: {}\n", taps.error().message);
    return;
  }
  tap::Recording& recording = taps->front();
  const tap::TapAnalysis analysis = AnalyseRecorded(recording, options_.tap, analyser_);
  last_ = analysis;
  last_rise_print_time_s_ = machine::Number(came.tap, kRiseTime);
  unanswered_s_ = came.received_s;
  const double z_before_s = kLooseZ_s + RiseTime(came.tap);
  open_ = Open{std::move(came.tap), {std::move(recording), analysis, {}}, came.received_s};
  if (loose_z_ && came.received_s - loose_z_->received_s < z_before_s) {
    Take(FirmwareZ(*loose_z_));
  }
  loose_z_.reset();
}

void TapWatcher::Take(const FirmwareZ& firmware) {
  if (!open_) {
    // Console and status report the same result, the console to six decimals.
    const bool again =
        !received_s_.empty() && firmware.received_s - received_s_.back() < kLooseZ_s &&
        std::abs(taps_.back().recording.firmware_z_mm.value_or(1e9) - firmware.z_mm) < kSameZ_mm;
    if (!again) loose_z_ = firmware;
    return;
  }
  if (!open_->tap.recording.firmware_z_mm) open_->tap.recording.firmware_z_mm = firmware.z_mm;
  open_->raw["x_firmware_z_mm"] = *open_->tap.recording.firmware_z_mm;
  Close();
}

void TapWatcher::Take(const Call& call, machine::TapStream& stream) {
  if (!options_.answer) return;
  // Only one macro waits at a time: Klipper runs them in sequence.
  asked_ = call;
  // Print time identifies the tap, however long the macro lifted after it.
  const bool times_tell = std::isfinite(call.since_print_time_s) && last_rise_print_time_s_;
  if (!times_tell && unanswered_s_ && call.received_s - *unanswered_s_ > kFresh_s + call.took_s) {
    unanswered_s_.reset();
  }
  Answer(stream, machine::HostNow());
}

void TapWatcher::Answer(machine::TapStream& stream, double now_s) {
  if (!asked_) return;
  if (last_rise_print_time_s_ && *last_rise_print_time_s_ < asked_->since_print_time_s) {
    unanswered_s_.reset();  // tap before the macro's own, which is still to come
  }
  if (unanswered_s_ && last_) {
    stream.Send(AnswerScript(*last_, asked_->id));
    fmt::print(stderr, "  answered {:.0f} ms after the macro asked\n",
               1000 * (now_s - asked_->received_s));
  } else if (now_s >= asked_->received_s + options_.answer_within_s) {
    stream.Send(NoTapScript(asked_->id));
    fmt::print(stderr, "  a macro asked and no tap came within {:.1f} s\n",
               options_.answer_within_s);
  } else {
    return;
  }
  asked_.reset();
  unanswered_s_.reset();
}

void TapWatcher::Close() {
  Keep(*open_);
  report::AnalysedTap& tap = open_->tap;
  std::string line = report::TapLine(tap);
  if (tap.recording.firmware_z_mm) {
    line += fmt::format("    printer's own z {:.4f} mm", *tap.recording.firmware_z_mm);
    if (tap.analysis.verdict == Verdict::kGood) {
      differences_mm_.push_back(*tap.recording.firmware_z_mm - tap.analysis.contact_mm.value);
      line += fmt::format(", {:+.4f} mm from ours", differences_mm_.back());
      if (differences_mm_.size() > 1) line += "; so far " + DifferenceText(differences_mm_);
    }
    line += '\n';
  }
  std::fputs(line.c_str(), stdout);
  std::fflush(stdout);
  // The samples are in the file: a watcher runs for weeks.
  tap.recording.time_s = {};
  tap.recording.force_g = {};
  tap.recording.z_mm = {};
  taps_.push_back(std::move(tap));
  received_s_.push_back(open_->received_s);
  open_.reset();
}

// The answer stands in the line, for pages that show it without an analysis of their own.
void TapWatcher::Keep(Open& open) {
  const tap::TapAnalysis& analysis = open.tap.analysis;
  auto& answer = open.raw[service::kTapAnswer] = report::JsonOf(open.tap);
  answer["utc"] = UtcNow();
  answer["printer"] = options_.printer;
  answer["words"] = analysis.verdict == Verdict::kGood
                        ? report::WithInterval(analysis.contact_mm, report::kMillimetres)
                        : tap::Explain(analysis.reason);
  answer["curve"] = report::CurveJson(open.tap);
  const auto kept = files::AppendLine(
      options_.recording, open.raw.dump(-1, ' ', false, json::error_handler_t::replace));
  if (kept) return;
  ++unrecorded_;
  fmt::print(stderr, "trammel: the tap is not recorded: {}\n", kept.error().message);
}

void TapWatcher::PrintSummary() const {
  std::vector<tap::TapResult> results = ResultsOf(taps_);
  // Print time restarts with the printer; ours does not.
  for (std::size_t i = 0; i < results.size(); ++i) results[i].time_s = received_s_[i];
  fmt::print("\n{}", report::EnsembleText(tap::Summarise(results), taps_));
  if (!differences_mm_.empty()) {
    fmt::print("printer minus ours {}\n", DifferenceText(differences_mm_));
  }
  if (taps_.empty()) return;
  const std::string those =
      unrecorded_ > 0 ? fmt::format("{} of {} taps: ", taps_.size() - unrecorded_, taps_.size())
                      : "";
  fmt::print("recorded          {}{}\n", those, options_.recording.string());
  PrintWrapped("next",
               "trammel tap analyze " + ShellQuoted(options_.recording.string()) + " --advice");
}

}  // namespace trammel::app
