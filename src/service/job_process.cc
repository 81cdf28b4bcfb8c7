#include "service/job_process.h"

#include <fmt/format.h>
#include <unistd.h>

#include <string_view>
#include <utility>

#include "base/utf8.h"
#include "session/progress_line.h"

namespace trammel::service {
namespace {

constexpr std::string_view kErrorBegins = "trammel: ";
constexpr std::string_view kUnrestored = "NOT AS IT WAS";  // as a procedure's command says it
constexpr std::size_t kMostLines = 50;
constexpr std::size_t kLongestLine = 1024;
constexpr int kInterrupted = 130;  // CONVENTIONS.md

}  // namespace

JobEnd JobProcess::Run(const std::vector<std::string>& words, const Tell& tell, const Log& log) {
  JobEnd end;
  // An update that failed halfway takes the program away, and the service goes on without it.
  if (access(words.front().c_str(), X_OK) != 0) {
    end.error = fmt::format("{} is gone or cannot be run: unpack trammel's archive there anew",
                            words.front());
    log("trammel: " + end.error);
    return end;
  }
  auto process = machine::CommandProcess::Start(words);
  if (!process) {
    end.error = process.error().message;
    return end;
  }
  {
    const std::lock_guard lock(mutex_);
    process_ = process->get();
    if (stopped_) process_->AskToEnd();
  }
  const machine::CommandEnd ended =
      (*process)->Follow([&](machine::OutputStream stream, std::string_view line) {
        const bool answer = stream == machine::OutputStream::kOutput;
        if (const auto progress = answer ? std::nullopt : procedure::ParseProgressLine(line)) {
          return tell(*progress);
        }
        std::string text = Utf8OrReplaced(line, kLongestLine);
        log(text);
        if (answer) {
          if (end.output.size() == kMostLines) end.output.erase(end.output.begin());
          end.output.push_back(std::move(text));
        } else if (text.starts_with(kErrorBegins)) {
          end.error = text.substr(kErrorBegins.size());
          if (end.error.starts_with(kUnrestored)) end.unrestored.push_back(end.error);
        }
      });
  {
    const std::lock_guard lock(mutex_);
    process_ = nullptr;
  }
  end.exit_code = ended.exit_code;
  end.stopped = ended.exit_code == kInterrupted;
  end.killed = ended.signal != 0;
  if (end.killed) end.error = fmt::format("its process ended by {}", ended.Words());
  return end;
}

void JobProcess::Stop() {
  const std::lock_guard lock(mutex_);
  stopped_ = true;
  if (process_ != nullptr) process_->AskToEnd();
}

}  // namespace trammel::service
