// The server of one printer: takes requests and its macros' calls, runs one job at a time, and
// tells everybody how it goes.
#pragma once

#include <condition_variable>
#include <deque>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "base/measured.h"
#include "base/result.h"
#include "machine/moonraker/printer.h"
#include "measurement/applied.h"
#include "service/job_kind.h"
#include "service/job_process.h"
#include "service/job_record.h"
#include "session/screen.h"

namespace trammel::service {

/// The number by which clients know the methods below; another one is another meaning.
inline constexpr int kApiVersion = 1;

/// Codes of refusals, beside JSON-RPC's own.
inline constexpr int kInvalidParameters = -32602;
inline constexpr int kBusy = -32001;     ///< a job is at work, or another program has the printer
inline constexpr int kNothing = -32002;  ///< no such run, or nothing of the kind that was asked for
inline constexpr int kRefused = -32003;  ///< it cannot be done; the message says why

struct JobServerOptions {
  PrinterPlace place;
  std::string address;               ///< of the printer, as its settings have it
  std::string program;               ///< path of trammel, which the jobs are commands of
  std::string version;               ///< "trammel 0.1.0"
  std::filesystem::path recordings;  ///< each run gets a folder of its own in here
  std::filesystem::path state_folder;
  std::vector<JobKind> jobs;
  std::function<std::string()> utc_now;  ///< ISO 8601 to the second, ending in Z
  /// Takes a line for the service's log; errors begin with "trammel: ". Of any thread.
  std::function<void(const std::string&)> log;
  /// Brings back what a job left that was killed, and says what. Of a run's own thread.
  std::function<void(machine::Printer&, const std::function<void(const std::string&)>&)>
      bring_back = {};
};

/// Answers the methods `status`, `start`, `stop`, `result`, `history`, `dismiss` and `new_nozzle`
/// (docs/howto/serve.md), and the macros of klipper/trammel.cfg. Runs survive nothing of the
/// service, but what they found does: an answer that nobody has decided on is offered again after a
/// restart.
class JobServer {
 public:
  explicit JobServer(JobServerOptions options);
  JobServer(const JobServer&) = delete;
  JobServer& operator=(const JobServer&) = delete;
  ~JobServer() = default;

  /// Answers a request, at once; of any thread, also while there is no printer.
  [[nodiscard]] machine::RpcAnswer Answer(const std::string& method, const nlohmann::json& params);

  /// Serves a printer until it is stopped; a run under way is then ended safely. May be
  /// called again, with another connection.
  /// Errors: kMachine, kInterrupted where the macros' methods cannot be registered.
  /// @returns whether a run was under way.
  [[nodiscard]] Result<bool> Serve(machine::Printer& printer, const std::stop_token& stop);

  [[nodiscard]] const JobServerOptions& options() const { return options_; }

 private:
  /// What is said on the screen, with buttons or without.
  struct Words {
    std::string text;
    std::optional<procedure::Buttons> buttons = {};
    std::string question = {};  ///< of the dialog, in place of the text
    Arguments start = {};       ///< the start button's
  };
  /// A macro's call.
  struct Call {
    enum class What { kAsk, kConfirm, kApply, kDismiss, kNewNozzle };
    What what = What::kAsk;
    const JobKind* job = nullptr;
    Arguments arguments = {};  ///< of kConfirm the token
  };
  /// What the dialog that is open asks, and its button begins.
  struct Offered {
    std::string token;
    const JobKind* job = nullptr;
    Arguments arguments = {};
    double until_s = 0;  ///< machine::HostNow
  };
  /// What a run is made of before it begins.
  struct Plan {
    std::string job;
    Arguments arguments;
    std::string folder = {};  ///< empty: a new one
    const JobKind* kind = nullptr;
    bool applies = false;
  };

  // job_server_methods.cc
  [[nodiscard]] machine::RpcAnswer Status() const;
  [[nodiscard]] machine::RpcAnswer StartAsked(const nlohmann::json& params);
  [[nodiscard]] machine::RpcAnswer StopAsked(const nlohmann::json& params);
  [[nodiscard]] machine::RpcAnswer ResultAsked(const nlohmann::json& params) const;
  [[nodiscard]] machine::RpcAnswer HistoryAsked(const nlohmann::json& params) const;
  [[nodiscard]] machine::RpcAnswer NewNozzleAsked();
  [[nodiscard]] nlohmann::json PrinterNow() const;
  [[nodiscard]] nlohmann::json ProposalNow() const;
  [[nodiscard]] std::string BlockerOf(const JobKind& kind) const;

  // job_server.cc
  [[nodiscard]] const JobKind* FindJob(const std::string& name) const;
  /// Begins a run. Errors: kMachine where one is under way; why the job cannot be started.
  [[nodiscard]] Result<RunRecord> Begin(Plan plan);
  [[nodiscard]] Result<Plan> PlanApply() const;
  [[nodiscard]] std::string WhoHasThePrinter() const;
  [[nodiscard]] std::string NewRunId(const std::string& job) const;
  void RunJob(const RunRecord& run, const Plan& plan, JobProcess& process);
  void Hear(const procedure::Progress& progress);
  void BringBackWhatItLeft();
  /// @param before  what was noted of the plan's result before the job
  void Conclude(const Plan& plan, const JobEnd& end, const std::vector<files::Application>& before);
  /// What the history notes of setting the result in a folder; empty: nothing, or no result.
  [[nodiscard]] std::vector<files::Application> NotedOf(const std::string& folder) const;
  void ConcludeResult(const Plan& plan, RunRecord run, const JobEnd& end);
  /// What the printer says is in force now, in words; empty where it is not told.
  [[nodiscard]] std::string InForce(const JobKind& kind) const;
  /// A good answer that nobody has decided on yet.
  struct Waiting {
    Proposal proposal;
    const JobKind* kind = nullptr;
    AnswerInWords answer;
  };
  /// The result itself decides whether there is one.
  [[nodiscard]] std::optional<Waiting> FindWaiting(std::optional<Proposal> proposal) const;
  [[nodiscard]] std::optional<Waiting> FindWaiting() const;
  [[nodiscard]] Words ProposalWords(const Waiting& waiting) const;
  void EndRun(RunRecord run, std::optional<Proposal> proposal, Words words);
  [[nodiscard]] bool Dismiss();
  /// Notes that the nozzle was changed, and drops the answer that waits: it was the old one's.
  /// Errors: kMachine while a job is at work; kInput: not written.
  [[nodiscard]] Result<std::string> NoteNewNozzle();
  void Keep() const;  // REQUIRES the lock
  void SendRunEvent(const RunRecord& run);
  void ShowPicture(const RunRecord& run);

  // job_server_dialogs.cc
  [[nodiscard]] Result<void> Register(const std::stop_token& stop);
  void Answer(const Call& call);
  void ApplyAsked();
  void AnswerConfirmed(const Call& call);
  /// Opens a dialog, or begins what needs none.
  void AnswerAsked(const Call& call);
  void BeginAsked(const JobKind& job, Arguments arguments);
  /// Whether the printer's macros are of this trammel; says what to do where they are not.
  [[nodiscard]] bool HasOurMacros();
  void OfferProposalAgain(const std::stop_token& stop);
  void Tell(Words words);  // written down now, shown by Serve's thread
  void Show(const Words& words, bool ending);
  void ShowAll(bool ending);

  const JobServerOptions options_;
  const std::filesystem::path state_path_;
  const std::filesystem::path lock_path_;

  mutable std::mutex mutex_;  // of what follows, but screen_
  std::condition_variable_any called_;
  std::deque<Call> calls_;
  std::deque<Words> words_;
  machine::Printer* printer_ = nullptr;  // while it is served
  std::optional<RunRecord> run_;         // the last one
  std::optional<Proposal> proposal_;
  std::shared_ptr<JobProcess> process_;      // of the run under way
  bool ending_ = false;                      // nothing more is begun
  std::stop_token stop_;                     // Serve's, of its thread
  std::optional<Offered> offered_;           // likewise
  int offers_ = 0;                           // likewise
  std::optional<procedure::Screen> screen_;  // of Serve's thread
  std::jthread worker_;                      // last: it uses everything above
};

/// What was given, and of what it leads to the rest.
[[nodiscard]] Arguments Completed(Arguments given, const Offer& offer);

}  // namespace trammel::service
