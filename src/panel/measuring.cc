#include "panel/measuring.h"

#include <chrono>
#include <memory>
#include <string_view>

#include "base/utf8.h"
#include "machine/net/command_process.h"

namespace trammel::panel {

std::string MeasuringEnd::Why() const {
  std::string why;
  for (const std::string& error : errors) why += (why.empty() ? "" : "; ") + error;
  return why.empty() ? "it was not measured: " + end : why;
}

// More who wait would take the threads that answer.
Result<MeasuringQueue::Turn> MeasuringQueue::Wait() {
  constexpr int kMostWaiting = 2;
  constexpr std::chrono::seconds kWait(100);
  const std::shared_ptr<void> leaves(nullptr, [this](void*) { --waiting_; });
  const bool may_wait = ++waiting_ <= kMostWaiting;
  std::unique_lock lock(measuring_, std::defer_lock);
  if (may_wait ? lock.try_lock_for(kWait) : lock.try_lock()) return Turn(std::move(lock));
  return Fail("another picture is being measured: try again in some seconds", ErrorKind::kMachine);
}

Result<MeasuringEnd> RunMeasuring(const std::vector<std::string>& words,
                                  const std::function<void(const std::string&)>& log,
                                  const std::stop_token& stop) {
  constexpr double kPatience_s = 120;  // 48 MP take 6 s of one core
  constexpr double kRest_s = 5;
  constexpr std::size_t kMaxErrors = 3;
  constexpr std::size_t kMaxOutput = 16 << 20;
  const auto process = TRY(machine::CommandProcess::Start(words));
  MeasuringEnd measured;
  const auto end = process->Follow(
      [&](machine::OutputStream stream, std::string_view line) {
        if (stream == machine::OutputStream::kOutput) {
          if (measured.output.size() < kMaxOutput) measured.output.append(line) += '\n';
          return;
        }
        if (line.empty()) return;
        log("  " + Utf8OrReplaced(line));
        constexpr std::string_view kOurs = "trammel: ";
        if (line.starts_with(kOurs)) line.remove_prefix(kOurs.size());
        if (measured.errors.size() < kMaxErrors) measured.errors.emplace_back(line);
      },
      {stop, kPatience_s, kRest_s});
  measured.end = end.Describe();
  return measured;
}

}  // namespace trammel::panel
