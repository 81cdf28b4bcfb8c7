// Dialogs of a server on the printer's own screen, and requests of the printer's macros.
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "base/url_secrets.h"
#include "machine/net/host_clock.h"
#include "service/job_server.h"
#include "service/macros.h"

namespace trammel::service {
namespace {

using nlohmann::json;

constexpr double kCommand_s = 30;
constexpr double kOfferLasts_s = 600;  // a bed that was empty may not be so an hour later
// Limit for a button pressed repeatedly; further calls repeat the same one.
constexpr std::size_t kMaxCalls = 8;
constexpr std::size_t kMaxWords = 100;  // while the printer cannot hear them
constexpr std::size_t kLongestArgument = 200;

constexpr const char* kToken = "token";

// Reads a macro's accepted arguments; omits empty texts.
Arguments ArgumentsOf(const json& called, const std::vector<std::string>& names) {
  Arguments arguments;
  if (!called.is_object()) return arguments;
  for (const std::string& name : names) {
    const auto found = called.find(name);
    if (found == called.end() || !found->is_string()) continue;
    const auto& text = found->get_ref<const std::string&>();
    if (!text.empty() && text.size() <= kLongestArgument) arguments[name] = text;
  }
  return arguments;
}

}  // namespace

Result<void> JobServer::Register(const std::stop_token& stop) {
  const auto add = [&](const std::string& method, Call::What what, const JobKind* job,
                       std::vector<std::string> names = {}) -> Result<void> {
    if (job != nullptr) names = job->arguments;
    return printer_->RegisterRemoteMethod(
        method,
        [this, what, job, names](const json& called) {
          const std::lock_guard lock(mutex_);
          if (calls_.size() < kMaxCalls) {
            calls_.push_back({what, job, ArgumentsOf(called, names)});
          }
          called_.notify_all();
        },
        {kCommand_s, stop});
  };
  for (const JobKind& job : options_.jobs) {
    TRY(add(job.method, Call::What::kAsk, &job));
  }
  TRY(add("trammel_start", Call::What::kConfirm, nullptr, {kToken}));
  TRY(add("trammel_apply", Call::What::kApply, nullptr));
  TRY(add("trammel_dismiss", Call::What::kDismiss, nullptr));
  return add("trammel_new_nozzle", Call::What::kNewNozzle, nullptr);
}

Result<bool> JobServer::Serve(machine::Printer& printer, const std::stop_token& stop) {
  {
    const std::lock_guard lock(mutex_);
    printer_ = &printer;
    ending_ = false;
  }
  screen_.emplace(printer);
  stop_ = stop;
  printer.OnRequest(
      [this](const std::string& method, const json& params) { return Answer(method, params); });
  auto registered = Register(stop);
  if (registered) {
    options_.log("serving " + WithoutSecrets(options_.address));  // a macro is heard from now on
    OfferProposalAgain(stop);
  }
  while (registered) {
    std::unique_lock lock(mutex_);
    called_.wait(lock, stop, [this] { return !calls_.empty() || !words_.empty(); });
    if (stop.stop_requested()) break;
    std::optional<Call> call;
    if (!calls_.empty()) {
      call = std::move(calls_.front());
      calls_.pop_front();
    }
    lock.unlock();
    ShowAll(/*ending=*/false);
    if (call) Answer(*call);
  }
  bool was_working = false;
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
    was_working = process_ != nullptr;
    if (process_) process_->Stop();
  }
  if (worker_.joinable()) worker_.join();
  ShowAll(/*ending=*/true);
  printer.OnRequest({});
  const std::unique_lock unused(using_printer_);
  const std::lock_guard lock(mutex_);
  printer_ = nullptr;
  if (!registered) return tl::unexpected(registered.error());
  return was_working;
}

void JobServer::Answer(const Call& call) {
  bool working = false;
  {
    const std::lock_guard lock(mutex_);
    working = process_ != nullptr;
  }
  if (call.what == Call::What::kNewNozzle) {
    const auto noted = NoteNewNozzle();
    return Show({noted ? *noted : "nozzle change not noted: " + noted.error().message}, false);
  }
  const bool about_answer = call.what == Call::What::kApply || call.what == Call::What::kDismiss;
  if (working) {
    return Show({about_answer ? "still calibrating: apply when there is an answer"
                              : "already at work: one calibration at a time"},
                false);
  }
  switch (call.what) {
    case Call::What::kAsk:
      return AnswerAsked(call);
    case Call::What::kConfirm:
      return AnswerConfirmed(call);
    case Call::What::kApply:
      return ApplyAsked();
    case Call::What::kNewNozzle:
      return;
    case Call::What::kDismiss:
      return Show({Dismiss() ? "nothing applied: the old value stays" : "nothing to drop"}, false);
  }
}

void JobServer::ApplyAsked() {
  auto plan = PlanApply();
  if (!plan) return Show({plan.error().message}, false);
  const auto begun = Begin(std::move(*plan));
  if (!begun) Show({"not applied: " + begun.error().message}, false);
}

void JobServer::BeginAsked(const JobKind& job, Arguments arguments) {
  const auto offer = job.check(options_.place, arguments, nullptr);
  const auto begun = offer ? Begin({job.name, Completed(std::move(arguments), *offer), {}, &job})
                           : tl::unexpected(offer.error());
  if (begun) return;
  options_.log("trammel: " + begun.error().message);
  Show({"no calibration: " + begun.error().message, procedure::Buttons::kClose}, false);
}

// A dialog remains on many screens, and reappears when a page is reloaded: only the last one opened
// starts a job, once, and only if no other run began since.
void JobServer::AnswerConfirmed(const Call& call) {
  const auto token = call.arguments.find(kToken);
  int begun = 0;
  {
    const std::lock_guard lock(mutex_);
    begun = begun_;
  }
  const bool open = offered_ && token != call.arguments.end() && token->second == offered_->token &&
                    machine::HostNow() < offered_->until_s && offered_->begun == begun;
  if (!open) {
    return Show({"that dialog is closed, and nothing was started: ask anew"}, false);
  }
  Offered offered = std::move(*offered_);
  offered_.reset();
  BeginAsked(*offered.job, std::move(offered.arguments));
}

bool JobServer::HasOurMacros() {
  const auto known = printer_->HasCommand(kLatestMacro, {kCommand_s, stop_});
  if (!known || *known) return true;  // a printer that does not tell shows what it can
  Show({fmt::format("no calibration: trammel.cfg on the printer is older than this trammel and has "
                    "no {}. Copy the one of this trammel (klipper/trammel.cfg) beside printer.cfg, "
                    "then FIRMWARE_RESTART",
                    kLatestMacro),
        procedure::Buttons::kClose},
       false);
  return false;
}

void JobServer::AnswerAsked(const Call& call) {
  const JobKind& job = *call.job;
  auto offer = job.check(options_.place, call.arguments, printer_);
  if (offer && offer->question.empty()) return BeginAsked(job, call.arguments);
  if (!HasOurMacros()) return;
  if (!offer) {
    options_.log("trammel: " + offer.error().message);
    return Show({"no calibration: " + offer.error().message, procedure::Buttons::kClose}, false);
  }
  // Unique between services, since names include the second of the service's start.
  const std::string token = fmt::format("{}-{}", CompactUtc(options_.utc_now()), ++offers_);
  {
    const std::lock_guard lock(mutex_);
    offered_ = Offered{token, &job, Completed(call.arguments, *offer),
                       machine::HostNow() + kOfferLasts_s, begun_};
  }
  Show({std::move(offer->question), job.start_buttons, {}, {{kToken, token}}}, false);
}

// Repeats a proposal that was not answered before the service ended.
void JobServer::OfferProposalAgain(const std::stop_token& stop) {
  constexpr double kPatience_s = 600;
  if (!FindWaiting()) return;
  // Klipper starts later than Moonraker. Until it is ready it calls no macro either.
  if (!printer_->WaitUntilReady({kPatience_s, stop})) return;
  if (const auto waiting = FindWaiting()) Announce(ProposalText(*waiting));
}

void JobServer::Announce(Announcement words) {
  options_.log("  " + words.text);
  if (words.text.starts_with(' ')) return;  // progress of a wait: for the log only
  const std::lock_guard lock(mutex_);
  if (words_.size() == kMaxWords) words_.pop_front();
  words_.push_back(std::move(words));
  called_.notify_all();
}

void JobServer::ShowAll(bool ending) {
  for (;;) {
    std::unique_lock lock(mutex_);
    if (words_.empty()) return;
    const Announcement words = std::move(words_.front());
    words_.pop_front();
    lock.unlock();
    Show(words, ending);
  }
}

void JobServer::Show(const Announcement& words, bool ending) {
  // Messages wait for the printer's current commands, for example homing; only briefly at the end
  // of the service, since the last message of a stopped calibration also matters.
  constexpr double kPatience_s = 300;
  constexpr double kLastPatience_s = 10;
  const machine::WaitLimit limit{ending ? kLastPatience_s : kPatience_s};
  bool waited = false;
  // The message of a run's end must wait: after an emergency stop nothing is visible until the
  // restart, and no macro runs until then.
  while (words.buttons && !ending && !stop_.stop_requested() &&
         printer_->LastState().readiness != machine::PrinterReadiness::kReady) {
    waited = true;
    if (printer_->WaitUntilReady({kPatience_s, stop_})) break;
  }
  // After a restart another value is in force.
  if (waited && words.buttons == procedure::Buttons::kUse) {
    const auto waiting = FindWaiting();
    return waiting ? Show(ProposalText(*waiting), ending) : void();
  }
  auto shown = screen_->Show(words.text, limit);
  if (shown && words.buttons)
    shown = screen_->Ask(words.question.empty() ? words.text : words.question, *words.buttons,
                         words.start, limit);
  if (!shown) {
    options_.log("trammel: not shown on the printer: " + shown.error().message);
  }
}

}  // namespace trammel::service
