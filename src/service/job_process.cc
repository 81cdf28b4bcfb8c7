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
constexpr std::size_t kMostLines = 50;
constexpr std::size_t kLongestLine = 1024;
constexpr int kInterrupted = 130;  // CONVENTIONS.md

void Add(std::string line, std::vector<std::string>& lines) {
  if (lines.size() == kMostLines) lines.erase(lines.begin());
  lines.push_back(std::move(line));
}

}  // namespace

JobEnd JobProcess::Run(const std::vector<std::string>& words, const Tell& tell, const Log& log) {
  JobEnd end;
  // An update that failed halfway takes the program away, and the service goes on without it.
  if (access(words.front().c_str(), X_OK) != 0) {
    end.errors = {fmt::format("{} is gone or cannot be run: unpack trammel's archive there anew",
                              words.front())};
    log("trammel: " + end.errors.front());
    return end;
  }
  auto process = machine::CommandProcess::Start(words);
  if (!process) {
    end.errors = {process.error().message};
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
          Add(std::move(text), end.output);
        } else if (text.starts_with(kErrorBegins)) {
          Add(text.substr(kErrorBegins.size()), end.errors);
        }
      });
  {
    const std::lock_guard lock(mutex_);
    process_ = nullptr;
  }
  end.exit_code = ended.exit_code;
  end.stopped = ended.exit_code == kInterrupted;
  end.killed = ended.signal != 0;
  if (end.killed) end.errors.push_back(fmt::format("its process ended by {}", ended.Words()));
  return end;
}

void JobProcess::Stop() {
  const std::lock_guard lock(mutex_);
  stopped_ = true;
  if (process_ != nullptr) process_->AskToEnd();
}

}  // namespace trammel::service
