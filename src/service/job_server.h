// Server of one printer: accepts requests and its macros' calls, runs one job at a time, and
// reports its progress to all clients.
#pragma once

#include <atomic>
#include <condition_variable>
#include <deque>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <shared_mutex>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "base/measured.h"
#include "base/result.h"
#include "machine/moonraker/printer.h"
#include "measurement/history.h"
#include "service/job_kind.h"
#include "service/job_process.h"
#include "service/job_record.h"
#include "session/screen.h"

namespace trammel::service {

/// API version; incremented when a method below changes its meaning.
inline constexpr int kApiVersion = 1;

/// Error codes of rejections, beside JSON-RPC's own.
inline constexpr int kInvalidParameters = -32602;
inline constexpr int kBusy = -32001;     ///< a job is at work, or another program has the printer
inline constexpr int kNothing = -32002;  ///< no such run, or nothing of the kind that was asked for
inline constexpr int kRefused = -32003;  ///< it cannot be done; the message says why

struct JobServerOptions {
  PrinterPlace place;
  std::string address;               ///< printer's address, as in its settings
  std::string program;               ///< path of trammel, which the jobs are commands of
  std::string version;               ///< "trammel 0.1.0"
  std::filesystem::path recordings;  ///< each run gets a folder of its own in here
  std::filesystem::path state_folder;
  std::vector<JobKind> jobs;
  std::function<std::string()> utc_now;  ///< ISO 8601 to the second, ending in Z
  /// Receives a line for the service's log; errors begin with "trammel: ". Called from any thread.
  std::function<void(const std::string&)> log;
  /// Restores settings after a killed job, and reports which. Called from a run's own thread.
  std::function<void(machine::Printer&, const std::function<void(const std::string&)>&)>
      bring_back = {};
  /// Shared by the servers of a process whose recordings are in one folder.
  std::shared_ptr<FoldersInUse> in_use = std::make_shared<FoldersInUse>();
  bool answers_taps = false;  ///< `trammel tap watch` runs beside it
};

/// Maximum number of scans that pages store on a printer a day.
inline constexpr int kMaxScansADay = 100;

/// Answers the methods in docs/howto/serve.md, and the macros of klipper/trammel.cfg. Runs end with
/// the service, but results survive: a pending answer is offered again after a restart.
class JobServer {
 public:
  explicit JobServer(JobServerOptions options);
  JobServer(const JobServer&) = delete;
  JobServer& operator=(const JobServer&) = delete;
  ~JobServer() = default;

  /// Answers a request, at once; thread-safe, also without a printer.
  [[nodiscard]] machine::RpcAnswer Answer(const std::string& method, const nlohmann::json& params);

  /// Serves a printer until stopped; a current run is then ended safely. May be called again, with
  /// another connection.
  /// Errors: kMachine, kInterrupted if the macros' methods cannot be registered.
  /// @returns true if a run was in progress.
  [[nodiscard]] Result<bool> Serve(machine::Printer& printer, const std::stop_token& stop);

  /// Stops motion and heaters at once, past everything that runs.
  [[nodiscard]] machine::RpcAnswer EmergencyStop();

  /// Answers `setup` (missing macros and sections, and the changes that would be made), `set_up`
  /// and `undo_set_up` (service/printer_setup.h). The last two restart the firmware: refused while
  /// anything runs or is hot. May take minutes; any thread but the connection's.
  [[nodiscard]] machine::RpcAnswer SetUp(const std::string& method, const std::stop_token& stop);

  /// Returns the history as CSV (ToCsv). Errors: ReadHistoryByPrinter's.
  [[nodiscard]] Result<std::string> Table() const;

  /// Answers `offer`: the question before a job of these arguments, by the printer's own state. Any
  /// thread but the connection's.
  [[nodiscard]] machine::RpcAnswer OfferAsked(const nlohmann::json& params);

  /// Stores a scan among the printer's files, where `offset_scan` finds it by its name. Any thread
  /// but the connection's. Errors: kMachine: not connected, not stored.
  /// @param ending  ".png" … @returns the name
  [[nodiscard]] Result<std::string> StoreScan(const std::string& ending, std::string_view bytes,
                                              const std::stop_token& stop);

  /// Queries the printer for its active extruder's nozzle, "0.40" mm; empty: not known within the
  /// limit. Any thread but the connection's.
  [[nodiscard]] std::string Nozzle(const machine::WaitLimit& limit);

  /// Receives "run", with the run, at each of its changes, and "changed" when the answer that waits
  /// may be another. Called from any thread, under a lock: it must not call the server.
  using EventCallback = std::function<void(const std::string& event, nlohmann::json data)>;
  void OnEvent(EventCallback callback);

  [[nodiscard]] const JobServerOptions& options() const { return options_; }
  /// Returns the printer's name in results (measurement::Subject).
  [[nodiscard]] std::string subject() const;

 private:
  /// Text on the screen, with or without buttons.
  struct Announcement {
    std::string text;
    std::optional<procedure::Buttons> buttons = {};
    std::string question = {};  ///< dialog's question, replaces the text
    Arguments start = {};       ///< the start button's
  };
  /// Call from a macro.
  struct Call {
    enum class What { kAsk, kConfirm, kApply, kDismiss, kNewNozzle };
    What what = What::kAsk;
    const JobKind* job = nullptr;
    Arguments arguments = {};  ///< kConfirm: the token
  };
  /// Question of the open dialog, and the job that its button starts.
  struct Offered {
    std::string token;
    const JobKind* job = nullptr;
    Arguments arguments = {};
    double until_s = 0;  ///< machine::HostNow
    int begun = 0;       ///< runs begun before: a later one may have left a print on the bed
  };
  /// Definition of a run before it begins.
  struct Plan {
    std::string job;
    Arguments arguments;
    std::string folder = {};  ///< empty: a new one
    const JobKind* kind = nullptr;
    bool applies = false;
    bool undoes = false;  ///< sets back what was set last; the answer that waits goes on waiting
  };

  // job_server_methods.cc
  [[nodiscard]] machine::RpcAnswer Status() const;
  [[nodiscard]] machine::RpcAnswer StartAsked(const nlohmann::json& params);
  [[nodiscard]] machine::RpcAnswer StopAsked(const nlohmann::json& params);
  [[nodiscard]] machine::RpcAnswer ResultAsked(const nlohmann::json& params) const;
  [[nodiscard]] machine::RpcAnswer NewNozzleAsked();
  [[nodiscard]] nlohmann::json PrinterNow() const;
  [[nodiscard]] nlohmann::json ProposalNow() const;
  [[nodiscard]] std::string BlockerOf(const JobKind& kind) const;
  [[nodiscard]] std::string RestartBlocker(const machine::PrinterState& state) const;
  [[nodiscard]] machine::RpcAnswer BeginAsRequested(Plan plan);
  /// Returns the connected printer; null: none. Valid while using_printer_ is held, and on a run's
  /// own thread.
  [[nodiscard]] machine::Printer* PrinterInUse() const;

  // job_server_results.cc
  [[nodiscard]] machine::RpcAnswer HistoryAsked(const nlohmann::json& params) const;
  [[nodiscard]] machine::RpcAnswer CompareAsked(const nlohmann::json& params) const;
  [[nodiscard]] machine::RpcAnswer DueAsked() const;
  [[nodiscard]] machine::RpcAnswer AnnotateAsked(const nlohmann::json& params) const;
  [[nodiscard]] machine::RpcAnswer DeleteAsked(const nlohmann::json& params) const;
  [[nodiscard]] machine::RpcAnswer UseAsked(const nlohmann::json& params);
  [[nodiscard]] std::string WhyNotUndone(measurement::Instrument instrument,
                                         const std::string& run) const;
  [[nodiscard]] machine::RpcAnswer UndoAsked(const nlohmann::json& params);
  [[nodiscard]] machine::RpcAnswer TapsAsked(const nlohmann::json& params) const;
  [[nodiscard]] machine::RpcAnswer TapAsked(const nlohmann::json& params) const;
  [[nodiscard]] Result<files::History> ReadResults(const files::HistoryQuery& query) const;

  // job_server.cc
  [[nodiscard]] const JobKind* FindJob(const std::string& name) const;
  /// Starts a run. Errors: kMachine if one is in progress; the reason why the job cannot be
  /// started.
  [[nodiscard]] Result<RunRecord> Begin(Plan plan);
  [[nodiscard]] Result<Plan> PlanApply() const;
  [[nodiscard]] std::string WhoHasThePrinter() const;
  [[nodiscard]] std::string NewRunId(const std::string& job) const;
  void RunJob(const RunRecord& run, const Plan& plan, JobProcess& process);
  void OnProgress(const procedure::Progress& progress);
  void BringBackWhatItLeft();
  /// @param before  what was noted of the plan's result before the job
  void Conclude(const Plan& plan, const JobEnd& end, const std::vector<files::Application>& before);
  /// Returns the history's notes on setting the result in a folder; empty: none, or no result.
  [[nodiscard]] std::vector<files::Application> NotedOf(const std::string& folder) const;
  void ConcludeResult(const Plan& plan, RunRecord run, const JobEnd& end);
  /// Returns the printer's value in force, in words; empty if it is not reported.
  [[nodiscard]] std::string InForce(const JobKind& kind) const;
  /// Good answer that is not yet accepted or dismissed.
  struct Waiting {
    Proposal proposal;
    const JobKind* kind = nullptr;
    AnswerSummary answer;
  };
  /// Finds the pending answer; the result file decides if there is one.
  [[nodiscard]] std::optional<Waiting> FindWaiting(std::optional<Proposal> proposal) const;
  [[nodiscard]] std::optional<Waiting> FindWaiting() const;
  [[nodiscard]] Announcement ProposalText(const Waiting& waiting) const;
  void EndRun(RunRecord run, std::optional<Proposal> proposal, Announcement words);
  [[nodiscard]] bool Dismiss();
  /// Records that the nozzle was changed, and drops the pending answer, which was the old one's.
  /// Errors: kMachine while a job runs; kInput: not written.
  [[nodiscard]] Result<std::string> NoteNewNozzle();
  void Keep() const;  // REQUIRES the lock
  void SendRunEvent(const RunRecord& run);
  void ShowPicture(const RunRecord& run);

  // job_server_dialogs.cc
  [[nodiscard]] Result<void> Register(const std::stop_token& stop);
  void Answer(const Call& call);
  void ApplyAsked();
  void AnswerConfirmed(const Call& call);
  /// Opens a dialog, or starts the job if it needs none.
  void AnswerAsked(const Call& call);
  void BeginAsked(const JobKind& job, Arguments arguments);
  /// True if the printer's macros are of this trammel; otherwise reports the remedy.
  [[nodiscard]] bool HasOurMacros();
  void OfferProposalAgain(const std::stop_token& stop);
  void Announce(Announcement words);  // written down now, shown by Serve's thread
  void Show(const Announcement& words, bool ending);
  void ShowAll(bool ending);

  const JobServerOptions options_;
  const std::filesystem::path state_path_;
  const std::filesystem::path lock_path_;

  std::mutex storing_;
  std::string stored_day_;  // of the scans
  int stored_ = 0;
  std::atomic<bool> stopping_ = false;  // an emergency stop is under way
  std::shared_mutex using_printer_;     // held while a thread besides Serve's calls the printer
  mutable std::mutex mutex_;            // guards the members below, but screen_
  EventCallback on_event_;
  std::condition_variable_any called_;
  std::deque<Call> calls_;
  std::deque<Announcement> words_;
  machine::Printer* printer_ = nullptr;  // while it is served
  std::optional<RunRecord> run_;         // the last one
  std::optional<Proposal> proposal_;
  std::shared_ptr<JobProcess> process_;      // current run
  FoldersInUse::Hold hold_;                  // on its folder
  bool ending_ = false;                      // nothing more is begun
  int begun_ = 0;                            // runs
  std::stop_token stop_;                     // Serve's, of its thread
  std::optional<Offered> offered_;           // likewise
  int offers_ = 0;                           // likewise
  std::optional<procedure::Screen> screen_;  // used by Serve's thread only
  std::jthread worker_;                      // last: it uses everything above
};

/// Returns the given arguments, completed by the offer's.
[[nodiscard]] Arguments Completed(Arguments given, const Offer& offer);

}  // namespace trammel::service
