// Stands in for machine/net/child_process.cc: the work runs at once and in this process, where the
// sanitizers see it and no process has to be made for each input. Its limits are not set.
#include <sys/resource.h>

#include <deque>
#include <new>

#include "machine/net/child_process.h"

namespace {

std::deque<trammel::machine::ChildMessage> g_messages;

}  // namespace

// They would limit the fuzzer.
extern "C" int setrlimit(__rlimit_resource_t, const rlimit*) noexcept { return 0; }

namespace trammel::machine {

bool ChildSender::Send(std::uint32_t kind, std::span<const std::uint8_t> bytes) const {
  g_messages.push_back({kind, {bytes.begin(), bytes.end()}});
  return fd_ < 0;
}

bool ChildSender::Send(std::uint32_t kind, std::string_view text) const {
  return Send(kind, {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

Result<ChildProcess> ChildProcess::Start(const std::function<void(const ChildSender&)>& work,
                                         double patience_s) {
  constexpr int kNone = -1;
  g_messages.clear();
  try {
    work(ChildSender(kNone));
  } catch (const std::bad_alloc&) {
    // More than a child may take: it ends without having said all.
  }
  return ChildProcess(kNone, kNone, patience_s);
}

ChildProcess::ChildProcess(ChildProcess&& other) noexcept = default;
ChildProcess::~ChildProcess() = default;

Heard ChildProcess::Receive(ChildMessage& message, double, const std::stop_token&) {
  if (g_messages.empty()) return Heard::kEnded;
  message = std::move(g_messages.front());
  g_messages.pop_front();
  return Heard::kMessage;
}

void ChildProcess::LetEnd() {}
std::string ChildProcess::End() { return "it has not said all"; }

}  // namespace trammel::machine
