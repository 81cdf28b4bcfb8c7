#include "machine/scanner/scanner.h"

#include <fmt/format.h>

#include <array>
#include <cstring>

#include "machine/module/module.h"
#include "machine/scanner/frame_assembler.h"
#include "machine/scanner/sane_scan.h"
#include "machine/scanner/scanner_module.h"

namespace trammel::machine {
namespace {

template <class T>
std::optional<T> ValueOf(const ChildMessage& message) {
  T value{};
  if (message.bytes.size() != sizeof value) return std::nullopt;
  std::memcpy(&value, message.bytes.data(), sizeof value);
  return value;
}

std::string TextOf(const ChildMessage& message) {
  return {message.bytes.begin(), message.bytes.end()};
}

std::optional<Error> ErrorOf(const ChildMessage& message) {
  if (message.kind != static_cast<std::uint32_t>(ScannerMessage::kError)) return std::nullopt;
  const std::string text = TextOf(message);
  const auto kind = static_cast<ErrorKind>(text.empty() ? '\0' : text[0]);
  return Error{kind, text.empty() ? text : text.substr(1)};
}

constexpr const char* kAnotherWay =
    "see whether scanimage -d NAME can do it, update the driver, or scan to a file with another "
    "program: analyze reads that";

struct Conversation {
  ChildProcess child;
  std::string about;  // whom: "the drivers", "scanner test:0"
  double silence_s = 0;

  // The next message, or why there is none.
  Result<ChildMessage> Next(const std::stop_token& stop) {
    ChildMessage message;
    switch (child.Receive(message, silence_s, stop)) {
      case Heard::kMessage:
        break;
      case Heard::kStopped:
        return Fail("stopped during the scan", ErrorKind::kInterrupted);
      case Heard::kSilence:
        return Fail(fmt::format("{} said nothing for {:g} s: switch it off and on, and try again; "
                                "otherwise {}",
                                about, silence_s, kAnotherWay),
                    ErrorKind::kMachine);
      case Heard::kEnded:
        return Fail(fmt::format("{}: its driver crashed ({}): {}", about, child.End(), kAnotherWay),
                    ErrorKind::kMachine);
    }
    if (const auto error = ErrorOf(message)) {
      child.LetEnd();
      return tl::unexpected(*error);
    }
    return message;
  }
};

ScannerInfo InfoOf(const ChildMessage& message) {
  std::array<std::string, 4> parts;
  std::size_t part = 0;
  for (const std::uint8_t byte : message.bytes) {
    if (byte == 0) {
      if (++part == parts.size()) break;
    } else {
      parts[part].push_back(static_cast<char>(byte));
    }
  }
  return {parts[0], parts[1], parts[2], parts[3]};
}

Result<void> BadMessage(const std::string& about, const ChildMessage& message) {
  return Fail(fmt::format("{}: its process said something that cannot be read ({}, {} bytes); "
                          "scan again",
                          about, message.kind, message.bytes.size()),
              ErrorKind::kMachine);
}

// What one message adds to the page. Its resolution is set by the last one.
Result<void> Take(const ChildMessage& message, Conversation& with, FrameAssembler& frames,
                  std::optional<double>& dpi) {
  switch (static_cast<ScannerMessage>(message.kind)) {
    case ScannerMessage::kChosen:
      with.about = fmt::format("scanner {}", TextOf(message));
      return {};
    case ScannerMessage::kFrame:
      if (const auto head = ValueOf<FrameHead>(message)) return frames.Begin(*head);
      break;
    case ScannerMessage::kSamples:
      return frames.Add(message.bytes);
    case ScannerMessage::kFrameEnd:
      return frames.End();
    case ScannerMessage::kDone:
      dpi = ValueOf<double>(message);
      if (dpi) return {};
      break;
    default:
      break;
  }
  return BadMessage(with.about, message);
}

}  // namespace

Result<std::vector<ScannerInfo>> ListScanners() {
  const auto module = LoadModule<ScannerModule>(kScannerModule);
  if (!module) return tl::unexpected(module.error());
  const ScanRequest usual;
  auto child = ChildProcess::Start((*module)->list, usual.rest_s);
  if (!child) return tl::unexpected(child.error());
  Conversation with{std::move(*child), "looking for scanners", usual.silence_s};
  std::vector<ScannerInfo> infos;
  for (;;) {
    const auto message = with.Next({});
    if (!message) return tl::unexpected(message.error());
    if (message->kind != static_cast<std::uint32_t>(ScannerMessage::kScanner)) break;
    infos.push_back(InfoOf(*message));
  }
  with.child.LetEnd();
  return infos;
}

Result<Page> ScanPage(const ScanRequest& request, const PageReadOptions& limits,
                      const std::function<void(double)>& progress, const std::stop_token& stop) {
  const auto module = LoadModule<ScannerModule>(kScannerModule);
  if (!module) return tl::unexpected(module.error());
  auto child = ChildProcess::Start(
      [&](const ChildSender& sender) { (*module)->scan(request, sender); }, request.rest_s);
  if (!child) return tl::unexpected(child.error());
  Conversation with{std::move(*child), "looking for scanners", request.silence_s};
  FrameAssembler frames(limits);
  std::optional<double> dpi;
  while (!dpi) {
    const auto message = with.Next(stop);
    if (!message) return tl::unexpected(message.error());
    if (auto taken = Take(*message, with, frames, dpi); !taken) {
      return tl::unexpected(taken.error());
    }
    if (progress) frames.Tell(progress);
  }
  with.child.LetEnd();
  auto page = frames.Finish();
  if (page) page->dpi_x = page->dpi_y = *dpi;
  return page;
}

}  // namespace trammel::machine
