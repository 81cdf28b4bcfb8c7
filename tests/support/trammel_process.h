// The trammel that was built, as a process of its own that a test can interrupt and kill.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <ostream>
#include <string>
#include <vector>

#include "support/run_trammel.h"
#include "support/temporary_folder.h"

namespace trammel::test {

/// Patience with whatever comes for certain, in seconds: only a failure waits that long. Beyond the
/// two minutes for which trammel waits for a lost printer, and four times what the longest wait
/// took on two cores with sixteen tests at once; below the limit of a test.
inline constexpr double kEnough_s = 240;

struct ProcessLimits {
  std::uint64_t file_bytes = 0;  ///< largest file that it may write, as on a full disk; 0: any
  std::uint64_t open_files = 0;  ///< most files, sockets and pipes open at once; 0: any
  bool nobody_reads = false;     ///< both streams go into a pipe whose reader has gone
  bool terminal = false;         ///< standard input and standard error are a terminal of its own
};

struct ProcessEnd : CommandResult {
  int signal = 0;          ///< that ended it; 0: none
  bool timed_out = false;  ///< it had to be killed
  double elapsed_s = 0;
  double cpu_s = 0;           ///< all threads, user and system
  double peak_memory_mb = 0;  ///< resident; 10^6 bytes
};
/// Prints a run for GoogleTest.
inline void PrintTo(const ProcessEnd& end, std::ostream* out) {
  *out << "signal " << end.signal << ", ";
  PrintTo(static_cast<const CommandResult&>(end), out);
}

/// Starts at once, with an empty standard input unless it has a terminal; dies with its object at
/// the latest.
class TrammelProcess {
 public:
  /// @param arguments  Without a shell: one word each; with "sim" in front those of trammel-sim.
  /// @param folder     Its current folder; must exist. Its state folder is folder/state.
  TrammelProcess(const std::vector<std::string>& arguments, const std::filesystem::path& folder,
                 const ProcessLimits& limits = {});
  /// @param arguments  As typed: split at blanks outside of single quotes.
  TrammelProcess(const std::string& arguments, const std::filesystem::path& folder);
  ~TrammelProcess();
  TrammelProcess(const TrammelProcess&) = delete;
  TrammelProcess& operator=(const TrammelProcess&) = delete;

  void Send(int signal) const;
  /// Types a line at its terminal.
  void Type(const std::string& line) const;
  /// Closes its terminal, as a lost SSH does.
  void HangUp();
  /// Sets one of its limits (RLIMIT_...) while it runs. Throws std::runtime_error where it cannot.
  void Limit(int resource, std::uint64_t value) const;
  /// Looks; also keeps count of its memory, so ask often.
  [[nodiscard]] bool Running();
  [[nodiscard]] std::string StandardErrorSoFar() const;
  /// Returns what follows `label` in the first whole line of its standard output that begins with
  /// it; empty where it ends, or kEnough_s pass, without such a line.
  [[nodiscard]] std::string WaitForLine(const std::string& label);
  /// Returns the peak at the last check.
  [[nodiscard]] double PeakMemorySoFar_mb() const { return end_.peak_memory_mb; }
  /// Waits for its end, kills it where that does not come in time.
  [[nodiscard]] ProcessEnd Wait(double time_limit_s = kEnough_s);

 private:
  void LookAtMemory();
  /// Takes what the terminal shows.
  void TakeTerminal() const;

  int terminal_ = -1;  ///< the test's end of it
  TemporaryFolder aside_;
  pid_t pid_ = -1;
  bool ended_ = false;
  double began_s_ = 0;
  ProcessEnd end_;
};

}  // namespace trammel::test
