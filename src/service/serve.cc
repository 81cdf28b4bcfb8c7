#include "service/serve.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <thread>

#include "base/bug_note.h"
#include "base/url_secrets.h"
#include "machine/net/host_clock.h"
#include "service/job_process.h"
#include "session/crash_recovery.h"

namespace trammel::service {
namespace {

// End of the service of one printer.
struct Served {
  bool was_working = false;
  std::optional<Error> error = {};
};

// Logs the jobs' temperatures, and missing requirements, before the first request.
void PrintWhatIsOffered(const JobServerOptions& server) {
  for (const JobKind& kind : server.jobs) {
    const auto offer = kind.check(server.place, {}, nullptr);
    std::string words = "moves and heats nothing";
    if (!offer) {
      words = "not as things are: " + offer.error().message;
    } else if (!offer->question.empty()) {
      words = "asked for, it begins with: " + offer->question;
    }
    server.log(fmt::format("{} at {}: {}", kind.name, WithoutSecrets(server.address), words));
  }
}

// At start the printer's computer or its Moonraker may not be up yet.
Result<std::unique_ptr<machine::Printer>> ConnectPatiently(const ServedPrinter& served,
                                                           const std::stop_token& stop) {
  constexpr double kAgain_s = 5;
  std::string last;
  for (;;) {
    auto printer = served.connect(stop);
    if (printer || printer.error().kind != ErrorKind::kMachine) return printer;
    if (printer.error().message != last) {
      last = printer.error().message;
      served.server.log(fmt::format("trammel: {}; trying again every {:.0f} s", last, kAgain_s));
    }
    if (!procedure::Pause(kAgain_s, stop)) return Fail("stopped", ErrorKind::kInterrupted);
  }
}

Served ServeOne(const ServedPrinter& served, JobServer& server, const std::stop_token& stop) {
  constexpr double kAgain_s = 5;
  PrintWhatIsOffered(served.server);
  for (;;) {
    const auto printer = ConnectPatiently(served, stop);
    if (!printer) {
      if (printer.error().kind == ErrorKind::kInterrupted) return {};
      return {false, printer.error()};
    }
    // A restarted service restores the printer: its heaters need not wait for the printer's own
    // limit.
    const procedure::Session session{**printer, stop, [&](const procedure::Progress& progress) {
                                       served.server.log("  " + progress.text);
                                     }};
    procedure::FinishDeadRunsWhereFree(session, served.settings, served.server.state_folder);
    const auto done = server.Serve(**printer, stop);
    if (done) return {*done};
    if (done.error().kind == ErrorKind::kInterrupted) return {};
    // A lost link of ours, or an older service, may still have the names.
    served.server.log(
        fmt::format("trammel: {}; trying again in {:.0f} s", done.error().message, kAgain_s));
    if (!procedure::Pause(kAgain_s, stop)) return {};
  }
}

// Runs a command permanently, with growing pauses if it ends soon.
void Attend(const ServedPrinter& served, const Attendant& attendant, const std::stop_token& stop) {
  constexpr double kFirstPause_s = 5;
  constexpr double kLongestPause_s = 120;
  const JobServerOptions& server = served.server;
  double pause_s = kFirstPause_s;
  do {
    std::vector<std::string> words = {server.program};
    words.insert(words.end(), attendant.command.begin(), attendant.command.end());
    const std::vector<std::string> place = OptionText(server.place);
    words.insert(words.end(), place.begin(), place.end());
    words.push_back(fmt::format(
        "--out={}",
        (server.recordings / (attendant.name + "-" + CompactUtc(server.utc_now()) + ".jsonl"))
            .string()));
    JobProcess process;
    const std::stop_callback asked(stop, [&process] { process.Stop(); });
    const double begin_s = machine::HostNow();
    const JobEnd end = process.Run(
        words, [](const procedure::Progress&) {}, server.log);
    if (stop.stop_requested()) return;
    const bool lasted = machine::HostNow() - begin_s > kLongestPause_s;
    pause_s = lasted ? kFirstPause_s : std::min(2 * pause_s, kLongestPause_s);
    server.log(fmt::format(
        "trammel: {} ended ({}); again in {:.0f} s", attendant.name,
        end.errors.empty() ? fmt::format("exit code {}", end.exit_code) : end.errors.back(),
        pause_s));
  } while (procedure::Pause(pause_s, stop));
}

}  // namespace

Result<bool> Serve(const std::vector<ServedPrinter>& printers, const std::stop_token& stop,
                   const Beside& beside) {
  std::stop_source all;  // one printer that can never be served ends the service, visibly
  const std::stop_callback asked(stop, [&all] { all.request_stop(); });
  std::vector<Served> ended(printers.size());
  std::vector<std::unique_ptr<JobServer>> servers;
  for (const ServedPrinter& printer : printers) {
    JobServerOptions options = printer.server;
    options.bring_back = [&printer, token = all.get_token()](machine::Printer& of,
                                                             const auto& say) {
      const procedure::Session session{
          of, token, [&say](const procedure::Progress& progress) { say(progress.text); }};
      procedure::FinishDeadRunsWhereFree(session, printer.settings, printer.server.state_folder);
    };
    servers.push_back(std::make_unique<JobServer>(std::move(options)));
  }
  {
    std::vector<JobServer*> all_servers;
    for (const auto& server : servers) all_servers.push_back(server.get());
    std::vector<std::jthread> threads;
    if (beside) {
      threads.emplace_back([&] { (void)NoteBug([&] { beside(all_servers, all.get_token()); }); });
    }
    for (std::size_t i = 0; i < printers.size(); ++i) {
      threads.emplace_back([&, i] {
        const auto bug =
            NoteBug([&] { ended[i] = ServeOne(printers[i], *servers[i], all.get_token()); });
        if (bug || ended[i].error) all.request_stop();
      });
      for (const Attendant& attendant : printers[i].attendants) {
        threads.emplace_back(
            [&, i] { (void)NoteBug([&] { Attend(printers[i], attendant, all.get_token()); }); });
      }
    }
  }
  bool was_working = false;
  for (const Served& served : ended) {
    if (served.error) return tl::unexpected(*served.error);
    was_working = was_working || served.was_working;
  }
  return was_working;
}

}  // namespace trammel::service
